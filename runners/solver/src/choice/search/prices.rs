//! The best prediction so far, and what settings take from now on.

use core::cmp::Ordering;

use super::super::family::Prediction;
use super::super::setting::Setting;
use super::Search;

impl Search<'_> {
    /// The best prediction so far. One without a pilot is believed as long as all pilots took no longer than it tells: if
    /// they did, predictions have been wrong more than once, and every further look would cost a set-up.
    pub(in super::super) fn best(&self) -> Option<Prediction> {
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
        let limit = self.time_limit();
        let key = |found: &Prediction| {
            let is_long = self.remaining_setup(found) > limit;
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

    /// Seconds that a setting takes from now on, which the search minimises.
    pub(in super::super) fn price(&self, found: &Prediction) -> f64 {
        self.remaining_setup(found) + found.careful
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
