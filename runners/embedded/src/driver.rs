//! One thread, bounded pieces of work, small state.

use core::fmt;
use core::marker::PhantomData;

use fredholm_core::{
    Batch, Estimate, Job, NotFinite, RunOptions, RunOptionsError, Schedule, Statistics, StopReason,
    Tail,
};

/// The progress of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// The preconditioned estimate of the walks so far, with its standard error: of the first goal, if several share them.
    pub estimate: Estimate,
    /// The number of walks so far.
    pub walks: u64,
    /// `None`: there is more to do.
    pub stop: Option<StopReason>,
}

/// Why there is no such run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DriverError {
    /// The options are impossible.
    Options(RunOptionsError),
    /// The job has no such goal, or it is not the first of as many that share their walks.
    Goal,
}

impl fmt::Display for DriverError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Options(error) => error.fmt(f),
            Self::Goal => f.write_str(
                "the job has no such goal, or it is not the first of as many that share their walks",
            ),
        }
    }
}

impl core::error::Error for DriverError {}

/// Runs the walks of a goal in pieces that the caller chooses: from a main loop, between two
/// interrupts, within a watchdog's period. S goals that share their walks, channels say, are run together.
///
/// It owns nothing but numbers: the job is lent to it in every call, always the same one. The pieces change no
/// bit of the result, which is that of any other runner of the same job with the same options.
#[derive(Debug)]
pub struct Driver<J: ?Sized, const S: usize = 1> {
    /// The number of the first of the goals.
    first: usize,
    position: Position<S>,
    // Not a reference: the compiler would lose sight of the job with every call that changes the position.
    job: PhantomData<fn(&J)>,
}

/// What changes from walk to walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Position<const S: usize> {
    /// The walks of all batches before this one, of every goal.
    pub(crate) merged: [Statistics; S],
    /// The first batch that the stage has left, of every goal. If it has none, the run has ended.
    pub(crate) batches: [Batch; S],
    pub(crate) schedule: Schedule,
}

impl<J: Job + ?Sized, const S: usize> Driver<J, S> {
    /// A run of the S goals from number `first` on that has not begun.
    ///
    /// # Errors
    /// [`DriverError`].
    #[inline(always)]
    pub fn new(job: &J, first: usize, options: RunOptions) -> Result<Self, DriverError> {
        let schedule = Schedule::new(options).map_err(DriverError::Options)?;
        Self::check(job, first)?;
        Ok(Self {
            first,
            position: Position {
                merged: [Statistics::default(); S],
                batches: [Batch::new(0, options.batch, options.walks); S],
                schedule,
            },
            job: PhantomData,
        })
    }

    /// Refuses goals that the job does not have.
    pub(crate) fn check(job: &J, first: usize) -> Result<(), DriverError> {
        let has = job.shared() == S && first.checked_rem(S) == Some(0) && first < job.goals();
        has.then_some(()).ok_or(DriverError::Goal)
    }

    /// Goes on from a position that fits the job.
    pub(crate) const fn at(first: usize, position: Position<S>) -> Self {
        Self {
            first,
            position,
            job: PhantomData,
        }
    }

    /// Runs at most `walks` further walks of the driver's job and says where the run stands. A walk is never cut in
    /// two, so that the longest piece of work is one walk of `step_limit` states.
    ///
    /// # Errors
    /// [`NotFinite`]: a walk scored an infinity or NaN. It is not in the statistics, and the run
    /// stands before it.
    pub fn poll(&mut self, job: &J, walks: u64) -> Result<Progress, NotFinite> {
        self.advance(job, walks, |position| {
            position.end_batch();
            if position.has_ended() && position.stop().is_none() {
                position.schedule.begin_stage();
            }
        })
    }

    /// Runs walks as [`poll`](Self::poll) does, but a goal that reached its tolerance goes on while its error bar is not
    /// believed ([`Schedule::stop_if_believed`]), as in the library `fredholm`. `tails`, one for each goal, belong to the run from its
    /// first walk to its last: they are kept beside a saved state. `floor` is what rounding alone leaves of the standard deviation
    /// of a score ([`rounding_floor`](fredholm_core::rounding_floor)).
    ///
    /// # Errors
    /// As [`poll`](Self::poll).
    pub fn poll_with_tails(
        &mut self,
        job: &J,
        walks: u64,
        tails: &mut [Tail; S],
        floor: f64,
    ) -> Result<Progress, NotFinite> {
        self.advance(job, walks, |position| {
            for (tail, batch) in tails.iter_mut().zip(&position.batches) {
                tail.add(batch.dense());
            }
            position.end_batch();
            let Position {
                merged, schedule, ..
            } = position;
            let mut goals = merged.iter().zip(&*tails);
            let goes_on =
                goals.any(|(all, tail)| schedule.stop_if_believed(all, tail, floor).is_none());
            if schedule.stage().is_empty() && goes_on {
                schedule.begin_stage();
            }
        })
    }

    /// Runs walks, and `end`s batches that are done.
    // Into each caller, which has an `end` of its own: the stack is counted in bytes.
    #[inline(always)]
    fn advance(
        &mut self,
        job: &J,
        walks: u64,
        mut end: impl FnMut(&mut Position<S>),
    ) -> Result<Progress, NotFinite> {
        let mut left = walks;
        while left > 0 && !self.position.has_ended() {
            let before = self.position.walks_of_batch();
            job.run(self.first, &mut self.position.batches, left)?;
            let run = self.position.walks_of_batch() - before;
            // A job that has no such goal is another one.
            if run == 0 {
                break;
            }
            left = left.saturating_sub(run);
            if self.position.batches.first().is_none_or(Batch::is_done) {
                end(&mut self.position);
            }
        }
        let stop = self.position.stop();
        Ok(Progress {
            stop,
            ..self.position.progress()
        })
    }

    /// The statistics of the walks so far: both estimates, variances, endings. Of several goals, in their order.
    #[must_use]
    pub fn statistics(&self) -> [Statistics; S] {
        let mut all = self.position.merged;
        for (all, batch) in all.iter_mut().zip(&self.position.batches) {
            all.merge(batch.dense());
        }
        all
    }

    /// Why the run ended; `None`: there is more to do. Goals that share their walks stop with the last of them.
    #[must_use]
    pub fn stop(&self) -> Option<StopReason> {
        self.position.stop()
    }

    /// The number of the first of the goals.
    #[must_use]
    pub const fn first(&self) -> usize {
        self.first
    }

    pub(crate) const fn position(&self) -> &Position<S> {
        &self.position
    }
}

impl<const S: usize> Position<S> {
    pub(crate) fn has_ended(&self) -> bool {
        self.schedule.stage().is_empty()
    }

    // Out of line, as the next ones: what they put on the stack is gone while walks use it.
    #[inline(never)]
    pub(crate) fn stop(&self) -> Option<StopReason> {
        let mut worst = StopReason::Done;
        for merged in &self.merged {
            worst = worst.max(self.schedule.stop(merged)?);
        }
        Some(worst)
    }

    /// The walks of the batch that is run.
    fn walks_of_batch(&self) -> u64 {
        let first = self.batches.first();
        first.map_or(0, |batch| batch.dense().walks())
    }

    #[inline(never)]
    fn progress(&self) -> Progress {
        let nothing = Statistics::default();
        let merged = self.merged.first().unwrap_or(&nothing);
        let batch = self.batches.first().map_or(&nothing, Batch::dense);
        Progress {
            estimate: merged.preconditioned_with(batch),
            walks: merged.walks() + batch.walks(),
            stop: None,
        }
    }

    #[inline(never)]
    fn end_batch(&mut self) {
        self.schedule.end_batch();
        let (options, stage) = (self.schedule.options(), self.schedule.stage());
        for (merged, batch) in self.merged.iter_mut().zip(&mut self.batches) {
            merged.merge(batch.dense());
            *batch = Batch::new(stage.start, options.batch, options.walks);
        }
    }
}
