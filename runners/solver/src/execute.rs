//! What a set-up tells of walks, and whoever runs them.

use core::fmt;
use core::time::Duration;
use std::borrow::Cow;

use fredholm_core::galerkin::Convergence;
use fredholm_core::{Job, RunOptions, Statistics, Tolerance, rounding_floor};
use fredholm_model::cost::PointwisePairs;
use fredholm_model::resolvent::ResolventFigures;
use fredholm_model::{Prepared, in_scalar};
use fredholm_rayon::{Observer, Outcome, Runner};
use serde::{Deserialize, Deserializer, Serialize};

use crate::answer::{SolveObserver, Walks};
use crate::chosen::ChoiceReport;
use crate::systems::SystemStore;
use crate::{Error, Model, Partitioned, Scalar, Settings};

/// The part of a set-up that a report needs besides statistics: plain numbers, without the solved system.
///
/// All but the seconds follow from the model, the goals and the settings, to the bit.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SetUp {
    /// The number of goals of the job: those that were asked for, and what a room has besides.
    pub goals: usize,
    /// The number of them that share their walks.
    #[serde(default = "alone")]
    pub shared: usize,
    /// The number of quantities by which each of them has derivatives; these are goals behind them.
    #[serde(default)]
    pub quantities: usize,
    /// (v, Φ) of each goal that was asked for; NaN for plain walks.
    #[serde(deserialize_with = "null_is_nan")]
    pub galerkin: Vec<f64>,
    /// ‖v‖∞, for what rounding leaves.
    pub largest: f64,
    /// A bound of the spectral radius of |K'|; 0 for plain walks.
    pub radius_bound: f64,
    /// The number of sweeps for v.
    pub sweeps: u32,
    /// The residual after the last of them.
    pub residual: f64,
    /// Pointwise pairs of a row.
    pub pointwise: PointwisePairs,
    /// The spectral radius of T_h²p, or a bound of it, if it was looked at.
    pub neighbour_second_moment_radius: Option<f64>,
    /// What was known before any walk, if these are resolvent walks.
    #[serde(default)]
    pub resolvent: Option<ResolventFigures>,
    /// Seconds of the set-up.
    pub seconds: f64,
}

/// A goal that shares its walks with no other one, as all did once.
const fn alone() -> usize {
    1
}

/// JSON has no NaN: it is written as null.
fn null_is_nan<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
    let all = Vec::<Option<f64>>::deserialize(from)?;
    Ok(all.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect())
}

impl SetUp {
    /// The numbers of prepared walks, whose set-up took so many seconds.
    pub(crate) fn new(prepared: &Prepared<'_>, seconds: f64) -> Self {
        Self {
            goals: prepared.job.goals(),
            shared: prepared.job.shared(),
            quantities: prepared.job.shared() / prepared.job.decisive().max(1) - 1,
            galerkin: prepared.galerkin.to_vec(),
            largest: prepared.largest,
            radius_bound: prepared.radius_bound,
            sweeps: prepared.convergence.sweeps,
            residual: prepared.convergence.residual,
            pointwise: prepared.pointwise,
            neighbour_second_moment_radius: prepared.neighbour_second_moment_radius,
            resolvent: None,
            seconds,
        }
    }

    /// The number of goals that are no derivatives.
    #[must_use]
    pub fn own_goals(&self) -> usize {
        self.goals / (1 + self.quantities)
    }

    /// Whether a goal is the derivative of another one.
    fn is_derivative(&self, goal: usize) -> bool {
        goal % self.shared.max(1) >= self.shared / (1 + self.quantities)
    }

    /// What there is of every goal, without derivatives.
    pub(crate) fn own<'a, T: Clone>(&self, all: &'a [T]) -> Cow<'a, [T]> {
        if self.quantities == 0 {
            return Cow::Borrowed(all);
        }
        let own = all.iter().enumerate();
        let own = own.filter(|(goal, _)| !self.is_derivative(*goal));
        own.map(|(_, one)| one.clone()).collect()
    }

    /// Takes the statistics of derivatives out of an outcome: of every goal those by all quantities, one after the other.
    pub(crate) fn split_off(&self, outcome: &mut Outcome) -> Vec<Statistics> {
        let all = outcome.statistics.iter().enumerate();
        let derivatives = all.filter(|(goal, _)| self.is_derivative(*goal));
        let derivatives = derivatives.map(|(_, one)| *one).collect();
        outcome.statistics = self.own(&outcome.statistics).into_owned();
        outcome.tails = self.own(&outcome.tails).into_owned();
        derivatives
    }

    /// How the iteration for v went.
    pub(crate) const fn convergence(&self) -> Convergence<f64> {
        Convergence {
            sweeps: self.sweeps,
            residual: self.residual,
        }
    }

    /// What rounding alone leaves of the standard deviation of walks with these statistics.
    #[must_use]
    pub fn floor(&self, scalar: Scalar, statistics: &Statistics) -> f64 {
        let u = statistics.preconditioned().estimate;
        if let Some(figures) = self.resolvent {
            return figures.floor(self.largest);
        }
        // Where all is 0 nothing is rounded.
        if u == 0.0 && statistics.plain().std_dev == Some(0.0) {
            return 0.0;
        }
        // Plain walks have no table: every step of theirs rounds once.
        let length = statistics.states() as f64 / statistics.walks().max(1) as f64;
        let radius_bound = match self.radius_bound {
            0.0 => 1.0 - 1.0 / length.max(1.0),
            radius_bound => radius_bound,
        };
        in_scalar!(scalar, F => rounding_floor::<F>(self.largest, u, radius_bound))
    }
}

/// The number of cells and unknowns.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CellCount {
    /// Cells as the settings count them: of a cube, per axis.
    pub cells: usize,
    /// Unknowns in all.
    pub unknowns: usize,
    /// Cells for people.
    pub text: String,
}

impl CellCount {
    /// The counts of these cells.
    #[must_use]
    pub fn of(cells: &dyn Partitioned<'_>) -> Self {
        Self {
            cells: cells.cells(),
            unknowns: cells.unknowns(),
            text: cells.cells_text(),
        }
    }
}

/// Walks that are about to be run: what they follow from, but for the model and the goals.
#[derive(Clone, Copy)]
pub struct Walking<'a> {
    /// The settings, in which what is chosen is not open.
    pub settings: &'a Settings,
    /// Whether walks follow no neighbour equation.
    pub plain: bool,
    /// The cells.
    pub cells: &'a CellCount,
    /// The choice, if settings were chosen.
    pub choice: Option<&'a ChoiceReport>,
    /// The numbers of the set-up.
    pub set_up: &'a SetUp,
    /// The job.
    pub job: &'a dyn Job,
    /// The number of walks, their batches, and when a goal stops.
    pub options: RunOptions,
    /// The time after which walks end.
    pub time_limit: Option<Duration>,
}

impl fmt::Debug for Walking<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Walking")
            .field("settings", &self.settings)
            .field("set_up", &self.set_up)
            .finish_non_exhaustive()
    }
}

impl<'a> Walking<'a> {
    /// The runner of these walks on the threads of this process, which keeps nothing.
    #[must_use]
    pub fn runner(&self) -> Runner<'a> {
        Runner {
            time_limit: self.time_limit,
            ..Runner::new(self.options)
        }
    }
}

/// Whoever runs the walks of an answer: the threads of this process, or more than these; or a part of them, or none whose
/// batches are known.
///
/// ```
/// use fredholm::execute::Walking;
/// use fredholm::{CubeModel, Error, Execute, Observer, Solver};
/// use fredholm_rayon::Outcome;
///
/// /// As the library does, with a word on it.
/// struct Loud;
/// impl Execute for Loud {
///     fn run(&self, walking: &Walking<'_>, watch: &dyn Observer) -> Result<Outcome, Error> {
///         println!("{} batches of each goal", walking.options.batches());
///         Ok(walking.runner().run(walking.job, watch)?)
///     }
/// }
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let report = Solver::new(&u).mean().cells(4).walks(5000).execute(&Loud).solve()?;
/// assert_eq!(report.goals[0].walks, 5000);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
pub trait Execute: Sync {
    /// Runs the walks.
    ///
    /// # Errors
    /// [`Error`].
    fn run(&self, walking: &Walking<'_>, watch: &dyn Observer) -> Result<Outcome, Error>;

    /// The tolerance at which these walks end, if that is looked at.
    fn tolerance(&self, asked: Option<Tolerance>) -> Option<Tolerance> {
        asked
    }

    /// The number of walks of each target for which what is open was chosen, if these walks go on with others.
    fn goes_on_with(&self) -> Option<u64> {
        None
    }

    /// Whether what is run is all of an answer, so that other walks may follow it.
    fn tells_all(&self) -> bool {
        true
    }

    /// Whether the threads of this process may answer all goals from one set of walks in its place.
    fn takes_whole(&self) -> bool {
        false
    }
}

/// The threads of the current rayon pool.
#[derive(Clone, Copy, Debug)]
pub struct OnThreads;

impl Execute for OnThreads {
    fn takes_whole(&self) -> bool {
        true
    }

    fn run(&self, walking: &Walking<'_>, watch: &dyn Observer) -> Result<Outcome, Error> {
        Ok(walking.runner().run(walking.job, watch)?)
    }
}

/// What is known of walks before they are prepared, and who runs them. Without, the threads of this process do.
#[derive(Clone, Copy, Debug)]
pub struct Execution<'a> {
    /// Whoever runs them.
    pub execute: &'a dyn Execute,
    /// The settings, in which what is chosen is not open.
    pub settings: &'a Settings,
    /// Whether walks follow no neighbour equation.
    pub plain: bool,
    /// The cells.
    pub cells: &'a CellCount,
    /// The choice, if settings were chosen.
    pub choice: Option<&'a ChoiceReport>,
}

impl<'a> Execution<'a> {
    /// The maker of these walks of a model.
    pub(crate) fn walks(self, model: &'a dyn Model) -> Walks<'a> {
        Walks {
            model,
            scalar: self.settings.scalar,
            execution: Some(self),
        }
    }
}

fredholm_model::debug_by_name!(
    "Execute": dyn Execute + '_,
    "SolveObserver": dyn SolveObserver + '_,
    "SystemStore": dyn SystemStore + '_
);
