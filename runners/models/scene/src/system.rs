//! A solved scene, and its walks.

use core::num::NonZeroU32;
use std::borrow::Cow;
use std::sync::Arc;

use fredholm_core::galerkin::{CellMap, Partition, Solution};
use fredholm_core::sampled::{Sampled, SampledSolution, SampledTables, ScoreVariance};
use fredholm_core::{
    DefaultGenerator, Goals, Job, LastStep, Neighbour, Real, RngUniforms, Started, WalkSeeds,
    WithKnown,
};
use fredholm_embedded::TableBuilder;
use fredholm_model::heat::RadiativeExchange as _;
use fredholm_model::{
    Error, Examined, Pairs, Prepared, Request, SavedSystem, Scalar, System, Then, WalkOptions,
    WholeSystem, in_scalar,
};
use fredholm_scene::{Air, Facing, Point, Radiosity};

use crate::SceneModel;
use crate::of_degree;
use crate::partition::{Cut, NO_PAIRS, WalkTables};
use crate::radius::check_plain_variance;
use crate::regions::{Place, Start};
use crate::whole::SceneWhole;

/// Rays of a score by which the best number of rays is found.
pub(crate) const TRIAL: NonZeroU32 = NonZeroU32::MIN.saturating_add(3);
/// What the rest of a walk takes, in rays of its scores: its own rays, those to lights, and the form factors of c's events.
pub(crate) const REST: f64 = 3.0;

/// A neighbour equation of any degree: one type of walk for all.
pub(crate) type Boxed<'a, F> = dyn Neighbour<Scalar = F, Point = Started<Point<F>, F>> + Sync + 'a;

/// The neighbour equation on points of the scene alone, of any degree.
pub(crate) type OnPoints<'a, F> = dyn Neighbour<Scalar = F, Point = Point<F>> + Sync + 'a;

/// The neighbour equation from rays, with faces that they cross as events, and as many rays a score as have the least product of variance
/// and time.
fn sampled<'a, F: Real, const B: usize>(
    tables: &'a SampledTables<F>,
    last: &LastStep<'a, Radiosity<'a, F>>,
) -> Result<Sampled<'a, F, Radiosity<'a, F>, 2, B, Radiosity<'a, F>>, Error> {
    made(tables, last, best_rays::<F, B>(tables, last)?)
}

/// Returns as many rays a score as have the least product of variance and time.
pub(crate) fn best_rays<F: Real, const B: usize>(
    tables: &SampledTables<F>,
    last: &LastStep<'_, Radiosity<'_, F>>,
) -> Result<NonZeroU32, Error> {
    let trial = made::<F, B>(tables, last, TRIAL)?;
    Ok(ScoreVariance::estimate(last.0, last, (&trial, TRIAL)).best_steps(REST))
}

/// The neighbour equation with so many rays a score.
fn made<'a, F: Real, const B: usize>(
    tables: &'a SampledTables<F>,
    last: &LastStep<'a, Radiosity<'a, F>>,
    rays: NonZeroU32,
) -> Result<Sampled<'a, F, Radiosity<'a, F>, 2, B, Radiosity<'a, F>>, Error> {
    let of = (last.0, last.0);
    let sampled = tables.neighbour_with_events::<_, _, 2, B>(of, rays);
    sampled.map_err(|_| Error::Internal("tables of other cells"))
}

/// Hands out the neighbour equation of walks that know what is known of their score.
pub(crate) fn with_neighbour<F: Real>(
    degree: usize,
    tables: &SampledTables<F>,
    last: &LastStep<'_, Radiosity<'_, F>>,
    then: &mut dyn FnMut(&Boxed<'_, F>) -> Result<(), Error>,
) -> Result<(), Error> {
    of_degree!(degree, B => then(&WithKnown(&sampled::<F, B>(tables, last)?)))
}

/// Hands out the neighbour equation on points of the scene alone.
pub(crate) fn with_sampled<F: Real>(
    degree: usize,
    tables: &SampledTables<F>,
    last: &LastStep<'_, Radiosity<'_, F>>,
    then: &mut dyn FnMut(&OnPoints<'_, F>) -> Result<(), Error>,
) -> Result<(), Error> {
    of_degree!(degree, B => then(&sampled::<F, B>(tables, last)?))
}

/// v and c of a scene.
pub(crate) struct SceneSystem<'m> {
    pub(crate) model: &'m SceneModel,
    pub(crate) cut: Arc<Cut>,
    pub(crate) solution: SampledSolution,
    /// The largest ρ if it is below 1; otherwise the spectral radius of T_K as rays from few cells have it.
    pub(crate) radius_bound: f64,
}

impl SceneSystem<'_> {
    fn job_in<F: Real>(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let tables = WalkTables::<F>::new(self.model.scene(), &self.cut)?;
        let radiosity = tables.radiosity(&self.cut, request.walk.absorption)?;
        let last = LastStep(&radiosity);
        let vectors = self.solution.for_walks::<F>()?;
        let wide = self.cut.radiosity(request.walk.absorption)?;
        let v: Vec<f64> = vectors.v().iter().map(|v| v.to_f64()).collect();
        let places = self.model.places(request)?;
        with_neighbour(self.cut.degree, &vectors, &last, &mut |neighbour| {
            let mut galerkin = Vec::with_capacity(request.goals.len());
            let mut control_means = Vec::with_capacity(places.len());
            for place in &places {
                let known = place.known(&radiosity);
                let value = |start| neighbour.value(&neighbour.locate(start)).to_f64();
                let mean = match *place {
                    Place::Point(face, position) => {
                        let point = radiosity.at(face, position)?;
                        let known = F::from_f64(known);
                        Some(value(Started { point, known }))
                    }
                    Place::Faces(ref faces) => Some(known + mean(&wide, faces, &v)),
                    Place::Air(_) | Place::Facing(..) => None,
                };
                control_means.push(mean);
                if galerkin.len() < request.goals.len() {
                    galerkin.push(match (mean, place) {
                        (None, Place::Air(position)) => {
                            let position = position.map(F::from_f64);
                            let air = Air {
                                radiosity: &radiosity,
                                position,
                            };
                            seen_of(&air, &value)
                        }
                        (None, Place::Facing(position, direction)) => {
                            facing_of(&Facing::new(&radiosity, *position, *direction)?, &value)
                        }
                        (mean, _) => mean.unwrap_or(f64::NAN),
                    });
                }
            }
            with_job(
                (self.model, &places),
                (&radiosity, &last, neighbour),
                request,
                &control_means,
                &mut |job| {
                    then(&Prepared {
                        job,
                        galerkin: &galerkin,
                        largest: fredholm_model::numbers::largest(vectors.v()),
                        radius_bound: self.radius_bound,
                        convergence: self.solution.convergence(),
                        pointwise: NO_PAIRS,
                        neighbour_second_moment_radius: None,
                        pair_counts: None,
                    })
                },
            )
        })
    }
}

/// Directions along each of two coordinates in which v is looked at from a point in the air.
const LOOKS: u32 = 64;

/// (v, Φ) of a point in the air, about: what rays in many directions meet.
fn seen_of<F: Real>(air: &Air<'_, F>, value: &dyn Fn(Started<Point<F>, F>) -> f64) -> f64 {
    let middle = |i: u32| F::from_f64((f64::from(i) + 0.5) / f64::from(LOOKS));
    let looks = (0..LOOKS * LOOKS).map(|i| {
        let (start, phi) = air.at([middle(i / LOOKS), middle(i % LOOKS)]);
        phi.to_f64() * value(start)
    });
    looks.sum::<f64>() / f64::from(LOOKS * LOOKS)
}

/// Calls `look` with what a point in the air sees in many directions, and with the share of φ that each has.
pub(crate) fn look_around<F: Real>(air: &Air<'_, F>, look: &mut dyn FnMut(Point<F>, f64)) {
    let middle = |i: u32| F::from_f64((f64::from(i) + 0.5) / f64::from(LOOKS));
    for i in 0..LOOKS * LOOKS {
        let (start, phi) = air.at([middle(i / LOOKS), middle(i % LOOKS)]);
        look(start.point, phi.to_f64() / f64::from(LOOKS * LOOKS));
    }
}

/// (v, Φ) of what faces in a direction, about: as many starts of walks.
fn facing_of<F: Real>(facing: &Facing<'_, F>, value: &dyn Fn(Started<Point<F>, F>) -> f64) -> f64 {
    let seeds = WalkSeeds::<DefaultGenerator>::new(0, 0);
    let mut draws = RngUniforms(seeds.generator(0));
    let looks = (0..LOOKS * LOOKS).map(|_| {
        let (start, phi) = facing.draw(&mut draws);
        phi.to_f64() * value(start)
    });
    looks.sum::<f64>() / f64::from(LOOKS * LOOKS)
}

/// The mean of v over some faces: ψ_0 = 1, and the other functions have the mean 0.
pub(crate) fn mean(radiosity: &Radiosity<'_, f64>, faces: &[u32], v: &[f64]) -> f64 {
    let mut is_in = vec![false; radiosity.geometry().faces().len()];
    for &face in faces {
        if let Some(is_in) = is_in.get_mut(face as usize) {
            *is_in = true;
        }
    }
    let functions = v.len() / radiosity.cells().max(1);
    let (mut sum, mut area) = (0.0, 0.0);
    for cell in 0..radiosity.cells() {
        let face = radiosity.point(cell, &[0.5, 0.25]).face;
        if is_in.get(face as usize) == Some(&true) {
            let measure = radiosity.measure(cell);
            sum += measure * v.get(cell * functions).copied().unwrap_or(f64::NAN);
            area += measure;
        }
    }
    sum / area
}

/// Prepares the walks of all places, (v, Φ) of which is known or not, and of irradiances that do not follow from u there.
pub(crate) fn with_job<'a, F: Real>(
    (model, places): (&SceneModel, &'a [Place]),
    (radiosity, last, neighbour): (
        &'a Radiosity<'a, F>,
        &LastStep<'a, Radiosity<'a, F>>,
        &Boxed<'_, F>,
    ),
    request: &Request<'_>,
    control_means: &[Option<f64>],
    then: &mut dyn FnMut(&dyn Job) -> Result<(), Error>,
) -> Result<(), Error> {
    let ends = places
        .iter()
        .map(|place| place.areas(radiosity))
        .collect::<Result<Vec<Vec<F>>, Error>>()?;
    let starts = places
        .iter()
        .zip(&ends)
        .map(|(place, ends)| place.start(radiosity, ends))
        .collect::<Result<Vec<Start<'_, F>>, Error>>()?;
    let mut goals: Vec<_> = starts
        .iter()
        .zip(control_means)
        .map(|(&functional, &control_mean)| fredholm_core::Goal {
            functional,
            control_mean,
        })
        .collect();
    let regions = model.regions(request.goals, request.only_u);
    for (region, start) in regions.iter().zip(&starts) {
        if model.takes_walks(region, request.only_u) {
            goals.push(fredholm_core::Goal {
                functional: start.irradiance(radiosity),
                control_mean: None,
            });
        }
    }
    let options = request.walk.for_core();
    let equation = WithKnown(last);
    then(&Goals::new(&equation, neighbour, &goals, options))
}

impl System for SceneSystem<'_> {
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        check_plain_variance(self.model.scene(), walk.absorption)
    }

    fn job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        in_scalar!(self.cut.scalar, F => self.job_in::<F>(request, then))
    }

    fn whole<'s>(self: Box<Self>) -> Result<Box<dyn WholeSystem<'s> + 's>, Error>
    where
        Self: 's,
    {
        Ok(Box::new(SceneWhole::new(*self)?))
    }

    fn examine(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.examine_drawn(request, nodes, then)
    }

    fn saved(&self) -> Option<SavedSystem<'_>> {
        Some(SavedSystem {
            solution: Cow::Owned(Solution {
                v: self.solution.v().to_vec(),
                convergence: self.solution.convergence(),
                radius_bound: self.radius_bound,
            }),
            coefficients: Cow::Borrowed(self.solution.control()),
            views: Cow::Borrowed(&[]),
        })
    }

    fn tables(&self, _: Pairs, absorption: f64) -> Result<TableBuilder, Error> {
        match self.cut.scalar {
            Scalar::F32 => crate::export::scene::<f32>(self, absorption),
            Scalar::F64 => crate::export::scene::<f64>(self, absorption),
        }
    }
}
