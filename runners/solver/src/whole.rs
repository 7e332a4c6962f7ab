//! The whole function u from one set of walks.

mod summary;

use core::fmt::{self, Debug};
use std::time::Instant;

use fredholm_core::whole::{WholeJob, band_factor, over_replicates};
use fredholm_core::{DEFAULT_GENERATOR, rounding_floor};
use fredholm_model::memory::refuse_beyond_memory;
use fredholm_model::{IMAGE_HEAD, WholeField, WholeQuantity, WholeRequest, WholeSystem};
use fredholm_rayon::Replicates;
use serde::Serialize;

use crate::answer::SolveObserver;
use crate::point::Point;
use crate::solver::Solver;
use crate::systems::Systems;
use crate::{
    Choices, Error, Goal, Model, Pairs, Region, Scalar, Settings, SolveError, Subject, Tolerance,
};
pub use summary::WholeSummary;

/// Replicates: an error bar of 64 is itself uncertain by 9 %, and Student's t of 63 degrees of freedom is 2 % wider than the
/// normal distribution. More make every value dearer.
const REPLICATES: usize = 64;

/// The probability with which a band holds at all points together.
const BAND_LEVEL: f64 = WholeFunction::BAND_LEVEL;

/// The fewest walks of a replicate.
const LEAST_WALKS: u64 = 16;
/// Resamples for a band: they fix its level to 0.7 %.
const RESAMPLES: usize = 1000;
/// Points, about, at which error bars are looked at for the band and for a tolerance.
const PROBES: f64 = 256.0;
/// Points at which the quadrature of T_K is compared with a finer one.
const QUADRATURE_PROBES: usize = 8;
/// The part of a standard error that quadrature may be off.
const QUADRATURE_SHARE: f64 = 0.01;
/// The share of a replicate's walks that one round adds: as long a cancellation may wait.
const ROUND: u64 = 8;

/// A value of a [`WholeFunction`]: of u at a point, or of a functional.
///
/// ```
/// use fredholm::{CubeModel, Solver};
///
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let value = Solver::new(&u).cells(4).walks(5000).whole()?.at(0.5)?;
/// assert_eq!(value.interval().map(|[low, high]| low <= value.estimate && value.estimate <= high), Some(true));
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WholeValue {
    /// The estimate ũ = F + T_K v + T_K ê, unbiased but for what the summary tells.
    pub estimate: f64,
    /// The standard error over replicates, in the unit of u. `None`: no walk has scored.
    pub std_error: Option<f64>,
    /// Half of the width of the band that holds at all points of the space together, in the unit of u; of a functional there
    /// is none.
    pub band: Option<f64>,
    /// The deterministic part F + T_K v, often better than affordable walks and without any error bar.
    pub iterate: f64,
    /// How far the iterate of a mean moved with the last finer rule in x, and that of a point in the air with the highest
    /// degree; 0 at a point of the space.
    pub quadrature_error: f64,
}

impl WholeValue {
    /// The ends of the band. `None`: the value is of a functional, or no walk has scored.
    #[must_use]
    pub fn interval(&self) -> Option<[f64; 2]> {
        let band = self.band?;
        Some([self.estimate - band, self.estimate + band])
    }
}

/// The whole function u with an error band, from one set of walks: [`Solver::whole`](crate::Solver::whole) makes one.
///
/// ũ = F + T_K v + T_K ê, where v is the Galerkin solution and ê what the walks estimate of e = u − v: `core::whole` has
/// the mathematics, and the manual's page `whole.md` says when it is right.
///
/// ```
/// use fredholm::circle::{Emission, Harmonic};
/// use fredholm::{CircleModel, Solver};
///
/// let light = Harmonic { constant: 5.0, amplitude: 1.0, frequency: 5 };
/// let u = CircleModel::new(vec![0.3, 0.7], Emission::Harmonic(light));
/// let whole = Solver::new(&u).cells(100).walks(100_000).whole()?;
/// // Any point, after the walks: u(s) = 5 + sin 5s.
/// for i in 0..100 {
///     let s = 0.06 * f64::from(i);
///     let u = whole.at(s)?;
///     assert!((u.estimate - light.solution(s)).abs() < u.band.unwrap() && u.band.unwrap() < 2e-3);
/// }
/// # Ok::<(), fredholm::SolveError>(())
/// ```
pub struct WholeFunction<'m> {
    model: &'m dyn Model,
    field: Box<dyn WholeField + 'm>,
    summary: WholeSummary,
}

impl Debug for WholeFunction<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("WholeFunction")
            .field("summary", &self.summary)
            .finish_non_exhaustive()
    }
}

impl WholeFunction<'_> {
    /// The probability with which a band holds at all points together.
    pub const BAND_LEVEL: f64 = 0.95;

    /// The function's summary.
    #[must_use]
    pub const fn summary(&self) -> &WholeSummary {
        &self.summary
    }

    pub(crate) fn model(&self) -> &dyn Model {
        self.model
    }

    /// u at a point: see [`Point`]. To ask for many points, [`values`](Self::values) is faster.
    ///
    /// # Errors
    /// [`Error::Region`]: the space has no such point.
    pub fn at(&self, point: impl Into<Point>) -> Result<WholeValue, Error> {
        self.functional(&self.model.point(&point.into().0))
    }

    /// (u, Φ) for a region: the mean over the whole space ([`Model::whole`]) or over a part, an integral with a weight, a
    /// point.
    ///
    /// # Errors
    /// [`Error::Region`]: the space has no such region.
    pub fn functional(&self, region: &Region) -> Result<WholeValue, Error> {
        let values = self.values(core::slice::from_ref(region))?;
        values
            .first()
            .copied()
            .ok_or(Error::Internal("a region without a value"))
    }

    /// The values of several regions, on all threads.
    ///
    /// # Errors
    /// [`Error::Region`]: the space has no such region.
    pub fn values(&self, regions: &[Region]) -> Result<Vec<WholeValue>, Error> {
        self.quantities(WholeQuantity::U, regions)
    }

    /// The irradiance of a point of a wall, or of walls in the mean, in rooms.
    ///
    /// # Errors
    /// [`Error::Region`]: the space has no such region, or no light falls on it.
    pub fn irradiance(&self, region: &Region) -> Result<WholeValue, Error> {
        self.heat(WholeQuantity::Irradiance, region)
    }

    /// The net flux out of a wall at a point, in the unit of u, or out of walls, in that times a length, in rooms: what they
    /// emit minus what they absorb. Over all walls of a closed room it is 0 up to its error.
    ///
    /// ```
    /// use fredholm::room::{Material, Surfaces};
    /// use fredholm::{Region, RoomModel, Scalar, Solver};
    ///
    /// let floor = Material { reflectance: 0.5, emission: 1.0 };
    /// let walls = Material { reflectance: 0.5, emission: 0.0 };
    /// let square = Surfaces::default()
    ///     .with("floor", &[[0.0, 0.0], [1.0, 0.0]], floor)
    ///     .with("walls", &[[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]], walls);
    /// let room = RoomModel::new(square, Scalar::F64)?;
    /// let whole = Solver::new(&room).cells(40).walks(20_000).whole()?;
    /// let (floor, all) = (whole.net_flux(&Region::Part(0))?, whole.net_flux(&Region::Whole)?);
    /// assert!(floor.estimate > 0.5);
    /// assert!(all.estimate.abs() < 5.0 * all.std_error.unwrap());
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    ///
    /// # Errors
    /// As [`irradiance`](Self::irradiance).
    pub fn net_flux(&self, region: &Region) -> Result<WholeValue, Error> {
        self.heat(WholeQuantity::NetFlux, region)
    }

    fn heat(&self, quantity: WholeQuantity, region: &Region) -> Result<WholeValue, Error> {
        if !self.model.has_irradiance(region) {
            return Err(Error::Region {
                message: "irradiances and net fluxes are those of walls of a room".to_owned(),
            });
        }
        let values = self.quantities(quantity, core::slice::from_ref(region))?;
        let value = values.first().copied();
        value.ok_or(Error::Internal("a region without a value"))
    }

    /// A quantity of several regions, on all threads.
    pub(crate) fn quantities(
        &self,
        quantity: WholeQuantity,
        regions: &[Region],
    ) -> Result<Vec<WholeValue>, Error> {
        let goal = |region: &Region| Goal {
            name: "u".to_owned(),
            region: region.clone(),
        };
        let goals: Vec<Goal> = regions.iter().map(goal).collect();
        self.model.check_goals(&goals)?;
        if regions.is_empty() {
            return Ok(Vec::new());
        }
        let images = self.field.images(quantity, regions)?;
        let width = IMAGE_HEAD + self.field.rows();
        let all = images.chunks_exact(width).zip(regions);
        let values = all.map(|(image, region)| {
            let has_band = quantity == WholeQuantity::U && self.model.is_in_space(region);
            self.value(image, has_band)
        });
        Ok(values.collect())
    }

    /// u at so many equally spaced points of the space, of a cube per axis, and where they are.
    ///
    /// # Errors
    /// [`Error`].
    pub fn grid(&self, points: usize) -> Result<Vec<(Region, WholeValue)>, Error> {
        let regions = self.model.grid(points, None);
        let values = self.values(&regions)?;
        Ok(regions.into_iter().zip(values).collect())
    }

    fn value(&self, image: &[f64], has_band: bool) -> WholeValue {
        let ([iterate, quadrature_error], replicates) = split(image, self.summary.replicates);
        let correction = over_replicates(replicates);
        let has_scored = self.summary.largest_std_error.is_some();
        let std_error = has_scored.then_some(correction.std_error);
        let factor = self.summary.band_factor.filter(|_| has_band);
        WholeValue {
            estimate: iterate + correction.mean,
            std_error,
            band: factor.zip(std_error).map(|(factor, error)| factor * error),
            iterate,
            quadrature_error,
        }
    }
}

/// F + T_K v and its error by quadrature in x, and T_K ê of every replicate.
fn split(image: &[f64], replicates: usize) -> ([f64; IMAGE_HEAD], &[f64]) {
    match image.split_first_chunk() {
        Some((head, rest)) => (*head, rest.get(..replicates).unwrap_or_default()),
        None => ([f64::NAN; IMAGE_HEAD], &[]),
    }
}

impl<'m> Solver<'m> {
    /// Sets the degree of the polynomials on whose coefficients the walks of a whole function score: above that of v,
    /// by two otherwise.
    pub fn score_degree(mut self, degree: usize) -> Self {
        self.settings.score_degree = Some(degree);
        self
    }

    /// The whole function u with its error band, from one set of walks, for circles, spheres, cubes and rooms. What is asked for otherwise
    /// plays no part. What is open has its default: nothing is chosen. The number of walks is that of all, rounded up to
    /// equally many of each of 64 replicates; a tolerance is for every point.
    ///
    /// If walks end before a tolerance is reached, at a time limit or because somebody cancels, the function is that of the
    /// walks so far, and its summary says so.
    ///
    /// ```
    /// use fredholm::{CubeModel, Model, Solver};
    ///
    /// // u = 6x/5.
    /// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    /// let whole = Solver::new(&u).cells(10).walks(20_000).whole()?;
    /// for (x, value) in [(0.1, 0.12), (0.35, 0.42), (0.9, 1.08)] {
    ///     let u = whole.at(x)?;
    ///     assert!((u.estimate - value).abs() <= u.band.unwrap() && u.band.unwrap() < 1e-3);
    /// }
    /// let mean = whole.functional(&u.whole())?;
    /// assert!((mean.estimate - 0.6).abs() < 5.0 * mean.std_error.unwrap());
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn whole(&self) -> Result<WholeFunction<'m>, SolveError> {
        self.check()?;
        Whole {
            model: self.model,
            settings: &self.settings,
            watch: self.watch,
            systems: self.systems,
        }
        .function()
    }
}

/// What the walks of a whole function depend on.
struct Whole<'a, 'm> {
    model: &'m dyn Model,
    settings: &'a Settings,
    watch: &'a dyn SolveObserver,
    systems: Systems<'m>,
}

/// The walks so far, and why they ended.
struct Walked {
    replicates: Replicates,
    coefficients: Vec<f64>,
    stop: &'static str,
    seconds: f64,
}

impl<'m> Whole<'_, 'm> {
    /// Sets up, walks, and makes the function.
    fn function(&self) -> Result<WholeFunction<'m>, SolveError> {
        let start = Instant::now();
        if !self.model.has_whole() {
            return Err(Error::Option {
                subject: Subject::Problem,
                message: "the whole function from one set of walks is offered for circles, spheres, rooms, and cubes \
                          whose kernel has no singularity at x = y: ask for targets without it"
                    .to_owned(),
            }
            .into());
        }
        let (cut, mut walk) = (self.settings.discretisation(), self.settings.walk_options());
        if self.settings.lift.is_none() {
            walk.pairs = self.settings.pairs.unwrap_or(self.model.whole_pairs());
        }
        if walk.pairs == Pairs::Theory {
            return Err(Error::Option {
                subject: Subject::Pairs,
                message: "\"theory\" chooses pairs for targets, and the whole function has none: use \"default\""
                    .to_owned(),
            }
            .into());
        }
        if self.settings.exact_source == Some(true) {
            return Err(Error::Option {
                subject: Subject::ExactSource,
                message: "the whole function is not offered with an exact source: leave `exact_source` out"
                    .to_owned(),
            }
            .into());
        }
        let cells = self.model.partition(&cut)?;
        let needed = cells.memory(&[], walk.pairs);
        let what = || format!("{} unknowns", cells.unknowns());
        let advice = self.model.about().less_memory;
        refuse_beyond_memory(what, needed, advice)?;
        if !walk.allow_infinite_variance {
            cells.check_variance(&walk)?;
        }
        let system = self.systems.lifted(&*cells, self.settings)?.whole()?;
        let request = WholeRequest {
            walk: &walk,
            degree: self.score_degree(&*system)?,
        };
        let degrees = system.degrees(request.degree);
        // Sums, coefficients, and what makes T_K of them.
        let numbers = system.cells() * degrees.len() * (REPLICATES + 2);
        let what = || {
            format!(
                "{REPLICATES} replicates of {} scores",
                degrees.len() * system.cells()
            )
        };
        refuse_beyond_memory(what, numbers.saturating_mul(3 * 8), advice)?;
        let setup_seconds = start.elapsed().as_secs_f64();
        let walked = self.walk(&*system, &request)?;
        let after = Instant::now();
        let mut rows = walked.coefficients;
        rows.extend(highest(&rows, &degrees, system.cells()));
        let field = system.field(&request, rows)?;
        let counts = walked.replicates.counts();
        let about = self.model.about();
        let mut whole = WholeFunction {
            model: self.model,
            field,
            summary: WholeSummary {
                problem: about.kind,
                dimension: about.dimension,
                cells: cells.cells(),
                unknowns: cells.unknowns(),
                degree: cut.degree,
                lift: self.settings.lift,
                score_degree: request.degree,
                pairs: walk.pairs.word(),
                absorption: walk.absorption,
                estimator: walk.estimator.word(),
                scalar: self.settings.scalar.word(),
                generator: DEFAULT_GENERATOR,
                sequence: walk.sequence_word(),
                survivals: walk.survivals,
                seed: walk.seed,
                stop: walked.stop,
                replicates: REPLICATES,
                walks: counts.walks,
                states: counts.states,
                step_limit: counts.step_limit,
                largest_std_error: (counts.scored > 0).then_some(0.0),
                band_factor: None,
                band_level: BAND_LEVEL,
                truncation: 0.0,
                quadrature_error: None,
                rounding_floor: 0.0,
                setup_seconds,
                walk_seconds: walked.seconds,
                band_seconds: 0.0,
            },
        };
        let [largest, radius_bound] = system.sizes();
        whole.summary.rounding_floor = match self.settings.scalar {
            Scalar::F32 => rounding_floor::<f32>(largest, largest, radius_bound),
            Scalar::F64 => rounding_floor::<f64>(largest, largest, radius_bound),
        };
        self.finish(&mut whole)?;
        whole.summary.band_seconds = after.elapsed().as_secs_f64();
        Ok(whole)
    }

    fn score_degree(&self, system: &dyn WholeSystem<'_>) -> Result<usize, Error> {
        let (own, most) = (system.degree(), system.most_degree());
        match self.settings.score_degree {
            None if own < most => Ok(system.default_degree()),
            None => Err(Error::Option {
                subject: Subject::Degree,
                message: format!(
                    "walks of a whole function score on polynomials of a higher degree than v, and {most} is the highest \
                     here: use a `degree` of at most {}",
                    most - 1
                ),
            }),
            Some(degree) if degree > own && degree <= most => Ok(degree),
            Some(degree) => Err(Error::Option {
                subject: Subject::Degree,
                message: format!(
                    "scores of degree {degree}: they must be of a higher degree than v, which has {own}, and at most \
                     {most}"
                ),
            }),
        }
    }

    /// The points at which error bars are looked at.
    fn probes(&self) -> Vec<Region> {
        self.model.spread(PROBES)
    }

    fn walk(
        &self,
        system: &dyn WholeSystem<'m>,
        request: &WholeRequest<'_>,
    ) -> Result<Walked, SolveError> {
        let start = Instant::now();
        let mut walked = None;
        self.watch.walking();
        system.walks(request, &mut |job| {
            let mut replicates = Replicates::new(job, REPLICATES);
            let stop = self.run(system, request, job, &mut replicates, start)?;
            let coefficients = replicates.coefficients(job, &|cell| system.measure(cell));
            walked = Some(Walked {
                replicates,
                coefficients,
                stop,
                seconds: start.elapsed().as_secs_f64(),
            });
            Ok(())
        })?;
        Ok(walked.ok_or(Error::Internal("no walks were prepared"))?)
    }

    /// Walks until the tolerance is reached, or to the end.
    fn run(
        &self,
        system: &dyn WholeSystem<'m>,
        request: &WholeRequest<'_>,
        job: &dyn WholeJob,
        replicates: &mut Replicates,
        start: Instant,
    ) -> Result<&'static str, Error> {
        let walk = request.walk;
        let most = walk.walks.div_ceil(REPLICATES as u64).max(LEAST_WALKS);
        let mut done = 0;
        let mut goal = match walk.tolerance {
            // Enough for an error bar, which tells how many more.
            Some(_) => most.min(walk.batch.div_ceil(REPLICATES as u64).max(4 * LEAST_WALKS)),
            None => most,
        };
        loop {
            while done < goal {
                let round = (done / ROUND).max(LEAST_WALKS).min(goal - done);
                replicates.run(job, round, self.watch)?;
                done += round;
                if self.watch.cancelled() {
                    return Ok("cancelled");
                }
                if walk
                    .time_limit
                    .is_some_and(|limit| start.elapsed() >= limit)
                    && done < most
                {
                    return Ok("time_limit");
                }
            }
            let Some(tolerance) = walk.tolerance else {
                return Ok("done");
            };
            let coefficients = replicates.coefficients(job, &|cell| system.measure(cell));
            let field = system.field(request, coefficients)?;
            let excess = excess(&*field, &self.probes(), tolerance)?;
            if excess <= 1.0 && replicates.counts().scored > 0 {
                return Ok("done");
            }
            if done >= most {
                return Ok("error_not_reached");
            }
            // 10 % more than the error bar says, which is itself uncertain by 9 %.
            let factor = (1.1 * excess * excess).clamp(1.1, 64.0);
            goal = ((done as f64 * factor).ceil() as u64)
                .max(done + 1)
                .min(most);
        }
    }

    /// The error bars at the probes, the band, and what no band sees.
    fn finish(&self, whole: &mut WholeFunction<'m>) -> Result<(), Error> {
        let probes = self.probes();
        let images = whole.field.images(WholeQuantity::U, &probes)?;
        let width = IMAGE_HEAD + whole.field.rows();
        let mut values = Vec::with_capacity(probes.len() * REPLICATES);
        let mut errors = Vec::with_capacity(probes.len());
        for image in images.chunks_exact(width) {
            let (_, replicates) = split(image, REPLICATES);
            errors.push(over_replicates(replicates).std_error);
            values.extend(replicates);
            let moved = image.last().copied().unwrap_or(f64::NAN).abs();
            whole.summary.truncation = whole.summary.truncation.max(moved);
        }
        if whole.summary.largest_std_error.is_none() {
            return Ok(());
        }
        let largest = errors.iter().fold(0.0, |m: f64, error| m.max(*error));
        whole.summary.largest_std_error = Some(largest);
        let mut resamples = vec![0.0; RESAMPLES];
        let seed = self.settings.seed;
        let factor = band_factor(&mut values, REPLICATES, BAND_LEVEL, seed, &mut resamples);
        whole.summary.band_factor = Some(factor);
        errors.sort_unstable_by(f64::total_cmp);
        let median = errors.get(errors.len() / 2).copied().unwrap_or(0.0);
        let some = probes.len().div_ceil(QUADRATURE_PROBES).max(1);
        let some: Vec<Region> = probes.into_iter().step_by(some).collect();
        let moved = whole.field.refine(&some, QUADRATURE_SHARE * median)?;
        whole.summary.quadrature_error = Some(moved).filter(|moved| moved.is_finite());
        Ok(())
    }
}

/// The largest standard error at these points, over the one that the tolerance asks for.
fn excess(field: &dyn WholeField, probes: &[Region], tolerance: Tolerance) -> Result<f64, Error> {
    let images = field.images(WholeQuantity::U, probes)?;
    let width = IMAGE_HEAD + field.rows();
    let ratios = images.chunks_exact(width).map(|image| {
        let ([iterate, _], replicates) = split(image, REPLICATES);
        let correction = over_replicates(replicates);
        let bound = match tolerance {
            Tolerance::Absolute(bound) => bound,
            Tolerance::Relative(bound) => bound * (iterate + correction.mean).abs(),
        };
        if correction.std_error == 0.0 {
            0.0
        } else {
            correction.std_error / bound
        }
    });
    Ok(ratios.fold(0.0, f64::max))
}

/// The part of the highest degree of the mean of all replicates.
fn highest(coefficients: &[f64], degrees: &[usize], cells: usize) -> Vec<f64> {
    let top = degrees.iter().copied().max().unwrap_or(0);
    let unknowns = cells * degrees.len();
    let mut mean = vec![0.0; unknowns];
    for row in coefficients.chunks_exact(unknowns.max(1)) {
        for ((mean, value), degree) in mean.iter_mut().zip(row).zip(degrees.iter().cycle()) {
            if *degree == top {
                *mean += value / REPLICATES as f64;
            }
        }
    }
    mean
}
