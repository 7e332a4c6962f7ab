//! A report as JSON and as a picture.

use fredholm::report::{GoalReport, Report};
use fredholm_plot::{Axis, BandPlot, Curve, Style};

use crate::failure::Failure;

/// One JSON document.
pub(crate) fn json(report: &Report) -> Result<String, Failure> {
    let mut text = serde_json::to_string_pretty(report).map_err(Failure::run)?;
    text.push('\n');
    Ok(text)
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
            _ => Axis::Coordinate,
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
