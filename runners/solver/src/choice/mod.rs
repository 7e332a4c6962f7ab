//! The best division of work between the set-up and the walks.
//!
//! A finer Galerkin solution takes longer and leaves less to the walks. If a tolerance is given, the choice is the setting that minimises, among
//! all that are left open,
//!
//! ```text
//! set-up(n) + Σ Var(n)/E² · seconds of a walk
//! ```
//!
//! over the targets. Pilots tell the variances and the length of walks: some hundred walks each, on few cells. The
//! variance on more cells follows its observed order. If the walks of the answer show that this was wrong, the choice is
//! made again with what they tell. Seconds come from constants ([`Cost`](fredholm_model::cost::Cost)) and from what was
//! counted, and never from a clock: the same input has the same bits on every machine.
//!
//! If no error is given, the choice is the setting that minimises
//!
//! ```text
//! Var(n) · (set-up(n) + seconds of the walks that are given)
//! ```
//!
//! among those that take no more than a few times as long as plain walks, or a moment.
//!
//! - `aim`: the errors by which settings are compared. `setting`: what may be chosen. `pilot`: few walks of one setting. `systems`: what they solved.
//! - `family`: what pilots on few cells predict of more.
//! - `search`: which pilot comes next, and the best prediction.
//! - `joint`: one set of walks for all targets, where that takes less. `global`: the cells and the degree of such walks, where they are asked for.
//! - `course`: whether the answer's walks go as predicted.
//! - `ways`: walks from the targets, or the way back from the sources.

mod aim;
mod course;
mod family;
mod global;
mod joint;
mod pilot;
mod search;
mod setting;
mod systems;
mod ways;

use std::sync::Arc;

use fredholm_core::StopReason;

pub use crate::chosen::ChoiceReport;
use crate::chosen::WHOLE;

use crate::answer::{Answer, Gave, SolveObserver, Solved};
use crate::execute::{CellCount, Execute, Execution};
use crate::whole::GlobalEstimate;
use crate::{Error, Goal, Method, Model, Sequence, Settings, SolveError};
use fredholm_model::{Request, Wanted};
use fredholm_model::{Target, goals};

use course::{Course, End};
use family::Prediction;
use joint::{Looked, Question};
use search::{Lifted, Search};

/// The most walks of a goal if only its error ends them.
pub(crate) const ENDLESS: u64 = u64::MAX >> 1;
/// Seconds that are not begun without a word: a person waits no longer.
pub const LONG_SECONDS: f64 = 10.0;
pub use fredholm_model::MOST_SECONDS;
pub(crate) use global::choose_global;
pub(crate) use setting::cells_to_choose;
pub(crate) use ways::solve_by_faster;

/// What walks found.
pub(crate) enum Found<'m> {
    /// Separate walks of every goal.
    Separate(Answer),
    /// One set of walks for all goals.
    Whole(GlobalEstimate<'m>),
    /// Nothing yet, as the other way takes less. It has the pilots of this one.
    OtherWay(Box<Search<'m>>),
}

/// Settings in which nothing is open, and how they were chosen.
#[derive(Clone, Debug)]
pub struct Chosen<'m> {
    /// The settings.
    pub settings: Settings,
    /// Whether walks follow no neighbour equation.
    pub plain: bool,
    /// The solved system of a pilot, if there is one.
    pub solved: Option<Arc<Solved<'m>>>,
    /// The cells.
    pub cells: CellCount,
    /// The report of the choice.
    pub report: ChoiceReport,
}

impl Chosen<'_> {
    /// Whether one set of walks answers all targets.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.report.method == WHOLE
    }
}

/// Chooses what the settings leave open: for the error that is asked for, or else for the walks that are given. `None`: nothing is chosen by
/// pilots, as nothing is open, or as walks of resolvents, a lift or the paper's method are asked for.
///
/// # Errors
/// [`Error`]: nothing can be chosen. [`Error::Cancelled`].
pub fn choose<'m>(
    model: &'m dyn Model,
    targets: &[Target],
    settings: &'m Settings,
    watch: &'m dyn SolveObserver,
) -> Result<Option<Chosen<'m>>, Error> {
    choose_with(model, targets, settings, watch, None)
}

/// Chooses as [`choose`] does, with a solved system on the cells and of the degree that the settings name.
pub(crate) fn choose_with<'m>(
    model: &'m dyn Model,
    targets: &[Target],
    settings: &'m Settings,
    watch: &'m dyn SolveObserver,
    kept: Option<Solved<'m>>,
) -> Result<Option<Chosen<'m>>, Error> {
    if settings.global == Some(true) {
        let found = choose_global(model, settings, watch)?;
        return Ok(found.map(|(chosen, _)| chosen));
    }
    let own = settings.walk_options().walks;
    let Some(mut search) = begin(model, targets, settings, (own, watch))? else {
        return Ok(None);
    };
    if let Some(kept) = kept {
        search.keep(kept);
    }
    let goals = goals(model, targets)?;
    let question = Question {
        model,
        goals: &goals,
        settings,
        watch,
        states: search.states(),
    };
    let (lost, joint) = look_early(&mut search, &question)?;
    if let Some(chosen) = joint {
        return Ok(Some(lost.chosen(chosen)));
    }
    let Next { chosen, best, .. } = next(&mut search, settings, watch)?;
    let looked = question.look(&chosen, search.price(&best), lost)?;
    Ok(Some(looked.chosen(chosen)))
}

/// Chooses what the settings leave open, as [`choose`] does, and walks for every target: the number of walks that the settings say, or until the
/// tolerance is reached. Where walks show that few walks were wrong by far, what is open is chosen again with what is known then. They end
/// without the tolerance where rounding leaves more, where walks tell of ever more walks,
/// or where more than an hour is left, unless the settings have a number of walks or a time limit
/// ([`Answer::gave_up`]).
///
/// # Errors
/// [`Error`]: nothing can be chosen, or walks fail. [`Error::Cancelled`].
pub fn solve<'m>(
    model: &'m dyn Model,
    targets: &[Target],
    goals: &[Goal],
    settings: &'m Settings,
    by: (&'m dyn SolveObserver, &dyn Execute),
) -> Result<Option<(Chosen<'m>, Answer)>, Error> {
    match solve_either(model, targets, goals, settings, by, (None, false)) {
        Ok(Some((chosen, Found::Separate(answer)))) => Ok(Some((chosen, answer))),
        Ok(Some(_)) => Err(Error::Internal("an answer that nobody wants")),
        Ok(None) => Ok(None),
        Err(SolveError::Failed(error)) => Err(error),
        Err(_) => Err(Error::Cancelled),
    }
}

/// Solves as [`solve`] does, or with one set of walks for all targets where that is predicted to take less.
///
/// # Errors
/// As [`solve`].
pub(crate) fn solve_either<'m>(
    model: &'m dyn Model,
    targets: &[Target],
    goals: &[Goal],
    settings: &'m Settings,
    (watch, execute): (&'m dyn SolveObserver, &dyn Execute),
    (begun, mut may_be_joint): (Option<Search<'m>>, bool),
) -> Result<Option<(Chosen<'m>, Found<'m>)>, SolveError> {
    let search = match begun {
        Some(search) => Some(search),
        None => begin(
            model,
            targets,
            settings,
            (chosen_for(settings, execute), watch),
        )?,
    };
    let Some(mut search) = search else {
        return Ok(None);
    };
    let question = Question {
        model,
        goals,
        settings,
        watch,
        states: search.states(),
    };
    // Seconds that a global estimate was predicted to take which was given up.
    let mut given_up: Option<f64> = None;
    let mut lost = Looked::default();
    if !may_be_joint {
        search.run();
    } else {
        match look_early(&mut search, &question)? {
            (looked, Some(chosen)) => {
                let joint = looked.chosen(chosen);
                watch.chosen(&joint.settings, &joint.report);
                let price = joint.report.predicted_separate_seconds;
                given_up = looked.seconds;
                if let Some(function) = looked.walk(&question, price.unwrap_or(f64::INFINITY))? {
                    return Ok(Some((joint, Found::Whole(function))));
                }
                may_be_joint = false;
                // What it was better than may be best now.
                search.forget_rival();
                search.run();
            }
            (looked, None) => lost = looked,
        }
    }
    // The walks that were given up last, if there are some: they are the result if nothing follows.
    let mut last: Option<(Chosen<'m>, Answer)> = None;
    loop {
        let found = next(&mut search, settings, watch);
        search.forget_sequences();
        search.forget_lifts();
        let Next {
            mut chosen,
            best,
            otherwise,
        } = match (found, last.take()) {
            (Err(why), Some(last)) => {
                let (chosen, answer) = ended(last, why)?;
                return Ok(Some((chosen, Found::Separate(answer))));
            }
            (next, _) => next?,
        };
        if core::mem::take(&mut may_be_joint) {
            let price = search.price(&best);
            let looked = question.look(&chosen, price, core::mem::take(&mut lost))?;
            if looked.joint.is_some() {
                let joint = looked.chosen(chosen.clone());
                given_up = looked.seconds;
                watch.chosen(&joint.settings, &joint.report);
                if let Some(function) = looked.walk(&question, price)? {
                    return Ok(Some((joint, Found::Whole(function))));
                }
            } else {
                chosen = looked.chosen(chosen);
            }
        }
        if given_up.is_some() {
            chosen.report.predicted_whole_seconds = given_up;
            chosen.report.whole_given_up = true;
        }
        watch.chosen(&chosen.settings, &chosen.report);
        let walk = chosen.settings.walk_options();
        let request = Request {
            goals,
            walk: &walk,
            wanted: match settings.sensitivities {
                true => Wanted::Derivatives,
                false => Wanted::All,
            },
        };
        let execution = Execution {
            execute,
            settings: &chosen.settings,
            plain: chosen.plain,
            cells: &chosen.cells,
            choice: Some(&chosen.report),
        };
        let walks = execution.walks(model);
        let mut course = Course::new(&mut search, best, settings, watch);
        course.otherwise = otherwise;
        let answered = match &chosen.solved {
            Some(solved) => solved.walk(&walks, &request, &course),
            None => {
                let cells = model.partition(&chosen.settings.discretisation())?;
                walks.plain(&*cells, &request, &course)
            }
        };
        let end = course.end();
        let mut answer = match answered {
            // The neighbour equation's own variance is known now.
            Err(refusal @ Error::InfiniteVariance { .. }) => {
                search.forget(best.setting, refusal);
                search.run();
                continue;
            }
            answered => answered?,
        };
        match end {
            Some(End::Other) if !watch.cancelled() => {
                if otherwise.is_some() {
                    // It ended when these seemed to be better.
                    search.run();
                }
                last = Some((chosen, answer));
                continue;
            }
            Some(End::OtherWay) if !watch.cancelled() => {
                return Ok(Some((chosen, Found::OtherWay(Box::new(search)))));
            }
            Some(End::Gave(why)) => {
                answer.outcome.stop = StopReason::ToleranceNotReached;
                answer.gave_up = Some(why);
            }
            _ => {}
        }
        // Looks at the walks have taken pilots, too.
        chosen.report.predicted_pilot_seconds = search.chosen_in(&best);
        return Ok(Some((chosen, Found::Separate(answer))));
    }
}

/// The walks that were given up last, if the choice has ended since for this reason.
fn ended<'m>(
    (chosen, mut answer): (Chosen<'m>, Answer),
    why: Error,
) -> Result<(Chosen<'m>, Answer), Error> {
    answer.outcome.stop = match why {
        Error::Cancelled => StopReason::Cancelled,
        Error::TooLong { seconds } => {
            answer.gave_up = Some(Gave::TooLong { seconds });
            StopReason::ToleranceNotReached
        }
        why => return Err(why),
    };
    Ok((chosen, answer))
}

/// The number of walks for which is chosen, if no error is asked for: that of walks which these go on with.
fn chosen_for(settings: &Settings, execute: &dyn Execute) -> u64 {
    let own = settings.walk_options().walks;
    execute.goes_on_with().unwrap_or(own)
}

/// The search, if something is to be chosen: of so many walks of each target, if no error is asked for.
fn begin<'m>(
    model: &'m dyn Model,
    targets: &[Target],
    settings: &'m Settings,
    (walks, watch): (u64, &'m dyn SolveObserver),
) -> Result<Option<Search<'m>>, Error> {
    if settings.method == Some(Method::Resolvent) {
        // These choose without pilots.
        return Ok(None);
    }
    if settings.method == Some(Method::Paper) && settings.tolerance.is_none() {
        // The paper says what is open.
        return Ok(None);
    }
    if settings.lift.is_some_and(|lift| lift > 0) {
        // Predictions know nothing of it.
        return Ok(None);
    }
    let search = Search::new(model, targets, settings, walks, watch)?;
    // Without an error there may be nothing to choose.
    let is_open = settings.tolerance.is_some() || search.is_open();
    Ok(is_open.then_some(search))
}

/// Looks for one set of walks for all targets before pilots of separate walks take long: they are told what these have to be
/// better than. What was looked at, and what pilots tell of separate walks if it takes less than any of them may that pilots can
/// find; otherwise all pilots of separate walks are made.
fn look_early<'m>(
    search: &mut Search<'m>,
    question: &Question<'_, 'm>,
) -> Result<(Looked<'m>, Option<Chosen<'m>>), Error> {
    let mut lost = Looked::default();
    if question.is_open()
        && let Some(best) = search.begin()
        && let Ok(chosen) = accepted(search, question.settings, &best)
    {
        let price = search.price(&best).min(LONG_SECONDS);
        let looked = question.look(&chosen, price, lost)?;
        let Some(seconds) = looked.seconds.filter(|_| looked.joint.is_some()) else {
            search.run();
            return Ok((looked, None));
        };
        search.rival = search.rival.min(seconds);
        search.run();
        if search
            .best()
            .is_none_or(|best| seconds < search.price(&best))
        {
            let mut chosen = chosen;
            // What no pilot had may take less, but perhaps does not.
            chosen.report = report(search, &search.best_tried().unwrap_or(best), 0.0);
            return Ok((looked, Some(chosen)));
        }
        search.forget_rival();
        lost = looked.lost();
    }
    search.run();
    Ok((lost, None))
}

/// What is walked next.
struct Next<'m> {
    chosen: Chosen<'m>,
    best: Prediction,
    /// If walks draw from a sequence or follow a lift, seconds of pseudo-random walks without in their place.
    otherwise: Option<f64>,
}

/// The best setting that the problem takes, and its prediction.
fn next<'m>(
    search: &mut Search<'m>,
    settings: &'m Settings,
    watch: &'m dyn SolveObserver,
) -> Result<Next<'m>, Error> {
    loop {
        if watch.cancelled() {
            return Err(Error::Cancelled);
        }
        let Some(best) = search.best() else {
            return Err(search.take_refusal().unwrap_or(Error::NoSetting));
        };
        if search.has_no_mean() {
            return Err(Error::NoMean);
        }
        let next = |chosen, best, otherwise| {
            Ok(Next {
                chosen,
                best,
                otherwise,
            })
        };
        if let Some(drawn) = search.sequence(&best)
            && let Ok(mut chosen) = accepted(search, settings, &drawn.prediction)
        {
            refuse_without_end(settings, &drawn.prediction)?;
            chosen.settings.sequence = Some(Sequence::Sobol);
            chosen.settings.absorption = search.absorption_of_sequences();
            chosen.settings.forced_steps = Some(drawn.forced_steps);
            chosen.settings.batch = Some(drawn.batch);
            if let Some(lifted) = drawn.lifted {
                follow(&mut chosen, lifted);
            }
            return next(chosen, drawn.prediction, Some(search.price(&best)));
        }
        if let Some(lifted) = search.lift(search.price(&best))
            && let Ok(mut chosen) = accepted(search, settings, &lifted.prediction)
        {
            let prediction = lifted.prediction;
            refuse_without_end(settings, &prediction)?;
            follow(&mut chosen, lifted);
            return next(chosen, prediction, Some(search.price(&best)));
        }
        refuse_without_end(settings, &best)?;
        match accepted(search, settings, &best) {
            Ok(chosen) => return next(chosen, best, None),
            Err(refusal) => search.forget(best.setting, refusal),
        }
        search.run();
    }
}

/// Lets the walks of a choice follow a lift.
fn follow<'m>(chosen: &mut Chosen<'m>, lifted: Lifted<'m>) {
    lifted.apply(&mut chosen.settings);
    chosen.report.pilot_seconds -= lifted.solved.seconds;
    chosen.solved = Some(lifted.solved);
}

/// Refuses walks until an error is reached if no walk may ever score, or if that takes too long.
fn refuse_without_end(settings: &Settings, best: &Prediction) -> Result<(), Error> {
    let seconds = best.seconds();
    let has_end = settings.walks.is_some() || settings.tolerance.is_none();
    if has_end || settings.time_limit.is_some() || seconds <= MOST_SECONDS {
        Ok(())
    } else if best.scored > 0 {
        Err(Error::TooLong { seconds })
    } else {
        Err(Error::Dark)
    }
}

/// The choice of a search, if its variance is finite.
fn accepted<'m>(
    search: &mut Search<'m>,
    settings: &Settings,
    best: &Prediction,
) -> Result<Chosen<'m>, Error> {
    let setting = &best.setting;
    let mut chosen = setting.applied(settings);
    // Until the error is reached.
    let most = chosen.tolerance.map(|_| ENDLESS);
    chosen.walks = chosen.walks.or(most);
    let solved = search.solved_to_answer(best)?;
    if let Some(solved) = solved.as_ref().filter(|_| !chosen.allow_infinite_variance) {
        solved.system.check_variance(&chosen.walk_options())?;
    }
    let kept = solved.as_ref().map_or(0.0, |solved| solved.seconds);
    let cells = search.model().partition(&chosen.discretisation())?;
    Ok(Chosen {
        cells: CellCount::of(&*cells),
        settings: chosen,
        plain: setting.plain,
        solved,
        report: report(search, best, kept),
    })
}

/// What is told of the best setting, whose set-up has taken so many seconds that are no pilot's.
fn report(search: &Search<'_>, best: &Prediction, kept: f64) -> ChoiceReport {
    let plain = search.best_plain().as_ref().map(Prediction::seconds);
    // Pilots count the walks of every functional.
    let shared = search.model().shared() as f64;
    let (pilots, pilot_walks) = search.all_pilots();
    let given = search.walks_given();
    let walks = given.map_or(best.walks, |walks| walks as f64 * best.targets);
    // Where there is no variance, no walk is needed.
    let states = match best.walks > 0.0 {
        true => best.states / best.walks,
        false => search.states(),
    };
    ChoiceReport {
        method: best.setting.method(),
        walks: given,
        predicted_setup_seconds: best.setup,
        predicted_walk_seconds: given.map_or(best.walking, |_| walks * best.seconds_per_walk),
        predicted_walks: walks / shared,
        predicted_states: walks * states / shared,
        predicted_plain_seconds: plain.filter(|seconds| seconds.is_finite()),
        predicted_separate_seconds: None,
        predicted_whole_seconds: None,
        whole_given_up: false,
        pilots,
        pilot_walks,
        predicted_pilot_seconds: search.chosen_in(best),
        pilot_seconds: search.begun.elapsed().as_secs_f64() - kept,
    }
}
