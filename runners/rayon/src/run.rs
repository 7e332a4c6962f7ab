//! Stages of batches on all threads, merged in batch order.

use core::fmt;
use core::ops::Range;
use core::time::Duration;

use fredholm_core::{
    Job, RunOptions, RunOptionsError, Schedule, Statistics, StopReason, Tail, next_stage,
};

use crate::crew::{Crew, Threads};
use crate::stage::{Clock, Stage};
use crate::store::BatchStore;

/// Watches a run and may end it. All methods do nothing by default; `()` is the observer that does
/// not look.
///
/// ```
/// use core::sync::atomic::{AtomicU64, Ordering};
///
/// use fredholm_rayon::Observer;
///
/// /// Cancels after a million walks.
/// struct Million(AtomicU64);
/// impl Observer for Million {
///     fn walked(&self, walks: u64) {
///         self.0.fetch_add(walks, Ordering::Relaxed);
///     }
///     fn cancelled(&self) -> bool {
///         self.0.load(Ordering::Relaxed) >= 1_000_000
///     }
/// }
///
/// let observer = Million(AtomicU64::new(0));
/// observer.walked(1_000_000);
/// assert!(observer.cancelled());
/// ```
pub trait Observer: Sync {
    /// `walks` more walks have been run, of which those that several goals share count once; called from any thread, often.
    fn walked(&self, walks: u64) {
        let _ = walks;
    }
    /// A stage is merged: the statistics of every goal so far.
    fn merged(&self, statistics: &[Statistics]) {
        let _ = statistics;
    }
    /// A stage is merged: the statistics and the tails of the scores of every goal so far.
    fn merged_with_tails(&self, statistics: &[Statistics], tails: &[Tail]) {
        let _ = tails;
        self.merged(statistics);
    }
    /// What rounding alone leaves of the standard deviation of a goal's scores, if a goal shall go on whose error bar is not
    /// believed ([`Schedule::stop_if_believed`]); `None`: every goal stops at its tolerance. It must follow from the
    /// statistics alone.
    fn rounding_floor(&self, statistics: &Statistics) -> Option<f64> {
        let _ = statistics;
        None
    }
    /// Whether to stop now, with what has been done so far; called from any thread, often.
    fn cancelled(&self) -> bool {
        false
    }
}

impl Observer for () {}

/// The results of a run.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The statistics of every goal, over its walks 0, 1, 2, … without a gap.
    pub statistics: Vec<Statistics>,
    /// For every goal the batches with most of the variance: a sign of rare scores of a size that
    /// most walks know nothing of, and of a variance that may be infinite.
    pub tails: Vec<Tail>,
    /// Why it ended.
    pub stop: StopReason,
}

impl Outcome {
    /// No walks yet of any goal.
    ///
    /// # Errors
    /// [`RunError::NoGoal`].
    pub fn of(job: &dyn Job) -> Result<Self, RunError> {
        if job.goals() == 0 {
            return Err(RunError::NoGoal);
        }
        Ok(Self {
            statistics: vec![Statistics::default(); job.goals()],
            tails: vec![Tail::default(); job.goals()],
            stop: StopReason::Done,
        })
    }
}

/// Why there is no result.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum RunError {
    /// The options are impossible.
    Options(RunOptionsError),
    /// There is no goal.
    NoGoal,
    /// A walk scored an infinity or NaN. `Goals::replay` of the core runs it again alone.
    NotFinite {
        /// The number of the goal, from 0.
        goal: usize,
        /// The number of the batch, from 0.
        batch: u64,
        /// The number of the walk, from 0.
        walk: u64,
    },
    /// A walk of a global estimate scored an infinity or NaN.
    Replicate {
        /// The number of the replicate, from 0.
        replicate: usize,
        /// The number of the walk, from 0.
        walk: u64,
    },
}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Options(error) => error.fmt(f),
            Self::NoGoal => write!(f, "at least one goal is needed"),
            Self::NotFinite { goal, batch, walk } => write!(
                f,
                "walk {walk} (batch {batch}) of goal {goal} scored a value that is not finite"
            ),
            Self::Replicate { replicate, walk } => write!(
                f,
                "walk {walk} (replicate {replicate}) of the global estimate scored a value that is not finite"
            ),
        }
    }
}

impl core::error::Error for RunError {}

impl From<RunOptionsError> for RunError {
    fn from(error: RunOptionsError) -> Self {
        Self::Options(error)
    }
}

/// Runs the walks of every goal of the job on the threads of the current rayon pool.
///
/// Batches are dealt out in order and merged in order, so the result has the same bits for any
/// number of threads. With a tolerance, a goal stops after the first stage in which its standard
/// error is small enough, as the [`Schedule`] of every runner says. A time limit or a cancellation
/// keeps what is complete from the front: of every goal the walks 0, 1, 2, … up to some number,
/// which is in its statistics.
///
/// # Errors
/// [`RunError`].
pub fn run(
    job: &dyn Job,
    options: &RunOptions,
    time_limit: Option<Duration>,
    observer: &dyn Observer,
) -> Result<Outcome, RunError> {
    let runner = Runner {
        time_limit,
        ..Runner::new(*options)
    };
    runner.run(job, observer)
}

/// The walks of a run, who runs them, and what keeps their batches.
///
/// ```
/// use fredholm_core::RunOptions;
/// use fredholm_rayon::Runner;
///
/// let runner = Runner::new(RunOptions::new(10_000));
/// assert_eq!(runner.options.batches(), 3);
/// ```
#[derive(Clone, Copy)]
pub struct Runner<'a> {
    /// The number of walks, their batches, and when a goal stops.
    pub options: RunOptions,
    /// The time after which walks end.
    pub time_limit: Option<Duration>,
    /// Whoever runs the batches of a stage.
    pub crew: &'a dyn Crew,
    /// The keeper of batches that were run.
    pub store: &'a dyn BatchStore,
}

impl fmt::Debug for Runner<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Runner")
            .field("options", &self.options)
            .field("time_limit", &self.time_limit)
            .finish_non_exhaustive()
    }
}

impl Runner<'_> {
    /// A runner on the threads of the current rayon pool, without a time limit, that keeps nothing.
    #[must_use]
    pub fn new(options: RunOptions) -> Self {
        Self {
            options,
            time_limit: None,
            crew: &Threads,
            store: &(),
        }
    }

    /// Runs the walks of every goal until the options say that it stops: see [`run`].
    ///
    /// # Errors
    /// [`RunError`].
    pub fn run(&self, job: &dyn Job, observer: &dyn Observer) -> Result<Outcome, RunError> {
        let mut schedule = Schedule::new(self.options)?;
        let mut outcome = Outcome::of(job)?;
        let clock = Clock::new(self.time_limit, observer);
        let shared = job.shared();
        let mut active: Vec<usize> = (0..job.goals()).step_by(shared).collect();
        while !active.is_empty() {
            let stage = Stage {
                active: &active,
                batches: schedule.stage(),
                runner: self,
            };
            if stage.run(job, &clock, &mut outcome)? {
                break;
            }
            schedule.end_stage();
            active.retain(|&first| {
                let reasons = (first..first + job.decisive()).map(|goal| {
                    let (merged, tail) = (&outcome.statistics[goal], &outcome.tails[goal]);
                    stop(&schedule, merged, tail, observer.rounding_floor(merged))
                });
                // Goals that share their walks stop with the last of them.
                let reason = reasons.collect::<Option<Vec<StopReason>>>();
                let worst = reason.iter().flatten().max().copied();
                outcome.stop = outcome.stop.max(worst.unwrap_or(StopReason::Done));
                reason.is_none()
            });
            schedule.begin_stage();
        }
        Ok(outcome)
    }

    /// Runs these batches of every goal, whatever error is reached. The statistics are theirs alone.
    ///
    /// # Errors
    /// [`RunError`].
    pub fn run_batches(
        &self,
        job: &dyn Job,
        batches: Range<u64>,
        observer: &dyn Observer,
    ) -> Result<Outcome, RunError> {
        self.options.validate()?;
        let mut outcome = Outcome::of(job)?;
        let clock = Clock::new(self.time_limit, observer);
        let active: Vec<usize> = (0..job.goals()).step_by(job.shared()).collect();
        let end = batches.end.min(self.options.batches());
        let mut start = batches.start;
        while start < end {
            let next = start + next_stage(start - batches.start, end - batches.start);
            let stage = Stage {
                active: &active,
                batches: start..next,
                runner: self,
            };
            if stage.run(job, &clock, &mut outcome)? {
                break;
            }
            start = next;
        }
        Ok(outcome)
    }
}

/// Why a goal stops with these statistics; `None`: it goes on. Without what rounding leaves, every error bar is believed.
#[must_use]
pub fn stop(
    schedule: &Schedule,
    merged: &Statistics,
    tail: &Tail,
    floor: Option<f64>,
) -> Option<StopReason> {
    match floor {
        Some(floor) => schedule.stop_if_believed(merged, tail, floor),
        None => schedule.stop(merged),
    }
}
