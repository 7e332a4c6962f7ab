//! A solved scene, and its walks.

use core::num::NonZeroU32;
use std::borrow::Cow;
use std::sync::Arc;

use fredholm_core::galerkin::{CellMap, Partition, Solution};
use fredholm_core::sampled::SampledSolution;
use fredholm_core::{Goals, Job, KnownPart, LastStep, Neighbour, Real, Started, WithKnown};
use fredholm_embedded::TableBuilder;
use fredholm_model::{
    Error, Examined, Pairs, Prepared, Request, SavedSystem, Subject, System, Then, WalkOptions,
    in_scalar,
};
use fredholm_scene::{Point, Radiosity, Scene};

use crate::of_degree;
use crate::partition::{Cut, NO_PAIRS, NO_PREDICTION, WalkTables};
use crate::radius::second_moment_radius;
use crate::regions::Place;

/// Rays of a score. Of 1, 4 and 16 this has the least error at equal time in an empty cube and in a Cornell box, at degrees
/// 0 and 1 with 600 to 5,000 cells, or nearly so.
const STEPS: NonZeroU32 = NonZeroU32::MIN.saturating_add(3);

/// v and c of a scene.
pub(crate) struct SceneSystem<'m> {
    pub(crate) scene: &'m Scene,
    pub(crate) cut: Arc<Cut>,
    pub(crate) solution: SampledSolution,
}

impl SceneSystem<'_> {
    fn job_in<F: Real, const B: usize>(
        &self,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error> {
        let tables = WalkTables::<F>::new(self.scene, &self.cut)?;
        let radiosity = tables.radiosity(&self.cut, request.walk.absorption)?;
        let last = LastStep(&radiosity);
        let vectors = self.solution.for_walks::<F>()?;
        let sampled = vectors.neighbour::<_, 2, B>(&radiosity, STEPS);
        let sampled = sampled.map_err(|_| Error::Internal("tables of other cells"))?;
        let neighbour = WithKnown(&sampled);
        let wide = self.cut.radiosity(request.walk.absorption)?;
        let v: Vec<f64> = vectors.v().iter().map(|v| v.to_f64()).collect();
        let mut galerkin = Vec::with_capacity(request.goals.len());
        for goal in request.goals {
            let place = Place::new(self.scene, &goal.region)?;
            galerkin.push(match place {
                Place::Point(face, position) => {
                    let point = radiosity.at(face, position)?;
                    let known = F::from_f64(place.emission(self.scene));
                    let start = neighbour.locate(Started { point, known });
                    neighbour.value(&start).to_f64()
                }
                Place::Faces(ref faces) => place.emission(self.scene) + mean::<B>(&wide, faces, &v),
            });
        }
        with_job(
            self.scene,
            (&radiosity, &last, &neighbour),
            request,
            &galerkin,
            &mut |job| {
                then(&Prepared {
                    job,
                    galerkin: &galerkin,
                    largest: fredholm_model::numbers::largest(vectors.v()),
                    radius_bound: self.largest_reflectance(),
                    convergence: self.solution.convergence(),
                    pointwise: NO_PAIRS,
                    neighbour_second_moment_radius: None,
                    pair_counts: None,
                })
            },
        )
    }

    fn largest_reflectance(&self) -> f64 {
        let faces = self.scene.faces().iter();
        faces.fold(0.0, |m: f64, face| m.max(face.reflectance))
    }
}

/// The mean of v over some faces: ψ_0 = 1, and the other functions have the mean 0.
fn mean<const B: usize>(radiosity: &Radiosity<'_, f64>, faces: &[u32], v: &[f64]) -> f64 {
    let (mut sum, mut area) = (0.0, 0.0);
    for cell in 0..radiosity.cells() {
        let face = radiosity.point(cell, &[0.5, 0.25]).face;
        if faces.contains(&face) {
            let measure = radiosity.measure(cell);
            sum += measure * v.get(cell * B).copied().unwrap_or(f64::NAN);
            area += measure;
        }
    }
    sum / area
}

/// Prepares the walks of all goals, (v, Φ) of which is known.
pub(crate) fn with_job<'a, F: Real, N>(
    scene: &Scene,
    (radiosity, last, neighbour): (&'a Radiosity<'a, F>, &LastStep<'a, Radiosity<'a, F>>, &N),
    request: &Request<'_>,
    galerkin: &[f64],
    then: &mut dyn FnMut(&dyn Job) -> Result<(), Error>,
) -> Result<(), Error>
where
    N: Neighbour<Scalar = F, Point = Started<Point<F>, F>> + Sync,
{
    let places = request
        .goals
        .iter()
        .map(|goal| Place::new(scene, &goal.region))
        .collect::<Result<Vec<Place>, Error>>()?;
    let mut goals = Vec::with_capacity(places.len());
    for (place, &galerkin) in places.iter().zip(galerkin) {
        goals.push(fredholm_core::Goal {
            functional: KnownPart {
                functional: place.start(radiosity)?,
                known: F::from_f64(place.emission(scene)),
            },
            control_mean: Some(galerkin),
        });
    }
    let options = request.walk.for_core();
    let equation = WithKnown(last);
    then(&Goals::new(&equation, neighbour, &goals, options))
}

impl System for SceneSystem<'_> {
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        let absorption = walk.absorption;
        fredholm_model::finite::check_plain("reflectance²/(1 − absorption)", absorption, || {
            second_moment_radius(self.scene, absorption)
        })
    }

    fn job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        in_scalar!(self.cut.scalar, F => of_degree!(self.cut.degree, B => self.job_in::<F, B>(request, then)))
    }

    fn examine(
        &self,
        _: &Request<'_>,
        _: usize,
        _: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        Err(NO_PREDICTION())
    }

    fn saved(&self) -> Option<SavedSystem<'_>> {
        Some(SavedSystem {
            solution: Cow::Owned(Solution {
                v: self.solution.v().to_vec(),
                convergence: self.solution.convergence(),
                radius_bound: self.largest_reflectance(),
            }),
            coefficients: Cow::Borrowed(self.solution.control()),
            views: Cow::Borrowed(&[]),
        })
    }

    fn tables(&self, _: Pairs, _: f64) -> Result<TableBuilder, Error> {
        Err(Error::Option {
            subject: Subject::Problem,
            message: "there are no device tables of scenes".to_owned(),
        })
    }
}
