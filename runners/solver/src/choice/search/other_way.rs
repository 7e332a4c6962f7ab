//! A second way to the same answer, and what a search makes of it.

use super::super::family::Prediction;
use super::Search;

/// A second way to the same answer: what it takes, and its pilots so far.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct OtherWay {
    /// Seconds that it takes from now on.
    pub(in super::super) price: f64,
    pub(in super::super) pilots: usize,
    pub(in super::super) walks: u64,
    /// Predicted seconds of its pilots, and of walks of it that were given up.
    pub(in super::super) seconds: f64,
}

impl Default for OtherWay {
    /// There is none.
    fn default() -> Self {
        Self {
            price: f64::INFINITY,
            pilots: 0,
            walks: 0,
            seconds: 0.0,
        }
    }
}

impl Search<'_> {
    /// Says what another way to the same answer takes: what takes longer is no better.
    pub(in super::super) fn compete_with(&mut self, other_way: OtherWay) {
        self.other_way = other_way;
        self.forget_rival();
    }

    /// What answered in place of separate walks is given up.
    pub(in super::super) fn forget_rival(&mut self) {
        self.rival = self.other_way.price;
    }

    /// Seconds that another way to the same answer takes. Infinite if there is none.
    pub(in super::super) fn other_price(&self) -> f64 {
        self.other_way.price
    }

    /// What this way takes, for another one to the same answer.
    pub(in super::super) fn as_other_way(&self) -> OtherWay {
        OtherWay {
            price: self.best().map_or(f64::INFINITY, |best| self.price(&best)),
            pilots: self.pilots,
            walks: self.walks,
            seconds: self.work + self.walked,
        }
    }

    /// Seconds that the choice of a prediction took: those of all pilots, of either way, and of walks that were given up.
    pub(in super::super) fn chosen_in(&self, best: &Prediction) -> f64 {
        self.lost(best) + self.walked + self.other_way.seconds
    }

    /// The pilots of either way, and their walks.
    pub(in super::super) fn all_pilots(&self) -> (usize, u64) {
        let other = &self.other_way;
        (self.pilots + other.pilots, self.walks + other.walks)
    }
}
