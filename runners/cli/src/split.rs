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
mod search;

use std::time::Instant;

use serde::Serialize;

use crate::failure::Failure;
use crate::file::{Place, Placed, ProblemFile, word};
use crate::numbers::short;
use crate::problem;
use crate::solve;

use pilot::{Prediction, Setting};
use search::Search;

/// A file in which nothing is open, and how it came about.
#[derive(Debug)]
pub(crate) struct Split {
    pub(crate) file: ProblemFile,
    /// Whether walks follow no neighbour equation.
    pub(crate) plain: bool,
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
    /// What plain walks alone would take; null where the file does not let them be looked at.
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
            word(&walk.estimator.value)
        );
        let which = if self.method == "plain" {
            format!("plain walks, {walks}: a neighbour equation does not pay at this error")
        } else {
            let plain = self.predicted_plain_seconds.map(short);
            format!(
                "cells {cells}, degree {}, {} pairs, {walks}; plain walks alone: about {} s",
                galerkin.degree.value,
                word(&galerkin.pairs.value),
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
        (pilots, walks) = (pilots + search.pilots, walks + search.walks);
        let pilot_seconds = clock.elapsed().as_secs_f64();
        let (found, refused) = search.take_found();
        refusal = refusal.or(refused);
        let plain = found.iter().find(|found| found.setting.plain);
        most = search.lower();
        // Where the best has no variance that is finite, longer walks may have one.
        let alone = search.checks_late() && most.is_some();
        let tried = if alone { 1 } else { found.len() };
        for prediction in found.iter().take(tried) {
            let setting = &prediction.setting;
            let chosen = match accepted(file, setting) {
                Ok(chosen) => chosen,
                Err(failure) => {
                    refusal.get_or_insert(failure);
                    continue;
                }
            };
            return Ok(Some(Split {
                file: chosen,
                plain: setting.plain,
                report: SplitReport {
                    method: setting.method(),
                    predicted_setup_seconds: prediction.setup,
                    predicted_walk_seconds: prediction.walking,
                    predicted_walks: prediction.walks,
                    predicted_states: prediction.states,
                    predicted_plain_seconds: plain.map(Prediction::seconds),
                    pilots,
                    pilot_walks: walks,
                    pilot_seconds,
                },
            }));
        }
    }
    Err(refusal.unwrap_or_else(|| Failure::input("no setting of the file has walks")))
}

/// The file with a setting, if the problem takes it.
fn accepted(file: &ProblemFile, setting: &Setting) -> Result<ProblemFile, Failure> {
    let mut chosen = setting.applied(file);
    if chosen.walk.walks.place == Place::Default {
        // Until the error is reached.
        chosen.walk.walks = Placed::chosen(u64::MAX >> 1);
    }
    chosen.validate()?;
    let problem = problem::of_file(&chosen)?;
    if !setting.plain {
        solve::refuse_beyond_memory(&chosen, &*problem)?;
    }
    if !chosen.walk.allow_infinite_variance {
        problem.refuse_infinite_variance()?;
    }
    drop(problem);
    Ok(chosen)
}
