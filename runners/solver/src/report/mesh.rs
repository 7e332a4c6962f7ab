//! The means over the cells of a scene, in the report of its global estimate.

use fredholm_model::MeshCell;
use fredholm_model::heat::{Carried, Element, RadiativeExchange};

use super::GoalReport;
use super::whole::estimate;
use crate::{GlobalEstimate, GlobalValue, Goal, Region};

/// Surfaces of which a cell is asked for: all of its surface has one material, of which one element tells as much as all.
struct OfCell<'a> {
    surfaces: &'a dyn RadiativeExchange,
    element: Option<Element>,
}

impl RadiativeExchange for OfCell<'_> {
    fn carried(&self) -> Carried {
        self.surfaces.carried()
    }

    fn is_closed(&self) -> bool {
        self.surfaces.is_closed()
    }

    fn is_in_air(&self, _: &Region) -> bool {
        false
    }

    fn elements(&self, _: &Region) -> Vec<Element> {
        self.element.into_iter().collect()
    }

    fn flux_names(&self) -> &[String] {
        self.surfaces.flux_names()
    }
}

impl GlobalEstimate<'_> {
    /// What is told of every cell, by the name of its surface and its number there.
    pub(super) fn mesh_report(&self) -> Vec<GoalReport> {
        let model = self.model();
        let surfaces = model.exchange();
        let parts = self.mesh().iter().map(|cell| cell.part + 1).max();
        let mut numbers = vec![0_usize; parts.unwrap_or(0)];
        let element = |part| surfaces?.elements(&Region::Part(part)).first().copied();
        let elements: Vec<Option<Element>> = (0..numbers.len()).map(element).collect();
        let mut told = |(cell, value): (&MeshCell, GlobalValue)| {
            let number = numbers[cell.part];
            numbers[cell.part] += 1;
            let name = model.part(cell.part).unwrap_or_default();
            let goal = Goal::new(format!("{name}[{number}]"), Region::Part(cell.part));
            let mut report = GoalReport::of_whole(self, &goal, None, &value);
            if let Some(surfaces) = surfaces {
                let element = elements[cell.part];
                let own = OfCell { surfaces, element };
                let heat = own.heat_of(&goal.region, estimate(&value), None);
                report.add(&heat, model, 1);
            }
            GoalReport {
                position: Some(cell.middle().to_vec()),
                corners: cell.corners.clone(),
                ..report
            }
        };
        let (cells, values) = (self.mesh(), self.mesh_values());
        cells.iter().zip(values).map(&mut told).collect()
    }
}
