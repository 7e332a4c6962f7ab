//! The best division of work between the set-up and the walks, if a tolerance is given and no cells.
//!
//! A finer Galerkin solution takes longer and leaves less to the walks. The choice is the setting that minimises, among
//! all that are left open,
//!
//! ```text
//! set-up(n) + Σ Var(n)/E² · seconds of a walk
//! ```
//!
//! over the targets. Pilots tell the variances and the length of walks: some hundred walks each, on few cells. The
//! variance on more cells follows its observed order. Seconds come from constants ([`Cost`](crate::cost::Cost)) and
//! from what was counted, and never from a clock: the same input has the same bits on every machine.
//!
//! - `setting`: what may be chosen. `family`: settings that differ by their cells alone.
//! - `pilot`: few walks of one setting, and what they tell of many. `rare`: what they miss. `systems`: what they solved.
//! - `prediction`: what a setting will take.
//! - `search`: which pilot comes next, and the best prediction.

mod family;
mod pilot;
mod prediction;
mod rare;
mod search;
mod setting;
mod systems;

use std::time::Instant;

use serde::Serialize;

use crate::answer::{Solved, Watch};
use crate::goal::Target;
use crate::memory::refuse_beyond_memory;
use crate::numbers::short;
use crate::{Choices, Error, Model, Settings};

use prediction::Prediction;
use search::Search;
use setting::Setting;

/// The most walks of a goal if only its error ends them.
const ENDLESS: u64 = u64::MAX >> 1;

/// Settings in which nothing is open, and how they were chosen.
#[derive(Debug)]
pub struct Chosen<'m> {
    /// The settings.
    pub settings: Settings,
    /// Whether walks follow no neighbour equation.
    pub plain: bool,
    /// The solved system of a pilot, if there is one.
    pub solved: Option<Solved<'m>>,
    /// The report of the choice.
    pub report: ChoiceReport,
}

/// The part of a report on a choice.
#[derive(Clone, Debug, Serialize)]
pub struct ChoiceReport {
    /// "preconditioned" or "plain".
    pub method: &'static str,
    /// Seconds of the set-up on one thread of the machine whose constants the library knows.
    pub predicted_setup_seconds: f64,
    /// Seconds of all walks on one such thread.
    pub predicted_walk_seconds: f64,
    /// Walks of all goals.
    pub predicted_walks: f64,
    /// States that these walks visit.
    pub predicted_states: f64,
    /// Seconds that plain walks alone would take; null if they are not allowed, or if none of a pilot's scored.
    pub predicted_plain_seconds: Option<f64>,
    /// The number of pilots.
    pub pilots: usize,
    /// Walks of all pilots.
    pub pilot_walks: u64,
    /// Measured seconds of the choice.
    pub pilot_seconds: f64,
}

impl ChoiceReport {
    /// The choice for people: these settings, and this text for the number of cells.
    #[must_use]
    pub fn text(&self, settings: &Settings, cells: &str) -> String {
        let walk = settings.walk_options();
        let walks = format!(
            "absorption {}, {} estimator",
            walk.absorption,
            walk.estimator.word()
        );
        let which = if self.method == "plain" {
            format!("plain walks, {walks}: a neighbour equation does not pay at this error")
        } else {
            let plain = self.predicted_plain_seconds.map(short);
            format!(
                "cells {cells}, degree {}, {} pairs, {walks}; plain walks alone: about {} s",
                settings.discretisation().degree,
                walk.pairs.word(),
                plain.as_deref().unwrap_or("?")
            )
        };
        format!(
            "chosen by {} pilots in {} s: {which}\npredicted: {:.1e} walks in about {} s on one thread, \
             {} s of them for the set-up\n",
            self.pilots,
            short(self.pilot_seconds),
            self.predicted_walks,
            short(self.predicted_setup_seconds + self.predicted_walk_seconds),
            short(self.predicted_setup_seconds),
        )
    }
}

/// Chooses what the settings leave open, if they give a tolerance and no cells.
///
/// # Errors
/// [`Error`]: nothing can be chosen. [`Error::Cancelled`].
pub fn choose<'m>(
    model: &'m dyn Model,
    targets: &[Target],
    settings: &'m Settings,
    watch: &'m dyn Watch,
) -> Result<Option<Chosen<'m>>, Error> {
    let (None, Some(tolerance)) = (settings.cells, settings.tolerance) else {
        return Ok(None);
    };
    let clock = Instant::now();
    let mut search = Search::new(model, targets, settings, tolerance, watch)?;
    search.run();
    let mut refusal = None;
    while let Some(best) = search.best() {
        if watch.cancelled() {
            return Err(Error::Cancelled);
        }
        let setting = best.setting;
        refuse_no_scores(settings, &best)?;
        let searched = clock.elapsed().as_secs_f64();
        match accepted(model, settings, &setting, search.systems.of(&setting)) {
            Ok(chosen) => return Ok(Some(finished(chosen, &best, &mut search, searched))),
            Err(error) => refusal = refusal.or(Some(error)),
        }
        search.forget(setting);
        search.improve_until_stable();
    }
    if watch.cancelled() {
        return Err(Error::Cancelled);
    }
    Err(refusal
        .or(search.take_refusal())
        .unwrap_or(Error::NoSetting))
}

/// Refuses walks until an error is reached if no walk may ever score.
fn refuse_no_scores(settings: &Settings, best: &Prediction) -> Result<(), Error> {
    if settings.walks.is_some() || best.walking.is_finite() {
        Ok(())
    } else {
        Err(Error::Dark)
    }
}

/// The choice of a search that took this many seconds, including those of the system that the answer uses.
fn finished<'m>(
    settings: Settings,
    best: &Prediction,
    search: &mut Search<'m>,
    seconds: f64,
) -> Chosen<'m> {
    let setting = &best.setting;
    let plain = search.best_plain().as_ref().map(Prediction::seconds);
    let solved = search.systems.take(setting);
    let kept = solved.as_ref().map_or(0.0, |solved| solved.seconds);
    Chosen {
        settings,
        plain: setting.plain,
        solved,
        report: ChoiceReport {
            method: setting.method(),
            predicted_setup_seconds: best.setup,
            predicted_walk_seconds: best.walking,
            predicted_walks: best.walks,
            predicted_states: best.states,
            predicted_plain_seconds: plain.filter(|seconds| seconds.is_finite()),
            pilots: search.pilots,
            pilot_walks: search.walks,
            pilot_seconds: seconds - kept,
        },
    }
}

/// The settings with the choice applied, if the model takes it and its variance is finite.
fn accepted(
    model: &dyn Model,
    settings: &Settings,
    setting: &Setting,
    solved: Option<&Solved<'_>>,
) -> Result<Settings, Error> {
    let mut chosen = setting.applied(settings);
    // Until the error is reached.
    chosen.walks = chosen.walks.or(Some(ENDLESS));
    let walk = chosen.walk_options();
    let cut = chosen.discretisation();
    model.check(&cut, walk.pairs)?;
    let cells = model.partition(&cut)?;
    if !setting.plain && solved.is_none() {
        let unknowns = || format!("{} unknowns", cells.unknowns());
        let advice = model.about().less_memory;
        refuse_beyond_memory(unknowns, cells.memory(&[], walk.pairs), advice)?;
    }
    match solved {
        _ if chosen.allow_infinite_variance => {}
        Some(solved) => solved.system.check_variance(walk.pairs, walk.absorption)?,
        None => cells.check_variance(walk.pairs, walk.absorption)?,
    }
    Ok(chosen)
}
