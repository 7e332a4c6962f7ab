//! How uncertain targets are since quantities are.

use fredholm_model::heat::STEFAN_BOLTZMANN;
use serde::Serialize;

use crate::report::{Coordinates, GoalReport, Over};
use crate::{Report, Sensitivity, Uncertainty};

/// How uncertain a target is since quantities are, to first order, if their errors do not depend on each other.
///
/// With the standard errors σ_q of quantities the variance of the target is Σ (∂u/∂λ_q)² σ_q². The square of an estimated derivative is too large by
/// the square of its standard error, which is taken off.
///
/// ```
/// use fredholm::{CubeModel, Derivatives, Quantity, Solver, Uncertainty};
///
/// // u = a x ∫ y u dy + b x: u = b x/(1 − a/3).
/// let derivatives = Derivatives {
///     quantities: vec![Quantity::number("a", 0.5), Quantity::number("b", 1.0)],
///     kernel: Box::new(|q, _, x, y| [x[0] * y[0], 0.0][q]),
///     source: Box::new(|q, _, x| [0.0, x[0]][q]),
/// };
/// let u = CubeModel::on_interval([0.0, 1.0], |x, y| 0.5 * x * y, |x| x).with_derivatives(derivatives);
/// let known_to = |quantity: &str, std_error| Uncertainty { quantity: quantity.to_owned(), std_error };
/// let report = Solver::new(&u).at(0.5).uncertain(vec![known_to("a", 0.02), known_to("b", 0.01)]).solve()?;
/// let budget = &report.sensitivities.unwrap().budgets[0];
/// // ∂u/∂a = 0.24 and ∂u/∂b = 0.6.
/// assert!((budget.std_error - 0.0048_f64.hypot(0.006)).abs() < 1e-12);
/// assert_eq!(budget.largest.as_deref(), Some("b"));
/// assert!((budget.without_largest - 0.0048).abs() < 1e-12);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Budget {
    /// The name of the target.
    pub target: String,
    /// The standard error of the target by all uncertain quantities, in the unit of u.
    pub std_error: f64,
    /// The quantity that makes most of it: the one to be measured better.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest: Option<String>,
    /// The standard error that would be left if that were known exactly.
    pub without_largest: f64,
    /// The standard error of the temperature that follows from u, in kelvin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature_std_error: Option<f64>,
}

impl Report {
    /// Adds to the [sensitivities](Report::sensitivities), if there are some, how uncertain targets are since quantities are.
    pub fn add_budgets(&mut self, uncertainties: &[Uncertainty]) {
        let Some(all) = self
            .sensitivities
            .as_mut()
            .filter(|_| !uncertainties.is_empty())
        else {
            return;
        };
        all.budgets.clear();
        let by_target = |a: &Sensitivity, b: &Sensitivity| a.target == b.target;
        for own in all.derivatives.chunk_by_mut(by_target) {
            for sensitivity in &mut *own {
                let is_of = |known: &&Uncertainty| known.quantity == sensitivity.quantity;
                let known = uncertainties.iter().find(is_of);
                sensitivity.uncertainty = known.map(|known| known.std_error);
            }
            let goal = self
                .goals
                .iter()
                .find(|goal| own.first().is_some_and(|own| own.target == goal.name));
            all.budgets.extend(goal.map(|goal| Budget::of(own, goal)));
        }
    }
}

impl Budget {
    /// The budget of a goal with these derivatives.
    fn of(derivatives: &[Sensitivity], goal: &GoalReport) -> Self {
        let (mut variance, mut of_temperature) = (0.0, Some(0.0));
        let mut largest: (f64, Option<&str>) = (0.0, None);
        for own in derivatives {
            let Some(error) = own.uncertainty else {
                continue;
            };
            let part =
                |slope: f64, noise: f64| (slope * slope - noise * noise).max(0.0) * error * error;
            let noise = own.std_error.unwrap_or(0.0);
            let own_part = part(own.derivative, noise);
            variance += own_part;
            if own_part > largest.0 {
                largest = (own_part, Some(&own.quantity));
            }
            let slope = goal.temperature_slope(&own.quantity, own.derivative);
            let slope = slope.zip(goal.kelvin_per_u());
            let both = of_temperature.zip(slope);
            of_temperature = both.map(|(sum, (slope, scale))| sum + part(slope, scale * noise));
        }
        Self {
            target: goal.name.clone(),
            std_error: f64::sqrt(variance),
            largest: largest.1.map(str::to_owned),
            without_largest: (variance - largest.0).max(0.0).sqrt(),
            temperature_std_error: of_temperature
                .filter(|_| goal.any_temperature().is_some())
                .map(f64::sqrt),
        }
    }
}

impl GoalReport {
    /// The temperature that follows from u, in kelvin.
    pub(crate) fn any_temperature(&self) -> Option<f64> {
        self.temperature.or(self.radiant_temperature)?.estimate
    }

    /// The derivative of that temperature by u.
    pub(crate) fn kelvin_per_u(&self) -> Option<f64> {
        Some(0.25 / (STEFAN_BOLTZMANN * self.any_temperature()?.powi(3)))
    }

    /// The derivative of that temperature with respect to a quantity by which u has this derivative. A wall's own net flux hides in it, too.
    pub(crate) fn temperature_slope(&self, quantity: &str, of_u: f64) -> Option<f64> {
        let surface = match (&self.over, &self.at) {
            (Some(Over::Word(name)), _) => Some(name),
            (_, Some(Coordinates::On { surface, .. })) => Some(surface),
            _ => None,
        };
        let of_surface = surface.and_then(|name| quantity.strip_prefix(name.as_str()));
        let hidden = match of_surface {
            Some(" net flux") => self.hidden_by_flux?,
            _ => 0.0,
        };
        Some((of_u + hidden) * self.kelvin_per_u()?)
    }
}
