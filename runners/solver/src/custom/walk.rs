//! Walks of an equation in its own scalar.

use core::fmt;
use std::borrow::Cow;

use fredholm_core::galerkin::{Solution, degree_of};
use fredholm_core::global::{AdjointImage, AdjointScores, Scores};
use fredholm_core::{
    Chain, Dependence, Equation, Goals, Job, LastStep, Lights, Located, NoDraws, NoNeighbour, Real,
    Sensitivities, Space, Start, StartOf, Uniforms,
};
use fredholm_variance::gauss;

use super::cells::{MOST_DIMENSIONS, Nodes, Uniform};
use super::degree::{Boxed, Degree, Kinds, Of, OnCells, Use};
use super::lifted::Lifted;
use super::scores::{CellScores, Polynomials};
use super::whole::{AnyStarts, GlobalWalks};
use super::{CustomEquation, PointFn};
use crate::domain::Position;
use crate::{Error, Goal, Region, Sequence, Subject};
use fredholm_model::cost::PointwisePairs;
use fredholm_model::resolvent::PointWeight;
use fredholm_model::{
    GlobalRequest, Prepared, Request, Then, Wanted, WithGlobalJob, WithJob, only_points,
};

/// An equation by the number of its cells.
pub(super) type Build<E> = dyn Fn(usize) -> Result<E, Error> + Send + Sync;

/// An equation of any number of cells, with what may be asked of it.
pub(super) struct Equations<E: CustomEquation> {
    pub(super) build: Box<Build<E>>,
    pub(super) degrees: Vec<Box<dyn Degree<E>>>,
    pub(super) weights: Vec<(String, Box<PointFn<E::Point>>)>,
    /// The weights of which the integrals are the means over parts of the space, with the names of these.
    pub(super) parts: Vec<(String, Box<PointFn<E::Point>>)>,
    /// Where a point lies, if that is known.
    pub(super) positions: Option<Box<dyn Positions<E::Point>>>,
    pub(super) starts: Box<dyn AnyStarts<E>>,
    pub(super) lights: Option<Box<dyn AnyLights<E>>>,
    /// The number of quantities, and what points and steps have to do with them.
    pub(super) dependences: Option<(usize, Box<PointDependences<E::Point>>)>,
}

/// Hands on the dependences of a point, and of the step from the point before it, if there is one.
///
/// ```
/// use fredholm_core::Dependence;
///
/// // The emission on the left half.
/// let left: Box<fredholm::PointDependences<f64>> = Box::new(|_, x, each| {
///     if *x < 0.5 {
///         each(Dependence { source: 1.0, ..Dependence::on(0) });
///     }
/// });
/// let mut number = 0;
/// left(None, &0.3, &mut |_| number += 1);
/// left(Some(&0.3), &0.7, &mut |_| number += 1);
/// assert_eq!(number, 1);
/// ```
pub type PointDependences<P> = dyn Fn(Option<&P>, &P, &mut dyn FnMut(Dependence)) + Send + Sync;

/// Coordinates for people: "0.5" or "[0.5, 0.25]".
pub(crate) struct Coordinates<'a, F>(pub(crate) &'a [F]);

impl<F: fmt::Display> fmt::Display for Coordinates<'_, F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let [one] = self.0 {
            return one.fmt(f);
        }
        let texts: Vec<String> = self.0.iter().map(F::to_string).collect();
        write!(f, "[{}]", texts.join(", "))
    }
}

/// What knows where points lie.
pub(crate) trait Positions<P>: Send + Sync {
    /// The position of a point.
    fn position(&self, x: &P) -> Position;

    /// Takes note that a function of coordinates has a value that is no number, in words.
    fn refuse(&self, what: String);
}

/// A weight that is asked for, as a function of the point.
pub(super) type Weight<'a, P> = Box<dyn Fn(&P) -> f64 + Send + Sync + 'a>;

/// Coefficients and Galerkin solution, which serve walks in every scalar.
pub(super) struct Solved {
    /// Cells as they were asked for.
    pub(super) cells: usize,
    pub(super) degree: usize,
    /// The numbers that the degree keeps of K'.
    pub(super) entries: Vec<f64>,
    pub(super) solution: Solution,
    /// The solution in place of that, if it is lifted.
    pub(super) lifted: Option<Lifted>,
}

/// How the walks of a neighbour equation go.
#[derive(Clone, Copy)]
pub(super) struct How {
    pub(super) kinds: Kinds,
    pub(super) pointwise: PointwisePairs,
    pub(super) neighbour_second_moment_radius: Option<f64>,
}

/// What the walks of a global estimate score on.
#[derive(Clone, Copy)]
pub(super) enum ScoredOn<'a> {
    /// These functions of every cell.
    Polynomials(&'a Polynomials),
    /// K(x, ·) of these points x.
    Points(&'a [Region]),
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

    /// Walks of a global estimate that score on these.
    fn whole_job(
        &self,
        solved: &Solved,
        kinds: Kinds,
        how: (&GlobalRequest<'_>, ScoredOn<'_>),
        then: &mut WithGlobalJob<'_>,
    ) -> Result<(), Error>;

    /// What may be asked: whether pairs may be pointwise, for every degree; the names of weights; whether last steps may lead to the light.
    fn abilities(&self) -> (Vec<bool>, Vec<&str>, bool);
}

/// A weighted integral ∫ w u dμ: Φ = w, walks start uniformly.
///
/// For (v, Φ) see `fredholm_cube::Weighted`: whatever numbers stand for the means of w over cells, the estimate has the
/// same mean.
pub(super) struct Weighted<'a, E: CustomEquation> {
    uniform: &'a Uniform<'a, E>,
    weight: Weight<'a, E::Point>,
    /// The functions of v, and the means over cells of w times each of them.
    near: Option<(&'a dyn OnCells<E>, Vec<f64>)>,
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
        let near = self.near.as_ref().map_or(0.0, |(functions, means)| {
            let series = functions.series(self.uniform.equation(), means, x);
            series * self.uniform.measure
        });
        self.of_means + (phi - near) * v
    }
}

/// Where the walks of a goal start.
enum Begin<'a, E: CustomEquation> {
    Point(E::Point),
    Mean(&'a Uniform<'a, E>),
    /// From a coordinate to another one.
    Arc([f64; 2]),
    Weight(&'a Weighted<'a, E>),
}

/// The functional of a goal, and whether what is known of a start is to be added.
struct Functional<'a, E: CustomEquation> {
    begin: Begin<'a, E>,
    equation: &'a E,
    /// F_s in a point, if that is known of the start and not of the goal.
    known: Option<&'a dyn AnyLights<E>>,
}

impl<E, W> fredholm_core::Functional<W> for Functional<'_, E>
where
    E: CustomEquation,
    W: Equation<Scalar = E::Scalar, Point = E::Point, Value = E::Scalar>,
{
    #[inline]
    fn start<U: Uniforms<E::Scalar>>(&self, equation: &W, uniforms: &mut U) -> StartOf<W> {
        let (point, phi) = match self.begin {
            Begin::Point(x) => (x, 1.0),
            Begin::Mean(uniform) => (uniform.draw(uniforms), 1.0),
            Begin::Arc([from, to]) => {
                let share = uniforms.uniform().to_f64();
                (inside(self.equation, from + (to - from) * share), 1.0)
            }
            Begin::Weight(weighted) => {
                let x = weighted.uniform.draw(uniforms);
                (x, weighted.weight(&x) * weighted.uniform.measure)
            }
        };
        let known = self
            .known
            .map(|lights| phi * lights.known(self.equation, &point));
        Start {
            known: E::Scalar::from_f64(known.unwrap_or(0.0)),
            ..Start::of(equation, point, E::Scalar::from_f64(phi))
        }
    }

    fn control_estimate(&self, x: &Located<E::Point>, phi: E::Scalar, v: &E::Scalar) -> f64 {
        match self.begin {
            Begin::Weight(weighted) => weighted.control_estimate(x, phi.to_f64(), v.to_f64()),
            // The others are known.
            _ => (phi * *v).to_f64(),
        }
    }
}

/// The point with a coordinate; that of the last cell where rounding leads beyond it.
fn inside<E: CustomEquation>(equation: &E, coordinate: f64) -> E::Point {
    let last = || equation.point(equation.cells().saturating_sub(1), &[1.0]);
    equation.at(&[coordinate]).unwrap_or_else(last)
}

/// The mean of a function over an interval of the coordinate that is smooth on cells.
pub(super) fn mean_between<E: CustomEquation>(
    equation: &E,
    interval: [f64; 2],
    value: &dyn Fn(E::Point) -> f64,
) -> Result<f64, Error> {
    let nodes = nodes_between(equation, interval, ARC_POINTS)?.into_iter();
    Ok(nodes.map(|(x, share)| share * value(x)).sum())
}

/// The points of Gauss rules between the ends of cells in an interval of the coordinate, with shares that sum to 1. The ends are found by
/// bisection.
pub(super) fn nodes_between<E: CustomEquation>(
    equation: &E,
    [from, to]: [f64; 2],
    points: usize,
) -> Result<Vec<(E::Point, f64)>, Error> {
    let rule = gauss(points)?;
    let cell = |s: f64| equation.locate(&inside(equation, s));
    let (mut low, mut nodes) = (from, Vec::new());
    while low < to {
        let own = cell(low + (to - low) * f64::EPSILON);
        let (mut inner, mut outer) = (low, to);
        if cell(to) != own || cell(0.5 * (low + to)) != own {
            while outer - inner > f64::EPSILON * (1.0 + outer.abs()) {
                let middle = 0.5 * (inner + outer);
                if cell(middle) == own {
                    inner = middle;
                } else {
                    outer = middle;
                }
                if middle == inner && middle == outer {
                    break;
                }
            }
        }
        let half = 0.5 * (outer - low);
        nodes.extend(rule.iter().map(|(t, weight)| {
            let x = inside(equation, low + half * (1.0 + t));
            (x, half * weight / (to - from))
        }));
        low = outer;
    }
    Ok(nodes)
}

/// Gauss points between the ends of cells: exact for the degrees that there are.
const ARC_POINTS: usize = 6;

/// Whether a region is a weighted integral.
pub(super) const fn is_weight(region: &Region) -> bool {
    matches!(
        region,
        Region::Weight(_) | Region::Function(_) | Region::Part(_)
    )
}

/// Walks whose last step leads to the light, of an equation that has lights. It is object safe.
pub(super) trait AnyLights<E: CustomEquation>: Send + Sync {
    /// F_s(x).
    fn known(&self, equation: &E, x: &E::Point) -> f64;

    /// What walks score in a state: F − F_s, and what the light gives directly.
    fn source(&self, equation: &E, x: &E::Point) -> E::Scalar;

    /// Hands on the walks of these goals.
    fn with_job(
        &self,
        walks: &GoalWalks<'_, E>,
        then: &mut dyn FnMut(&dyn Job) -> Result<(), Error>,
    ) -> Result<(), Error>;
}

/// The lights of an equation itself.
pub(super) struct OwnLights;

impl<E: CustomEquation + Lights> AnyLights<E> for OwnLights {
    fn known(&self, equation: &E, x: &E::Point) -> f64 {
        Lights::known(equation, x).to_f64()
    }

    fn source(&self, equation: &E, x: &E::Point) -> E::Scalar {
        LastStep(equation).source(x, &mut NoDraws)
    }

    fn with_job(
        &self,
        walks: &GoalWalks<'_, E>,
        then: &mut dyn FnMut(&dyn Job) -> Result<(), Error>,
    ) -> Result<(), Error> {
        walks.hand_on(&LastStep(walks.equation), then)
    }
}

/// The equation of walks for a prediction of their variance, with or without a last step.
pub(super) struct Lit<'a, E: CustomEquation> {
    pub(super) equation: &'a E,
    pub(super) lights: Option<&'a dyn AnyLights<E>>,
}

impl<E: CustomEquation> Space for Lit<'_, E> {
    type Scalar = E::Scalar;
    type Point = E::Point;
}

impl<E: CustomEquation> Chain for Lit<'_, E> {
    fn step<U: Uniforms<E::Scalar>>(&self, x: &E::Point, uniforms: &mut U) -> Option<E::Point> {
        self.equation.step(x, uniforms)
    }
}

impl<E: CustomEquation> Equation for Lit<'_, E> {
    type Value = E::Scalar;

    fn kernel(&self, x: &E::Point, y: &E::Point) -> E::Scalar {
        self.equation.kernel(x, y)
    }

    fn source<U: Uniforms<E::Scalar>>(&self, x: &E::Point, uniforms: &mut U) -> E::Scalar {
        match self.lights {
            Some(lights) => lights.source(self.equation, x),
            None => self.equation.source(x, uniforms),
        }
    }

    fn size(&self, x: &E::Point) -> E::Scalar {
        self.equation.size(x)
    }
}

/// The walks of goals.
pub(super) struct GoalWalks<'a, E: CustomEquation> {
    equation: &'a E,
    neighbour: &'a Boxed<'a, E>,
    goals: &'a [fredholm_core::Goal<Functional<'a, E>, f64>],
    request: &'a Request<'a>,
    lights: Option<&'a dyn AnyLights<E>>,
    dependences: Option<&'a (usize, Box<PointDependences<E::Point>>)>,
}

impl<E: CustomEquation> GoalWalks<'_, E> {
    /// Hands on the walks of the equation, or of what is left of it, which tell derivatives where these are wanted.
    fn hand_on<W>(
        &self,
        walked: &W,
        then: &mut dyn FnMut(&dyn Job) -> Result<(), Error>,
    ) -> Result<(), Error>
    where
        W: Equation<Scalar = E::Scalar, Point = E::Point, Value = E::Scalar> + Sync,
    {
        let job = Goals::new(
            walked,
            self.neighbour,
            self.goals,
            self.request.walk.for_core(),
        );
        let sequence = self.request.walk.sequence;
        let is_wanted = self.request.wanted == Wanted::Derivatives;
        let Some((quantities, dependences)) = self.dependences.filter(|_| is_wanted) else {
            return match sequence {
                Sequence::Random => then(&job),
                Sequence::Sobol => then(&job.with_generators(sequence)),
            };
        };
        let of =
            |before: Option<&E::Point>, x: &E::Point, each: &mut dyn FnMut(usize, Dependence)| {
                let known = self.lights;
                let known = known.map_or(0.0, |lights| lights.known(self.equation, x));
                dependences(before, x, &mut |own| each(0, own.knowing(known)));
            };
        let job = job.with_generators(sequence);
        then(&Sensitivities::new(&job, *quantities, &of))
    }
}

impl<E: CustomEquation> Equations<E> {
    pub(super) fn degree(&self, degree: usize) -> Result<&dyn Degree<E>, Error> {
        let degree = self.degrees.get(degree).map(|degree| &**degree);
        degree.ok_or(Error::Internal("the equation does not have this degree"))
    }

    /// The weight of a region.
    pub(super) fn weight_of<'a>(&'a self, region: &Region) -> Result<Weight<'a, E::Point>, Error> {
        match (region, &self.positions) {
            (Region::Weight(number), _) if *number < self.weights.len() => {
                Ok(Box::new(&*self.weights[*number].1))
            }
            (Region::Part(number), _) if *number < self.parts.len() => {
                Ok(Box::new(&*self.parts[*number].1))
            }
            (Region::Function(weight), Some(positions)) => {
                let weight = weight.clone();
                Ok(Box::new(move |x| {
                    let at = positions.position(x);
                    let x = &at.coordinates[..E::DIMENSION];
                    let value = weight.value(x);
                    if !value.is_finite() {
                        positions.refuse(format!("`weight` is {value} at x = {}", Coordinates(x)));
                    }
                    at.volume * value
                }))
            }
            _ => Err(Error::Internal("the equation does not have this weight")),
        }
    }

    /// The weighted means that are asked for, in the order of their goals; `near` is the degree of v with v itself.
    pub(super) fn weighted<'a>(
        &'a self,
        uniform: &'a Uniform<'a, E>,
        goals: &[Goal],
        near: Option<(&'a dyn Degree<E>, &[E::Scalar])>,
    ) -> Result<Vec<Weighted<'a, E>>, Error> {
        let regions = goals.iter().map(|goal| &goal.region);
        let regions = regions.filter(|region| is_weight(region));
        let of = |region| {
            let weight = self.weight_of(region)?;
            let mut weighted = Weighted {
                uniform,
                weight,
                near: None,
                of_means: 0.0,
            };
            if let Some((degree, v)) = near {
                let points = degree_of(E::DIMENSION, degree.functions()) + 2;
                let nodes = Nodes::new(uniform.equation(), points)?;
                let own = degree.on_cells();
                let means = own.means(uniform.equation(), &nodes, &weighted.weight);
                let functions = degree.functions();
                let cells = means.chunks(functions).zip(v.chunks(functions));
                let terms = cells.zip(nodes.measures()).map(|((means, v), measure)| {
                    let products = means.iter().zip(v).map(|(w, v)| w * v.to_f64());
                    measure * products.sum::<f64>()
                });
                weighted.of_means = terms.sum();
                weighted.near = Some((own, means));
            }
            Ok(weighted)
        };
        regions.map(of).collect()
    }

    /// Hands on the neighbour equation of a solved system, and v as far as its degree is that of the matrix. With a last step they are
    /// those of u less the emission of lights, which is constant on cells.
    pub(super) fn with_neighbour(
        &self,
        equation: &E,
        solved: &Solved,
        (kinds, last_step): (Kinds, bool),
        then: &mut Use<'_, E>,
    ) -> Result<(), Error> {
        let lights = self.lights.as_deref().filter(|_| last_step);
        if let Some(lifted) = &solved.lifted {
            if lights.is_some() {
                return Err(Error::Option {
                    subject: Subject::LastStep,
                    message:
                        "walks that follow a lift go without a last step: leave one of them out"
                            .to_owned(),
                });
            }
            let v = lifted.lower(E::DIMENSION, solved.degree);
            let v: Vec<E::Scalar> = v.into_iter().map(E::Scalar::from_f64).collect();
            return then(&lifted.neighbour(equation), &v);
        }
        let degree = self.degree(solved.degree)?;
        let mut solution = Cow::Borrowed(&solved.solution);
        if let Some(lights) = lights {
            let middle = [0.5; MOST_DIMENSIONS];
            let v = &mut solution.to_mut().v;
            for (cell, own) in v.chunks_exact_mut(degree.functions()).enumerate() {
                let x = equation.point(cell, &middle[..E::DIMENSION]);
                own[0] -= lights.known(equation, &x);
            }
        }
        let of = Of {
            equation,
            entries: &solved.entries,
            solution: &solution,
        };
        degree.with_neighbour(&of, kinds, then)
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
        let uniform = Uniform::new(equation, self.starts.uniform(equation));
        let weighted = self.weighted(&uniform, request.goals, near)?;
        let lights = self.lights.as_deref().filter(|_| request.walk.last_step);
        let mut weights = weighted.iter();
        let (mut goals, mut values) = (Vec::new(), Vec::new());
        let v = |x: E::Point| neighbour.value(&neighbour.locate(x)).to_f64();
        for goal in request.goals {
            let of_lights = known_of(equation, lights, &goal.region)?;
            let (begin, mean) = match &goal.region {
                Region::Point(coordinates) => {
                    let x = place(equation, coordinates)?;
                    (Begin::Point(x), v(x))
                }
                region if is_weight(region) => {
                    let one = weights.next();
                    let one = one.ok_or(Error::Internal("a weight has no means"))?;
                    (Begin::Weight(one), one.of_means)
                }
                Region::Arc(from, to) => {
                    let arc = [*from, *to];
                    (Begin::Arc(arc), mean_between(equation, arc, &v)?)
                }
                _ => {
                    let mean = near.map_or(0.0, |(degree, v)| uniform.mean(degree.functions(), v));
                    (Begin::Mean(&uniform), mean)
                }
            };
            let is_known = !matches!(begin, Begin::Weight(_));
            values.push(mean + of_lights.unwrap_or(0.0));
            goals.push(fredholm_core::Goal {
                functional: Functional {
                    begin,
                    equation,
                    known: lights.filter(|_| of_lights.is_none()),
                },
                control_mean: is_known.then_some(mean),
                known: of_lights.unwrap_or(0.0),
            });
        }
        let walks = GoalWalks {
            equation,
            neighbour,
            goals: &goals,
            request,
            lights,
            dependences: self.dependences.as_ref(),
        };
        let mut then = |job: &dyn Job| then(job, &values);
        match lights {
            Some(lights) => lights.with_job(&walks, &mut then),
            None => walks.hand_on(equation, &mut then),
        }
    }
}

impl<E: CustomEquation> Equations<E> {
    /// The weight of a region that resolvent walks are asked for.
    pub(super) fn regular(&self, region: &Region) -> Result<PointWeight<'_, E::Point>, Error> {
        if is_weight(region) {
            return Ok(self.weight_of(region)?);
        }
        Err(Error::Region {
            message: "resolvent walks have points, weights, and the mean over the whole space"
                .to_owned(),
        })
    }
}

/// (F_s, Φ) of a functional for walks with a last step to these lights. `None`: every start knows its part.
pub(super) fn known_of<E: CustomEquation>(
    equation: &E,
    lights: Option<&dyn AnyLights<E>>,
    region: &Region,
) -> Result<Option<f64>, Error> {
    if is_weight(region) {
        return Ok(None);
    }
    let Some(lights) = lights else {
        return Ok(Some(0.0));
    };
    let known = |x: E::Point| lights.known(equation, &x);
    Ok(Some(match region {
        Region::Point(coordinates) => known(place(equation, coordinates)?),
        Region::Arc(from, to) => mean_between(equation, [*from, *to], &known)?,
        _ => {
            let middle = [0.5; MOST_DIMENSIONS];
            let (mut sum, mut measure) = (0.0, 0.0);
            for cell in 0..equation.cells() {
                let own = equation.measure(cell);
                sum += own * known(equation.point(cell, &middle[..E::DIMENSION]));
                measure += own;
            }
            sum / measure
        }
    }))
}

/// The point with these coordinates.
pub(super) fn place<E: CustomEquation>(
    equation: &E,
    coordinates: &[f64],
) -> Result<E::Point, Error> {
    equation.at(coordinates).ok_or_else(|| Error::Region {
        message: format!(
            "the equation has no point with the coordinates {coordinates:?}: see its `Cells::at`"
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
        let equation = (self.build)(cells)?;
        let none: &Boxed<'_, E> = &NoNeighbour::new(&equation);
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
        let equation = (self.build)(solved.cells)?;
        let degree = self.degree(solved.degree)?;
        let how_of = (how.kinds, request.walk.last_step);
        self.with_neighbour(&equation, solved, how_of, &mut |neighbour, v| {
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
                })
            })
        })
    }

    fn whole_job(
        &self,
        solved: &Solved,
        kinds: Kinds,
        (request, on): (&GlobalRequest<'_>, ScoredOn<'_>),
        then: &mut WithGlobalJob<'_>,
    ) -> Result<(), Error> {
        let equation = &(self.build)(solved.cells)?;
        let mut score = |scores: &(dyn Scores<E::Point> + Sync)| {
            self.with_neighbour(equation, solved, (kinds, false), &mut |neighbour, _| {
                let walks = GlobalWalks {
                    equation,
                    neighbour,
                    scores,
                    request,
                };
                self.starts.start(&walks, then)
            })
        };
        let points = match on {
            ScoredOn::Polynomials(polynomials) => {
                return score(&CellScores {
                    equation,
                    polynomials,
                });
            }
            ScoredOn::Points(points) => points,
        };
        let image = |region: &Region| match region {
            Region::Point(x) => {
                let x = place(equation, x)?;
                let image = move |y: &Located<E::Point>| {
                    let k = equation.kernel(&x, &y.point) * equation.density(&x, &y.point);
                    k.to_f64()
                };
                Ok(Box::new(image) as Box<AdjointImage<'_, E::Point>>)
            }
            _ => Err(only_points()),
        };
        let images = points
            .iter()
            .map(image)
            .collect::<Result<Vec<_>, Error>>()?;
        let images: Vec<_> = images.iter().map(|image| &**image).collect();
        score(&AdjointScores(&images))
    }

    fn abilities(&self) -> (Vec<bool>, Vec<&str>, bool) {
        let degrees = self.degrees.iter();
        let names = self.weights.iter().map(|(name, _)| name.as_str());
        (
            degrees.map(|degree| degree.pairs().pointwise).collect(),
            names.collect(),
            self.lights.is_some(),
        )
    }
}
