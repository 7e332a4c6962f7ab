//! A report as JSON, as CSV and as a picture.

use fredholm::report::{Coordinates, GoalReport, Over, Report};
use fredholm_plot::{Axis, BandPlot, Curve, Style};
use serde::Serialize;

use crate::failure::Failure;

/// One JSON document.
pub(crate) fn json(report: &Report) -> Result<String, Failure> {
    let mut text = serde_json::to_string_pretty(report).map_err(Failure::run)?;
    text.push('\n');
    Ok(text)
}

/// One row a target.
pub(crate) fn csv(report: &Report) -> Result<String, Failure> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for target in &report.goals {
        writer
            .serialize(CsvRow::new(target))
            .map_err(Failure::run)?;
    }
    let bytes = writer.into_inner().map_err(Failure::run)?;
    String::from_utf8(bytes).map_err(Failure::run)
}

/// A picture of the grid target whose points are called `name[0]`, `name[1]`, …
pub(crate) fn svg(report: &Report, name: &str) -> Result<String, Failure> {
    let on_grid = |target: &&GoalReport| {
        let rest = target.name.strip_prefix(name);
        rest.is_some_and(|rest| rest.starts_with('['))
    };
    let points: Vec<&GoalReport> = report.goals.iter().filter(on_grid).collect();
    let exact: Vec<_> = points
        .iter()
        .filter_map(|t| Some((t.at.as_ref()?.first()?, t.exact?)))
        .collect();
    let mut curves = Vec::new();
    if !exact.is_empty() {
        let style = Style {
            colour: 0,
            marker: None,
            dashed: true,
        };
        curves.push(Curve {
            name: "exact solution".to_owned(),
            points: exact,
            style,
        });
    }
    let band = BandPlot {
        title: format!("{name}: the solution with its 95 % error band"),
        axis: match report.problem {
            "circle" => Axis::Angle,
            "room" => Axis::Surface,
            _ => Axis::Unit,
        },
        name: "preconditioned walks".to_owned(),
        points: points
            .iter()
            .filter_map(|t| {
                let estimate = &t.preconditioned;
                let at = t.at.as_ref()?.first()?;
                Some((at, estimate.estimate?, estimate.std_error.unwrap_or(0.0)))
            })
            .collect(),
        curves,
    };
    band.svg().map_err(Failure::run)
}

/// A target in one line.
#[derive(Serialize)]
struct CsvRow<'a> {
    name: &'a str,
    at: Option<String>,
    from: Option<f64>,
    to: Option<f64>,
    weight: Option<&'a str>,
    exact: Option<f64>,
    galerkin: f64,
    walks: u64,
    plain: Option<f64>,
    plain_std_error: Option<f64>,
    plain_std_dev: Option<f64>,
    preconditioned: Option<f64>,
    preconditioned_std_error: Option<f64>,
    preconditioned_std_dev: Option<f64>,
    irradiance: Option<f64>,
    irradiance_std_error: Option<f64>,
    net_flux: Option<f64>,
    net_flux_std_error: Option<f64>,
    rounding_floor: f64,
    absorbed: u64,
    step_limit: u64,
}

impl<'a> CsvRow<'a> {
    fn new(target: &'a GoalReport) -> Self {
        let interval = match target.over {
            Some(Over::Interval(interval)) => Some(interval),
            _ => None,
        };
        Self {
            name: &target.name,
            at: target.at.as_ref().map(point),
            from: interval.map(|over| over[0]),
            to: interval.map(|over| over[1]),
            weight: target.weight.as_deref(),
            exact: target.exact,
            galerkin: target.galerkin,
            walks: target.walks,
            plain: target.plain.estimate,
            plain_std_error: target.plain.std_error,
            plain_std_dev: target.plain.std_dev,
            preconditioned: target.preconditioned.estimate,
            preconditioned_std_error: target.preconditioned.std_error,
            preconditioned_std_dev: target.preconditioned.std_dev,
            irradiance: target.irradiance.as_ref().and_then(|h| h.estimate),
            irradiance_std_error: target.irradiance.as_ref().and_then(|h| h.std_error),
            net_flux: target.net_flux.as_ref().and_then(|q| q.estimate),
            net_flux_std_error: target.net_flux.as_ref().and_then(|q| q.std_error),
            rounding_floor: target.rounding_floor,
            absorbed: target.endings.absorbed,
            step_limit: target.endings.step_limit,
        }
    }
}

/// A point as one entry of a table.
fn point(at: &Coordinates) -> String {
    match at {
        Coordinates::One(s) => s.to_string(),
        Coordinates::Many(x) => {
            let texts: Vec<String> = x.iter().map(f64::to_string).collect();
            texts.join(" ")
        }
        Coordinates::On { surface, t } => format!("{surface} {t}"),
    }
}
