//! The best split of work between the set-up and the walks, where a file gives the error alone.
//!
//! A finer Galerkin solution takes longer and leaves less to the walks. With `target_error` and without
//! `cells`, that of all settings which the file leaves open is taken which minimises
//!
//! ```text
//! set-up(n) + Σ Var(n)/E² · seconds of a walk
//! ```
//!
//! over the targets. Variances and the length of walks come of pilots: some hundred walks each, on few
//! cells; the variance on more of them follows its observed order. Seconds come of constants ([`Cost`])
//! and of what was counted, and never of a clock: the same file has the same bits on every machine.

use std::time::Instant;

use fredholm_core::{Statistics, next_round};
use fredholm_rayon::{Plan, TargetError};
use serde::Serialize;

use crate::failure::Failure;
use crate::file::{self, Estimator, Pairs, Place, Placed, ProblemFile, What, word};
use crate::numbers::short;
use crate::problem::{self, Answer, Cost, Problem};
use crate::progress::Progress;
use crate::solve;

/// Walks of a pilot for each of its targets, and targets that it looks at.
const WALKS: u64 = 512;
const TARGETS: usize = 8;
/// The shares of the best prediction so far that one pilot may take, and all.
const ONE: f64 = 0.03;
const ALL: f64 = 0.2;
/// Bytes that a set-up may take which nobody asked for, and unknowns.
const MEMORY: usize = 1 << 30;
const UNKNOWNS: usize = 1 << 17;
/// Batches of which rounds need not be counted.
const MANY: f64 = 1e6;
/// Walks of pilots are others than those of the answer, which they must not be able to prefer.
const SEED: u64 = 0x7069_6c6f_74;
/// q0 to choose from. The smallest serves kernels near which walks are long; the largest, solutions so
/// good that what matters is how short walks are.
const ABSORPTIONS: [f64; 5] = [0.1, 0.2, 0.35, 0.5, 0.7];

/// Everything that may be chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Setting {
    /// Walks without a neighbour equation.
    plain: bool,
    cells: usize,
    degree: usize,
    pairs: Pairs,
    absorption: f64,
    estimator: Estimator,
}

impl Setting {
    /// The file with it.
    fn applied(&self, file: &ProblemFile) -> ProblemFile {
        let mut file = file.clone();
        let (galerkin, walk) = (&mut file.galerkin, &mut file.walk);
        galerkin.cells = Some(Placed::chosen(self.cells));
        galerkin.degree = Placed::chosen(self.degree);
        galerkin.pairs = Placed::chosen(self.pairs);
        walk.absorption = Placed::chosen(self.absorption);
        walk.estimator = Placed::chosen(self.estimator);
        file
    }
}

/// A file in which nothing is open, and how it came about.
#[derive(Debug)]
pub(crate) struct Split {
    pub(crate) file: ProblemFile,
    pub(crate) plain: bool,
    pub(crate) report: SplitReport,
}

/// What `solve --json` says of the choice.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct SplitReport {
    /// "preconditioned" or "plain".
    pub(crate) method: &'static str,
    /// On one thread of the machine whose constants the program knows.
    pub(crate) predicted_setup_seconds: f64,
    pub(crate) predicted_walk_seconds: f64,
    /// Over all targets.
    pub(crate) predicted_walks: f64,
    pub(crate) predicted_states: f64,
    /// What plain walks alone would take.
    pub(crate) predicted_plain_seconds: f64,
    pub(crate) pilots: usize,
    pub(crate) pilot_walks: u64,
    pub(crate) pilot_seconds: f64,
}

impl SplitReport {
    /// In words, of these settings.
    pub(crate) fn text(&self, file: &ProblemFile, cells: &str) -> String {
        let (walk, galerkin) = (&file.walk, &file.galerkin);
        let walks = format!(
            "absorption {}, {} estimator",
            walk.absorption.value,
            word(&walk.estimator.value)
        );
        let all = self.predicted_setup_seconds + self.predicted_walk_seconds;
        let which = if self.method == "plain" {
            format!("plain walks with {walks}: a neighbour equation does not pay at this error")
        } else {
            format!(
                "cells {cells}, degree {}, {} pairs, {walks}; plain walks alone: about {} s",
                galerkin.degree.value,
                word(&galerkin.pairs.value),
                short(self.predicted_plain_seconds)
            )
        };
        format!(
            "chosen by {} pilots in {} s: {which}\npredicted: {:.1e} walks in about {} s on one thread, \
             {} s of them for the set-up\n",
            self.pilots,
            short(self.pilot_seconds),
            self.predicted_walks,
            short(all),
            short(self.predicted_setup_seconds),
        )
    }
}

/// Chooses what the file leaves open, if it gives an error and no cells.
pub(crate) fn choose(file: &ProblemFile) -> Result<Option<Split>, Failure> {
    let (None, Some(error)) = (&file.galerkin.cells, solve::plan(file, None).target_error) else {
        return Ok(None);
    };
    let mut search = Search::new(file, error);
    search.plain()?;
    search.families()?;
    search.climb()?;
    search.vary()?;
    search.finish().map(Some)
}

/// The values to choose from: the file's own, if it has one.
fn open<T: Clone>(given: &Placed<T>, all: &[T]) -> Vec<T> {
    match given.place {
        Place::Default => all.to_vec(),
        _ => vec![given.value.clone()],
    }
}

/// What a pilot found.
#[derive(Clone, Debug)]
struct Pilot {
    setting: Setting,
    /// The bound of the standard error and the variance of every target, each for so many targets.
    targets: Vec<(f64, f64, f64)>,
    /// Of a walk, in the mean.
    states: f64,
    pointwise: f64,
    unknowns: f64,
}

/// Settings that differ in cells alone, with what is known of them.
#[derive(Clone, Debug)]
struct Family {
    first: Setting,
    /// Cells as the file counts them, from few to many, with the cost of each.
    levels: Vec<Level>,
    /// By levels, from the first on.
    pilots: Vec<Pilot>,
    /// √Var ~ unknowns^−order, by theory.
    order: f64,
}

#[derive(Clone, Copy, Debug)]
struct Level {
    cells: usize,
    unknowns: f64,
    cost: Cost,
}

/// What a setting will take.
#[derive(Clone, Copy, Debug)]
struct Prediction {
    setting: Setting,
    setup: f64,
    walking: f64,
    walks: f64,
    states: f64,
}

impl Prediction {
    fn seconds(&self) -> f64 {
        self.setup + self.walking
    }
}

struct Search<'f> {
    file: &'f ProblemFile,
    error: TargetError,
    /// The file with few targets, and how many targets each of these stands for.
    sample: ProblemFile,
    weights: Vec<f64>,
    families: Vec<Family>,
    found: Vec<Prediction>,
    /// Predicted seconds of the pilots so far.
    spent: f64,
    pilots: usize,
    walks: u64,
    clock: Instant,
}

impl<'f> Search<'f> {
    fn new(file: &'f ProblemFile, error: TargetError) -> Self {
        let (sample, weights) = sampled(file);
        Self {
            file,
            error,
            sample,
            weights,
            families: Vec::new(),
            found: Vec::new(),
            spent: 0.0,
            pilots: 0,
            walks: 0,
            clock: Instant::now(),
        }
    }

    fn estimators(&self) -> Vec<Estimator> {
        let all = [Estimator::Absorption, Estimator::Collision];
        open(&self.file.walk.estimator, &all)
    }

    fn absorptions(&self) -> Vec<f64> {
        open(&self.file.walk.absorption, &ABSORPTIONS)
    }

    /// The settings from which others start.
    fn base(&self) -> Setting {
        Setting {
            plain: false,
            cells: 1,
            degree: self.file.galerkin.degree.value,
            pairs: self.file.galerkin.pairs.value,
            absorption: self.file.walk.absorption.value,
            estimator: self.file.walk.estimator.value,
        }
    }

    /// The best prediction so far, in seconds.
    fn best(&self) -> f64 {
        let seconds = self.found.iter().map(Prediction::seconds);
        seconds.fold(f64::INFINITY, f64::min)
    }

    /// Whether a pilot of so many predicted seconds is worth it.
    fn affords(&self, seconds: f64) -> bool {
        let best = self.best();
        seconds <= ONE * best && self.spent + seconds <= ALL * best
    }

    /// What a pilot will take.
    fn price(&self, setting: &Setting, cost: &Cost, pairs: f64) -> f64 {
        let walks = WALKS as f64 * self.weights.len() as f64;
        let states = 1.0 / setting.absorption;
        cost.setup + walks * cost.walk.seconds(setting.estimator, states, pairs)
    }

    /// Walks; `None` where the problem does not take the setting.
    fn pilot(&mut self, setting: Setting) -> Result<Option<Pilot>, Failure> {
        let file = setting.applied(&self.sample);
        if file.validate().is_err() {
            return Ok(None);
        }
        let Ok(problem) = problem::of_file(&file) else {
            return Ok(None);
        };
        let mut plan = solve::plan(&file, None);
        plan.walks = WALKS;
        plan.target_error = None;
        plan.seed ^= SEED;
        let Ok(answer) = walked(&*problem, setting.plain, &plan) else {
            return Ok(None);
        };
        self.pilots += 1;
        let pilot = self.read(setting, &*problem, &answer);
        self.spent += self.seconds_of(&pilot, &problem.cost(), WALKS as f64);
        Ok(Some(pilot))
    }

    fn read(&mut self, setting: Setting, problem: &dyn Problem, answer: &Answer) -> Pilot {
        let own = &answer.outcome.statistics;
        let all = || own.iter().chain(&answer.others);
        let walks: u64 = all().map(Statistics::walks).sum();
        let states: u64 = all().map(Statistics::states).sum();
        self.walks += walks;
        // What a room needs besides stands in no target, and is all there.
        let weights = self.weights.iter().copied().chain(core::iter::repeat(1.0));
        let targets = all().zip(weights).map(|(statistics, weight)| {
            let estimate = if setting.plain {
                statistics.plain()
            } else {
                statistics.preconditioned()
            };
            let bound = match self.error {
                TargetError::Absolute(bound) => bound,
                TargetError::Relative(bound) => bound * estimate.estimate.abs(),
            };
            let sd = estimate.std_dev.unwrap_or(0.0);
            (weight, bound, sd * sd)
        });
        Pilot {
            setting,
            targets: targets.collect(),
            states: states as f64 / walks as f64,
            pointwise: answer.pointwise,
            unknowns: problem.unknowns() as f64,
        }
    }

    /// Of set-up and so many walks for every target of the sample.
    fn seconds_of(&self, pilot: &Pilot, cost: &Cost, walks: f64) -> f64 {
        let setup = if pilot.setting.plain { 0.0 } else { cost.setup };
        setup + pilot.targets.len() as f64 * walks * walk_seconds(pilot, cost, 1.0)
    }

    /// What the setting of the pilot takes with so many times the variance, and so many times the pointwise pairs.
    fn predict(&self, pilot: &Pilot, level: &Level, scale: f64) -> Prediction {
        let batch = self.file.walk.batch.value as f64;
        let of = |&(weight, bound, variance): &(f64, f64, f64)| {
            weight * batch * batches(scale * variance / (bound * bound) / batch)
        };
        let walks: f64 = pilot.targets.iter().map(of).sum();
        let more = level.unknowns / pilot.unknowns;
        let setting = Setting {
            cells: level.cells,
            ..pilot.setting
        };
        let plain = setting.plain;
        Prediction {
            setting,
            setup: if plain { 0.0 } else { level.cost.setup },
            walking: walks * walk_seconds(pilot, &level.cost, more),
            walks,
            states: walks * pilot.states,
        }
    }

    /// Plain walks.
    fn plain(&mut self) -> Result<(), Failure> {
        let base = Setting {
            plain: true,
            cells: 1,
            degree: 0,
            pairs: Pairs::Default,
            ..self.base()
        };
        let Some(level) = self.levels(&base)?.0.first().copied() else {
            return Ok(());
        };
        for absorption in self.absorptions() {
            for estimator in self.estimators() {
                let setting = Setting {
                    absorption,
                    estimator,
                    cells: level.cells,
                    ..base
                };
                if let Some(pilot) = self.pilot(setting)? {
                    let prediction = self.predict(&pilot, &level, 1.0);
                    self.found.push(prediction);
                }
            }
        }
        Ok(())
    }

    /// Cells from few to many, as far as they may pay, and the order of √Var in unknowns. None, where the
    /// problem does not take the setting.
    fn levels(&self, setting: &Setting) -> Result<(Vec<Level>, f64), Failure> {
        let mut open = setting.applied(&self.sample);
        open.galerkin.cells = None;
        if open.validate().is_err() {
            return Ok((Vec::new(), 0.0));
        }
        let Ok(problem) = problem::of_file(&open) else {
            return Ok((Vec::new(), 0.0));
        };
        let mut levels: Vec<Level> = Vec::new();
        let most = self.best();
        let dimension = problem.dimension();
        let finer = |&cells: &usize| match dimension {
            Some(2..) => cells + cells.div_ceil(2),
            _ => 2 * cells,
        };
        let known = problem.levels();
        let beyond = core::iter::successors(known.last().map(finer), |cells| Some(finer(cells)));
        for cells in known.iter().copied().chain(beyond) {
            let file = Setting { cells, ..*setting }.applied(&self.sample);
            if file.validate().is_err() {
                break;
            }
            let Ok(problem) = problem::of_file(&file) else {
                break;
            };
            let (cost, unknowns) = (problem.cost(), problem.unknowns());
            let large = problem.memory() > MEMORY || unknowns > UNKNOWNS;
            if large || (cost.setup > most && levels.len() > 1) {
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
    fn families(&mut self) -> Result<(), Failure> {
        let degrees: Vec<usize> = (0..=self.file.most_degree().0).collect();
        let all = [Pairs::Default, Pairs::Pointwise];
        for degree in open(&self.file.galerkin.degree, &degrees) {
            for pairs in open(&self.file.galerkin.pairs, &all) {
                let setting = Setting {
                    degree,
                    pairs,
                    ..self.base()
                };
                self.family(setting)?;
            }
        }
        Ok(())
    }

    fn family(&mut self, first: Setting) -> Result<(), Failure> {
        let (levels, order) = self.levels(&first)?;
        let mut family = Family {
            first,
            levels,
            pilots: Vec::new(),
            order,
        };
        self.explore(&mut family)?;
        self.explore(&mut family)?;
        self.families.push(family);
        Ok(())
    }

    /// One more pilot, on the next level, if there is one that is cheap; whether there was.
    fn explore(&mut self, family: &mut Family) -> Result<bool, Failure> {
        let Some(&level) = family.levels.get(family.pilots.len()) else {
            return Ok(false);
        };
        let setting = Setting {
            cells: level.cells,
            ..family.first
        };
        // How many pairs are pointwise is known from the second pilot on.
        let known = family.pilots.last();
        let pairs = known.map_or(0.0, |p| p.pointwise * level.unknowns / p.unknowns);
        if !self.affords(self.price(&setting, &level.cost, pairs)) {
            return Ok(false);
        }
        let Some(pilot) = self.pilot(setting)? else {
            family.levels.clear();
            return Ok(false);
        };
        family.pilots.push(pilot);
        let predictions: Vec<Prediction> = family.predictions(self).collect();
        self.found.retain(|found| !family.has(&found.setting));
        self.found.extend(predictions);
        Ok(true)
    }

    /// Pilots on finer levels, as long as what is promised is much finer than what was seen.
    fn climb(&mut self) -> Result<(), Failure> {
        loop {
            let Some(best) = self.first() else {
                return Ok(());
            };
            let Some(at) = self.families.iter().position(|f| f.has(&best.setting)) else {
                return Ok(());
            };
            let mut family = self.families.swap_remove(at);
            let seen = family.pilots.len();
            let level = family
                .levels
                .iter()
                .position(|l| l.cells == best.setting.cells);
            let far = level.is_some_and(|level| level > seen);
            let more = far && self.explore(&mut family)?;
            self.families.push(family);
            if !more {
                return Ok(());
            }
        }
    }

    /// Other absorptions and the other estimator, for the best that was found.
    fn vary(&mut self) -> Result<(), Failure> {
        let Some(best) = self.first() else {
            return Ok(());
        };
        let Some(family) = self.families.iter().find(|f| f.has(&best.setting)) else {
            return Ok(());
        };
        let (levels, order) = (family.levels.clone(), family.order);
        let Some(known) = family.pilots.last().cloned() else {
            return Ok(());
        };
        let pilots = family.pilots.clone();
        let Some(level) = levels
            .iter()
            .find(|level| level.cells == known.setting.cells)
        else {
            return Ok(());
        };
        for absorption in self.absorptions() {
            for estimator in self.estimators() {
                let setting = Setting {
                    absorption,
                    estimator,
                    ..known.setting
                };
                let price = self.price(&setting, &level.cost, known.pointwise);
                if setting == known.setting || !self.affords(price) {
                    continue;
                }
                let Some(pilot) = self.pilot(setting)? else {
                    continue;
                };
                // Its variance falls on more cells as that of the settings that were looked at closely.
                let family = Family {
                    first: setting,
                    levels: levels.clone(),
                    pilots: pilots.clone(),
                    order,
                };
                let observed = family.observed();
                let of = |level: &Level| {
                    let ratio = level.unknowns / pilot.unknowns;
                    self.predict(&pilot, level, ratio.powf(-2.0 * observed))
                };
                let predictions: Vec<Prediction> = levels.iter().map(of).collect();
                self.found.extend(predictions);
            }
        }
        Ok(())
    }

    /// The best prediction so far.
    fn first(&self) -> Option<Prediction> {
        let order = |a: &&Prediction, b: &&Prediction| a.seconds().total_cmp(&b.seconds());
        self.found.iter().min_by(order).copied()
    }

    /// The best that the problem takes.
    fn finish(mut self) -> Result<Split, Failure> {
        self.found
            .sort_by(|a, b| a.seconds().total_cmp(&b.seconds()));
        let plain = self.found.iter().find(|found| found.setting.plain);
        let plain = plain.map_or(f64::INFINITY, Prediction::seconds);
        let mut refusal = None;
        for found in &self.found {
            let mut file = found.setting.applied(self.file);
            if file.walk.walks.place == Place::Default {
                // Until the error is reached.
                file.walk.walks = Placed::chosen(u64::MAX >> 1);
            }
            if let Err(failure) = accepted(&file, found.setting.plain) {
                refusal.get_or_insert(failure);
                continue;
            }
            return Ok(Split {
                file,
                plain: found.setting.plain,
                report: SplitReport {
                    method: if found.setting.plain {
                        "plain"
                    } else {
                        "preconditioned"
                    },
                    predicted_setup_seconds: found.setup,
                    predicted_walk_seconds: found.walking,
                    predicted_walks: found.walks,
                    predicted_states: found.states,
                    predicted_plain_seconds: plain,
                    pilots: self.pilots,
                    pilot_walks: self.walks,
                    pilot_seconds: self.clock.elapsed().as_secs_f64(),
                },
            });
        }
        Err(refusal.unwrap_or_else(|| Failure::input("no setting of the file has walks")))
    }
}

impl Family {
    /// Whether a setting is one of it.
    fn has(&self, setting: &Setting) -> bool {
        *setting
            == Setting {
                cells: setting.cells,
                ..self.first
            }
    }

    /// r of √Var ~ unknowns^−r, as the last two pilots have it, and no better than theory.
    fn observed(&self) -> f64 {
        let [.., coarse, fine] = self.pilots.as_slice() else {
            return 0.0;
        };
        let sum = |pilot: &Pilot| -> f64 {
            let shares = pilot.targets.iter();
            shares
                .map(|(weight, bound, variance)| weight * variance / (bound * bound))
                .sum()
        };
        let falls = sum(coarse) / sum(fine);
        let order = 0.5 * falls.ln() / (fine.unknowns / coarse.unknowns).ln();
        if order.is_finite() {
            order.clamp(0.0, self.order)
        } else {
            self.order
        }
    }

    /// Of every level, from the pilot on it or on the last before it.
    fn predictions<'a>(&'a self, search: &'a Search<'_>) -> impl Iterator<Item = Prediction> + 'a {
        let order = self.observed();
        self.levels
            .iter()
            .enumerate()
            .filter_map(move |(i, level)| {
                let pilot = self.pilots.get(i).or(self.pilots.last())?;
                let ratio = level.unknowns / pilot.unknowns;
                Some(search.predict(pilot, level, ratio.powf(-2.0 * order)))
            })
    }
}

/// Seconds of a walk, with so many times the pointwise pairs that the pilot had.
fn walk_seconds(pilot: &Pilot, cost: &Cost, more: f64) -> f64 {
    // One pair is that of a cell with itself, however many cells there are.
    let pairs = if pilot.pointwise > 1.0 {
        more * pilot.pointwise
    } else {
        pilot.pointwise
    };
    let cost = if pilot.setting.plain {
        cost.plain
    } else {
        cost.walk
    };
    cost.seconds(pilot.setting.estimator, pilot.states, pairs)
}

/// Batches of the rounds that so many batches take.
fn batches(needed: f64) -> f64 {
    // Beyond that rounds are small change.
    if needed > MANY {
        return needed;
    }
    let mut done = 0;
    loop {
        done += next_round(done, u64::MAX);
        if done as f64 >= needed {
            return done as f64;
        }
    }
}

/// The answer of few walks.
fn walked(problem: &dyn Problem, plain: bool, plan: &Plan) -> Result<Answer, Failure> {
    let progress = Progress::hidden();
    if plain {
        problem.plain(plan, &progress)
    } else {
        problem.answer(plan, &progress)
    }
}

/// Whether the problem takes what was chosen.
fn accepted(file: &ProblemFile, plain: bool) -> Result<(), Failure> {
    file.validate()?;
    let problem = problem::of_file(file)?;
    if !plain {
        solve::refuse_beyond_memory(file, &*problem)?;
    }
    if file.walk.allow_infinite_variance {
        return Ok(());
    }
    problem.refuse_infinite_variance()
}

/// The file with at most [`TARGETS`] of its targets and of the points of its grids, evenly chosen; and how many each
/// stands for.
fn sampled(file: &ProblemFile) -> (ProblemFile, Vec<f64>) {
    let mut sample = file.clone();
    if let file::Problem::Cube(cube) = &mut sample.problem {
        // Its means are integrals that no pilot needs.
        cube.solution = None;
    }
    let count = file.targets.len();
    let kept = count.min(TARGETS);
    sample.targets = (0..kept)
        .filter_map(|i| file.targets.get(i * count / kept).cloned())
        .collect();
    let share = count as f64 / kept as f64;
    let mut weights = Vec::new();
    for target in &mut sample.targets {
        let What::Grid(points, _) = &mut target.what else {
            weights.push(share);
            continue;
        };
        let few = points.value.min((TARGETS / kept).max(1));
        weights.extend(vec![share * points.value as f64 / few as f64; few]);
        points.value = few;
    }
    (sample, weights)
}
