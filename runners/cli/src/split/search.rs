//! From cheap pilots to what they promise.

use fredholm_core::ENOUGH_BATCHES;
use fredholm_rayon::TargetError;

use super::family::Family;
use super::pilot::{Level, Pilot, Prediction, Sample, Setting};
use crate::failure::Failure;
use crate::file::{self, Estimator, Pairs, Place, Placed, ProblemFile};
use crate::output::abandon;
use crate::problem::{self, Cost};
use crate::progress::{Progress, interrupted};
use crate::solve;

/// Seconds of a pilot besides its walks and its set-up.
const PILOT: f64 = 0.1e-3;
/// Walks of a pilot, and what it may take.
#[derive(Clone, Copy, Debug)]
struct Allowance {
    /// Of each of its targets.
    walks: u64,
    /// The share of the best prediction so far that it may take.
    one: f64,
    /// The same of all pilots until then, and it.
    all: f64,
}

/// Of pilots that look around, of those that look at finer cells of the best, and of those that confirm it.
const LOOK: Allowance = Allowance {
    walks: 512,
    one: 0.05,
    all: 0.2,
};
const CLIMB: Allowance = Allowance {
    walks: 512,
    one: 0.15,
    all: 0.35,
};
const CONFIRM: Allowance = Allowance {
    walks: 2048,
    one: 0.15,
    all: 0.35,
};
/// The spectral radius of T_k²p from which on a variance is close to infinite: few walks do not show it.
const FAR: f64 = 0.85;
/// How many times slower plain walks may be for a second look at them.
const HOPELESS: f64 = 10.0;
/// The part of the best price that is hoped for where there is a second look at others.
const HOPE: f64 = 0.7;
/// The part of 1/q0 that walks are at least long.
const SHORTER: f64 = 0.9;
/// Levels to begin with, and how many more there are where the finest is the best.
const LEVELS: usize = 5;
/// Bytes that a set-up may take which nobody asked for, and unknowns.
const MEMORY: usize = 1 << 30;
const UNKNOWNS: usize = 1 << 17;
/// Walks of pilots are others than those of the answer, which they must not be able to prefer.
const SEED: u64 = 0x0070_696c_6f74;
/// q0 to choose from: large where the Galerkin solution is so good that only the time of a walk matters,
/// small where long walks tell more. The cheapest pilots come first.
const ABSORPTIONS: [f64; 5] = [0.7, 0.5, 0.35, 0.2, 0.1];

/// Pilots so far, and what they promise.
#[derive(Debug)]
pub(super) struct Search<'f> {
    file: &'f ProblemFile,
    error: TargetError,
    /// The values of q0 that are tried, and that from which to start.
    absorptions: Vec<f64>,
    shortest: Option<f64>,
    sample: Sample,
    families: Vec<Family>,
    found: Vec<Prediction>,
    /// The first that a setting met: what there is to say where none is taken.
    refusal: Option<Failure>,
    /// Predicted seconds of the pilots so far.
    spent: f64,
    pub(super) pilots: usize,
    pub(super) walks: u64,
}

/// The values to choose from: the file's own, if it has one.
fn open<T: Clone>(given: &Placed<T>, all: &[T]) -> Vec<T> {
    match given.place {
        Place::Default => all.to_vec(),
        _ => vec![given.value.clone()],
    }
}

impl<'f> Search<'f> {
    /// With an absorption of at most this, where the file leaves it open.
    pub(super) fn new(file: &'f ProblemFile, error: TargetError, most: f64) -> Self {
        let mut absorptions = open(&file.walk.absorption, &ABSORPTIONS);
        absorptions.retain(|&absorption| absorption <= most);
        Self {
            file,
            error,
            shortest: absorptions.first().copied(),
            absorptions,
            sample: Sample::new(file),
            families: Vec::new(),
            found: Vec::new(),
            refusal: None,
            spent: 0.0,
            pilots: 0,
            walks: 0,
        }
    }

    /// Everything.
    pub(super) fn run(&mut self) {
        self.drop_infinite_variances();
        self.plain();
        self.families();
        self.climb();
        self.hope();
        self.climb();
        self.confirm();
        self.vary();
        self.climb();
        self.vary_plain();
        self.confirm();
    }

    /// The largest absorption below those that were looked at first, if there is one.
    pub(super) fn lower(&self) -> Option<f64> {
        self.absorptions.get(1).copied()
    }

    /// Whether what [`drop_infinite_variances`](Self::drop_infinite_variances) does would take longer than
    /// pilots in vain: it integrates a formula.
    pub(super) const fn checks_late(&self) -> bool {
        matches!(self.file.problem, file::Problem::Cube(_))
    }

    /// All predictions, the best first, and the first refusal.
    pub(super) fn take_found(&mut self) -> (Vec<Prediction>, Option<Failure>) {
        let mut found = core::mem::take(&mut self.found);
        found.sort_by(|a, b| a.price().total_cmp(&b.price()));
        (found, self.refusal.take())
    }

    fn estimators(&self) -> Vec<Estimator> {
        let all = [Estimator::Absorption, Estimator::Collision];
        open(&self.file.walk.estimator, &all)
    }

    /// All q0 and estimators that are open.
    fn kinds_of_walks(&self) -> Vec<(f64, Estimator)> {
        let of = |estimator: Estimator| {
            let absorptions = self.absorptions.iter();
            absorptions.map(move |&absorption| (absorption, estimator))
        };
        self.estimators().into_iter().flat_map(of).collect()
    }

    /// The setting from which others start: with the shortest walks.
    fn base(&self) -> Setting {
        let (galerkin, walk) = (&self.file.galerkin, &self.file.walk);
        Setting {
            plain: false,
            cells: 1,
            degree: galerkin.degree.value,
            pairs: galerkin.pairs.value,
            absorption: self.shortest.unwrap_or(walk.absorption.value),
            estimator: walk.estimator.value,
        }
    }

    /// The same without a neighbour equation.
    fn plain_base(&self) -> Setting {
        Setting {
            plain: true,
            degree: 0,
            pairs: Pairs::Default,
            ..self.base()
        }
    }

    /// Forgets values of q0 for which plain walks have no finite variance, as long as one is left, and starts from
    /// one for which it is far from infinite.
    fn drop_infinite_variances(&mut self) {
        if self.file.walk.allow_infinite_variance || self.checks_late() {
            return;
        }
        let base = self.plain_base();
        let mut file = base.applied(&self.sample.file);
        file.galerkin.cells = None;
        // What is wrong is said by whoever looks at it.
        let problem = problem::of_file(&file);
        let Ok(radius) = problem.and_then(|problem| problem.second_moment()) else {
            return;
        };
        // k² p is K²/p, and p has the factor 1 − q0.
        let radius = |absorption: f64| radius * (1.0 - base.absorption) / (1.0 - absorption);
        let least = self.absorptions.last().copied();
        self.absorptions
            .retain(|&absorption| radius(absorption) < 1.0 || Some(absorption) == least);
        let mut far = self.absorptions.iter().copied();
        self.shortest = far.find(|&absorption| radius(absorption) < FAR).or(least);
    }

    const fn batch(&self) -> u64 {
        self.file.walk.batch.value
    }

    /// The best prediction so far.
    fn best(&self) -> Option<Prediction> {
        self.best_of(|_| true)
    }

    /// The best of those.
    fn best_of(&self, of: impl Fn(&Prediction) -> bool) -> Option<Prediction> {
        let found = self.found.iter().filter(|found| of(found));
        found
            .min_by(|a, b| a.price().total_cmp(&b.price()))
            .copied()
    }

    /// Takes the family of a setting out of its list.
    fn take_family(&mut self, setting: &Setting) -> Option<Family> {
        let at = self.families.iter().position(|f| f.has(setting))?;
        Some(self.families.swap_remove(at))
    }

    /// Its seconds.
    fn least(&self) -> f64 {
        self.best().map_or(f64::INFINITY, |best| best.seconds())
    }

    /// Whether a pilot of so many walks is worth its time, where a row has so many pointwise pairs: whether it is
    /// cheap, and whether one round of its setting would be faster than the best.
    fn affords(&self, setting: &Setting, cost: &Cost, pairs: f64, allowance: Allowance) -> bool {
        let Some(best) = self.best() else {
            return true;
        };
        let (setup, walk) = setting.costs(cost);
        let walk = walk.seconds(setting.estimator, 1.0 / setting.absorption, pairs);
        let round = (self.batch() * ENOUGH_BATCHES) as f64 * self.sample.weight() * walk;
        let seconds =
            PILOT + setup + (allowance.walks * self.sample.targets() as u64) as f64 * walk;
        setup + SHORTER * round <= best.price()
            && seconds <= allowance.one * best.seconds()
            && self.spent + seconds <= allowance.all * best.seconds()
    }

    /// Walks; `None` where the problem does not take the setting.
    fn pilot(&mut self, setting: Setting, walks: u64) -> Option<Pilot> {
        if interrupted() {
            abandon(130);
        }
        let pilot = self.try_pilot(setting, walks);
        pilot.map_err(|refusal| self.refuse(refusal)).ok()
    }

    fn refuse(&mut self, refusal: Failure) {
        self.refusal.get_or_insert(refusal);
    }

    fn try_pilot(&mut self, setting: Setting, walks: u64) -> Result<Pilot, Failure> {
        let file = setting.applied(&self.sample.file);
        file.validate()?;
        let problem = problem::of_file(&file)?;
        let mut plan = solve::plan(&file, None);
        plan.walks = walks;
        plan.target_error = None;
        plan.seed ^= SEED;
        let progress = Progress::hidden();
        let answer = if setting.plain {
            problem.plain(&plan, &progress)?
        } else {
            problem.answer(&plan, &progress)?
        };
        let pilot = Pilot::new(
            setting,
            &self.sample,
            self.error,
            problem.unknowns(),
            &answer,
        );
        self.pilots += 1;
        self.walks += pilot.walks;
        self.spent += PILOT + pilot.seconds(&problem.cost());
        Ok(pilot)
    }

    /// The level on which plain walks are looked at: cells are those of no neighbour equation.
    fn plain_level(&mut self) -> Option<Level> {
        let base = self.plain_base();
        self.levels(&base, 1).0.first().copied()
    }

    /// Plain walks: the shortest, and those of every default.
    fn plain(&mut self) {
        let (base, absorption) = (self.plain_base(), self.file.walk.absorption.value);
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
                self.pilot_plain(setting, &level, LOOK);
            }
        }
    }

    /// All other plain walks, unless they are hopeless.
    fn vary_plain(&mut self) {
        let plain: Vec<Prediction> = self
            .found
            .iter()
            .filter(|f| f.setting.plain)
            .copied()
            .collect();
        let fastest = plain.iter().map(Prediction::seconds).min_by(f64::total_cmp);
        if fastest.is_none_or(|fastest| fastest > HOPELESS * self.least()) {
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
                self.pilot_plain(setting, &level, LOOK);
            }
        }
    }

    /// Whether there is a pilot more.
    fn pilot_plain(&mut self, setting: Setting, level: &Level, allowance: Allowance) -> bool {
        let setting = Setting {
            cells: level.cells,
            ..setting
        };
        if !self.affords(&setting, &level.cost, 0.0, allowance) {
            return false;
        }
        let Some(pilot) = self.pilot(setting, allowance.walks) else {
            return false;
        };
        self.found.retain(|found| found.setting != setting);
        self.found.push(pilot.predict(level, 1.0, self.batch()));
        true
    }

    /// Cells from few to many, so many levels and as far as they may pay, and the order of √Var in unknowns;
    /// none where the problem does not take the setting.
    fn levels(&mut self, setting: &Setting, most: usize) -> (Vec<Level>, f64) {
        let levels = self.try_levels(setting, most);
        let levels = levels.map_err(|refusal| self.refuse(refusal));
        levels.unwrap_or_default()
    }

    fn try_levels(&self, setting: &Setting, most: usize) -> Result<(Vec<Level>, f64), Failure> {
        let mut open = setting.applied(&self.sample.file);
        open.galerkin.cells = None;
        open.validate()?;
        let problem = problem::of_file(&open)?;
        let finer = |&cells: &usize| match problem.dimension() {
            Some(2..) => cells + cells.div_ceil(3),
            _ => 2 * cells,
        };
        let mut known = problem.coarse();
        known.extend(problem.levels());
        let beyond = core::iter::successors(known.last().map(finer), |cells| Some(finer(cells)));
        let mut levels: Vec<Level> = Vec::new();
        for cells in known.iter().copied().chain(beyond).take(most) {
            let level = problem.mean_on(cells)?;
            let (cost, unknowns) = (level.cost(), level.unknowns());
            let large = level.memory() > MEMORY || unknowns > UNKNOWNS;
            if large || (levels.len() > 1 && cost.setup > self.least()) {
                break;
            }
            levels.push(Level {
                cells,
                unknowns: unknowns as f64,
                cost,
            });
        }
        Ok((levels, problem.order(setting.degree)))
    }

    /// A pilot on the fewest cells of every degree and every choice of pairs that may pay.
    fn families(&mut self) {
        let degrees: Vec<usize> = (0..=self.file.most_degree().0).collect();
        let all = [Pairs::Default, Pairs::Pointwise];
        for degree in open(&self.file.galerkin.degree, &degrees) {
            for pairs in open(&self.file.galerkin.pairs, &all) {
                let first = Setting {
                    degree,
                    pairs,
                    ..self.base()
                };
                let (coarsest, order) = self.levels(&first, 1);
                let mut family = Family::new(first, coarsest, order);
                if self.explore(&mut family, 0, LOOK) {
                    self.extend(&mut family);
                    self.families.push(family);
                }
            }
        }
    }

    /// More levels, if there are any; whether there were.
    fn extend(&mut self, family: &mut Family) -> bool {
        let known = family.levels.len();
        family.levels = self.levels(&family.first, known + LEVELS).0;
        self.note(family);
        family.levels.len() > known
    }

    /// A pilot on the level of this number, if that is cheap; whether it was.
    fn explore(&mut self, family: &mut Family, number: usize, allowance: Allowance) -> bool {
        let Some(&level) = family.levels.get(number) else {
            return false;
        };
        let setting = Setting {
            cells: level.cells,
            ..family.first
        };
        let pairs = family.last().map_or(0.0, |last| last.pairs(level.unknowns));
        if !self.affords(&setting, &level.cost, pairs, allowance) {
            return false;
        }
        let Some(pilot) = self.pilot(setting, allowance.walks) else {
            return false;
        };
        family.add(number, pilot);
        self.note(family);
        true
    }

    /// What a family promises, in place of what it has promised.
    fn note(&mut self, family: &Family) {
        self.found.retain(|found| !family.has(&found.setting));
        self.found.extend(family.predictions(self.batch()));
    }

    /// Pilots on finer levels, as long as what is promised is finer than what was seen.
    fn climb(&mut self) {
        while let Some(best) = self.best() {
            let Some(mut family) = self.take_family(&best.setting) else {
                return;
            };
            let (cells, next) = (best.setting.cells, family.next_number());
            // Half-way, where that is cheap enough.
            let middle = next.midpoint(family.number(cells));
            let more = family.is_last(cells) && self.extend(&mut family)
                || family.is_beyond(cells)
                    && (self.explore(&mut family, middle, CLIMB)
                        || self.explore(&mut family, next, CLIMB));
            self.families.push(family);
            if !more {
                return;
            }
        }
    }

    /// A second pilot of every family that may well be faster than the best: where its first happened to show
    /// much variance, or other pairs were looked at on finer cells.
    fn hope(&mut self) {
        let mut families = core::mem::take(&mut self.families);
        for family in &mut families {
            let own = self.found.iter().filter(|found| family.has(&found.setting));
            let unseen = own.filter(|found| found.of == 0).copied();
            let hoped = unseen.min_by(|a, b| a.hoped().total_cmp(&b.hoped()));
            let bound = HOPE * self.best().map_or(0.0, |best| best.price());
            if let Some(found) = hoped.filter(|found| found.hoped() < bound) {
                let number = family.number(found.setting.cells);
                self.explore(family, number, CLIMB);
            }
        }
        self.families = families;
    }

    /// Other absorptions and the other estimator, for the best neighbour equation that was found.
    fn vary(&mut self) {
        let Some(best) = self.best_of(|found| !found.setting.plain) else {
            return;
        };
        let family = self.families.iter().find(|f| f.has(&best.setting));
        let Some(family) = family.cloned() else {
            return;
        };
        let (Some(level), Some(last)) = (family.seen(), family.last()) else {
            return;
        };
        for (absorption, estimator) in self.kinds_of_walks() {
            let setting = Setting {
                absorption,
                estimator,
                ..last.setting
            };
            if setting == last.setting || !self.affords(&setting, &level.cost, last.pointwise, LOOK)
            {
                continue;
            }
            if let Some(pilot) = self.pilot(setting, LOOK.walks) {
                let varied = family.varied(pilot);
                self.note(&varied);
                self.families.push(varied);
            }
        }
    }

    /// More walks of what would be chosen, until it is what they choose, too.
    fn confirm(&mut self) {
        while let Some(best) = self.best() {
            if best.of >= CONFIRM.walks {
                return;
            }
            if best.setting.plain {
                let level = self.plain_level();
                if level.is_some_and(|level| self.pilot_plain(best.setting, &level, CONFIRM)) {
                    continue;
                }
                return;
            }
            let Some(mut family) = self.take_family(&best.setting) else {
                return;
            };
            let number = family.number(best.setting.cells);
            let more = self.explore(&mut family, number, CONFIRM);
            self.families.push(family);
            if !more {
                return;
            }
        }
    }
}
