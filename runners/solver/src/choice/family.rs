//! Settings that differ in cells alone.

use super::pilot::{Level, Pilot, Prediction, Scales, Setting};

/// The part of the order that finer cells have at least, for which a choice is prepared.
const SLOW: f64 = 0.75;

/// How many times less than by the order the rare variance of other cells may be: whether the number of cells of a wall
/// is odd makes up to eight times.
const LUCK: f64 = 0.125;

/// A degree with a choice of pairs, an absorption and an estimator, and what is known of it.
#[derive(Clone, Debug)]
pub(super) struct Family {
    pub(super) first: Setting,
    /// From few cells to many.
    pub(super) levels: Vec<Level>,
    /// With the numbers of their levels, from few cells to many.
    pilots: Vec<(usize, Pilot)>,
    /// √Var ~ unknowns^−order, by theory; the same of what few walks miss.
    order: f64,
    rare_order: f64,
    /// The same as long as there are no two pilots.
    assumed: f64,
}

impl Family {
    /// A family of which nothing is known but the order that it will have in the end.
    pub(super) const fn new(
        first: Setting,
        levels: Vec<Level>,
        [order, rare_order]: [f64; 2],
    ) -> Self {
        Self {
            first,
            levels,
            pilots: Vec::new(),
            order,
            rare_order,
            assumed: order,
        }
    }

    /// Another absorption or estimator, with a pilot on the level of the last one here.
    pub(super) fn varied(&self, pilot: Pilot) -> Self {
        let level = self.pilots.last().map_or(0, |&(level, _)| level);
        Self {
            first: pilot.setting,
            levels: self.levels.clone(),
            pilots: vec![(level, pilot)],
            order: self.order,
            rare_order: self.rare_order,
            assumed: self.observed(),
        }
    }

    /// Whether a setting is one of it.
    pub(super) fn has(&self, setting: &Setting) -> bool {
        let own = Setting {
            cells: setting.cells,
            ..self.first
        };
        *setting == own
    }

    /// The last pilot.
    pub(super) fn last(&self) -> Option<&Pilot> {
        self.pilots.last().map(|(_, pilot)| pilot)
    }

    /// The level of the last pilot.
    pub(super) fn seen(&self) -> Option<Level> {
        let (level, _) = self.pilots.last()?;
        self.levels.get(*level).copied()
    }

    /// The number of the level after those of the pilots.
    pub(super) fn next_number(&self) -> usize {
        self.pilots.last().map_or(0, |(level, _)| level + 1)
    }

    /// The number of the level that has so many cells; that after the last if there is none.
    pub(super) fn number(&self, cells: usize) -> usize {
        let level = self.levels.iter().position(|level| level.cells == cells);
        level.unwrap_or(self.levels.len())
    }

    /// Takes a pilot on the level of this number, in place of what was known there.
    pub(super) fn add(&mut self, number: usize, pilot: Pilot) {
        self.pilots.retain(|(level, _)| *level != number);
        self.pilots.push((number, pilot));
        self.pilots.sort_by_key(|(level, _)| *level);
    }

    /// Whether there is no level with more cells.
    pub(super) fn is_last(&self, cells: usize) -> bool {
        self.number(cells) + 1 == self.levels.len()
    }

    /// Whether these cells are finer than those that were looked at.
    pub(super) fn is_beyond(&self, cells: usize) -> bool {
        let level = self.number(cells);
        (self.next_number()..self.levels.len()).contains(&level)
    }

    /// r of √Var ~ unknowns^−r, as the last two pilots have it; no better than theory, and no worse than half of
    /// it: on few cells much depends on where targets lie in them, and finer ones are looked at before they are
    /// believed in.
    fn observed(&self) -> f64 {
        let [.., (_, coarse), (_, fine)] = self.pilots.as_slice() else {
            return self.assumed;
        };
        let falls = coarse.needed() / fine.needed();
        let order = 0.5 * falls.ln() / (fine.unknowns / coarse.unknowns).ln();
        if order.is_finite() {
            order.clamp(0.5 * self.order, self.order)
        } else {
            self.order
        }
    }

    /// The rare variance on the level of this number, and the least that it may be: the same if it is known, or by the
    /// order from the last level before it of which it is.
    fn rare(&self, number: usize, rare: impl Fn(&Setting) -> Option<f64>) -> [f64; 2] {
        let known = |level: &Level| {
            let setting = Setting {
                cells: level.cells,
                ..self.first
            };
            Some((level.unknowns, rare(&setting)?))
        };
        let Some((last, before)) = self.levels.get(..=number).and_then(<[_]>::split_last) else {
            return [0.0; 2];
        };
        if let Some((_, rare)) = known(last) {
            return [rare; 2];
        }
        let known = before.iter().rev().find_map(known);
        let scaled = known.map_or(0.0, |(unknowns, rare)| {
            rare * (last.unknowns / unknowns).powf(-2.0 * self.rare_order)
        });
        [scaled, LUCK * scaled]
    }

    /// Of every level from the first pilot's on, from the pilot on it or on the last before it; `rare` tells the rare
    /// variance of a setting, if it is known.
    pub(super) fn predictions(
        &self,
        batch: u64,
        rare: impl Fn(&Setting) -> Option<f64>,
    ) -> Vec<Prediction> {
        let order = self.observed();
        let of = |(number, level): (usize, &Level)| {
            let mut before = self.pilots.iter().rev();
            let (_, pilot) = before.find(|(seen, _)| *seen <= number)?;
            let more = level.unknowns / pilot.unknowns;
            let scale = |order: f64| more.powf(-2.0 * order);
            let [rare, rare_luckily] = self.rare(number, &rare);
            let scales = Scales {
                rare,
                rare_luckily,
                fast: scale(self.order),
                observed: scale(order),
                slow: scale(SLOW * order),
            };
            Some(pilot.predict(level, &scales, batch))
        };
        self.levels.iter().enumerate().filter_map(of).collect()
    }
}
