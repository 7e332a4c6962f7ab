//! Stages of batches on all threads, merged in batch order.

use core::fmt;
use core::ops::Range;
use core::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use core::time::Duration;
use std::time::Instant;

use fredholm_core::{
    Batch, Job, NotFinite, RunOptions, RunOptionsError, Schedule, Statistics, StopReason, Tail,
};

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
    /// `walks` more walks have been run; called from any thread, often.
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

/// Why there is no result.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum RunError {
    /// The options are impossible.
    Options(RunOptionsError),
    /// There is no goal.
    NoGoal,
    /// A walk scored an infinity or NaN. `Task::replay` runs it again alone.
    NotFinite {
        /// The number of the goal, from 0.
        goal: usize,
        /// The number of the batch, from 0.
        batch: u64,
        /// The number of the walk, from 0.
        walk: u64,
    },
    /// A walk of a whole function scored an infinity or NaN.
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
                "walk {walk} (replicate {replicate}) of the whole function scored a value that is not finite"
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

/// States between two looks at the clock and the observer: some milliseconds, however long walks are.
const SLICE: u64 = 1 << 17;

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
    let mut schedule = Schedule::new(*options)?;
    if job.goals() == 0 {
        return Err(RunError::NoGoal);
    }
    let clock = Clock {
        // A limit beyond the clock's range is none.
        deadline: time_limit.and_then(|limit| Instant::now().checked_add(limit)),
        late: AtomicBool::new(false),
        observer,
    };
    let mut statistics = vec![Statistics::default(); job.goals()];
    let mut tails = vec![Tail::default(); job.goals()];
    let mut active: Vec<usize> = (0..job.goals()).collect();
    let mut stop = StopReason::Done;
    while !active.is_empty() {
        let stage = Stage {
            active: &active,
            batches: schedule.stage(),
        };
        let cut = stage.run(job, options, &clock, &mut statistics, &mut tails)?;
        observer.merged_with_tails(&statistics, &tails);
        if cut {
            stop = clock.reason();
            break;
        }
        schedule.end_stage();
        active.retain(|&goal| {
            let merged = &statistics[goal];
            let reason = match observer.rounding_floor(merged) {
                Some(floor) => schedule.stop_if_believed(merged, &tails[goal], floor),
                None => schedule.stop(merged),
            };
            stop = stop.max(reason.unwrap_or(StopReason::Done));
            reason.is_none()
        });
        schedule.begin_stage();
    }
    Ok(Outcome {
        statistics,
        tails,
        stop,
    })
}

/// Whether to go on.
struct Clock<'a> {
    deadline: Option<Instant>,
    late: AtomicBool,
    observer: &'a dyn Observer,
}

impl Clock<'_> {
    fn stopped(&self) -> bool {
        if self
            .deadline
            .is_some_and(|deadline| Instant::now() >= deadline)
        {
            self.late.store(true, Ordering::Relaxed);
        }
        self.late.load(Ordering::Relaxed) || self.observer.cancelled()
    }

    /// Why it stopped.
    fn reason(&self) -> StopReason {
        if self.late.load(Ordering::Relaxed) {
            StopReason::TimeLimit
        } else {
            StopReason::Cancelled
        }
    }
}

/// The next batches of every active goal.
struct Stage<'a> {
    active: &'a [usize],
    batches: Range<u64>,
}

/// What came of a piece of work: its number, its batch, and whether a walk was not finite.
type Finished = (u64, Batch, Result<(), NotFinite>);

impl Stage<'_> {
    /// The number of pieces of work: one batch of one goal each.
    fn pieces(&self) -> u64 {
        (self.batches.end - self.batches.start) * self.active.len() as u64
    }

    /// The goal and the batch of a piece: the next batch of every goal, then the one after.
    fn piece(&self, number: u64) -> (usize, u64) {
        let goals = self.active.len() as u64;
        let goal = self.active[(number % goals) as usize];
        (goal, self.batches.start + number / goals)
    }

    /// Runs the stage and merges it into `statistics`. Returns whether it was cut short.
    fn run(
        &self,
        job: &dyn Job,
        options: &RunOptions,
        clock: &Clock<'_>,
        statistics: &mut [Statistics],
        tails: &mut [Tail],
    ) -> Result<bool, RunError> {
        let next = AtomicU64::new(0);
        // Pieces are taken in order: when the clock stops, those taken are a gapless beginning.
        let work = |_: rayon::BroadcastContext<'_>| {
            let mut finished = Vec::new();
            while !clock.stopped() {
                let number = next.fetch_add(1, Ordering::Relaxed);
                if number >= self.pieces() {
                    break;
                }
                let (goal, index) = self.piece(number);
                let mut batch = Batch::new(index, options.batch, options.walks);
                let result = run_batch(job, goal, &mut batch, clock);
                finished.push((number, batch, result));
            }
            finished
        };
        let mut finished: Vec<Finished> = rayon::broadcast(work).into_iter().flatten().collect();
        finished.sort_unstable_by_key(|&(number, ..)| number);
        self.merge(&finished, statistics, tails)
    }

    fn merge(
        &self,
        finished: &[Finished],
        statistics: &mut [Statistics],
        tails: &mut [Tail],
    ) -> Result<bool, RunError> {
        let mut open = vec![true; statistics.len()];
        let mut complete = 0;
        for (number, batch, result) in finished {
            let (goal, index) = self.piece(*number);
            if let Err(NotFinite { walk }) = *result {
                return Err(RunError::NotFinite {
                    goal,
                    batch: index,
                    walk,
                });
            }
            // Behind a batch that was cut short the walks have a gap.
            if open[goal] {
                statistics[goal].merge(batch.statistics());
                tails[goal].add(batch.statistics());
            }
            open[goal] &= batch.is_done();
            complete += u64::from(batch.is_done());
        }
        Ok(complete < self.pieces())
    }
}

fn run_batch(
    job: &dyn Job,
    goal: usize,
    batch: &mut Batch,
    clock: &Clock<'_>,
) -> Result<(), NotFinite> {
    loop {
        let before = batch.statistics().walks();
        // The first walk tells how long walks are, and those so far tell it better and better.
        let states = batch.statistics().states().max(1);
        let walks = u128::from(SLICE) * u128::from(before) / u128::from(states);
        job.run(goal, batch, (walks as u64).clamp(1, SLICE))?;
        clock.observer.walked(batch.statistics().walks() - before);
        if batch.is_done() || clock.stopped() {
            return Ok(());
        }
    }
}
