//! Walks of a prepared job, and what comes of them.

use core::fmt::{self, Display};
use web_time::Instant;

use fredholm_core::galerkin::Convergence;
use fredholm_core::{Job, RunOptions, Statistics, StopReason, Tolerance};
use fredholm_rayon::{Observer, Outcome, Tail, run};

use crate::chosen::ChoiceReport;
use crate::execute::{Execution, SetUp, Walking};
use crate::{Error, Goal, Model, Partitioned, Scalar, Settings, System, WalkOptions};
use fredholm_model::cost::PointwisePairs;
use fredholm_model::numbers::short;
use fredholm_model::resolvent::ResolventFigures;
use fredholm_model::{Derived, Request, Then};

/// An observer of a solution: it is told of the choice, of stages of walks and of sites, and may cancel.
///
/// ```
/// use fredholm::choice::ChoiceReport;
/// use fredholm::{CubeModel, Method, Observer, Settings, SolveObserver, Solver};
///
/// struct Prints;
/// impl Observer for Prints {}
/// impl SolveObserver for Prints {
///     fn chosen(&self, settings: &Settings, choice: &ChoiceReport) {
///         println!("{:?} cells, about {} walks", settings.cells, choice.predicted_walks);
///     }
/// }
///
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let solver = Solver::new(&u).method(Method::Walks).mean();
/// let report = solver.observer(&Prints).solve_to(1e-3)?;
/// assert!(report.choice.is_some());
/// # Ok::<(), fredholm::SolveError>(())
/// ```
pub trait SolveObserver: Observer {
    /// Walks begin: from now on there is something to report.
    fn walking(&self) {}

    /// A stage of walks is merged.
    fn staged(&self, stage: &Staged<'_>) {
        let _ = stage;
    }

    /// A choice will take so many seconds more, which is longer than a person waits without a word.
    fn choosing(&self, seconds: f64) {
        let _ = seconds;
    }

    /// This is chosen, and walks of it begin.
    fn chosen(&self, settings: &Settings, report: &ChoiceReport) {
        let _ = (settings, report);
    }

    /// A diagnosis will go through so many more sites.
    fn expect_sites(&self, sites: u64) {
        let _ = sites;
    }

    /// A diagnosis has gone through a site; called from any thread.
    fn finish_site(&self) {}
}

impl SolveObserver for () {}

/// The state of every functional after a stage of walks.
pub struct Staged<'a> {
    /// The statistics of all walks so far.
    pub statistics: &'a [Statistics],
    /// The tails of the scores.
    pub tails: &'a [Tail],
    /// The error by rounding of a functional with these statistics.
    pub floor: &'a dyn Fn(&Statistics) -> f64,
}

impl fmt::Debug for Staged<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Staged")
            .field("statistics", &self.statistics)
            .field("tails", &self.tails)
            .finish_non_exhaustive()
    }
}

/// Why walks ended before the tolerance was reached, if nobody ended them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Gave {
    /// The tolerance is below what rounding leaves, which more walks do not lower.
    Rounding,
    /// Few walks make most of the variance.
    Doubtful {
        /// The share of one batch in the variance.
        share: f64,
        /// The tail index of the scores, if there are enough batches for one.
        index: Option<f64>,
    },
    /// The more walks, the more of them are needed.
    Unpredicted {
        /// How many times as many as the first walks told.
        times: f64,
    },
    /// Walking tells that it would take this number of seconds more on one thread.
    TooLong {
        /// Seconds.
        seconds: f64,
    },
}

impl Gave {
    /// The reason if an error bar of these scores may mean nothing. What rounding leaves has any tail.
    pub(crate) fn doubtful(
        statistics: &[Statistics],
        tails: &[Tail],
        floor: &dyn Fn(&Statistics) -> f64,
    ) -> Option<Self> {
        let mut all = statistics.iter().zip(tails);
        let (_, tail) = all.find(|(all, tail)| tail.seems_infinite() && deviates(all, floor))?;
        Some(Self::Doubtful {
            share: tail.share(),
            index: tail.index(),
        })
    }
}

impl Display for Gave {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rounding => f.write_str(
                "it is below what rounding leaves, which more walks do not lower; use a larger `target_error`",
            ),
            Self::Doubtful { share, index } => {
                write!(
                    f,
                    "{:.0} % of the variance comes from one batch of walks",
                    100.0 * share
                )?;
                if let Some(index) = index {
                    write!(f, ", and the tail index of the scores is about {index:.1}")?;
                }
                f.write_str(
                    ": the variance may be infinite, so do not trust the error bar; look for places where the kernel is large",
                )
            }
            Self::Unpredicted { times } => write!(
                f,
                "after more walks the error is expected to take {times:.0} times as long as after the first ones: these missed most \
                 of the variance, which may be infinite, so do not trust the error bars"
            ),
            Self::TooLong { seconds } => write!(
                f,
                "the error takes about {} s more on one thread, as the walks so far show; say when to stop, by `walks` or a time \
                 limit, or use a larger `target_error`",
                short(*seconds)
            ),
        }
    }
}

/// The results of walks, with the Galerkin solution and the set-up beside them.
#[derive(Clone, Debug)]
pub struct Answer {
    /// (v, Φ) of each goal, or what is known of it; NaN for plain walks, which have no v.
    pub galerkin: Vec<f64>,
    /// The statistics of the walks of the goals, and why they ended.
    pub outcome: Outcome,
    /// Why the walks ended before the tolerance was reached, if nobody ended them.
    pub gave_up: Option<Gave>,
    /// The statistics of the other walks, for irradiances and net fluxes.
    pub others: Vec<Statistics>,
    /// The statistics of the derivatives of each goal, one after the other, if these were asked for.
    pub derivatives: Vec<Statistics>,
    /// The error by rounding of each goal.
    pub floors: Vec<f64>,
    /// How the iteration for v went.
    pub convergence: Convergence<f64>,
    /// Seconds of the set-up.
    pub setup_seconds: f64,
    /// Seconds of the walks.
    pub walk_seconds: f64,
    /// Pointwise pairs of a row.
    pub pointwise: PointwisePairs,
    /// The spectral radius of T_h²p, or a bound of it, if it was looked at.
    pub neighbour_second_moment_radius: Option<f64>,
    /// The heat results that follow from the statistics.
    pub derived: Derived,
    /// What was known before any walk, if these are resolvent walks.
    pub resolvent: Option<ResolventFigures>,
}

/// A solved system, and how long it took.
#[derive(Debug)]
pub struct Solved<'m> {
    /// The system.
    pub system: Box<dyn System + 'm>,
    /// Seconds.
    pub seconds: f64,
}

impl<'m> Solved<'m> {
    /// Solves the system of these cells.
    ///
    /// # Errors
    /// [`Error`].
    pub fn new(cells: &(dyn Partitioned<'m> + 'm)) -> Result<Self, Error> {
        let start = Instant::now();
        let system = cells.solve()?;
        Ok(Self {
            system,
            seconds: start.elapsed().as_secs_f64(),
        })
    }

    /// This system, [lifted](System::lift) if there is a degree.
    ///
    /// # Errors
    /// [`Error`].
    pub fn lifted(self, degree: Option<usize>) -> Result<Self, Error> {
        let Some(degree) = degree else {
            return Ok(self);
        };
        let start = Instant::now();
        Ok(Self {
            system: self.system.lift(degree)?,
            seconds: self.seconds + start.elapsed().as_secs_f64(),
        })
    }

    /// Walks that both equations follow.
    ///
    /// # Errors
    /// [`Error`].
    pub fn walk(
        &self,
        walks: &Walks<'_>,
        request: &Request<'_>,
        watch: &dyn SolveObserver,
    ) -> Result<Answer, Error> {
        let mut answer = walks.answer(request, watch, &|then| self.system.job(request, then))?;
        answer.setup_seconds += self.seconds;
        Ok(answer)
    }
}

/// The model and scalar of walks.
#[derive(Clone, Copy, Debug)]
pub struct Walks<'a> {
    /// The equation.
    pub model: &'a dyn Model,
    /// The floating-point type of walks.
    pub scalar: Scalar,
    /// Whoever runs them, if it is not this process alone.
    pub execution: Option<Execution<'a>>,
}

/// Prepares walks and hands them on.
type Prepare<'a> = dyn Fn(&mut Then<'_>) -> Result<(), Error> + 'a;

impl Walks<'_> {
    /// Walks that follow no neighbour equation.
    ///
    /// # Errors
    /// [`Error`].
    pub fn plain(
        &self,
        cells: &dyn Partitioned<'_>,
        request: &Request<'_>,
        watch: &dyn SolveObserver,
    ) -> Result<Answer, Error> {
        let mut answer = self.answer(request, watch, &|then| cells.plain_job(request, then))?;
        answer.galerkin.fill(f64::NAN);
        answer.setup_seconds = 0.0;
        Ok(answer)
    }

    fn answer(
        &self,
        request: &Request<'_>,
        watch: &dyn SolveObserver,
        prepare: &Prepare<'_>,
    ) -> Result<Answer, Error> {
        let start = Instant::now();
        let mut answer = None;
        prepare(&mut |prepared| {
            let set_up = SetUp::new(prepared, start.elapsed().as_secs_f64());
            answer = Some(self.run_as(request, watch, prepared.job, &set_up)?);
            Ok(())
        })?;
        answer.ok_or(Error::Internal("no walks were prepared"))
    }

    /// Runs a job whose set-up is known.
    pub(crate) fn run_as(
        &self,
        request: &Request<'_>,
        watch: &dyn SolveObserver,
        job: &dyn Job,
        set_up: &SetUp,
    ) -> Result<Answer, Error> {
        let walk = request.walk;
        watch.walking();
        let start = Instant::now();
        let floor = |statistics: &Statistics| set_up.floor(self.scalar, statistics);
        let watched = Watched {
            watch,
            floor: &floor,
            set_up,
        };
        let (outcome, tolerance) = match &self.execution {
            // What is known without any.
            _ if walk.walks == 0 => (Outcome::of(job)?, None),
            None => {
                let outcome = run(job, &options(walk), walk.time_limit, &watched)?;
                (outcome, walk.tolerance)
            }
            Some(execution) => {
                let walking = Walking {
                    settings: execution.settings,
                    plain: execution.plain,
                    cells: execution.cells,
                    choice: execution.choice,
                    set_up,
                    job,
                    options: options(walk),
                    time_limit: walk.time_limit,
                };
                let outcome = execution.execute.run(&walking, &watched)?;
                (outcome, execution.execute.tolerance(walk.tolerance))
            }
        };
        let walk_seconds = start.elapsed().as_secs_f64();
        let of = Of {
            model: self.model,
            goals: request.goals,
            scalar: self.scalar,
            tolerance,
        };
        Ok(Answer::new(&of, set_up, outcome, walk_seconds))
    }
}

/// The question of an answer.
#[derive(Clone, Copy, Debug)]
pub struct Of<'a> {
    /// The equation.
    pub model: &'a dyn Model,
    /// The goals that were asked for.
    pub goals: &'a [Goal],
    /// The floating-point type of the walks.
    pub scalar: Scalar,
    /// The tolerance at which goals end, if one is looked at.
    pub tolerance: Option<Tolerance>,
}

impl Answer {
    /// The answer that a set-up and the outcome of its walks give.
    #[must_use]
    pub fn new(of: &Of<'_>, set_up: &SetUp, mut outcome: Outcome, walk_seconds: f64) -> Self {
        let floor = |statistics: &Statistics| set_up.floor(of.scalar, statistics);
        let derivatives = set_up.split_off(&mut outcome);
        let derived = of.model.derive(of.goals, &outcome.statistics);
        let others = outcome.statistics.split_off(of.goals.len());
        let is_rounded = |statistics: &Statistics| {
            let bound = of.tolerance.map(|tolerance| tolerance.error(statistics));
            bound.is_some_and(|bound| bound < floor(statistics) && bound > 0.0)
        };
        let is_done = of.tolerance.is_some() && outcome.stop == StopReason::Done;
        let gave_up = if !is_done {
            None
        } else if outcome.statistics.iter().any(is_rounded) {
            Some(Gave::Rounding)
        } else {
            Gave::doubtful(&outcome.statistics, &outcome.tails, &floor)
        };
        if gave_up.is_some() {
            outcome.stop = StopReason::ToleranceNotReached;
        }
        Self {
            galerkin: set_up.galerkin.clone(),
            floors: outcome.statistics.iter().map(floor).collect(),
            outcome,
            gave_up,
            others,
            derivatives,
            convergence: set_up.convergence(),
            setup_seconds: set_up.seconds,
            walk_seconds,
            pointwise: set_up.pointwise,
            neighbour_second_moment_radius: set_up.neighbour_second_moment_radius,
            derived,
            resolvent: set_up.resolvent,
        }
    }
}

/// The observer of a watch that is told of rounding, too.
struct Watched<'a> {
    watch: &'a dyn SolveObserver,
    floor: &'a (dyn Fn(&Statistics) -> f64 + Sync),
    set_up: &'a SetUp,
}

impl Observer for Watched<'_> {
    fn walked(&self, walks: u64) {
        self.watch.walked(walks);
    }

    fn merged(&self, statistics: &[Statistics]) {
        self.watch.merged(&self.set_up.own(statistics));
    }

    fn merged_with_tails(&self, statistics: &[Statistics], tails: &[Tail]) {
        let statistics = &self.set_up.own(statistics);
        self.watch.merged(statistics);
        self.watch.staged(&Staged {
            statistics,
            tails: &self.set_up.own(tails),
            floor: self.floor,
        });
    }

    fn rounding_floor(&self, statistics: &Statistics) -> Option<f64> {
        Some((self.floor)(statistics))
    }

    fn cancelled(&self) -> bool {
        self.watch.cancelled()
    }
}

/// Whether ζ differs by more than rounding.
fn deviates(statistics: &Statistics, floor: &dyn Fn(&Statistics) -> f64) -> bool {
    statistics.preconditioned().std_dev > Some(floor(statistics))
}

/// The schedule of these walks.
pub(crate) fn options(walk: &WalkOptions) -> RunOptions {
    let mut options = RunOptions::new(walk.walks);
    options.batch = walk.batch;
    options.tolerance = walk.tolerance;
    options
}
