//! One set of walks for all targets, by the global estimate, in place of walks of each.
//!
//! A few walks on the coarsest levels tell what the global estimate takes: pilots go on to finer cells while what is left of the
//! best prediction leaves time for a set-up, and together take at most [`SHARE`] of what separate walks are predicted to. If it
//! takes less than these, it is walked; and given up, for separate walks, if it turns out that it does not, or where scores on
//! polynomials leave a bias.

use fredholm_core::{Estimator, Real, Tolerance};
use fredholm_model::WholeValues;
use fredholm_model::cost::{Cost, PointwisePairs};

use super::Chosen;
use super::search::{LIFTED_PILOT, OF_SEQUENCE, PAYS, Quiet};
use super::setting::cells_to_choose;
use crate::answer::SolveObserver;
use crate::chosen::{ChoiceReport, WHOLE};
use crate::execute::CellCount;
use crate::whole::{Bound, GlobalEstimate, Look, Looks, Ready, Until, Whole};
use crate::{Error, Goal, Model, Pairs, Partitioned, Sequence, Settings, SolveError, WalkOptions};
use fredholm_core::StopReason;

/// The part of the time of separate walks that pilots may take: with a run that is given up at once they stay below a tenth.
const SHARE: f64 = 0.05;
/// The part of the best global estimate's time that a pilot on finer cells may take, once that is ahead of separate walks.
pub(super) const FINER: f64 = 0.25;
/// Walks of a pilot: 16 of each replicate.
pub(super) const PILOT: u64 = 1024;
/// Walks of a pilot that draws from a sequence, which gains with its length: 64 of each replicate. States without absorption, after which
/// on cubes hardly anything is left.
const LONG_PILOT: u64 = 4096;
const FORCED_STEPS: u32 = 4;
/// The part of the best global estimate's time that such a pilot may take.
const SEQUENCE_SHARE: f64 = 0.1;
/// The rate r of a variance of N^−r that longer replicates are trusted to have; that of pseudo-random walks is 1.
const TRUSTED_RATE: f64 = 1.25;
/// The mask of a pilot's seed: its walks differ from those of the answer.
const SEED: u64 = 0x6a6f_696e_7473;
/// A walk that scores in every state, over one that scores its start: 1.4 to 2.4 were measured.
const WALK: f64 = 2.0;
/// How many times as large as a pilot's the variance may be: those of 64 replicates are uncertain by 18 %.
const CAREFUL: f64 = 1.4;
/// Points at which error bars are looked at for the band.
const BAND_POINTS: f64 = 256.0;
/// Seconds of the band's resamples.
const BAND_SECONDS: f64 = 0.02;
/// Seconds of a product of an integral and a coefficient, and how many coefficients there are of each: 64 replicates, v, and
/// the highest degree.
const PRODUCT_SECONDS: f64 = 0.4e-9;
const ROWS: f64 = 66.0;
/// The most unknowns of a set-up that nobody asked for.
const UNKNOWNS: usize = 1 << 15;

/// A global estimate of some cells and a degree, of which a pilot tells what it takes.
pub(super) struct Joint<'m> {
    pub(super) settings: Settings,
    pub(super) ready: Ready<'m>,
    looks: Looks,
    pub(super) cells: CellCount,
    /// `None`: it is lifted, and there are no pairs to choose.
    pairs: Option<Pairs>,
    /// Seconds of the set-up, of a walk, and of what follows walks.
    pub(super) setup: f64,
    each: f64,
    values: f64,
    /// The number of walks, and of states.
    pub(super) walks: f64,
    pub(super) states: f64,
    /// The largest error bar after these walks, and the largest part of the highest degree of scores.
    pub(super) error: f64,
    pub(super) highest: f64,
    /// Whether scores leave a bias that error bars do not see.
    pub(super) is_biased: bool,
}

/// What a pilot tells.
struct PilotResult {
    /// States of a walk.
    states: f64,
    /// The number of walks until the error is reached, or the one that is given.
    walks: f64,
    look: Look,
}

/// What was looked at, and what that took.
#[derive(Default)]
pub(super) struct Looked<'m> {
    /// The best global estimate, if it is better than separate walks.
    pub(super) joint: Option<Joint<'m>>,
    /// Seconds that it is predicted to take, if there was a pilot.
    pub(super) seconds: Option<f64>,
    pilots: usize,
    walks: u64,
    lost: f64,
    /// Seconds of pilots that draw from a sequence.
    drawn: f64,
}

impl<'m> Joint<'m> {
    /// The settings with the absorption of its walks, in which nothing is open.
    pub(super) fn settled(&self) -> Settings {
        let absorption = self.ready.walk.absorption;
        Settings {
            absorption: absorption.probability(),
            estimator: Some(absorption.estimator()),
            ..self.settings.clone()
        }
    }

    /// Seconds from now on.
    pub(super) fn seconds(&self) -> f64 {
        self.walks * self.each + self.values
    }

    /// The function. `None`: walks were given up for separate ones, which take so many seconds, or it is not good enough.
    fn walk(
        self,
        model: &'m dyn Model,
        watch: &dyn SolveObserver,
        price: f64,
    ) -> Result<Option<GlobalEstimate<'m>>, SolveError> {
        let whole = Whole::new(model, &self.settings, watch);
        let until = Until {
            looks: self.looks,
            walks: super::ENDLESS,
            price: price / self.each,
        };
        let walked = whole.walk(&self.ready, &until)?;
        if walked.stop.is_none() {
            return Ok(None);
        }
        let function = whole.finished(self.ready, walked)?;
        let summary = function.summary();
        let is_good = summary.stop != StopReason::Done || summary.remarks().is_empty();
        Ok(is_good.then_some(function))
    }
}

impl<'m> Looked<'m> {
    /// What was looked at without a global estimate.
    pub(super) fn lost(self) -> Self {
        let setup = self.joint.as_ref().map_or(0.0, |joint| joint.setup);
        Self {
            joint: None,
            seconds: None,
            lost: self.lost + setup,
            ..self
        }
    }

    /// The settings and the report of the global estimate in place of those of separate walks, or of these with what was
    /// looked at besides.
    pub(super) fn chosen(&self, mut chosen: Chosen<'m>) -> Chosen<'m> {
        let report = &mut chosen.report;
        report.pilots += self.pilots;
        report.pilot_walks += self.walks;
        report.predicted_pilot_seconds += self.lost + self.drawn;
        report.predicted_whole_seconds = self.seconds;
        let Some(joint) = &self.joint else {
            return chosen;
        };
        let separate = report.predicted_setup_seconds + report.predicted_walk_seconds;
        chosen.report = ChoiceReport {
            method: WHOLE,
            predicted_setup_seconds: joint.setup,
            predicted_walk_seconds: joint.seconds(),
            predicted_walks: joint.walks,
            predicted_states: joint.states,
            predicted_separate_seconds: Some(separate),
            ..chosen.report
        };
        chosen.settings = joint.settled();
        chosen.settings.pairs = joint.pairs;
        chosen.plain = false;
        chosen.cells = joint.cells.clone();
        chosen
    }

    /// The global estimate, if it is predicted to take less than separate walks, does, and has no bias that its error bars do not
    /// see.
    pub(super) fn walk(
        self,
        question: &Question<'_, 'm>,
        price: f64,
    ) -> Result<Option<GlobalEstimate<'m>>, SolveError> {
        match self.joint {
            Some(joint) => joint.walk(question.model, question.watch, price),
            None => Ok(None),
        }
    }
}

/// What is asked, and of whom.
#[derive(Clone, Copy)]
pub(super) struct Question<'a, 'm> {
    pub(super) model: &'m dyn Model,
    pub(super) goals: &'a [Goal],
    pub(super) settings: &'a Settings,
    pub(super) watch: &'a dyn SolveObserver,
    /// The number of states of a walk, about.
    pub(super) states: f64,
}

impl<'m> Question<'_, 'm> {
    /// Whether the global estimate answers it, and nobody refuses that.
    pub(super) fn is_open(&self) -> bool {
        let settings = self.settings;
        let starts = self.goals.len() + self.model.besides(self.goals);
        starts > 1
            && self.model.about().whole == WholeValues::Points
            && settings.global != Some(false)
            && settings.walks.is_none()
            && settings.tolerance.is_some()
            && settings.last_step != Some(true)
    }

    /// Looks for a global estimate that takes less than separate walks, which would take so many seconds, after what an earlier look has
    /// lost.
    pub(super) fn look(
        &self,
        chosen: &Chosen<'m>,
        price: f64,
        before: Looked<'m>,
    ) -> Result<Looked<'m>, Error> {
        let mut looked = before.lost();
        let (true, Some(tolerance)) = (self.is_open(), self.settings.tolerance) else {
            return Ok(looked);
        };
        for cells in self.levels(chosen) {
            let best = looked.joint.as_ref().map_or(f64::INFINITY, Joint::seconds);
            let settings = self.on(cells, chosen);
            let Some(level) = self.level(&settings) else {
                break;
            };
            let setup = level.cost(self.pairs()).setup;
            let pilot = setup + self.pilot_seconds(&*level, &settings);
            let lost = looked.lost + pilot;
            let pays = lost + best < price && pilot < FINER * best;
            let is_long = pilot > FINER * best || setup > price;
            if is_long || lost > SHARE * price && !pays {
                break;
            }
            if self.watch.cancelled() {
                return Err(Error::Cancelled);
            }
            looked.lost = lost;
            // What values take is known when the system is solved.
            let may = if pays {
                FINER * best
            } else {
                SHARE * price - lost
            };
            match self.pilot(
                &*level,
                (settings, None),
                (Bound::Error(tolerance), may),
                &mut looked.lost,
            ) {
                // Walks have less noise than a pilot, and see a bias that it does not see.
                Ok(Some(joint)) if joint.is_biased => {}
                Ok(Some(mut joint)) => {
                    looked.pilots += 1;
                    looked.walks += PILOT;
                    let least = price.min(best);
                    let drawn =
                        self.draw(&*level, &mut joint, (tolerance, least), &mut looked.drawn);
                    // Whatever else refuses them, pseudo-random walks are still there.
                    if let Err(Error::Cancelled) = drawn {
                        return Err(Error::Cancelled);
                    }
                    if joint.seconds() < best {
                        looked.joint = Some(joint);
                    }
                }
                Ok(None) => {}
                Err(Error::Cancelled) => return Err(Error::Cancelled),
                // What it does not take is left to separate walks.
                Err(_) => break,
            }
        }
        self.try_lift(chosen, (tolerance, price), &mut looked)?;
        looked.seconds = looked.joint.as_ref().map(Joint::seconds);
        looked.joint = looked.joint.filter(|joint| joint.seconds() < price);
        if let Some(joint) = &looked.joint {
            looked.lost -= joint.setup;
        }
        Ok(looked)
    }

    /// Lifts global estimates of few cells, if pilots tell that what is left then takes less than half as long as the best so far and as
    /// separate walks. All these pilots together take a quarter of the best global estimate at most, or, where separate walks are ahead of
    /// it, a twentieth of theirs.
    fn try_lift(
        &self,
        chosen: &Chosen<'m>,
        (tolerance, price): (Tolerance, f64),
        looked: &mut Looked<'m>,
    ) -> Result<(), Error> {
        let degree = self.model.about().most_lift;
        let own = self.settings;
        let is_open = own.lift.is_none() && own.pairs.is_none();
        if !is_open || degree == 0 || own.sequence == Some(Sequence::Sobol) {
            return Ok(());
        }
        let mut spent = 0.0;
        for cells in self.levels(chosen) {
            let best = looked.joint.as_ref().map_or(f64::INFINITY, Joint::seconds);
            let least = best.min(price);
            let may = if best < price {
                FINER * best
            } else {
                SHARE * price
            };
            let settings = Settings {
                lift: Some(degree),
                ..self.on(cells, chosen)
            };
            let Some(level) = self.level(&settings) else {
                break;
            };
            let Some(cost) = level.lift_cost(degree) else {
                break;
            };
            let states = self.states;
            let pilot = cost.setup + LIFTED_PILOT as f64 * lifted_seconds(&cost, &settings, states);
            spent += pilot;
            if spent > may {
                break;
            }
            looked.lost += pilot;
            match self.pilot(
                &*level,
                (settings, Some(&cost)),
                (Bound::Error(tolerance), may),
                &mut looked.lost,
            ) {
                Ok(found) => {
                    looked.pilots += 1;
                    looked.walks += LIFTED_PILOT;
                    let pays =
                        |joint: &Joint<'_>| !joint.is_biased && PAYS * joint.seconds() < least;
                    if let Some(joint) = found.filter(pays) {
                        looked.joint = Some(joint);
                    }
                }
                Err(Error::Cancelled) => return Err(Error::Cancelled),
                Err(_) => break,
            }
        }
        Ok(())
    }

    pub(super) fn pairs(&self) -> Pairs {
        let given = self.settings.pairs;
        given.unwrap_or_else(|| self.model.about().whole_pairs)
    }

    /// The numbers of cells, from few to many.
    fn levels(&self, chosen: &Chosen<'m>) -> Vec<usize> {
        let cut = self.on(1, chosen).discretisation();
        cells_to_choose(self.model, &cut, self.settings.cells)
    }

    /// The cells of these settings, unless they are refused or too many.
    pub(super) fn level(&self, settings: &Settings) -> Option<Box<dyn Partitioned<'m> + 'm>> {
        let level = self.model.partition(&settings.discretisation()).ok()?;
        (level.unknowns() <= UNKNOWNS).then_some(level)
    }

    /// The settings with so many cells, and with the degree and the walks of the choice.
    fn on(&self, cells: usize, chosen: &Chosen<'m>) -> Settings {
        let most = self.model.about().most_degree.saturating_sub(1);
        let own = chosen.settings.discretisation().degree;
        let degree = if chosen.plain { 2 } else { own };
        Settings {
            cells: Some(cells),
            degree: self.settings.degree.or(Some(degree.min(most))),
            walks: Some(super::ENDLESS),
            ..self.settings.clone()
        }
    }

    /// Seconds of a pilot but for its set-up.
    pub(super) fn pilot_seconds(&self, level: &dyn Partitioned<'_>, settings: &Settings) -> f64 {
        let each = self.walk_seconds(level, settings, self.states);
        PILOT as f64 * each
    }

    pub(super) fn walk_seconds(
        &self,
        level: &dyn Partitioned<'_>,
        settings: &Settings,
        states: f64,
    ) -> f64 {
        let pointwise = level.pointwise_pairs(self.pairs()).unwrap_or_default();
        let cost = level.cost(self.pairs()).walk;
        let estimator = settings.absorption().estimator();
        let none = PointwisePairs::default();
        // Scores in every state are those of one walk.
        WALK * cost.seconds(estimator, states, none) - cost.seconds(estimator, states, none)
            + cost.seconds(estimator, states, pointwise)
    }

    /// What a few walks on these cells tell, of a lift with its cost. `None`: no walk scored.
    pub(super) fn pilot(
        &self,
        level: &dyn Partitioned<'m>,
        (settings, lift): (Settings, Option<&Cost>),
        (bound, may): (Bound, f64),
        lost: &mut f64,
    ) -> Result<Option<Joint<'m>>, Error> {
        let watch = Quiet(self.watch);
        let whole = Whole::new(self.model, &settings, &watch);
        let ready = whole.ready()?;
        let looks = self.looks();
        let [points, means] = looks.counts(self.model).map(|count| count as f64);
        let point = ready.system.point_seconds(ready.degree);
        let functions = ready.system.cells() * ready.system.degrees(ready.degree).len();
        let products = ROWS * PRODUCT_SECONDS * functions as f64;
        let mean = point * ready.system.mean_points(ready.degree);
        let values = (points + BAND_POINTS) * (point + products) + means * (mean + products);
        if values > may {
            return Err(Error::TooLong { seconds: values });
        }
        *lost += values;
        let seed = settings.seed ^ SEED;
        let random = WalkOptions {
            seed,
            walks: lift.map_or(PILOT, |_| LIFTED_PILOT),
            sequence: Sequence::Random,
            ..ready.walk
        };
        let (found, looks) = self.walked(&whole, &ready, &random, (looks, bound))?;
        let Some(PilotResult {
            states,
            walks,
            look,
        }) = found
        else {
            return Ok(None);
        };
        let (pairs, setup, each) = match lift {
            Some(cost) => (None, cost.setup, lifted_seconds(cost, &settings, states)),
            None => {
                let each = self.walk_seconds(level, &settings, states);
                let pairs = self.pairs();
                (Some(pairs), level.cost(pairs).setup, each)
            }
        };
        Ok(Some(Joint {
            cells: CellCount::of(level),
            pairs,
            setup,
            each,
            // Error bars are looked at two or three times, and values taken once.
            values: 3.0 * values + BAND_SECONDS,
            walks,
            states: walks * states,
            error: look.bound,
            highest: look.highest,
            is_biased: look.is_nearly_biased,
            settings,
            ready,
            looks,
        }))
    }

    /// Lets the walks draw from a sequence, if a pilot tells that this pays, or if nothing else is wanted. `lost`: what it takes.
    fn draw(
        &self,
        level: &dyn Partitioned<'_>,
        joint: &mut Joint<'m>,
        (tolerance, price): (Tolerance, f64),
        lost: &mut f64,
    ) -> Result<(), Error> {
        let wanted = self.settings.sequence;
        let forced_steps = self.settings.forced_steps.unwrap_or(FORCED_STEPS);
        let states = self.states + f64::from(forced_steps);
        let none = PointwisePairs::default();
        let pointwise = level.pointwise_pairs(self.pairs()).unwrap_or(none);
        let cost = level.cost(self.pairs()).walk;
        let score = cost.seconds(Estimator::Absorption, 1.0, pointwise) - cost.start;
        let states_seconds = cost.start + (states - 1.0) * cost.step;
        let each = OF_SEQUENCE * (states_seconds + (1.0 + f64::from(forced_steps)) * score);
        let pilot = joint.values / 3.0 + LONG_PILOT as f64 * each;
        let may = *lost + pilot < SHARE * price && pilot < SEQUENCE_SHARE * joint.seconds();
        let may = may || wanted == Some(Sequence::Sobol);
        if !self.model.about().has_sequences || wanted == Some(Sequence::Random) || !may {
            return Ok(());
        }
        let mut settings = joint.settings.clone();
        settings.sequence = Some(Sequence::Sobol);
        settings.forced_steps = Some(forced_steps);
        let watch = Quiet(self.watch);
        let whole = Whole::new(self.model, &settings, &watch);
        let walk = WalkOptions {
            sequence: Sequence::Sobol,
            forced_steps,
            ..joint.ready.walk
        };
        let pilot_walk = WalkOptions {
            seed: settings.seed ^ SEED,
            walks: LONG_PILOT,
            ..walk
        };
        *lost += pilot;
        let of = (self.looks(), Bound::Error(tolerance));
        let (found, _) = self.walked(&whole, &joint.ready, &pilot_walk, of)?;
        let Some(PilotResult { states, walks, .. }) =
            found.filter(|result| !result.look.is_nearly_biased)
        else {
            return Ok(());
        };
        let pays = walks * each < joint.walks * joint.each;
        if pays || wanted.is_some() {
            joint.settings = settings;
            joint.ready.walk = walk;
            joint.each = each;
            joint.walks = walks;
            joint.states = walks * states;
        }
        Ok(())
    }

    /// What error bars are looked at: those of the goals, or else of points all over the space.
    fn looks(&self) -> Looks {
        match self.goals {
            [] => Looks::of_points(self.model),
            goals => Looks::of_goals(goals),
        }
    }

    /// What these walks tell. `None`: none scored.
    fn walked(
        &self,
        whole: &Whole<'_, 'm>,
        ready: &Ready<'m>,
        walk: &WalkOptions,
        (looks, bound): (Looks, Bound),
    ) -> Result<(Option<PilotResult>, Looks), Error> {
        let (walked, looks) = whole.pilot(ready, walk, looks)?;
        if self.watch.cancelled() {
            return Err(Error::Cancelled);
        }
        let counts = walked.counts();
        let look = ready.look(walked, &looks, (self.model, bound))?;
        if counts.scored == 0 {
            return Ok((None, looks));
        }
        let walks = counts.walks as f64;
        let states = counts.states as f64 / walks;
        let times = CAREFUL * look.error * look.error;
        let times = match walk.sequence {
            Sequence::Random => times,
            Sequence::Sobol => Real::exp(Real::ln(times) / TRUSTED_RATE),
        };
        let result = PilotResult {
            states,
            walks: match bound {
                Bound::Error(_) => (walks * times).max(walk.batch as f64),
                Bound::Walks(given) => given as f64,
            },
            look,
        };
        Ok((Some(result), looks))
    }
}

/// Seconds of a walk of a lift that scores in every state.
fn lifted_seconds(cost: &Cost, settings: &Settings, states: f64) -> f64 {
    let estimator = settings.absorption().estimator();
    WALK * cost
        .walk
        .seconds(estimator, states, PointwisePairs::default())
}
