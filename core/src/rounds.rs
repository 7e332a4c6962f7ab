//! When a run with a target error is looked at, so that every runner stops after the same walk.

use crate::{Estimate, Statistics};

/// The standard error at which a target is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TargetError {
    /// In the units of the estimate.
    Absolute(f64),
    /// As a part of the estimate's magnitude.
    Relative(f64),
}

/// No error bar is believed before so many batches …
pub const ENOUGH_BATCHES: u64 = 16;
/// … and so many walks that scored: a standard deviation from a few scores of a rare event is often
/// far too small.
pub const ENOUGH_SCORES: u64 = 1000;

/// Batches of a target in one round: rounds stay short enough to be watched.
const LARGEST_ROUND: u64 = 4096;

impl TargetError {
    /// The number, absolute or relative. It must be positive.
    #[must_use]
    pub const fn bound(&self) -> f64 {
        match *self {
            Self::Absolute(bound) | Self::Relative(bound) => bound,
        }
    }

    /// Whether `statistics` of `batches` batches reach this error, and may be believed.
    #[must_use]
    pub fn reached(&self, statistics: &Statistics, batches: u64) -> bool {
        let Estimate {
            estimate,
            std_error,
            ..
        } = statistics.preconditioned();
        let bound = match *self {
            Self::Absolute(bound) => bound,
            Self::Relative(bound) => bound * estimate.abs(),
        };
        batches >= ENOUGH_BATCHES
            && statistics.scored() >= ENOUGH_SCORES
            && std_error.is_some_and(|error| error <= bound)
    }
}

/// The number of batches in the round that begins after `done` of `all` batches: an eighth of what
/// has been done, 16 to 4096. A target error is looked at after whole rounds only, and a round's
/// length depends on nothing else, so that where a run stops does not depend on who runs it.
///
/// ```
/// use fredholm_core::next_round;
///
/// assert_eq!(next_round(0, 1000), 16);
/// assert_eq!(next_round(160, 1000), 20);
/// assert_eq!(next_round(990, 1000), 10);
/// ```
#[must_use]
pub fn next_round(done: u64, all: u64) -> u64 {
    (done / 8)
        .clamp(ENOUGH_BATCHES, LARGEST_ROUND)
        .min(all.saturating_sub(done))
}
