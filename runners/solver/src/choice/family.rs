//! A family: settings that differ by their cells alone.

use super::pilot::Pilot;
use super::prediction::{Level, Prediction, Scales};
use super::setting::Setting;

/// The part of the order that finer cells have at least. Choices allow for it.
const SLOW: f64 = 0.75;

/// The least rare variance of other cells over the value that its order predicts: the parity of the number of cells on
/// a wall makes up to a factor of eight.
const OPTIMISTIC_RARE: f64 = 0.125;

/// A degree with a choice of pairs, an absorption and an estimator, and everything that is known of it.
#[derive(Clone, Debug)]
pub(super) struct Family {
    pub(super) first: Setting,
    /// Levels from few cells to many.
    pub(super) levels: Vec<Level>,
    /// Pilots with the numbers of their levels, from few cells to many.
    pilots: Vec<(usize, Pilot)>,
    /// The order r of √Var ~ unknowns^−r in theory.
    order: f64,
    /// The order of what few walks miss.
    rare_order: f64,
    /// The order that is assumed before there are two pilots.
    assumed: f64,
}

impl Family {
    /// A family of which nothing is known but its asymptotic order, and the order of what few walks miss.
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

    /// A family with another absorption or estimator, and with a pilot on the level of this family's last one.
    pub(super) fn varied(&self, pilot: Pilot) -> Self {
        let level = self.pilots.last().map_or(0, |&(level, _)| level);
        Self {
            first: pilot.setting,
            levels: self.levels.clone(),
            pilots: vec![(level, pilot)],
            order: self.order,
            rare_order: self.rare_order,
            assumed: self.observed_order(),
        }
    }

    /// Whether a setting belongs to the family.
    pub(super) fn has(&self, setting: &Setting) -> bool {
        *setting == self.on(setting.cells)
    }

    /// The family's setting with this number of cells.
    pub(super) const fn on(&self, cells: usize) -> Setting {
        Setting {
            cells,
            ..self.first
        }
    }

    /// The pilot on the finest level.
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

    /// The number of the level with these cells; the number of levels if there is none.
    pub(super) fn number(&self, cells: usize) -> usize {
        let level = self.levels.iter().position(|level| level.cells == cells);
        level.unwrap_or(self.levels.len())
    }

    /// Replaces the pilot on the level of this number.
    pub(super) fn add(&mut self, number: usize, pilot: Pilot) {
        self.pilots.retain(|(level, _)| *level != number);
        self.pilots.push((number, pilot));
        self.pilots.sort_by_key(|(level, _)| *level);
    }

    /// Corrects all pilots of fewer walks than these, which missed what others like them missed.
    pub(super) fn missed(&mut self, times: f64, walks: u64) {
        let few = self
            .pilots
            .iter_mut()
            .filter(|(_, pilot)| pilot.walks < walks);
        few.for_each(|(_, pilot)| pilot.missed(times));
    }

    /// The pilot on the level of this number.
    pub(super) fn pilot(&self, number: usize) -> Option<&Pilot> {
        let found = self.pilots.iter().find(|(level, _)| *level == number);
        found.map(|(_, pilot)| pilot)
    }

    /// Whether no level has more cells.
    pub(super) fn is_last(&self, cells: usize) -> bool {
        self.number(cells) + 1 == self.levels.len()
    }

    /// Whether these cells are finer than those of all pilots.
    pub(super) fn is_beyond(&self, cells: usize) -> bool {
        let level = self.number(cells);
        (self.next_number()..self.levels.len()).contains(&level)
    }

    /// The order r of √Var ~ unknowns^−r by the last two pilots. It is at most that of the theory, and at least half
    /// of it: on few cells much depends on where targets lie in them, and a pilot is made on finer ones before they are
    /// believed in.
    fn observed_order(&self) -> f64 {
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

    /// The rare variance on the level of this number, and the least value that it may have. Both are the same if it is
    /// known. Otherwise they follow by the order from the last level before it whose rare variance is known.
    fn rare(&self, number: usize, rare: impl Fn(&Setting) -> Option<f64>) -> [f64; 2] {
        let known = |level: &Level| Some((level.unknowns, rare(&self.on(level.cells))?));
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
        [scaled, OPTIMISTIC_RARE * scaled]
    }

    /// A prediction for every level from the first pilot's on, by the pilot on it or by the last one before it. `rare`
    /// returns the rare variance of a setting, if it is known.
    pub(super) fn predictions(
        &self,
        batch: u64,
        rare: impl Fn(&Setting) -> Option<f64>,
    ) -> Vec<Prediction> {
        let order = self.observed_order();
        let of = |(number, level): (usize, &Level)| {
            let mut before = self.pilots.iter().rev();
            let (_, pilot) = before.find(|(seen, _)| *seen <= number)?;
            let more = level.unknowns / pilot.unknowns;
            let scale = |order: f64| more.powf(-2.0 * order);
            let [rare, optimistic_rare] = self.rare(number, &rare);
            let scales = Scales {
                rare,
                optimistic_rare,
                fast: scale(self.order),
                observed: scale(order),
                slow: scale(SLOW * order),
            };
            Some(pilot.predict(level, &scales, batch))
        };
        self.levels.iter().enumerate().filter_map(of).collect()
    }
}
