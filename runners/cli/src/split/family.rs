//! Settings that differ in cells alone.

use super::pilot::{Level, Pilot, Prediction, Setting};

/// A degree with a choice of pairs, and what is known of it.
#[derive(Clone, Debug)]
pub(super) struct Family {
    pub(super) first: Setting,
    /// From few cells to many.
    pub(super) levels: Vec<Level>,
    /// On the first levels.
    pub(super) pilots: Vec<Pilot>,
    /// √Var ~ unknowns^−order, by theory.
    pub(super) order: f64,
}

impl Family {
    /// Whether a setting is one of it.
    pub(super) fn has(&self, setting: &Setting) -> bool {
        let own = Setting {
            cells: setting.cells,
            ..self.first
        };
        *setting == own
    }

    /// The level after those of the pilots.
    pub(super) fn next(&self) -> Option<Level> {
        self.levels.get(self.pilots.len()).copied()
    }

    /// Whether these cells are finer than the next that could be looked at.
    pub(super) fn is_beyond(&self, cells: usize) -> bool {
        let level = self.levels.iter().position(|level| level.cells == cells);
        level.is_some_and(|level| level > self.pilots.len())
    }

    /// r of √Var ~ unknowns^−r, as the last two pilots have it, and no better than theory.
    pub(super) fn observed(&self) -> f64 {
        let [.., coarse, fine] = self.pilots.as_slice() else {
            return 0.0;
        };
        let falls = coarse.needed() / fine.needed();
        let order = 0.5 * falls.ln() / (fine.unknowns / coarse.unknowns).ln();
        if order.is_finite() {
            order.clamp(0.0, self.order)
        } else {
            self.order
        }
    }

    /// Of every level, from the pilot on it or on the last before it.
    pub(super) fn predictions(&self, batch: u64) -> Vec<Prediction> {
        let levels = self.levels.iter().enumerate();
        let of = |(i, level): (usize, &Level)| {
            let pilot = self.pilots.get(i).or(self.pilots.last())?;
            Some(self.predict(pilot, level, batch))
        };
        levels.filter_map(of).collect()
    }

    /// Of one level, from any pilot.
    pub(super) fn predict(&self, pilot: &Pilot, level: &Level, batch: u64) -> Prediction {
        let more = level.unknowns / pilot.unknowns;
        pilot.predict(level, more.powf(-2.0 * self.observed()), batch)
    }
}
