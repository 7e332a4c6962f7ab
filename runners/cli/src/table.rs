//! A report as JSON and as a picture.

use fredholm::report::{Coordinates, GlobalReport, Report};
use fredholm_plot::{Axis, Figure, GridCurve, GridPoint};

use crate::failure::Failure;

/// One JSON document.
pub(crate) fn json<R: serde::Serialize>(report: &R) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(report).map_err(Failure::run)?;
    Ok(text + "\n")
}

/// The text of an SVG file of a figure.
pub(crate) fn drawn(figure: Result<Figure, fredholm_plot::Error>) -> Result<String, Failure> {
    figure.and_then(Figure::svg).map_err(Failure::run)
}

/// The normal quantile that a picture multiplies standard errors by.
const QUANTILE: f64 = 1.96;

/// A picture of the grid target whose points are called `name[0]`, `name[1]`, …
pub(crate) fn svg(report: &Report, name: &str) -> Result<Figure, Failure> {
    let goals = report.goals.iter().map(|target| {
        let (at, walks) = (target.at.as_ref(), &target.preconditioned);
        let numbers = (walks.estimate, walks.std_error, target.exact);
        (&target.name, point(at, numbers, target.galerkin))
    });
    let words = ["preconditioned walks", "error band", "v"];
    picture(goals, (name, report.problem), words)
}

/// A picture of the same target of a global estimate, with its band.
pub(crate) fn whole_svg(report: &GlobalReport, name: &str) -> Result<Figure, Failure> {
    let goals = report.targets.iter().map(|target| {
        let error = target.band.map(|band| band / QUANTILE);
        let numbers = (target.preconditioned.estimate, error, target.exact);
        let point = point(
            target.at.as_ref(),
            numbers,
            target.iterate.unwrap_or(f64::NAN),
        );
        (&target.name, point)
    });
    let words = [
        "global estimate",
        "band of all points together",
        "F + T_K v",
    ];
    picture(goals, (name, report.summary.problem), words)
}

/// Whether a functional of this name is one of a target: `name` itself, or `name[0]`, `name[1]`, …
pub(crate) fn is_of(functional: &str, name: &str) -> bool {
    let rest = functional.strip_prefix(name);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('['))
}

/// A point of a grid with its estimate, standard error and exact value, and what is known without walks.
fn point(
    at: Option<&Coordinates>,
    (estimate, std_error, exact): (Option<f64>, Option<f64>, Option<f64>),
    known: f64,
) -> Option<GridPoint> {
    Some(GridPoint {
        at: at?.first()?,
        value: estimate?,
        std_error: std_error.unwrap_or(0.0),
        known,
        exact,
    })
}

fn picture<'a>(
    all: impl Iterator<Item = (&'a String, Option<GridPoint>)>,
    (name, problem): (&str, &str),
    [values, band, known]: [&str; 3],
) -> Result<Figure, Failure> {
    let on_grid = all.filter(|(own, _)| *own != name && is_of(own, name));
    let curve = GridCurve {
        name,
        axis: match problem {
            "circle" => Axis::Angle,
            "room" => Axis::Surface,
            _ => Axis::Coordinate,
        },
        points: on_grid.filter_map(|(_, point)| point).collect(),
        values,
        band,
        known,
    };
    curve.draw().map_err(Failure::run)
}
