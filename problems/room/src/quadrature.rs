//! Quadrature on walls, to predict variances with.

use alloc::vec::Vec;

use fredholm_core::galerkin::{Cells, GalerkinError, reserve};
use fredholm_core::{Located, Space};
use fredholm_variance::{Quadrature, Step, gauss};

use crate::pairs::Visibility;
use crate::{Point, Room};

/// Sites that are cells, parts of them where there are few, or groups of neighbouring cells of a wall where there are
/// many, of which the one in the middle stands for the others.
///
/// Steps into a cell that is wholly seen go to its nodes, in proportion to the density, and in sum with the exact mass; into
/// one that is seen in part to its middle, with the exact mass of what is seen.
#[derive(Clone, Debug)]
pub struct RoomQuadrature<'r, 'a> {
    room: &'r Room<'a, f64>,
    /// Sites of a cell.
    parts: usize,
    /// The first cell of every site, the cell that stands for it, and the length of its cells over that of this one.
    groups: Vec<(usize, usize, f64)>,
    /// The rule of a site: places in [−1, 1], and weights that sum to 2.
    rule: Vec<(f64, f64)>,
    /// Point and weight.
    nodes: Vec<(Point<f64>, f64)>,
}

impl<'r, 'a> RoomQuadrature<'r, 'a> {
    /// The quadrature with about `nodes` nodes at most, for a neighbour equation of this degree.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn new(
        room: &'r Room<'a, f64>,
        nodes: usize,
        degree: usize,
    ) -> Result<Self, GalerkinError> {
        let sites = nodes / (degree + 2);
        let cells = room.partition();
        let n = cells.len().max(1);
        let (parts, group) = ((sites / n).max(1), n.div_ceil(sites.max(1)));
        let mut groups: Vec<(usize, usize, f64)> = reserve(n)?;
        for wall in 0..room.geometry().walls().len() {
            let range = cells.range(wall as u32);
            let mut from = range.start;
            while from < range.end {
                let to = (from + group).min(range.end);
                let middle = (from + to) / 2;
                let length: f64 = (from..to).map(|cell| cells.length(cell)).sum();
                groups.push((from, middle, length / cells.length(middle)));
                from = to;
            }
        }
        let rule = gauss(degree + 2)?;
        let mut quadrature = Self {
            room,
            parts,
            groups,
            rule,
            nodes: Vec::new(),
        };
        let mut nodes = reserve(quadrature.sites().saturating_mul(quadrature.rule.len()))?;
        for site in 0..quadrature.sites() {
            let Some(&(_, cell, scale)) = quadrature.groups.get(site / parts) else {
                continue;
            };
            let length = scale * cells.length(cell) / parts as f64;
            for &(t, weight) in &quadrature.rule {
                let place = ((site % parts) as f64 + 0.5 * (1.0 + t)) / parts as f64;
                if let Some(point) = room.inside(cell, place) {
                    nodes.push((point, length * 0.5 * weight));
                }
            }
        }
        quadrature.nodes = nodes;
        Ok(quadrature)
    }

    fn of_site(&self, site: usize) -> &[(Point<f64>, f64)] {
        let points = self.rule.len();
        self.nodes
            .get(site * points..(site + 1) * points)
            .unwrap_or(&[])
    }
}

impl Space for RoomQuadrature<'_, '_> {
    type Scalar = f64;
    type Point = Point<f64>;
}

impl Quadrature for RoomQuadrature<'_, '_> {
    fn sites(&self) -> usize {
        self.groups.len() * self.parts
    }

    fn locate(&self, x: &Point<f64>) -> usize {
        let cell = self.room.locate(x);
        let group = self
            .groups
            .partition_point(|&(first, ..)| first <= cell)
            .saturating_sub(1);
        if self.parts == 1 {
            return group;
        }
        let mut place = [0.0];
        self.room
            .parameters(&Located { point: *x, cell }, &mut place);
        group * self.parts + ((place[0] * self.parts as f64) as usize).min(self.parts - 1)
    }

    fn nodes(&self, site: usize, mut visit: impl FnMut(Point<f64>, f64)) {
        for &(point, weight) in self.of_site(site) {
            visit(point, weight);
        }
    }

    fn steps(&self, x: &Point<f64>, site: usize, mut visit: impl FnMut(Step<Point<f64>>)) {
        let Some(&(_, cell, scale)) = self.groups.get(site / self.parts) else {
            return;
        };
        let nodes = self.of_site(site);
        match self.room.views().visibility(self.room.locate(x), cell) {
            Visibility::None => {}
            Visibility::Partial => {
                let mass = scale * self.room.form_factor(x, cell) / self.parts as f64;
                let middle = nodes.get(nodes.len() / 2);
                if let Some(&(point, _)) = middle.filter(|_| mass > 0.0) {
                    visit(Step {
                        point,
                        weight: mass,
                        node: None,
                    });
                }
            }
            Visibility::Full | Visibility::FullBounded => {
                let weights = nodes
                    .iter()
                    .map(|(y, weight)| weight * self.room.facing(x, y));
                let sum: f64 = weights.clone().sum();
                // Of a part of a cell the mass is that of the rule.
                let share = if self.parts == 1 && sum > 0.0 {
                    scale * self.room.form_factor(x, cell) / sum
                } else {
                    1.0
                };
                for (node, (&(point, _), weight)) in nodes.iter().zip(weights).enumerate() {
                    visit(Step {
                        point,
                        weight: share * weight,
                        node: Some(node),
                    });
                }
            }
        }
    }
}
