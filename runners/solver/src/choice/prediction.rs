//! What a setting is predicted to take.

use fredholm_core::next_stage;

use super::setting::Setting;
use fredholm_model::cost::Cost;

/// The number of batches from which on whole stages are not counted.
const MANY_BATCHES: f64 = 1e6;

/// A number of cells, with the costs that depend on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Level {
    /// The number of cells as [`Settings`](crate::Settings) count them.
    pub(super) cells: usize,
    pub(super) unknowns: f64,
    pub(super) cost: Cost,
}

/// The variance on other cells, in multiples of the variance that a pilot observed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scales {
    /// The multiple if cells help as much as theory allows.
    pub(super) fast: f64,
    /// The multiple if cells help as observed.
    pub(super) observed: f64,
    /// The multiple if cells help less than observed.
    pub(super) slow: f64,
    /// The rare variance of the other cells.
    pub(super) rare: f64,
    /// The least value that this rare variance may have.
    pub(super) optimistic_rare: f64,
}

impl Scales {
    /// The scales of plain walks, which do not depend on cells.
    pub(super) const PLAIN: Self = Self {
        fast: 1.0,
        observed: 1.0,
        slow: 1.0,
        rare: 0.0,
        optimistic_rare: 0.0,
    };
}

/// What a setting will take. All seconds are those of one thread.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prediction {
    pub(super) setting: Setting,
    /// Seconds of the set-up.
    pub(super) setup: f64,
    /// Seconds of the set-up that are left once the system is solved.
    pub(super) source: f64,
    /// Seconds of one walk.
    pub(super) seconds_per_walk: f64,
    /// Seconds of all walks by the observed variance.
    pub(super) walking: f64,
    /// Seconds of all walks, adjusted for risk: the mean of `walking` and of what the walks take if large scores are
    /// rare and cells help less than observed.
    pub(super) risk_adjusted: f64,
    /// The seconds if a rare variance that is not known has its least value.
    pub(super) optimistic: f64,
    /// Seconds of all walks in the best case: the pilot happened to have rare large scores, and cells help as much as
    /// theory allows.
    pub(super) best_case: f64,
    /// The number of walks of one target that a pilot of this very setting had; 0 without such a pilot.
    pub(super) pilot_walks: u64,
    /// The least number of scored walks of a target, in any pilot.
    pub(super) scored: f64,
    /// The number of walks of the target that takes most if large scores are rare, not rounded up to whole stages.
    pub(super) worst_case_walks: f64,
    /// The number of walks of the target that takes most by the observed variance.
    pub(super) most_walks: f64,
    /// The number of all walks.
    pub(super) walks: f64,
    /// The number of states that all walks visit.
    pub(super) states: f64,
}

impl Prediction {
    /// Seconds of the set-up and of all walks.
    pub(super) fn seconds(&self) -> f64 {
        self.setup + self.walking
    }
}

/// The number of batches in the stages that a run takes which needs this many: errors are looked at after whole stages.
pub(super) fn batches_of_whole_stages(needed: f64) -> f64 {
    if needed > MANY_BATCHES {
        return needed;
    }
    let mut done = 0;
    loop {
        done += next_stage(done, u64::MAX);
        if done as f64 >= needed {
            return done as f64;
        }
    }
}
