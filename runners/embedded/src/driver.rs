//! One thread, bounded pieces of work, small state.

use fredholm_core::{
    Batch, Equation, Estimate, Functional, Generators, NeighbourOf, NotFinite, RunOptions,
    RunOptionsError, Schedule, Statistics, StopReason, Tail, Task,
};

/// The progress of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// The preconditioned estimate of the walks so far, with its standard error.
    pub estimate: Estimate,
    /// The number of walks so far.
    pub walks: u64,
    /// `None`: there is more to do.
    pub stop: Option<StopReason>,
}

/// Runs the walks of one goal in pieces that the caller chooses: from a main loop, between two
/// interrupts, within a watchdog's period.
///
/// It owns nothing but numbers; equation, neighbour equation and their tables are borrowed. The
/// pieces change no bit of the result, which is that of any other runner with the same seed, goal
/// number, walks, batch size, estimator and generator.
#[derive(Debug)]
pub struct Driver<'a, E, N: ?Sized, T, G> {
    task: Task<'a, E, N, T, G>,
    position: Position,
}

/// What changes from walk to walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Position {
    /// The walks of all batches before this one.
    pub(crate) merged: Statistics,
    /// The first batch that the stage has left. If it has none, the run has ended.
    pub(crate) batch: Batch,
    pub(crate) schedule: Schedule,
}

impl<'a, E, N, T, G> Driver<'a, E, N, T, G>
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Generators,
{
    /// A run that has not begun.
    ///
    /// # Errors
    /// [`RunOptionsError`].
    pub fn new(task: Task<'a, E, N, T, G>, options: RunOptions) -> Result<Self, RunOptionsError> {
        let schedule = Schedule::new(options)?;
        // In place: a position of its own would be on the stack twice.
        Ok(Self {
            task,
            position: Position {
                merged: Statistics::default(),
                batch: Batch::new(0, options.batch, options.walks),
                schedule,
            },
        })
    }

    /// Goes on from a position that fits the task.
    pub(crate) const fn at(task: Task<'a, E, N, T, G>, position: Position) -> Self {
        Self { task, position }
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
                self.begin_stage();
            }
        }
        let stop = self.stop();
        Ok(Progress {
            stop,
            ..self.progress()
        })
    }

    /// Runs walks as [`poll`](Self::poll) does, but a goal that reached its tolerance goes on while its error bar is not
    /// believed ([`Schedule::stop_if_believed`]), as in the library `fredholm`. `tail` belongs to the run from its first
    /// walk to its last: it is kept beside a saved state. `floor` is what rounding alone leaves of the standard deviation
    /// of a score ([`rounding_floor`](fredholm_core::rounding_floor)).
    ///
    /// # Errors
    /// As [`poll`](Self::poll).
    pub fn poll_with_tail(
        &mut self,
        walks: u64,
        tail: &mut Tail,
        floor: f64,
    ) -> Result<Progress, NotFinite> {
        let mut left = walks;
        // Apart from `poll`, whose stack is counted in bytes.
        while left > 0 && !self.has_ended() {
            let batch = &mut self.position.batch;
            let before = batch.statistics().walks();
            batch.run(&self.task, left)?;
            left = left.saturating_sub(batch.statistics().walks() - before);
            if batch.is_done() {
                tail.add(batch.statistics());
                self.end_batch();
                let Position {
                    merged, schedule, ..
                } = &mut self.position;
                if schedule.stage().is_empty()
                    && schedule.stop_if_believed(merged, tail, floor).is_none()
                {
                    schedule.begin_stage();
                }
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
    // Out of line, as the next ones: what they put on the stack is gone while walks use it.
    #[inline(never)]
    #[must_use]
    pub fn stop(&self) -> Option<StopReason> {
        self.position.schedule.stop(&self.position.merged)
    }

    fn has_ended(&self) -> bool {
        self.position.schedule.stage().is_empty()
    }

    /// The task that is run.
    #[must_use]
    pub const fn task(&self) -> &Task<'a, E, N, T, G> {
        &self.task
    }

    pub(crate) const fn position(&self) -> &Position {
        &self.position
    }

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
        position.schedule.end_batch();
        let (options, stage) = (position.schedule.options(), position.schedule.stage());
        position.batch = Batch::new(stage.start, options.batch, options.walks);
    }

    /// Begins another stage if one has ended and the goal goes on.
    fn begin_stage(&mut self) {
        if self.has_ended() && self.stop().is_none() {
            self.position.schedule.begin_stage();
        }
    }
}
