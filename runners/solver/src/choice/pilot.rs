//! One pilot: few walks of one setting, and what they tell.

use fredholm_core::Statistics;

use super::aim::{Aim, Given};
use super::setting::Setting;
use crate::{Error, Goal, Model};
use fredholm_model::cost::PointwisePairs;
use fredholm_model::{Target, goals};

/// The most targets that a pilot has.
const TARGETS: usize = 8;
/// How far few walks may be from the true variance: that of N walks that scored may be 1 + DOUBT/√N times as large, or as
/// small. Its standard deviation is √(κ − 1)/√N with the kurtosis κ of the scores, which is 3 of a normal distribution.
const DOUBT: f64 = 4.0;
/// N walks that miss something tell, at 95 %, that fewer than 3/N of all walks meet it.
pub(super) const MISSED: f64 = 3.0;
/// Standard errors beyond which two estimates are no longer of one number, at 95 %.
pub(super) const SURE: f64 = 2.0;

/// Few of the targets, and the number of targets that each of them stands for.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    pub(super) goals: Vec<Goal>,
    pub(super) weights: Vec<f64>,
    /// The numbers of the targets among those of the answer, unless points of a grid are left out.
    numbers: Option<Vec<usize>>,
    /// The targets that one set of walks of the way back serves, as far as pilots have so many; otherwise 1.
    served: u64,
}

impl Sample {
    /// At most [`TARGETS`] targets and points of grids: half of them the first of these numbers, each of which stands for itself, and others evenly
    /// chosen.
    pub(super) fn new(
        model: &dyn Model,
        targets: &[Target],
        first: &[usize],
    ) -> Result<Self, Error> {
        let count = targets.len();
        // Receivers of the way back have one set of walks.
        let most = if model.about().is_adjoint {
            count
        } else {
            TARGETS
        };
        let kept = count.min(most);
        let channels = model.channels().len().max(1);
        let first = &first[..first.len().min(kept / 2)];
        let others: Vec<usize> = (0..count).filter(|i| !first.contains(i)).collect();
        let few = kept - first.len();
        let share = others.len() as f64 / few as f64;
        let even = (0..few).map(|i| (others[i * others.len() / few], share));
        let mut numbers: Vec<_> = first.iter().map(|&i| (i, 1.0)).chain(even).collect();
        numbers.sort_by_key(|&(i, _)| i);
        let (mut few, mut weights) = (Vec::new(), Vec::new());
        for &(number, share) in &numbers {
            let mut target = targets[number].clone();
            if let Some(points) = target.ask.points() {
                let fewer = (*points).min((TARGETS / kept).max(1));
                weights.extend(vec![
                    share * *points as f64 / fewer as f64;
                    fewer * channels
                ]);
                *points = fewer;
            } else {
                weights.extend(vec![share; channels]);
            }
            few.push(target);
        }
        Ok(Self {
            numbers: (weights.len() == kept * channels).then(|| {
                let of = |(first, _)| first * channels..(first + 1) * channels;
                numbers.into_iter().flat_map(of).collect()
            }),
            goals: goals(model, &few)?,
            weights,
            served: if model.about().is_adjoint {
                count.min(TARGETS) as u64
            } else {
                1
            },
        })
    }

    /// The walks of a pilot that has so many of each target: those of all together, where receivers are served by the same. A small
    /// receiver is met by few of them.
    pub(super) fn walks(&self, each: u64) -> u64 {
        each * self.served
    }

    /// These of the statistics of all targets.
    pub(super) fn of<'a>(&self, all: &'a [Statistics]) -> Vec<&'a Statistics> {
        let numbers = self.numbers.iter().flatten();
        numbers.filter_map(|&i| all.get(i)).collect()
    }
}

/// What a pilot found of one target.
#[derive(Clone, Copy, Debug)]
pub(super) struct Observed {
    /// The number of targets that this one stands for.
    pub(super) weight: f64,
    /// The variance of a walk.
    variance: f64,
    /// Var/E²: the number of walks that the target takes.
    needed: f64,
    /// The estimate and the number of walks behind it.
    estimate: f64,
    walks: f64,
    /// E, and what rounding leaves of it, where walks end at that.
    bound: f64,
    floor: f64,
    /// The number of walks until enough have scored for an error to be believed.
    believed: f64,
    /// The factor by which the true variance may differ from the observed one.
    doubt: f64,
}

impl Observed {
    /// Asks for this error.
    fn ask(&mut self, error: f64) {
        self.bound = error.max(self.floor);
        self.needed = self.variance / self.bound.powi(2);
    }

    /// The number of walks with this multiple of the observed variance; infinite before a walk has scored.
    pub(super) fn walks(&self, multiple: f64) -> f64 {
        (multiple * self.needed).max(self.believed)
    }

    /// Corrects the variance by an estimate of more walks, and its standard error: if few walks missed by so much, then
    /// scores that they did not meet, whose share is below [`MISSED`]/N, have at least the square of that over the share.
    fn correct(&mut self, [estimate, error]: [f64; 2]) {
        let missed = (self.estimate - estimate).abs() - SURE * error;
        if missed > 0.0 {
            self.variance = self.variance.max(missed.powi(2) * self.walks / MISSED);
            self.needed = self.needed.max(self.variance / self.bound.powi(2));
        }
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
    /// The errors of the first ones by rounding, where the first stage of walks reaches them: walks end there, whatever was asked for.
    /// 0 otherwise.
    pub(super) floors: &'a [f64],
    pub(super) pointwise: PointwisePairs,
    pub(super) unknowns: f64,
}

/// The estimates of the most walks so far, and their standard errors: u is the same in all settings.
#[derive(Debug, Default)]
pub(super) struct Known {
    walks: u64,
    pub(super) targets: Vec<[f64; 2]>,
    /// The walks that targets take which pilots leave out, over those that pilots tell of: a small error that is asked for of one of
    /// them, which is the same in all settings, makes most of it.
    pub(super) left_out: f64,
}

impl Known {
    /// Learns from statistics of the targets of pilots, if they have more walks.
    pub(super) fn learn(&mut self, all: &[&Statistics]) {
        let walks = all.iter().map(|of| of.walks()).max().unwrap_or(0);
        if walks > self.walks {
            self.walks = walks;
            let of = |of: &&Statistics| {
                let found = of.preconditioned();
                [found.estimate, found.std_error.unwrap_or(f64::INFINITY)]
            };
            self.targets = all.iter().map(of).collect();
        }
    }
}

/// What few walks found.
#[derive(Clone, Debug)]
pub(super) struct Pilot {
    pub(super) setting: Setting,
    /// Whether its targets are those of all pilots, and not those of the answer.
    is_sampled: bool,
    /// The number of targets of one set of walks.
    shared: usize,
    targets: Vec<Observed>,
    /// One target for all that the pilot leaves out and that take more.
    left_out: Option<Observed>,
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
    pub(super) fn new(walked: &Walked<'_>, aim: &Aim, model: &dyn Model) -> Self {
        let floors = walked.floors.iter().copied();
        let floors = floors.chain(core::iter::repeat(0.0));
        let all = || walked.statistics.iter().copied();
        let of = |(i, ((statistics, floor), weight)): (usize, ((&Statistics, f64), f64))| {
            let variance = aim.variance(statistics, floor);
            let mut target = Observed {
                weight,
                variance,
                needed: 0.0,
                estimate: statistics.preconditioned().estimate,
                walks: statistics.walks() as f64,
                bound: 0.0,
                floor,
                believed: aim.believed(statistics),
                doubt: 1.0 + DOUBT / (statistics.scored() as f64).sqrt(),
            };
            target.ask(aim.error(i, statistics, variance));
            target
        };
        let weights = walked.weights.iter().copied();
        let weights = weights.chain(core::iter::repeat(1.0));
        let walks: u64 = all().map(|of| of.walks()).sum();
        let states: u64 = all().map(|of| of.states()).sum();
        let targets = all().zip(floors).zip(weights).enumerate().map(of);
        let mut pilot = Self {
            setting: walked.setting,
            is_sampled: !walked.weights.is_empty(),
            shared: model.shared(),
            targets: targets.collect(),
            left_out: None,
            walks,
            walks_each: all().map(|of| of.walks()).max().unwrap_or(0),
            states: states as f64 / walks as f64,
            pointwise: walked.pointwise,
            unknowns: walked.unknowns,
            scored: all().map(|of| of.scored()).min().unwrap_or(0),
        };
        pilot.share();
        pilot
    }

    /// What shares its walks takes as many as what takes most of them.
    fn share(&mut self) {
        for sharing in self.targets.chunks_mut(self.shared) {
            let most = |of: fn(&Observed) -> f64| sharing.iter().map(of).fold(0.0, f64::max);
            let [needed, believed] = [most(|of| of.needed), most(|of| of.believed)];
            for target in sharing {
                (target.needed, target.believed) = (needed, believed);
            }
        }
    }

    /// Asks for these errors.
    pub(super) fn ask(&mut self, given: &Given) {
        for (i, target) in self.targets.iter_mut().enumerate() {
            target.ask(given.error(i, target.variance));
            // Neither has a variance.
            if target.needed.is_nan() {
                target.needed = given.walks as f64;
            }
        }
        self.share();
    }

    /// The errors that so many walks leave.
    pub(super) fn leaves(&self, given: &Given) -> Vec<f64> {
        let of = |target: &Observed| given.standard_error(target.variance);
        self.targets.iter().map(of).collect()
    }

    /// Corrects the variances by estimates of more walks.
    pub(super) fn correct(&mut self, known: &Known) {
        if self.is_sampled && self.walks_each < known.walks {
            let all = self.targets.iter_mut().zip(&known.targets);
            all.for_each(|(target, &known)| target.correct(known));
        }
        let needed = known.left_out * self.needed();
        let first = self.targets.first();
        let first = first.filter(|_| self.is_sampled && needed > 0.0);
        self.left_out = first.map(|target| Observed {
            weight: 1.0,
            needed,
            ..*target
        });
    }

    /// The targets, and one for what is left out.
    pub(super) fn observed(&self) -> impl Iterator<Item = &Observed> {
        self.targets.iter().chain(&self.left_out)
    }

    /// The number of walks that all targets take by their observed variance.
    pub(super) fn needed(&self) -> f64 {
        self.targets.iter().map(|of| of.weight * of.needed).sum()
    }

    /// The number of walks that all targets take by their observed variance, with those that the pilot leaves out.
    pub(super) fn needed_of_all(&self) -> f64 {
        self.observed().map(|of| of.weight * of.needed).sum()
    }

    /// The pointwise pairs of a row with this number of unknowns.
    pub(super) fn pairs(&self, unknowns: f64) -> PointwisePairs {
        self.pointwise
            .on(self.setting.pairs, unknowns / self.unknowns)
    }
}
