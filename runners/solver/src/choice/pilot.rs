//! One pilot: few walks of one setting, and what they tell.

use fredholm_core::{Estimator, MIN_SCORED_WALKS, Statistics, Tolerance};

use super::setting::Setting;
use crate::{Error, Goal, Model};
use fredholm_model::cost::PointwisePairs;
use fredholm_model::{Ask, Target, goals};

/// The most targets that a pilot has.
const TARGETS: usize = 8;
/// The square of how many times as often as everywhere walks come to the places where few walks miss something. The
/// diagnosis finds 3.6 to 7.1 times in a square room and 4.3 to 6.4 times in one with a doorway, with 50 to 200 cells
/// of degree 2 to 4.
const RARE: f64 = 4.0;

/// How far few walks may be from the true variance: that of N walks that scored may be 1 + DOUBT/√N times as large, or as
/// small. Its standard deviation is √(κ − 1)/√N with the kurtosis κ of the scores, which is 3 of a normal distribution.
const DOUBT: f64 = 4.0;

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
}

/// What a pilot found of one target.
#[derive(Clone, Copy, Debug)]
pub(super) struct Observed {
    /// The number of targets that this one stands for.
    pub(super) weight: f64,
    /// Var/E²: the number of walks that the target takes.
    needed: f64,
    /// The part of E² that the error of (v, Φ) takes, which no walks lower.
    taken: f64,
    /// The number of walks until enough have scored for an error to be believed.
    believed: f64,
    /// The factor by which the true variance may differ from the observed one.
    doubt: f64,
}

impl Observed {
    /// The number of walks with this multiple of the observed variance; infinite before a walk has scored.
    pub(super) fn walks(&self, multiple: f64) -> f64 {
        if self.taken >= 1.0 {
            return f64::INFINITY;
        }
        (multiple * self.needed / (1.0 - self.taken)).max(self.believed)
    }

    /// The number of walks if cells help less than observed, and if large scores were missed.
    pub(super) fn careful_walks(&self, multiple: f64) -> f64 {
        self.walks(multiple * self.doubt)
    }

    /// The number of walks if there were too many large scores. Before a walk has scored nothing is known.
    pub(super) fn hopeful_walks(&self, multiple: f64) -> f64 {
        if self.believed.is_finite() {
            self.walks(multiple / self.doubt)
        } else {
            0.0
        }
    }
}

/// Walks, and what they were of.
#[derive(Debug)]
pub(super) struct Walked<'a> {
    pub(super) setting: Setting,
    /// Statistics of the targets, and of whatever else a room needs.
    pub(super) statistics: Vec<&'a Statistics>,
    /// How many targets each of the first ones stands for: all others for one.
    pub(super) weights: &'a [f64],
    pub(super) pointwise: PointwisePairs,
    pub(super) unknowns: f64,
    /// The part of the tolerance that moments of F are to leave; if walks have their own, what they leave is known.
    pub(super) of_moments: Option<f64>,
    /// The variance that few walks miss: see [`System::rare_variance`](crate::System::rare_variance).
    pub(super) rare: f64,
}

/// What few walks found.
#[derive(Clone, Debug)]
pub(super) struct Pilot {
    pub(super) setting: Setting,
    pub(super) targets: Vec<Observed>,
    /// The number of walks of all targets.
    pub(super) walks: u64,
    /// The number of walks of a target.
    pub(super) walks_each: u64,
    /// The mean number of states of a walk.
    pub(super) states: f64,
    pub(super) pointwise: PointwisePairs,
    pub(super) unknowns: f64,
    /// The least number of scored walks of a target.
    pub(super) scored: u64,
}

impl Pilot {
    /// The pilot that had these walks.
    pub(super) fn new(walked: &Walked<'_>, tolerance: Tolerance, model: &dyn Model) -> Self {
        let Setting {
            absorption,
            estimator,
            ..
        } = walked.setting;
        // A score is F/q where a walk is absorbed, and F in every state otherwise.
        let score = match estimator {
            Estimator::Absorption => absorption,
            Estimator::Collision => 1.0,
        };
        let rare = RARE * walked.rare * score / (1.0 - absorption);
        // E η² of walks from anywhere may be larger than that of walks from a target which little light reaches.
        let from_anywhere = model.mean_square_of_source() / score;
        let of = |(statistics, weight): (&&Statistics, f64)| {
            let [plain, found] = [statistics.plain(), statistics.preconditioned()];
            let square = plain.estimate.powi(2) + plain.std_dev.unwrap_or(0.0).powi(2);
            let variance = found.std_dev.unwrap_or(0.0).powi(2);
            let variance = variance.max(rare * square * square.max(from_anywhere));
            let (walks, scored) = (statistics.walks() as f64, statistics.scored() as f64);
            let bound = tolerance.error(statistics);
            Observed {
                weight,
                needed: variance / bound.powi(2),
                taken: match walked.of_moments {
                    Some(part) => part * part,
                    None => (statistics.control_error() / bound).powi(2),
                },
                believed: MIN_SCORED_WALKS as f64 * walks / scored,
                doubt: 1.0 + DOUBT / scored.sqrt(),
            }
        };
        let all = || walked.statistics.iter();
        let weights = walked.weights.iter().copied();
        let weights = weights.chain(core::iter::repeat(1.0));
        let walks: u64 = all().map(|of| of.walks()).sum();
        let states: u64 = all().map(|of| of.states()).sum();
        Self {
            setting: walked.setting,
            targets: all().zip(weights).map(of).collect(),
            walks,
            walks_each: all().map(|of| of.walks()).max().unwrap_or(0),
            states: states as f64 / walks as f64,
            pointwise: walked.pointwise,
            unknowns: walked.unknowns,
            scored: all().map(|of| of.scored()).min().unwrap_or(0),
        }
    }

    /// The pilot of a setting with other walks, if their variance is this multiple of what these walks had.
    pub(super) fn with_walks(&self, setting: Setting, multiple: f64) -> Self {
        let mut other = Self {
            setting,
            states: self.states * self.setting.absorption / setting.absorption,
            ..self.clone()
        };
        other.multiply(multiple);
        other
    }

    /// Corrects the variance by a factor.
    pub(super) fn multiply(&mut self, times: f64) {
        for observed in &mut self.targets {
            observed.needed *= times;
        }
    }

    /// The number of walks that all targets take by their observed variance.
    pub(super) fn needed(&self) -> f64 {
        self.targets.iter().map(|of| of.weight * of.needed).sum()
    }

    /// The pointwise pairs of a row with this number of unknowns.
    pub(super) fn pairs(&self, unknowns: f64) -> PointwisePairs {
        self.pointwise
            .on(self.setting.pairs, unknowns / self.unknowns)
    }
}
