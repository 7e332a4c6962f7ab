//! The search for the best setting: its state, and how predictions are compared.

mod candidates;
mod doubts;
mod families;
mod pilots;
mod plain;
mod policy;

use std::time::Instant;

use fredholm_core::{Estimator, Tolerance};

use self::candidates::{ABSORPTIONS, open};
use super::family::Family;
use super::pilot::Sample;
use super::prediction::Prediction;
use super::rare::RareVariances;
use super::setting::Setting;
use super::systems::Systems;
use crate::answer::SolveObserver;
use crate::{Error, Model, Settings};
use fredholm_model::About;
use fredholm_model::Target;

/// Seconds of which pilots may take a share at most before there are walks. What takes hours in the end is refused soon,
/// and what takes minutes is corrected by its walks.
const PATIENCE: f64 = 30.0;

/// E η² of walks with an absorption and an estimator.
type Squares = ((f64, Estimator), Vec<f64>);

/// The pilots so far, and what they predict.
pub(super) struct Search<'m> {
    model: &'m dyn Model,
    about: About,
    settings: &'m Settings,
    tolerance: Tolerance,
    watch: &'m dyn SolveObserver,
    /// The values of q0 that are tried.
    absorptions: Vec<f64>,
    /// The q0 of the first pilots.
    shortest: Option<f64>,
    /// The spectral radius of T_k²p without absorption, if it is known.
    second_moment: Option<f64>,
    sample: Sample,
    /// Families that have pilots.
    families: Vec<Family>,
    /// Families without a pilot, as none would have paid.
    waiting: Vec<Family>,
    found: Vec<Prediction>,
    pub(super) systems: Systems<'m>,
    rare: RareVariances,
    /// E η² of walks with an absorption and an estimator.
    squares: Vec<Squares>,
    /// Settings that the problem has refused.
    refused: Vec<Setting>,
    /// The first refusal: it is reported if every setting is refused.
    refusal: Option<Error>,
    /// Predicted seconds of the pilots so far.
    spent: f64,
    /// Seconds of everything that was done so far, as they are predicted: of set-ups that the answer may use, too.
    work: f64,
    /// Seconds of the first choice, as they were predicted.
    pub(super) predicted_first: f64,
    /// Seconds of the answer's walks that were given up for other ones.
    pub(super) walked: f64,
    /// Pilots take no larger share of a longer prediction than of one of this many seconds.
    patience: f64,
    /// Seconds that are left for pilots with all their set-ups.
    budget: f64,
    /// Whether the watch was told that the choice takes long.
    warned: bool,
    /// When it began. Nothing but a report depends on it.
    pub(super) begun: Instant,
    pub(super) pilots: usize,
    pub(super) walks: u64,
}

impl<'m> Search<'m> {
    /// A search with the absorptions that are open and whose walks have a finite variance.
    ///
    /// # Errors
    /// [`Error::TwoGoals`], [`Error::InfiniteVariance`].
    pub(super) fn new(
        model: &'m dyn Model,
        targets: &[Target],
        settings: &'m Settings,
        tolerance: Tolerance,
        watch: &'m dyn SolveObserver,
    ) -> Result<Self, Error> {
        let absorptions = open(settings.absorption, &ABSORPTIONS);
        let about = model.about();
        let mut search = Self {
            model,
            about,
            settings,
            tolerance,
            watch,
            shortest: absorptions.first().copied(),
            absorptions,
            second_moment: None,
            sample: Sample::new(model, targets)?,
            families: Vec::new(),
            waiting: Vec::new(),
            found: Vec::new(),
            systems: Systems::default(),
            rare: RareVariances::new(about.has_rare_scores),
            squares: Vec::new(),
            refused: Vec::new(),
            refusal: None,
            spent: 0.0,
            work: 0.0,
            predicted_first: f64::INFINITY,
            walked: 0.0,
            patience: settings
                .time_limit
                .map_or(PATIENCE, |limit| limit.as_secs_f64().min(PATIENCE)),
            budget: f64::INFINITY,
            warned: false,
            begun: Instant::now(),
            pilots: 0,
            walks: 0,
        };
        search.drop_infinite_variances()?;
        // Every solve looks at the variance, whether it chooses or not.
        search.begun = Instant::now();
        Ok(search)
    }

    /// Runs all pilots.
    pub(super) fn run(&mut self) {
        self.pilot_first_plain();
        self.begin_families();
        self.shorten_walks();
        self.improve_until_stable();
        self.pilot_other_plain();
        self.improve_until_stable();
    }

    /// Makes pilots until none can improve the best setting any more.
    pub(super) fn improve_until_stable(&mut self) {
        while self.improve() {}
    }

    /// Forgets a setting that the problem refuses, and every setting that differs from it by shorter walks or fewer
    /// cells, on which h is farther from k.
    pub(super) fn forget(&mut self, setting: Setting) {
        self.refused.push(setting);
        let refused = &self.refused;
        self.found
            .retain(|found| !is_refused(refused, &found.setting));
    }

    /// Forgets a setting that the problem refuses with this error, and looks for another one.
    pub(super) fn give_up(&mut self, setting: Setting, refusal: Error) {
        self.refuse(refusal);
        self.forget(setting);
        self.improve_until_stable();
    }

    /// The error to report if every setting is refused.
    pub(super) fn take_refusal(&mut self) -> Option<Error> {
        self.refusal.take()
    }

    /// The best prediction so far.
    pub(super) fn best(&self) -> Option<Prediction> {
        self.best_of(|_| true)
    }

    /// The best prediction of plain walks.
    pub(super) fn best_plain(&self) -> Option<Prediction> {
        self.best_of(|found| found.setting.plain)
    }

    /// The best prediction among some: of those whose set-up takes no longer than the walks may, if there is one.
    fn best_of(&self, of: impl Fn(&Prediction) -> bool) -> Option<Prediction> {
        let limit = self.settings.time_limit;
        let limit = limit.map_or(f64::INFINITY, |limit| limit.as_secs_f64());
        let is_late = |found: &Prediction| self.remaining_setup_of(found) > limit;
        let found = self.found.iter().filter(|found| of(found));
        found
            .min_by(|a, b| {
                let prices = self.price(a).total_cmp(&self.price(b));
                is_late(a).cmp(&is_late(b)).then(prices)
            })
            .copied()
    }

    /// Seconds of the best prediction; infinite before there is one.
    fn least_seconds(&self) -> f64 {
        self.best().map_or(f64::INFINITY, |best| best.seconds())
    }

    /// The price of a prediction, which the search minimises.
    pub(super) fn price(&self, found: &Prediction) -> f64 {
        self.remaining_setup_of(found) + found.risk_adjusted
    }

    /// The price of a prediction in the best case.
    fn best_case_price(&self, found: &Prediction) -> f64 {
        self.remaining_setup_of(found) + found.best_case
    }

    /// Seconds of a set-up that are still to come: those of the source alone if the system is solved.
    fn remaining_setup(&self, setting: &Setting, [setup, source]: [f64; 2]) -> f64 {
        match self.systems.of(setting) {
            Some(_) => source,
            None => setup,
        }
    }

    /// Seconds of a prediction's set-up that are still to come.
    fn remaining_setup_of(&self, found: &Prediction) -> f64 {
        self.remaining_setup(&found.setting, [found.setup, found.source])
    }

    /// Keeps the seconds that are predicted at first.
    pub(super) const fn expect(&mut self, seconds: f64) {
        if self.predicted_first.is_infinite() {
            self.predicted_first = seconds;
        }
    }

    /// Seconds of everything so far but for a set-up that is kept, as they are predicted.
    pub(super) fn work_without(&self, kept: &Prediction) -> f64 {
        let setup = self.remaining_setup_of(kept);
        self.work + self.walked - (kept.setup - setup)
    }

    /// Seconds of all pilots so far and of walks that were given up, as they are predicted.
    pub(super) fn lost(&self) -> f64 {
        self.spent + self.walked
    }

    /// Makes pilots that take at most so many seconds in all, until none can improve the best setting any more.
    pub(super) fn improve_for(&mut self, seconds: f64) {
        self.budget = seconds;
        self.patience = self.patience.max(seconds);
        self.improve_until_stable();
    }

    /// Whether the problem is known to refuse a setting.
    fn refuses(&self, setting: &Setting) -> bool {
        is_refused(&self.refused, setting)
    }

    /// Keeps the first refusal.
    fn refuse(&mut self, refusal: Error) {
        self.refusal.get_or_insert(refusal);
    }

    /// The number of walks of a batch.
    const fn batch(&self) -> u64 {
        self.settings.batch
    }
}

/// Whether one of the refusals holds for a setting.
fn is_refused(refused: &[Setting], setting: &Setting) -> bool {
    refused
        .iter()
        .any(|refused| setting.is_refused_with(refused))
}
