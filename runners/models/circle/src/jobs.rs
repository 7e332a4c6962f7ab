//! The walks of all goals of a circle.

use fredholm_circle::{Circle, Emission, LaneNeighbour, LaneReal, MeanOver, Point, SideBySide};
use fredholm_core::{At, Functional, Generators, Goals, Job, Neighbour, Real, Shifted, Uniforms};

use fredholm_model::{Error, Region, Request};

/// Prepares the walks of all goals, of which (F_s, Φ) and (v, Φ) are known, with the draws of a generator.
pub(super) fn with_job<G: Generators, F: Real, E: Emission<F> + Sync, N>(
    circle: &Circle<'_, F, E>,
    neighbour: &N,
    request: &Request<'_>,
    known: &[(f64, f64)],
    then: &mut dyn FnMut(&dyn Job) -> Result<(), Error>,
) -> Result<(), Error>
where
    N: Neighbour<Scalar = F, Point = Point<F>> + Sync + ?Sized,
{
    let goals = goals(circle, request, known)?;
    let options = request.walk.for_core();
    then(&Goals::new(circle, neighbour, &goals, options).with_generator::<G>())
}

/// Prepares walks that go side by side if lanes know the h of the neighbour equation.
pub(super) fn side_by_side<F: LaneReal, E: Emission<F> + Sync, N>(
    circle: &Circle<'_, F, E>,
    neighbour: &N,
    request: &Request<'_>,
    known: &[(f64, f64)],
    then: &mut dyn FnMut(&dyn Job) -> Result<(), Error>,
) -> Result<(), Error>
where
    N: LaneNeighbour<F, E> + Sync,
{
    let goals = goals(circle, request, known)?;
    let options = request.walk.for_core();
    then(&SideBySide::new(Goals::new(
        circle, neighbour, &goals, options,
    )))
}

/// Prepares walks that go side by side, of a neighbour equation with h = k.
pub(super) fn with_same_kernel<F: LaneReal, E: Emission<F> + Sync, N>(
    circle: &Circle<'_, F, E>,
    neighbour: &N,
    request: &Request<'_>,
    known: &[(f64, f64)],
    then: &mut dyn FnMut(&dyn Job) -> Result<(), Error>,
) -> Result<(), Error>
where
    N: Neighbour<Scalar = F, Point = Point<F>> + Sync + ?Sized,
{
    let goals = goals(circle, request, known)?;
    let options = request.walk.for_core();
    then(&SideBySide::with_same_kernel(Goals::new(
        circle, neighbour, &goals, options,
    )))
}

/// A goal of walks, of which a part may be known.
type WalkGoal<'a, 'c, F, E> = fredholm_core::Goal<Shifted<Start<'a, 'c, F, E>>>;

/// The goals of all walks, of which (F_s, Φ) and (v, Φ) are known.
fn goals<'a, 'c, F: Real, E: Emission<F>>(
    circle: &'a Circle<'c, F, E>,
    request: &Request<'_>,
    known: &[(f64, f64)],
) -> Result<Vec<WalkGoal<'a, 'c, F, E>>, Error> {
    let goals = request.goals.iter().zip(known);
    goals
        .map(|(goal, &(known, galerkin))| {
            let functional = match goal.region {
                Region::Angle(s) => Start::Point(At(circle.point(s))),
                Region::Arc(from, to) => Start::Mean(MeanOver::new(circle, from, to)?),
                _ => return Err(Error::Internal("a circle has angles and arcs")),
            };
            Ok(fredholm_core::Goal {
                functional: Shifted { functional, known },
                control_mean: Some(galerkin),
            })
        })
        .collect()
}

/// Where walks start.
enum Start<'a, 'c, F, E> {
    Point(At<Point<F>>),
    Mean(MeanOver<'a, 'c, F, E>),
}

impl<F: Real, E: Emission<F>> Functional<Circle<'_, F, E>> for Start<'_, '_, F, E> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Point<F>, F) {
        match self {
            Self::Point(At(x)) => (*x, F::one()),
            Self::Mean(mean) => mean.start(uniforms),
        }
    }
}
