//! How wrong a solution is that somebody else has found.

mod text;

use core::fmt::{self, Display};

use fredholm_model::numbers::{short, simultaneous, sum, with_error};
use fredholm_model::{Ask, Field, Target, WholeValues, goals as goals_of};
use serde::Serialize;

use crate::report::{Coordinates, GoalReport, Over};
use crate::{Error, Goal, Method, Report, SolveError, Solver};

/// The probability with which a band holds at all values together.
const LEVEL: f64 = 0.95;
/// Points, about, at which a function is compared with u besides the targets.
const POINTS: f64 = 256.0;
/// Roundings of the larger one of two numbers that say nothing about their difference.
const ROUNDINGS: f64 = 8.0;

/// What a certificate says of a solution.
///
/// ```
/// use fredholm::{CubeModel, Solver, Verdict};
///
/// let u = CubeModel::from_fn::<1>(|_, _| 0.5, |_| 1.0);
/// assert_eq!(Solver::new(&u).certify(|_| 2.0)?.verdict, Verdict::Right);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// No value is farther from u than its band.
    Right,
    /// Some value is farther from u than its band.
    Wrong,
}

/// How wrong a given solution v is: v − u at every target and at points all over the space, with error bars.
///
/// Estimates ũ of (u, Φ) are unbiased whatever v is, so that (v, Φ) − ũ has the error bar of ũ. The band is so many standard errors wide
/// that it contains all errors together with the probability [`level`](Self::level): that of the bootstrap of a global estimate, and of
/// separate walks that of Z. Šidák, *Rectangular confidence regions for the means of multivariate normal distributions*, 1967.
/// The serialised names are stable; fields may be added.
///
/// ```
/// use fredholm::{CubeModel, Solver, Verdict};
///
/// // u = 6x/5.
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let right = Solver::new(&u).mean().certify(|x| 1.2 * x[0])?;
/// assert_eq!(right.verdict, Verdict::Right);
/// // A bump of 10⁻⁴.
/// let bump = |x: f64| if (0.4..0.5).contains(&x) { 1e-4 } else { 0.0 };
/// let wrong = Solver::new(&u).certify(move |x| 1.2 * x[0] + bump(x[0]))?;
/// assert_eq!(wrong.verdict, Verdict::Wrong);
/// let largest = wrong.largest().unwrap();
/// assert!((largest.error.unwrap() - 1e-4).abs() < largest.band.unwrap());
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug, Serialize)]
pub struct Certificate {
    /// What it says.
    pub verdict: Verdict,
    /// The number of values that were compared.
    pub compared: usize,
    /// The number of values that are wrong for certain: farther from u than their band.
    pub wrong: usize,
    /// The largest error that values may have, in the unit of u: with the probability `level` no error is larger.
    pub bound: f64,
    /// The mean error of the values that were compared, in the unit of u.
    pub mean: f64,
    /// The root of the mean square error of these, without what error bars add to it.
    pub root_mean_square: f64,
    /// The probability with which the bands hold together.
    pub level: f64,
    /// The number of standard errors that a band is wide on each side; more where an error bar is that of few replicates.
    pub band_factor: f64,
    /// By how much rounding may have moved the given values, in the unit of u.
    pub rounding: f64,
    /// The unit of u, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// The values, targets first.
    pub values: Vec<CertifiedValue>,
    /// The number of targets among the values.
    #[serde(skip)]
    pub targets: usize,
    /// The report of the walks.
    pub report: Report,
}

/// A value of a given solution beside u.
///
/// ```
/// use fredholm::{CubeModel, Solver};
///
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let certificate = Solver::new(&u).at(0.5).certify_values(&[0.61], 0.0)?;
/// let value = &certificate.values[0];
/// assert!((value.error.unwrap() - 0.01).abs() < value.band.unwrap() && value.is_wrong);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug, Serialize)]
pub struct CertifiedValue {
    /// The goal's name.
    pub name: String,
    /// The point, if it is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<Coordinates>,
    /// The place in the drawing of a room.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<Vec<f64>>,
    /// The region of a mean.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over: Option<Over>,
    /// The given value. `None`: nothing is given here, or an integral of the given function is not known to twelve digits.
    pub given: Option<f64>,
    /// The estimate of (u, Φ).
    pub estimate: Option<f64>,
    /// The given value minus the estimate.
    pub error: Option<f64>,
    /// The standard error of both, or what rounding and quadrature leave where that is more. `None`: no walk has scored.
    pub std_error: Option<f64>,
    /// Half of the width of the band around the error.
    pub band: Option<f64>,
    /// Whether the error is larger than that and what rounding may have moved the given value.
    pub is_wrong: bool,
}

impl CertifiedValue {
    fn new(goal: &GoalReport, given: Option<f64>) -> Self {
        let estimate = Some(goal.value()).filter(|value| value.is_finite());
        let rounding =
            |given: f64, value: f64| ROUNDINGS * f64::EPSILON * f64::max(given.abs(), value.abs());
        let rounded = given.zip(estimate).map_or(0.0, |(a, b)| rounding(a, b));
        let floor = f64::max(rounded, goal.quadrature_error);
        Self {
            name: goal.name.clone(),
            at: goal.at.clone(),
            position: goal.position.clone(),
            over: goal.over.clone(),
            given,
            estimate,
            error: given
                .zip(estimate)
                .map(|(given, estimate)| given - estimate),
            std_error: Some(goal.std_error().max(floor)).filter(|error| error.is_finite()),
            band: None,
            is_wrong: false,
        }
    }

    /// The error and half of its band, infinite where nothing is known.
    fn difference(&self) -> Option<[f64; 2]> {
        Some([self.error?, self.band.unwrap_or(f64::INFINITY)])
    }

    /// The place in words: "x = 0.67", "floor 0.5".
    #[must_use]
    pub fn place(&self) -> String {
        match (&self.at, &self.over) {
            (Some(at), _) => at.text(),
            (None, Some(Over::Word(word))) => word.clone(),
            _ => self.name.clone(),
        }
    }
}

impl Certificate {
    /// The certificate of these values, one for every goal of a report.
    fn new(report: Report, given: &[Option<f64>], (targets, rounding): (usize, f64)) -> Self {
        let goals = report.goals.iter().zip(given);
        let values = goals.map(|(goal, given)| CertifiedValue::new(goal, *given));
        let mut values: Vec<CertifiedValue> = values.collect();
        let compared = values.iter().filter(|value| value.error.is_some()).count();
        let whole = report.whole.as_ref();
        // The band of a global estimate is that of points, and not of others. Of few replicates a band is wider.
        let replicates = whole.map(|whole| whole.summary.replicates as u32);
        let of = |count, replicates: Option<u32>| {
            let freedom = replicates.map(|count| f64::from(count.max(2)) - 1.0);
            simultaneous(LEVEL, count, freedom)
        };
        let factor = whole.and_then(|whole| whole.summary.band_factor);
        let own = factor.map(|factor| factor.max(of(targets, replicates)));
        let factor = own.unwrap_or_else(|| of(compared, None));
        // What the scores of a global estimate do not see is in no error bar.
        let unseen = whole.map_or(0.0, |whole| whole.summary.truncation);
        for (value, goal) in values.iter_mut().zip(&report.goals) {
            let sampled = goal
                .preconditioned
                .std_error
                .filter(|own| Some(*own) == value.std_error);
            let replicates = goal
                .replicates
                .filter(|_| sampled.is_some() && own.is_none());
            let factor = replicates.map_or(factor, |count| of(compared, Some(count)));
            value.band = value.std_error.map(|error| factor * error + unseen);
            let difference = value.difference();
            value.is_wrong = difference.is_some_and(|[error, band]| error.abs() > band + rounding);
        }
        let differences = || values.iter().filter_map(CertifiedValue::difference);
        let wrong = values.iter().filter(|value| value.is_wrong).count();
        let squares = values.iter().filter_map(|value| {
            Some(value.error?.powi(2) - value.std_error.unwrap_or(f64::NAN).powi(2))
        });
        let count = compared as f64;
        Self {
            verdict: if wrong > 0 {
                Verdict::Wrong
            } else {
                Verdict::Right
            },
            compared,
            wrong,
            bound: differences().fold(0.0, |most, [error, band]| most.max(error.abs() + band)),
            mean: sum(differences().map(|[error, _]| error)) / count,
            root_mean_square: (sum(squares) / count).max(0.0).sqrt(),
            level: LEVEL,
            band_factor: factor,
            rounding,
            unit: report
                .goals
                .first()
                .and_then(|goal| goal.preconditioned.unit),
            values,
            targets,
            report,
        }
    }

    /// The value that is farthest from u for certain, or else that of the largest error. `None`: nothing was compared.
    #[must_use]
    pub fn largest(&self) -> Option<&CertifiedValue> {
        let size = |value: &CertifiedValue| value.error.map_or(-1.0, f64::abs);
        let order = |a: &&CertifiedValue, b: &&CertifiedValue| {
            a.is_wrong
                .cmp(&b.is_wrong)
                .then(size(a).total_cmp(&size(b)))
        };
        let compared = self.values.iter().filter(|value| value.error.is_some());
        compared.max_by(order)
    }
}

impl Display for Certificate {
    /// The verdict in a sentence: "wrong by 0.0428 ± 1.2e-10 at 0.67".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = self.unit.map_or(String::new(), |unit| format!(" {unit}"));
        match (self.verdict, self.largest()) {
            (_, None) => f.write_str("nothing was compared"),
            (Verdict::Right, _) => write!(f, "right to within {}{unit}", short(self.bound)),
            (Verdict::Wrong, Some(value)) => write!(
                f,
                "wrong by {}{unit} at {}",
                with_error(value.error.map_or(f64::NAN, f64::abs), value.std_error),
                value.place()
            ),
        }
    }
}

impl Solver<'_> {
    /// Compares a given solution, a function of the coordinates, with u: at the targets that are asked for and at points all over the space.
    /// A mean or a weighted integral of it is compared where two rules agree on it to twelve digits.
    ///
    /// The number of walks or the target error says how exact u is; a target error that is not reached leaves wider bands.
    ///
    /// # Errors
    /// [`SolveError`]; [`Error::Option`], where there are several channels: give a function for each
    /// ([`certify_all`](Self::certify_all)).
    pub fn certify(
        &self,
        solution: impl Fn(&[f64]) -> f64 + Send + Sync + 'static,
    ) -> Result<Certificate, SolveError> {
        self.certify_all(&[&solution])
    }

    /// Compares a given solution of every channel, as [`certify`](Self::certify) does that of one.
    ///
    /// # Errors
    /// As [`certify`](Self::certify).
    pub fn certify_all(&self, solutions: &[&Field]) -> Result<Certificate, SolveError> {
        let channels = self.model.channels().len();
        // The last channel may be the sum of the others.
        let fits = match channels {
            0 => solutions.len() == 1,
            _ => [channels, channels - 1].contains(&solutions.len()),
        };
        if !fits {
            let message = format!(
                "u has {} channels, and {} functions are given: give one for each",
                channels.max(1),
                solutions.len()
            );
            return Err(Error::Option {
                subject: crate::Subject::Problem,
                message,
            }
            .into());
        }
        let mut solver = self.certifying();
        for (i, region) in self.model.spread(POINTS).into_iter().enumerate() {
            let name = format!("point[{i}]");
            let ask = Ask::One(region);
            solver.asked.push(Ok(Target { name, ask }));
        }
        let all = solver.targets()?;
        let goals = solver.goals(&all)?;
        let own = goals_of(self.model, all.get(..self.asked.len()).unwrap_or_default())?.len();
        let value = |goal: &Goal| {
            let function = solutions.get(goal.channel.unwrap_or(0));
            function.map_or(Ok(None), |own| self.model.integral(&goal.region, *own))
        };
        let given = goals.iter().map(value).collect::<Result<Vec<_>, Error>>()?;
        solver.compare(&given, (own, 0.0))
    }

    /// Compares given values with u, one for every goal that is asked for, in their order; NaN: there is none of it. `rounding` is half of the
    /// last digit with which they are written, in the unit of u; 0: they are exact.
    ///
    /// # Errors
    /// [`SolveError`]; [`Error::Option`]: there are not as many values as goals.
    pub fn certify_values(&self, given: &[f64], rounding: f64) -> Result<Certificate, SolveError> {
        let solver = self.certifying();
        let goals = solver.goals(&solver.targets()?)?;
        if goals.len() != given.len() {
            let message = format!(
                "{} values are given, and {} are asked for",
                given.len(),
                goals.len()
            );
            return Err(Error::Option {
                subject: crate::Subject::Problem,
                message,
            }
            .into());
        }
        let given = given
            .iter()
            .map(|&value| Some(value).filter(|value| !value.is_nan()));
        solver.compare(&given.collect::<Vec<_>>(), (goals.len(), rounding))
    }

    /// This solver with what is best for many points, where that is open.
    fn certifying(&self) -> Self {
        let mut solver = self.clone();
        let (about, settings) = (self.model.about(), &mut solver.settings);
        let by_resolvent = about.takes_resolvent && settings.method != Some(Method::Walks);
        settings.sensitivities = false;
        if !by_resolvent && about.whole == WholeValues::Points {
            settings.global = settings.global.or(Some(true));
        }
        solver
    }

    /// Estimates, beside what is given.
    fn compare(
        &self,
        given: &[Option<f64>],
        (targets, rounding): (usize, f64),
    ) -> Result<Certificate, SolveError> {
        let bad = given
            .iter()
            .position(|own| own.is_some_and(|own| !own.is_finite()));
        if let Some(number) = bad {
            let goals = self.goals(&self.targets()?)?;
            let what = goals.get(number).map_or("", |goal| &goal.name);
            let what = format!("the given solution at {what}");
            return Err(Error::NotFinite { what }.into());
        }
        let report = match self.solve() {
            Ok(report) => report,
            Err(SolveError::NotReached(report)) => *report,
            Err(error) => return Err(error),
        };
        Ok(Certificate::new(report, given, (targets, rounding)))
    }
}
