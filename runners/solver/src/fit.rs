//! Quantities from measured targets, by least squares.

use web_time::Instant;

use fredholm_model::numbers::{NORMAL, aligned, short, with_error};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use serde::Serialize;

use crate::{Error, Quantity, Report, SolveError, Subject, Uncertainty};

/// The relative change of parameters and of the sum of squares at which a fit ends.
const TOLERANCE: f64 = 1e-4;
/// Solutions that a fit of one quantity takes at most, and as many more for each further one.
const PATIENCE: usize = 20;
/// The part of a standard error that a last step may still move a quantity by, besides what walks make of it.
const SETTLED: f64 = 0.1;
/// The normal deviate of that.
const OF_WALKS: f64 = 3.0;
/// The share of a range that a start keeps from its ends.
const INSIDE: f64 = 1e-3;
/// The normal deviate that is exceeded once in a thousand times.
const SELDOM: f64 = 3.09;

/// What was measured at a target.
///
/// ```
/// use fredholm::{Measured, Measurement};
///
/// let thermocouple = Measurement {
///     target: "roof".to_owned(),
///     what: Measured::Temperature,
///     value: 1012.0,
///     std_error: 3.0,
/// };
/// assert_eq!(thermocouple.what, Measured::Temperature);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// The name of the target.
    pub target: String,
    /// What of it was measured.
    pub what: Measured,
    /// The number that was found, in the unit of u or in kelvin.
    pub value: f64,
    /// The standard error of the number.
    pub std_error: f64,
}

/// A number of a target that can be measured.
///
/// ```
/// assert_ne!(fredholm::Measured::Value, fredholm::Measured::Temperature);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measured {
    /// u.
    Value,
    /// The temperature that follows from u, in kelvin.
    Temperature,
}

/// A quantity that is looked for: its name and range, the value from which the search starts, and its standard error there if something is known of it
/// besides the measurements.
///
/// ```
/// use fredholm::{Quantity, Unknown};
///
/// // Between 0 and 1, and 0.6 ± 0.1 by the maker's table.
/// let emissivity = Quantity { range: [0.0, 1.0], ..Quantity::number("floor emissivity", 0.6) };
/// let unknown = Unknown { quantity: emissivity, known_to: Some(0.1) };
/// assert_eq!(unknown.quantity.value, Some(0.6));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// The quantity, whose value is the start.
    pub quantity: Quantity,
    /// The standard error of that value, if it is more than a start.
    pub known_to: Option<f64>,
}

/// The question of a fit: which quantities have been measured by these targets.
///
/// With measurements m, their errors and those of walks, and the errors of quantities that are uncertain and not looked for, all of them independent,
///
/// ```text
/// χ²(λ) = (u(λ) − m)ᵀ C⁻¹ (u(λ) − m),      C = diag(σ_m² + σ_walks²) + Σ_q σ_q² ∂u/∂λ_q (∂u/∂λ_q)ᵀ,
/// ```
///
/// to which a quantity with a [standard error](Unknown::known_to) adds ((λ − λ_0)/σ)². It is made least by the method of Levenberg and Marquardt
/// with the derivatives that the walks tell; a quantity stays within its range by a transformation. The covariance of the quantities is (Jᵀ C⁻¹ J)⁻¹, J
/// being ∂u/∂λ, so that it holds the noise of walks, too.
///
/// ```
/// use fredholm::{CubeModel, Derivatives, Fitting, Measured, Measurement, Quantity, Solver, Unknown};
///
/// // u = a x ∫ y u dy + x: u = x/(1 − a/3), and u(½) was measured as 0.6.
/// let a = |a: f64| Quantity::number("a", a);
/// let fitting = Fitting {
///     unknowns: vec![Unknown { quantity: a(0.2), known_to: None }],
///     measurements: vec![Measurement { target: "u(0.5)".to_owned(), what: Measured::Value, value: 0.6, std_error: 0.006 }],
///     uncertainties: Vec::new(),
/// };
/// let fit = fitting.fit(&mut |values| {
///     let value = values[0];
///     let derivatives = Derivatives {
///         quantities: vec![a(value)],
///         kernel: Box::new(|_, _, x, y| x[0] * y[0]),
///         source: Box::new(|_, _, _| 0.0),
///     };
///     let u = CubeModel::on_interval([0.0, 1.0], move |x, y| value * x * y, |x| x).with_derivatives(derivatives);
///     Solver::new(&u).at(0.5).with_sensitivities(true).solve()
/// })?;
/// // a = 3 − 3/(2 · 0.6) = ½, and ∂u/∂a = 0.24 there.
/// let found = &fit.quantities[0];
/// assert!((found.value - 0.5).abs() < 1e-6 && (found.std_error - 0.006 / 0.24).abs() < 1e-6);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Fitting {
    /// The quantities that are looked for.
    pub unknowns: Vec<Unknown>,
    /// The measurements.
    pub measurements: Vec<Measurement>,
    /// Other quantities that are uncertain.
    pub uncertainties: Vec<Uncertainty>,
}

/// Quantities that were found from measurements. The serialised names are stable; fields may be added.
///
/// ```
/// use fredholm::{Fit, FittedQuantity};
///
/// let quantities = vec![FittedQuantity {
///     name: "floor emissivity".to_owned(),
///     start: 0.5,
///     value: 0.62,
///     std_error: 0.02,
///     interval: [0.58, 0.66],
///     unit: None,
/// }];
/// let fit = Fit {
///     quantities,
///     covariance: vec![vec![4e-4]],
///     targets: Vec::new(),
///     chi_square: 40.0,
///     freedom: 4,
///     solutions: 6,
///     seconds: 1.0,
/// };
/// // χ² is not ten times the number of degrees of freedom by chance.
/// assert!(!fit.is_plausible() && fit.table().contains("does not explain"));
/// ```
#[derive(Clone, Debug, Serialize)]
pub struct Fit {
    /// The quantities.
    pub quantities: Vec<FittedQuantity>,
    /// Their covariance, row by row.
    pub covariance: Vec<Vec<f64>>,
    /// The measured targets.
    pub targets: Vec<FittedTarget>,
    /// χ² at the quantities that were found.
    pub chi_square: f64,
    /// Measurements, with what was known of quantities before, less quantities.
    pub freedom: usize,
    /// The number of solutions.
    pub solutions: usize,
    /// Seconds.
    pub seconds: f64,
}

/// A quantity that was found.
///
/// ```
/// use fredholm::FittedQuantity;
///
/// let own = FittedQuantity {
///     name: "floor emissivity".to_owned(),
///     start: 0.5,
///     value: 0.93,
///     std_error: 0.04,
///     interval: [0.80, 0.98],
///     unit: None,
/// };
/// assert!(own.interval[1] < own.value + 2.0 * own.std_error);
/// ```
#[derive(Clone, Debug, Serialize)]
pub struct FittedQuantity {
    /// The name of the quantity.
    pub name: String,
    /// The value from which the search started.
    pub start: f64,
    /// The value that was found.
    pub value: f64,
    /// The standard error of the value, by measurements, walks and uncertain quantities; of a value at the end of its range as if there were none.
    pub std_error: f64,
    /// The ends of the interval of 95 %, which stays within the range of the quantity: of emissivities near 0 or 1 it is no symmetric one.
    pub interval: [f64; 2],
    /// The unit of the quantity, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
}

/// A measured target beside what the quantities that were found give there.
///
/// ```
/// use fredholm::FittedTarget;
///
/// let own = FittedTarget {
///     name: "roof".to_owned(),
///     unit: Some("K"),
///     measured: 1012.0,
///     measured_std_error: 3.0,
///     fitted: 1009.0,
///     fitted_std_error: 0.01,
///     deviation: 1.0,
/// };
/// assert!(own.measured > own.fitted);
/// ```
#[derive(Clone, Debug, Serialize)]
pub struct FittedTarget {
    /// The name of the target.
    pub name: String,
    /// The unit of the numbers, if they have one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// The number that was measured.
    pub measured: f64,
    /// The standard error of the measurement.
    pub measured_std_error: f64,
    /// The number by the quantities that were found.
    pub fitted: f64,
    /// The standard error of that by walks.
    pub fitted_std_error: f64,
    /// The measured number less the other, in standard errors of all kinds.
    pub deviation: f64,
}

impl Fit {
    /// Whether measurements as far from the model as these come more often than once in a thousand times (Fisher's approximation).
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        let freedom = self.freedom as f64;
        self.freedom == 0 || (2.0 * self.chi_square).sqrt() - (2.0 * freedom - 1.0).sqrt() < SELDOM
    }

    /// Tables for people.
    #[must_use]
    pub fn table(&self) -> String {
        let unit = |unit: Option<&str>| unit.map_or(String::new(), |unit| format!(" {unit}"));
        let head = ["quantity", "start", "found", "95 %"];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        rows.extend(self.quantities.iter().map(|own| {
            let unit = unit(own.unit);
            let found = with_error(own.value, Some(own.std_error));
            let interval = format!("{} to {}", short(own.interval[0]), short(own.interval[1]));
            vec![
                own.name.clone(),
                short(own.start) + &unit,
                found + &unit,
                interval + &unit,
            ]
        }));
        let mut text = aligned(&rows);
        let errors: Vec<f64> = self.quantities.iter().map(|own| own.std_error).collect();
        let mut rows = vec![vec!["correlation".to_owned()]];
        rows[0].extend(self.quantities.iter().map(|own| own.name.clone()));
        for (i, (own, row)) in self.quantities.iter().zip(&self.covariance).enumerate() {
            let correlation = |(j, c): (usize, &f64)| format!("{:.2}", c / (errors[i] * errors[j]));
            let mut line = vec![own.name.clone()];
            line.extend(row.iter().enumerate().map(correlation));
            rows.push(line);
        }
        if self.quantities.len() > 1 {
            text += &format!("\n{}", aligned(&rows));
        }
        let head = ["target", "measured", "fitted", "deviation/σ"];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        rows.extend(self.targets.iter().map(|own| {
            let unit = unit(own.unit);
            vec![
                own.name.clone(),
                with_error(own.measured, Some(own.measured_std_error)) + &unit,
                with_error(own.fitted, Some(own.fitted_std_error)) + &unit,
                format!("{:.1}", (10.0 * own.deviation).round() / 10.0 + 0.0),
            ]
        }));
        text += &format!("\n{}", aligned(&rows));
        text += &format!(
            "\nχ² = {} with {} degrees of freedom, {} solutions in {} s\n",
            short(self.chi_square),
            self.freedom,
            self.solutions,
            short(self.seconds)
        );
        if !self.is_plausible() {
            text += "the model does not explain the measurements: χ² is as large once in a thousand times at most\n";
        }
        text
    }
}

impl Fitting {
    /// Looks for the quantities. `solve` gives the report of the problem with these values of theirs, with sensitivities, always with the same draws.
    ///
    /// # Errors
    /// [`SolveError`] of `solve`; [`Error::Option`]: a target or a quantity is not there, the measurements do not tell the quantities, or no end was
    /// found.
    pub fn fit(
        &self,
        solve: &mut dyn FnMut(&[f64]) -> Result<Report, SolveError>,
    ) -> Result<Fit, SolveError> {
        let begun = Instant::now();
        let known = self.unknowns.iter().filter(|own| own.known_to.is_some());
        let rows = self.measurements.len() + known.count();
        if self.unknowns.is_empty() || rows < self.unknowns.len() {
            return Err(refused(format!(
                "{} quantities do not follow from {} measurements",
                self.unknowns.len(),
                self.measurements.len()
            )));
        }
        let starts = self.unknowns.iter().map(|own| own.start());
        let start: Vec<f64> = starts.collect::<Result<_, _>>()?;
        let mut search = Search {
            fitting: self,
            solve,
            parameters: DVector::from_vec(start),
            seen: Vec::new(),
            whitening: None,
            failure: None,
        };
        // The errors of walks and of other quantities are those at the start, and then those near the end.
        for _ in 0..2 {
            let at = search.look()?;
            search.whitening = Some(search.seen[at].whitening()?);
            let method = LevenbergMarquardt::new()
                .with_ftol(TOLERANCE)
                .with_xtol(TOLERANCE)
                .with_gtol(TOLERANCE)
                .with_patience(PATIENCE);
            search = method.minimize(search).0;
            if let Some(failure) = search.failure.take() {
                return Err(failure);
            }
        }
        let at = search.look()?;
        let found = &search.seen[at];
        let whitening = search.whitening.as_ref();
        let whitening = whitening.ok_or(Error::Internal("a fit without weights"))?;
        let (residuals, jacobian) = found.weighted(whitening, self);
        let information = jacobian.tr_mul(&jacobian);
        let gradient = jacobian.tr_mul(&residuals);
        let covariance = self.inverse(information)?;
        let errors: Vec<f64> = covariance.diagonal().iter().map(|c| c.sqrt()).collect();
        let step = &covariance * gradient;
        let noise = found.step_noise(&covariance)?;
        for (i, own) in self.unknowns.iter().enumerate() {
            let (value, range) = (found.values[i], own.quantity.range);
            // At the end of its range a quantity would go on.
            let is_at_end = range
                .iter()
                .any(|end| (value - end).abs() < 0.1 * errors[i]);
            let may = SETTLED * errors[i] + OF_WALKS * noise[i];
            if step[i].abs() > may && !is_at_end {
                return Err(refused(format!(
                    "no end was found: {:?} is {} and would still move by {}, with a standard error of {}; start nearer, or walk \
                     more",
                    own.quantity.name,
                    short(value),
                    short(-step[i]),
                    short(errors[i])
                )));
            }
        }
        let quantities = self.unknowns.iter().zip(found.values.iter().zip(&errors));
        Ok(Fit {
            quantities: quantities
                .map(|(own, (&value, &std_error))| FittedQuantity {
                    name: own.quantity.name.clone(),
                    start: own.quantity.value.unwrap_or(f64::NAN),
                    value,
                    std_error,
                    interval: own.interval(value, std_error),
                    unit: own.quantity.unit,
                })
                .collect(),
            covariance: covariance
                .row_iter()
                .map(|row| row.iter().copied().collect())
                .collect(),
            targets: found.targets(self),
            chi_square: residuals.norm_squared(),
            freedom: rows - self.unknowns.len(),
            solutions: search.seen.len(),
            seconds: begun.elapsed().as_secs_f64(),
        })
    }

    /// The inverse of Jᵀ C⁻¹ J, if all quantities are told by the measurements.
    fn inverse(&self, information: DMatrix<f64>) -> Result<DMatrix<f64>, SolveError> {
        let scales = information.diagonal().map(f64::sqrt);
        if let Some(dark) = scales.iter().position(|&scale| !(scale > 0.0)) {
            let name = &self.unknowns[dark].quantity.name;
            return Err(refused(format!("no measurement depends on {name:?}")));
        }
        let scaled = DMatrix::from_fn(scales.len(), scales.len(), |i, j| {
            information[(i, j)] / (scales[i] * scales[j])
        });
        let inverse = scaled.cholesky().map(|own| own.inverse());
        // Beyond that two quantities are one to the digits of the derivatives.
        let inverse = inverse.filter(|own| own.diagonal().iter().all(|c| *c < 1e12));
        let Some(inverse) = inverse else {
            let names = self.unknowns.iter().map(|own| own.quantity.name.as_str());
            let names: Vec<&str> = names.collect();
            return Err(refused(format!(
                "the measurements do not tell {} from each other",
                names.join(", ")
            )));
        };
        Ok(DMatrix::from_fn(scales.len(), scales.len(), |i, j| {
            inverse[(i, j)] / (scales[i] * scales[j])
        }))
    }
}

fn refused(message: String) -> SolveError {
    let subject = Subject::Problem;
    Error::Option { subject, message }.into()
}

impl Unknown {
    /// The parameter of the start.
    fn start(&self) -> Result<f64, SolveError> {
        let name = &self.quantity.name;
        let value = self.quantity.value;
        let value = value
            .ok_or_else(|| refused(format!("{name:?} has several values: a fit looks for one")))?;
        Ok(self.parameter(value))
    }

    /// The parameter of a value, which is any number; of an end of the range that of a value near it.
    fn parameter(&self, value: f64) -> f64 {
        let [low, high] = self.quantity.range;
        match (low.is_finite(), high.is_finite()) {
            (true, true) => {
                let share = ((value - low) / (high - low)).clamp(INSIDE, 1.0 - INSIDE);
                (share / (1.0 - share)).ln()
            }
            (true, false) => (value - low).max(f64::MIN_POSITIVE).ln(),
            _ => value,
        }
    }

    /// The interval of 95 % about a value with this standard error: that of the parameter.
    fn interval(&self, value: f64, std_error: f64) -> [f64; 2] {
        let parameter = self.parameter(value);
        let half = NORMAL * std_error / self.value(parameter).1;
        [-half, half].map(|shift| self.value(parameter + shift).0)
    }

    /// The value of a parameter, and its derivative.
    fn value(&self, parameter: f64) -> (f64, f64) {
        let [low, high] = self.quantity.range;
        match (low.is_finite(), high.is_finite()) {
            (true, true) => {
                let share = 1.0 / (1.0 + (-parameter).exp());
                (
                    low + (high - low) * share,
                    (high - low) * share * (1.0 - share),
                )
            }
            (true, false) => (low + parameter.exp(), parameter.exp()),
            _ => (parameter, 1.0),
        }
    }
}

/// What a solution with some values of the quantities tells.
#[derive(Clone, Debug)]
struct Seen {
    values: Vec<f64>,
    /// What was measured, as this solution has it, its error by walks, and its unit.
    found: Vec<(f64, f64, Option<&'static str>)>,
    /// The derivatives of these by the quantities that are looked for.
    jacobian: DMatrix<f64>,
    /// The standard errors of these derivatives.
    noise: DMatrix<f64>,
    /// The covariance of measurements, walks and uncertain quantities.
    covariance: DMatrix<f64>,
    misfit: DVector<f64>,
}

impl Seen {
    fn new(fitting: &Fitting, values: Vec<f64>, report: &Report) -> Result<Self, SolveError> {
        let sensitivities = report.sensitivities.as_ref();
        let sensitivities = sensitivities.ok_or(Error::Internal("a fit without derivatives"))?;
        let (rows, mut found) = (fitting.measurements.len(), Vec::new());
        let mut jacobian = DMatrix::zeros(rows, fitting.unknowns.len());
        let mut noise = jacobian.clone();
        let mut uncertain = DMatrix::zeros(rows, fitting.uncertainties.len());
        for (i, own) in fitting.measurements.iter().enumerate() {
            let name = &own.target;
            let goal = report.goals.iter().find(|goal| &goal.name == name);
            let goal = goal.ok_or_else(|| refused(format!("there is no target {name:?}")))?;
            found.push(match own.what {
                Measured::Value => (goal.value(), goal.std_error(), goal.plain.unit),
                Measured::Temperature => {
                    let kelvin = goal.temperature.or(goal.radiant_temperature);
                    let numbers = kelvin.and_then(|own| Some((own.estimate?, own.std_error?)));
                    let (value, error) = numbers.ok_or_else(|| {
                        refused(format!("{name:?} has no temperature that follows from u"))
                    })?;
                    (value, error, Some("K"))
                }
            });
            let derivative = |quantity: &str| {
                let of_u = sensitivities.get(name, quantity).ok_or_else(|| {
                    refused(format!("{name:?} has no derivative by {quantity:?}"))
                })?;
                let error = of_u.std_error.unwrap_or(0.0);
                let found = match own.what {
                    Measured::Value => Some((of_u.derivative, error)),
                    Measured::Temperature => goal
                        .temperature_slope(quantity, of_u.derivative)
                        .zip(goal.kelvin_per_u().map(|scale| scale * error)),
                };
                found.ok_or_else(|| {
                    refused(format!(
                        "the temperature of {name:?} has no derivative by {quantity:?}: its emissivity is not known"
                    ))
                })
            };
            for (j, unknown) in fitting.unknowns.iter().enumerate() {
                (jacobian[(i, j)], noise[(i, j)]) = derivative(&unknown.quantity.name)?;
            }
            for (j, other) in fitting.uncertainties.iter().enumerate() {
                uncertain[(i, j)] = derivative(&other.quantity)?.0 * other.std_error;
            }
        }
        let mut covariance = &uncertain * uncertain.transpose();
        for (i, (own, found)) in fitting.measurements.iter().zip(&found).enumerate() {
            covariance[(i, i)] += own.std_error * own.std_error + found.1 * found.1;
        }
        let misfits = fitting.measurements.iter().zip(&found);
        let misfits = misfits.map(|(own, found)| found.0 - own.value);
        Ok(Self {
            misfit: DVector::from_iterator(rows, misfits),
            values,
            found,
            jacobian,
            noise,
            covariance,
        })
    }

    /// The standard errors of a step by those of walks: of what they tell of the targets, and of the derivatives.
    fn step_noise(&self, covariance: &DMatrix<f64>) -> Result<DVector<f64>, SolveError> {
        let factor = self.covariance.clone().cholesky();
        let factor = factor.ok_or(Error::Internal("a covariance that is none"))?;
        let gain = covariance * factor.solve(&self.jacobian).transpose();
        let weighted = factor.solve(&self.misfit);
        let squares = |own: &DMatrix<f64>| own.map(|x| x * x);
        let of_walks = self.found.iter().map(|found| found.1 * found.1);
        let of_walks = DVector::from_iterator(self.found.len(), of_walks);
        let of_gradient = squares(&self.noise).tr_mul(&weighted.map(|x| x * x));
        let variance = squares(&gain) * of_walks + squares(covariance) * of_gradient;
        Ok(variance.map(f64::sqrt))
    }

    /// L of C = L Lᵀ.
    fn whitening(&self) -> Result<DMatrix<f64>, SolveError> {
        let factor = self.covariance.clone().cholesky();
        let factor = factor.ok_or(Error::Internal("a covariance that is none"))?;
        Ok(factor.unpack())
    }

    /// What is squared, and its derivatives by the quantities: L⁻¹ (u − m), and what was known of quantities before.
    fn weighted(
        &self,
        whitening: &DMatrix<f64>,
        fitting: &Fitting,
    ) -> (DVector<f64>, DMatrix<f64>) {
        let solve = |own: DMatrix<f64>| {
            let solved = whitening.solve_lower_triangular(&own);
            solved.unwrap_or(own)
        };
        let misfit = DMatrix::from_columns(core::slice::from_ref(&self.misfit));
        let (mut residuals, mut jacobian) = (
            solve(misfit).column(0).into_owned(),
            solve(self.jacobian.clone()),
        );
        for (j, own) in fitting.unknowns.iter().enumerate() {
            if let (Some(error), Some(start)) = (own.known_to, own.quantity.value) {
                let row = residuals.len();
                residuals = residuals.push((self.values[j] - start) / error);
                jacobian = jacobian.insert_row(row, 0.0);
                jacobian[(row, j)] = 1.0 / error;
            }
        }
        (residuals, jacobian)
    }

    fn targets(&self, fitting: &Fitting) -> Vec<FittedTarget> {
        let all = fitting.measurements.iter().zip(&self.found).enumerate();
        all.map(|(i, (own, &(fitted, error, unit)))| FittedTarget {
            name: own.target.clone(),
            unit,
            measured: own.value,
            measured_std_error: own.std_error,
            fitted,
            fitted_std_error: error,
            deviation: (own.value - fitted) / self.covariance[(i, i)].sqrt(),
        })
        .collect()
    }
}

/// The search for the least χ².
struct Search<'f> {
    fitting: &'f Fitting,
    solve: &'f mut dyn FnMut(&[f64]) -> Result<Report, SolveError>,
    parameters: DVector<f64>,
    /// All solutions so far.
    seen: Vec<Seen>,
    /// L of the covariance by which misfits are weighted.
    whitening: Option<DMatrix<f64>>,
    failure: Option<SolveError>,
}

impl Search<'_> {
    /// The number of the solution at the parameters, which is found if it is not there.
    fn look(&mut self) -> Result<usize, SolveError> {
        let pairs = self.fitting.unknowns.iter().zip(self.parameters.iter());
        let values: Vec<f64> = pairs.map(|(own, &p)| own.value(p).0).collect();
        if let Some(known) = self.seen.iter().position(|seen| seen.values == values) {
            return Ok(known);
        }
        let report = (self.solve)(&values)?;
        self.seen.push(Seen::new(self.fitting, values, &report)?);
        Ok(self.seen.len() - 1)
    }

    /// The weighted misfits, and their derivatives by the parameters.
    fn weighted(&self) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let pairs = self.fitting.unknowns.iter().zip(self.parameters.iter());
        let pairs: Vec<(f64, f64)> = pairs.map(|(own, &p)| own.value(p)).collect();
        let is_here = |seen: &&Seen| seen.values.iter().zip(&pairs).all(|(a, b)| *a == b.0);
        let seen = self.seen.iter().find(is_here)?;
        let (residuals, mut jacobian) = seen.weighted(self.whitening.as_ref()?, self.fitting);
        for (mut column, (_, slope)) in jacobian.column_iter_mut().zip(&pairs) {
            column *= *slope;
        }
        Some((residuals, jacobian))
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Search<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, parameters: &DVector<f64>) {
        self.parameters.clone_from(parameters);
        if self.failure.is_none() {
            self.failure = self.look().err();
        }
    }

    fn params(&self) -> DVector<f64> {
        self.parameters.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(self.weighted()?.0)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        Some(self.weighted()?.1)
    }
}
