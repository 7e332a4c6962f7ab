//! Whether walks follow a lift: where u is smooth, a matrix of few cells is enough for errors that finer ones take long for.
//!
//! A lift is tried before a pilot that takes twice as long, so that all lifts together take at most half of what pilots take.

use std::sync::Arc;

use fredholm_core::MIN_BATCHES;
use fredholm_model::cost::{Cost, PointwisePairs};

use super::super::family::{Prediction, batches_of_whole_stages};
use super::super::pilot::Observed;
use super::super::setting::Setting;
use super::{PAYS, PILOT_SECONDS, Search};
use crate::answer::Solved;
use crate::{Error, Model, Pairs, Settings};

/// Walks of a pilot, a quarter of the least run: scores have rare corrections, in one of some hundred to thousand states, which may make
/// most of their variance.
pub(in super::super) const LIFTED_PILOT: u64 = 16_384;
/// The part of the time of the next pilot that a lift may take before it.
const BEFORE: f64 = 0.5;

/// A lift, and what walks that follow it are predicted to take.
#[derive(Clone, Debug)]
pub(in super::super) struct Lifted<'m> {
    pub(in super::super) prediction: Prediction,
    /// The degree of v'.
    pub(in super::super) degree: usize,
    pub(in super::super) solved: Arc<Solved<'m>>,
}

impl Lifted<'_> {
    /// Asks for this lift.
    pub(in super::super) const fn apply(&self, settings: &mut Settings) {
        settings.lift = Some(self.degree);
        settings.pairs = None;
    }
}

/// All lifts that were tried.
#[derive(Debug)]
pub(super) struct Lifts<'m> {
    /// The degree to which is lifted, if that may be chosen.
    degree: Option<usize>,
    /// Cells and degrees of those that were tried.
    tried: Vec<[usize; 2]>,
    best: Option<Lifted<'m>>,
}

impl Lifts<'_> {
    pub(super) fn new(model: &dyn Model, settings: &Settings) -> Self {
        let is_open = settings.lift.is_none()
            && settings.pairs.is_none()
            && settings.walks.is_none()
            && settings.tolerance.is_some();
        let most = if is_open { model.about().most_lift } else { 0 };
        Self {
            degree: (most > 0).then_some(most),
            tried: Vec::new(),
            best: None,
        }
    }
}

impl<'m> Search<'m> {
    /// Walks of a lift in place of others that take so many seconds, if they are predicted to take less than half as long.
    pub(in super::super) fn lift(&self, price: f64) -> Option<Lifted<'m>> {
        let best = self.lifts.best.as_ref();
        best.filter(|best| PAYS * best.prediction.careful < price)
            .cloned()
    }

    /// From now on nothing is lifted.
    pub(in super::super) fn forget_lifts(&mut self) {
        self.lifts.degree = None;
        self.lifts.best = None;
    }

    /// Seconds of the best lift so far.
    pub(super) fn lift_price(&self) -> Option<f64> {
        Some(self.lifts.best.as_ref()?.prediction.careful)
    }

    /// Tries a lift, if one may pay and takes less than half as long as a pilot of so many seconds.
    pub(super) fn try_lift_before(&mut self, seconds: f64) -> bool {
        let (Some(degree), Some(best)) = (self.lifts.degree, self.best()) else {
            return false;
        };
        let price = self.least_price(&best);
        let all = self.lift_candidates().into_iter().filter_map(|setting| {
            let cost = self.partition(&setting).ok()?.lift_cost(degree)?;
            let pilot = PILOT_SECONDS + cost.setup + self.lift_seconds(&cost, LIFTED_PILOT);
            let least = MIN_BATCHES * self.settings.batch();
            let all = cost.setup + self.lift_seconds(&cost, least);
            (pilot < BEFORE * seconds && PAYS * all < price).then_some((setting, cost, pilot))
        });
        // The finest that there is time for.
        let Some((setting, cost, pilot)) = all.max_by(|a, b| a.2.total_cmp(&b.2)) else {
            return false;
        };
        self.lifts.tried.push([setting.cells, setting.degree]);
        self.work += pilot;
        if let Ok(lifted) = self.try_lift(setting, degree, &cost) {
            self.add_lifted(&lifted, cost.walk);
            if lifted.prediction.careful < self.lift_price().unwrap_or(f64::INFINITY) {
                self.lifts.best = Some(lifted);
            }
        }
        true
    }

    /// Seconds of so many walks of every target of the sample.
    fn lift_seconds(&self, cost: &Cost, walks: u64) -> f64 {
        let none = PointwisePairs::default();
        let estimator = self.settings.absorption().estimator();
        let each = cost.walk.seconds(estimator, self.states, none);
        walks as f64 * self.sample.weights.iter().sum::<f64>() * each
    }

    /// Settings of pilots that were not lifted: of every number of cells the highest degree.
    fn lift_candidates(&self) -> Vec<Setting> {
        let pilots = self.families.iter().flat_map(|family| &family.pilots);
        let mut all: Vec<Setting> = Vec::new();
        for setting in pilots.map(|pilot| pilot.setting) {
            let is_plain = setting.plain || setting.pairs != Pairs::Default;
            if is_plain || self.lifts.tried.contains(&[setting.cells, setting.degree]) {
                continue;
            }
            match all.iter_mut().find(|other| other.cells == setting.cells) {
                Some(other) if other.degree < setting.degree => *other = setting,
                Some(_) => {}
                None => all.push(setting),
            }
        }
        all
    }

    fn try_lift(
        &mut self,
        setting: Setting,
        degree: usize,
        cost: &Cost,
    ) -> Result<Lifted<'m>, Error> {
        let solved = Solved::new(&*self.partition(&setting)?)?;
        let solved = Arc::new(solved.lifted(Some(degree))?);
        let settings = Settings {
            lift: Some(degree),
            pairs: None,
            sequence: None,
            ..setting.applied(self.settings)
        };
        let mut pilot = self.observed((setting, Some(&solved)), settings, LIFTED_PILOT)?;
        pilot.correct(&self.known);
        self.pilots += 1;
        self.walks += pilot.walks;
        let each = cost.walk.seconds(
            self.settings.absorption().estimator(),
            pilot.states,
            PointwisePairs::default(),
        );
        let batch = self.settings.batch() as f64;
        let walks =
            |target: &Observed| batch * batches_of_whole_stages(target.careful_walks(1.0) / batch);
        let walks_of = |target: &Observed| target.weight * walks(target);
        let all: f64 = pilot.observed().map(walks_of).sum();
        let most = pilot.observed().map(walks).fold(0.0, f64::max);
        Ok(Lifted {
            prediction: Prediction {
                setting,
                setup: cost.setup,
                source: 0.0,
                kept: 0.0,
                seconds_per_walk: each,
                walking: all * each,
                careful: all * each,
                hopeful: all * each,
                shown: all * each,
                pilot_walks: pilot.walks_each,
                scored: pilot.scored,
                most_walks: most,
                targets: pilot.observed().map(|target| target.weight).sum(),
                walks: all,
                needed: pilot.needed_of_all(),
                states: all * pilot.states,
            },
            degree,
            solved,
        })
    }
}
