//! One pilot: few walks of one setting, and what they tell of many.

use fredholm_core::{Estimator, MIN_SCORED_WALKS, Statistics, Tolerance};

use super::prediction::{Level, Prediction, Scales, batches_of_whole_stages};
use super::setting::Setting;
use crate::answer::bound;
use crate::{Error, Goal, Model};
use fredholm_model::cost::{Cost, PointwisePairs};
use fredholm_model::{Ask, Target, goals};

/// The most targets that a pilot has.
const TARGETS: usize = 8;
/// The square of how many times as often as everywhere walks come to the places where few walks miss something. The
/// diagnosis finds 3.6 to 7.1 times in a square room and 4.3 to 6.4 times in one with a doorway, with 50 to 200 cells
/// of degree 2 to 4.
const RARE: f64 = 4.0;

/// Few of the targets, and the number of targets that each of them stands for.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    pub(super) goals: Vec<Goal>,
    pub(super) weights: Vec<f64>,
}

impl Sample {
    /// At most [`TARGETS`] targets and points of grids, evenly chosen.
    pub(super) fn new(model: &dyn Model, targets: &[Target]) -> Result<Self, Error> {
        let count = targets.len();
        let kept = count.min(TARGETS);
        let mut few: Vec<Target> = (0..kept)
            .filter_map(|i| targets.get(i * count / kept).cloned())
            .collect();
        let share = count as f64 / kept as f64;
        let mut weights = Vec::new();
        for target in &mut few {
            let Ask::Grid { points, .. } = &mut target.ask else {
                weights.push(share);
                continue;
            };
            let fewer = (*points).min((TARGETS / kept).max(1));
            weights.extend(vec![share * *points as f64 / fewer as f64; fewer]);
            *points = fewer;
        }
        Ok(Self {
            goals: goals(model, &few)?,
            weights,
        })
    }

    /// The number of all targets.
    pub(super) fn weight(&self) -> f64 {
        self.weights.iter().sum()
    }

    /// The number of targets in the sample.
    pub(super) fn targets(&self) -> usize {
        self.weights.len()
    }
}

/// What a pilot found of one target.
#[derive(Clone, Copy, Debug)]
struct Observed {
    /// The number of targets that this one stands for.
    weight: f64,
    /// Var/E²: the number of walks that the target takes by its observed variance.
    needed: f64,
    /// The number of walks that it takes by the variance which few walks miss, over the rare variance of the cells.
    rare: f64,
    /// The number of walks that scored. No other walk tells of the variance.
    scored: f64,
    /// The number of walks until enough have scored for an error to be believed.
    believed: f64,
}

impl Observed {
    /// The number of walks on cells with this multiple of the observed variance, and with this rare variance. It is
    /// infinite before a walk has scored.
    fn walks(&self, multiple: f64, rare: f64) -> f64 {
        if self.scored > 0.0 {
            (multiple * self.needed)
                .max(rare * self.rare)
                .max(self.believed)
        } else {
            f64::INFINITY
        }
    }

    /// The factor by which the true variance may differ from the observed one.
    fn times(&self, doubt: f64) -> f64 {
        1.0 + doubt / self.scored.sqrt()
    }
}

/// E η² of every target, and of whatever else a room needs, as few walks observe it. Rare steps hardly ever coincide
/// with weights that are rare themselves.
pub(super) fn squares<'a>(all: impl Iterator<Item = &'a Statistics>) -> Vec<f64> {
    let square = |statistics: &Statistics| {
        let plain = statistics.plain();
        plain.estimate.powi(2) + plain.std_dev.unwrap_or(0.0).powi(2)
    };
    all.map(square).collect()
}

/// How far the variance of N walks that scored may be from the true one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Doubt {
    /// c if the true variance may be 1 + c/√N times as large: all large scores may be missing. Choices allow for this.
    pub(super) more: f64,
    /// c if the true variance may be 1 + c/√N times as small: there may be too many large scores.
    pub(super) less: f64,
    /// The part of the rare variance that walks observe.
    pub(super) observed_rare: f64,
}

/// Walks, and what they were of.
#[derive(Debug)]
pub(super) struct Walked<'a> {
    pub(super) statistics: Vec<&'a Statistics>,
    /// How many targets each of the first ones stands for: all others for one.
    pub(super) weights: &'a [f64],
    pub(super) pointwise: PointwisePairs,
    pub(super) unknowns: f64,
}

/// What few walks found.
#[derive(Clone, Debug)]
pub(super) struct Pilot {
    pub(super) setting: Setting,
    targets: Vec<Observed>,
    /// The number of walks of all targets.
    pub(super) walks: u64,
    /// The mean number of states of a walk.
    states: f64,
    pub(super) pointwise: PointwisePairs,
    pub(super) unknowns: f64,
    doubt: Doubt,
}

impl Pilot {
    /// The pilot that had these walks.
    pub(super) fn new(
        setting: Setting,
        walked: &Walked<'_>,
        tolerance: Tolerance,
        model: &dyn Model,
        squares: &[f64],
        doubt: Doubt,
    ) -> Self {
        // What else a room needs belongs to no target, and is never sampled.
        let all = || walked.statistics.iter().copied();
        let weights = walked.weights.iter().copied();
        let weights = weights.chain(core::iter::repeat(1.0));
        let targets = all().zip(weights).zip(squares);
        let Setting { absorption, .. } = setting;
        // A score is F/q where a walk is absorbed, and F in every state otherwise.
        let score = match setting.estimator {
            Estimator::Absorption => absorption,
            Estimator::Collision => 1.0,
        };
        let rare = RARE * doubt.observed_rare * score / (1.0 - absorption);
        // E η² of walks from anywhere may be larger than that of walks from a target which little light reaches.
        let from_anywhere = model.mean_square_of_source() / score;
        let of = |((statistics, weight), square): ((&Statistics, f64), &f64)| {
            // Both estimates of plain walks are the same.
            let estimate = statistics.preconditioned();
            let bound = bound(tolerance, statistics);
            let scored = statistics.scored() as f64;
            let each = statistics.walks() as f64 / scored;
            Observed {
                weight,
                needed: (estimate.std_dev.unwrap_or(0.0) / bound).powi(2),
                rare: rare * square * square.max(from_anywhere) / bound.powi(2),
                scored,
                believed: MIN_SCORED_WALKS as f64 * each,
            }
        };
        let walks: u64 = all().map(Statistics::walks).sum();
        let states: u64 = all().map(Statistics::states).sum();
        Self {
            setting,
            targets: targets.map(of).collect(),
            walks,
            states: states as f64 / walks as f64,
            pointwise: walked.pointwise,
            unknowns: walked.unknowns,
            doubt,
        }
    }

    /// The pilot of another setting if its walks had the same variance.
    pub(super) fn shortened(&self, setting: Setting, doubt: Doubt) -> Self {
        Self {
            states: self.states * self.setting.absorption / setting.absorption,
            setting,
            doubt,
            ..self.clone()
        }
    }

    /// The least number of scored walks of a target.
    pub(super) fn scored(&self) -> f64 {
        let scored = self.targets.iter().map(|observed| observed.scored);
        scored.fold(f64::INFINITY, f64::min)
    }

    /// The number of walks that all targets take by their observed variance.
    pub(super) fn needed(&self) -> f64 {
        let targets = self.targets.iter();
        targets
            .map(|observed| observed.weight * observed.needed)
            .sum()
    }

    /// Corrects the pilot as if it missed as much of the variance as a like one did, of which many
    /// walks needed so many times as many as few had told.
    pub(super) fn missed(&mut self, times: f64) {
        for observed in &mut self.targets {
            observed.needed *= times;
        }
    }

    /// Seconds of the pilot's walks.
    pub(super) fn seconds(&self, cost: &Cost) -> f64 {
        self.walks as f64 * self.seconds_per_walk(cost, self.pointwise)
    }

    /// What the pilot's setting takes on these cells.
    pub(super) fn predict(&self, level: &Level, scales: &Scales, batch: u64) -> Prediction {
        let batch = batch as f64;
        let walks = |multiple: &dyn Fn(&Observed) -> f64, rare: f64| -> f64 {
            let whole = |walks: f64| batch * batches_of_whole_stages(walks / batch);
            let of =
                |target: &Observed| target.weight * whole(target.walks(multiple(target), rare));
            self.targets.iter().map(of).sum()
        };
        let each = self.seconds_per_walk(&level.cost, self.pairs(level.unknowns));
        let [setup, source] = self.setting.setup(&level.cost);
        let pilot_walks = self.walks / self.targets.len().max(1) as u64;
        let fast = |target: &Observed| scales.fast / target.times(self.doubt.less);
        let slow = |target: &Observed| scales.slow * target.times(self.doubt.more);
        let worst_case = self
            .targets
            .iter()
            .map(|target| target.walks(slow(target), scales.rare));
        let worst_case_walks = worst_case.fold(0.0, f64::max);
        let risk_adjusted = |rare: f64| {
            let walks = walks(&|_| scales.observed, rare) + walks(&slow, rare);
            0.5 * walks * each
        };
        let observed = self.targets.iter();
        let observed = observed.map(|target| target.walks(scales.observed, scales.rare));
        let most_walks = batch * batches_of_whole_stages(observed.fold(0.0, f64::max) / batch);
        let best_case = walks(&fast, scales.optimistic_rare) * each;
        let walks = walks(&|_| scales.observed, scales.rare);
        Prediction {
            setting: Setting {
                cells: level.cells,
                ..self.setting
            },
            setup,
            source,
            seconds_per_walk: each,
            walking: walks * each,
            risk_adjusted: risk_adjusted(scales.rare),
            optimistic: risk_adjusted(scales.optimistic_rare),
            best_case,
            pilot_walks: if level.cells == self.setting.cells {
                pilot_walks
            } else {
                0
            },
            scored: self.scored(),
            worst_case_walks,
            most_walks,
            walks,
            states: walks * self.states,
        }
    }

    /// The pointwise pairs of a row with this number of unknowns.
    pub(super) fn pairs(&self, unknowns: f64) -> PointwisePairs {
        let times = unknowns / self.unknowns;
        self.pointwise.on(self.setting.pairs, times)
    }

    /// Seconds of a walk.
    fn seconds_per_walk(&self, cost: &Cost, pairs: PointwisePairs) -> f64 {
        let walk = self.setting.walk(cost);
        walk.seconds(self.setting.estimator, self.states, pairs)
    }
}
