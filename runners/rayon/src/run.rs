//! Rounds of batches on all threads, merged in batch order.

use core::fmt;
use core::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

use fredholm_core::rand_core::{Rng, SeedableRng};
use fredholm_core::{
    Batch, Functional, Kernel, Neighbour, NotFinite, Sampler, Source, Statistics, Stream, Task,
    next_round,
};

use crate::{Plan, Target};

/// Watches a run and may end it. All methods do nothing by default; `()` is the observer that does
/// not look.
pub trait Observer: Sync {
    /// `walks` more walks have been run; called from any thread, often.
    fn walked(&self, walks: u64) {
        let _ = walks;
    }
    /// A round is merged: the statistics of every target so far.
    fn merged(&self, statistics: &[Statistics]) {
        let _ = statistics;
    }
    /// Whether to stop now, with what has been done so far; called from any thread, often.
    fn cancelled(&self) -> bool {
        false
    }
}

impl Observer for () {}

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// All walks were run or, with a target error, every target reached it.
    Done,
    /// All walks were run, and a target did not reach its error.
    ErrorNotReached,
    /// The time limit came first.
    TimeLimit,
    /// The observer cancelled.
    Cancelled,
}

/// What came of a run.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Of every target, over its walks 0, 1, 2, … without a gap.
    pub statistics: Vec<Statistics>,
    /// Why it ended.
    pub stop: Stop,
}

/// Why there is no result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RunError {
    /// The plan has no walks, or batches of no walks.
    NoWalks,
    /// There is no target.
    NoTarget,
    /// The target error is not a positive number.
    TargetError,
    /// A walk scored an infinity or NaN. `Task::replay` runs it again alone.
    NotFinite {
        /// The number of the target, from 0.
        target: usize,
        /// The number of the batch, from 0.
        batch: u64,
        /// The number of the walk, from 0.
        walk: u64,
    },
}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoWalks => write!(f, "at least one walk and one walk a batch are needed"),
            Self::NoTarget => write!(f, "at least one target is needed"),
            Self::TargetError => write!(f, "the target error must be a positive number"),
            Self::NotFinite {
                target,
                batch,
                walk,
            } => write!(
                f,
                "walk {walk} (batch {batch}) of target {target} scored a value that is not finite"
            ),
        }
    }
}

impl core::error::Error for RunError {}

/// States between two looks at the clock and the observer: some milliseconds, however long walks are.
const SLICE: u64 = 1 << 17;

/// Runs the plan for every target on the threads of the current rayon pool.
///
/// Batches are dealt out in order and merged in order, so the result has the same bits for any
/// number of threads. With a target error, a target stops after the first round in which its
/// standard error is small enough; a round's length follows from what has been done ([`next_round`]) and from
/// nothing else. A time limit or a cancellation keeps what is complete from the front: of every
/// target the walks 0, 1, 2, … up to some number, which is in its statistics.
///
/// # Errors
/// [`RunError`].
pub fn run<E, N, T, G, O>(
    equation: &E,
    neighbour: &N,
    targets: &[Target<T>],
    plan: &Plan<G>,
    observer: &O,
) -> Result<Outcome, RunError>
where
    E: Sampler + Kernel + Source + Sync,
    N: Neighbour<Scalar = E::Scalar, Point = E::Point> + Sync + ?Sized,
    T: Functional<E> + Sync,
    G: Rng + SeedableRng,
    O: Observer + ?Sized,
{
    validate(targets, plan)?;
    let tasks: Vec<_> = (0..)
        .zip(targets)
        .map(|(number, target)| Task {
            equation,
            neighbour,
            functional: &target.functional,
            neighbour_value: target.neighbour_value,
            estimator: plan.estimator,
            stream: Stream::<G>::new(plan.seed, number),
            step_limit: plan.step_limit,
        })
        .collect();
    let clock = Clock {
        // A limit beyond the clock's range is none.
        deadline: plan
            .time_limit
            .and_then(|limit| Instant::now().checked_add(limit)),
        late: AtomicBool::new(false),
        observer,
    };
    let mut statistics = vec![Statistics::default(); tasks.len()];
    let mut active: Vec<usize> = (0..tasks.len()).collect();
    let mut done = 0;
    while !active.is_empty() && done < plan.batches() {
        let round = Round {
            active: &active,
            first: done,
            batches: next_round(done, plan.batches()),
        };
        let cut = round.run(&tasks, plan, &clock, &mut statistics)?;
        observer.merged(&statistics);
        if cut {
            let stop = if clock.late.load(Ordering::Relaxed) {
                Stop::TimeLimit
            } else {
                Stop::Cancelled
            };
            return Ok(Outcome { statistics, stop });
        }
        done += round.batches;
        if let Some(error) = plan.target_error {
            active.retain(|&target| !error.reached(&statistics[target], done));
        }
    }
    let stop = if plan.target_error.is_some() && !active.is_empty() {
        Stop::ErrorNotReached
    } else {
        Stop::Done
    };
    Ok(Outcome { statistics, stop })
}

fn validate<T, G>(targets: &[Target<T>], plan: &Plan<G>) -> Result<(), RunError> {
    if plan.walks == 0 || plan.batch == 0 {
        return Err(RunError::NoWalks);
    }
    if targets.is_empty() {
        return Err(RunError::NoTarget);
    }
    match plan.target_error {
        Some(error) if !(error.bound() > 0.0) => Err(RunError::TargetError),
        _ => Ok(()),
    }
}

/// Whether to go on.
struct Clock<'a, O: ?Sized> {
    deadline: Option<Instant>,
    late: AtomicBool,
    observer: &'a O,
}

impl<O: Observer + ?Sized> Clock<'_, O> {
    fn stopped(&self) -> bool {
        if self
            .deadline
            .is_some_and(|deadline| Instant::now() >= deadline)
        {
            self.late.store(true, Ordering::Relaxed);
        }
        self.late.load(Ordering::Relaxed) || self.observer.cancelled()
    }
}

/// The next batches of every active target.
struct Round<'a> {
    active: &'a [usize],
    first: u64,
    batches: u64,
}

impl Round<'_> {
    /// The target and the batch of a job: the next batch of every target, then the one after.
    fn job(&self, job: u64) -> (usize, u64) {
        let targets = self.active.len() as u64;
        let target = self.active[(job % targets) as usize];
        (target, self.first + job / targets)
    }

    /// Runs the round and merges it into `statistics`. Returns whether it was cut short.
    fn run<E, N, T, G, O>(
        &self,
        tasks: &[Task<'_, E, N, T, G>],
        plan: &Plan<G>,
        clock: &Clock<'_, O>,
        statistics: &mut [Statistics],
    ) -> Result<bool, RunError>
    where
        E: Sampler + Kernel + Source + Sync,
        N: Neighbour<Scalar = E::Scalar, Point = E::Point> + Sync + ?Sized,
        T: Functional<E> + Sync,
        G: Rng + SeedableRng,
        O: Observer + ?Sized,
    {
        let jobs = self.batches * self.active.len() as u64;
        let next = AtomicU64::new(0);
        // Jobs are taken in order: when the clock stops, those taken are a gapless beginning.
        let work = |_: rayon::BroadcastContext<'_>| {
            let mut finished = Vec::new();
            while !clock.stopped() {
                let job = next.fetch_add(1, Ordering::Relaxed);
                if job >= jobs {
                    break;
                }
                let (target, index) = self.job(job);
                let mut batch = Batch::new(index, plan.batch, plan.walks);
                let result = run_batch(&mut batch, &tasks[target], clock);
                finished.push((job, batch, result));
            }
            finished
        };
        let mut finished: Vec<_> = rayon::broadcast(work).into_iter().flatten().collect();
        finished.sort_unstable_by_key(|&(job, ..)| job);
        self.merge(&finished, jobs, statistics)
    }

    fn merge(
        &self,
        finished: &[(u64, Batch, Result<(), NotFinite>)],
        jobs: u64,
        statistics: &mut [Statistics],
    ) -> Result<bool, RunError> {
        let mut open = vec![true; statistics.len()];
        let mut complete = 0;
        for (job, batch, result) in finished {
            let (target, index) = self.job(*job);
            if let Err(NotFinite { walk }) = *result {
                return Err(RunError::NotFinite {
                    target,
                    batch: index,
                    walk,
                });
            }
            // Behind a batch that was cut short the walks have a gap.
            if open[target] {
                statistics[target].merge(batch.statistics());
            }
            open[target] &= batch.is_done();
            complete += u64::from(batch.is_done());
        }
        Ok(complete < jobs)
    }
}

fn run_batch<E, N, T, G, O>(
    batch: &mut Batch,
    task: &Task<'_, E, N, T, G>,
    clock: &Clock<'_, O>,
) -> Result<(), NotFinite>
where
    E: Sampler + Kernel + Source,
    N: Neighbour<Scalar = E::Scalar, Point = E::Point> + ?Sized,
    T: Functional<E>,
    G: Rng + SeedableRng,
    O: Observer + ?Sized,
{
    loop {
        let before = batch.statistics().walks();
        // The first walk tells how long walks are, and those so far tell it better and better.
        let states = batch.statistics().states().max(1);
        let walks = u128::from(SLICE) * u128::from(before) / u128::from(states);
        batch.run(task, (walks as u64).clamp(1, SLICE))?;
        clock.observer.walked(batch.statistics().walks() - before);
        if batch.is_done() || clock.stopped() {
            return Ok(());
        }
    }
}
