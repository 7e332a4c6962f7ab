//! The report of a whole function at some regions.

use fredholm_model::numbers::{aligned, short, with_error};
use serde::Serialize;

use super::csv::{CsvPlace, of_columns, places, record, text};
use super::{Coordinates, Over};
use crate::{Error, Goal, Model, Region, WholeFunction, WholeSummary, WholeValue};

/// The report of a whole function: its summary, and its values at the regions that were asked for. The serialised names are
/// stable; fields may be added.
///
/// ```
/// use fredholm::{CubeModel, Goal, Region, Solver};
///
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let whole = Solver::new(&u).cells(4).walks(5000).whole()?;
/// let report = whole.report(&[Goal { name: "middle".to_owned(), region: Region::Point(vec![0.5]) }])?;
/// assert!(report.table().contains("middle"));
/// assert!(report.csv()?.starts_with("name,at,"));
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug, Serialize)]
pub struct WholeReport {
    /// The function's summary.
    #[serde(flatten)]
    pub summary: WholeSummary,
    /// Seconds of the values.
    pub value_seconds: f64,
    /// The values.
    pub targets: Vec<WholeGoalReport>,
}

/// The value of a whole function at one region.
#[derive(Clone, Debug, Serialize)]
pub struct WholeGoalReport {
    /// The goal's name.
    pub name: String,
    /// The point, if the goal is u at a point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<Coordinates>,
    /// The region, if the goal is a mean over one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over: Option<Over>,
    /// The formula of the weight, if the goal is a weighted integral.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weight: Option<String>,
    /// The exact value, if it is known.
    pub exact: Option<f64>,
    /// Estimate, standard error, band, and the deterministic part.
    #[serde(flatten)]
    pub value: WholeValue,
    /// The estimate minus the exact value, if that is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// The error in standard errors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub z: Option<f64>,
}

impl WholeGoalReport {
    pub(crate) fn new(
        model: &dyn Model,
        goal: &Goal,
        exact: Option<f64>,
        value: WholeValue,
    ) -> Self {
        let error = exact.map(|exact| value.estimate - exact);
        let bar = value.std_error.filter(|bar| *bar > 0.0);
        Self {
            name: goal.name.clone(),
            at: Coordinates::new(model, &goal.region),
            over: Over::new(model, &goal.region),
            weight: match goal.region {
                Region::Weight(number) => model.weight(number).map(str::to_owned),
                _ => None,
            },
            exact,
            value,
            error,
            z: error.zip(bar).map(|(error, bar)| error / bar),
        }
    }
}

/// The columns that all problems have.
const COLUMNS: [&str; 12] = [
    "name",
    "at",
    "from",
    "to",
    "weight",
    "exact",
    "iterate",
    "estimate",
    "std_error",
    "band",
    "error",
    "z",
];

impl WholeReport {
    /// The report as CSV, a row for every target, with columns of the problem's own coordinates.
    ///
    /// # Errors
    /// [`Error::Internal`].
    pub fn csv(&self) -> Result<String, Error> {
        let coordinates = of_columns(self.summary.problem, self.summary.dimension);
        let columns = COLUMNS.iter().map(|&name| name.to_owned());
        let mut rows = vec![columns.chain(coordinates.iter().cloned()).collect()];
        for target in &self.targets {
            let number = |x: Option<f64>| x.map_or(String::new(), |x| x.to_string());
            let over = match target.over {
                Some(Over::Interval([from, to])) => [Some(from), Some(to)],
                _ => [None; 2],
            };
            let mut row = vec![
                text(&target.name),
                target.at.as_ref().map_or(String::new(), Coordinates::entry),
            ];
            row.extend(over.map(number));
            row.push(target.weight.as_deref().map_or(String::new(), text));
            let value = &target.value;
            row.extend([
                number(target.exact),
                value.iterate.to_string(),
                value.estimate.to_string(),
            ]);
            let rest = [value.std_error, value.band, target.error, target.z];
            row.extend(rest.map(number));
            let place = CsvPlace {
                at: target.at.as_ref(),
                position: &[],
            };
            row.extend(places(place, coordinates.len()));
            rows.push(row);
        }
        record(&rows)
    }

    /// The report as a table for people.
    #[must_use]
    pub fn table(&self) -> String {
        let has_errors = self.targets.iter().any(|target| target.error.is_some());
        let mut head: Vec<String> = [
            "target",
            "at",
            "exact",
            "F + T_K v",
            "whole function",
            "band ±",
        ]
        .map(str::to_owned)
        .to_vec();
        if has_errors {
            head.extend(["error", "z"].map(str::to_owned));
        }
        let mut rows = vec![head];
        rows.extend(self.targets.iter().map(|target| target.row(has_errors)));
        let summary = &self.summary;
        let mut about = vec![summary.to_string()];
        if let (Some(factor), Some(error)) = (summary.band_factor, summary.largest_std_error) {
            about.push(format!(
                "band: {} % at all points together, {} standard errors; the largest among some 256 points is {}",
                short(100.0 * summary.band_level),
                short(factor),
                short(error)
            ));
        }
        about.push(format!(
            "set-up {} s, walks {} s, band {} s, values {} s",
            short(summary.setup_seconds),
            short(summary.walk_seconds),
            short(summary.band_seconds),
            short(self.value_seconds)
        ));
        format!(
            "{}, {} pairs, {} estimator, {}, seed {}\n\n{}\n{}\n",
            match summary.dimension {
                Some(d) => format!("{} of dimension {d}", summary.problem),
                None => summary.problem.to_owned(),
            },
            summary.pairs,
            summary.estimator,
            summary.scalar,
            summary.seed,
            aligned(&rows),
            about.join("\n")
        )
    }
}

impl WholeGoalReport {
    fn row(&self, has_errors: bool) -> Vec<String> {
        let value = &self.value;
        let optional = |x: Option<f64>| x.map_or(String::new(), short);
        let mut row = vec![
            self.name.clone(),
            self.at.as_ref().map_or(String::new(), Coordinates::text),
            self.exact
                .map_or("-".to_owned(), |exact| format!("{exact:.7}")),
            format!("{:.7}", value.iterate),
            with_error(value.estimate, value.std_error),
            optional(value.band),
        ];
        if has_errors {
            row.extend([optional(self.error), optional(self.z)]);
        }
        row
    }
}

impl WholeFunction<'_> {
    /// The report of this function at these regions.
    ///
    /// # Errors
    /// [`Error::Region`]: the space has no such region.
    pub fn report(&self, goals: &[Goal]) -> Result<WholeReport, Error> {
        let start = std::time::Instant::now();
        let regions: Vec<Region> = goals.iter().map(|goal| goal.region.clone()).collect();
        let values = self.values(&regions)?;
        let value_seconds = start.elapsed().as_secs_f64();
        let all = goals.iter().zip(values);
        let targets = all.map(|(goal, value)| {
            let exact = self.model().exact(&goal.region)?;
            Ok(WholeGoalReport::new(self.model(), goal, exact, value))
        });
        Ok(WholeReport {
            summary: self.summary().clone(),
            value_seconds,
            targets: targets.collect::<Result<_, Error>>()?,
        })
    }
}
