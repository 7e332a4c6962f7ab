//! What few walks miss of systems, whether they were solved or not.

use super::pilot::Setting;
use crate::failure::Failure;
use crate::file::{self, Pairs, ProblemFile};
use crate::problem::{Problem, Solved};

/// Rare variances by cells and degree.
#[derive(Debug)]
pub(super) struct RareVariances {
    /// Whether there are corners: everywhere else they are zero.
    corners: bool,
    known: Vec<((usize, usize), f64)>,
}

impl RareVariances {
    pub(super) const fn new(file: &ProblemFile) -> Self {
        Self {
            corners: matches!(file.problem, file::Problem::Room(_)),
            known: Vec::new(),
        }
    }

    /// That of a setting, if it is known; with all pairs pointwise S is empty.
    pub(super) fn of(&self, setting: &Setting) -> Option<f64> {
        if !self.corners || setting.plain || setting.pairs == Pairs::Pointwise {
            return Some(0.0);
        }
        let own = (setting.cells, setting.degree);
        let known = self.known.iter().find(|(of, _)| *of == own);
        known.map(|&(_, rare)| rare)
    }

    /// Asks the setting's problem, with its system if that is solved; not twice.
    pub(super) fn ask(
        &mut self,
        problem: &dyn Problem,
        setting: &Setting,
        solved: Option<&Solved>,
    ) -> Result<(), Failure> {
        if self.of(setting).is_none() {
            let own = (setting.cells, setting.degree);
            self.known.push((own, problem.rare_variance(solved)?));
        }
        Ok(())
    }
}
