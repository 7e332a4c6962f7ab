//! The schedule of a run: which batches are run next, and after which of them a goal stops. All
//! runners follow it, so that they stop after the same walk.

use core::fmt;
use core::ops::Range;

use crate::{Real, Statistics, Tail};

/// The standard error at which a goal is reached.
///
/// ```
/// use fredholm_core::Tolerance;
///
/// let percent = Tolerance::Relative(0.01);
/// assert_eq!(percent.bound(), 0.01);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// A standard error in the units of the estimate.
    Absolute(f64),
    /// A standard error relative to the magnitude of the estimate.
    Relative(f64),
    /// A standard error of the fourth root of the estimate: where walks estimate σT⁴, σ^¼ times that of T.
    FourthRoot(f64),
}

/// The fewest batches whose error bar is believed.
pub const MIN_BATCHES: u64 = 16;
/// The fewest replicates of a [Sobol'](crate::Sequence) sequence whose error bar is believed, as every one is one sample: the standard error of
/// 32 is uncertain by 13 %, and Student's quantile of 95 % is 2.04.
pub const MIN_REPLICATES: u64 = 32;
/// The fewest walks that scored whose error bar is believed: a standard deviation from a few scores
/// of a rare event is often far too small.
pub const MIN_SCORED_WALKS: u64 = 1000;

/// The most batches of a goal in one stage: stages stay short enough to be watched.
const LONGEST_STAGE: u64 = 4096;

impl Tolerance {
    /// The number, absolute or relative. It must be positive.
    #[must_use]
    pub const fn bound(&self) -> f64 {
        match *self {
            Self::Absolute(bound) | Self::Relative(bound) | Self::FourthRoot(bound) => bound,
        }
    }

    /// The standard error that is asked for, in the units of the estimate.
    #[must_use]
    pub fn error(&self, statistics: &Statistics) -> f64 {
        self.error_at(statistics.preconditioned().estimate)
    }

    /// The standard error that is asked for of an estimate of this size, in its units.
    ///
    /// The error of a root r = x^¼ is Δr, and so that of x is Δr dx/dr = 4 x Δr/r; there is none where x is not above 0.
    ///
    /// ```
    /// use fredholm_core::Tolerance;
    ///
    /// assert_eq!(Tolerance::Relative(0.01).error_at(-50.0), 0.5);
    /// // 0.1 of the root of x = 2⁴: 4 · 16 · 0.1/2.
    /// let of_root = Tolerance::FourthRoot(0.1);
    /// assert!((of_root.error_at(16.0) - 3.2).abs() < 1e-12);
    /// ```
    #[must_use]
    #[inline]
    pub fn error_at(&self, estimate: f64) -> f64 {
        match *self {
            Self::Absolute(bound) => bound,
            Self::Relative(bound) => bound * estimate.abs(),
            Self::FourthRoot(bound) if estimate > 0.0 => {
                4.0 * bound * estimate / Real::sqrt(Real::sqrt(estimate))
            }
            Self::FourthRoot(_) => 0.0,
        }
    }

    /// Whether `statistics` of `batches` batches reach this error, and may be believed.
    #[must_use]
    pub fn reached(&self, statistics: &Statistics, batches: u64) -> bool {
        let fewest = match statistics.replicates() {
            0 => MIN_BATCHES,
            _ => MIN_REPLICATES,
        };
        // The error last: square roots are software on a device.
        batches >= fewest
            && statistics.scored() >= MIN_SCORED_WALKS
            && (statistics.preconditioned_error())
                .is_some_and(|error| error <= self.error_at(statistics.preconditioned_mean()))
    }
}

/// The number of batches in the stage that begins after `done` of `all` batches: an eighth of what
/// has been done, 16 to 4096. A stage's length depends on nothing else, so that where a run stops
/// does not depend on who runs it.
///
/// ```
/// use fredholm_core::next_stage;
///
/// assert_eq!(next_stage(0, 1000), 16);
/// assert_eq!(next_stage(160, 1000), 20);
/// assert_eq!(next_stage(990, 1000), 10);
/// ```
#[must_use]
pub fn next_stage(done: u64, all: u64) -> u64 {
    (done / 8)
        .clamp(MIN_BATCHES, LONGEST_STAGE)
        .min(all.saturating_sub(done))
}

/// The number of walks of every goal of a run, their batches, and when a goal stops. What else a
/// result depends on is in the [`Job`](crate::Job).
///
/// ```
/// use fredholm_core::{RunOptions, Tolerance};
///
/// let mut options = RunOptions::new(1_000_000);
/// options.tolerance = Some(Tolerance::Relative(1e-4));
/// assert_eq!(options.batch, 4096);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunOptions {
    /// Walks for each goal; with a tolerance the most.
    pub walks: u64,
    /// Walks of a batch. It is part of what bits depend on.
    pub batch: u64,
    /// Stop a goal when the standard error of its preconditioned estimate is this small. Looked at
    /// after whole stages of batches only.
    pub tolerance: Option<Tolerance>,
}

impl RunOptions {
    /// `walks` walks for each goal, in batches of 4096.
    #[must_use]
    pub const fn new(walks: u64) -> Self {
        Self {
            walks,
            batch: 4096,
            tolerance: None,
        }
    }

    /// Whether a run with these options is possible.
    ///
    /// # Errors
    /// [`RunOptionsError`].
    pub fn validate(&self) -> Result<(), RunOptionsError> {
        if self.walks == 0 || self.batch == 0 {
            return Err(RunOptionsError::NoWalks);
        }
        match self.tolerance {
            Some(tolerance) if !(tolerance.bound() > 0.0) => Err(RunOptionsError::Tolerance),
            _ => Ok(()),
        }
    }

    /// The number of batches for each goal.
    #[must_use]
    pub fn batches(&self) -> u64 {
        self.batches_of(self.walks)
    }

    /// The number of batches of this many walks; the last one may be shorter.
    #[must_use]
    pub fn batches_of(&self, walks: u64) -> u64 {
        // The compiler does not know that a batch has a walk, and would link a panic.
        let whole = walks.checked_div(self.batch).unwrap_or(0);
        whole + u64::from(whole * self.batch < walks)
    }
}

/// Why [`RunOptions`] cannot be run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RunOptionsError {
    /// The run has no walks, or batches of no walks.
    NoWalks,
    /// The tolerance is not a positive number.
    Tolerance,
}

impl fmt::Display for RunOptionsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoWalks => "at least one walk and one walk a batch are needed",
            Self::Tolerance => "the tolerance must be a positive number",
        })
    }
}

impl core::error::Error for RunOptionsError {}

/// Why a run ended, or one goal of it: from the best reason to the worst. A run of several goals
/// ended for the greatest of their reasons.
///
/// ```
/// use fredholm_core::StopReason;
///
/// let worst = [StopReason::Done, StopReason::TimeLimit].into_iter().max();
/// assert_eq!(worst, Some(StopReason::TimeLimit));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum StopReason {
    /// All walks were run or, with a tolerance, every goal reached it.
    Done,
    /// All walks were run, and a goal did not reach its tolerance.
    ToleranceNotReached,
    /// The time limit came first. Only a runner with a clock says so.
    TimeLimit,
    /// Somebody cancelled. Only a runner that can be cancelled says so.
    Cancelled,
}

/// The stages of a run, and where it stands in them.
///
/// All goals that have not stopped are in the same stage. A runner runs the batches of the stage for
/// each of them, in any order and place, merges them in their order, and asks for each goal whether
/// it stops. As plain numbers it may be saved, or be followed by many machines at once.
///
/// ```
/// use fredholm_core::{
///     Batch, Job, NotFinite, RunOptions, RunOptionsError, Schedule, Statistics, StopReason,
/// };
///
/// /// What every runner does, one batch after the other.
/// fn run_alone(job: &dyn Job, options: RunOptions) -> Result<(Vec<Statistics>, StopReason), NotFinite> {
///     let mut schedule = Schedule::new(options).expect("options with walks");
///     let mut statistics = vec![Statistics::default(); job.goals()];
///     // The first ones of goals that share walks.
///     let mut active: Vec<usize> = (0..job.goals()).step_by(job.shared()).collect();
///     let mut reason = StopReason::Done;
///     while !active.is_empty() {
///         for &first in &active {
///             for index in schedule.stage() {
///                 let mut batches = vec![Batch::new(index, options.batch, options.walks); job.shared()];
///                 job.run(first, &mut batches, u64::MAX)?;
///                 for (all, batch) in statistics[first..].iter_mut().zip(&batches) {
///                     all.merge(&batch.statistics());
///                 }
///             }
///         }
///         schedule.end_stage();
///         active.retain(|&first| {
///             let goals = &statistics[first..first + job.shared()];
///             let stops: Option<Vec<_>> = goals.iter().map(|goal| schedule.stop(goal)).collect();
///             reason = stops.iter().flatten().copied().fold(reason, StopReason::max);
///             stops.is_none()
///         });
///         schedule.begin_stage();
///     }
///     Ok((statistics, reason))
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Schedule {
    options: RunOptions,
    /// The batches of each goal before this one are merged.
    next: u64,
    /// The stage ends before this batch.
    end: u64,
}

impl Schedule {
    /// The schedule of a run that has not begun: its first stage.
    ///
    /// # Errors
    /// [`RunOptionsError`].
    pub fn new(options: RunOptions) -> Result<Self, RunOptionsError> {
        options.validate()?;
        Ok(Self {
            options,
            next: 0,
            end: next_stage(0, options.batches()),
        })
    }

    /// The schedule of a run in a stage of which these batches are left ([`stage`](Self::stage)).
    /// `None`: the options are impossible, or have fewer batches.
    #[must_use]
    pub fn resume(options: RunOptions, Range { start, end }: Range<u64>) -> Option<Self> {
        let fits = options.validate().is_ok() && start <= end && end <= options.batches();
        fits.then_some(Self {
            options,
            next: start,
            end,
        })
    }

    /// The options of the run.
    #[must_use]
    pub const fn options(&self) -> &RunOptions {
        &self.options
    }

    /// The numbers of the batches that the stage has left, for every goal that has not stopped.
    #[must_use]
    pub const fn stage(&self) -> Range<u64> {
        self.next..self.end
    }

    /// The first batch that is left has been merged.
    pub fn end_batch(&mut self) {
        self.next = self.end.min(self.next.saturating_add(1));
    }

    /// All batches that were left have been merged.
    pub const fn end_stage(&mut self) {
        self.next = self.end;
    }

    /// Why a goal stops whose batches so far are merged in `merged`. `None`: it goes on, with what
    /// is left of the stage or with another one.
    #[must_use]
    #[inline(never)]
    pub fn stop(&self, merged: &Statistics) -> Option<StopReason> {
        if self.next < self.end {
            return None;
        }
        // First: on a device the stack is deepest in what follows.
        let has_ended = self.next >= self.options.batches();
        match &self.options.tolerance {
            None => has_ended.then_some(StopReason::Done),
            Some(tolerance) if tolerance.reached(merged, self.next) => Some(StopReason::Done),
            Some(_) => has_ended.then_some(StopReason::ToleranceNotReached),
        }
    }

    /// Why a goal stops, as [`stop`](Self::stop) says, but for one that reached its tolerance with an error bar that is not
    /// believed: that goes on while there are walks ([`Tail::is_enough`]). The tail is that of the goal's batches so far.
    #[must_use]
    pub fn stop_if_believed(
        &self,
        merged: &Statistics,
        tail: &Tail,
        floor: f64,
    ) -> Option<StopReason> {
        let has_more = self.end < self.options.batches();
        let goes_on = || has_more && !tail.is_enough(merged, self.options.tolerance, floor);
        self.stop(merged).filter(|_| !goes_on())
    }

    /// Begins the stage after this one, for the goals that go on. After the last walks it is empty.
    pub fn begin_stage(&mut self) {
        self.next = self.end;
        self.end += next_stage(self.next, self.options.batches());
    }
}
