//! What was chosen, for reports.

use fredholm_model::numbers::short;
use serde::{Deserialize, Deserializer, Serialize};

use fredholm_core::Absorption;

use crate::{Choices, Settings};

/// The word for a method. By this name it is not taken for one that lives in what is read.
type Method = &'static str;

/// The word for separate walks that follow a neighbour equation.
pub(crate) const PRECONDITIONED: &str = "preconditioned";
/// The word for one set of walks for all goals.
pub(crate) const WHOLE: &str = "global estimate";

/// The part of a report on a choice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChoiceReport {
    /// "preconditioned" or "plain", of separate walks for every goal, or "global estimate", of one set of walks for all.
    #[serde(deserialize_with = "method")]
    pub method: Method,
    /// The number of walks of each target for which it was chosen, if no error was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub walks: Option<u64>,
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
    /// Seconds that separate walks would take, set-up included, if the global estimate is used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_separate_seconds: Option<f64>,
    /// Seconds that the global estimate takes after its set-up, if a pilot looked at it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_whole_seconds: Option<f64>,
    /// Whether the global estimate was walked and given up for separate walks: it took longer than they are predicted to, or has a
    /// bias beside its error bars.
    #[serde(default, skip_serializing_if = "core::ops::Not::not")]
    pub whole_given_up: bool,
    /// The number of pilots.
    pub pilots: usize,
    /// Walks of all pilots.
    pub pilot_walks: u64,
    /// Seconds of the choice on one such thread, walks included that were given up for others; the set-up that the answer
    /// uses is not in it.
    pub predicted_pilot_seconds: f64,
    /// Measured seconds of the choice.
    pub pilot_seconds: f64,
}

/// One of the known words.
fn method<'de, D: Deserializer<'de>>(from: D) -> Result<&'static str, D::Error> {
    let word = String::deserialize(from)?;
    let mut known = [PRECONDITIONED, "plain", WHOLE].into_iter();
    let found = known.find(|known| *known == word);
    found.ok_or_else(|| serde::de::Error::custom(format_args!("no such method: {word:?}")))
}

/// How walks end, for people: "roulette", or "absorption 0.2, collision estimator".
#[must_use]
pub(crate) fn absorption_text(absorption: Absorption) -> String {
    ending(absorption.probability(), absorption.estimator().word())
}

/// How walks end, from what a report has.
pub(crate) fn ending(absorption: Option<f64>, estimator: &str) -> String {
    match absorption {
        None => "roulette".to_owned(),
        Some(probability) => format!("absorption {probability}, {estimator} estimator"),
    }
}

/// What is unusual about walks: a sequence that they draw from, states without absorption, a last step to the light, the way back.
pub(crate) fn draws(
    sequence: Option<&str>,
    forced_steps: u32,
    last_step: bool,
    adjoint: bool,
) -> String {
    let mut text = String::new();
    if sequence.is_some() {
        text.push_str(", Sobol' points");
    }
    if forced_steps > 0 {
        text.push_str(&format!(", {forced_steps} forced steps"));
    }
    if last_step {
        text.push_str(", last step to the light");
    }
    if adjoint {
        text.push_str(", from the sources");
    }
    text
}

impl ChoiceReport {
    /// Whether separate walks follow a neighbour equation.
    #[must_use]
    pub fn is_preconditioned(&self) -> bool {
        self.method == PRECONDITIONED
    }

    /// The choice for people: these settings, and this text for the number of cells.
    #[must_use]
    pub fn text(&self, settings: &Settings, cells: &str) -> String {
        let walk = settings.walk_options();
        let walks = format!(
            "{}{}",
            absorption_text(walk.absorption),
            draws(walk.sequence_word(), walk.forced_steps, false, false)
        );
        let together = match (
            self.predicted_separate_seconds,
            self.predicted_whole_seconds,
        ) {
            (Some(separate), _) => format!(
                "one set of walks answers all targets (global estimate): separate walks would take about {} s\n",
                short(separate)
            ),
            (None, Some(whole)) if self.whole_given_up => format!(
                "separate walks for every target: one set of walks for all (global estimate), predicted to take about {} s, took longer than \
                 these, or has a bias beside its error bars\n",
                short(whole)
            ),
            (None, Some(whole)) => format!(
                "separate walks for every target: one set of walks for all (global estimate) would take about {} s\n",
                short(whole)
            ),
            (None, None) => String::new(),
        };
        let last = match walk.last_step {
            true => "last step to the light, ",
            false => "",
        };
        let which = if self.method == "plain" {
            let what = match settings.tolerance {
                Some(_) => "at this error",
                None => "for so few walks",
            };
            format!("plain walks, {last}{walks}: a neighbour equation does not pay {what}")
        } else {
            let plain = match (
                self.predicted_plain_seconds,
                self.predicted_separate_seconds,
            ) {
                (None, None) if self.method == WHOLE => String::new(),
                (plain, _) => {
                    let plain = plain.map_or("?".to_owned(), short);
                    format!("; plain walks alone: about {plain} s")
                }
            };
            let pairs = match settings.lifted() {
                Some(lift) => format!(" lifted to {lift}"),
                None => format!(", {} pairs", walk.pairs.word()),
            };
            format!(
                "cells {cells}, degree {}{pairs}, {last}{walks}{plain}",
                settings.discretisation().degree
            )
        };
        format!(
            "chosen by {} pilots in {} s: {which}\npredicted: {:.1e} walks in about {} s on one thread, \
             {} s of them for the set-up\n{together}",
            self.pilots,
            short(self.pilot_seconds),
            self.predicted_walks,
            short(self.predicted_setup_seconds + self.predicted_walk_seconds),
            short(self.predicted_setup_seconds),
        )
    }
}
