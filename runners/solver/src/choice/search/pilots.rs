//! One pilot of the search: whether it pays, its walks, and its cost.

use fredholm_core::MIN_BATCHES;
use fredholm_rayon::Observer;

use super::super::LONG_SECONDS;
use super::super::pilot::{self, Pilot, Walked};
use super::super::setting::Setting;
use super::{Search, Squares};
use crate::Error;
use crate::answer::{SolveObserver, Walks};
use crate::cost::{Cost, PointwisePairs};
use crate::model::Request;

/// Seconds of a pilot apart from its walks and its set-up.
pub(super) const PILOT_SECONDS: f64 = 0.1e-3;
/// The least length of a walk over its mean length 1/q0.
const LEAST_LENGTH: f64 = 0.9;
/// The mask of a pilot's seed. Its walks differ from those of the answer, which it must not be able to prefer.
const SEED: u64 = 0x0070_696c_6f74;

/// The walks of a pilot, and what it may take.
#[derive(Clone, Copy, Debug)]
pub(super) struct Allowance {
    /// The number of walks of each target.
    pub(super) walks: u64,
    /// The share of the best prediction so far that the pilot may take.
    one: f64,
    /// The share of the best prediction so far that all pilots may take, this one included.
    all: f64,
    /// Whether the set-up counts. If the answer may use the set-up again, the pilot is judged by what it may save.
    setup: bool,
}

impl Allowance {
    /// This allowance with the set-up counted.
    const fn with_setup(self) -> Self {
        Self {
            setup: true,
            ..self
        }
    }
}

/// The allowance of first pilots.
pub(super) const FIRST: Allowance = Allowance {
    walks: 256,
    one: 0.03,
    all: 0.2,
    setup: true,
};
/// The allowance of pilots on finer cells of the best setting.
pub(super) const FINER_BEST: Allowance = Allowance {
    walks: 512,
    one: 0.15,
    all: 0.35,
    setup: false,
};
/// The allowance of pilots on finer cells of other settings.
pub(super) const FINER: Allowance = Allowance {
    setup: true,
    ..FINER_BEST
};
/// The allowance of pilots on the same cells with other walks.
pub(super) const VARY: Allowance = Allowance { one: 0.01, ..FINER };
/// The allowance of pilots that confirm other settings.
pub(super) const CONFIRM: Allowance = Allowance {
    walks: 2048,
    all: 0.5,
    ..FINER
};
/// The allowance of pilots that confirm the best setting.
pub(super) const CONFIRM_BEST: Allowance = Allowance {
    setup: false,
    ..CONFIRM
};

/// Seconds of a walk of mean length.
fn seconds_of_walk(setting: &Setting, cost: &Cost, pairs: PointwisePairs) -> f64 {
    let walk = setting.walk(cost);
    walk.seconds(setting.estimator, 1.0 / setting.absorption, pairs)
}

impl Search<'_> {
    /// Whether a pilot is worth its time: it is cheap, and its setting is the best or takes less with one stage of walks.
    pub(super) fn affords(
        &self,
        setting: &Setting,
        cost: &Cost,
        pairs: PointwisePairs,
        allowance: Allowance,
    ) -> bool {
        if self.refuses(setting) {
            return false;
        }
        let Some(best) = self.best() else {
            return true;
        };
        let setup = self.remaining_setup(setting, setting.setup(cost));
        let stage = (self.batch() * MIN_BATCHES) as f64 * self.sample.weight();
        let stage = stage * seconds_of_walk(setting, cost, pairs);
        let seconds = self.seconds(setting, cost, pairs, allowance);
        let whole = best.seconds().min(self.patience);
        (best.setting == *setting || setup + LEAST_LENGTH * stage <= self.price(&best))
            && seconds <= allowance.one * whole
            && self.spent + seconds <= allowance.all * whole
            && self.seconds(setting, cost, pairs, allowance.with_setup()) <= self.budget
    }

    /// Seconds of a pilot that count.
    pub(super) fn seconds(
        &self,
        setting: &Setting,
        cost: &Cost,
        pairs: PointwisePairs,
        allowance: Allowance,
    ) -> f64 {
        let setup = self.remaining_setup(setting, setting.setup(cost));
        let setup = if allowance.setup { setup } else { 0.0 };
        let walks = (allowance.walks * self.sample.targets() as u64) as f64;
        PILOT_SECONDS + setup + walks * seconds_of_walk(setting, cost, pairs)
    }

    /// A pilot of a setting. It is `None` if the problem refuses the setting, which is forgotten then.
    pub(super) fn pilot(&mut self, setting: Setting, allowance: Allowance) -> Option<Pilot> {
        if self.watch.cancelled() {
            return None;
        }
        let pilot = self.try_pilot(setting, allowance);
        let refused = |refusal| {
            self.refuse(refusal);
            self.forget(setting);
        };
        pilot.map_err(refused).ok()
    }

    fn try_pilot(&mut self, setting: Setting, allowance: Allowance) -> Result<Pilot, Error> {
        let settings = setting.applied(self.settings);
        let cells = self.cells(&setting)?;
        let cost = cells.cost(setting.pairs);
        let none = PointwisePairs::default();
        let seconds = self.seconds(&setting, &cost, none, allowance.with_setup());
        self.warn_of(seconds);
        self.budget -= seconds;
        let mut walk = settings.walk_options();
        walk.walks = allowance.walks;
        walk.tolerance = None;
        walk.time_limit = None;
        walk.seed ^= SEED;
        let walks = Walks {
            model: self.model,
            scalar: self.settings.scalar,
        };
        let request = Request {
            goals: &self.sample.goals,
            walk: &walk,
            only_u: false,
        };
        let watch = Quiet(self.watch);
        let answer = if setting.plain {
            walks.plain(&*cells, &request, &watch)?
        } else {
            let setup = self.remaining_setup(&setting, setting.setup(&cost));
            self.work += setup;
            if allowance.setup {
                self.spent += setup;
            }
            let solved = self.systems.solve(&*cells, &setting, &self.sample.goals)?;
            self.rare.measure(&*cells, &setting, Some(solved))?;
            solved.walk(&walks, &request, &watch)?
        };
        let without = |radius: f64| radius * (1.0 - setting.absorption);
        self.second_moment = self
            .second_moment
            .or(answer.neighbour_second_moment_radius.map(without));
        if self.watch.cancelled() {
            return Err(Error::Cancelled);
        }
        let all = answer.outcome.statistics.iter().chain(&answer.others);
        let walked = Walked {
            statistics: all.collect(),
            weights: &self.sample.weights,
            pointwise: answer.pointwise,
            unknowns: cells.unknowns() as f64,
        };
        let squares = squares(&mut self.squares, &setting, &walked);
        let doubt = self.doubt(setting.absorption);
        let pilot = Pilot::new(
            setting,
            &walked,
            self.tolerance,
            self.model,
            &squares,
            doubt,
        );
        self.pilots += 1;
        self.walks += pilot.walks;
        let seconds = PILOT_SECONDS + pilot.seconds(&cost);
        self.spent += seconds;
        self.work += seconds;
        Ok(pilot)
    }

    /// Says once that the choice takes long, before what would make it so: so many more seconds.
    fn warn_of(&mut self, seconds: f64) {
        if !self.warned && self.spent + seconds > LONG_SECONDS {
            self.warned = true;
            self.watch.choosing(seconds);
        }
    }
}

/// E η² of the first pilot with these walks. It does not depend on cells.
fn squares(known: &mut Vec<Squares>, setting: &Setting, walked: &Walked<'_>) -> Vec<f64> {
    let walks = (setting.absorption, setting.estimator);
    if let Some((_, squares)) = known.iter().find(|(of, _)| *of == walks) {
        return squares.clone();
    }
    let squares = pilot::squares(walked.statistics.iter().copied());
    if squares.iter().all(|&square| square > 0.0) {
        known.push((walks, squares.clone()));
    }
    squares
}

/// A watch that observes nothing of pilots, and may end them.
struct Quiet<'a>(&'a dyn SolveObserver);

impl Observer for Quiet<'_> {
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

impl SolveObserver for Quiet<'_> {}
