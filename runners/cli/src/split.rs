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
//! cells; the variance on more of them follows its observed order. Seconds come of constants
//! ([`Cost`](crate::problem::Cost)) and of what was counted, and never of a clock: the same file has the
//! same bits on every machine.

mod family;
mod pilot;
mod rare;
mod search;
mod systems;

use std::time::Instant;

use fredholm::Choices;
use serde::Serialize;

use crate::failure::Failure;
use crate::file::{Place, Placed, ProblemFile};
use crate::numbers::short;
use crate::problem::{self, Solved};
use crate::solve;

use pilot::{Prediction, Setting};
use search::Search;

/// A file in which nothing is open, and how it came about.
#[derive(Debug)]
pub(crate) struct Split {
    pub(crate) file: ProblemFile,
    /// Whether walks follow no neighbour equation.
    pub(crate) plain: bool,
    /// What a pilot left of the set-up.
    pub(crate) solved: Option<Solved>,
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
    /// What plain walks alone would take; null where the file does not let them be looked at, or none of a pilot's
    /// scored.
    pub(crate) predicted_plain_seconds: Option<f64>,
    pub(crate) pilots: usize,
    pub(crate) pilot_walks: u64,
    pub(crate) pilot_seconds: f64,
}

impl SplitReport {
    /// In words, of this file and its cells.
    pub(crate) fn text(&self, file: &ProblemFile, cells: &str) -> String {
        let (walk, galerkin) = (&file.walk, &file.galerkin);
        let walks = format!(
            "absorption {}, {} estimator",
            walk.absorption.value,
            walk.estimator.value.word().to_owned()
        );
        let which = if self.method == "plain" {
            format!("plain walks, {walks}: a neighbour equation does not pay at this error")
        } else {
            let plain = self.predicted_plain_seconds.map(short);
            format!(
                "cells {cells}, degree {}, {} pairs, {walks}; plain walks alone: about {} s",
                galerkin.degree.value,
                galerkin.pairs.value.word().to_owned(),
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

/// Chooses what the file leaves open, if it gives an error and no cells.
pub(crate) fn choose(file: &ProblemFile) -> Result<Option<Split>, Failure> {
    let (None, Some(error)) = (&file.galerkin.cells, solve::plan(file, None).target_error) else {
        return Ok(None);
    };
    let clock = Instant::now();
    let (mut pilots, mut walks) = (0, 0);
    let mut refusal = None;
    let mut most = Some(1.0);
    while let Some(absorption) = most {
        let mut search = Search::new(file, error, absorption);
        search.run();
        most = search.lower();
        while let Some(best) = search.best() {
            let setting = best.setting;
            refuse_the_dark(file, &best)?;
            // What follows is asked of every file before it is solved.
            let searched = clock.elapsed().as_secs_f64();
            match accepted(file, &setting, search.systems.of(&setting)) {
                Ok(chosen) => {
                    let mut split = split(chosen, &best, &mut search, searched);
                    split.report.pilots += pilots;
                    split.report.pilot_walks += walks;
                    return Ok(Some(split));
                }
                Err(failure) => {
                    refusal.get_or_insert(failure);
                }
            }
            // Where the best has no variance that is finite, longer walks may have one.
            if search.checks_late() && most.is_some() {
                break;
            }
            search.forget(setting);
            search.settle();
        }
        (pilots, walks) = (pilots + search.pilots, walks + search.walks);
        refusal = refusal.or(search.take_refusal());
    }
    Err(refusal.unwrap_or_else(|| Failure::input("no setting of the file has walks")))
}

/// Refuses walks until an error where no walk may ever score.
fn refuse_the_dark(file: &ProblemFile, best: &Prediction) -> Result<(), Failure> {
    let (Some(error), Place::Default) = (&file.walk.target_error, &file.walk.walks.place) else {
        return Ok(());
    };
    if best.walking.is_finite() {
        return Ok(());
    }
    let message = "no walk of any pilot scored, and perhaps none ever does: u may be 0 at a target, if nothing emits \
                   or nothing of it comes there; give `walks`, after which to stop in any case";
    Err(file.refuse(error, message).into())
}

/// What was chosen by a search that took so many seconds, those of the system with which the answer goes on among them.
fn split(file: ProblemFile, best: &Prediction, search: &mut Search<'_>, seconds: f64) -> Split {
    let setting = &best.setting;
    let plain = search.best_plain().as_ref().map(Prediction::seconds);
    let solved = search.systems.take(setting);
    let kept = solved.as_ref().map_or(0.0, |solved| solved.seconds);
    Split {
        file,
        plain: setting.plain,
        solved,
        report: SplitReport {
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

/// The file with a setting, if the problem takes it, whose system may be solved.
fn accepted(
    file: &ProblemFile,
    setting: &Setting,
    solved: Option<&Solved>,
) -> Result<ProblemFile, Failure> {
    let mut chosen = setting.applied(file);
    if chosen.walk.walks.place == Place::Default {
        // Until the error is reached.
        chosen.walk.walks = Placed::chosen(u64::MAX >> 1);
    }
    chosen.validate()?;
    let problem = problem::of_file(&chosen)?;
    if !setting.plain && solved.is_none() {
        solve::refuse_beyond_memory(&chosen, &*problem)?;
    }
    match solved {
        _ if chosen.walk.allow_infinite_variance => {}
        Some(solved) => problem.refuse_infinite_variance_of(solved)?,
        None => problem.refuse_infinite_variance()?,
    }
    drop(problem);
    Ok(chosen)
}
