//! Solved systems of pilots: later pilots and the answer use them again.

use std::sync::Arc;

use super::setting::Setting;
use crate::answer::Solved;
use crate::{Error, Goal, Partitioned};

/// The most bytes that are kept.
const MEMORY: usize = 1 << 30;

/// The systems of the last pilots, with their bytes, as far as they fit into the memory for them.
#[derive(Debug, Default)]
pub(super) struct Systems<'m>(Vec<(Setting, usize, Arc<Solved<'m>>)>);

impl<'m> Systems<'m> {
    /// The system of a setting, if it is solved.
    pub(super) fn of(&self, setting: &Setting) -> Option<&Arc<Solved<'m>>> {
        let mut all = self.0.iter();
        let found = all.find(|(of, ..)| of.shares_system(setting));
        found.map(|(.., solved)| solved)
    }

    /// Keeps a system that is solved already.
    pub(super) fn keep(&mut self, setting: Setting, solved: Solved<'m>) {
        self.0.push((setting, 0, Arc::new(solved)));
    }

    /// Solves the system of a setting, unless it is solved.
    pub(super) fn solve(
        &mut self,
        cells: &(dyn Partitioned<'m> + 'm),
        setting: &Setting,
        goals: &[Goal],
    ) -> Result<Arc<Solved<'m>>, Error> {
        if let Some(solved) = self.of(setting) {
            return Ok(Arc::clone(solved));
        }
        let bytes = cells.memory(goals, setting.pairs);
        let solved = Arc::new(Solved::new(cells)?);
        let kept: usize = self.0.iter().map(|(_, bytes, _)| bytes).sum();
        if kept.saturating_add(bytes) > MEMORY {
            self.0.clear();
        }
        self.0.push((*setting, bytes, Arc::clone(&solved)));
        Ok(solved)
    }
}
