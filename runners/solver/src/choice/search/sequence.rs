//! Whether walks draw from a Sobol' sequence: where what they score is smooth, far fewer of them are enough.
//!
//! Pilots of 16 replicates are made on systems that are solved already, and on those that were lifted: what a lift leaves is smooth
//! on its cells. A trial of longer replicates tells how fast the error falls with their length. All of them together take at most
//! [`SHARE`] of what pseudo-random walks are predicted to.

use fredholm_core::{Estimator, MIN_BATCHES, MIN_REPLICATES, Statistics};
use fredholm_model::cost::{PointwisePairs, WalkCost};

use super::super::family::{Prediction, batches_of_whole_stages};
use super::super::pilot::{MISSED, SURE};
use super::super::setting::Setting;
use super::lift::{LIFTED_PILOT, Lifted};
use super::{PAYS, PILOT_SECONDS, Search};
use crate::{Error, Model, Sequence, Settings};

/// The share of the time of pseudo-random walks that trials may take.
const SHARE: f64 = 0.05;
/// The part of the time of all pilots that trials may take beside them, before the best pseudo-random walks are known.
const BESIDE: f64 = 0.2;
/// Walks of a replicate of the first trial of a setting, and how many times as many the next trial has.
const FIRST: u64 = 64;
const LONGER: u64 = 4;
/// Walks of a replicate of an answer: with 32 replicates at least a quarter of the least number of pseudo-random walks, so that
/// rare scores are met as well; and at most so many, since whoever cancels waits for them.
const SHORTEST: u64 = 512;
const LONGEST: u64 = 1 << 20;
/// How many times less variance a sequence is hoped to leave where no trial was made: 10 to 200 were measured on cubes.
const HOPE: f64 = 100.0;
/// The rate r of a variance of N^−r within a replicate that is hoped for; 3 is that of very smooth functions, and 1 that of
/// pseudo-random walks.
const HOPED_RATE: f64 = 2.0;
/// The part of the observed rate beyond 1 that longer replicates are trusted to have: that of two trials is uncertain by 0.4.
const TRUSTED: f64 = 0.5;
/// How many times as large as that of 16 replicates a variance may be: that is uncertain by 37 %.
const CAREFUL: f64 = 1.4;
/// States without absorption: the first value is tried first, and the others where that pays.
const FORCED_STEPS: [u32; 3] = [4, 2, 8];
/// The least share of walks that must score: of rare scores, a sequence is of no use.
const SCORED: f64 = 0.25;
/// Seconds of a walk over those of a pseudo-random one with as many states, which may be compiled for its equation.
pub(in super::super) const OF_SEQUENCE: f64 = 1.3;

/// Walks that draw from a sequence, and what they are predicted to take.
#[derive(Clone, Debug)]
pub(in super::super) struct Drawn<'m> {
    pub(in super::super) prediction: Prediction,
    /// The lift that they follow, if they do.
    pub(in super::super) lifted: Option<Lifted<'m>>,
    pub(in super::super) forced_steps: u32,
    /// Walks of a replicate.
    pub(in super::super) batch: u64,
}

/// A setting whose walks may draw from a sequence, with what trials told of it.
#[derive(Clone, Debug)]
struct Trial<'m> {
    /// What pseudo-random walks of it would take.
    random: Prediction,
    /// The lift that walks follow, if they do, and what they take.
    lifted: Option<(Lifted<'m>, WalkCost)>,
    forced_steps: u32,
    /// Walks of a replicate of the longest trial; 0 before there was one.
    length: u64,
    /// The number of targets that each target stands for, and the number of walks that it takes in replicates of that length.
    targets: Vec<(f64, f64)>,
    /// The rate by the last two trials.
    rate: Option<f64>,
    /// States and seconds of a walk.
    states: f64,
    each: f64,
}

impl Trial<'_> {
    /// Seconds of the next trial.
    fn next_seconds(&self, targets: usize) -> f64 {
        let walks = MIN_BATCHES * self.next_length() * targets as u64;
        PILOT_SECONDS + walks as f64 * self.each
    }

    fn next_length(&self) -> u64 {
        match (self.length, &self.lifted) {
            (0, None) => FIRST,
            // The second trial has as many walks as the pilot of the lift.
            (0, Some(_)) => LIFTED_PILOT / MIN_BATCHES / LONGER,
            (length, _) => LONGER * length,
        }
    }

    /// Walks of all targets in replicates of this length, if the variance within a replicate falls at this rate.
    fn walks(&self, length: u64, rate: f64) -> f64 {
        let [long, own] = [length, self.length].map(|length| length as f64);
        let fewer = CAREFUL * (own / long).powf(rate - 1.0);
        let of = |(weight, needed): &(f64, f64)| {
            let replicates = (fewer * needed / long).max(MIN_REPLICATES as f64);
            weight * long * batches_of_whole_stages(replicates)
        };
        self.targets.iter().map(of).sum()
    }

    /// The length of replicates that takes the fewest walks, and these.
    fn best(&self, lengths: &[u64], rate: f64) -> (u64, f64) {
        let all = lengths.iter().map(|&of| (of, self.walks(of, rate)));
        // Of equal ones the longest: it may gain more.
        let best = all.min_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        best.unwrap_or((SHORTEST, f64::INFINITY))
    }

    /// The rate that longer replicates are trusted to have.
    fn trusted_rate(&self) -> f64 {
        let more = self.rate.map_or(0.0, |rate| rate - 1.0);
        1.0 + TRUSTED * more.clamp(0.0, 2.0)
    }
}

/// All trials, and what they took.
#[derive(Debug)]
pub(super) struct Sequences<'m> {
    /// Whether walks may draw from a sequence, and whether they have to.
    may: bool,
    must: bool,
    /// The lengths that replicates may have.
    lengths: Vec<u64>,
    trials: Vec<Trial<'m>>,
    /// Settings whose trials failed, or had few scores.
    refused: Vec<Setting>,
    /// Predicted seconds of all trials.
    work: f64,
}

impl Sequences<'_> {
    pub(super) fn new(model: &dyn Model, settings: &Settings) -> Self {
        let must = settings.sequence == Some(Sequence::Sobol);
        let is_open = settings.sequence.is_none() && settings.walks.is_none();
        let is_asked = settings.tolerance.is_some();
        let all = core::iter::successors(Some(SHORTEST), |length| Some(2 * length));
        let all = all.take_while(|length| *length <= LONGEST).collect();
        Self {
            may: model.about().has_sequences && is_asked && (is_open || must),
            must,
            lengths: settings.batch.map_or(all, |batch| vec![batch]),
            trials: Vec::new(),
            refused: Vec::new(),
            work: 0.0,
        }
    }
}

impl<'m> Search<'m> {
    /// Walks of a sequence in place of the best pseudo-random ones, with a lift or without, if they are predicted to take less than
    /// half as long, or if nothing else is wanted.
    pub(in super::super) fn sequence(&mut self, best: &Prediction) -> Option<Drawn<'m>> {
        let price = self.random_price(best);
        let share = SHARE * price;
        loop {
            let is_missing = self.sequences.must && self.best_trial().is_none();
            let may = if is_missing { f64::INFINITY } else { share };
            if self.watch.cancelled() || !self.try_sequence_within(may) {
                break;
            }
        }
        let (seconds, trial) = self.best_trial()?;
        let pays = self.sequences.must || PAYS * seconds < price;
        pays.then(|| self.drawn(trial))
    }

    /// From now on walks draw pseudo-random numbers.
    pub(in super::super) fn forget_sequences(&mut self) {
        self.sequences.may = false;
        self.sequences.trials.clear();
    }

    /// Seconds of the best setting, or of walks of a lift if they are predicted to take less than half as long.
    fn random_price(&self, best: &Prediction) -> f64 {
        let price = self.price(best);
        self.lift(price)
            .map_or(price, |lifted| lifted.prediction.careful)
    }

    /// Makes a trial, if trials have taken a small part of all pilots so far.
    pub(super) fn try_sequence_beside(&mut self) -> bool {
        self.try_sequence_within(BESIDE * self.work)
    }

    /// Seconds of the best setting, or of walks of a sequence or a lift if they are predicted to take less than half as long.
    pub(super) fn least_price(&self, best: &Prediction) -> f64 {
        let price = self.price(best);
        let drawn = self.best_trial().map(|(seconds, _)| seconds);
        let others = [drawn, self.lift_price()].into_iter().flatten();
        let least = others.fold(f64::INFINITY, f64::min);
        if PAYS * least < price { least } else { price }
    }

    /// The best setting that had two trials.
    fn best_trial(&self) -> Option<(f64, &Trial<'m>)> {
        let known = self
            .sequences
            .trials
            .iter()
            .filter(|trial| trial.rate.is_some());
        let all = known.map(|trial| (self.sequence_price(trial), trial));
        all.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Makes the most promising trial, if there is one that pays and all of them take so many seconds at most.
    fn try_sequence_within(&mut self, may: f64) -> bool {
        if !self.sequences.may {
            return false;
        }
        self.add_trials();
        let Some((next, seconds)) = self.next_trial(may - self.sequences.work) else {
            return false;
        };
        self.warn_of(seconds);
        self.sequences.work += seconds;
        self.work += seconds;
        let trial = self.sequences.trials.swap_remove(next);
        if let Ok(longer) = self.try_sequence(&trial) {
            let is_known = longer.rate.is_some() && trial.rate.is_none();
            self.sequences.trials.push(longer);
            if is_known {
                self.add_forced_steps(&trial);
            }
        } else if trial.lifted.is_none() {
            self.sequences.refused.push(trial.random.setting);
        }
        true
    }

    /// Seconds from now on.
    fn sequence_price(&self, trial: &Trial<'_>) -> f64 {
        let (_, walks) = trial.best(&self.sequences.lengths, trial.trusted_rate());
        self.before_walks(trial) + walks * trial.each
    }

    /// Seconds of a set-up before walks: of what is lifted there is one already.
    fn before_walks(&self, trial: &Trial<'_>) -> f64 {
        match trial.lifted {
            None => self.remaining_setup(&trial.random),
            Some(_) => 0.0,
        }
    }

    /// Seconds with luck.
    fn hoped_price(&self, trial: &Trial<'_>) -> f64 {
        let rest = self.before_walks(trial);
        if trial.length == 0 {
            let targets = self.sample.weights.iter().sum::<f64>();
            let least = (MIN_REPLICATES * SHORTEST) as f64 * targets;
            let longer = trial.each / trial.random.seconds_per_walk;
            return rest + (trial.random.hopeful * longer / HOPE).max(least * trial.each);
        }
        let rate = trial.rate.map_or(HOPED_RATE, |rate| rate.max(HOPED_RATE));
        let (_, walks) = trial.best(&self.sequences.lengths, rate);
        rest + walks / CAREFUL * trial.each
    }

    /// The trial that may take least, if it may pay and takes so many seconds at most; and its seconds.
    fn next_trial(&self, may: f64) -> Option<(usize, f64)> {
        let best = self.best()?;
        let price = match self.best_trial() {
            Some((seconds, _)) => seconds.min(self.random_price(&best)),
            None if self.sequences.must => f64::INFINITY,
            None => self.random_price(&best),
        };
        let longest = self.sequences.lengths.last().copied().unwrap_or(0);
        let all = self.sequences.trials.iter().enumerate();
        let all = all.filter_map(|(i, trial)| {
            let seconds = trial.next_seconds(self.sample.weights.len());
            let hoped = self.hoped_price(trial);
            let pays = hoped + PAYS * seconds < price;
            (pays && seconds <= may && trial.length < longest).then_some((i, seconds, hoped))
        });
        let most = all.min_by(|a, b| a.2.total_cmp(&b.2));
        most.map(|(i, seconds, _)| (i, seconds))
    }

    /// Adds all settings of pilots whose systems are solved, with the shortest walks that are safe.
    fn add_trials(&mut self) {
        let forced_steps = self.settings.forced_steps.unwrap_or(FORCED_STEPS[0]);
        let mut new: Vec<Trial<'m>> = Vec::new();
        for family in &self.families {
            for pilot in &family.pilots {
                let setting = pilot.setting;
                let is_new =
                    |trial: &Trial<'_>| trial.lifted.is_some() || trial.random.setting != setting;
                let is_solved = setting.plain || self.systems.of(&setting).is_some();
                let trials = &self.sequences.trials;
                if self.may_answer(&setting)
                    && !self.refuses(&setting)
                    && is_solved
                    && !self.sequences.refused.contains(&setting)
                    && new.iter().chain(trials).all(is_new)
                    && let Some(level) = family.level(setting.cells)
                {
                    let random = family.predict(pilot, level);
                    new.push(self.untried(random, None, forced_steps));
                }
            }
        }
        self.sequences.trials.extend(new);
    }

    /// Adds a lift that was tried, whose walks cost so much.
    pub(super) fn add_lifted(&mut self, lifted: &Lifted<'m>, cost: WalkCost) {
        if self.sequences.may {
            let forced_steps = self.settings.forced_steps.unwrap_or(FORCED_STEPS[0]);
            let with = Some((lifted.clone(), cost));
            let trial = self.untried(lifted.prediction, with, forced_steps);
            self.sequences.trials.push(trial);
        }
    }

    /// Adds the same setting with other numbers of states without absorption.
    fn add_forced_steps(&mut self, trial: &Trial<'m>) {
        if self.settings.forced_steps.is_none() && trial.forced_steps == FORCED_STEPS[0] {
            let others = FORCED_STEPS.iter().skip(1);
            let new: Vec<Trial<'m>> = others
                .map(|&other| self.untried(trial.random, trial.lifted.clone(), other))
                .collect();
            self.sequences.trials.extend(new);
        }
    }

    fn untried(
        &self,
        random: Prediction,
        lifted: Option<(Lifted<'m>, WalkCost)>,
        forced_steps: u32,
    ) -> Trial<'m> {
        let states = random.states / random.walks;
        let states = if states.is_finite() {
            states
        } else {
            self.states
        };
        let mut trial = Trial {
            random,
            lifted,
            forced_steps,
            length: 0,
            targets: Vec::new(),
            rate: None,
            states: states + f64::from(forced_steps),
            each: 0.0,
        };
        trial.each = self.sequence_seconds(&trial);
        trial
    }

    /// Seconds of a walk.
    fn sequence_seconds(&self, trial: &Trial<'_>) -> f64 {
        let setting = &trial.random.setting;
        let of_lift = trial.lifted.as_ref();
        let of_lift = of_lift.map(|(_, cost)| (*cost, PointwisePairs::default()));
        let family = self.family_of(setting);
        let of = family.and_then(|family| {
            let level = family.level(setting.cells)?;
            let pairs = family.pilot_for(setting).or(family.pilots.first())?;
            Some((setting.walk(&level.cost), pairs.pairs(level.unknowns)))
        });
        let Some((walk, pairs)) = of_lift.or(of) else {
            return f64::INFINITY;
        };
        let scores = match self.settings.absorption().estimator() {
            Estimator::Absorption => 1.0 + f64::from(trial.forced_steps),
            Estimator::Collision => trial.states,
        };
        let one = walk.seconds(Estimator::Absorption, trial.states, pairs);
        let score = one - walk.start - (trial.states - 1.0) * walk.step;
        OF_SEQUENCE * (one + (scores - 1.0) * score)
    }

    /// The next trial of a setting.
    fn try_sequence(&mut self, trial: &Trial<'m>) -> Result<Trial<'m>, Error> {
        let setting = trial.random.setting;
        let length = trial.next_length();
        let lifted = trial.lifted.as_ref().map(|(lifted, _)| lifted);
        let mut settings = setting.applied(self.settings);
        if let Some(lifted) = lifted {
            lifted.apply(&mut settings);
        }
        settings.sequence = Some(Sequence::Sobol);
        settings.absorption = self.of_sequences;
        settings.forced_steps = Some(trial.forced_steps);
        settings.batch = Some(length);
        let (answer, ..) = self.walked(
            (&setting, lifted.map(|lifted| &lifted.solved)),
            settings,
            MIN_BATCHES * length,
        )?;
        let all: Vec<&Statistics> = answer.outcome.statistics.iter().collect();
        self.pilots += 1;
        self.walks += all.iter().map(|of| of.walks()).sum::<u64>();
        let [walks, states] = [Statistics::walks, Statistics::states]
            .map(|of| all.iter().map(|all| of(all)).sum::<u64>() as f64);
        let is_rare = |of: &&&Statistics| (of.scored() as f64) < SCORED * of.walks() as f64;
        if all.iter().any(|of| is_rare(&of)) {
            return Err(Error::NoSetting);
        }
        let known = self.known.targets.iter().copied().map(Some);
        let known = known.chain(core::iter::repeat(None));
        let targets: Vec<(f64, f64)> = (all.iter().zip(&self.sample.weights).zip(known))
            .enumerate()
            .map(|(i, ((of, &weight), known))| {
                let found = of.preconditioned();
                let mut variance = found.std_dev.unwrap_or(f64::INFINITY).powi(2);
                // What these walks have missed, as another pilot tells: see `Observed::correct`.
                if let Some([estimate, error]) = known {
                    let missed = (found.estimate - estimate).abs() - SURE * error;
                    variance = variance.max(missed.max(0.0).powi(2) * of.walks() as f64 / MISSED);
                }
                let bound = self.aim.error(i, of, variance).powi(2);
                (weight, variance / bound)
            })
            .collect();
        let rate = (trial.length > 0).then(|| {
            let sum = |of: &[(f64, f64)]| {
                of.iter()
                    .map(|(weight, needed)| weight * needed)
                    .sum::<f64>()
            };
            let falls = sum(&trial.targets) / sum(&targets);
            1.0 + falls.ln() / (LONGER as f64).ln()
        });
        let mut next = Trial {
            length,
            targets,
            rate: rate.map(|rate| if rate.is_finite() { rate } else { 1.0 }),
            states: states / walks,
            ..trial.clone()
        };
        next.each = self.sequence_seconds(&next);
        Ok(next)
    }

    /// The prediction of a trial.
    fn drawn(&self, trial: &Trial<'m>) -> Drawn<'m> {
        let rate = trial.trusted_rate();
        let (batch, walks) = trial.best(&self.sequences.lengths, rate);
        let walking = walks * trial.each;
        let alone = |target: &(f64, f64)| {
            let of = Trial {
                targets: vec![(1.0, target.1)],
                ..trial.clone()
            };
            of.walks(batch, rate)
        };
        let most_walks = trial.targets.iter().map(alone).fold(0.0, f64::max);
        Drawn {
            prediction: Prediction {
                seconds_per_walk: trial.each,
                walking,
                careful: walking,
                most_walks,
                walks,
                states: walks * trial.states,
                ..trial.random
            },
            lifted: trial.lifted.as_ref().map(|(lifted, _)| lifted.clone()),
            forced_steps: trial.forced_steps,
            batch,
        }
    }
}
