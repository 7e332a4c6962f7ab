//! Where the variances of an equation are predicted: cells of the equation itself, as many as it takes.

use fredholm_core::galerkin::{Partition, TransitionMoments};
use fredholm_core::{Located, StateSpace};
use fredholm_variance::{Quadrature, Step};

use super::CustomEquation;
use super::cells::Nodes;
use crate::Error;

/// The cells of an equation as sites.
pub(super) struct Sites<E: CustomEquation> {
    sites: E,
    nodes: Nodes<E::Point>,
}

impl<E: CustomEquation> Sites<E> {
    /// The cells of this equation, with as many points an axis of each.
    pub(super) fn new(sites: E, points: usize) -> Result<Self, Error> {
        Ok(Self {
            nodes: Nodes::new(&sites, points)?,
            sites,
        })
    }

    /// A point in the site.
    pub(super) fn inside(&self, site: usize) -> E::Point {
        self.sites
            .point(site, &[0.5; super::cells::MOST_DIMENSIONS][..E::DIMENSION])
    }
}

impl<E: CustomEquation> StateSpace for Sites<E> {
    type Scalar = f64;
    type Point = E::Point;
}

impl<E: CustomEquation<Scalar = f64>> Quadrature for Sites<E> {
    fn sites(&self) -> usize {
        self.nodes.cells()
    }

    fn locate(&self, x: &E::Point) -> usize {
        Partition::locate(&self.sites, x)
    }

    fn nodes(&self, site: usize, mut visit: impl FnMut(E::Point, f64)) {
        self.nodes
            .weighted(site)
            .for_each(|(x, weight)| visit(x, weight));
    }

    fn steps(&self, x: &E::Point, site: usize, mut visit: impl FnMut(Step<E::Point>)) {
        let from = Located {
            point: *x,
            cell: Partition::locate(&self.sites, x),
        };
        let [[mass]] = TransitionMoments::<1>::moments(&self.sites, &from, site);
        let weight = |(y, weight): (E::Point, f64)| weight * self.sites.density(x, &y);
        let sum: f64 = self.nodes.weighted(site).map(weight).sum();
        // Quadrature of p is off by little; where it finds nothing, nothing is to be found.
        let scale = if sum > 0.0 { mass / sum } else { 0.0 };
        for (node, (point, own)) in self.nodes.weighted(site).enumerate() {
            visit(Step {
                point,
                weight: scale * weight((point, own)),
                node: Some(node),
            });
        }
    }
}
