//! What work takes, by constants that were measured once: a choice by it must not depend on the machine.

use fredholm_core::Estimator;
use serde::{Deserialize, Serialize};

use crate::Pairs;

/// Seconds of a set-up and of walks on one thread.
#[derive(Clone, Copy, Debug)]
pub struct Cost {
    /// Seconds of the set-up.
    pub setup: f64,
    /// The part of it that is left where the system is solved: G.
    pub source: f64,
    /// Seconds of what the first walks with these pairs make of a solved system, which keeps it: a part of the set-up.
    pub kept: f64,
    /// Seconds of walks that both equations follow.
    pub walk: WalkCost,
    /// Seconds of plain walks.
    pub plain: WalkCost,
    /// Seconds of a last step to the light, in every score of walks that make one.
    pub light: f64,
}

/// What a further channel takes in a walk, over what the walk takes with one: some products, and one number more of every table; of plain
/// walks nothing but products.
const CHANNEL: f64 = 0.01;
const PLAIN_CHANNEL: f64 = 0.002;
/// What it takes in a set-up: the fits, but no rays.
const CHANNEL_SETUP: f64 = 0.03;

impl Cost {
    /// The cost of so many functionals that share their walks, in so many channels: of a set-up, and of walks for one of them.
    #[must_use]
    pub fn shared(self, functionals: usize, channels: usize) -> Self {
        let further = channels.saturating_sub(1) as f64;
        let share = |channel: f64| (1.0 + channel * further) / functionals.max(1) as f64;
        Self {
            setup: self.setup * (1.0 + CHANNEL_SETUP * further),
            walk: self.walk.times(share(CHANNEL)),
            plain: self.plain.times(share(PLAIN_CHANNEL)),
            ..self
        }
    }

    /// The cost of so many channels with walks of their own, and their sum: of a set-up, and of walks for one of these functionals.
    #[must_use]
    pub(crate) fn of_each(self, channels: usize) -> Self {
        let each = channels as f64;
        let share = each / (each + 1.0);
        Self {
            setup: each * self.setup,
            source: each * self.source,
            kept: each * self.kept,
            walk: self.walk.times(share),
            plain: self.plain.times(share),
            light: share * self.light,
        }
    }
}

/// Seconds of the parts of a walk.
#[derive(Clone, Copy, Debug)]
pub struct WalkCost {
    /// Seconds of the state where a walk starts.
    pub start: f64,
    /// Seconds of every further state.
    pub step: f64,
    /// Seconds of a score besides: once a walk, or in every state.
    pub score: f64,
    /// Seconds of a pointwise pair in a score.
    pub pair: f64,
    /// Seconds of a pointwise pair in a score that is partly hidden.
    pub hidden_pair: f64,
}

impl WalkCost {
    /// The seconds of all parts times a number.
    fn times(self, times: f64) -> Self {
        Self {
            start: times * self.start,
            step: times * self.step,
            score: times * self.score,
            pair: times * self.pair,
            hidden_pair: times * self.hidden_pair,
        }
    }

    /// Seconds of a walk of so many states.
    #[must_use]
    pub fn seconds(&self, estimator: Estimator, states: f64, pairs: PointwisePairs) -> f64 {
        let scores = match estimator {
            Estimator::Absorption => 1.0,
            Estimator::Collision => states,
        };
        let score = self.score + pairs.seen * self.pair + pairs.hidden * self.hidden_pair;
        self.start + (states - 1.0) * self.step + scores * score
    }
}

/// Pointwise pairs of a row, in the mean over the space of states.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointwisePairs {
    /// Pairs that nothing hides.
    pub seen: f64,
    /// Pairs that are partly hidden, in a room.
    pub hidden: f64,
}

impl PointwisePairs {
    /// The pairs of a row on so many times as many cells. What is partly hidden lies along the edges of shadows, of
    /// which a row has as many on finer cells; as it has pairs next to a corner, which the default has pointwise.
    #[must_use]
    pub fn on(self, pairs: Pairs, times: f64) -> Self {
        match pairs {
            Pairs::Pointwise => Self {
                seen: times * self.seen,
                ..self
            },
            _ => self,
        }
    }
}
