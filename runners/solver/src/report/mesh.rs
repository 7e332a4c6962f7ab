//! The means over the cells of a scene, in the report of its global estimate.

use fredholm_model::MeshCell;

use super::GoalReport;
use super::whole::estimate;
use crate::{GlobalEstimate, GlobalValue, Goal, Region};

impl GlobalEstimate<'_> {
    /// What is told of every cell, by the name of its surface and its number there.
    pub(super) fn mesh_report(&self) -> Vec<GoalReport> {
        let model = self.model();
        let mut numbers: Vec<usize> = Vec::new();
        let mut told = |(cell, value): (&MeshCell, GlobalValue)| {
            if numbers.len() <= cell.part {
                numbers.resize(cell.part + 1, 0);
            }
            let number = numbers[cell.part];
            numbers[cell.part] += 1;
            let name = model.part(cell.part).unwrap_or_default();
            let goal = Goal::new(format!("{name}[{number}]"), Region::Part(cell.part));
            let mut report = GoalReport::of_whole(self, &goal, None, &value);
            if let Some(surfaces) = model.exchange() {
                let heat = surfaces.heat_of(&goal.region, estimate(&value), None);
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
