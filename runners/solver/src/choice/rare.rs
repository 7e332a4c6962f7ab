//! Rare variances: what few walks miss of systems, solved or not.

use super::setting::Setting;
use crate::answer::Solved;
use crate::{Error, Pairs, Partitioned};

/// The rare variances that are known, by cells and degree.
#[derive(Debug)]
pub(super) struct RareVariances {
    /// Whether there are corners: without them all rare variances are zero.
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

    /// The rare variance of a setting, if it is known. It is zero with all pairs pointwise: S is empty.
    pub(super) fn of(&self, setting: &Setting) -> Option<f64> {
        if !self.corners || setting.plain || setting.pairs == Pairs::Pointwise {
            return Some(0.0);
        }
        let own = (setting.cells, setting.degree);
        let known = self.known.iter().find(|(of, _)| *of == own);
        known.map(|&(_, rare)| rare)
    }

    /// Computes the rare variance of a setting, unless it is known, from its cells, or from its system if that is solved.
    pub(super) fn measure(
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
