//! The figures of a sweep.

use fredholm::sweep::{Rates, Row};
use fredholm_plot::{Curve, LogLogPlot, Style};

/// The problem, for titles.
pub(super) fn what(rates: &Rates) -> String {
    match rates.dimension {
        Some(d) => format!("{}, d = {d}", rates.problem),
        None => rates.problem.to_owned(),
    }
}

/// Errors against work.
pub(super) fn work_figure(rates: &Rates) -> LogLogPlot {
    let of = |y: &dyn Fn(&Row) -> Option<f64>| {
        let rows = rates.rows.iter();
        rows.filter_map(|row| Some((row.work()[1], y(row)?)))
            .collect::<Vec<_>>()
    };
    // A deterministic solution ends where its walks would begin.
    let galerkin = rates.rows.iter();
    let galerkin = galerkin.filter_map(|r| Some((r.work()[0], r.error_galerkin?)));
    let nystrom = rates.nystrom.iter();
    let nystrom = nystrom.filter_map(|s| Some((s.evaluations, s.error?)));
    let curve = |name: &str, points, colour, marker| Curve {
        name: name.to_owned(),
        points,
        style: Style {
            colour,
            marker: Some(marker),
            dashed: false,
        },
    };
    let mut curves = vec![
        curve("plain Monte Carlo", of(&|r| Some(r.work()[2])), 0, 1),
        curve("Galerkin alone", galerkin.collect(), 5, 3),
        curve("Gauss–Nyström", nystrom.collect(), 3, 2),
        curve("preconditioned", of(&|r| Some(r.error)), 1, 0),
    ];
    if let (Some(first), Some(last)) = (rates.rows.first(), rates.rows.last()) {
        let exponent = rates.fits.error_theory;
        let from = (first.work()[1], 2.0 * first.error);
        let name = format!("slope {exponent:.2}").replace('-', "−");
        curves.push(Curve::power_law(&name, exponent, from, last.work()[1]));
    }
    LogLogPlot {
        title: format!("Error of the mean against work ({})", what(rates)),
        x_label: match rates.unit() {
            "seconds" => "seconds, set-up included",
            _ => "kernel evaluations, set-up included",
        }
        .to_owned(),
        y_label: "error".to_owned(),
        curves,
    }
}

/// √Var against n.
pub(super) fn deviation_figure(rates: &Rates) -> LogLogPlot {
    let of = |y: &dyn Fn(&Row) -> f64| {
        let rows = rates.rows.iter();
        rows.map(|row| (row.unknowns as f64, y(row)))
            .collect::<Vec<_>>()
    };
    let style = |colour, marker| Style {
        colour,
        marker: Some(marker),
        dashed: false,
    };
    let mut curves = vec![
        Curve {
            name: "plain Monte Carlo".to_owned(),
            points: of(&|r| r.std_dev_plain),
            style: style(0, 1),
        },
        Curve {
            name: "preconditioned".to_owned(),
            points: of(&|r| r.std_dev),
            style: style(1, 0),
        },
    ];
    if let (Some(first), Some(last)) = (rates.rows.first(), rates.rows.last()) {
        let exponent = rates.fits.std_dev_theory;
        let from = (first.unknowns as f64, 1.5 * first.std_dev);
        let name = format!("slope {exponent:.2}").replace('-', "−");
        curves.push(Curve::power_law(
            &name,
            exponent,
            from,
            last.unknowns as f64,
        ));
    }
    LogLogPlot {
        title: format!("Standard deviation against cells ({})", what(rates)),
        x_label: "cells n".to_owned(),
        y_label: "√Var of the mean".to_owned(),
        curves,
    }
}
