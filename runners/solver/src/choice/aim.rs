//! The errors by which settings are compared.

use fredholm_core::{MIN_SCORED_WALKS, Statistics, Tolerance};

use crate::Settings;

/// What walks are made for.
#[derive(Clone, Debug)]
pub(super) enum Aim {
    /// Each target has an error that is asked for.
    Error(Tolerance),
    /// A number of walks of each target. Settings are compared by variance × time.
    Walks(Given),
}

/// The number of walks that is given, and what the best setting so far leaves then.
#[derive(Clone, Debug)]
pub(super) struct Given {
    /// The number of walks of each target.
    pub(super) walks: u64,
    /// The standard error of each target of pilots, which others are compared with: none before the first pilot, and 0 where nothing is known
    /// of it.
    pub(super) errors: Vec<f64>,
}

impl Aim {
    /// The aim of walks with these settings: of so many of each target, if no error is asked for.
    pub(super) fn new(settings: &Settings, walks: u64) -> Self {
        let given = Given {
            walks,
            errors: Vec::new(),
        };
        settings.tolerance.map_or(Self::Walks(given), Self::Error)
    }

    /// The number of walks of each target, if no error is asked for.
    pub(super) const fn walks(&self) -> Option<u64> {
        match self {
            Self::Error(_) => None,
            Self::Walks(given) => Some(given.walks),
        }
    }

    /// The error of a target that walks are made for. They have these statistics.
    pub(super) fn error(&self, target: usize, of: &Statistics, variance: f64) -> f64 {
        match self {
            Self::Error(tolerance) => tolerance.error(of),
            Self::Walks(given) => given.error(target, variance),
        }
    }

    /// The variance of a walk of a target, of which rounding leaves so much: no less than leaves as much when the walks that are given are over, as
    /// what is below that is no better.
    pub(super) fn variance(&self, of: &Statistics, floor: f64) -> f64 {
        let least = self.walks().unwrap_or(0) as f64 * floor.powi(2);
        variance(of).max(least)
    }

    /// The number of walks until so many have scored that an error is believed, if one is asked for.
    pub(super) fn believed(&self, of: &Statistics) -> f64 {
        match self {
            Self::Error(_) => (MIN_SCORED_WALKS * of.walks()) as f64 / of.scored() as f64,
            Self::Walks(_) => 0.0,
        }
    }
}

impl Given {
    /// The error that others are compared with, of a target of which a pilot knows this variance. Where there was none, as without a neighbour
    /// equation where it is dark, all settings are alike.
    pub(super) fn error(&self, target: usize, variance: f64) -> f64 {
        let known = self.errors.get(target).copied();
        let own = || self.standard_error(variance);
        known.filter(|error| *error > 0.0).unwrap_or_else(own)
    }

    /// The standard error that this variance of a walk leaves.
    pub(super) fn standard_error(&self, variance: f64) -> f64 {
        f64::sqrt(variance / self.walks as f64)
    }
}

/// The variance of a walk.
fn variance(of: &Statistics) -> f64 {
    of.preconditioned().std_dev.unwrap_or(0.0).powi(2)
}
