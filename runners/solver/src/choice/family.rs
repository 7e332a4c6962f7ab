//! A family: neighbour equations that differ by the number of their cells, with any walks; or plain walks.

use fredholm_core::{Estimator, MIN_BATCHES, next_stage};

use super::aim::Given;
use super::pilot::{Known, Observed, Pilot};
use super::setting::Setting;
use fredholm_model::cost::{Cost, PointwisePairs};

/// The part of the observed order that finer cells are trusted to have: their variance falls less regularly than that, above
/// all at singular kernels, which took five times as long without.
const TRUSTED: f64 = 0.75;
/// How many times less variance is hoped for where nothing is known, if no error is asked for.
const HOPE: f64 = 100.0;
/// The number of batches from which on whole stages are not counted.
const MANY_BATCHES: f64 = 1e6;

/// A number of cells, with the costs that depend on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Level {
    /// The number of cells as [`Settings`](crate::Settings) count them.
    pub(super) cells: usize,
    pub(super) unknowns: f64,
    pub(super) cost: Cost,
}

/// What a setting will take. All seconds are those of one thread.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prediction {
    pub(super) setting: Setting,
    /// Seconds of the set-up.
    pub(super) setup: f64,
    /// Seconds of the set-up that are left once the system is solved.
    pub(super) source: f64,
    /// Seconds of what the first walks of its family make of the system, which keeps it.
    pub(super) kept: f64,
    /// Seconds of one walk.
    pub(super) seconds_per_walk: f64,
    /// Seconds of all walks by the observed variance, and of moments.
    pub(super) walking: f64,
    /// Seconds of all walks if large scores were missed and cells help less than observed.
    pub(super) careful: f64,
    /// Seconds of all walks if there were too many large scores and cells help as much as theory allows.
    pub(super) hopeful: f64,
    /// Seconds of all walks if cells help as much as they did from the last pilot but one of its family to the last, or from the first; infinite if there
    /// are no two.
    pub(super) shown: f64,
    /// The number of walks of one target that a pilot of this very setting had; 0 without such a pilot.
    pub(super) pilot_walks: u64,
    /// The least number of scored walks of a target, in any pilot.
    pub(super) scored: u64,
    /// The number of walks of the target that takes most by the observed variance.
    pub(super) most_walks: f64,
    /// The number of targets.
    pub(super) targets: f64,
    /// The number of all walks.
    pub(super) walks: f64,
    /// Var/E² of all targets: the number of walks if they were not made in whole stages.
    pub(super) needed: f64,
    /// The number of states that all walks visit.
    pub(super) states: f64,
}

impl Prediction {
    /// Whether a pilot of its family tells of it.
    pub(super) const fn is_known(&self) -> bool {
        self.walking.is_finite()
    }

    /// Seconds of the set-up and of all walks.
    pub(super) fn seconds(&self) -> f64 {
        self.setup + self.walking
    }
}

/// What is known of the walks of a family before any.
#[derive(Clone, Copy, Debug)]
pub(super) struct FamilyWalks {
    /// Walks of a batch.
    pub(super) batch: u64,
    /// The number of walks of a target, unless they are made in stages until an error is reached.
    pub(super) given: Option<u64>,
    /// The estimator.
    pub(super) estimator: Estimator,
    /// The number of states of a walk, about.
    pub(super) states: f64,
}

/// Neighbour equations that differ by the number of their cells; or plain walks.
#[derive(Debug)]
pub(super) struct Family {
    pub(super) first: Setting,
    /// Levels from few cells to many.
    pub(super) levels: Vec<Level>,
    /// The number of levels that were asked for.
    pub(super) asked: usize,
    /// The order r of √Var ~ unknowns^−r in theory.
    order: f64,
    pub(super) pilots: Vec<Pilot>,
    walks: FamilyWalks,
    /// The predictions of the pilots.
    pub(super) found: Vec<Prediction>,
}

impl Family {
    /// A family of which nothing is known but its levels and its order in theory.
    pub(super) const fn new(
        first: Setting,
        levels: Vec<Level>,
        order: f64,
        walks: FamilyWalks,
    ) -> Self {
        Self {
            first,
            levels,
            asked: 1,
            order,
            pilots: Vec::new(),
            walks,
            found: Vec::new(),
        }
    }

    /// Expects walks with so many states.
    pub(super) const fn expect(&mut self, states: f64) {
        self.walks.states = states;
    }

    /// Whether it is one of plain walks, or had no pilot.
    pub(super) fn is_plain_or_new(&self) -> bool {
        self.first.plain || self.pilots.is_empty()
    }

    /// The level with these cells.
    pub(super) fn level(&self, cells: usize) -> Option<&Level> {
        self.levels.iter().find(|level| level.cells == cells)
    }

    /// The pilot by which a setting is predicted: on the finest cells that are no finer.
    pub(super) fn pilot_for(&self, setting: &Setting) -> Option<&Pilot> {
        let coarser = |pilot: &&Pilot| pilot.setting.cells <= setting.cells;
        let pilots = self.pilots.iter().filter(coarser);
        pilots.max_by_key(|pilot| pilot.setting.cells)
    }

    /// Whether there were walks on these cells.
    pub(super) fn has_walked(&self, cells: usize) -> bool {
        self.pilots.iter().any(|pilot| pilot.setting.cells == cells)
    }

    /// Adds a pilot in place of one of the same setting.
    pub(super) fn add(&mut self, pilot: Pilot) {
        self.pilots.retain(|of| of.setting != pilot.setting);
        self.pilots.push(pilot);
    }

    /// Predicts all levels anew, by what is known of u now.
    pub(super) fn correct(&mut self, known: &Known) {
        self.pilots
            .iter_mut()
            .for_each(|pilot| pilot.correct(known));
        self.update();
    }

    /// Predicts all levels anew, for these errors.
    pub(super) fn ask(&mut self, given: &Given) {
        self.pilots.iter_mut().for_each(|pilot| pilot.ask(given));
        self.update();
    }

    /// Keeps levels that were asked for. Fewer may pay now, but those that are known stay.
    pub(super) fn extend(&mut self, levels: Vec<Level>, asked: usize) {
        self.asked = asked;
        if levels.len() > self.levels.len() {
            self.levels = levels;
            self.update();
        }
    }

    /// Predicts all levels by all pilots.
    fn update(&mut self) {
        let mut found = Vec::new();
        for level in &self.levels {
            let pilot = self.pilot_for(&self.first.on(level.cells));
            found.extend(pilot.map(|pilot| self.predict(pilot, level)));
        }
        self.found = found;
    }

    /// What is known of these cells before there is a pilot: their cost, and that of the least number of walks.
    pub(super) fn unknown(&self, level: &Level, weights: &[f64]) -> Prediction {
        let setting = self.first.on(level.cells);
        let walk = setting.walk(&level.cost);
        let none = PointwisePairs::default();
        let each = walk.seconds(self.walks.estimator, self.walks.states, none);
        let least = match self.walks.given {
            None => (self.walks.batch * MIN_BATCHES) as f64,
            Some(walks) => walks as f64 / HOPE,
        };
        let least = least * weights.iter().sum::<f64>();
        let [setup, source, kept] = setting.setup(&level.cost);
        Prediction {
            setting,
            setup,
            source,
            kept,
            seconds_per_walk: each,
            walking: f64::INFINITY,
            careful: f64::INFINITY,
            hopeful: least * each,
            shown: f64::INFINITY,
            pilot_walks: 0,
            scored: 0,
            most_walks: f64::INFINITY,
            targets: weights.iter().sum(),
            walks: f64::INFINITY,
            needed: f64::INFINITY,
            states: f64::INFINITY,
        }
    }

    /// The order r of √Var ~ unknowns^−r that is expected: by the last two pilots, if there are as many, but at most that of the theory, and
    /// at least half of it, as on few cells much depends on where targets lie in them.
    pub(super) fn observed_order(&self) -> f64 {
        let least = 0.5 * self.order;
        let last = self.shown_orders().map(|[last, _]| last);
        last.map_or(self.order, |last| last.clamp(least, self.order))
    }

    /// The order r by the last two pilots with the same walks, on different cells; and by the first and the last of them.
    fn shown_orders(&self) -> Option<[f64; 2]> {
        let by_unknowns = |a: &&Pilot, b: &&Pilot| a.unknowns.total_cmp(&b.unknowns);
        let fine = self.pilots.iter().max_by(by_unknowns)?;
        let all = self.pilots.iter();
        let coarser = || all.clone().filter(|of| of.unknowns < fine.unknowns);
        let order = |coarse: &Pilot| {
            let falls = coarse.needed_of_all() / fine.needed_of_all();
            0.5 * falls.ln() / (fine.unknowns / coarse.unknowns).ln()
        };
        let [before, first] = [
            coarser().max_by(by_unknowns)?,
            coarser().min_by(by_unknowns)?,
        ];
        let [last, all] = [before, first].map(order);
        let all = Some(all).filter(|all| all.is_finite());
        last.is_finite().then(|| [last, all.unwrap_or(last)])
    }

    /// What the setting of a pilot takes on these cells.
    pub(super) fn predict(&self, pilot: &Pilot, level: &Level) -> Prediction {
        let setting = pilot.setting.on(level.cells);
        let batch = self.walks.batch as f64;
        let in_stages = |walks: f64| match self.walks.given {
            None => batch * batches_of_whole_stages(walks / batch),
            Some(_) => walks,
        };
        let all = |walks: &dyn Fn(&Observed) -> f64| -> f64 {
            let of = |target: &Observed| target.weight * in_stages(walks(target));
            pilot.observed().map(of).sum()
        };
        let more = level.unknowns / pilot.unknowns;
        let order = self.observed_order();
        let scale = |order: f64| more.powf(-2.0 * order);
        let [observed, slow, fast] = [order, TRUSTED * order, self.order].map(scale);
        let shown = self.shown_orders().map_or(f64::INFINITY, |[last, all]| {
            scale(last.max(all).min(self.order))
        });
        let walk = setting.walk(&level.cost);
        let pairs = pilot.pairs(level.unknowns);
        let each = walk.seconds(self.walks.estimator, pilot.states, pairs);
        let walks = all(&|target| target.walks(observed));
        let most = pilot.observed().map(|target| target.walks(observed));
        let [setup, source, kept] = setting.setup(&level.cost);
        Prediction {
            setting,
            setup,
            source,
            kept,
            seconds_per_walk: each,
            walking: walks * each,
            careful: all(&|target| target.careful_walks(slow)) * each,
            hopeful: all(&|target| target.hopeful_walks(fast)) * each,
            shown: all(&|target| target.walks(shown)) * each,
            pilot_walks: if setting == pilot.setting {
                pilot.walks_each
            } else {
                0
            },
            scored: pilot.scored,
            most_walks: in_stages(most.fold(0.0, f64::max)),
            targets: pilot.observed().map(|target| target.weight).sum(),
            walks,
            needed: observed * pilot.needed_of_all(),
            states: walks * pilot.states,
        }
    }
}

/// The number of batches in the stages that a run takes which needs this many: errors are looked at after whole stages.
pub(super) fn batches_of_whole_stages(needed: f64) -> f64 {
    if needed > MANY_BATCHES {
        return needed;
    }
    let mut done = 0;
    loop {
        done += next_stage(done, u64::MAX);
        if done as f64 >= needed {
            return done as f64;
        }
    }
}
