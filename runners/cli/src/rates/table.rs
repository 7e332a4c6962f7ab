//! The tables and figures of a sweep.

use fredholm::Choices;
use fredholm::numbers::{aligned, short, slope};
use fredholm::sweep::{Deterministic, Level};
use fredholm_core::Estimate;
use fredholm_plot::{Curve, LogLogPlot, Style};
use serde::Serialize;

use super::Sweeping;

/// A standard deviation is left out of fits where it is below this part of the plain one: rounding may hold
/// it there.
const ROUNDING: f64 = 1e-12;

/// What a sweep gave. Names are a promise; fields may be added.
#[derive(Debug, Serialize)]
pub(super) struct Rates {
    pub(super) problem: &'static str,
    pub(super) dimension: Option<usize>,
    pub(super) degree: usize,
    pub(super) pairs: &'static str,
    pub(super) absorption: f64,
    pub(super) seed: u64,
    /// The mean of u: exact, or the preconditioned estimate of the finest level.
    pub(super) mean: f64,
    /// Its standard error; `null` where it is exact.
    pub(super) mean_std_error: Option<f64>,
    pub(super) rows: Vec<Row>,
    pub(super) nystrom: Vec<Deterministic>,
    pub(super) fits: Fits,
}

/// One level.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Row {
    /// p.
    pub(super) degree: usize,
    /// As the file counts them: of a cube, per axis.
    pub(super) cells: usize,
    /// n.
    pub(super) unknowns: usize,
    /// N = n².
    pub(super) walks: u64,
    /// Kernel evaluations of the set-up, and of all; `null` where seconds tell the work.
    pub(super) setup_evaluations: Option<f64>,
    pub(super) evaluations: Option<f64>,
    /// Seconds of the set-up, and of all; `null` where kernel evaluations tell the work.
    pub(super) setup_seconds: Option<f64>,
    pub(super) seconds: Option<f64>,
    pub(super) std_dev_plain: f64,
    pub(super) std_dev: f64,
    /// √(Var/N) of the preconditioned estimate of N walks.
    pub(super) error: f64,
    /// √(Var/N) of as much work spent on plain walks alone.
    #[serde(rename = "error_plain")]
    pub(super) error_plain_in_evaluations: Option<f64>,
    pub(super) error_plain_in_seconds: Option<f64>,
    /// What rounding leaves of the error however many walks there are.
    pub(super) rounding_floor: f64,
    /// (v, Φ), and its error; `null` where that is not known well enough.
    pub(super) galerkin: f64,
    pub(super) error_galerkin: Option<f64>,
}

/// Exponents, found and expected.
#[derive(Debug, Serialize)]
pub(super) struct Fits {
    /// √Var ~ n^this.
    pub(super) std_dev: Option<f64>,
    /// The same from a tenth of the finest level's cells on.
    pub(super) std_dev_last_decade: Option<f64>,
    pub(super) std_dev_theory: f64,
    /// error ~ evaluations^this, or seconds^this.
    #[serde(rename = "error")]
    pub(super) error_in_evaluations: Option<f64>,
    pub(super) error_in_seconds: Option<f64>,
    pub(super) error_theory: f64,
}

/// An exponent, if there is one.
pub(super) fn exponent(x: Option<f64>) -> String {
    x.map_or("-".to_owned(), |x| format!("{x:.3}"))
}

/// N = n².
pub(super) fn squared(unknowns: usize) -> u64 {
    (unknowns as u64).saturating_pow(2)
}

impl Row {
    /// Work is what the clock says or, where it is not asked, kernel evaluations.
    pub(super) fn new(level: &Level, degree: usize) -> Self {
        let (statistics, work) = (&level.statistics, level.clock.ok_or(level.evaluations));
        let deviation = |estimate: Estimate| estimate.std_dev.unwrap_or(f64::NAN);
        let (plain, std_dev) = (
            deviation(statistics.plain()),
            deviation(statistics.preconditioned()),
        );
        let walks = squared(level.unknowns);
        let setup = work.map_or_else(|setup| setup, |clock| clock.setup);
        // A walk of m states evaluates the kernel m − 1 times.
        let steps = statistics.states() as f64 / statistics.walks() as f64 - 1.0;
        let [walk, plain_walk] = work.map_or([steps; 2], |clock| [clock.walk, clock.plain]);
        let all = setup + walks as f64 * walk;
        let error_plain = plain / (all / plain_walk).sqrt();
        let counted = |value: f64| work.is_err().then_some(value);
        let timed = |value: f64| work.is_ok().then_some(value);
        Self {
            degree,
            cells: level.cells,
            unknowns: level.unknowns,
            walks,
            setup_evaluations: counted(setup),
            evaluations: counted(all),
            setup_seconds: timed(setup),
            seconds: timed(all),
            std_dev_plain: plain,
            std_dev,
            error: std_dev / (walks as f64).sqrt(),
            error_plain_in_evaluations: counted(error_plain),
            error_plain_in_seconds: timed(error_plain),
            rounding_floor: level.rounding_floor,
            galerkin: level.galerkin,
            error_galerkin: None,
        }
    }

    /// Whether the deviation is none of rounding.
    pub(super) fn is_above_rounding(&self) -> bool {
        self.std_dev > ROUNDING * self.std_dev_plain
    }

    /// The columns of the table for people.
    pub(super) fn columns(unit: &str) -> [&str; 11] {
        [
            "cells",
            "n",
            "walks",
            unit,
            "√Var plain",
            "√Var",
            "ratio",
            "error",
            "plain",
            "gain",
            "Galerkin",
        ]
    }

    /// What stands in them.
    pub(super) fn texts(&self) -> [String; 11] {
        let [_, work, error_plain] = self.work();
        [
            self.cells.to_string(),
            self.unknowns.to_string(),
            self.walks.to_string(),
            short(work),
            short(self.std_dev_plain),
            short(self.std_dev),
            short(self.std_dev_plain / self.std_dev),
            short(self.error),
            short(error_plain),
            short(error_plain / self.error),
            self.error_galerkin.map_or("-".to_owned(), short),
        ]
    }

    /// Evaluations or seconds of the set-up, of all, and the error of plain walks in these.
    pub(super) fn work(&self) -> [f64; 3] {
        let one = |counted: Option<f64>, timed: Option<f64>| counted.or(timed).unwrap_or(f64::NAN);
        [
            one(self.setup_evaluations, self.setup_seconds),
            one(self.evaluations, self.seconds),
            one(self.error_plain_in_evaluations, self.error_plain_in_seconds),
        ]
    }
}

impl Rates {
    pub(super) fn new(
        sweeping: &Sweeping<'_>,
        (exact, estimates): (Option<f64>, &[Estimate]),
        mut rows: Vec<Row>,
        mut nystrom: Vec<Deterministic>,
    ) -> Self {
        let reference = estimates.last().copied();
        let mean = exact.or(reference.map(|r| r.estimate)).unwrap_or(f64::NAN);
        let mean_std_error = match exact {
            Some(_) => None,
            None => reference.and_then(|r| r.std_error),
        };
        // An error that the reference cannot tell from its own is none.
        let known = |found: f64| {
            let error = (found - mean).abs();
            (error > 3.0 * mean_std_error.unwrap_or(0.0) && error > 1e-15 * mean.abs())
                .then_some(error)
        };
        for row in &mut rows {
            row.error_galerkin = known(row.galerkin);
        }
        for solution in &mut nystrom {
            solution.error = known(solution.mean);
        }
        // Where rounding holds the deviation, there is no slope.
        let above = |row: &&Row| row.is_above_rounding();
        let fit =
            |points: Vec<(f64, f64)>| slope(points.into_iter().map(|(x, y)| (x.ln(), y.ln())));
        let sweep = &sweeping.sweep;
        let (model, about) = (sweep.model, sweep.model.about());
        let order = model.order(&sweep.discretisation, sweep.walk.pairs);
        let deviations = |from: usize| {
            let rows = rows.iter().filter(above).filter(|r| r.cells >= from);
            fit(rows.map(|r| (r.unknowns as f64, r.std_dev)).collect())
        };
        let error = fit(rows
            .iter()
            .filter(above)
            .map(|r| (r.work()[1], r.error))
            .collect());
        let is_timed = rows.iter().any(|r| r.seconds.is_some());
        Self {
            problem: about.kind,
            dimension: about.dimension,
            degree: sweep.discretisation.degree,
            pairs: sweep.walk.pairs.word(),
            absorption: sweep.walk.absorption,
            seed: sweep.walk.seed,
            mean,
            mean_std_error,
            fits: Fits {
                std_dev: deviations(0),
                std_dev_last_decade: deviations(
                    rows.last().map_or(0, |finest| finest.cells.div_ceil(10)),
                ),
                std_dev_theory: -order,
                error_in_evaluations: error.filter(|_| !is_timed),
                error_in_seconds: error.filter(|_| is_timed),
                error_theory: -0.5 * order - 0.5,
            },
            rows,
            nystrom,
        }
    }

    /// "cube of dimension 2".
    pub(super) fn named(&self) -> String {
        let dimension = self.dimension;
        let dimension = dimension.map_or(String::new(), |d| format!(" of dimension {d}"));
        format!("{}{dimension}", self.problem)
    }

    /// "the mean of u, 5 (exact)".
    pub(super) fn mean_text(&self) -> String {
        let error = self.mean_std_error;
        let error = error.map_or("(exact)".to_owned(), |e| {
            format!("± {e:.1e} (finest level)")
        });
        format!("the mean of u, {:.9} {error}", self.mean)
    }

    /// From where errors are told.
    pub(super) fn reference(&self) -> &'static str {
        match self.mean_std_error {
            Some(_) => "the finest level's estimate, where that is known well enough",
            None => "the exact value",
        }
    }

    /// The tables for people.
    pub(super) fn text(&self) -> String {
        let mut rows = vec![Row::columns(self.unit()).map(str::to_owned).to_vec()];
        rows.extend(self.rows.iter().map(|row| row.texts().to_vec()));
        let mut text = format!(
            "{}, degree {}, {} pairs: {}\n\n{}",
            self.named(),
            self.degree,
            self.pairs,
            self.mean_text(),
            aligned(&rows),
        );
        if !self.nystrom.is_empty() {
            let mut rows = vec![
                ["Gauss-Nyström nodes", "evaluations", "error"]
                    .map(str::to_owned)
                    .to_vec(),
            ];
            for solution in &self.nystrom {
                rows.push(vec![
                    solution.nodes.to_string(),
                    short(solution.evaluations),
                    solution.error.map_or("-".to_owned(), short),
                ]);
            }
            text += &format!("\n{}", aligned(&rows));
        }
        let unit = self.unit();
        text += &format!(
            "\nerrors are those of the mean: of walks √(Var/N), of the others the distance from {}\n\
             plain: as many {unit} spent on plain walks alone; gain: how many times larger that is\n\n\
             fitted exponents\n  √Var  ~ n^{:<18} theory {:.3}\n  √Var  ~ n^{:<18} from a tenth of \
             the finest level's cells on\n  error ~ {:<20} theory {:.3}\n",
            self.reference(),
            exponent(self.fits.std_dev),
            self.fits.std_dev_theory,
            exponent(self.fits.std_dev_last_decade),
            format!(
                "{unit}^{}",
                exponent(
                    self.fits
                        .error_in_evaluations
                        .or(self.fits.error_in_seconds)
                )
            ),
            self.fits.error_theory,
        );
        text
    }

    /// What work is counted in.
    pub(super) fn unit(&self) -> &'static str {
        match self.rows.first() {
            Some(row) if row.seconds.is_some() => "seconds",
            _ => "evaluations",
        }
    }

    pub(super) fn what(&self) -> String {
        match self.dimension {
            Some(d) => format!("{}, d = {d}", self.problem),
            None => self.problem.to_owned(),
        }
    }

    /// Errors against work.
    pub(super) fn work_figure(&self) -> LogLogPlot {
        let of = |y: &dyn Fn(&Row) -> Option<f64>| {
            let rows = self.rows.iter();
            rows.filter_map(|row| Some((row.work()[1], y(row)?)))
                .collect::<Vec<_>>()
        };
        // A deterministic solution ends where its walks would begin.
        let galerkin = self.rows.iter();
        let galerkin = galerkin.filter_map(|r| Some((r.work()[0], r.error_galerkin?)));
        let nystrom = self.nystrom.iter();
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
        if let (Some(first), Some(last)) = (self.rows.first(), self.rows.last()) {
            let exponent = self.fits.error_theory;
            let from = (first.work()[1], 2.0 * first.error);
            let name = format!("slope {exponent:.2}").replace('-', "−");
            curves.push(Curve::power_law(&name, exponent, from, last.work()[1]));
        }
        LogLogPlot {
            title: format!("Error of the mean against work ({})", self.what()),
            x_label: match self.unit() {
                "seconds" => "seconds, set-up included",
                _ => "kernel evaluations, set-up included",
            }
            .to_owned(),
            y_label: "error".to_owned(),
            curves,
        }
    }

    /// √Var against n.
    pub(super) fn deviation_figure(&self) -> LogLogPlot {
        let of = |y: &dyn Fn(&Row) -> f64| {
            let rows = self.rows.iter();
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
        if let (Some(first), Some(last)) = (self.rows.first(), self.rows.last()) {
            let exponent = self.fits.std_dev_theory;
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
            title: format!("Standard deviation against cells ({})", self.what()),
            x_label: "cells n".to_owned(),
            y_label: "√Var of the mean".to_owned(),
            curves,
        }
    }
}
