//! The search for the best setting: which pilot comes next, and the best prediction so far.
//!
//! A setting is worth a pilot if, with luck, it saves more than twice the pilot's time over the best so far. Candidates
//! are the coarsest cells of every family, and all settings that are predicted but by few walks. The one that may take least comes first. In the end the best has a pilot with more walks.

mod candidates;
mod hardest;
mod lift;
mod other_way;
mod prices;
mod sequence;

use std::sync::Arc;
use web_time::Instant;

use fredholm_core::{MIN_BATCHES, Statistics};
use fredholm_rayon::Observer;

use super::LONG_SECONDS;
use super::aim::{Aim, Given};
use super::family::{Family, Prediction};
use super::pilot::{Known, Pilot, Sample, Walked};
use super::setting::Setting;
use super::systems::Systems;
use crate::answer::{Answer, SolveObserver, Solved, Walks};
use crate::model::{Request, Wanted};
use crate::{Error, Model, Partitioned, Settings, WalkOptions};
use fredholm_model::memory::refuse_beyond_memory;
use fredholm_model::{About, Target};
use lift::Lifts;
pub(super) use lift::{LIFTED_PILOT, Lifted};
use other_way::OtherWay;
pub(super) use prices::{MOMENT, TIMES};
pub(super) use sequence::OF_SEQUENCE;
use sequence::Sequences;

/// Walks of a first pilot: it takes less than a hundredth of the least run of 16 batches.
const FIRST: u64 = 256;
/// Walks of the pilot of a setting that is about to be chosen: a thirtieth of the least run.
const CONFIRM: u64 = 2048;
/// The share of the best prediction that pilots may take, and of [`LONG_SECONDS`] at most: what would take hours is refused
/// soon, and what takes minutes is corrected by its walks. What would pay and is not tried for it costs more than that.
pub(super) const SHARE: f64 = 0.25;
/// How many times its own time a pilot must be able to save, and another setting to take over: about half of them save
/// nothing.
pub(super) const PAYS: f64 = 2.0;
/// The number of levels beyond a pilot that its variance is believed to tell of.
const LEVELS: usize = 4;
/// Seconds of pilots after which something other than separate walks is looked at, and a person does not notice.
const PAUSE_SECONDS: f64 = 0.5;
/// Seconds of a pilot that needs none before it.
const LEAST_SECONDS: f64 = 1e-3;
/// Seconds of a pilot apart from its walks and its set-up.
const PILOT_SECONDS: f64 = 0.1e-3;
/// The mask of a pilot's seed. Its walks differ from those of the answer, which it must not be able to prefer.
const SEED: u64 = 0x0070_696c_6f74;

/// The pilots so far, and what they predict.
pub(crate) struct Search<'m> {
    model: &'m dyn Model,
    about: About,
    settings: &'m Settings,
    aim: Aim,
    watch: &'m dyn SolveObserver,
    /// The number of states of a walk, about.
    states: f64,
    /// The constant absorption of walks that draw from a sequence: roulette makes jumps of what they score, all over the cube.
    of_sequences: Option<f64>,
    sample: Sample,
    families: Vec<Family>,
    known: Known,
    systems: Systems<'m>,
    sequences: Sequences<'m>,
    lifts: Lifts<'m>,
    /// Settings that the problem has refused.
    refused: Vec<Setting>,
    /// The first refusal of walks: it is reported if every setting is refused.
    refusal: Option<Error>,
    /// The first refusal of a setting that was not tried: it is reported if no walks are refused.
    unfit: Option<Error>,
    /// The most cells on which walks of a neighbour equation have no mean.
    no_mean: Option<usize>,
    /// Predicted seconds of all pilots and their set-ups.
    work: f64,
    /// Seconds that pilots may take in any case.
    granted: f64,
    /// Seconds that walks of the answer have left: what takes longer is no better. Infinite while nothing is walked.
    left: f64,
    /// Seconds of what answers in place of separate walks: those that take longer are no better. Infinite if nothing does.
    pub(super) rival: f64,
    /// The second way to the same answer.
    other_way: OtherWay,
    /// Predicted seconds of the answer's walks that were given up for other ones.
    pub(super) walked: f64,
    /// Whether another setting took over although the error is a part of what may be 0.
    pub(super) hoped: bool,
    /// Whether the watch was told that the choice takes long.
    warned: bool,
    /// When it began. Nothing but a report depends on it.
    pub(super) begun: Instant,
    pub(super) pilots: usize,
    pub(super) walks: u64,
}

impl<'m> Search<'m> {
    /// A search of what is open, if walks have a finite variance.
    ///
    /// # Errors
    /// [`Error::TwoGoals`], [`Error::InfiniteVariance`].
    pub(super) fn new(
        model: &'m dyn Model,
        targets: &[Target],
        settings: &'m Settings,
        walks: u64,
        watch: &'m dyn SolveObserver,
    ) -> Result<Self, Error> {
        let mut search = Self {
            model,
            about: model.about(),
            settings,
            aim: Aim::new(settings, walks),
            watch,
            states: f64::NAN,
            of_sequences: None,
            sample: Sample::new(model, targets, &[])?,
            families: Vec::new(),
            known: Known::default(),
            systems: Systems::default(),
            sequences: Sequences::new(model, settings),
            lifts: Lifts::new(model, settings),
            refused: Vec::new(),
            refusal: None,
            unfit: None,
            no_mean: None,
            work: 0.0,
            granted: 0.0,
            left: f64::INFINITY,
            rival: f64::INFINITY,
            other_way: OtherWay::default(),
            walked: 0.0,
            hoped: false,
            warned: false,
            begun: Instant::now(),
            pilots: 0,
            walks: 0,
        };
        search.look_at_variance()?;
        // Every solve looks at the variance, whether it chooses or not.
        search.begun = Instant::now();
        search.begin_families();
        let hardest = search.hardest(targets);
        search.sample = Sample::new(model, targets, &hardest)?;
        Ok(search)
    }

    /// Makes pilots until none may pay any more.
    pub(super) fn run(&mut self) {
        self.run_up_to(f64::INFINITY);
    }

    /// Makes pilots for a short time; the best setting of those that had some, if others may follow.
    pub(super) fn begin(&mut self) -> Option<Prediction> {
        self.run_up_to(PAUSE_SECONDS);
        self.best_tried().filter(|_| self.work >= PAUSE_SECONDS)
    }

    /// Makes pilots until none may pay any more, or they have taken so many seconds.
    fn run_up_to(&mut self, seconds: f64) {
        while self.work < seconds
            && !self.watch.cancelled()
            && let Some((next, walks)) = self.most_promising().or_else(|| self.unconfirmed())
        {
            let seconds = self.seconds_of(&next, walks);
            if !self.try_lift_before(seconds) && !self.try_sequence_beside() {
                self.try_out(&next, walks);
            }
        }
    }

    /// Learns from a pilot with so many walks of each target, or from its refusal.
    fn try_out(&mut self, next: &Prediction, walks: u64) {
        match self.pilot(next, walks) {
            Ok(pilot) => {
                self.pilots += 1;
                self.walks += pilot.walks;
                self.learn(pilot);
            }
            Err(Error::Cancelled) => {}
            Err(refusal) => self.forget(next.setting, refusal),
        }
    }

    /// Makes pilots of what may take less than this, which take so many seconds more at most, unless they pay in any case: first of the
    /// best setting that pilots know; then the best, if it is known by less than so many walks or seconds, has a pilot of as many. Of
    /// settings that few walks tell of the luckiest seem best.
    pub(super) fn run_for(&mut self, seconds: f64, walks: u64, left: f64) {
        self.granted = self.work + seconds;
        self.left = left;
        let known = self.best_tried();
        self.confirm(known, seconds, walks);
        self.run();
        while self.work < self.granted
            && !self.watch.cancelled()
            && let best = self.best()
            && self.confirm(best, seconds, walks)
        {}
        self.left = f64::INFINITY;
    }

    /// Makes a pilot of so many seconds or walks, if that is more than a setting has had, and if it takes less than is left.
    fn confirm(&mut self, found: Option<Prediction>, seconds: f64, walks: u64) -> bool {
        let found = found.filter(|found| {
            let enough = self.enough(found, seconds, walks);
            self.price(found) < self.left && found.pilot_walks < enough
        });
        if let Some(found) = found {
            self.try_out(&found, self.enough(&found, seconds, walks));
        }
        found.is_some()
    }

    /// The walks of a pilot that takes so many seconds, or has as many walks.
    pub(super) fn enough(&self, found: &Prediction, seconds: f64, walks: u64) -> u64 {
        let each = found.seconds_per_walk * self.sample.weights.len() as f64;
        walks.min((seconds / each) as u64)
    }

    /// The candidate that takes least, with luck, if that pays; and the walks of its pilot.
    fn most_promising(&self) -> Option<(Prediction, u64)> {
        let best = self.best();
        let price = best.map_or(f64::INFINITY, |best| self.least_price(&best));
        let price = price.min(self.left).min(self.rival);
        let may = best.map_or(f64::INFINITY, |best| self.allowance(&best, SHARE));
        let all = self.candidates(best.as_ref()).into_iter().map(|found| {
            let walks = match found.pilot_walks {
                0 => self.sample.walks(FIRST),
                _ => self.confirming(),
            };
            let step = self.step_to(&found, walks);
            let setup = self.remaining_setup(&step);
            // What is set up for the best is not lost.
            let is_for_best = best.is_some_and(|best| best.setting.shares_system(&step.setting));
            let is_kept = is_for_best && self.systems.of(&step.setting).is_none();
            let lost = self.seconds_of(&step, walks) - if is_kept { setup } else { 0.0 };
            let before = self.remaining_setup(&found) + PAYS * lost;
            let is_shown = || {
                let may = best.map_or(0.0, |best| self.allowance_of_shown(&best, &found));
                lost <= may && self.cost(&found, before, found.shown) < price
            };
            let may_be_lost = lost <= may || is_shown();
            let cost = self.cost(&found, before, found.hopeful);
            may_be_lost.then_some((step, walks, lost, cost))
        });
        let pay = all.flatten().filter(|&(.., cost)| cost < price);
        // What takes longer than all so far comes after everything else that may pay.
        let is_late = |(step, walks, ..): &(Prediction, u64, f64, f64)| !self.is_soon(step, *walks);
        let pay: Vec<_> = pay
            .map(|candidate| (is_late(&candidate), candidate))
            .collect();
        let least = pay
            .iter()
            .min_by(|(late, a), (other, b)| late.cmp(other).then(a.3.total_cmp(&b.3)));
        let &(_, (least, walks, _, cost)) = least?;
        // The very first is plain: every report tells what plain walks take.
        if least.is_known() || self.pilots == 0 {
            return Some((least, walks));
        }
        // Where nothing is known, of what may take alike the highest degree comes first: it leaves the least variance.
        let alike = pay
            .iter()
            .filter(|(_, (step, .., other_cost))| !step.is_known() && *other_cost <= PAYS * cost);
        let first = alike.max_by(|(_, a), (_, b)| {
            let degree = |of: &(Prediction, u64, f64, f64)| of.0.setting.degree;
            degree(a).cmp(&degree(b)).then(b.3.total_cmp(&a.3))
        });
        first.map(|&(_, (step, walks, ..))| (step, walks))
    }

    /// Whether a pilot takes no longer than all before it.
    fn is_soon(&self, found: &Prediction, walks: u64) -> bool {
        self.seconds_of(found, walks) <= self.work.max(LEAST_SECONDS)
    }

    /// The best setting, if few walks told of it, or the next one on the way to it.
    fn unconfirmed(&self) -> Option<(Prediction, u64)> {
        let best = self.best()?;
        let least = self.least_price(&best).min(self.left).min(self.rival);
        if least < self.price(&best) {
            // It is not what is walked.
            return None;
        }
        let confirm = self.confirming();
        let step = self.step_to(&best, confirm);
        let walks = if step.setting == best.setting {
            confirm
        } else {
            self.sample.walks(FIRST)
        };
        (best.pilot_walks < confirm).then_some((step, walks))
    }

    /// Walks of the pilot of a setting that is about to be chosen: no more than that of the least run takes of them, if fewer are given.
    pub(super) fn confirming(&self) -> u64 {
        let most = self
            .aim
            .walks()
            .map_or(CONFIRM, |walks| walks / MIN_BATCHES);
        self.sample.walks(most.clamp(FIRST, CONFIRM))
    }

    /// The setting whose pilot comes next if this one is wanted: itself if its pilot takes no longer than all before it, so that
    /// all pilots take at most twice as long as the last; or else one on fewer cells that is the next to be had so.
    fn step_to(&self, found: &Prediction, walks: u64) -> Prediction {
        let is_soon = |of: &Prediction| self.is_soon(of, walks);
        let family = self.family_of(&found.setting);
        let pilot = family.and_then(|family| family.pilot_for(&found.setting));
        let (Some(family), Some(pilot), false) = (family, pilot, is_soon(found)) else {
            return *found;
        };
        let between = pilot.setting.cells + 1..found.setting.cells;
        let is_between =
            |of: &&Prediction| between.contains(&of.setting.cells) && !self.refuses(&of.setting);
        let steps = || family.found.iter().filter(is_between);
        let finest = steps()
            .filter(|of| is_soon(of))
            .max_by_key(|of| of.setting.cells);
        let next = finest.or_else(|| steps().min_by_key(|of| of.setting.cells));
        *next.unwrap_or(found)
    }

    /// Seconds of a pilot with so many walks of each target.
    fn seconds_of(&self, found: &Prediction, walks: u64) -> f64 {
        let walks = walks as f64 * self.sample.weights.len() as f64;
        PILOT_SECONDS + self.remaining_setup(found) + walks * found.seconds_per_walk
    }

    /// Seconds that further pilots may take, if all may take this share of a prediction, or of what given walks may take; the first of a neighbour
    /// equation, without which plain walks have nothing to be compared with, all of that.
    fn allowance(&self, best: &Prediction, share: f64) -> f64 {
        let is_first = || self.families.iter().all(Family::is_plain_or_new);
        let most = match self.aim {
            Aim::Error(_) => share * self.least_price(best).min(self.rival).min(LONG_SECONDS),
            Aim::Walks(_) if is_first() => self.may_take().min(LONG_SECONDS),
            Aim::Walks(_) => share * self.may_take().min(LONG_SECONDS),
        };
        let all = most.min(share * self.time_limit());
        (all - self.lost(best)).max(self.granted - self.work)
    }

    /// Seconds that a pilot on the way to finer cells of the best setting may take of given walks, if those so far show that it pays: as many as
    /// this setting does, or a moment. If it was better indeed, its set-up is that of the answer.
    fn allowance_of_shown(&self, best: &Prediction, finer: &Prediction) -> f64 {
        match self.walking(best) {
            Some(walking) if best.setting.shares_family(&finer.setting) => {
                let most = (best.setup + walking).clamp(MOMENT, LONG_SECONDS);
                most.min(SHARE * self.time_limit()) - self.lost(best)
            }
            _ => 0.0,
        }
    }

    /// Seconds of all pilots so far but for the set-up that a prediction uses again.
    pub(super) fn lost(&self, best: &Prediction) -> f64 {
        self.work - (best.setup - self.remaining_setup(best))
    }

    fn time_limit(&self) -> f64 {
        let limit = self.settings.time_limit;
        limit.map_or(f64::INFINITY, |limit| limit.as_secs_f64())
    }

    /// The family of a setting.
    fn family_of(&self, setting: &Setting) -> Option<&Family> {
        let own = |family: &&Family| family.first.shares_family(setting);
        self.families.iter().find(own)
    }

    fn family(&mut self, setting: &Setting) -> Option<&mut Family> {
        let own = |family: &&mut Family| family.first.shares_family(setting);
        self.families.iter_mut().find(own)
    }

    /// Adds a pilot to its family, and corrects all others by what it tells of u.
    fn learn(&mut self, pilot: Pilot) {
        let setting = pilot.setting;
        if setting.plain && self.aim.walks().is_some() {
            // What is not known yet is compared with what is.
            self.families
                .iter_mut()
                .for_each(|family| family.expect(pilot.states));
        }
        if let Some(family) = self.family(&setting) {
            family.add(pilot);
        }
        for family in &mut self.families {
            family.correct(&self.known);
        }
        self.extend(&setting);
        self.compare_with_best();
    }

    /// If no error is asked for, compares all with what is left by the best setting that had a pilot.
    fn compare_with_best(&mut self) {
        let (Aim::Walks(given), Some(best)) = (&self.aim, self.best_tried()) else {
            return;
        };
        let family = self.family_of(&best.setting);
        let Some(pilot) = family.and_then(|family| family.pilot_for(&best.setting)) else {
            return;
        };
        let given = Given {
            errors: pilot.leaves(given),
            ..*given
        };
        self.families
            .iter_mut()
            .for_each(|family| family.ask(&given));
        self.aim = Aim::Walks(given);
    }

    /// Adds the levels to a setting's family that it may tell of.
    fn extend(&mut self, setting: &Setting) {
        // What given walks may take is an end.
        let has_end = self.aim.walks().is_some();
        let Some(family) = self.family(setting) else {
            return;
        };
        let mut levels = family.levels.iter();
        let number = levels.position(|level| level.cells == setting.cells);
        let wanted = match has_end {
            true => usize::MAX,
            false => 1 + LEVELS + number.unwrap_or(0),
        };
        if setting.plain || family.asked >= wanted {
            return;
        }
        let levels = self.levels(setting, wanted);
        if let Some(family) = self.family(setting) {
            family.extend(levels, wanted);
        }
    }

    fn partition(&self, setting: &Setting) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
        let cut = setting.applied(self.settings).discretisation();
        self.model.check(&cut, setting.pairs)?;
        let cells = self.model.partition(&cut)?;
        if !setting.plain {
            let needed = cells.memory(&self.sample.goals, setting.pairs);
            let what = || format!("{} unknowns", cells.unknowns());
            refuse_beyond_memory(what, needed, self.about.less_memory)?;
        }
        Ok(cells)
    }

    /// The number of walks of each target, if no error is asked for.
    pub(super) const fn walks_given(&self) -> Option<u64> {
        self.aim.walks()
    }

    /// The number of states of a walk, about.
    pub(super) const fn states(&self) -> f64 {
        self.states
    }

    /// The absorption of walks that draw from a sequence.
    pub(super) const fn absorption_of_sequences(&self) -> Option<f64> {
        self.of_sequences
    }

    /// The equation.
    pub(super) fn model(&self) -> &'m dyn Model {
        self.model
    }

    /// The solved system of a setting, unless its walks are plain.
    pub(super) fn solved(&mut self, setting: &Setting) -> Result<Option<Arc<Solved<'m>>>, Error> {
        if setting.plain {
            return Ok(None);
        }
        let cells = self.partition(setting)?;
        let solved = self.systems.solve(&*cells, setting, &self.sample.goals)?;
        Ok(Some(solved))
    }

    /// The solved system of a prediction that is to answer: a set-up that no pilot had counts among those of pilots.
    pub(super) fn solved_to_answer(
        &mut self,
        best: &Prediction,
    ) -> Result<Option<Arc<Solved<'m>>>, Error> {
        let left = self.remaining_setup(best);
        let solved = self.solved(&best.setting)?;
        self.work += left - self.remaining_setup(best);
        Ok(solved)
    }

    /// A pilot with so many walks of each target.
    fn pilot(&mut self, next: &Prediction, walks: u64) -> Result<Pilot, Error> {
        let setting = next.setting;
        let seconds = self.seconds_of(next, walks);
        self.warn_of(seconds);
        self.work += seconds;
        let mut settings = setting.applied(self.settings);
        // What is predicted are pseudo-random walks.
        settings.sequence = None;
        self.observed((setting, None), settings, walks)
    }

    /// What walks of each target, with these settings and a given system or that of the setting, tell.
    fn observed(
        &mut self,
        (setting, solved): (Setting, Option<&Arc<Solved<'m>>>),
        settings: Settings,
        walks: u64,
    ) -> Result<Pilot, Error> {
        let (answer, unknowns) = self.walked((&setting, solved), settings, walks)?;
        let all = answer.outcome.statistics.iter().chain(&answer.others);
        let all: Vec<&Statistics> = all.collect();
        self.known.learn(&all);
        let first_stage = (MIN_BATCHES * self.settings.batch()) as f64;
        let is_given = self.aim.walks().is_some();
        let reached = |(of, &floor): (&&Statistics, &f64)| {
            let deviation = of.preconditioned().std_dev.unwrap_or(0.0);
            let is_reached = is_given || deviation <= floor * first_stage.sqrt();
            if is_reached { floor } else { 0.0 }
        };
        let floors: Vec<f64> = all.iter().zip(&answer.floors).map(reached).collect();
        let walked = Walked {
            setting,
            statistics: all,
            weights: &self.sample.weights,
            floors: &floors,
            pointwise: answer.pointwise,
            unknowns,
        };
        Ok(Pilot::new(&walked, &self.aim, self.model))
    }

    /// Walks of each target by these settings, with a seed of their own, that follow a given system or that of the setting; and the number
    /// of unknowns.
    fn walked(
        &mut self,
        (setting, solved): (&Setting, Option<&Arc<Solved<'m>>>),
        mut settings: Settings,
        walks: u64,
    ) -> Result<(Answer, f64), Error> {
        let cells = self.partition(setting)?;
        let solved = match solved {
            Some(solved) => Some(Arc::clone(solved)),
            None => self.solved(setting)?,
        };
        settings.seed ^= SEED;
        let walk = WalkOptions {
            walks,
            tolerance: None,
            time_limit: None,
            ..settings.walk_options()
        };
        let walks = Walks {
            model: self.model,
            scalar: self.settings.scalar,
            execution: None,
        };
        let request = Request {
            goals: &self.sample.goals,
            walk: &walk,
            wanted: Wanted::All,
        };
        let watch = Quiet(self.watch);
        let answer = match &solved {
            None => walks.plain(&*cells, &request, &watch)?,
            Some(solved) => solved.walk(&walks, &request, &watch)?,
        };
        if self.watch.cancelled() {
            return Err(Error::Cancelled);
        }
        Ok((answer, cells.unknowns() as f64))
    }

    /// Learns from walks of the answer, which are those of all targets; the prediction then.
    pub(super) fn correct(
        &mut self,
        setting: &Setting,
        statistics: &[Statistics],
    ) -> Option<Prediction> {
        let family = self.family(setting)?;
        let level = *family.level(setting.cells)?;
        let pilot = family.pilot_for(setting)?;
        let walked = Walked {
            setting: *setting,
            statistics: statistics.iter().collect(),
            weights: &[],
            floors: &[],
            pointwise: pilot.pairs(level.unknowns),
            unknowns: level.unknowns,
        };
        let pilot = Pilot::new(&walked, &self.aim, self.model);
        let of = self.sample.of(statistics);
        if !of.is_empty() {
            let few = Pilot::new(
                &Walked {
                    statistics: of.clone(),
                    weights: &self.sample.weights,
                    ..walked
                },
                &self.aim,
                self.model,
            );
            self.known.left_out = (pilot.needed() / few.needed() - 1.0).max(0.0);
        }
        self.known.learn(&of);
        self.learn(pilot);
        self.found()
            .find(|found| found.setting == *setting)
            .copied()
    }

    /// Says once that the choice takes long, before what would make it so: so many more seconds.
    fn warn_of(&mut self, seconds: f64) {
        if !self.warned && self.work + seconds > LONG_SECONDS {
            self.warned = true;
            self.watch.choosing(seconds);
        }
    }

    /// Forgets a setting that the problem refuses with this error, and every one for which the refusal holds as well. On
    /// more cells h may be close enough to k.
    pub(super) fn forget(&mut self, setting: Setting, refusal: Error) {
        self.refused.push(setting);
        if matches!(refusal, Error::NoMean) {
            self.no_mean = self.no_mean.max(Some(setting.cells));
        }
        self.refusal.get_or_insert(refusal);
        self.extend(&setting);
    }

    /// The error to report if every setting is refused.
    pub(super) fn take_refusal(&mut self) -> Option<Error> {
        self.refusal.take().or_else(|| self.unfit.take())
    }

    /// Whether walks have no mean, as the neighbour equation tells that was tried on the most cells.
    pub(super) fn has_no_mean(&self) -> bool {
        let pilots = self.families.iter().flat_map(|family| &family.pilots);
        let neighbours = pilots.filter(|pilot| !pilot.setting.plain);
        let most = neighbours.map(|pilot| pilot.setting.cells).max();
        self.no_mean.is_some_and(|cells| Some(cells) >= most)
    }

    /// Whether the problem is known to refuse a setting.
    fn refuses(&self, setting: &Setting) -> bool {
        let mut refused = self.refused.iter();
        refused.any(|refused| setting.is_refused_with(refused))
    }

    /// All predictions so far of what is not refused.
    fn found(&self) -> impl Iterator<Item = &Prediction> {
        let all = self.families.iter().flat_map(|family| &family.found);
        all.filter(|found| !self.refuses(&found.setting))
    }
}

/// A watch that observes nothing of pilots, and may end them.
pub(super) struct Quiet<'a>(pub(super) &'a dyn SolveObserver);

impl Observer for Quiet<'_> {
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

impl SolveObserver for Quiet<'_> {}
