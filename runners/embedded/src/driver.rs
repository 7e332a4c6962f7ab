//! One thread, bounded pieces of work, small state.

use core::fmt;

use fredholm_core::rand_core::{Rng, SeedableRng};
use fredholm_core::{
    Batch, Estimate, Functional, Kernel, Neighbour, NotFinite, Sampler, Source, Statistics,
    TargetError, Task, next_round,
};

/// How much to run, and when to stop. What else a result depends on is in the
/// [`Task`]: seed and target (its stream), estimator, step limit.
///
/// ```
/// use fredholm_core::TargetError;
/// use fredholm_embedded::Plan;
///
/// let mut plan = Plan::new(1_000_000);
/// plan.target_error = Some(TargetError::Relative(1e-4));
/// assert_eq!(plan.batch, 4096);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Walks; with a target error the most.
    pub walks: u64,
    /// Walks of a batch. It is part of what bits depend on.
    pub batch: u64,
    /// Stop when the standard error of the preconditioned estimate is this small. Looked at after
    /// whole rounds of batches only ([`next_round`]), as other runners do.
    pub target_error: Option<TargetError>,
}

impl Plan {
    /// `walks` walks in batches of 4096, the default of every runner.
    #[must_use]
    pub const fn new(walks: u64) -> Self {
        Self {
            walks,
            batch: 4096,
            target_error: None,
        }
    }

    pub(crate) fn validate(&self) -> Result<(), PlanError> {
        if self.walks == 0 || self.batch == 0 {
            return Err(PlanError::NoWalks);
        }
        match self.target_error {
            Some(error) if !(error.bound() > 0.0) => Err(PlanError::TargetError),
            _ => Ok(()),
        }
    }

    pub(crate) fn batches(&self) -> u64 {
        self.batches_of(self.walks)
    }

    /// The number of batches that so many walks are, the last one not always whole.
    pub(crate) fn batches_of(&self, walks: u64) -> u64 {
        // The compiler does not know that a batch has a walk, and would link a panic.
        let whole = walks.checked_div(self.batch).unwrap_or(0);
        whole + u64::from(whole * self.batch < walks)
    }
}

/// Why nothing can be run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlanError {
    /// The plan has no walks, or batches of no walks.
    NoWalks,
    /// The target error is not a positive number.
    TargetError,
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoWalks => "at least one walk and one walk a batch are needed",
            Self::TargetError => "the target error must be a positive number",
        })
    }
}

impl core::error::Error for PlanError {}

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// All walks were run or, with a target error, it was reached.
    Done,
    /// All walks were run, and the target error was not reached.
    ErrorNotReached,
}

/// Where a run stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// The preconditioned estimate of the walks so far, with its standard error.
    pub estimate: Estimate,
    /// The number of walks so far.
    pub walks: u64,
    /// `None`: there is more to do.
    pub stop: Option<Stop>,
}

/// Runs the walks of one target in pieces that the caller chooses: from a main loop, between two
/// interrupts, within a watchdog's period.
///
/// It owns nothing but numbers; equation, neighbour equation and their tables are borrowed. The
/// pieces change no bit of the result, which is that of any other runner with the same seed, target
/// number, walks, batch size, estimator and generator.
#[derive(Debug)]
pub struct Driver<'a, E, N: ?Sized, T, G> {
    task: Task<'a, E, N, T, G>,
    plan: Plan,
    position: Position,
}

/// What changes from walk to walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Position {
    /// The walks of all batches before this one.
    pub(crate) merged: Statistics,
    /// The number of the batch.
    pub(crate) index: u64,
    pub(crate) batch: Batch,
    /// The batch at which the target error is looked at next. Where it was and another round was not
    /// begun, the run has ended.
    pub(crate) round_end: u64,
}

impl<'a, E, N, T, G> Driver<'a, E, N, T, G>
where
    E: Sampler + Kernel + Source,
    N: Neighbour<Scalar = E::Scalar, Point = E::Point> + ?Sized,
    T: Functional<E>,
    G: Rng + SeedableRng,
{
    /// A run that has not begun.
    ///
    /// # Errors
    /// [`PlanError`].
    pub fn new(task: Task<'a, E, N, T, G>, plan: Plan) -> Result<Self, PlanError> {
        plan.validate()?;
        Ok(Self {
            task,
            plan,
            position: Position {
                merged: Statistics::default(),
                index: 0,
                batch: Batch::new(0, plan.batch, plan.walks),
                round_end: next_round(0, plan.batches()),
            },
        })
    }

    /// Goes on from a position that fits the plan.
    pub(crate) const fn at(task: Task<'a, E, N, T, G>, plan: Plan, position: Position) -> Self {
        Self {
            task,
            plan,
            position,
        }
    }

    /// Runs at most `walks` further walks and says where the run stands. A walk is never cut in
    /// two, so that the longest piece of work is one walk of `step_limit` states.
    ///
    /// # Errors
    /// [`NotFinite`]: a walk scored an infinity or NaN. It is not in the statistics, and the run
    /// stands before it.
    pub fn poll(&mut self, walks: u64) -> Result<Progress, NotFinite> {
        let mut left = walks;
        while left > 0 && !self.has_ended() {
            let batch = &mut self.position.batch;
            let before = batch.statistics().walks();
            batch.run(&self.task, left)?;
            left = left.saturating_sub(batch.statistics().walks() - before);
            if batch.is_done() {
                self.end_batch();
                self.begin_round();
            }
        }
        let stop = self.stop();
        Ok(Progress {
            stop,
            ..self.progress()
        })
    }

    /// The statistics of the walks so far: both estimates, variances, endings.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        let mut all = self.position.merged;
        all.merge(self.position.batch.statistics());
        all
    }

    /// Why the run ended; `None`: there is more to do.
    #[must_use]
    pub fn stop(&self) -> Option<Stop> {
        self.has_ended().then(|| {
            if self.plan.target_error.is_none() || self.error_is_reached() {
                Stop::Done
            } else {
                Stop::ErrorNotReached
            }
        })
    }

    const fn has_ended(&self) -> bool {
        self.position.index == self.position.round_end
    }

    #[inline(never)]
    fn error_is_reached(&self) -> bool {
        let Position { merged, index, .. } = &self.position;
        let error = self.plan.target_error;
        error.is_some_and(|error| error.reached(merged, *index))
    }

    /// What is run.
    #[must_use]
    pub const fn task(&self) -> &Task<'a, E, N, T, G> {
        &self.task
    }

    pub(crate) const fn plan(&self) -> &Plan {
        &self.plan
    }

    pub(crate) const fn position(&self) -> &Position {
        &self.position
    }

    // Out of line, as the next: what they put on the stack is gone while walks use it.
    #[inline(never)]
    fn progress(&self) -> Progress {
        let (merged, batch) = (&self.position.merged, self.position.batch.statistics());
        Progress {
            estimate: merged.preconditioned_with(batch),
            walks: merged.walks() + batch.walks(),
            stop: None,
        }
    }

    #[inline(never)]
    fn end_batch(&mut self) {
        let position = &mut self.position;
        position.merged.merge(position.batch.statistics());
        position.index += 1;
        position.batch = Batch::new(position.index, self.plan.batch, self.plan.walks);
    }

    /// Begins another round where one has ended and the error is not reached.
    fn begin_round(&mut self) {
        if self.has_ended() && !self.error_is_reached() {
            let batches = self.plan.batches();
            self.position.round_end += next_round(self.position.index, batches);
        }
    }
}
