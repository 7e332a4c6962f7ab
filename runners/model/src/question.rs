//! What resolvent walks are asked for, and what they answer.

use core::fmt;

use fredholm_core::StopReason;
use fredholm_rayon::Observer;

use crate::{Goal, Settings};

/// What resolvent walks are asked for.
#[derive(Clone, Copy)]
pub struct ResolventQuestion<'a> {
    /// The goals.
    pub goals: &'a [Goal],
    /// The settings; of these cells, degree, points, tolerance, time limit and seed are heeded.
    pub settings: &'a Settings,
    /// Whether nothing is walked: cells and degree are chosen, and the points that they take are predicted.
    pub is_prediction: bool,
    /// Who sees what the solution is at, and may cancel it.
    pub watch: &'a dyn Observer,
}

impl fmt::Debug for ResolventQuestion<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ResolventQuestion")
            .field("goals", &self.goals)
            .field("settings", &self.settings)
            .finish_non_exhaustive()
    }
}

/// The estimate of a goal by resolvent walks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResolventEstimate {
    /// The estimate of (u, Φ).
    pub value: f64,
    /// The part that takes no walks.
    pub known: f64,
    /// The standard error.
    pub std_error: f64,
    /// The degrees of freedom of the standard error.
    pub freedom: f64,
    /// The points in which it was sampled.
    pub points: u64,
}

/// Answer of resolvent walks.
#[derive(Clone, Debug, PartialEq)]
pub struct ResolventAnswer {
    /// The estimate of every goal.
    pub estimates: Vec<ResolventEstimate>,
    /// Cells as they are asked for.
    pub cells: usize,
    /// The degree of the polynomials on a cell.
    pub degree: usize,
    /// The unknowns.
    pub unknowns: usize,
    /// The spectral radius of (1 + |R_n|)|K − K_n|.
    pub radius: f64,
    /// The condition number of I − K' in the maximum norm.
    pub condition: f64,
    /// The part of a value that rounding leaves unknown, by the condition number and the scalar.
    pub rounding: f64,
    /// The number of all points.
    pub points: u64,
    /// The number of all steps beyond the first.
    pub steps: u64,
    /// The number of rounds.
    pub rounds: u32,
    /// Why they ended.
    pub stop: StopReason,
    /// Seconds of the set-up, the choice among it.
    pub setup_seconds: f64,
    /// Seconds of the walks.
    pub walk_seconds: f64,
}

impl ResolventAnswer {
    /// The error that rounding leaves of a value, which more points do not lower.
    #[must_use]
    pub fn floor(&self, value: f64) -> f64 {
        self.rounding * value.abs()
    }
}
