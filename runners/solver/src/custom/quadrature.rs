//! Where the variances of an equation are predicted: parts of its cells.

use fredholm_core::galerkin::{Cells, TransitionMoments};
use fredholm_core::{Located, Space};
use fredholm_variance::{Quadrature, Step};

use super::CustomEquation;
use super::cells::{MOST_DIMENSIONS, Nodes};
use crate::Error;

/// Equal parts of the cells of an equation as sites. Points may carry what the equation knew, so that they are its own.
pub(super) struct Sites<E: CustomEquation> {
    equation: E,
    /// Parts of a cell along every axis.
    parts: usize,
    nodes: Nodes<E::Point>,
}

impl<E: CustomEquation> Sites<E> {
    /// Sites that are so many parts of every cell along each axis, with as many points an axis of each.
    pub(super) fn new(equation: E, parts: usize, points: usize) -> Result<Self, Error> {
        Ok(Self {
            nodes: Nodes::of_parts(&equation, parts, points)?,
            equation,
            parts,
        })
    }

    /// The parts of a cell.
    const fn boxes(&self) -> usize {
        self.parts.pow(E::DIMENSION as u32)
    }

    /// A point in the site.
    pub(super) fn inside(&self, site: usize) -> E::Point {
        let mut part = site % self.boxes();
        let middle = [(); MOST_DIMENSIONS].map(|()| {
            let first = part % self.parts;
            part /= self.parts;
            (first as f64 + 0.5) / self.parts as f64
        });
        self.equation
            .point(site / self.boxes(), &middle[..E::DIMENSION])
    }

    fn located(&self, x: &E::Point) -> Located<E::Point> {
        Located {
            point: *x,
            cell: Cells::locate(&self.equation, x),
        }
    }
}

impl<E: CustomEquation> Space for Sites<E> {
    type Scalar = f64;
    type Point = E::Point;
}

impl<E: CustomEquation<Scalar = f64>> Quadrature for Sites<E> {
    fn sites(&self) -> usize {
        self.nodes.cells()
    }

    fn locate(&self, x: &E::Point) -> usize {
        let x = self.located(x);
        let mut t = [0.0; MOST_DIMENSIONS];
        let t = &mut t[..E::DIMENSION];
        self.equation.parameters(&x, t);
        let place = |part: usize, t: &f64| {
            part * self.parts + ((t * self.parts as f64) as usize).min(self.parts - 1)
        };
        x.cell * self.boxes() + t.iter().rev().fold(0, place)
    }

    fn nodes(&self, site: usize, mut visit: impl FnMut(E::Point, f64)) {
        self.nodes
            .weighted(site)
            .for_each(|(x, weight)| visit(x, weight));
    }

    fn steps(&self, x: &E::Point, site: usize, mut visit: impl FnMut(Step<E::Point>)) {
        let (from, boxes) = (self.located(x), self.boxes());
        let weight = |(y, weight): (E::Point, f64)| weight * self.equation.density(x, &y);
        let cell = site / boxes;
        // Quadrature of p is off by little, and by most where it has a kink: in the cell of x. The mass of a cell is exact.
        let mut scale = 1.0;
        if boxes == 1 || cell == from.cell {
            let [[mass]] = TransitionMoments::<1>::moments(&self.equation, &from, cell);
            let sites = cell * boxes..(cell + 1) * boxes;
            let all = sites.flat_map(|site| self.nodes.weighted(site));
            let sum: f64 = all.map(weight).sum();
            // Where it finds nothing, nothing is to be found.
            scale = if sum > 0.0 { mass / sum } else { 0.0 };
        }
        for (node, (point, own)) in self.nodes.weighted(site).enumerate() {
            visit(Step {
                point,
                weight: scale * weight((point, own)),
                node: Some(node),
            });
        }
    }
}
