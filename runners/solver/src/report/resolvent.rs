//! The report of resolvent walks.

use fredholm_core::{DEFAULT_GENERATOR, Estimate};
use fredholm_model::numbers::{aligned, short, with_error};
use fredholm_model::resolvent::{ResolventAnswer, ResolventEstimate};
use serde::Serialize;

use super::{Coordinates, EndingsReport, EstimateReport, GoalReport, Over, Report, word};
use crate::{Choices, Goal, Method, Model, Region, Settings};

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

impl Report {
    /// The report of resolvent walks.
    pub(crate) fn of_resolvent(
        model: &dyn Model,
        goals: &[Goal],
        exact: &[Option<f64>],
        settings: &Settings,
        answer: &ResolventAnswer,
    ) -> Self {
        let about = model.about();
        let own = goals.iter().zip(exact).zip(&answer.estimates);
        let reports = own.map(|((goal, &exact), estimate)| {
            GoalReport::of_resolvent(model, goal, exact, estimate, answer.floor(estimate.value))
        });
        Self {
            method: Method::Resolvent.word(),
            problem: about.kind,
            dimension: about.dimension,
            cells: answer.cells,
            unknowns: answer.unknowns,
            degree: answer.degree,
            lift: None,
            pairs: "no",
            absorption: None,
            estimator: "",
            form: "",
            scalar: settings.scalar.word(),
            generator: DEFAULT_GENERATOR,
            sequence: None,
            forced_steps: 0,
            last_step: false,
            adjoint: false,
            batch: 0,
            seed: settings.seed,
            part: None,
            stop: word(answer.stop),
            reason: None,
            sweeps: 0,
            residual: 0.0,
            shared: goals.len().max(1),
            states: answer.points + answer.steps,
            other_walks: 0,
            other_states: 0,
            setup_seconds: answer.setup_seconds,
            walk_seconds: answer.walk_seconds,
            goals: reports.collect(),
            choice: None,
            choice_text: String::new(),
            energy: None,
            resolvent: Some(ResolventReport {
                radius: answer.radius,
                condition: answer.condition,
                rounds: answer.rounds,
                points: answer.points,
                steps: answer.steps,
            }),
            whole: None,
        }
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
            "{}{}, {} cells{}, resolvent walks, {}, seed {}\n\n{}\
             {} points in {} round{}, {} steps beyond the first; radius {}, condition {}; set-up {} s, walks {} s\n",
            self.problem,
            self.dimension
                .map_or(String::new(), |d| format!(" of dimension {d}")),
            self.cells
                .saturating_pow(self.dimension.unwrap_or(1) as u32),
            match self.degree {
                0 => String::new(),
                degree => format!(" of degree {degree} ({} unknowns)", self.unknowns),
            },
            self.scalar,
            self.seed,
            aligned(&rows),
            found.points,
            found.rounds,
            if found.rounds == 1 { "" } else { "s" },
            found.steps,
            short(found.radius),
            short(found.condition),
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
        floor: f64,
    ) -> Self {
        let unit = model.unit();
        let none = EstimateReport {
            estimate: None,
            std_error: None,
            std_dev: None,
            unit,
        };
        let estimate = Estimate {
            estimate: found.value,
            std_error: Some(found.std_error),
            std_dev: None,
        };
        let error = exact.map(|exact| found.value - exact);
        let bar = found.std_error.max(floor);
        Self {
            name: goal.name.clone(),
            channel: None,
            at: Coordinates::new(model, &goal.region),
            position: model.position(&goal.region),
            over: Over::new(model, &goal.region),
            weight: match goal.region {
                Region::Weight(number) => model.weight(number).map(str::to_owned),
                _ => None,
            },
            exact,
            galerkin: found.known,
            walks: found.points,
            // An interval of 95 % has Student's t of one degree of freedom less than that.
            replicates: Some((found.freedom + 1.0).min(1e6) as u32),
            rounding_floor: floor,
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
            preconditioned: EstimateReport::new(estimate, found.points, unit),
            band: None,
            iterate: None,
            error,
            z: error.filter(|_| bar > 0.0).map(|error| error / bar),
            irradiance: None,
            net_flux: None,
            is_flux_given: false,
            temperature: None,
            radiant_temperature: None,
        }
    }
}
