//! On what a target depends, and how strongly.

use fredholm_core::Statistics;
use fredholm_model::Quantity;
use fredholm_model::numbers::{aligned, short, with_error};
use serde::Serialize;

use crate::answer::Answer;
use crate::report::Run;
use crate::{
    Ask, Budget, Error, GlobalQuantity, Goal, Method, Report, SolveError, Solver, Subject, Target,
    Uncertainty,
};

/// Rows in a table for people, about, and the most and the fewest of a target.
const ROWS: usize = 48;
const MOST: usize = 12;
const FEWEST: usize = 2;

/// The derivatives of all targets with respect to the quantities on which u depends.
///
/// The derivative u' of u with respect to a quantity λ solves u' = T_K u' + ∂F/∂λ + (∂T_K/∂λ) u. A walk from a target passes every surface that
/// could change it, and scores there what the change would do; [`fredholm_core::Sensitivities`] has the formula. Derivatives are unbiased. The
/// serialised names are stable; fields may be added.
///
/// ```
/// use fredholm::room::{Material, Surfaces};
/// use fredholm::{RoomModel, Scalar, Solver};
///
/// // A room all of whose walls have ρ = 0.6 and F = 0.4, so that u = F/(1 − ρ) = 1.
/// let wall = Material { reflectance: 0.6, emission: 0.4 };
/// let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
/// let room = RoomModel::new(Surfaces::default().with("wall", &corners, wall), Scalar::F64)?;
/// let all = Solver::new(&room).over("wall").walks(20_000).sensitivities()?;
/// // ∂u/∂ρ = F/(1 − ρ)² and ∂u/∂F = 1/(1 − ρ).
/// for (name, exact) in [("wall reflectance", 2.5), ("wall emission", 2.5)] {
///     let own = all.get("wall", name).unwrap();
///     let error = own.std_error.unwrap();
///     assert!((own.derivative - exact).abs() < 5.0 * error && error < 0.05);
/// }
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug, Serialize)]
pub struct Sensitivities {
    /// The derivatives, target by target, and of every target the largest first: by what the quantity as a whole contributes, |λ ∂u/∂λ|.
    pub derivatives: Vec<Sensitivity>,
    /// How uncertain the targets are since quantities are, if that was said of some.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub budgets: Vec<Budget>,
    /// The number of walks of each target.
    pub walks: u64,
    /// The number of states that they visited.
    pub states: u64,
    /// Seconds of the set-up.
    pub setup_seconds: f64,
    /// Seconds of the walks.
    pub walk_seconds: f64,
}

/// The derivative of a target with respect to a quantity.
///
/// ```
/// use fredholm::Sensitivity;
///
/// let own = Sensitivity {
///     target: "desk".to_owned(),
///     quantity: "lamp emission".to_owned(),
///     value: Some(100.0),
///     derivative: 0.02,
///     std_error: Some(1e-4),
///     unit: None,
///     uncertainty: None,
/// };
/// assert_eq!(own.contribution(), 2.0);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sensitivity {
    /// The name of the target.
    pub target: String,
    /// The name of the quantity: "floor reflectance".
    pub quantity: String,
    /// The value of the quantity, if all of it has one.
    pub value: Option<f64>,
    /// The derivative, in the unit of u over that of the quantity.
    pub derivative: f64,
    /// The standard error of the derivative; an interval of 95 % is 2 of them wide on each side. None, if no walk came by the quantity: then the
    /// derivative is 0 or rare.
    pub std_error: Option<f64>,
    /// The unit of the quantity, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// The standard error of the quantity, if it was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<f64>,
}

impl Sensitivity {
    /// λ ∂u/∂λ: by how much the target would change if the quantity grew by all of itself, to first order; the derivative itself where no
    /// value is known.
    #[must_use]
    pub fn contribution(&self) -> f64 {
        self.value.unwrap_or(1.0) * self.derivative
    }
}

impl Sensitivities {
    /// Takes the derivatives that walks have told beside their goals, if they have told any.
    pub(crate) fn of_walks(run: &Run<'_>, answer: &Answer) -> Option<Self> {
        let quantities = run.model.quantities();
        if answer.derivatives.is_empty() || quantities.is_empty() {
            return None;
        }
        let values = answer.derivatives.iter().map(|own| {
            let own = own.preconditioned();
            (own.estimate, own.std_error)
        });
        let statistics = answer.outcome.statistics.iter();
        let statistics = statistics.step_by(run.model.shared());
        Some(Self {
            derivatives: sorted(run.goals, &quantities, values),
            budgets: Vec::new(),
            walks: statistics.clone().map(Statistics::walks).sum(),
            states: statistics.map(Statistics::states).sum(),
            setup_seconds: answer.setup_seconds,
            walk_seconds: answer.walk_seconds,
        })
    }

    /// The derivatives that are the goals of a report: those of a target by all quantities follow each other, each in all channels, of which there
    /// are so many with their sum.
    fn of_report(report: &Report, goals: &[Goal], quantities: &[Quantity], shared: usize) -> Self {
        let own = |goal: usize, quantity: usize| {
            let (target, channel) = (goal / shared, goal % shared);
            let place = (target * quantities.len() + quantity) * shared + channel;
            let own = report.goals.get(place);
            own.map_or((f64::NAN, None), |own| (own.value(), Some(own.std_error())))
        };
        let goals_and =
            (0..goals.len()).flat_map(|goal| (0..quantities.len()).map(move |q| (goal, q)));
        let values = goals_and.map(|(goal, quantity)| own(goal, quantity));
        Self {
            derivatives: sorted(goals, quantities, values),
            budgets: Vec::new(),
            walks: report.walks(),
            states: report.states,
            setup_seconds: report.setup_seconds,
            walk_seconds: report.walk_seconds,
        }
    }

    /// The derivative of the target of this name with respect to the quantity of that name.
    #[must_use]
    pub fn get(&self, target: &str, quantity: &str) -> Option<&Sensitivity> {
        let mut all = self.derivatives.iter();
        all.find(|own| own.target == target && own.quantity == quantity)
    }

    /// A table for people: of every target the quantities that contribute most, and where some are uncertain how uncertain the targets are.
    #[must_use]
    pub fn table(&self) -> String {
        let has_budgets = !self.budgets.is_empty();
        let last = match has_budgets {
            true => ["known to", "target ±"].as_slice(),
            false => &["per 1 %"],
        };
        let head = ["target", "quantity", "value", "∂target/∂quantity"];
        let mut rows = vec![
            [&head, last]
                .concat()
                .iter()
                .map(|&own| own.to_owned())
                .collect(),
        ];
        let mut left = 0;
        let by_target = || self.derivatives.chunk_by(|a, b| a.target == b.target);
        let most = (ROWS / by_target().count().max(1)).clamp(FEWEST, MOST);
        for own in by_target() {
            let own = own.iter();
            let own = own.filter(|own| !has_budgets || own.uncertainty.is_some());
            let mut own: Vec<&Sensitivity> = own.collect();
            left += own.len().saturating_sub(most);
            if has_budgets {
                own.sort_by(|a, b| b.moved().total_cmp(&a.moved()));
            }
            rows.extend(own.iter().take(most).map(|own| own.row(has_budgets)));
        }
        let mut text = aligned(&rows);
        if left > 0 {
            text += &format!("{left} smaller ones are in the JSON\n");
        }
        if has_budgets {
            text += &self.table_of_budgets();
        }
        text
    }

    fn table_of_budgets(&self) -> String {
        let has_kelvin = self
            .budgets
            .iter()
            .any(|own| own.temperature_std_error.is_some());
        let head = [
            "target",
            "± by quantities",
            "± K",
            "most by",
            "± without it",
        ];
        let mut rows = vec![head.map(str::to_owned)];
        rows.extend(self.budgets.iter().map(|own| {
            [
                own.target.clone(),
                short(own.std_error),
                own.temperature_std_error.map_or(String::new(), short),
                own.largest.clone().unwrap_or_default(),
                short(own.without_largest),
            ]
        }));
        let columns = |row: [String; 5]| {
            let kept = row.into_iter().enumerate();
            kept.filter(|(column, _)| *column != 2 || has_kelvin)
                .map(|(_, text)| text)
                .collect()
        };
        let rows: Vec<Vec<String>> = rows.into_iter().map(columns).collect();
        format!("\n{}", aligned(&rows))
    }
}

impl Sensitivity {
    /// By how much the target moves with a standard error of the quantity; 0 if none is given.
    fn moved(&self) -> f64 {
        (self.uncertainty.unwrap_or(0.0) * self.derivative).abs()
    }

    /// A row of a table: with a budget, or with what 1 % of the quantity does.
    fn row(&self, has_budget: bool) -> Vec<String> {
        let unit = self.unit.map_or(String::new(), |unit| format!(" {unit}"));
        let with_unit = |value: f64| short(value) + &unit;
        let mut row = vec![
            self.target.clone(),
            self.quantity.clone(),
            self.value.map_or(String::new(), with_unit),
            with_error(self.derivative, self.std_error),
        ];
        if has_budget {
            row.push(self.uncertainty.map_or(String::new(), with_unit));
            row.push(short(self.moved()));
        } else {
            // With 0 there is no -0.
            let part = (self.value).map(|value| 0.01 * value * self.derivative + 0.0);
            row.push(part.map_or(String::new(), short));
        }
        row
    }
}

impl Solver<'_> {
    /// Sets whether the derivatives of all targets are wanted, too: [`Report::sensitivities`]. Then every target has walks of its own.
    pub fn with_sensitivities(mut self, are_wanted: bool) -> Self {
        self.settings.sensitivities = are_wanted;
        self
    }

    /// Sets how well quantities are known, and asks for sensitivities and [budgets](Budget) of the targets.
    pub fn uncertain(mut self, uncertainties: Vec<Uncertainty>) -> Self {
        self.settings.uncertainties = uncertainties;
        self.with_sensitivities(true)
    }

    /// Refuses sensitivities of an equation that has none, of targets that have none, and by walks that tell none.
    pub(crate) fn check_sensitivities(&self) -> Result<(), SolveError> {
        let refused = |message: &str| {
            let subject = Subject::Sensitivities;
            let message = format!("sensitivities {message}");
            Err(Error::Option { subject, message }.into())
        };
        let run = || -> Result<(), SolveError> {
            let settings = &self.settings;
            if settings.global == Some(true) || settings.adjoint == Some(true) {
                return refused(
                    "are told by walks from every target: leave `global` and `adjoint` out",
                );
            }
            if self.model.quantities().is_empty() {
                let what = match self.model.channels() {
                    [] => {
                        "are by quantities, and this equation names none, as `[problem.parameters]` would: leave them out"
                    }
                    _ => {
                        "are by quantities that all channels name: give all the same parameters, and lists of the same length"
                    }
                };
                return refused(what);
            }
            let goals = self.goals(&self.targets()?)?;
            if goals
                .iter()
                .any(|own| own.region.asked().0 == GlobalQuantity::Temperature)
            {
                return refused("are those of u: leave `ask = \"temperature\"` out");
            }
            let is_of_several = |goal: &Goal| {
                let (quantity, place) = goal.region.asked();
                let elements = self.model.exchange().map(|own| own.elements(place));
                let elements = elements.unwrap_or_default();
                let mut pairs = elements.windows(2);
                quantity == GlobalQuantity::NetFlux
                    && pairs.any(|pair| pair[0].surface != pair[1].surface)
            };
            if goals.iter().any(is_of_several) {
                return refused(
                    "are those of the net flux out of one surface: ask for each of them",
                );
            }
            let by_walks = self.walks_tell_derivatives()?;
            if by_walks && settings.method == Some(Method::Resolvent) {
                return refused("are told by walks of the equation's chain: leave `method` out");
            }
            if !by_walks && !self.execute.tells_all() {
                return refused(
                    "of formulas are solved after u, and no part of a run: leave them out, or run it as a whole",
                );
            }
            Ok(())
        };
        self.explained(run())
    }

    /// Whether derivatives are wanted that the equation's own walks tell.
    pub(crate) fn walks_tell_derivatives(&self) -> Result<bool, Error> {
        let is_wanted = self.settings.sensitivities && !self.model.quantities().is_empty();
        Ok(is_wanted && self.model.with_derivatives(&[])?.is_none())
    }

    /// A solution with the derivatives that its own walks do not tell.
    pub(crate) fn with_derivatives(
        &self,
        mut solved: Result<Report, SolveError>,
    ) -> Result<Report, SolveError> {
        let report = match &mut solved {
            Ok(report) => report,
            Err(SolveError::NotReached(report)) => &mut **report,
            Err(_) => return solved,
        };
        let run = || -> Result<Option<Sensitivities>, SolveError> {
            let goals = self.goals(&self.targets()?)?;
            let Some((model, derivatives)) = self.model.with_derivatives(&goals)? else {
                return Ok(None);
            };
            let targets = derivatives.iter().map(|goal| Target {
                name: goal.name.clone(),
                ask: Ask::One(goal.region.clone()),
            });
            let settings = self.settings.clone();
            let solver = Solver::with(&*model, settings, targets.collect());
            let solver = solver.observer(self.watch).execute(self.execute);
            let found = solver.solve_targets()?;
            let quantities = self.model.quantities();
            let shared = self.model.shared();
            Ok(Some(Sensitivities::of_report(
                &found,
                &goals,
                &quantities,
                shared,
            )))
        };
        match self.explained(run()) {
            Ok(found) => {
                report.sensitivities = found.or(report.sensitivities.take());
                report.add_budgets(&self.settings.uncertainties);
            }
            Err(SolveError::Cancelled(_)) => {
                return Err(SolveError::Cancelled(Some(Box::new(report.clone()))));
            }
            Err(error) => return Err(error),
        }
        solved
    }

    /// The derivatives of u at all targets with respect to the [quantities](crate::Model::quantities) on which it depends: of rooms and scenes
    /// reflectances and emissions of surfaces, or emissivities, temperatures and given net fluxes; of circles, spheres and tubes their parameters; of
    /// formulas theirs.
    ///
    /// They are those of [`solve`](Self::solve) [with them](Self::with_sensitivities): the walks of u tell them, so that a target error is that of u.
    /// Derivatives by parameters of formulas are the solutions of equations of their own, to which all settings belong.
    ///
    /// # Errors
    /// [`SolveError`]; [`Error::Option`], where the equation has no such quantities.
    pub fn sensitivities(&self) -> Result<Sensitivities, SolveError> {
        let report = self.clone().with_sensitivities(true).solve()?;
        let found = report.sensitivities;
        found.ok_or_else(|| Error::Internal("walks that told no derivatives").into())
    }
}

/// The derivatives of all goals by all quantities, of each the largest first.
fn sorted(
    goals: &[Goal],
    quantities: &[Quantity],
    mut values: impl Iterator<Item = (f64, Option<f64>)>,
) -> Vec<Sensitivity> {
    let mut all = Vec::new();
    for goal in goals {
        let own = quantities.iter().zip(values.by_ref());
        let own = own.map(|(quantity, (derivative, std_error))| Sensitivity {
            target: goal.name.clone(),
            quantity: quantity.name.clone(),
            value: quantity.value,
            derivative,
            std_error,
            unit: quantity.unit,
            uncertainty: None,
        });
        let mut own: Vec<Sensitivity> = own.collect();
        own.sort_by(|a, b| b.contribution().abs().total_cmp(&a.contribution().abs()));
        all.extend(own);
    }
    all
}
