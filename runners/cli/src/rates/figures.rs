//! The figures of a sweep.

use fredholm::sweep::{Rates, Row};
use fredholm_plot::{Curve, LogLogPlot, Style};

/// A figure of curves; the title says of which problem.
pub(super) fn figure(rates: &Rates, titles: [&str; 3], curves: Vec<Curve>) -> LogLogPlot {
    let [title, x_label, y_label] = titles.map(str::to_owned);
    let problem = rates.problem;
    let what = match rates.dimension {
        Some(d) => format!("{problem}, d = {d}"),
        None => problem.to_owned(),
    };
    LogLogPlot {
        title: format!("{title} ({what})"),
        x_label,
        y_label,
        curves,
    }
}

/// A curve of the rows that have such a point.
fn curve(rates: &Rates, name: &str, style: Style, at: fn(&Row) -> Option<(f64, f64)>) -> Curve {
    Curve::new(name, style, rates.rows.iter().filter_map(at))
}

/// The line of an exponent so many times above a curve.
fn slope(exponent: f64, above: f64, curve: &Curve) -> Option<Curve> {
    let (&(x, y), &(end, _)) = (curve.points.first()?, curve.points.last()?);
    let name = format!("slope {exponent:.2}").replace('-', "−");
    Some(Curve::power_law(&name, exponent, (x, above * y), end))
}

/// Errors against work.
pub(super) fn work_figure(rates: &Rates) -> LogLogPlot {
    let nystrom = rates.nystrom.iter();
    let nystrom = nystrom.filter_map(|s| Some((s.evaluations, s.error?)));
    let error = |row: &Row| Some((row.work()[1], row.error));
    let preconditioned = curve(rates, "preconditioned", Style::marked(1, 0), error);
    let theory = slope(rates.fits.error_theory, 2.0, &preconditioned);
    let mut curves = vec![
        curve(rates, "plain Monte Carlo", Style::marked(0, 1), |row| {
            Some((row.work()[1], row.work()[2]))
        }),
        // A deterministic solution ends where its walks would begin.
        curve(rates, "Galerkin alone", Style::marked(5, 3), |row| {
            Some((row.work()[0], row.error_galerkin?))
        }),
        Curve::new("Gauss–Nyström", Style::marked(3, 2), nystrom),
        preconditioned,
    ];
    curves.extend(theory);
    let x_label = match rates.unit() {
        "seconds" => "seconds, set-up included",
        _ => "kernel evaluations, set-up included",
    };
    figure(
        rates,
        ["Error of the mean against work", x_label, "error"],
        curves,
    )
}

/// √Var against n.
pub(super) fn deviation_figure(rates: &Rates) -> LogLogPlot {
    let deviation = |row: &Row| Some((row.unknowns as f64, row.std_dev));
    let plain = |row: &Row| Some((row.unknowns as f64, row.std_dev_plain));
    let preconditioned = curve(rates, "preconditioned", Style::marked(1, 0), deviation);
    let theory = slope(rates.fits.std_dev_theory, 1.5, &preconditioned);
    let mut curves = vec![
        curve(rates, "plain Monte Carlo", Style::marked(0, 1), plain),
        preconditioned,
    ];
    curves.extend(theory);
    let titles = [
        "Standard deviation against cells",
        "cells n",
        "√Var of the mean",
    ];
    figure(rates, titles, curves)
}
