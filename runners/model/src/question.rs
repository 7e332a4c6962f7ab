//! What resolvent walks are asked for, and what they answer.

use core::fmt;

use fredholm_core::StopReason;
use fredholm_rayon::Observer;
use serde::{Deserialize, Serialize};

use crate::{Error, GlobalField, Goal, Prepared, Settings};

/// What resolvent walks are asked for.
#[derive(Clone, Copy)]
pub struct ResolventQuestion<'a> {
    /// The goals.
    pub goals: &'a [Goal],
    /// The settings; of these cells, degree, points, tolerance, time limit and seed are heeded.
    pub settings: &'a Settings,
    /// Whether nothing is walked: cells and degree are chosen, and the points that they take are predicted.
    pub is_prediction: bool,
    /// Who runs the walks, if it is not this process alone: then every batch is a sample of its own, and no estimates are answered.
    pub run: Option<&'a RunReplicates<'a>>,
    /// Who sees what the solution is at, and may cancel it.
    pub watch: &'a dyn Observer,
}

/// Runs walks with these settings, in which nothing is open, of a chosen setting.
pub type RunReplicates<'a> =
    dyn Fn(&Prepared<'_>, &Settings, &ResolventAnswer) -> Result<(), Error> + Sync + 'a;

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
    /// The error that rounding leaves, which more points do not lower.
    pub floor: f64,
    /// The standard error.
    pub std_error: f64,
    /// The degrees of freedom of the standard error.
    pub freedom: f64,
    /// The points in which it was sampled.
    pub points: u64,
}

/// What is known of a solved equation before any walk.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResolventFigures {
    /// The unknowns, N.
    pub unknowns: usize,
    /// The spectral radius of (1 + |R_n|)|K − K_n| by which walks go on.
    pub radius: f64,
    /// About how large that is for what walks leave at the first point: less, if they go on by a coarse resolvent.
    pub first_radius: f64,
    /// The condition number of I − K' in the maximum norm.
    pub condition: f64,
    /// The part of the terms of a value that rounding leaves unknown, by the condition number, the scalar, and √N.
    pub rounding: f64,
}

impl ResolventFigures {
    /// The error that rounding leaves of a sum of terms that have this size together, which more points do not lower.
    #[must_use]
    pub fn floor(&self, size: f64) -> f64 {
        self.rounding * size
    }
}

/// Answer of resolvent walks.
#[derive(Clone, Debug, PartialEq)]
pub struct ResolventAnswer {
    /// The estimate of every goal; of many values of one function those of some.
    pub estimates: Vec<ResolventEstimate>,
    /// Cells as they are asked for.
    pub cells: usize,
    /// The degree of the polynomials on a cell.
    pub degree: usize,
    /// What was known before any walk.
    pub figures: ResolventFigures,
    /// The number of all points.
    pub points: u64,
    /// The number of all steps beyond the first.
    pub steps: u64,
    /// The number of rounds.
    pub rounds: u32,
    /// Why they ended.
    pub stop: StopReason,
    /// Why the error that is asked for was not reached, if it is not for the walks or the time that were given.
    pub reason: Option<String>,
    /// Seconds of the set-up, the choice among it.
    pub setup_seconds: f64,
    /// Seconds of the walks.
    pub walk_seconds: f64,
}

/// What resolvent walks have found.
#[derive(Debug)]
pub struct ResolventFound<'a> {
    /// Their answer.
    pub answer: ResolventAnswer,
    /// The function of which the goals are values, if they are told by the points that all of them share.
    pub field: Option<FoundField<'a>>,
}

/// Function that resolvent walks have found.
#[derive(Debug)]
pub struct FoundField<'a> {
    /// The function.
    pub field: Box<dyn GlobalField + 'a>,
    /// The images of the goals, as [`GlobalField::images`] has them.
    pub images: Vec<f64>,
    /// The degree of the polynomials on which points score.
    pub score_degree: usize,
    /// Seconds of the images.
    pub seconds: f64,
}
