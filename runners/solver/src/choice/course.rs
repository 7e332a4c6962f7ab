//! The course of the answer's walks: whether they go as predicted, and what is done if they do not.

use std::sync::{Mutex, PoisonError};

use fredholm_core::{MANY_BATCHES, MIN_SCORED_WALKS, Statistics, Tolerance};
use fredholm_rayon::Observer;

use super::family::Prediction;
use super::search::{PAYS, SHARE, Search};
use super::{LONG_SECONDS, MOST_SECONDS};
use crate::Settings;
use crate::answer::{Gave, SolveObserver, Staged};

/// How many times as many walks as predicted, made or told to be needed by those made, are a reason to look for another
/// setting. Predictions are off by less in general.
const WRONG: f64 = 2.0;
/// How many times as long as the first look told is more than a wrong variance: what grows so has perhaps none.
const ENDLESS_TIMES: f64 = 4.0;
/// The standard error over an estimate of which a part may be asked for.
const KNOWN: f64 = 0.5;

/// Watches walks of a setting, and looks for another one with what they tell.
pub(super) struct Course<'a, 'm> {
    watch: &'a dyn SolveObserver,
    /// The error that is asked for, unless something else ends the walks: then nothing is looked at.
    tolerance: Option<Tolerance>,
    batch: u64,
    /// If walks draw from a sequence or follow a lift, seconds of pseudo-random walks without in their place: those that take longer are given up for
    /// them, as nothing else is known of such walks.
    pub(super) otherwise: Option<f64>,
    state: Mutex<State<'a, 'm>>,
}

struct State<'a, 'm> {
    search: &'a mut Search<'m>,
    predicted: Prediction,
    /// The number of walks of a target before which no look is due.
    look: f64,
    /// Seconds of all walks, as they told at the first look.
    told: Option<f64>,
    end: Option<End>,
}

/// Why the course ended before the tolerance was reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum End {
    /// A different setting takes less, even from the beginning.
    Other,
    /// Walks of the other direction take less, even from the beginning.
    OtherWay,
    /// Nothing helps.
    Gave(Gave),
}

impl<'a, 'm> Course<'a, 'm> {
    /// The course of walks with this prediction.
    pub(super) fn new(
        search: &'a mut Search<'m>,
        predicted: Prediction,
        settings: &Settings,
        watch: &'a dyn SolveObserver,
    ) -> Self {
        let has_end = settings.walks.is_some() || settings.time_limit.is_some();
        Self {
            watch,
            tolerance: settings.tolerance.filter(|_| !has_end),
            batch: settings.batch(),
            otherwise: None,
            state: Mutex::new(State {
                search,
                predicted,
                look: 0.0,
                told: None,
                end: None,
            }),
        }
    }

    /// Why it ended, if it did before the tolerance was reached.
    pub(super) fn end(&self) -> Option<End> {
        self.with(|state| state.end)
    }

    fn with<T>(&self, then: impl FnOnce(&mut State<'a, 'm>) -> T) -> T {
        // A thread that panicked while it held the state has ended the program's walks already.
        then(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Whether a target goes on.
    fn is_open(&self, tolerance: Tolerance, statistics: &Statistics) -> bool {
        let batches = statistics.walks() / self.batch.max(1);
        !tolerance.reached(statistics, batches)
    }

    /// The number of walks that a target takes, as far as enough have scored to tell.
    fn needed(tolerance: Tolerance, statistics: &Statistics) -> f64 {
        if statistics.scored() < MIN_SCORED_WALKS {
            return 0.0;
        }
        let deviation = statistics.preconditioned().std_dev.unwrap_or(0.0);
        (deviation / tolerance.error(statistics)).powi(2)
    }

    /// The number of walks that are left of a target.
    fn left(tolerance: Tolerance, statistics: &Statistics) -> f64 {
        (Self::needed(tolerance, statistics) - statistics.walks() as f64).max(0.0)
    }

    /// Whether the error that is asked for is no matter of chance, as a part of what may be 0 is.
    fn is_known(tolerance: Tolerance, statistics: &Statistics) -> bool {
        let found = statistics.preconditioned();
        let error = found.std_error.unwrap_or(f64::INFINITY);
        matches!(tolerance, Tolerance::Absolute(_)) || error < KNOWN * found.estimate.abs()
    }
}

impl State<'_, '_> {
    /// Looks whether to go on. `is_known`: the tolerance does not depend on the noise of an estimate.
    fn look(&mut self, statistics: &[Statistics], walked: f64, is_known: bool) -> Option<End> {
        let setting = self.predicted.setting;
        let now = self.search.correct(&setting, statistics)?;
        let walks = statistics.iter().map(Statistics::walks).max().unwrap_or(0);
        // Looks are twice as far apart every time: all of them take at most half as long as the walks.
        let (may, few) = (SHARE * walked, (SHARE * walks as f64) as u64);
        let left = (now.walking - walked).max(0.0);
        // Where the error is a part of what may be 0, another setting tells whether it is; a third one would tell no more.
        let may_change = is_known || !self.search.hoped;
        if may_change {
            self.search.run_for(may, few, left / PAYS);
        }
        let best = self.search.best()?;
        let price = self.search.price(&best);
        // The last pilot tells the length of walks anew, and as many more or fewer are enough then.
        let is_tried = 2 * best.pilot_walks >= self.search.enough(&best, may, few);
        let is_other = best.setting != setting && may_change;
        let told = *self.told.get_or_insert(now.walking);
        let least = if is_other { left.min(price) } else { left };
        // An estimate that the predicted walks do not tell from 0 is perhaps 0, and then a part of it is never reached.
        let most = self.predicted.walking.max(LONG_SECONDS);
        if may_change && PAYS * self.search.other_price() < least {
            self.search.walked += walked;
            return Some(End::OtherWay);
        }
        if least > MOST_SECONDS {
            return Some(End::Gave(Gave::TooLong { seconds: least }));
        }
        if !is_known && walked > most && left > walked {
            return Some(End::Gave(Gave::TooLong { seconds: left }));
        }
        if is_other && is_tried && PAYS * price < left {
            self.search.walked += walked;
            self.search.hoped |= !is_known;
            return Some(End::Other);
        }
        // What is nearly done is done.
        let times = now.walking / told;
        (is_known && times > ENDLESS_TIMES && left > walked.max(LONG_SECONDS))
            .then_some(End::Gave(Gave::Unpredicted { times }))
    }
}

impl Observer for Course<'_, '_> {
    fn walked(&self, walks: u64) {
        self.watch.walked(walks);
    }

    fn merged(&self, statistics: &[Statistics]) {
        self.watch.merged(statistics);
    }

    fn cancelled(&self) -> bool {
        self.watch.cancelled() || self.end().is_some()
    }
}

impl SolveObserver for Course<'_, '_> {
    fn walking(&self) {
        self.watch.walking();
    }

    fn staged(&self, stage: &Staged<'_>) {
        self.watch.staged(stage);
        let Some(tolerance) = self.tolerance else {
            return;
        };
        let Staged {
            statistics,
            tails,
            floor,
        } = *stage;
        let is_open = |of: &&Statistics| self.is_open(tolerance, of);
        let open: Vec<_> = statistics.iter().filter(is_open).collect();
        if open.is_empty() || self.watch.cancelled() {
            return;
        }
        let walks = open.iter().map(|of| of.walks()).max().unwrap_or(0) as f64;
        let needed = open.iter().map(|of| Self::needed(tolerance, of));
        let needed = needed.fold(0.0, f64::max);
        let is_rounded = |of: &&Statistics| {
            let error = of.preconditioned().std_error;
            of.scored() >= MIN_SCORED_WALKS && error.is_some_and(|error| error < floor(of))
        };
        self.with(|state| {
            // The stage in which it ends is merged, too.
            if state.end.is_some() {
                return;
            }
            let each = state.predicted.seconds_per_walk;
            let all: u64 = statistics.iter().map(Statistics::walks).sum();
            let walked = all as f64 * each;
            if open.iter().all(is_rounded) {
                state.end = Some(End::Gave(Gave::Rounding));
            }
            if let Some(price) = self.otherwise {
                let left: f64 = open.iter().map(|of| Self::left(tolerance, of)).sum();
                if state.end.is_none() && left * each > price {
                    state.search.walked += walked;
                    state.end = Some(End::Other);
                }
                return;
            }
            let is_wrong = walks.max(needed) > WRONG * state.predicted.most_walks;
            if state.end.is_none() && is_wrong && walks >= state.look {
                state.look = 2.0 * walks;
                let is_known = open.iter().all(|of| Self::is_known(tolerance, of));
                state.end = state.look(statistics, walked, is_known);
                if state.end.is_none() && walks >= (MANY_BATCHES * self.batch) as f64 {
                    state.end = Gave::doubtful(statistics, tails, floor).map(End::Gave);
                }
            }
        });
    }
}
