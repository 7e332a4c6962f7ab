//! Walks of an equation in its own scalar.

use fredholm_core::galerkin::{Dense, Solution};
use fredholm_core::{Functional, Goals, Located, NoNeighbour, Real, Uniforms};

use super::cells::{Nodes, Uniform};
use super::degree::{Boxed, Degree, Kinds, Of};
use super::scores::{CellScores, Polynomials};
use super::whole::{AnyStarts, WholeWalks};
use super::{CustomEquation, PointFn};
use crate::{Error, Goal, Region};
use fredholm_model::cost::PointwisePairs;
use fredholm_model::{Prepared, Request, Then, WholeRequest, WithJob, WithWholeJob};

/// An equation by the number of its cells and an absorption probability.
pub(super) type Build<E> = dyn Fn(usize, f64) -> Result<E, Error> + Send + Sync;

/// An equation of any number of cells, with what may be asked of it.
pub(super) struct Equations<E: CustomEquation> {
    pub(super) build: Box<Build<E>>,
    pub(super) degrees: Vec<Box<dyn Degree<E>>>,
    pub(super) weights: Vec<(String, Box<PointFn<E::Point>>)>,
    pub(super) starts: Box<dyn AnyStarts<E>>,
}

/// Coefficients and Galerkin solution, which serve walks in every scalar.
pub(super) struct Solved {
    /// Cells as they were asked for.
    pub(super) cells: usize,
    pub(super) degree: usize,
    /// K', (n·B)² entries.
    pub(super) entries: Vec<f64>,
    /// n and B.
    pub(super) shape: [usize; 2],
    pub(super) solution: Solution,
}

impl Solved {
    pub(super) fn coefficients(&self) -> Result<Dense<'_, f64>, Error> {
        let [n, functions] = self.shape;
        Dense::new(&self.entries, n, functions).ok_or(Error::Internal("a table has a wrong size"))
    }
}

/// How the walks of a neighbour equation go.
#[derive(Clone, Copy)]
pub(super) struct How {
    pub(super) kinds: Kinds,
    pub(super) pointwise: PointwisePairs,
    pub(super) neighbour_second_moment_radius: Option<f64>,
}

/// Prepares walks in one scalar.
pub(super) trait Walks: Send + Sync {
    /// Walks that follow no neighbour equation.
    fn plain_job(
        &self,
        cells: usize,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error>;

    /// Walks that both equations follow.
    fn job(
        &self,
        solved: &Solved,
        how: How,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error>;

    /// Walks of a whole function that score on these polynomials.
    fn whole_job(
        &self,
        solved: &Solved,
        kinds: Kinds,
        how: (&WholeRequest<'_>, &Polynomials),
        then: &mut WithWholeJob<'_>,
    ) -> Result<(), Error>;

    /// The name of the weight of this number.
    fn weight(&self, number: usize) -> Option<&str>;

    /// Whether pairs may be pointwise, for every degree.
    fn integrals(&self) -> Vec<bool>;
}

/// A weighted integral ∫ w u dμ: Φ = w, walks start uniformly.
///
/// For (v, Φ) see `fredholm_cube::Weighted`: whatever numbers stand for the means of w over cells, the estimate has the
/// same mean.
pub(super) struct Weighted<'a, E: CustomEquation> {
    uniform: &'a Uniform<'a, E>,
    weight: &'a PointFn<E::Point>,
    /// The degree of v, and the means over cells of w times each function there.
    near: Option<(&'a dyn Degree<E>, Vec<f64>)>,
    /// (v, Φ) as far as these are the means.
    pub(super) of_means: f64,
}

impl<E: CustomEquation> Weighted<'_, E> {
    /// w(x).
    pub(super) fn weight(&self, x: &E::Point) -> f64 {
        (self.weight)(x)
    }

    /// A number near (v, Φ), whose mean is that, from a start.
    pub(super) fn control_estimate(&self, x: &Located<E::Point>, phi: f64, v: f64) -> f64 {
        let near = self.near.as_ref().map_or(0.0, |(degree, means)| {
            let series = degree.series(self.uniform.equation(), means, x);
            series * self.uniform.measure
        });
        self.of_means + (phi - near) * v
    }
}

/// Where the walks of a goal start.
enum Start<'a, E: CustomEquation> {
    Point(E::Point),
    Mean(&'a Uniform<'a, E>),
    Weight(&'a Weighted<'a, E>),
}

impl<E: CustomEquation> Functional<E> for Start<'_, E> {
    #[inline]
    fn start<U: Uniforms<E::Scalar>>(&self, uniforms: &mut U) -> (E::Point, E::Scalar) {
        match self {
            Self::Point(x) => (*x, E::Scalar::from_f64(1.0)),
            Self::Mean(uniform) => (uniform.draw(uniforms), E::Scalar::from_f64(1.0)),
            Self::Weight(weighted) => {
                let x = weighted.uniform.draw(uniforms);
                let phi = weighted.weight(&x) * weighted.uniform.measure;
                (x, E::Scalar::from_f64(phi))
            }
        }
    }

    fn control_estimate(&self, x: &Located<E::Point>, phi: E::Scalar, v: E::Scalar) -> f64 {
        match self {
            Self::Weight(weighted) => weighted.control_estimate(x, phi.to_f64(), v.to_f64()),
            // These are known.
            Self::Point(_) | Self::Mean(_) => (phi * v).to_f64(),
        }
    }
}

impl<E: CustomEquation> Equations<E> {
    pub(super) fn degree(&self, degree: usize) -> Result<&dyn Degree<E>, Error> {
        let degree = self.degrees.get(degree).map(|degree| &**degree);
        degree.ok_or(Error::Internal("the equation does not have this degree"))
    }

    pub(super) fn weight_of(&self, number: usize) -> Result<&PointFn<E::Point>, Error> {
        let weight = self.weights.get(number).map(|(_, weight)| &**weight);
        weight.ok_or(Error::Internal("the equation does not have this weight"))
    }

    /// The weighted means that are asked for, in the order of their goals; `near` is the degree of v with v itself.
    pub(super) fn weighted<'a>(
        &'a self,
        uniform: &'a Uniform<'a, E>,
        goals: &[Goal],
        near: Option<(&'a dyn Degree<E>, &[E::Scalar])>,
    ) -> Result<Vec<Weighted<'a, E>>, Error> {
        let numbers = goals.iter().filter_map(|goal| match goal.region {
            Region::Weight(number) => Some(number),
            _ => None,
        });
        let of = |number| {
            let weight = self.weight_of(number)?;
            let mut weighted = Weighted {
                uniform,
                weight,
                near: None,
                of_means: 0.0,
            };
            if let Some((degree, v)) = near {
                let nodes = Nodes::new(uniform.equation(), 2)?;
                let means = degree.means(uniform.equation(), &nodes, weight);
                let functions = degree.functions();
                let cells = means.chunks(functions).zip(v.chunks(functions));
                let terms = cells.zip(nodes.measures()).map(|((means, v), measure)| {
                    let products = means.iter().zip(v).map(|(w, v)| w * v.to_f64());
                    measure * products.sum::<f64>()
                });
                weighted.of_means = terms.sum();
                weighted.near = Some((degree, means));
            }
            Ok(weighted)
        };
        numbers.map(of).collect()
    }

    /// Hands on the job of all goals, and (v, Φ) of each.
    fn with_job(
        &self,
        equation: &E,
        neighbour: &Boxed<'_, E>,
        near: Option<(&dyn Degree<E>, &[E::Scalar])>,
        request: &Request<'_>,
        then: &mut WithJob<'_>,
    ) -> Result<(), Error> {
        let uniform = Uniform::new(equation);
        let weighted = self.weighted(&uniform, request.goals, near)?;
        let mean = near.map_or(0.0, |(degree, v)| uniform.mean(degree.functions(), v));
        let mut weights = weighted.iter();
        let (mut goals, mut values) = (Vec::new(), Vec::new());
        for goal in request.goals {
            let (functional, value) = match &goal.region {
                Region::Point(coordinates) => {
                    let x = place(equation, coordinates)?;
                    let value = neighbour.value(&neighbour.locate(x)).to_f64();
                    (Start::Point(x), value)
                }
                Region::Weight(_) => {
                    let one = weights.next();
                    let one = one.ok_or(Error::Internal("a weight has no means"))?;
                    (Start::Weight(one), one.of_means)
                }
                _ => (Start::Mean(&uniform), mean),
            };
            values.push(value);
            let is_known = !matches!(functional, Start::Weight(_));
            goals.push(fredholm_core::Goal {
                functional,
                control_mean: is_known.then_some(value),
            });
        }
        let options = request.walk.for_core();
        then(&Goals::new(equation, neighbour, &goals, options), &values)
    }
}

/// The point with these coordinates.
pub(super) fn place<E: CustomEquation>(
    equation: &E,
    coordinates: &[f64],
) -> Result<E::Point, Error> {
    equation.at(coordinates).ok_or_else(|| Error::Region {
        message: format!(
            "the equation has no point with the coordinates {coordinates:?}: see its `CellMap::at`"
        ),
    })
}

impl<E: CustomEquation> Walks for Equations<E> {
    fn plain_job(
        &self,
        cells: usize,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error> {
        let equation = (self.build)(cells, request.walk.absorption)?;
        let none: &Boxed<'_, E> = &NoNeighbour::<E>::new();
        self.with_job(&equation, none, None, request, &mut |job, zeros| {
            then(&Prepared::plain(job, zeros))
        })
    }

    fn job(
        &self,
        solved: &Solved,
        how: How,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error> {
        let equation = (self.build)(solved.cells, request.walk.absorption)?;
        let degree = self.degree(solved.degree)?;
        let of = Of {
            equation: &equation,
            coefficients: &solved.coefficients()?,
            solution: &solved.solution,
        };
        degree.with_neighbour(&of, how.kinds, &mut |neighbour, v| {
            let near = Some((degree, v));
            self.with_job(&equation, neighbour, near, request, &mut |job, galerkin| {
                then(&Prepared {
                    job,
                    galerkin,
                    largest: fredholm_model::numbers::largest(v),
                    radius_bound: solved.solution.radius_bound,
                    convergence: solved.solution.convergence,
                    pointwise: how.pointwise,
                    neighbour_second_moment_radius: how.neighbour_second_moment_radius,
                    pair_counts: None,
                })
            })
        })
    }

    fn whole_job(
        &self,
        solved: &Solved,
        kinds: Kinds,
        (request, polynomials): (&WholeRequest<'_>, &Polynomials),
        then: &mut WithWholeJob<'_>,
    ) -> Result<(), Error> {
        let equation = &(self.build)(solved.cells, request.walk.absorption)?;
        let of = Of {
            equation,
            coefficients: &solved.coefficients()?,
            solution: &solved.solution,
        };
        let scores = CellScores {
            equation,
            polynomials,
        };
        let degree = self.degree(solved.degree)?;
        degree.with_neighbour(&of, kinds, &mut |neighbour, _| {
            let walks = WholeWalks {
                equation,
                neighbour,
                scores: &scores,
                request,
            };
            self.starts.start(&walks, then)
        })
    }

    fn weight(&self, number: usize) -> Option<&str> {
        self.weights.get(number).map(|(name, _)| name.as_str())
    }

    fn integrals(&self) -> Vec<bool> {
        let degrees = self.degrees.iter();
        degrees.map(|degree| degree.has_integrals()).collect()
    }
}
