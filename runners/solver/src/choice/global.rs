//! The cells and the degree of a global estimate that is asked for.
//!
//! Pilots of every degree begin on the coarsest cells. Next comes the degree whose last pilot was best, on finer cells, until these do not pay.
//! Pilots of the best degree take at most as long as an estimate may, and others a quarter of that. Only what had a pilot is chosen.

use fredholm_model::WholeValues;
use web_time::Instant;

use super::joint::{FINER, Joint, PILOT, Question};
use super::search::{MOMENT, TIMES};
use super::setting::cells_to_choose;
use super::{Chosen, ENDLESS, LONG_SECONDS, MOST_SECONDS};
use crate::answer::SolveObserver;
use crate::chosen::{ChoiceReport, WHOLE};
use crate::whole::{Bound, Ready};
use crate::{Error, Model, Settings};

/// States of a walk before a pilot tells.
const STATES: f64 = 4.0;
/// The part of an error bar that the highest degree of scores may be worth, half of what is warned of: then it counts as much as the error bar.
const UNSEEN: f64 = 0.25;

/// A degree, and the cells on which it had no pilot, from few to many.
struct Degree {
    degree: usize,
    levels: std::vec::IntoIter<usize>,
    /// The price of its last pilot; infinite before one, or where that was of no use.
    price: f64,
    /// What the highest degree of scores was worth there, in which number of cells.
    lost: [f64; 2],
}

/// The best estimate so far.
struct Best<'m> {
    degree: usize,
    /// Whether scores may leave a bias that error bars do not see.
    is_biased: bool,
    price: f64,
    joint: Joint<'m>,
}

/// What pilots have found.
#[derive(Default)]
struct Trials<'m> {
    best: Option<Best<'m>>,
    pilots: usize,
    /// Seconds of all pilots.
    spent: f64,
    /// Seconds of the estimate that had the first pilot.
    first: Option<f64>,
}

/// Chooses the cells and the degree of a global estimate that is asked for, where they are open, and sets it up. Until an error is reached it is to
/// take the least time; of given walks, variance × time is to be least. Walks have no other end than an error that is asked for, if that is predicted
/// to be reached within the hour. `None`: nothing is open, or no pilot is of use.
///
/// # Errors
/// [`Error::Cancelled`].
pub(crate) fn choose_global<'m>(
    model: &'m dyn Model,
    settings: &Settings,
    watch: &dyn SolveObserver,
) -> Result<Option<(Chosen<'m>, Ready<'m>)>, Error> {
    // Until an error is reached there is no end of walks but by what is predicted.
    let is_endless = settings.tolerance.is_some() && settings.walks.is_none();
    let has_degrees = settings.degree.is_none() && model.about().most_degree > 0;
    let is_open = settings.cells.is_none() || has_degrees || is_endless;
    let has_cells = model.about().whole != WholeValues::None && model.channels().is_empty();
    if !is_open || !has_cells || settings.lifted().is_some() {
        return Ok(None);
    }
    let start = Instant::now();
    let question = Question {
        model,
        goals: &[],
        settings,
        watch,
        states: STATES,
    };
    let walks = settings.walk_options().walks;
    let bound = settings.tolerance.map_or(Bound::Walks(walks), Bound::Error);
    let mut trials = Trials::default();
    let mut degrees = degrees(model, settings);
    while let Some(next) = next(&mut degrees) {
        if watch.cancelled() {
            return Err(Error::Cancelled);
        }
        let Some(cells) = next.levels.next() else {
            continue;
        };
        match trials.price(&question, (cells, next), bound)? {
            Some(price) if price <= next.price => next.price = price,
            // Finer cells do not pay, or take too long.
            _ => next.levels = Vec::new().into_iter(),
        }
    }
    let (pilots, spent) = (trials.pilots, trials.spent);
    Ok(trials.best.map(|Best { joint, .. }| {
        let report = ChoiceReport {
            method: WHOLE,
            walks: settings.tolerance.is_none().then_some(walks),
            predicted_setup_seconds: joint.setup,
            predicted_walk_seconds: joint.seconds(),
            predicted_walks: joint.walks,
            predicted_states: joint.states,
            predicted_plain_seconds: None,
            predicted_separate_seconds: None,
            predicted_whole_seconds: None,
            whole_given_up: false,
            pilots,
            pilot_walks: PILOT * pilots as u64,
            predicted_pilot_seconds: spent - joint.setup,
            pilot_seconds: start.elapsed().as_secs_f64(),
        };
        let ends = joint.setup + joint.seconds() <= MOST_SECONDS || settings.time_limit.is_some();
        let chosen = Chosen {
            settings: Settings {
                walks: match is_endless && ends {
                    true => Some(ENDLESS),
                    false => settings.walks,
                },
                ..joint.settled()
            },
            plain: false,
            solved: None,
            cells: joint.cells,
            report,
        };
        (chosen, joint.ready)
    }))
}

/// The degrees that may be chosen: below the highest, of which walks score.
fn degrees(model: &dyn Model, settings: &Settings) -> Vec<Degree> {
    let most = model.about().most_degree;
    let all = match settings.degree {
        Some(degree) => degree..=degree,
        None => 0..=most,
    };
    let of = |degree| {
        let own = Settings {
            degree: Some(degree),
            ..settings.clone()
        };
        let levels = cells_to_choose(model, &own.discretisation(), settings.cells);
        Degree {
            degree,
            levels: levels.into_iter(),
            price: f64::INFINITY,
            lost: [0.0, 1.0],
        }
    };
    all.map(of).collect()
}

/// The degree that has the next pilot: one that had none, or the best of those with finer cells.
fn next(degrees: &mut [Degree]) -> Option<&mut Degree> {
    let open = degrees.iter_mut().filter(|own| own.levels.len() > 0);
    open.min_by(|a, b| {
        let rank = |own: &Degree| {
            if own.price.is_finite() {
                own.price
            } else {
                0.0
            }
        };
        rank(a).total_cmp(&rank(b))
    })
}

impl<'m> Trials<'m> {
    /// What a pilot tells of some cells and a degree: seconds until the error is reached, or of the given walks, times the variance then and the
    /// square of what scores may lose. `None`: they are refused or take too long.
    fn price(
        &mut self,
        question: &Question<'_, 'm>,
        (cells, own): (usize, &mut Degree),
        bound: Bound,
    ) -> Result<Option<f64>, Error> {
        let settings = Settings {
            cells: Some(cells),
            degree: Some(own.degree),
            ..question.settings.clone()
        };
        let Some(level) = question.level(&settings) else {
            return Ok(None);
        };
        let setup = level.cost(question.pairs()).setup;
        let pilot = setup + question.pilot_seconds(&*level, &settings);
        let may = self.may_take(question.settings, bound);
        // The set-up of the best so far is that of the estimate, and not lost.
        let kept = self.best.as_ref().map_or(0.0, |best| best.joint.setup);
        // Finer cells of the best degree are what pays most.
        let is_best = self
            .best
            .as_ref()
            .is_some_and(|best| best.degree == own.degree);
        let may_lose = if is_best { may } else { FINER * may };
        let left = may_lose - (self.spent - kept);
        if self.best.is_some() && (pilot - setup > left || setup > may_lose) {
            return Ok(None);
        }
        let (of, mut values) = ((bound, left.max(MOMENT)), 0.0);
        let found = question.pilot(&*level, (settings, None), of, &mut values);
        let joint = match found {
            Ok(Some(joint)) => joint,
            Ok(None) => return Ok(Some(f64::INFINITY)),
            Err(Error::Cancelled) => return Err(Error::Cancelled),
            // Walks with these settings refuse them, too, if nothing else is left.
            Err(_) => return Ok(None),
        };
        self.pilots += 1;
        self.spent += pilot + values;
        let seconds = joint.setup + joint.seconds();
        self.first.get_or_insert(seconds);
        let is_given = matches!(bound, Bound::Walks(_));
        if is_given && seconds > may && self.best.is_some() {
            return Ok(None);
        }
        // Where it is below a pilot's noise, it has fallen with the square of the cells' size since it was seen, at least.
        let [before, coarse] = own.lost;
        let cells = cells as f64;
        let lost = match joint.highest > 0.0 {
            true => joint.highest,
            false => before * (coarse / cells).powi(2),
        };
        own.lost = [lost, cells];
        let floor = joint.ready.rounding_floor(question.settings.scalar);
        let error = joint.error.max(floor);
        let is_biased = joint.is_biased || lost > UNSEEN * error;
        let price = seconds * (error.powi(2) + (lost / UNSEEN).powi(2));
        if self.best.as_ref().is_none_or(|best| price < best.price) {
            self.best = Some(Best {
                degree: own.degree,
                is_biased,
                price,
                joint,
            });
        }
        Ok(Some(price))
    }

    /// Seconds that an estimate may take, and pilots for it.
    fn may_take(&self, settings: &Settings, bound: Bound) -> f64 {
        let seconds = match (bound, &self.best) {
            (
                _,
                None
                | Some(Best {
                    is_biased: true, ..
                }),
            ) => f64::INFINITY,
            (Bound::Walks(_), _) => (TIMES * self.first.unwrap_or(0.0)).max(MOMENT),
            (Bound::Error(_), Some(best)) => best.joint.setup + best.joint.seconds(),
        };
        let limit = settings.walk_options().time_limit;
        let limit = limit.map_or(LONG_SECONDS, |limit| limit.as_secs_f64());
        seconds.min(limit)
    }
}
