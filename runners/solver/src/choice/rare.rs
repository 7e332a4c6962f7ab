//! What few walks miss of systems, whether they were solved or not.

use super::pilot::Setting;
use crate::answer::Solved;
use crate::{Error, Pairs, Partitioned};

/// Rare variances by cells and degree.
#[derive(Debug)]
pub(super) struct RareVariances {
    /// Whether there are corners: everywhere else they are zero.
    corners: bool,
    known: Vec<((usize, usize), f64)>,
}

impl RareVariances {
    pub(super) const fn new(corners: bool) -> Self {
        Self {
            corners,
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

    /// Asks the setting's cells, or its system if that is solved; not twice.
    pub(super) fn ask(
        &mut self,
        cells: &dyn Partitioned<'_>,
        setting: &Setting,
        solved: Option<&Solved<'_>>,
    ) -> Result<(), Error> {
        if self.of(setting).is_none() {
            let rare = match solved {
                Some(solved) => solved.system.rare_variance(setting.pairs)?,
                None => cells.rare_variance(setting.pairs)?,
            };
            self.known.push(((setting.cells, setting.degree), rare));
        }
        Ok(())
    }
}
