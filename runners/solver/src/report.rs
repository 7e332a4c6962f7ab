//! The report of a run: its data, which serialises with stable names, and its text for people.

mod chain;
mod columns;
mod csv;
mod energy;
mod faces;
mod mesh;
mod resolvent;
mod text;
mod times;
mod value;
mod whole;

pub use chain::ChainReport;
pub use columns::{Column, Columns};
pub use faces::{FacesReport, SurfaceFaces};
pub use resolvent::ResolventReport;
pub(crate) use text::named;
pub use times::{TargetAtTimes, TimesReport};
pub use whole::GlobalReport;

use fredholm_core::{DEFAULT_GENERATOR, Estimate, Statistics, StopReason};
use fredholm_rayon::Tail;
use serde::{Serialize, Serializer};

use crate::answer::Answer;
use crate::choice::ChoiceReport;
use crate::execute::CellCount;
use crate::{Choices, GlobalQuantity, Goal, Method, Model, Region, Sensitivities, Settings};
use fredholm_model::Heat;
use fredholm_model::heat::temperature_of;
use fredholm_model::numbers::with_decimals;

/// The relative standard error of an error bar from which on a report says so: Student's t of 1/(2·UNCERTAIN²) = 8 degrees
/// of freedom keeps 91 of 100 intervals of 95 %.
const UNCERTAIN: f64 = 0.25;
/// Fewer walks that scored are so few that a report says so.
const FEW_SCORES: u64 = 64;

/// The report of a run. The serialised names are stable; fields may be added.
///
/// ```
/// use fredholm::{CubeModel, Solver, StopReason};
///
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let report = Solver::new(&u).mean().cells(4).walks(5000).solve()?;
/// assert_eq!((report.cells, report.stop), (4, StopReason::Done));
/// assert!(report.goals[0].walks <= 5000);
/// assert!(report.to_string().contains("resolvent walks"));
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The name of the method: "walks", "paper", "global" or "resolvent".
    pub method: &'static str,
    /// The kind of the problem: "circle", "cube" or "room".
    pub problem: &'static str,
    /// The dimension d of a cube.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dimension: Option<usize>,
    /// The number of cells as the settings count them: of a cube, per axis. It is 0 for plain walks.
    pub cells: usize,
    /// The number of all unknowns: that of the cells if their degree is 0.
    pub unknowns: usize,
    /// The degree of the polynomials on the cells.
    pub degree: usize,
    /// How walks of a chain were made, if these answer.
    #[serde(flatten)]
    pub chain: Option<ChainReport>,
    /// The name of the walks' floating-point type.
    pub scalar: &'static str,
    /// The name of the random number generator.
    pub generator: &'static str,
    /// The number of walks of a batch.
    pub batch: u64,
    /// The seed of the walks.
    pub seed: u64,
    /// The part of a run that this is, "3/64", if it is not the whole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// Why the walks ended: in JSON "done", "error_not_reached", "time_limit" or "cancelled".
    #[serde(serialize_with = "word_of")]
    pub stop: StopReason,
    /// Why the tolerance was not reached, if it was neither the number of walks, nor a time limit, nor a cancellation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The number of Gauss–Seidel sweeps of the Galerkin system; 0 of a global estimate, which does not tell it.
    pub sweeps: u32,
    /// The largest residual of the Galerkin system after the last sweep; NaN of a global estimate.
    pub residual: f64,
    /// The number of visited states over all goals, starts included; what several goals share counts once.
    pub states: u64,
    /// The number of walks besides those of the goals, for irradiances and net fluxes.
    #[serde(skip_serializing_if = "is_zero")]
    pub other_walks: u64,
    /// The number of states that these visited.
    #[serde(skip_serializing_if = "is_zero")]
    pub other_states: u64,
    /// Seconds of the set-up.
    pub setup_seconds: f64,
    /// Seconds of the walks.
    pub walk_seconds: f64,
    /// The report of every goal.
    #[serde(rename = "targets")]
    pub goals: Vec<GoalReport>,
    /// The report of the choice, if settings were chosen.
    #[serde(rename = "split", skip_serializing_if = "Option::is_none")]
    pub choice: Option<ChoiceReport>,
    /// The number of goals that share their walks. It is not serialised.
    #[serde(skip)]
    pub shared: usize,
    /// The choice in words, or nothing. It is not serialised.
    #[serde(skip)]
    pub choice_text: String,
    /// The energy balance of a room with temperatures.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub energy: Option<EnergyReport>,
    /// What resolvent walks knew and found, if these answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resolvent: Option<ResolventReport>,
    /// On what the targets depend, if that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensitivities: Option<Sensitivities>,
    /// The report of the global estimate, if one set of walks answers all goals; of it the summary is serialised.
    #[serde(
        serialize_with = "whole::summary",
        skip_serializing_if = "Option::is_none"
    )]
    pub whole: Option<Box<GlobalReport>>,
}

/// Whether a number is 0: of serialisers, which pass a reference.
pub(crate) fn is_zero<T: PartialEq + Default>(count: &T) -> bool {
    *count == T::default()
}

/// The report of one goal. A grid has one for every point.
#[derive(Clone, Debug, Serialize)]
pub struct GoalReport {
    /// The goal's name; of several channels, the target's and that of the channel.
    pub name: String,
    /// What is asked for, if it is not u: "irradiance", "net_flux", "temperature" or "transmission".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ask: Option<&'static str>,
    /// The name of the channel, or of the sum of all, if there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
    /// The point, if the goal is u at a point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<Coordinates>,
    /// The place in the drawing of a room, in the unit of its vertices, if the goal is u at a point of a wall.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<Vec<f64>>,
    /// The corners of a cell of a scene, in their order around it.
    #[serde(skip)]
    pub corners: Vec<[f64; 3]>,
    /// The region, if the goal is a mean over one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over: Option<Over>,
    /// The formula of the weight, if the goal is a weighted integral.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weight: Option<String>,
    /// The exact value, if it is known.
    pub exact: Option<f64>,
    /// The value (v, Φ) of the Galerkin solution; NaN if there is none.
    pub galerkin: f64,
    /// The number of walks.
    pub walks: u64,
    /// The number of replicates whose means are the independent samples, if walks draw from a sequence: an interval of 95 % is
    /// the quantile of Student's t, with one degree of freedom less than that, times the standard error wide on each side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replicates: Option<u32>,
    /// The error that rounding leaves, which more walks do not lower.
    pub rounding_floor: f64,
    /// The share that one of 16 or more batches has in the variance, if it is so large that the error bar may mean nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub doubtful_share: Option<f64>,
    /// The tail index of the scores, if an error bar may mean nothing: their variance is infinite below 2.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tail_index: Option<f64>,
    /// The excess kurtosis of ζ, if it is so large that the error bar is itself uncertain by more than a quarter: a few large
    /// scores make much of the variance, and fewer walks would have missed them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excess_kurtosis: Option<f64>,
    /// The number of walks that scored at all, if it is so small that the error bar means little.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub few_scores: Option<u64>,
    /// Whether ζ was the same in all walks, but for rounding: they tell no error, but how rare a difference is.
    #[serde(skip_serializing_if = "core::ops::Not::not")]
    pub no_difference: bool,
    /// The numbers of walks by how they ended.
    pub endings: EndingsReport,
    /// The estimate by plain walks.
    pub plain: EstimateReport,
    /// The estimate by preconditioned walks.
    pub preconditioned: EstimateReport,
    /// Half of the width of the band that holds at all points of the space together, of a point of a global estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub band: Option<f64>,
    /// The deterministic part F + T_K v of a global estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iterate: Option<f64>,
    /// How far the iterate moved with the last finer rule: see [`GlobalValue`](crate::GlobalValue).
    #[serde(skip)]
    pub quadrature_error: f64,
    /// The estimate by preconditioned walks minus the exact value, if that is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// The error in standard errors, or in rounding floors where those are larger.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub z: Option<f64>,
    /// The irradiance ∫ of the arriving u, in rooms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub irradiance: Option<EstimateReport>,
    /// The net flux out of the wall in W/m², of a surface in the mean, in rooms with temperatures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub net_flux: Option<EstimateReport>,
    /// Whether that is given, and no result.
    #[serde(skip)]
    pub is_flux_given: bool,
    /// The temperature in kelvin of a wall from which the net flux is given; of a mean, that of the mean of T⁴.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature: Option<EstimateReport>,
    /// The mean radiant temperature in kelvin at a point in the air, where there are temperatures; the plane radiant one of what
    /// faces in a direction there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radiant_temperature: Option<EstimateReport>,
    /// 1/ε − 1 of a wall from which the net flux is given: by how much more than u its σT⁴ grows with that.
    #[serde(skip)]
    pub hidden_by_flux: Option<f64>,
}

/// A point: coordinates, or a place on a surface.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum Coordinates {
    /// The coordinates of a point: the angle on a circle, those of a point of a cube, or of one between the walls of a room.
    Many(Vec<f64>),
    /// A place on a surface of a room.
    On {
        /// The surface's name.
        surface: String,
        /// The share of the surface's length.
        t: f64,
    },
}

/// The region of a mean.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum Over {
    /// An interval of angles.
    Interval([f64; 2]),
    /// The name of a part, or "all".
    Word(String),
    /// The names of several parts.
    Words(Vec<String>),
}

/// The numbers of walks by how they ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct EndingsReport {
    /// The number of absorbed walks.
    pub absorbed: u64,
    /// The number of walks that the step limit cut off.
    pub step_limit: u64,
}

/// An estimate. A number is `None` if there were too few walks for it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct EstimateReport {
    /// The estimate.
    pub estimate: Option<f64>,
    /// The standard error of the estimate.
    pub std_error: Option<f64>,
    /// The standard deviation of one walk.
    pub std_dev: Option<f64>,
    /// The unit of all three, if they have one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
}

/// The energy balance of a room.
#[derive(Clone, Debug, Serialize)]
pub struct EnergyReport {
    /// The net flux of every surface.
    pub surfaces: Vec<SurfaceReport>,
    /// The sum of all net fluxes: 0 in a closed room.
    pub energy_balance: Option<EstimateReport>,
    /// The unit of all of them: W, or W per metre of depth.
    #[serde(skip)]
    pub unit: &'static str,
}

/// The net flux of one surface.
#[derive(Clone, Debug, Serialize)]
pub struct SurfaceReport {
    /// The surface's name.
    pub name: String,
    /// The number of walks; 0 if the net flux is given.
    pub walks: u64,
    /// The net flux out of the surface; `None` if its material changes.
    pub net_flux: Option<EstimateReport>,
    /// Whether that is given, and no result.
    #[serde(skip_serializing_if = "core::ops::Not::not")]
    pub is_given: bool,
}

/// A run: everything that a report tells, apart from the answer.
#[derive(Clone, Copy, Debug)]
pub struct Run<'a> {
    /// The equation.
    pub model: &'a dyn Model,
    /// The goals of the walks.
    pub goals: &'a [Goal],
    /// The exact value of every goal, if it is known.
    pub exact: &'a [Option<f64>],
    /// The cells of the neighbour equation.
    pub cells: &'a CellCount,
    /// The settings, in which nothing is open.
    pub settings: &'a Settings,
    /// The choice, if settings were chosen.
    pub choice: Option<&'a ChoiceReport>,
    /// Whether walks followed no neighbour equation.
    pub plain: bool,
}

impl Report {
    /// The number of walks over all goals, of which those that several goals share count once.
    #[must_use]
    pub fn walks(&self) -> u64 {
        let firsts = self.goals.iter().step_by(self.shared.max(1));
        firsts.map(|goal| goal.walks).sum()
    }

    /// The report of a run and its answer.
    #[must_use]
    pub fn new(run: &Run<'_>, answer: Answer) -> Self {
        if let Some(figures) = answer.resolvent {
            return Self::of_replicates(run, &answer, figures);
        }
        let Run {
            model,
            goals,
            exact,
            cells,
            settings,
            choice,
            plain,
        } = *run;
        let walk = settings.walk_options();
        let statistics = answer.outcome.statistics.iter();
        let mut reports: Vec<GoalReport> = goals
            .iter()
            .zip(exact.iter().zip(&answer.galerkin))
            .zip(statistics.clone().zip(&answer.floors))
            .map(|((goal, (&exact, &galerkin)), (statistics, &floor))| {
                GoalReport::new(model, goal, exact, galerkin, statistics, floor)
            })
            .collect();
        for (report, tail) in reports.iter_mut().zip(&answer.outcome.tails) {
            if !report.no_difference {
                report.doubt(tail);
            }
        }
        for (report, heat) in reports.iter_mut().zip(&answer.derived.heat) {
            report.add(heat, model, report.walks);
        }
        reports.iter_mut().for_each(GoalReport::show_temperature);
        let sensitivities = Sensitivities::of_walks(run, &answer);
        // They may share the walks of the goals.
        let own = if model.shared() > goals.len() {
            0
        } else {
            usize::MAX
        };
        let others = || answer.others.iter().take(own);
        Self {
            method: match settings.method {
                Some(Method::Paper) => Method::Paper.word(),
                _ => Method::Walks.word(),
            },
            cells: if plain { 0 } else { cells.cells },
            unknowns: if plain { 0 } else { cells.unknowns },
            degree: settings.discretisation().degree,
            chain: Some(ChainReport {
                adjoint: model.about().is_adjoint,
                ..match plain {
                    true => ChainReport::plain(&walk),
                    false => ChainReport::new(&walk, settings.lifted()),
                }
            }),
            batch: walk.batch,
            stop: answer.outcome.stop,
            reason: answer.gave_up.map(|why| why.to_string()),
            sweeps: answer.convergence.sweeps,
            residual: answer.convergence.residual,
            shared: model.shared(),
            states: statistics
                .step_by(model.shared())
                .map(Statistics::states)
                .sum(),
            other_walks: others().map(Statistics::walks).sum(),
            other_states: others().map(Statistics::states).sum(),
            setup_seconds: answer.setup_seconds,
            walk_seconds: answer.walk_seconds,
            choice: choice.cloned(),
            choice_text: choice.map_or(String::new(), |choice| choice.text(settings, &cells.text)),
            energy: EnergyReport::new(answer.derived.fluxes, model.about().flux_unit),
            sensitivities,
            goals: reports,
            ..Self::empty(model, settings)
        }
    }

    /// The report of an equation without any walk.
    fn empty(model: &dyn Model, settings: &Settings) -> Self {
        let about = model.about();
        Self {
            method: Method::Resolvent.word(),
            problem: about.kind,
            dimension: about.dimension,
            cells: 0,
            unknowns: 0,
            degree: 0,
            chain: None,
            scalar: settings.scalar.word(),
            generator: DEFAULT_GENERATOR,
            batch: 0,
            seed: settings.seed,
            part: None,
            stop: StopReason::Done,
            reason: None,
            sweeps: 0,
            residual: 0.0,
            states: 0,
            other_walks: 0,
            other_states: 0,
            setup_seconds: 0.0,
            walk_seconds: 0.0,
            goals: Vec::new(),
            choice: None,
            shared: 1,
            choice_text: String::new(),
            energy: None,
            resolvent: None,
            sensitivities: None,
            whole: None,
        }
    }
}

/// Writes the name of a reason why walks ended.
pub(crate) fn word_of<S: Serializer>(stop: &StopReason, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(match stop {
        StopReason::Done => "done",
        StopReason::ToleranceNotReached => "error_not_reached",
        StopReason::TimeLimit => "time_limit",
        StopReason::Cancelled => "cancelled",
    })
}

/// The unit of what a goal asks for.
fn unit_of(model: &dyn Model, goal: &Goal) -> Option<&'static str> {
    match goal.region.asked().0 {
        GlobalQuantity::Irradiance => model.about().irradiance_unit,
        GlobalQuantity::Transmission => None,
        _ => model.about().unit,
    }
}

impl GoalReport {
    fn new(
        model: &dyn Model,
        goal: &Goal,
        exact: Option<f64>,
        galerkin: f64,
        statistics: &Statistics,
        rounding_floor: f64,
    ) -> Self {
        let walks = statistics.walks();
        let unit = unit_of(model, goal);
        let preconditioned = EstimateReport::new(statistics.preconditioned(), walks, unit);
        let bar = preconditioned.std_error.map(|own| own.max(rounding_floor));
        let deviation = preconditioned.std_error.and(preconditioned.std_dev);
        // Plain walks that agree, too, are certain.
        let deviation = deviation.filter(|_| statistics.plain().std_dev != Some(0.0));
        Self {
            channel: goal
                .channel
                .and_then(|channel| model.channels().get(channel).cloned()),
            galerkin,
            walks,
            replicates: Some(statistics.replicates()).filter(|&count| count > 0),
            rounding_floor,
            few_scores: Some(statistics.scored()).filter(|&scored| scored < walks.min(FEW_SCORES)),
            no_difference: statistics.replicates() == 0
                && deviation.is_some_and(|deviation| deviation <= rounding_floor),
            endings: EndingsReport::new(statistics),
            plain: EstimateReport::new(statistics.plain(), walks, unit),
            preconditioned,
            ..Self::of_value(model, goal, exact, (preconditioned.estimate, bar))
        }
    }

    /// The report of a goal without walks, whose value with its error bar is compared with the exact one.
    fn of_value(
        model: &dyn Model,
        goal: &Goal,
        exact: Option<f64>,
        (value, bar): (Option<f64>, Option<f64>),
    ) -> Self {
        let none = EstimateReport {
            estimate: None,
            std_error: None,
            std_dev: None,
            unit: unit_of(model, goal),
        };
        let (quantity, place) = goal.region.asked();
        let error = value.zip(exact).map(|(value, exact)| value - exact);
        let bar = bar.filter(|&bar| bar > 0.0);
        Self {
            name: goal.name.clone(),
            ask: (quantity != GlobalQuantity::U).then(|| quantity.word()),
            channel: None,
            at: Coordinates::new(model, place),
            position: model.position(place),
            corners: Vec::new(),
            over: Over::new(model, place),
            weight: match *place {
                Region::Weight(number) => model.weight(number).map(str::to_owned),
                _ => None,
            },
            exact,
            galerkin: f64::NAN,
            walks: 0,
            replicates: None,
            rounding_floor: 0.0,
            doubtful_share: None,
            tail_index: None,
            excess_kurtosis: None,
            few_scores: None,
            no_difference: false,
            endings: EndingsReport {
                absorbed: 0,
                step_limit: 0,
            },
            plain: none,
            preconditioned: none,
            band: None,
            iterate: None,
            quadrature_error: 0.0,
            error,
            z: error.zip(bar).map(|(error, bar)| error / bar),
            irradiance: None,
            net_flux: None,
            is_flux_given: false,
            temperature: None,
            radiant_temperature: None,
            hidden_by_flux: None,
        }
    }

    /// Adds what follows from u and from the irradiance, by this number of walks.
    fn add(&mut self, heat: &Heat, model: &dyn Model, walks: u64) {
        let of = |found: Option<Estimate>, unit| Some(EstimateReport::new(found?, walks, unit));
        self.irradiance = of(heat.irradiance, model.about().irradiance_unit);
        // Of a transmission it is the conductance.
        let is_passed = self.ask == Some(GlobalQuantity::Transmission.word());
        let unit = if is_passed {
            Some("l/s")
        } else {
            model.about().unit
        };
        self.net_flux = of(heat.net_flux, unit);
        self.is_flux_given = heat.is_flux_given;
        self.temperature = of(heat.temperature, Some("K"));
        self.hidden_by_flux = heat.hidden_by_flux;
        self.radiant_temperature = of(heat.radiant_temperature, Some("K"));
    }

    /// Puts the temperature in the place of σT⁴, where that is asked for.
    pub(super) fn show_temperature(&mut self) {
        if self.ask != Some(GlobalQuantity::Temperature.word()) {
            return;
        }
        let of = |x: f64, std_error: Option<f64>, std_dev: Option<f64>| {
            let estimate = x;
            temperature_of(Estimate {
                estimate,
                std_error,
                std_dev,
            })
        };
        let alone = |x: f64| of(x, None, None).map(|own| own.estimate);
        // In kelvin per unit of σT⁴.
        let slope = of(self.value(), Some(1.0), None).and_then(|own| own.std_error);
        let slope = slope.unwrap_or(f64::NAN);
        for report in [&mut self.plain, &mut self.preconditioned] {
            let own = report
                .estimate
                .and_then(|x| of(x, report.std_error, report.std_dev));
            *report = EstimateReport {
                estimate: own.map(|own| own.estimate),
                std_error: own.and_then(|own| own.std_error),
                std_dev: own.and_then(|own| own.std_dev),
                unit: Some("K"),
            };
        }
        self.exact = self.exact.and_then(alone);
        self.galerkin = alone(self.galerkin).unwrap_or(f64::NAN);
        self.iterate = self.iterate.and_then(alone);
        self.band = self.band.map(|band| band * slope);
        let own = self.preconditioned.estimate.zip(self.exact);
        self.error = own.map(|(own, exact)| own - exact);
        self.rounding_floor *= slope;
        self.quadrature_error *= slope;
    }

    /// What there is of heat, and whether it is given.
    const fn heat(&self) -> [(Option<EstimateReport>, bool); 4] {
        [
            (self.irradiance, false),
            (self.net_flux, self.is_flux_given),
            (self.temperature, false),
            (self.radiant_temperature, false),
        ]
    }

    /// Says what the tail of the scores leaves of the error bar.
    fn doubt(&mut self, tail: &Tail) {
        if tail.is_doubtful() {
            self.doubtful_share = Some(tail.share());
            self.tail_index = tail.index();
        }
        let uncertain = tail.uncertainty().filter(|&error| error > UNCERTAIN);
        self.excess_kurtosis = uncertain.map(|error| 4.0 * error * error * self.walks as f64 - 2.0);
    }
}

impl Coordinates {
    fn new(model: &dyn Model, region: &Region) -> Option<Self> {
        match region {
            Region::Point(x) => Some(Self::Many(x.clone())),
            Region::On(surface, t) => model.part(*surface).map(|surface| Self::On {
                surface: surface.to_owned(),
                t: *t,
            }),
            _ => None,
        }
    }

    /// The point for a table of people.
    pub(crate) fn text(&self) -> String {
        let few = |&x: &f64| with_decimals(x, 6);
        match self {
            Self::Many(x) => x.iter().map(few).collect::<Vec<_>>().join(", "),
            Self::On { surface, t } => format!("{surface} {}", few(t)),
        }
    }

    /// The abscissa of a point of a grid.
    #[must_use]
    pub fn first(&self) -> Option<f64> {
        match self {
            Self::Many(x) => x.first().copied(),
            Self::On { t, .. } => Some(*t),
        }
    }
}

impl Over {
    fn new(model: &dyn Model, region: &Region) -> Option<Self> {
        let name = |&part: &usize| model.part(part).map(str::to_owned);
        match region {
            Region::Arc(from, to) => Some(Self::Interval([*from, *to])),
            Region::Whole => Some(Self::Word("all".to_owned())),
            Region::Part(part) => name(part).map(Self::Word),
            Region::Parts(parts) => parts
                .iter()
                .map(name)
                .collect::<Option<_>>()
                .map(Self::Words),
            _ => None,
        }
    }
}

impl EndingsReport {
    const fn new(statistics: &Statistics) -> Self {
        let endings = statistics.terminations();
        Self {
            absorbed: endings.absorbed,
            step_limit: endings.step_limit,
        }
    }
}

impl EstimateReport {
    /// The report of an estimate by this number of walks.
    fn new(estimate: Estimate, walks: u64, unit: Option<&'static str>) -> Self {
        Self {
            estimate: (walks > 0).then_some(estimate.estimate),
            std_error: estimate.std_error,
            std_dev: estimate.std_dev,
            unit,
        }
    }
}
