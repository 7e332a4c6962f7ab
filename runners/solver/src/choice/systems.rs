//! Solved systems of pilots: later pilots and the answer use them again.

use std::sync::Arc;

use super::setting::Setting;
use crate::answer::Solved;
use crate::{Error, Goal, Partitioned};

/// The most bytes that are kept.
const MEMORY: usize = 1 << 30;

/// The systems of all pilots that fit into the memory for them.
#[derive(Debug, Default)]
pub(super) struct Systems<'m> {
    all: Vec<System<'m>>,
}

#[derive(Debug)]
struct System<'m> {
    cells: usize,
    degree: usize,
    bytes: usize,
    solved: Arc<Solved<'m>>,
}

impl<'m> Systems<'m> {
    /// The system of a setting, if it is solved.
    pub(super) fn of(&self, setting: &Setting) -> Option<&Arc<Solved<'m>>> {
        let at = self.position(setting)?;
        self.all.get(at).map(|system| &system.solved)
    }

    /// Solves the system of a setting, unless it is solved.
    pub(super) fn solve(
        &mut self,
        cells: &(dyn Partitioned<'m> + 'm),
        setting: &Setting,
        goals: &[Goal],
    ) -> Result<&Arc<Solved<'m>>, Error> {
        let at = match self.position(setting) {
            Some(at) => at,
            None => {
                let (bytes, solved) = (
                    cells.memory(goals, setting.pairs),
                    Arc::new(Solved::new(cells, setting.absorption)?),
                );
                let kept: usize = self.all.iter().map(|system| system.bytes).sum();
                if kept.saturating_add(bytes) > MEMORY {
                    self.all.clear();
                }
                self.all.push(System {
                    cells: setting.cells,
                    degree: setting.degree,
                    bytes,
                    solved,
                });
                self.all.len() - 1
            }
        };
        let system = self.all.get(at).map(|system| &system.solved);
        system.ok_or(Error::Internal("a solved system was lost"))
    }

    fn position(&self, setting: &Setting) -> Option<usize> {
        let own = (setting.cells, setting.degree);
        let mut all = self.all.iter();
        let at = all.position(|system| (system.cells, system.degree) == own);
        at.filter(|_| !setting.plain)
    }
}
