//! Families of the search: their beginnings, their levels, and their predictions.

use fredholm_core::Statistics;

use super::super::family::Family;
use super::super::pilot::{self, Pilot, Walked};
use super::super::prediction::{Level, Prediction, Scales};
use super::super::setting::Setting;
use super::candidates::open;
use super::pilots::{Allowance, FIRST, VARY};
use super::{Search, is_refused};
use crate::Pairs;
use crate::cost::PointwisePairs;

/// The number of levels to begin with, and of those added if the finest is the best.
const LEVELS: usize = 5;
/// The share of a set-up that belongs to cells next to corners.
pub(super) const CORNERS: f64 = 0.1;

impl Search<'_> {
    /// A pilot on the fewest cells of every degree and every choice of pairs that may pay. Others wait until they may.
    pub(super) fn begin_families(&mut self) {
        let degrees: Vec<usize> = (0..=self.about.most_degree).collect();
        let all = [Pairs::Default, Pairs::Pointwise];
        for degree in open(self.settings.degree, &degrees) {
            for pairs in open(self.settings.pairs, &all) {
                let first = Setting {
                    degree,
                    pairs,
                    ..self.base()
                };
                let (coarsest, order) = self.levels(&first, 1);
                let family = Family::new(first, coarsest, order);
                if let Some(family) = self.begin(family) {
                    self.waiting.push(family);
                }
            }
        }
    }

    /// A pilot on the fewest cells of every waiting family that may pay now: the best may not be what it seemed to be.
    /// Whether a family has begun.
    pub(super) fn begin_waiting(&mut self) -> bool {
        let waiting = core::mem::take(&mut self.waiting);
        let before = waiting.len();
        let left = waiting.into_iter().filter_map(|family| self.begin(family));
        let left: Vec<Family> = left.collect();
        self.waiting = left;
        self.waiting.len() < before
    }

    /// A pilot on the fewest cells of a family which the problem takes, if it may pay; the family otherwise. On very few
    /// cells, h may be so far from k that its walks have an infinite variance.
    fn begin(&mut self, mut family: Family) -> Option<Family> {
        for number in 0..=LEVELS {
            if self.explore(&mut family, number, FIRST) {
                self.extend(&mut family);
                self.families.push(family);
                return None;
            }
            let Some(&Level { cells, .. }) = family.levels.get(number) else {
                break;
            };
            let is_refused = self.refuses(&family.on(cells));
            if !is_refused || family.is_last(cells) && !self.extend(&mut family) {
                break;
            }
        }
        Some(family)
    }

    /// Adds levels to a family and to those that differ by their walks alone; whether there were any.
    pub(super) fn extend(&mut self, family: &mut Family) -> bool {
        let known = family.levels.len();
        let levels = self.levels(&family.first, known + LEVELS).0;
        let mut others = core::mem::take(&mut self.families);
        let own = family.first;
        let related = others
            .iter_mut()
            .filter(|other| other.first.shares_order(&own));
        for family in related.chain([&mut *family]) {
            family.levels.clone_from(&levels);
            self.update_predictions(family);
        }
        self.families = others;
        levels.len() > known
    }

    /// A pilot on the level of this number, or the rare variance there, if it pays; whether it did.
    pub(super) fn explore(
        &mut self,
        family: &mut Family,
        number: usize,
        allowance: Allowance,
    ) -> bool {
        let Some(&level) = family.levels.get(number) else {
            return false;
        };
        let setting = family.on(level.cells);
        let pairs = match family.last() {
            Some(last) => last.pairs(level.unknowns),
            None => self.observed_pairs(&setting),
        };
        if !self.affords(&setting, &level.cost, pairs, allowance) {
            return false;
        }
        // The coarsest cells are solved in any case, and so are those of the best setting.
        let is_best = self.best().is_some_and(|best| best.setting == setting);
        let in_any_case = family.last().is_none() || is_best;
        if !in_any_case && self.measure_rare_variance(&setting, level.cost.setup) {
            self.update_predictions(family);
            return true;
        }
        let Some(pilot) = self.pilot(setting, allowance) else {
            return false;
        };
        family.add(number, pilot);
        self.update_predictions(family);
        self.update_related(&setting);
        true
    }

    /// A pilot of a family with other walks; whether it was made.
    pub(super) fn begin_varied(&mut self, family: &Family, setting: Setting) -> bool {
        let Some(pilot) = self.pilot(setting, VARY) else {
            return false;
        };
        let varied = family.varied(pilot);
        self.update_predictions(&varied);
        self.families.push(varied);
        true
    }

    /// Computes the rare variance of a setting, if it is not known; whether it was not. It takes a small part of a set-up
    /// that may be in vain.
    pub(super) fn measure_rare_variance(&mut self, setting: &Setting, setup: f64) -> bool {
        if self.rare.of(setting).is_some() {
            return false;
        }
        self.spent += CORNERS * setup;
        self.work += CORNERS * setup;
        let cut = setting.applied(self.settings).discretisation();
        let cells = self.model.partition(&cut);
        let measured = cells.and_then(|cells| self.rare.measure(&*cells, setting, None));
        if let Err(refusal) = measured {
            self.refuse(refusal);
            self.forget(*setting);
        }
        self.update_related(setting);
        true
    }

    /// Replaces what a pilot told of a setting by what these walks of all targets tell; the prediction then.
    pub(in super::super) fn correct(
        &mut self,
        setting: &Setting,
        statistics: &[Statistics],
    ) -> Option<Prediction> {
        let squares = pilot::squares(statistics.iter());
        let mut family = self.take_family(setting);
        let number = family.as_ref().map(|family| family.number(setting.cells));
        let level = match (&family, number) {
            (Some(family), Some(number)) => family.levels.get(number).copied(),
            _ => self.plain_level(),
        };
        let last = family.as_ref().and_then(Family::last);
        let unknowns = level?.unknowns;
        let walked = Walked {
            statistics: statistics.iter().collect(),
            weights: &[],
            pointwise: last.map_or_else(PointwisePairs::default, |last| last.pairs(unknowns)),
            unknowns,
        };
        let doubt = self.doubt(setting.absorption);
        let pilot = Pilot::new(
            *setting,
            &walked,
            self.tolerance,
            self.model,
            &squares,
            doubt,
        );
        if let (Some(mut family), Some(number)) = (family.take(), number) {
            let before = family
                .pilot(number)
                .filter(|before| before.walks < pilot.walks);
            let times = before.map_or(1.0, |before| pilot.needed() / before.needed());
            self.correct_related(setting, times, pilot.walks);
            family.add(number, pilot);
            self.update_predictions(&family);
            self.families.push(family);
        } else {
            let predicted = pilot.predict(&level?, &Scales::PLAIN, self.batch());
            self.found.retain(|found| found.setting != *setting);
            self.found.push(predicted);
        }
        self.best_of(|found| found.setting == *setting)
    }

    /// Corrects what few walks told of the same neighbour equation with other walks, if this setting's missed as much as
    /// that of the variance: they missed the same.
    fn correct_related(&mut self, setting: &Setting, times: f64, walks: u64) {
        if !(times > 1.0 && times.is_finite()) {
            return;
        }
        let mut families = core::mem::take(&mut self.families);
        let related = families
            .iter_mut()
            .filter(|f| f.first.shares_order(setting));
        related.for_each(|family| family.missed(times, walks));
        self.families = families;
        self.update_related(setting);
    }

    /// Replaces the predictions of a family.
    fn update_predictions(&mut self, family: &Family) {
        self.found.retain(|found| !family.has(&found.setting));
        let mut predicted = family.predictions(self.batch(), |setting| self.rare.of(setting));
        predicted.retain(|found| !is_refused(&self.refused, &found.setting));
        self.found.extend(predicted);
    }

    /// Replaces the predictions of all families whose rare variance is that of a setting.
    fn update_related(&mut self, setting: &Setting) {
        let families = core::mem::take(&mut self.families);
        let related = |family: &&Family| family.first.shares_order(setting);
        for family in families.iter().filter(related) {
            self.update_predictions(family);
        }
        self.families = families;
    }

    /// The pointwise pairs of a row that a pilot with another degree observed on these cells; none without such a pilot.
    fn observed_pairs(&self, setting: &Setting) -> PointwisePairs {
        let alike = |pilot: &&Pilot| {
            (pilot.setting.cells, pilot.setting.pairs) == (setting.cells, setting.pairs)
        };
        let seen = self.families.iter().filter_map(Family::last);
        let like = seen.rev().find(alike);
        like.map_or_else(PointwisePairs::default, |pilot| pilot.pointwise)
    }

    /// Removes the family of a setting from the list, and returns it.
    pub(super) fn take_family(&mut self, setting: &Setting) -> Option<Family> {
        let at = self.families.iter().position(|f| f.has(setting))?;
        Some(self.families.swap_remove(at))
    }
}
