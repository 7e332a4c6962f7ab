//! A solution in a few lines: what is said is kept, what is open is chosen.

mod adjoint;
mod error;
mod extra;
mod resolvent;
mod whole;

pub use adjoint::asked_way_back;

use core::time::Duration;

use fredholm_core::{Estimator, Form, Tolerance};

use crate::answer::{Answer, SolveObserver};
use crate::choice::{self, ChoiceReport, ENDLESS, Found, cells_to_choose};
use crate::diagnosis::{Diagnosis, diagnose, refuse_long};
use crate::execute::{CellCount, Execute, Execution, OnThreads};
use crate::point::Point;
use crate::report::{Report, Run};
use crate::sweep::{PLAIN_WALKS, Rates, Row, Sweep};
use crate::systems::{KeptCut, SystemStore, Systems};
use crate::{
    Error, Goal, Method, Model, Pairs, Partitioned, Region, Scalar, Sequence, Settings, WeightFn,
};
use fredholm_core::StopReason;
use fredholm_model::heat::tolerance_of;
use fredholm_model::memory::refuse_beyond_memory;
use fredholm_model::{Ask, LastSteps, Target, goals};
use fredholm_model::{Request, Wanted};
use resolvent::ByResolvent;

pub use error::SolveError;

/// Points in which a diagnosis takes integrals, if nothing is said of them.
const NODES: usize = 2000;
/// The fewest points that say something, as for the program.
const LEAST_NODES: usize = 10;

/// Solution of one equation for any number of functionals, all by the same set-up and walks of the same kind.
///
/// What is not said is chosen: cells, degree and pairs, and what else the kind of equation has.
/// The same settings and seed give the same bits on every machine and for any number of threads.
///
/// ```
/// use fredholm::{CubeModel, Solver};
///
/// // u(x) = ½ ∫ exp(−|x − y|²) u(y) dy + 1 + x₁ on [0, 1]³.
/// let square = |x: &[f64; 3], y: &[f64; 3]| (0..3).map(|a| (x[a] - y[a]).powi(2)).sum::<f64>();
/// let u = CubeModel::from_fn::<3>(move |x, y| 0.5 * (-square(x, y)).exp(), |x| 1.0 + x[0]);
/// let report = Solver::new(&u).mean().at([0.2, 0.5, 0.5]).solve_to(1e-3)?;
/// assert!((report.goals[0].preconditioned.estimate.unwrap() - 2.209).abs() < 5e-3);
/// assert!(report.goals[1].preconditioned.std_error.unwrap() <= 1e-3);
/// println!("{report}");
/// # Ok::<(), fredholm::SolveError>(())
/// ```
///
/// Source: S. Heinrich, *Variance reduction for Monte Carlo methods by means of deterministic numerical computation*, 1995.
#[derive(Clone, Debug)]
#[must_use = "a solver does nothing until it is asked to solve, predict or diagnose"]
pub struct Solver<'m> {
    pub(crate) model: &'m dyn Model,
    pub(crate) settings: Settings,
    pub(crate) asked: Vec<Result<Target, Error>>,
    pub(crate) watch: &'m dyn SolveObserver,
    pub(crate) execute: &'m dyn Execute,
    pub(crate) systems: Systems<'m>,
    pub(crate) means: Vec<Vec<usize>>,
}

impl<'m> Solver<'m> {
    /// Solver of an equation.
    pub fn new(model: &'m dyn Model) -> Self {
        Self::with(model, Settings::default(), Vec::new())
    }

    /// Solver of an equation with settings and targets from elsewhere, a file for instance.
    pub fn with(model: &'m dyn Model, settings: Settings, targets: Vec<Target>) -> Self {
        Self {
            model,
            settings,
            asked: targets.into_iter().map(Ok).collect(),
            watch: &(),
            execute: &OnThreads,
            systems: Systems(None),
            means: Vec::new(),
        }
    }

    /// Asks for the mean of u over the whole space.
    pub fn mean(self) -> Self {
        let whole = self.model.whole();
        self.goal("mean", whole)
    }

    /// Asks for u at a point: see [`Point`].
    pub fn at(self, point: impl Into<Point>) -> Self {
        let Point(x) = point.into();
        let texts: Vec<String> = x.iter().map(f64::to_string).collect();
        self.goal(&format!("u({})", texts.join(", ")), Region::Point(x))
    }

    /// Asks for u on a part, for instance a wall of a room, at this share of its length from 0 to 1.
    pub fn on(self, part: &str, share: f64) -> Self {
        let region = self.part(part).map(|number| Region::On(number, share));
        self.ask(&format!("u({part}, {share})"), region.map(Ask::One))
    }

    /// Asks for the mean of u over a part, for instance a wall of a room.
    pub fn over(self, part: &str) -> Self {
        let region = self.part(part).map(Region::Part);
        self.ask(part, region.map(Ask::One))
    }

    /// Asks for u at this number of equally spaced points of the whole space; of a cube, per axis.
    pub fn grid(self, points: usize) -> Self {
        self.ask("u", Ok(Ask::Grid { points, part: None }))
    }

    /// Asks for a functional of any region, under this name.
    pub fn goal(self, name: &str, region: Region) -> Self {
        self.ask(name, Ok(Ask::One(region)))
    }

    /// Asks for the integral of u times the weight of this name, which the equation knows.
    pub fn weighted(self, name: &str) -> Self {
        let weight = number("weight", name, &|number| self.model.weight(number));
        self.ask(name, weight.map(Region::Weight).map(Ask::One))
    }

    /// Asks for the integral of u times a weight, a function of the coordinates of a point.
    ///
    /// ```
    /// use fredholm::{CubeModel, Solver};
    ///
    /// // u = 6x/5, of which ∫ x u dx is 2/5.
    /// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    /// let report = Solver::new(&u).weight("first moment", |x| x[0]).solve_to(1e-4)?;
    /// assert!((report.goals[0].preconditioned.estimate.unwrap() - 0.4).abs() < 5e-4);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    pub fn weight(
        self,
        name: &str,
        weight: impl Fn(&[f64]) -> f64 + Send + Sync + 'static,
    ) -> Self {
        self.goal(name, Region::Function(WeightFn::new(weight)))
    }

    /// Asks for this, or refuses it as soon as something is to be solved.
    fn ask(mut self, name: &str, ask: Result<Ask, Error>) -> Self {
        let name = name.to_owned();
        self.asked.push(ask.map(|ask| Target { name, ask }));
        self
    }

    /// Sets the method; otherwise it is walks of the chain.
    pub fn method(mut self, method: Method) -> Self {
        self.settings.method = Some(method);
        self
    }

    /// Sets the number of cells; of a cube, per axis.
    pub fn cells(mut self, cells: usize) -> Self {
        self.settings.cells = Some(cells);
        self
    }

    /// Sets the degree of the polynomials on a cell.
    pub fn degree(mut self, degree: usize) -> Self {
        self.settings.degree = Some(degree);
        self
    }

    /// Sets how the neighbour equation treats pairs of cells.
    pub fn pairs(mut self, pairs: Pairs) -> Self {
        self.settings.pairs = Some(pairs);
        self
    }

    /// Sets q0, the probability that a walk is absorbed in a state; otherwise walks end by roulette.
    pub fn absorption(mut self, absorption: f64) -> Self {
        self.settings.absorption = Some(absorption);
        self
    }

    /// Sets what a walk with constant absorption scores.
    pub fn estimator(mut self, estimator: Estimator) -> Self {
        self.settings.estimator = Some(estimator);
        self
    }

    /// Sets the form of the control variate.
    pub fn form(mut self, form: Form) -> Self {
        self.settings.form = Some(form);
        self
    }

    /// Sets the number of walks of each functional; with an error, the most. 0: there are values without error bars, by cells alone.
    pub fn walks(mut self, walks: u64) -> Self {
        self.settings.walks = Some(walks);
        self
    }

    /// Sets whether all goals are answered from one set of walks, by the [global estimate](Self::whole). If nothing is said, they are
    /// where an error is asked for and that is predicted to take less time.
    ///
    /// ```
    /// use fredholm::{CubeModel, Solver};
    ///
    /// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    /// let report = Solver::new(&u).grid(5).cells(4).walks(5000).together(true).solve()?;
    /// assert!(report.whole.is_some() && report.goals[3].band.is_some());
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    pub fn together(mut self, together: bool) -> Self {
        self.settings.global = Some(together);
        self
    }

    /// Sets the seed of all draws; it is 1 otherwise.
    pub fn seed(mut self, seed: u64) -> Self {
        self.settings.seed = seed;
        self
    }

    /// Sets the number of walks of a batch, of which several that are resolvent walks are samples of their own: then others may run a part of
    /// them ([`execute`](Self::execute)).
    pub fn batch(mut self, walks: u64) -> Self {
        self.settings.batch = Some(walks);
        self
    }

    /// Sets the floating-point type of walks.
    pub fn scalar(mut self, scalar: Scalar) -> Self {
        self.settings.scalar = scalar;
        self
    }

    /// Sets the time after which walks end.
    pub fn time_limit(mut self, limit: Duration) -> Self {
        self.settings.time_limit = Some(limit);
        self
    }

    /// Allows walks of infinite variance, whose error bars mean nothing.
    pub fn allow_infinite_variance(mut self) -> Self {
        self.settings.allow_infinite_variance = true;
        self
    }

    /// Sets who sees what the solution is at, and may cancel it.
    pub fn observer(mut self, watch: &'m dyn SolveObserver) -> Self {
        self.watch = watch;
        self
    }

    /// Sets who runs the walks of the answer; the threads of this process otherwise. Pilots of a choice are run by these in
    /// any case.
    pub fn execute(mut self, execute: &'m dyn Execute) -> Self {
        self.execute = execute;
        self
    }

    /// Sets who keeps the solved system, so that it is solved once for many processes. Cells and a degree that are open are those of the system that is
    /// there, or are [chosen](Self::choose) for the one that is to be kept.
    pub fn systems(mut self, systems: &'m dyn SystemStore) -> Self {
        self.systems = Systems(Some(systems));
        self
    }

    /// Walks until no standard error is above this one, in the unit of u.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn solve_to(mut self, error: f64) -> Result<Report, SolveError> {
        self.settings.tolerance = Some(Tolerance::Absolute(error));
        self.solve()
    }

    /// Walks until no standard error is above this share of its estimate.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn solve_to_relative(mut self, share: f64) -> Result<Report, SolveError> {
        self.settings.tolerance = Some(Tolerance::Relative(share));
        self.solve()
    }

    /// Solves as the settings say: 100,000 walks of each functional, if they are silent.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn solve(&self) -> Result<Report, SolveError> {
        if !self.settings.sensitivities {
            return self.solve_targets();
        }
        self.check_sensitivities()?;
        self.with_derivatives(self.solve_targets())
    }

    pub(crate) fn solve_targets(&self) -> Result<Report, SolveError> {
        if let Some(global) = self.by_global() {
            return global.solve_targets();
        }
        let run = || -> Result<Report, SolveError> {
            self.check()?;
            if let Some(own) = self.on_kept_cells()? {
                return own.solve_targets();
            }
            self.systems.check(&self.settings)?;
            let targets = self.targets()?;
            let goals = self.goals(&targets)?;
            if let Some(of_temperatures) = self.of_temperatures(&goals)? {
                return of_temperatures.solve_targets();
            }
            let exact = goals.iter().map(|goal| self.model.exact_of(goal));
            let exact = exact.collect::<Result<Vec<_>, Error>>()?;
            if let Some(back) = asked_way_back(self.model, &self.settings, &goals)? {
                return self.of_model(&*back).solve_targets();
            }
            if self.settings.global == Some(true) {
                let (function, chosen) = self.chosen_whole()?;
                let whole = function.report(&goals)?;
                return self.reported(Report::of_whole(
                    (&function, whole),
                    &goals,
                    &self.settings,
                    (chosen.as_ref(), &self.means),
                )?);
            }
            let refused = match self.by_resolvent(&goals, false)? {
                ByResolvent::Answered(found) => {
                    return self.reported(self.report_of_resolvent(&goals, &exact, *found)?);
                }
                ByResolvent::Divided(found) => {
                    let (answer, settings, cells) = *found;
                    let run = Run {
                        model: self.model,
                        goals: &goals,
                        exact: &exact,
                        cells: &cells,
                        settings: &settings,
                        choice: None,
                        plain: false,
                    };
                    return self.reported(Report::new(&run, answer));
                }
                ByResolvent::Refused(error) => Some(error),
                ByResolvent::NotAsked => None,
            };
            let walked = self.solve_by_walks(&targets, &goals, &exact);
            walked.map_err(|error| resolvent::reason(error, refused))
        };
        self.explained(run())
    }

    /// The solver with what is open where a system is kept: cells and the degree of the one that is there, and the rest chosen; an error that is asked
    /// for ends the walks. `None`: nothing is open, or no walks with a system pay.
    pub(crate) fn on_kept_cells(&self) -> Result<Option<Self>, SolveError> {
        let Settings {
            cells,
            degree,
            pairs,
            last_step,
            tolerance,
            walks,
            ..
        } = self.settings;
        let is_endless = tolerance.is_some() && walks.is_none();
        let has_way = last_step.is_none() && self.has_last_steps();
        let has_cut = cells.is_none() || degree.is_none() || pairs.is_none();
        let is_open = has_cut || has_way || is_endless;
        let Some(store) = self.systems.0.filter(|_| is_open) else {
            return Ok(None);
        };
        let mut own = self.clone();
        if let Some(KeptCut { cells, degree }) = store.cut()? {
            own.settings.cells.get_or_insert(cells);
            own.settings.degree.get_or_insert(degree);
        }
        if let Some((settings, report)) = own.chosen()? {
            own.settings = settings;
            if is_endless {
                own.settings.walks = Some(ENDLESS);
            }
            own.watch.chosen(&own.settings, &report);
        }
        Ok((own.settings != self.settings).then_some(own))
    }

    /// Whether last steps to the light may be chosen.
    fn has_last_steps(&self) -> bool {
        matches!(self.model.about().last_steps, LastSteps::Open { pay: true })
    }

    /// The solver whose tolerance is that of walks for temperatures, if the error in kelvin of some is asked for.
    fn of_temperatures(&self, goals: &[Goal]) -> Result<Option<Self>, Error> {
        let tolerance = tolerance_of(self.settings.tolerance, goals)?;
        Ok((tolerance != self.settings.tolerance).then(|| {
            let mut own = self.clone();
            own.settings.tolerance = tolerance;
            own
        }))
    }

    /// Solves by walks of the chain.
    fn solve_by_walks(
        &self,
        targets: &[Target],
        goals: &[Goal],
        exact: &[Option<f64>],
    ) -> Result<Report, SolveError> {
        // A system that is kept is that of the settings as they are.
        let is_kept = self.systems.0.is_some();
        let back = self.way_back(goals);
        let by = (self.watch, self.execute);
        let may_be_whole = self.execute.takes_whole() && !self.settings.sensitivities;
        let (is_back, chosen) = match &back {
            _ if is_kept => (false, None),
            Some(back) => choice::solve_by_faster(
                [self.model, &**back],
                targets,
                goals,
                &self.settings,
                by,
                may_be_whole,
            )?,
            None => {
                let begun = (None, may_be_whole);
                let found =
                    choice::solve_either(self.model, targets, goals, &self.settings, by, begun)?;
                (false, found)
            }
        };
        let model = back.as_deref().filter(|_| is_back).unwrap_or(self.model);
        let (chosen, answer, cells) = match chosen {
            Some((chosen, Found::Separate(answer))) => {
                let cells = chosen.cells.clone();
                (Some(chosen), answer, cells)
            }
            Some((chosen, Found::Whole(function))) => {
                return self.reported(Report::of_whole(
                    (&function, function.report(goals)?),
                    goals,
                    &self.settings,
                    (Some(&chosen), &self.means),
                )?);
            }
            Some((_, Found::OtherWay(_))) => {
                return Err(Error::Internal("another way that nobody asked for").into());
            }
            None => self
                .walk(goals)
                .map(|(answer, cells)| (None, answer, cells))?,
        };
        let chosen = chosen.as_ref();
        let report = Report::new(
            &Run {
                model,
                goals,
                exact,
                cells: &cells,
                settings: chosen.map_or(&self.settings, |chosen| &chosen.settings),
                choice: chosen.map(|chosen| &chosen.report),
                plain: chosen.is_some_and(|chosen| chosen.plain),
            },
            answer,
        );
        self.reported(report)
    }

    /// The report as a result: an error if it is not all that was asked for.
    fn reported(&self, report: Report) -> Result<Report, SolveError> {
        let asks_error = self.settings.tolerance.is_some();
        match report.stop {
            StopReason::Cancelled => Err(SolveError::Cancelled(Some(Box::new(report)))),
            StopReason::ToleranceNotReached => Err(SolveError::NotReached(Box::new(report))),
            StopReason::TimeLimit if asks_error => Err(SolveError::NotReached(Box::new(report))),
            StopReason::TimeLimit | StopReason::Done => Ok(report),
        }
    }

    /// The statistics of the walks of every functional, with a default for what is open in place of a choice.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn answer(&self) -> Result<Answer, SolveError> {
        let run = || -> Result<Answer, SolveError> {
            self.check()?;
            let goals = self.goals(&self.targets()?)?;
            if let Some(back) = asked_way_back(self.model, &self.settings, &goals)? {
                return self.of_model(&*back).answer();
            }
            Ok(self.walk(&goals)?.0)
        };
        self.explained(run())
    }

    /// The settings that would be chosen for the error that is asked for, or else for the number of walks, and what they are predicted to take; the
    /// walks of the answer are not made. `None`: nothing is chosen by pilots, as nothing is open, or as walks of resolvents or a lift are asked for.
    ///
    /// ```
    /// use fredholm::{Choices, CubeModel, Method, Solver};
    ///
    /// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * (-(x[0] - y[0]).abs()).exp(), |_| 1.0);
    /// let solver = Solver::new(&u).at(0.3).method(Method::Walks).walks(10_000);
    /// let (settings, report) = solver.predict()?.expect("cells are open");
    /// assert_eq!((settings.walks, report.predicted_walks), (Some(10_000), 10_000.0));
    /// assert!(settings.cells.is_some());
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn predict(&self) -> Result<Option<(Settings, ChoiceReport)>, SolveError> {
        let mut own = self.clone();
        own.settings = own.settings.for_model(own.model);
        let run = || {
            own.check()?;
            let targets = own.targets()?;
            let goals = own.goals(&targets)?;
            let of_temperatures = own.of_temperatures(&goals)?;
            let settings = &of_temperatures.as_ref().unwrap_or(&own).settings;
            let back = asked_way_back(own.model, settings, &goals)?;
            let model = back.as_deref().unwrap_or(own.model);
            let kept = match (settings.cells, settings.degree, &back) {
                (Some(_), Some(_), None) => {
                    let cells = model.partition(&settings.discretisation())?;
                    own.systems.kept(&*cells, settings)?
                }
                _ => None,
            };
            let chosen = choice::choose_with(model, &targets, settings, own.watch, kept)?;
            Ok(chosen.map(|chosen| (chosen.settings, chosen.report)))
        };
        self.explained(run())
    }

    /// Predicts as [`predict`](Self::predict) does, for this standard error, in the unit of u.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn predict_to(
        mut self,
        error: f64,
    ) -> Result<Option<(Settings, ChoiceReport)>, SolveError> {
        self.settings.tolerance = Some(Tolerance::Absolute(error));
        self.predict()
    }

    /// The settings in which what separate pseudo-random walks without a lift leave open is chosen, as [`predict`](Self::predict) tells: for
    /// many solutions that differ by values of the equation and are to have the same draws. Where a neighbour equation does not pay, nothing changes.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn choose(&self) -> Result<Settings, SolveError> {
        let found = self.chosen()?.map(|(settings, _)| settings);
        Ok(found.unwrap_or_else(|| self.settings.clone()))
    }

    /// The settings of [`choose`](Self::choose), and what they are predicted to take. `None`: nothing is chosen, or such walks do not pay.
    fn chosen(&self) -> Result<Option<(Settings, ChoiceReport)>, SolveError> {
        let mut own = self.clone();
        own.settings.global = Some(false);
        own.settings.sequence.get_or_insert(Sequence::Random);
        own.settings.lift.get_or_insert(0);
        let found = own.predict()?;
        let found = found.filter(|(_, report)| report.is_preconditioned());
        // A choice says only that there is one.
        let none = self.has_last_steps().then_some(false);
        Ok(found.map(|(chosen, report)| {
            let settings = Settings {
                tolerance: self.settings.tolerance,
                walks: self.settings.walks,
                global: self.settings.global,
                sequence: self.settings.sequence,
                lift: self.settings.lift,
                last_step: chosen.last_step.or(none),
                ..chosen
            };
            (settings, report)
        }))
    }

    /// What was wrong with the functions of the equation, if that caused an error.
    pub(crate) fn explained<T>(&self, result: Result<T, SolveError>) -> Result<T, SolveError> {
        result.map_err(|error| match error {
            SolveError::Failed(error) => SolveError::Failed(self.model.explain(error)),
            error => error,
        })
    }

    /// Predicts the variance of every functional, and says what limits it: with [the settings](Self::choose) of separate walks, but with fewer cells where as
    /// many take more points.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn diagnose(&self) -> Result<Diagnosis, SolveError> {
        self.diagnose_in(NODES)
    }

    /// Predicts as [`diagnose`](Self::diagnose) does, with integrals in this number of points in place of 2,000: in 10 at least,
    /// and in more if there are many cells. Time and memory grow with its square.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn diagnose_in(&self, nodes: usize) -> Result<Diagnosis, SolveError> {
        let run = || -> Result<Diagnosis, SolveError> {
            self.check()?;
            self.check_direction()?;
            let goals = self.goals(&self.targets()?)?;
            let (model, settings) = (self.model, self.choose_to_diagnose(nodes)?);
            let nodes = nodes.max(LEAST_NODES);
            Ok(diagnose(model, &goals, &settings, nodes, self.watch)?)
        };
        self.explained(run())
    }

    /// The settings that are diagnosed with integrals in this number of points: those of [`choose`](Self::choose), but fewer cells where open ones would
    /// take more points.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn choose_to_diagnose(&self, nodes: usize) -> Result<Settings, SolveError> {
        let (model, own) = (self.model, &self.settings);
        let cells = model.partition(&own.discretisation())?;
        // What has no diagnosis, or a long one, says so before the choice.
        match own.cells {
            Some(_) => refuse_long(&*cells)?,
            None => {
                cells.examined_points()?;
            }
        }
        let mut chosen = match self.choose() {
            Ok(chosen) => chosen,
            Err(ended @ (SolveError::Cancelled(_) | SolveError::Failed(Error::Cancelled))) => {
                return Err(ended);
            }
            // The diagnosis tells why.
            Err(_) => own.clone(),
        };
        if own.cells.is_some() {
            return Ok(chosen);
        }
        let mut fewer = cells_to_choose(model, &chosen.discretisation(), None);
        fewer.retain(|&cells| chosen.cells.is_none_or(|most| cells < most));
        let points = |cut| model.partition(&cut)?.examined_points();
        while points(chosen.discretisation())? > nodes
            && let Some(cells) = fewer.pop()
        {
            chosen.cells = Some(cells);
        }
        Ok(chosen)
    }

    /// Measures how fast the standard deviation of the mean of u falls: with this number of walks on each of these numbers of
    /// cells, and deterministic solutions beside it, if the equation has some. The coarsest come first.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn sweep(&self, cells: &[usize], walks: u64) -> Result<Rates, SolveError> {
        let run = || -> Result<Rates, SolveError> {
            self.check()?;
            self.check_direction()?;
            let lift = self.settings.lifted();
            let sweep = Sweep {
                model: self.model,
                discretisation: self.settings.discretisation(),
                walk: self.settings.walk_options(),
                lift,
                // What a lift takes is no number of values of the kernel alone.
                timed: lift.map(|_| PLAIN_WALKS),
            };
            let (mut rows, mut estimates, mut exact) = (Vec::new(), Vec::new(), None);
            for &cells in cells {
                let level = sweep.level(cells, walks, self.watch)?;
                let level = level.ok_or(SolveError::Cancelled(None))?;
                exact = level.exact;
                estimates.push(level.statistics.preconditioned());
                rows.push(Row::new(&level, sweep.discretisation.degree));
            }
            let nystrom = self.model.nystrom()?;
            Ok(Rates::new(&sweep, (exact, &estimates), rows, nystrom))
        };
        self.explained(run())
    }

    /// Cells that fit into memory, and whose walks have finite variances.
    fn cut(&self, goals: &[Goal]) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
        let walk = self.settings.walk_options();
        let cells = self.model.partition(&self.settings.discretisation())?;
        let needed = cells.memory(goals, walk.pairs);
        let what = || format!("{} unknowns", cells.unknowns());
        refuse_beyond_memory(what, needed, self.model.about().less_memory)?;
        if !walk.allow_infinite_variance {
            cells.check_variance(&walk)?;
        }
        Ok(cells)
    }

    /// Walks where nothing is chosen.
    fn walk(&self, goals: &[Goal]) -> Result<(Answer, CellCount), Error> {
        let cells = self.cut(goals)?;
        let walk = self.settings.walk_options();
        let request = Request {
            goals,
            walk: &walk,
            wanted: match self.settings.sensitivities {
                true => Wanted::Derivatives,
                false => Wanted::All,
            },
        };
        let count = CellCount::of(&*cells);
        let execution = Execution {
            execute: self.execute,
            settings: &self.settings,
            plain: false,
            cells: &count,
            choice: None,
        };
        let walks = execution.walks(self.model);
        let solved = self.systems.solved(&*cells, &self.settings)?;
        Ok((solved.walk(&walks, &request, self.watch)?, count))
    }

    pub(crate) fn goals(&self, targets: &[Target]) -> Result<Vec<Goal>, Error> {
        let goals = goals(self.model, targets)?;
        self.model.check_goals(&goals)?;
        Ok(goals)
    }

    pub(crate) fn targets(&self) -> Result<Vec<Target>, Error> {
        if self.asked.is_empty() {
            return Err(Error::Region {
                message: "nothing is asked for: give a point, a mean or another functional"
                    .to_owned(),
            });
        }
        self.asked.iter().cloned().collect()
    }

    /// The number of a part.
    fn part(&self, name: &str) -> Result<usize, Error> {
        number("part", name, &|number| self.model.part(number))
    }
}

/// The number of what has this name, among the numbers that have one.
fn number<'m>(
    what: &str,
    name: &str,
    names: &dyn Fn(usize) -> Option<&'m str>,
) -> Result<usize, Error> {
    let all = || (0..).map_while(names);
    all().position(|known| known == name).ok_or_else(|| {
        let all: Vec<&str> = all().collect();
        let known = match all.len() {
            0 => format!("this equation has no {what}s"),
            _ => format!("the {what}s are {}", all.join(", ")),
        };
        Error::Region {
            message: format!("there is no {what} {name:?}: {known}"),
        }
    })
}
