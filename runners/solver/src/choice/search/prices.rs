//! The best prediction so far, and what settings take from now on.

use core::cmp::Ordering;

use super::super::family::{Family, Prediction};
use super::super::setting::Setting;
use super::Search;

/// How many times as long as plain walks others and their set-up may take, if no error is asked for.
pub(in super::super) const TIMES: f64 = 6.0;
/// Seconds that interrupt nobody's thoughts.
pub(in super::super) const MOMENT: f64 = 1.0;

impl Search<'_> {
    /// The best prediction so far. One without a pilot is believed as long as all pilots took no longer than it tells: if
    /// they did, predictions have been wrong more than once, and every further look would cost a set-up. Of given walks only what had a pilot is
    /// believed: no walk of the answer corrects it.
    pub(in super::super) fn best(&self) -> Option<Prediction> {
        if self.aim.walks().is_some() {
            return self.best_tried();
        }
        let is_tried = |found: &&Prediction| found.pilot_walks > 0;
        let is_believed = |best: &Prediction| is_tried(&best) || self.allowance(best, 1.0) >= 0.0;
        let best = self.best_of(self.found().filter(|found| self.may_answer(&found.setting)));
        best.filter(is_believed)
            .or_else(|| self.best_tried())
            .or(best)
    }

    /// The best prediction of a setting that had a pilot.
    pub(in super::super) fn best_tried(&self) -> Option<Prediction> {
        let tried = |found: &&Prediction| found.pilot_walks > 0 && self.may_answer(&found.setting);
        self.best_of(self.found().filter(tried))
    }

    /// Whether a setting may be chosen: whoever names cells wants walks of a neighbour equation, and of plain ones is only told.
    pub(super) fn may_answer(&self, setting: &Setting) -> bool {
        self.settings.cells.is_none() || !setting.plain
    }

    /// The best prediction of plain walks.
    pub(in super::super) fn best_plain(&self) -> Option<Prediction> {
        self.best_of(self.found().filter(|found| found.setting.plain))
    }

    /// The best of some predictions: of those whose set-up takes no longer than the walks may, if there is one.
    pub(super) fn best_of<'a>(
        &self,
        all: impl Iterator<Item = &'a Prediction>,
    ) -> Option<Prediction> {
        let key = |found: &Prediction| {
            let is_long = self.is_long(found) || self.remaining_setup(found) > self.time_limit();
            // Walks are made in whole stages: of settings that take as many, one leaves least.
            [
                f64::from(u8::from(is_long)),
                self.price(found),
                found.needed,
            ]
        };
        let all = all.map(|found| (key(found), found));
        let best = all.min_by(|(a, _), (b, _)| {
            let pairs = a.iter().zip(b).map(|(a, b)| a.total_cmp(b));
            pairs.fold(Ordering::Equal, Ordering::then)
        });
        best.map(|(_, found)| *found)
    }

    /// What the search minimises: seconds that a setting takes from now on until an error is reached; of given walks, their seconds times the
    /// variance that it leaves over that of the best setting so far.
    pub(in super::super) fn price(&self, found: &Prediction) -> f64 {
        self.cost(found, self.remaining_setup(found), found.careful)
    }

    /// The price of a setting with so many seconds before walks, and so many of walks to the error.
    pub(super) fn cost(&self, found: &Prediction, before: f64, walking: f64) -> f64 {
        match self.walking(found) {
            None => before + walking,
            Some(given) => (before + given) * (walking / given),
        }
    }

    /// Seconds of the walks that are given, if no error is asked for.
    pub(super) fn walking(&self, found: &Prediction) -> Option<f64> {
        let walks = self.aim.walks()? as f64;
        Some(walks * found.targets * found.seconds_per_walk)
    }

    /// Whether given walks and their set-up take longer than they may.
    pub(super) fn is_long(&self, found: &Prediction) -> bool {
        let walking = self.walking(found);
        walking.is_some_and(|walking| found.setup + walking > self.may_take())
    }

    /// Seconds that given walks and their set-up may take: a few times as long as plain walks, or a moment; or the least that what may be chosen
    /// takes, as far as pilots know.
    pub(super) fn may_take(&self) -> f64 {
        let seconds =
            |found: Prediction| found.setup + self.walking(&found).unwrap_or(f64::INFINITY);
        let least = |all: &mut dyn Iterator<Item = Prediction>| {
            let all = all.map(seconds);
            all.reduce(f64::min)
        };
        let firsts = |is_plain: bool| {
            let own = move |family: &&Family| family.first.plain == is_plain;
            let first = |family: &Family| {
                let unknown = || Some(family.unknown(family.levels.first()?, &self.sample.weights));
                family.found.first().copied().or_else(unknown)
            };
            self.families.iter().filter(own).filter_map(first)
        };
        let tried = |found: &&Prediction| found.pilot_walks > 0 && self.may_answer(&found.setting);
        let plain = least(&mut firsts(true)).unwrap_or(0.0);
        let answer = least(&mut self.found().filter(tried).copied());
        let answer = answer.or_else(|| least(&mut firsts(false)));
        (TIMES * plain).max(MOMENT).max(answer.unwrap_or(0.0))
    }

    /// Seconds of a prediction's set-up that are still to come: those of the source alone if the system is solved and has made what it
    /// keeps for such walks.
    pub(super) fn remaining_setup(&self, found: &Prediction) -> f64 {
        let setting = &found.setting;
        let family = self.family_of(setting);
        let has_walked = family.is_some_and(|family| family.has_walked(setting.cells));
        match self.systems.of(setting) {
            None => found.setup,
            Some(_) if has_walked => found.source,
            Some(_) => found.source + found.kept,
        }
    }
}
