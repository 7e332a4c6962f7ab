//! A model from an equation, its neighbour and a quadrature: all that knows points.

use alloc::vec::Vec;
use core::fmt;
use core::ops::Range;

use fredholm_core::galerkin::{PairKind, Pairs, buffer, reserve};
use fredholm_core::{Absorption, Equation, Located, NeighbourOf, NoDraws};

use crate::survival::Survival;
use crate::{
    Density, Origin, Position, Quadrature, Start, Transition, Values, VarianceError, VarianceModel,
    Wanted,
};

/// What a predicted variance depends on: an equation, its neighbour equation, and the quadrature.
pub struct VarianceSetup<'a, E, N: ?Sized, S, L: Quadrature> {
    /// The equation with its chain.
    pub equation: &'a E,
    /// The neighbour equation.
    pub neighbour: &'a N,
    /// The pairs of the neighbour equation, to tell what is in S.
    pub pairs: S,
    /// The sites.
    pub quadrature: &'a L,
    /// How walks end.
    pub absorption: Absorption,
}

impl<E, N: ?Sized, S: Copy, L: Quadrature> Copy for VarianceSetup<'_, E, N, S, L> {}

impl<E, N: ?Sized, S: Copy, L: Quadrature> Clone for VarianceSetup<'_, E, N, S, L> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<'a, E, N, S, L> VarianceSetup<'a, E, N, S, L>
where
    E: Equation<Scalar = f64, Point = L::Point, Value = f64>,
    N: NeighbourOf<E> + ?Sized,
    L: Quadrature,
{
    /// A model of walks with these starts: numbers their points and those of all sites.
    ///
    /// # Errors
    /// [`VarianceError::Galerkin`]: no memory.
    pub fn with_starts(
        self,
        starts: &'a [Start<'a, L::Point>],
    ) -> Result<PointModel<'a, E, N, S, L>, VarianceError> {
        let sites = self.quadrature.sites();
        let mut first: Vec<usize> = buffer(sites.saturating_add(1))?;
        let mut count = 0_usize;
        for (site, first) in first.iter_mut().enumerate() {
            *first = count;
            if site < sites {
                self.quadrature.nodes(site, |_, _| count += 1);
            }
        }
        let mut points = reserve(count.saturating_add(starts.len()))?;
        for site in 0..sites {
            self.quadrature.nodes(site, |x, weight| {
                points.push((self.neighbour.locate(x), weight));
            });
        }
        for start in starts {
            if let Start::At(x) = start {
                points.push((self.neighbour.locate(*x), 1.0));
            }
        }
        Ok(PointModel {
            setup: self,
            first,
            points,
            starts,
        })
    }
}

impl<E, N: ?Sized, S: fmt::Debug, L: Quadrature> fmt::Debug for VarianceSetup<'_, E, N, S, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("VarianceSetup")
            .field("pairs", &self.pairs)
            .field("sites", &self.quadrature.sites())
            .finish_non_exhaustive()
    }
}

/// The model of a [`VarianceSetup`]: all its points have numbers.
pub struct PointModel<'a, E, N: ?Sized, S, L: Quadrature> {
    setup: VarianceSetup<'a, E, N, S, L>,
    /// The number of the first node of every site, and of the first start.
    first: Vec<usize>,
    /// Nodes and starts in one point, with their weights.
    points: Vec<(Located<L::Point>, f64)>,
    starts: &'a [Start<'a, L::Point>],
}

impl<E, N, S, L> PointModel<'_, E, N, S, L>
where
    E: Equation<Scalar = f64, Point = L::Point, Value = f64>,
    N: NeighbourOf<E> + ?Sized,
    L: Quadrature,
{
    fn survival(&self) -> Survival<'_, E> {
        let setup = &self.setup;
        Survival::new(setup.equation, setup.neighbour, setup.absorption)
    }

    fn point(&self, number: usize) -> Option<&Located<L::Point>> {
        self.points.get(number).map(|(x, _)| x)
    }
}

impl<E, N: ?Sized, S: fmt::Debug, L: Quadrature> fmt::Debug for PointModel<'_, E, N, S, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PointModel")
            .field("setup", &self.setup)
            .field("points", &self.points.len())
            .field("starts", &self.starts)
            .finish_non_exhaustive()
    }
}

impl<E, N, S, L> VarianceModel for PointModel<'_, E, N, S, L>
where
    E: Equation<Scalar = f64, Point = L::Point, Value = f64> + Sync,
    N: NeighbourOf<E> + Sync + ?Sized,
    S: Pairs + Sync,
    L: Quadrature + Sync,
    L::Point: Send + Sync,
{
    fn sites(&self) -> usize {
        self.first.len().saturating_sub(1)
    }

    fn nodes(&self, site: usize) -> Range<usize> {
        match self.first.get(site..) {
            Some(&[first, next, ..]) => first..next,
            _ => 0..0,
        }
    }

    fn position(&self, point: usize) -> Position {
        let missing = Position {
            cell: usize::MAX,
            weight: f64::NAN,
        };
        let position = |(x, weight): &(Located<L::Point>, f64)| Position {
            cell: x.cell,
            weight: *weight,
        };
        self.points.get(point).map_or(missing, position)
    }

    fn values(&self, point: usize) -> Values {
        let (equation, neighbour) = (self.setup.equation, self.setup.neighbour);
        self.point(point).map_or(Values::MISSING, |x| {
            let [neighbour_source, noise] = neighbour.source_moments(x);
            Values {
                absorption: 1.0 - self.survival().probability(&x.point, 1.0),
                source: equation.source(&x.point, &mut NoDraws),
                neighbour_source,
                source_noise: 0.0,
                noise,
                value: neighbour.value(x),
            }
        })
    }

    fn steps(&self, point: usize, site: usize, wanted: Wanted, visit: &mut dyn FnMut(&Transition)) {
        let Some(x) = self.point(point) else {
            return;
        };
        let VarianceSetup {
            equation,
            neighbour,
            pairs,
            quadrature,
            ..
        } = &self.setup;
        let survival = self.survival();
        let probability = survival.probability(&x.point, 1.0);
        quadrature.steps(&x.point, site, |step| {
            let kernel = equation.kernel(&x.point, &step.point);
            let survived = survival.step(probability, &step.point, kernel);
            let mut to = Transition {
                weight: step.weight * survived.probability,
                node: step.node,
                cell: 0,
                left_out: false,
                kernel: survived.kernel,
                next: survived.next,
                later: survived.later,
                neighbour: 0.0,
                value: 0.0,
            };
            if wanted > Wanted::Kernel && probability != 0.0 {
                let y = neighbour.locate(step.point);
                to.cell = y.cell;
                if wanted >= Wanted::Neighbour {
                    to.neighbour = neighbour.kernel(x, &y, &kernel) / probability;
                }
                if matches!(wanted, Wanted::Kind | Wanted::Value) {
                    to.left_out = pairs.kind(x.cell, y.cell) == PairKind::Dropped;
                }
                if wanted >= Wanted::Value {
                    to.value = neighbour.value(&y);
                }
            }
            visit(&to);
        });
    }

    fn kind(&self, i: usize, j: usize) -> PairKind {
        self.setup.pairs.kind(i, j)
    }

    fn start(&self, start: usize) -> Option<Origin> {
        Some(match self.starts.get(start)? {
            Start::At(x) => {
                let before = self.starts.iter().take(start);
                let points = before.filter(|start| matches!(start, Start::At(_))).count();
                Origin::Point {
                    point: self.first.last()? + points,
                    site: self.setup.quadrature.locate(x),
                }
            }
            Start::Density(_) => Origin::Density,
        })
    }

    fn density(&self, start: usize, point: usize) -> Density {
        match (self.starts.get(start), self.point(point)) {
            (Some(Start::Density(density)), Some(x)) => density(&x.point),
            _ => Density::nothing(),
        }
    }
}
