//! A report as JSON and as a picture.

use fredholm::report::{Coordinates, Report, WholeReport};
use fredholm_plot::{Axis, BandPlot, Curve, Style, stacked};

use crate::failure::Failure;

/// One JSON document.
pub(crate) fn json<R: serde::Serialize>(report: &R) -> Result<String, Failure> {
    let mut text = serde_json::to_string_pretty(report).map_err(Failure::run)?;
    text.push('\n');
    Ok(text)
}

/// The normal quantile that a picture multiplies standard errors by.
const QUANTILE: f64 = 1.96;

/// A picture of the grid target whose points are called `name[0]`, `name[1]`, …
pub(crate) fn svg(report: &Report, name: &str) -> Result<String, Failure> {
    let points = report.goals.iter().map(|target| Drawn {
        name: &target.name,
        at: target.at.as_ref(),
        exact: target.exact,
        estimate: target.preconditioned.estimate,
        std_error: target.preconditioned.std_error,
        known: target.galerkin,
    });
    let words = ["preconditioned walks", "error band", "v"];
    picture(points, (name, report.problem), words)
}

/// A picture of the same target of a whole function, with its band.
pub(crate) fn whole_svg(report: &WholeReport, name: &str) -> Result<String, Failure> {
    let points = report.targets.iter().map(|target| Drawn {
        name: &target.name,
        at: target.at.as_ref(),
        exact: target.exact,
        estimate: Some(target.value.estimate),
        std_error: target.value.band.map(|band| band / QUANTILE),
        known: target.value.iterate,
    });
    let words = ["whole function", "band of all points together", "F + T_K v"];
    picture(points, (name, report.summary.problem), words)
}

/// Whether a functional of this name is one of a target: `name` itself, or `name[0]`, `name[1]`, …
pub(crate) fn is_of(functional: &str, name: &str) -> bool {
    let rest = functional.strip_prefix(name);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('['))
}

/// A point of a picture.
struct Drawn<'a> {
    name: &'a str,
    at: Option<&'a Coordinates>,
    exact: Option<f64>,
    estimate: Option<f64>,
    std_error: Option<f64>,
    /// What is known of u without walks.
    known: f64,
}

/// The values with their band, and below them, where that is narrower than a line, what walks add to what is known.
fn picture<'a>(
    all: impl Iterator<Item = Drawn<'a>>,
    (name, problem): (&str, &str),
    [walks, band, known]: [&str; 3],
) -> Result<String, Failure> {
    let on_grid = |target: &Drawn<'_>| target.name != name && is_of(target.name, name);
    let points: Vec<Drawn<'_>> = all.filter(on_grid).collect();
    let axis = match problem {
        "circle" => Axis::Angle,
        "room" => Axis::Surface,
        _ => Axis::Coordinate,
    };
    // The values, or their difference from what is known.
    let plot = |title: String, label: Option<String>, of: &dyn Fn(&Drawn<'_>) -> f64| {
        let values = points.iter().filter_map(|t| {
            let value = t.estimate? - of(t);
            Some((t.at?.first()?, value, t.std_error.unwrap_or(0.0)))
        });
        let exact = points
            .iter()
            .filter_map(|t| Some((t.at?.first()?, t.exact? - of(t))));
        let exact: Vec<_> = exact.collect();
        let style = Style {
            colour: 0,
            marker: None,
            dashed: true,
        };
        let exact = (!exact.is_empty()).then_some(Curve {
            name: "exact solution".to_owned(),
            points: exact,
            style,
        });
        BandPlot {
            title,
            axis,
            name: walks.to_owned(),
            points: values.collect(),
            label,
            curves: exact.into_iter().collect(),
        }
    };
    let title = format!("{name}: the solution with its 95 % {band}");
    let values = plot(title, None, &|_| 0.0);
    let svg = values.svg().map_err(Failure::run)?;
    if !values.is_invisible() || points.iter().any(|t| t.known.is_nan()) {
        return Ok(svg);
    }
    let title = format!("{name}: what walks add to {known}, with the same band");
    let added = plot(title, Some("difference".to_owned()), &|t| t.known);
    let added = added.svg().map_err(Failure::run)?;
    Ok(stacked(&[svg, added]))
}
