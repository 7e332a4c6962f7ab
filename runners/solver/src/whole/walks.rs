//! The walks of a global estimate, and the function that they make.

use web_time::Instant;

use fredholm_core::global::{GlobalJob, ReplicateCounts, Replicated, band_factor, over_replicates};
use fredholm_core::{Absorption, Estimator, Real, Tolerance, rounding_floor};
use fredholm_model::memory::refuse_beyond_memory;
use fredholm_model::{
    GlobalField, GlobalQuantity, GlobalRequest, GlobalSystem, IMAGE_HEAD, WholeValues, in_scalar,
};
use fredholm_rayon::Replicates;

use super::looks::{Look, Looks, MOVED, highest_parts};
use super::{
    BAND_LEVEL, GlobalEstimate, GlobalSummary, GlobalValue, PROBES, QUADRATURE_SHARE, REPLICATES,
    split,
};
use crate::answer::SolveObserver;
use crate::report::ChainReport;
use crate::systems::Systems;
use crate::{
    Error, Model, Partitioned, Region, Scalar, Sequence, Settings, SolveError, Subject, WalkOptions,
};
use fredholm_core::StopReason;

/// The fewest walks of a replicate.
const LEAST_WALKS: u64 = 16;
/// Resamples for a band: they fix its level to 0.7 %.
const RESAMPLES: usize = 1000;
/// Points at which the quadrature of T_K is compared with a finer one.
const QUADRATURE_PROBES: usize = 8;
/// The most cells of a mesh at which error bars are looked at for a band: resamples of so many take a second.
const CELLS: usize = 4096;
/// The share of a replicate's walks that one round adds: as long a cancellation may wait.
const ROUND: u64 = 8;
/// The bounds of the absorption that is chosen: walks of one state see nothing of T_K, and those of a thousand take long.
const LEAST_ABSORPTION: f64 = 1e-3;
const MOST_ABSORPTION: f64 = 0.7;
/// The rate r of a variance of N^−r in the next stage of a sequence, between that of pseudo-random walks and that of smooth functions.
const SEQUENCE_RATE: f64 = 1.5;
/// By how many times more walks than an error bar says the next stage goes on: that is itself uncertain by 9 %.
const MORE: f64 = 1.1;

/// What the walks of a global estimate depend on.
pub(crate) struct Whole<'a, 'm> {
    pub(crate) model: &'m dyn Model,
    pub(crate) settings: &'a Settings,
    pub(crate) watch: &'a dyn SolveObserver,
    pub(crate) systems: Systems<'m>,
}

/// A solved system that is about to be walked.
pub(crate) struct Ready<'m> {
    pub(crate) system: Box<dyn GlobalSystem<'m> + 'm>,
    pub(crate) walk: WalkOptions,
    /// The degree of scores.
    pub(crate) degree: usize,
    pub(crate) cells: usize,
    pub(crate) unknowns: usize,
    seconds: f64,
}

/// When walks end.
pub(crate) struct Until {
    /// Whose error bars reach a tolerance.
    pub(crate) looks: Looks,
    /// The most walks.
    pub(crate) walks: u64,
    /// The number of walks that a different method leaves time for: if more than these are left, or if there is a bias beside the
    /// error bars, walks are given up.
    pub(crate) price: f64,
}

impl Until {
    /// Walks that end after this number, whatever another method takes.
    pub(crate) const fn end(looks: Looks, walks: u64) -> Self {
        Self {
            looks,
            walks,
            price: f64::INFINITY,
        }
    }
}

/// What error bars of a pilot are compared with.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Bound {
    /// The error that is asked for.
    Error(Tolerance),
    /// What they are after this number of walks.
    Walks(u64),
}

/// The walks so far.
pub(crate) struct Walked {
    replicates: Replicates,
    coefficients: Vec<f64>,
    /// Why they ended. `None`: they were given up for another method.
    pub(crate) stop: Option<StopReason>,
    seconds: f64,
}

impl Walked {
    /// The walks of all replicates.
    pub(crate) fn counts(&self) -> ReplicateCounts {
        self.replicates.counts()
    }
}

/// The best constant absorption of walks that score in every state. With scores of residuals that hardly depend on each other the
/// variance is proportional to 1/(1 − r/s), where r is the radius of T_k²p and s = 1 − q0, and the work to 1/(1 − s): their product is
/// least at s = √r. Two digits of it are enough, and can be read.
pub(crate) fn best_absorption(radius: f64) -> f64 {
    let best = (1.0 - Real::sqrt(radius)).clamp(LEAST_ABSORPTION, MOST_ABSORPTION);
    format!("{best:.1e}").parse().unwrap_or(best)
}

impl<'a, 'm> Whole<'a, 'm> {
    /// Walks of an equation whose systems nobody keeps.
    pub(crate) fn new(
        model: &'m dyn Model,
        settings: &'a Settings,
        watch: &'a dyn SolveObserver,
    ) -> Self {
        Self {
            model,
            settings,
            watch,
            systems: Systems(None),
        }
    }

    /// Sets up.
    pub(crate) fn ready(&self) -> Result<Ready<'m>, Error> {
        let start = Instant::now();
        fredholm_model::channels::refuse_whole(self.model)?;
        if self.model.about().whole == WholeValues::None {
            return Err(Error::Option {
                subject: Subject::Problem,
                message: "the global estimate from one set of walks is offered for circles, spheres, rooms, scenes, cubes whose \
                          kernel has an integral, and equations of a crate of its own: ask for targets without it"
                    .to_owned(),
            });
        }
        let (cut, mut walk) = (self.settings.discretisation(), self.settings.walk_options());
        walk.pairs = self
            .settings
            .pairs
            .unwrap_or(self.model.about().whole_pairs);
        if walk.last_step {
            return Err(Error::Option {
                subject: Subject::LastStep,
                message:
                    "a global estimate scores in every state of walks for u: leave `last_step` out"
                        .to_owned(),
            });
        }
        let cells = self.model.partition(&cut)?;
        let needed = cells.memory(&[], walk.pairs);
        let what = || format!("{} unknowns", cells.unknowns());
        let advice = self.model.about().less_memory;
        refuse_beyond_memory(what, needed, advice)?;
        if self.settings.absorption.is_none() {
            walk.absorption = self.absorption(&*cells)?;
        }
        if !walk.allow_infinite_variance {
            cells.check_variance(&walk)?;
        }
        let solved = self.systems.solved(&*cells, self.settings)?;
        let system = solved.system.whole()?;
        let degree = self.score_degree(&*system)?;
        let degrees = system.degrees(degree);
        // Sums, coefficients, and what makes T_K of them.
        let numbers = system.cells() * degrees.len() * (REPLICATES + 2);
        let what = || {
            format!(
                "{REPLICATES} replicates of {} scores",
                degrees.len() * system.cells()
            )
        };
        refuse_beyond_memory(what, numbers.saturating_mul(3 * 8), advice)?;
        Ok(Ready {
            system,
            walk,
            degree,
            cells: cells.cells(),
            unknowns: cells.unknowns(),
            seconds: start.elapsed().as_secs_f64(),
        })
    }

    fn score_degree(&self, system: &dyn GlobalSystem<'_>) -> Result<usize, Error> {
        let (own, most) = (system.degree(), system.most_degree());
        let has_points = self.model.about().whole == WholeValues::Points;
        match self.settings.score_degree {
            None | Some(0) if !has_points => Ok(0),
            Some(degree) if !has_points => Err(Error::Option {
                subject: Subject::Degree,
                message: format!(
                    "scores of degree {degree}: here walks score on means over cells, of degree 0"
                ),
            }),
            None if own < most => Ok(system.default_degree()),
            None => Err(Error::Option {
                subject: Subject::Degree,
                message: format!(
                    "walks of a global estimate score on polynomials of a higher degree than v, and {most} is the highest \
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

    fn absorption(&self, cells: &dyn Partitioned<'_>) -> Result<Absorption, Error> {
        Ok(Absorption::Constant {
            probability: best_absorption(cells.plain_radius()?),
            estimator: self.settings.estimator.unwrap_or(Estimator::Collision),
        })
    }

    /// Walks until the tolerance is reached, or to the end.
    pub(crate) fn walk(&self, ready: &Ready<'m>, until: &Until) -> Result<Walked, Error> {
        self.walk_as(ready, (&ready.walk, false), until)
    }

    /// A pilot of such walks, without any other end.
    pub(crate) fn pilot(
        &self,
        ready: &Ready<'m>,
        walk: &WalkOptions,
        looks: Looks,
    ) -> Result<(Walked, Looks), Error> {
        let walk = WalkOptions {
            tolerance: None,
            time_limit: None,
            ..*walk
        };
        let until = Until::end(looks, walk.walks);
        Ok((self.walk_as(ready, (&walk, true), &until)?, until.looks))
    }

    fn walk_as(
        &self,
        ready: &Ready<'m>,
        (walk, is_pilot): (&WalkOptions, bool),
        until: &Until,
    ) -> Result<Walked, Error> {
        let (start, system) = (Instant::now(), &*ready.system);
        let functions = system.cells() * system.degrees(ready.degree).len();
        let request = GlobalRequest {
            walk,
            degree: ready.degree,
            // As many values of F − G as there are functions, about, and one of every walk.
            knows_first: is_pilot || until.walks >= functions as u64,
        };
        let mut walked = None;
        self.watch.walking();
        system.walks(&request, &mut |job| {
            let mut replicates = Replicates::new(job, REPLICATES);
            let stop = self.run(ready, (walk, until), job, &mut replicates, start)?;
            let coefficients = replicates.coefficients(job, &|cell| system.measure(cell));
            walked = Some(Walked {
                replicates,
                coefficients,
                stop,
                seconds: start.elapsed().as_secs_f64(),
            });
            Ok(())
        })?;
        walked.ok_or(Error::Internal("no walks were prepared"))
    }

    /// The values at points, for which walks score on K(x, ·) itself.
    pub(crate) fn values_at(&self, points: &[Region]) -> Result<Vec<GlobalValue>, Error> {
        let ready = self.ready()?;
        let walk = WalkOptions {
            tolerance: None,
            ..ready.walk
        };
        let until = Until::end(Looks::of_points(self.model), walk.walks);
        let request = GlobalRequest {
            walk: &walk,
            degree: ready.degree,
            knows_first: false,
        };
        let (start, mut scored) = (Instant::now(), None);
        self.watch.walking();
        let system = &*ready.system;
        system.adjoint_walks(&request, points, &mut |job| {
            let mut replicates = Replicates::new(job, REPLICATES);
            self.run(&ready, (&walk, &until), job, &mut replicates, start)?;
            scored = Some(replicates.coefficients(job, &|_| 1.0));
            Ok(())
        })?;
        let scored = scored.ok_or(Error::Internal("no walks were prepared"))?;
        let of_point = |point: usize| -> Vec<f64> {
            let rows = scored.chunks_exact(points.len());
            rows.map(|row| row[point]).collect()
        };
        let corrections = (0..points.len()).map(|point| over_replicates(&of_point(point)));
        let corrections: Vec<_> = corrections.collect();
        let least = corrections.iter().map(|all| all.std_error);
        let least = least.fold(f64::INFINITY, f64::min);
        let mut field = system.field(&request, Vec::new())?;
        let moved = field.refine(points, QUADRATURE_SHARE * least)?;
        let images = field.images(GlobalQuantity::U, points)?;
        let all = images.chunks_exact(IMAGE_HEAD).zip(corrections);
        let value = |(image, correction): (&[f64], Replicated)| {
            let ([iterate, _], _) = split(image, 0);
            GlobalValue {
                estimate: iterate + correction.mean,
                std_error: Some(correction.std_error),
                band: None,
                iterate,
                quadrature_error: moved,
            }
        };
        Ok(all.map(value).collect())
    }

    fn run(
        &self,
        ready: &Ready<'m>,
        (walk, until): (&WalkOptions, &Until),
        job: &dyn GlobalJob,
        replicates: &mut Replicates,
        start: Instant,
    ) -> Result<Option<StopReason>, Error> {
        let most = until.walks.div_ceil(REPLICATES as u64).max(LEAST_WALKS);
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
                    return Ok(Some(StopReason::Cancelled));
                }
                let limit = walk.time_limit;
                if limit.is_some_and(|limit| start.elapsed() >= limit) && done < most {
                    return Ok(Some(StopReason::TimeLimit));
                }
            }
            let Some(tolerance) = walk.tolerance else {
                return Ok(Some(StopReason::Done));
            };
            let measure = |cell| ready.system.measure(cell);
            let field = ready.field(replicates.coefficients(job, &measure))?;
            let Look {
                error, is_biased, ..
            } = until.looks.look(&*field, tolerance)?;
            let is_random = walk.sequence == Sequence::Random;
            let times = MORE * error * error;
            let needed = done as f64
                * match is_random {
                    true => times,
                    false => Real::exp(Real::ln(times) / SEQUENCE_RATE),
                };
            let left = REPLICATES as f64 * (needed - done as f64);
            if until.price.is_finite() && (is_biased || error > 1.0 && left > until.price) {
                return Ok(None);
            }
            if error <= 1.0 && replicates.counts().scored > 0 {
                return Ok(Some(StopReason::Done));
            }
            if done >= most {
                return Ok(Some(StopReason::ToleranceNotReached));
            }
            goal = (needed.ceil().min(64.0 * done as f64) as u64)
                .max((MORE * done as f64).ceil() as u64)
                .max(done + 1);
            if !is_random {
                // Points of a sequence are most even then.
                goal = goal.checked_next_power_of_two().unwrap_or(goal);
            }
            goal = goal.min(most);
        }
    }

    /// The function that walks make.
    pub(crate) fn finished(
        &self,
        ready: Ready<'m>,
        walked: Walked,
    ) -> Result<GlobalEstimate<'m>, SolveError> {
        let after = Instant::now();
        let counts = walked.counts();
        let field = ready.field(walked.coefficients)?;
        let rounding_floor = ready.rounding_floor(self.settings.scalar);
        let mut whole = GlobalEstimate {
            model: self.model,
            field,
            summary: GlobalSummary {
                cells: ready.cells,
                unknowns: ready.unknowns,
                degree: self.settings.discretisation().degree,
                chain: Some(ChainReport {
                    last_step: false,
                    ..ChainReport::new(&ready.walk, self.settings.lifted())
                }),
                score_degree: ready.degree,
                stop: walked.stop.unwrap_or(StopReason::ToleranceNotReached),
                walks: counts.walks,
                states: counts.states,
                left: counts.left,
                step_limit: counts.step_limit,
                largest_std_error: (counts.scored > 0).then_some(0.0),
                rounding_floor,
                setup_seconds: ready.seconds,
                walk_seconds: walked.seconds,
                ..GlobalSummary::empty(self.model, self.settings)
            },
        };
        self.finish(&mut whole)?;
        whole.summary.band_seconds = after.elapsed().as_secs_f64();
        Ok(whole)
    }

    /// The error bars at the probes, the band, and what no band sees.
    fn finish(&self, whole: &mut GlobalEstimate<'m>) -> Result<(), Error> {
        let probes = self.model.spread(PROBES);
        let images = if self.model.about().whole == WholeValues::Points {
            whole.field.images(GlobalQuantity::U, &probes)?
        } else {
            whole.field.mesh_images()
        };
        let median = whole.summary.look_at(&images, whole.field.rows());
        if whole.summary.band_factor.is_none() {
            return Ok(());
        }
        let some = probes.len().div_ceil(QUADRATURE_PROBES).max(1);
        let some: Vec<Region> = probes.into_iter().step_by(some).collect();
        let moved = whole.field.refine(&some, QUADRATURE_SHARE * median)?;
        whole.summary.quadrature_error = Some(moved).filter(|moved| moved.is_finite());
        Ok(())
    }
}

impl GlobalSummary {
    /// Takes what images with so many rows say of error bars, the band, and what no band sees. Returns the median of the error bars.
    pub(super) fn look_at(&mut self, images: &[f64], rows: usize) -> f64 {
        let width = IMAGE_HEAD + rows;
        let mut values = Vec::with_capacity(images.len());
        let mut errors = Vec::with_capacity(images.len() / width);
        let step = (images.len() / width).div_ceil(CELLS).max(1);
        for image in images.chunks_exact(width).step_by(step) {
            let (_, replicates) = split(image, REPLICATES);
            errors.push(over_replicates(replicates).std_error);
            values.extend(replicates);
        }
        let all = images.chunks_exact(width).step_by(step);
        let truncation = highest_parts(all).into_iter();
        self.truncation = truncation.fold(0.0, |most: f64, part| most.max(part));
        if self.largest_std_error.is_none() {
            return 0.0;
        }
        let largest = errors.iter().fold(0.0, |m: f64, error| m.max(*error));
        self.largest_std_error = Some(largest);
        let mut resamples = vec![0.0; RESAMPLES];
        let level = BAND_LEVEL;
        let factor = band_factor(&mut values, REPLICATES, level, self.seed, &mut resamples);
        self.band_factor = Some(factor);
        errors.sort_unstable_by(f64::total_cmp);
        errors.get(errors.len() / 2).copied().unwrap_or(0.0)
    }
}

impl<'m> Ready<'m> {
    /// The function of these coefficients of all replicates, and of the highest degree of the means of two halves.
    pub(crate) fn field(&self, mut rows: Vec<f64>) -> Result<Box<dyn GlobalField + 'm>, Error> {
        let degrees = self.system.degrees(self.degree);
        rows.extend(highest(&rows, &degrees, self.system.cells()));
        let request = GlobalRequest {
            walk: &self.walk,
            degree: self.degree,
            knows_first: false,
        };
        self.system.field(&request, rows)
    }

    /// The error that rounding leaves in a walk's scores.
    pub(crate) fn rounding_floor(&self, scalar: Scalar) -> f64 {
        let [largest, radius_bound] = self.system.sizes();
        in_scalar!(scalar, F => rounding_floor::<F>(largest, largest, radius_bound))
    }

    /// What walks say of some quantities, and whether quadrature of T_K leaves a bias that error bars do not see.
    pub(crate) fn look(
        &self,
        walked: Walked,
        looks: &Looks,
        (model, bound): (&dyn Model, Bound),
    ) -> Result<Look, Error> {
        let walks = walked.counts().walks as f64;
        let mut field = self.field(walked.coefficients)?;
        let tolerance = match bound {
            Bound::Error(tolerance) => tolerance,
            Bound::Walks(given) => {
                let now = looks.look(&*field, Tolerance::Absolute(1.0))?.error;
                Tolerance::Absolute(now * Real::sqrt(walks / given as f64))
            }
        };
        let mut look = looks.look(&*field, tolerance)?;
        let some = looks.some_points(model, QUADRATURE_PROBES);
        if !some.is_empty() {
            let may = MOVED * look.bound;
            let moved = field.refine(&some, may)?;
            // NaN if a finer rule takes too long: then nobody knows.
            if !(moved <= may) {
                look.is_biased = true;
                look.is_nearly_biased = true;
            }
        }
        Ok(look)
    }
}

/// The parts of the highest degree of the means of either half of the replicates; 0 where that is the mean over a cell, which is told
/// as it is.
fn highest(coefficients: &[f64], degrees: &[usize], cells: usize) -> Vec<f64> {
    let top = degrees.iter().copied().max().unwrap_or(0);
    let unknowns = cells * degrees.len();
    let mut means = vec![0.0; 2 * unknowns];
    if top == 0 {
        return means;
    }
    let half = REPLICATES / 2;
    for (replicate, row) in coefficients.chunks_exact(unknowns.max(1)).enumerate() {
        let means = means.chunks_exact_mut(unknowns).nth(replicate / half);
        let means = means.into_iter().flatten();
        for ((mean, value), degree) in means.zip(row).zip(degrees.iter().cycle()) {
            if *degree == top {
                *mean += value / half as f64;
            }
        }
    }
    means
}
