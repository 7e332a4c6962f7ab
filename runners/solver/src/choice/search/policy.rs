//! The policy: which pilot comes next.

use fredholm_core::MIN_BATCHES;

use super::super::family::Family;
use super::super::prediction::Prediction;
use super::super::setting::Setting;
use super::Search;
use super::families::CORNERS;
use super::pilots::{Allowance, CONFIRM, CONFIRM_BEST, FINER, FINER_BEST, PILOT_SECONDS, VARY};

/// The least number of scored walks that show how rare scores are.
const ENOUGH_SCORED: f64 = 64.0;
/// The share of a stage which suffices even if pilots missed scores that are very rare.
const SAFE_SHARE: f64 = 1.0 / 16.0;

impl Search<'_> {
    /// Makes the next pilots that may improve the best setting; whether there were any.
    pub(super) fn improve(&mut self) -> bool {
        self.begin_waiting()
            || self.measure_promising()
            || self.vary_walks()
            || self.refine_best()
            || self.explore_promising()
            || self.confirm()
    }

    /// Computes the rare variance that may save most, if it may save more than twice its time; whether there was one.
    fn measure_promising(&mut self) -> bool {
        let Some(best) = self.best() else {
            return false;
        };
        let gain = |found: &Prediction| {
            let seconds = CORNERS * found.setup;
            self.price(&best) - self.remaining_setup_of(found) - found.optimistic - 2.0 * seconds
        };
        let is_unknown = |found: &&Prediction| {
            found.setting != best.setting && self.rare.of(&found.setting).is_none()
        };
        let unknown = self.found.iter().filter(is_unknown);
        let most = unknown.max_by(|a, b| gain(a).total_cmp(&gain(b)));
        let most = most.filter(|found| gain(found) > 0.0).copied();
        most.is_some_and(|found| self.measure_rare_variance(&found.setting, found.setup))
    }

    /// Pilots with the absorptions and estimators that the best neighbour equation has not had; whether there were any.
    fn vary_walks(&mut self) -> bool {
        let Some(best) = self.best_of(|found| !found.setting.plain) else {
            return false;
        };
        let family = self.families.iter().find(|f| f.has(&best.setting));
        let Some(family) = family.cloned() else {
            return false;
        };
        let (Some(level), Some(last)) = (family.seen(), family.last()) else {
            return false;
        };
        let mut unseen = Vec::new();
        for (absorption, estimator) in self.kinds_of_walks() {
            let setting = Setting {
                absorption,
                estimator,
                ..last.setting
            };
            let known = self.families.iter().any(|family| family.has(&setting));
            if !known && self.affords(&setting, &level.cost, last.pointwise, VARY) {
                unseen.push(setting);
            }
        }
        let seconds = unseen
            .iter()
            .map(|setting| self.seconds(setting, &level.cost, last.pointwise, VARY));
        // Few cells will do only if finer ones take longer to set up.
        if best.pilot_walks == 0 && seconds.sum::<f64>() > self.remaining_setup_of(&best) {
            return false;
        }
        let mut more = false;
        for setting in unseen {
            more |= self.begin_varied(&family, setting);
        }
        more
    }

    /// A pilot on finer cells of the best family, if its best prediction is beyond its pilots; whether it was made.
    fn refine_best(&mut self) -> bool {
        let Some(best) = self.best() else {
            return false;
        };
        let Some(mut family) = self.take_family(&best.setting) else {
            return false;
        };
        let (cells, number) = (best.setting.cells, family.number(best.setting.cells));
        let more = family.is_last(cells) && self.extend(&mut family)
            || family.is_beyond(cells) && {
                let before = self.intermediate_pilot(&family, &best);
                before.is_some_and(|before| self.explore(&mut family, before, FINER_BEST))
                    || self.explore(&mut family, number, FINER_BEST)
            };
        self.families.push(family);
        more
    }

    /// The level before that of the best prediction at which a pilot may save most.
    fn intermediate_pilot(&self, family: &Family, best: &Prediction) -> Option<usize> {
        let before =
            |found: &Prediction| found.pilot_walks == 0 && found.setting.cells < best.setting.cells;
        let (number, _) = self.promising(family, best, before)?;
        Some(number)
    }

    /// The level of a family at which a pilot may save most, if it may save more than twice its time. A level with a
    /// pilot is confirmed, if its system is not that of the best prediction.
    fn promising(
        &self,
        family: &Family,
        best: &Prediction,
        of: impl Fn(&Prediction) -> bool,
    ) -> Option<(usize, Allowance)> {
        let allowance = |found: &Prediction| {
            if found.pilot_walks == 0 {
                FINER
            } else {
                CONFIRM
            }
        };
        let gain = |found: &Prediction| {
            let walks = (allowance(found).walks * self.sample.targets() as u64) as f64;
            let seconds =
                self.remaining_setup_of(found) + PILOT_SECONDS + walks * found.seconds_per_walk;
            self.price(best) - self.best_case_price(found) - 2.0 * seconds
        };
        let own = self.found.iter().filter(|found| family.has(&found.setting));
        let other = |found: &Prediction| !found.setting.shares_system(&best.setting);
        let unconfirmed = |found: &Prediction| found.pilot_walks < CONFIRM.walks && other(found);
        let open = own.filter(|found| of(found) && (found.pilot_walks == 0 || unconfirmed(found)));
        let most = open.max_by(|a, b| gain(a).total_cmp(&gain(b)))?;
        (gain(most) > 0.0).then(|| (family.number(most.setting.cells), allowance(most)))
    }

    /// A pilot of every family that may well be faster than the best: its first pilot may have had much variance by
    /// chance, or other pairs had pilots on finer cells. Whether there was one.
    fn explore_promising(&mut self) -> bool {
        let mut families = core::mem::take(&mut self.families);
        let mut more = false;
        for family in &mut families {
            let Some(best) = self.best().filter(|best| !family.has(&best.setting)) else {
                continue;
            };
            if let Some((number, allowance)) = self.promising(family, &best, |_| true) {
                more |= self.explore(family, number, allowance);
            }
        }
        self.families = families;
        more
    }

    /// More walks of the best setting, if much may depend on them; whether there were any.
    fn confirm(&mut self) -> bool {
        let unconfirmed = |best: &Prediction| best.pilot_walks < CONFIRM.walks;
        let Some(best) = self.best().filter(unconfirmed) else {
            return false;
        };
        // Rare scores must not take one more stage, and far less if they may be very rare.
        let stage = (self.batch() * MIN_BATCHES) as f64;
        let is_sure = if self.has_rare_scores(&best.setting) {
            best.worst_case_walks <= SAFE_SHARE * stage
        } else {
            best.risk_adjusted <= best.walking
        };
        let is_told = best.pilot_walks > 0 && best.scored >= ENOUGH_SCORED;
        if is_told && is_sure && self.has_safe_variance(best.setting.absorption) {
            return false;
        }
        if best.setting.plain {
            return self.confirm_plain(best.setting);
        }
        let Some(mut family) = self.take_family(&best.setting) else {
            return false;
        };
        let number = family.number(best.setting.cells);
        let more = self.explore(&mut family, number, CONFIRM_BEST);
        self.families.push(family);
        more
    }

    /// Pilots with shorter walks of those families that they may make the best.
    pub(super) fn shorten_walks(&mut self) {
        for family in self.families.clone() {
            let mut shorter = self.absorptions.clone();
            shorter.retain(|&absorption| absorption > family.first.absorption);
            for absorption in shorter {
                self.shorten_to(&family, absorption);
            }
        }
    }

    /// A pilot of a family with shorter walks, if they would be the best with the variance of longer ones.
    fn shorten_to(&mut self, family: &Family, absorption: f64) {
        let Some((level, pilot)) = family.seen().zip(family.last()) else {
            return;
        };
        let setting = Setting {
            absorption,
            ..pilot.setting
        };
        let alike = family.varied(pilot.shortened(setting, self.doubt(absorption)));
        let predicted = alike.predictions(self.batch(), |setting| self.rare.of(setting));
        let seconds = predicted
            .iter()
            .map(|found| self.remaining_setup_of(found) + found.walking);
        let best = self.best().map(|best| self.price(&best));
        if seconds.min_by(f64::total_cmp) < best
            && self.affords(&setting, &level.cost, pilot.pointwise, VARY)
        {
            self.begin_varied(family, setting);
        }
    }
}
