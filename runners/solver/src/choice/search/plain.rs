//! Pilots of plain walks, which need no neighbour equation.

use fredholm_core::Estimator;

use super::super::prediction::{Level, Prediction, Scales};
use super::super::setting::Setting;
use super::Search;
use super::pilots::{Allowance, CONFIRM, FIRST};
use crate::cost::PointwisePairs;

/// The slowdown from which on no more plain walks are tried.
const HOPELESS: f64 = 10.0;

impl Search<'_> {
    /// The first pilots of plain walks: the shortest walks, and those with every default.
    pub(super) fn pilot_first_plain(&mut self) {
        let base = self.plain_base();
        let absorption = self.settings.walk_options().absorption;
        let default = Setting {
            absorption,
            estimator: Estimator::Collision,
            ..base
        };
        let Some(level) = self.plain_level() else {
            return;
        };
        let open = self.kinds_of_walks();
        for setting in [base, default] {
            if open.contains(&(setting.absorption, setting.estimator)) {
                self.pilot_plain(setting, &level, FIRST);
            }
        }
    }

    /// Pilots of all other plain walks, unless plain walks are hopeless.
    pub(super) fn pilot_other_plain(&mut self) {
        let plain: Vec<Prediction> = self
            .found
            .iter()
            .filter(|f| f.setting.plain)
            .copied()
            .collect();
        let fastest = plain.iter().map(Prediction::seconds).min_by(f64::total_cmp);
        if fastest.is_none_or(|fastest| fastest > HOPELESS * self.least_seconds()) {
            return;
        }
        let Some(level) = self.plain_level() else {
            return;
        };
        for (absorption, estimator) in self.kinds_of_walks() {
            let known = |f: &Prediction| (f.setting.absorption, f.setting.estimator);
            if plain.iter().all(|f| known(f) != (absorption, estimator)) {
                let setting = Setting {
                    absorption,
                    estimator,
                    ..self.plain_base()
                };
                self.pilot_plain(setting, &level, FIRST);
            }
        }
    }

    /// Confirms plain walks; whether a pilot was made.
    pub(super) fn confirm_plain(&mut self, setting: Setting) -> bool {
        let level = self.plain_level();
        level.is_some_and(|level| self.pilot_plain(setting, &level, CONFIRM))
    }

    /// A pilot of plain walks, if it pays; whether it was made.
    fn pilot_plain(&mut self, setting: Setting, level: &Level, allowance: Allowance) -> bool {
        let setting = Setting {
            cells: level.cells,
            ..setting
        };
        let none = PointwisePairs::default();
        if !self.affords(&setting, &level.cost, none, allowance) {
            return false;
        }
        let Some(pilot) = self.pilot(setting, allowance) else {
            return false;
        };
        if pilot.scored() == 0.0 && allowance.walks < CONFIRM.walks {
            return self.pilot_plain(setting, level, CONFIRM);
        }
        self.found.retain(|found| found.setting != setting);
        self.found
            .push(pilot.predict(level, &Scales::PLAIN, self.batch()));
        true
    }

    /// The level of plain walks. Its cells are those of no neighbour equation.
    pub(super) fn plain_level(&mut self) -> Option<Level> {
        let base = self.plain_base();
        self.levels(&base, 1).0.first().copied()
    }
}
