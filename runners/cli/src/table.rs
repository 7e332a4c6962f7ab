//! A report as JSON and as a picture.

use fredholm::report::{Coordinates, Report, WholeReport};
use fredholm_plot::{Axis, BandPlot, Curve, Style};

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
    });
    picture(points, name, report.problem, "preconditioned walks")
}

/// A picture of the same target of a whole function, with its band.
pub(crate) fn whole_svg(report: &WholeReport, name: &str) -> Result<String, Failure> {
    let points = report.targets.iter().map(|target| Drawn {
        name: &target.name,
        at: target.at.as_ref(),
        exact: target.exact,
        estimate: Some(target.value.estimate),
        std_error: target.value.band.map(|band| band / QUANTILE),
    });
    let walks = "whole function, band of all points together";
    picture(points, name, report.summary.problem, walks)
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
}

fn picture<'a>(
    all: impl Iterator<Item = Drawn<'a>>,
    name: &str,
    problem: &str,
    walks: &str,
) -> Result<String, Failure> {
    let on_grid = |target: &Drawn<'_>| target.name != name && is_of(target.name, name);
    let points: Vec<Drawn<'_>> = all.filter(on_grid).collect();
    let exact: Vec<_> = points
        .iter()
        .filter_map(|t| Some((t.at?.first()?, t.exact?)))
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
        axis: match problem {
            "circle" => Axis::Angle,
            "room" => Axis::Surface,
            _ => Axis::Coordinate,
        },
        name: walks.to_owned(),
        points: points
            .iter()
            .filter_map(|t| Some((t.at?.first()?, t.estimate?, t.std_error.unwrap_or(0.0))))
            .collect(),
        curves,
    };
    band.svg().map_err(Failure::run)
}
