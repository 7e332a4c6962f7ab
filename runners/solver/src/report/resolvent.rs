//! The report of resolvent walks.

use core::fmt;

use fredholm_core::Estimate;
use fredholm_model::numbers::{aligned, short, with_error};
use fredholm_model::resolvent::{ResolventAnswer, ResolventEstimate, ResolventFigures};
use serde::Serialize;

use super::text::named;
use super::{EstimateReport, GoalReport, Report, Run};
use crate::answer::Answer;
use crate::{Goal, Model, Settings};

/// What resolvent walks knew and found.
///
/// ```
/// use fredholm::{CubeModel, Method, Solver};
///
/// // ‖K‖ is about 1.5.
/// let u = CubeModel::from_fn::<1>(|x, y| 2.0 * (-(x[0] - y[0]).powi(2)).exp(), |_| 1.0);
/// let report = Solver::new(&u).at(0.3).method(Method::Resolvent).solve_to(1e-8)?;
/// let found = report.resolvent.unwrap();
/// assert!(found.radius < 0.3 && found.condition > 1.0);
/// assert!((report.goals[0].preconditioned.estimate.unwrap() + 1.445_944_564).abs() < 5e-8);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ResolventReport {
    /// The spectral radius of (1 + |R|)|K − K_n|, estimated: below 1 walks have a mean.
    pub radius: f64,
    /// The condition number of I − K' in the maximum norm.
    pub condition: f64,
    /// The number of rounds.
    pub rounds: u32,
    /// The number of points in all.
    pub points: u64,
    /// The number of steps beyond the first.
    pub steps: u64,
}

impl ResolventReport {
    pub(crate) const fn new(answer: &ResolventAnswer) -> Self {
        Self {
            radius: answer.figures.radius,
            condition: answer.figures.condition,
            rounds: answer.rounds,
            points: answer.points,
            steps: answer.steps,
        }
    }
}

impl fmt::Display for ResolventReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} points in {} round{}, {} steps beyond the first; radius {}, condition {}",
            self.points,
            self.rounds,
            if self.rounds == 1 { "" } else { "s" },
            self.steps,
            short(self.radius),
            short(self.condition),
        )
    }
}

impl Report {
    /// The report of resolvent walks.
    pub(crate) fn of_resolvent(
        model: &dyn Model,
        goals: &[Goal],
        exact: &[Option<f64>],
        settings: &Settings,
        answer: &ResolventAnswer,
    ) -> Self {
        let own = goals.iter().zip(exact).zip(&answer.estimates);
        let reports = own.map(|((goal, &exact), estimate)| {
            GoalReport::of_resolvent(model, goal, exact, estimate)
        });
        Self {
            cells: answer.cells,
            unknowns: answer.figures.unknowns,
            degree: answer.degree,
            stop: answer.stop,
            reason: answer.reason.clone(),
            shared: goals.len().max(1),
            states: answer.points + answer.steps,
            setup_seconds: answer.setup_seconds,
            walk_seconds: answer.walk_seconds,
            goals: reports.collect(),
            resolvent: Some(ResolventReport::new(answer)),
            ..Self::empty(model, settings)
        }
    }

    /// The report of resolvent walks whose batches are samples of their own.
    pub(super) fn of_replicates(run: &Run<'_>, answer: &Answer, figures: ResolventFigures) -> Self {
        let settings = run.settings;
        let own = answer.outcome.statistics.iter().zip(&answer.galerkin);
        let estimates = own.zip(&answer.floors).map(|((statistics, known), floor)| {
            let found = statistics.preconditioned();
            ResolventEstimate {
                value: found.estimate,
                known: *known,
                floor: *floor,
                std_error: found.std_error.unwrap_or(f64::INFINITY),
                freedom: f64::from(statistics.replicates().max(1)) - 1.0,
                points: statistics.walks(),
            }
        });
        let first = answer.outcome.statistics.first().copied();
        let first = first.unwrap_or_default();
        let found = ResolventAnswer {
            estimates: estimates.collect(),
            cells: run.cells.cells,
            degree: settings.degree.unwrap_or(0),
            figures,
            points: first.walks(),
            steps: first.states().saturating_sub(first.walks()),
            rounds: first.replicates(),
            stop: answer.outcome.stop,
            reason: answer.gave_up.as_ref().map(ToString::to_string),
            setup_seconds: answer.setup_seconds,
            walk_seconds: answer.walk_seconds,
        };
        let mut report = Self {
            batch: settings.batch(),
            ..Self::of_resolvent(run.model, run.goals, run.exact, settings, &found)
        };
        let goals = report.goals.iter_mut().zip(&answer.outcome.statistics);
        goals.for_each(|(goal, all)| goal.preconditioned.std_dev = all.preconditioned().std_dev);
        report
    }

    /// The report of resolvent walks as a table for people.
    pub(super) fn resolvent_table(&self, found: &ResolventReport) -> String {
        let places = self.goals.iter().any(|goal| goal.place().is_some());
        let errors = self.goals.iter().any(|goal| goal.error.is_some());
        let mut head = vec!["target"];
        head.extend(places.then_some("at"));
        head.extend(["exact", "without walks", "estimate"]);
        if errors {
            head.extend(["error", "z"]);
        }
        let mut rows = vec![head.into_iter().map(str::to_owned).collect::<Vec<_>>()];
        for goal in &self.goals {
            let mut row = vec![goal.name.clone()];
            if places {
                row.push(goal.place().unwrap_or_default());
            }
            let found = &goal.preconditioned;
            row.extend([
                goal.exact
                    .map_or("-".to_owned(), |exact| format!("{exact:.7}")),
                format!("{:.7}", goal.galerkin),
                with_error(found.estimate.unwrap_or(f64::NAN), found.std_error),
            ]);
            if errors {
                row.extend([goal.error, goal.z].map(|x| x.map_or(String::new(), short)));
            }
            rows.push(row);
        }
        format!(
            "{}, {} cells{}, resolvent walks, {}, seed {}\n\n{}\
             {found}; set-up {} s, walks {} s\n",
            named(self.problem, self.dimension),
            self.cells
                .saturating_pow(self.dimension.unwrap_or(1) as u32),
            match self.degree {
                0 => String::new(),
                degree => format!(" of degree {degree} ({} unknowns)", self.unknowns),
            },
            self.scalar,
            self.seed,
            aligned(&rows),
            short(self.setup_seconds),
            short(self.walk_seconds),
        )
    }
}

impl GoalReport {
    fn of_resolvent(
        model: &dyn Model,
        goal: &Goal,
        exact: Option<f64>,
        found: &ResolventEstimate,
    ) -> Self {
        // Walks may know u better than numbers do.
        let bar = found.std_error.max(found.floor);
        let estimate = Estimate {
            estimate: found.value,
            std_error: Some(bar).filter(|error| error.is_finite()),
            std_dev: None,
        };
        Self {
            galerkin: found.known,
            walks: found.points,
            // An interval of 95 % has Student's t of one degree of freedom less than that.
            replicates: Some((found.freedom + 1.0).min(1e6) as u32),
            rounding_floor: found.floor,
            preconditioned: EstimateReport::new(estimate, found.points, model.about().unit),
            ..Self::of_value(model, goal, exact, (Some(found.value), Some(bar)))
        }
    }
}
