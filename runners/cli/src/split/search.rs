//! From cheap pilots to what they promise.

use fredholm_rayon::TargetError;

use super::family::Family;
use super::pilot::{Level, Pilot, Prediction, Sample, Setting};
use crate::failure::Failure;
use crate::file::{Estimator, Pairs, Place, Placed, ProblemFile};
use crate::output::abandon;
use crate::problem::{self, Cost};
use crate::progress::{Progress, interrupted};
use crate::solve;

/// Walks of a pilot for each of its targets.
const WALKS: u64 = 512;
/// Seconds of a pilot besides its walks and its set-up.
const PILOT: f64 = 0.1e-3;
/// The shares of the best prediction so far that one pilot may take, and all.
const ONE: f64 = 0.05;
const ALL: f64 = 0.2;
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
    /// The values of q0 that are tried.
    absorptions: Vec<f64>,
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
        self.plain();
        self.families();
        self.climb();
        self.vary();
        self.climb();
    }

    /// The largest absorption below those that were looked at first, if there is one.
    pub(super) fn lower(&self) -> Option<f64> {
        self.absorptions.get(1).copied()
    }

    /// All predictions, the best first, and the first refusal.
    pub(super) fn take_found(&mut self) -> (Vec<Prediction>, Option<Failure>) {
        let mut found = core::mem::take(&mut self.found);
        found.sort_by(|a, b| a.seconds().total_cmp(&b.seconds()));
        (found, self.refusal.take())
    }

    fn estimators(&self) -> Vec<Estimator> {
        let all = [Estimator::Absorption, Estimator::Collision];
        open(&self.file.walk.estimator, &all)
    }

    /// All q0 and estimators that are open.
    fn kinds_of_walks(&self) -> Vec<(f64, Estimator)> {
        let estimators = self.estimators();
        let of = |&absorption: &f64| {
            let estimators = estimators.iter();
            estimators.map(move |&estimator| (absorption, estimator))
        };
        self.absorptions.iter().flat_map(of).collect()
    }

    /// The setting from which others start: with the shortest walks.
    fn base(&self) -> Setting {
        let (galerkin, walk) = (&self.file.galerkin, &self.file.walk);
        Setting {
            plain: false,
            cells: 1,
            degree: galerkin.degree.value,
            pairs: galerkin.pairs.value,
            absorption: self
                .absorptions
                .first()
                .copied()
                .unwrap_or(walk.absorption.value),
            estimator: walk.estimator.value,
        }
    }

    const fn batch(&self) -> u64 {
        self.file.walk.batch.value
    }

    /// The best prediction so far.
    fn best(&self) -> Option<Prediction> {
        let order = |a: &&Prediction, b: &&Prediction| a.seconds().total_cmp(&b.seconds());
        self.found.iter().min_by(order).copied()
    }

    /// Its seconds.
    fn least(&self) -> f64 {
        self.best().map_or(f64::INFINITY, |best| best.seconds())
    }

    /// Whether a pilot is worth its time, where a row has so many pointwise pairs.
    fn affords(&self, setting: &Setting, cost: &Cost, pairs: f64) -> bool {
        let walks = (WALKS * self.sample.targets() as u64) as f64;
        let states = 1.0 / setting.absorption;
        let (setup, walk) = if setting.plain {
            (0.0, cost.plain)
        } else {
            (cost.setup, cost.walk)
        };
        let seconds = PILOT + setup + walks * walk.seconds(setting.estimator, states, pairs);
        let least = self.least();
        seconds <= ONE * least && self.spent + seconds <= ALL * least
    }

    /// Walks; `None` where the problem does not take the setting.
    fn pilot(&mut self, setting: Setting) -> Option<Pilot> {
        if interrupted() {
            abandon(130);
        }
        let pilot = self.try_pilot(setting);
        pilot.map_err(|refusal| self.refuse(refusal)).ok()
    }

    fn refuse(&mut self, refusal: Failure) {
        self.refusal.get_or_insert(refusal);
    }

    fn try_pilot(&mut self, setting: Setting) -> Result<Pilot, Failure> {
        let file = setting.applied(&self.sample.file);
        file.validate()?;
        let problem = problem::of_file(&file)?;
        let mut plan = solve::plan(&file, None);
        plan.walks = WALKS;
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

    /// Plain walks.
    fn plain(&mut self) {
        let base = Setting {
            plain: true,
            degree: 0,
            pairs: Pairs::Default,
            ..self.base()
        };
        let Some(level) = self.levels(&base).0.first().copied() else {
            return;
        };
        for (absorption, estimator) in self.kinds_of_walks() {
            let setting = Setting {
                absorption,
                estimator,
                cells: level.cells,
                ..base
            };
            if !self.affords(&setting, &level.cost, 0.0) {
                continue;
            }
            if let Some(pilot) = self.pilot(setting) {
                self.found.push(pilot.predict(&level, 1.0, self.batch()));
            }
        }
    }

    /// Cells from few to many, as far as they may pay, and the order of √Var in unknowns; none where the
    /// problem does not take the setting.
    fn levels(&mut self, setting: &Setting) -> (Vec<Level>, f64) {
        let levels = self.try_levels(setting);
        let levels = levels.map_err(|refusal| self.refuse(refusal));
        levels.unwrap_or_default()
    }

    fn try_levels(&self, setting: &Setting) -> Result<(Vec<Level>, f64), Failure> {
        let mut open = setting.applied(&self.sample.file);
        open.galerkin.cells = None;
        open.validate()?;
        let problem = problem::of_file(&open)?;
        let finer = |&cells: &usize| match problem.dimension() {
            Some(2..) => cells + cells.div_ceil(2),
            _ => 2 * cells,
        };
        let mut known = problem.coarse();
        known.extend(problem.levels());
        let beyond = core::iter::successors(known.last().map(finer), |cells| Some(finer(cells)));
        let mut levels: Vec<Level> = Vec::new();
        for cells in known.iter().copied().chain(beyond) {
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

    /// Two pilots of every degree and every choice of pairs, as far as they are cheap.
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
                let (levels, order) = self.levels(&first);
                let mut family = Family::new(first, levels, order);
                let _ = self.explore(&mut family) && self.explore(&mut family);
                self.families.push(family);
            }
        }
    }

    /// One more pilot, on the next level, if that is cheap; whether it was.
    fn explore(&mut self, family: &mut Family) -> bool {
        let Some(level) = family.next() else {
            return false;
        };
        let setting = Setting {
            cells: level.cells,
            ..family.first
        };
        // How many pairs are pointwise is known from the second pilot on.
        let pairs = family
            .last()
            .map_or(0.0, |last| last.pointwise * level.unknowns / last.unknowns);
        if !self.affords(&setting, &level.cost, pairs) {
            return false;
        }
        let Some(pilot) = self.pilot(setting) else {
            return false;
        };
        family.add(pilot);
        self.note(family);
        true
    }

    /// What a family promises, in place of what it has promised.
    fn note(&mut self, family: &Family) {
        self.found.retain(|found| !family.has(&found.setting));
        self.found.extend(family.predictions(self.batch()));
    }

    /// Pilots on finer levels, as long as what is promised is much finer than what was seen.
    fn climb(&mut self) {
        while let Some(best) = self.best() {
            let Some(at) = self.families.iter().position(|f| f.has(&best.setting)) else {
                return;
            };
            let mut family = self.families.swap_remove(at);
            let more = family.is_beyond(best.setting.cells) && self.explore(&mut family);
            self.families.push(family);
            if !more {
                return;
            }
        }
    }

    /// Other absorptions and the other estimator, for the best neighbour equation that was found.
    fn vary(&mut self) {
        let preconditioned = self.found.iter().filter(|found| !found.setting.plain);
        let Some(best) = preconditioned.min_by(|a, b| a.seconds().total_cmp(&b.seconds())) else {
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
            if setting == last.setting || !self.affords(&setting, &level.cost, last.pointwise) {
                continue;
            }
            if let Some(pilot) = self.pilot(setting) {
                let varied = family.varied(pilot);
                self.note(&varied);
                self.families.push(varied);
            }
        }
    }
}
