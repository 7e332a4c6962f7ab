//! The table of a sweep: errors against work, and the exponents that they follow.

use fredholm_core::Estimate;
use serde::Serialize;

use super::{Deterministic, Level, Sweep};
use crate::report::named;
use crate::{Choices, Pairs};
use fredholm_model::numbers::{aligned, short, slope};

/// A standard deviation is left out of fits where it is below this part of the plain one: rounding may hold
/// it there.
const ROUNDING: f64 = 1e-12;

/// The rates of a sweep. The serialised names are stable; fields may be added.
#[derive(Debug, Serialize)]
pub struct Rates {
    /// The kind of the problem.
    pub problem: &'static str,
    /// The dimension d of a cube.
    pub dimension: Option<usize>,
    /// The degree of the polynomials on a cell.
    pub degree: usize,
    /// The degree of the lift, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lift: Option<usize>,
    /// The name of the choice of pairs.
    pub pairs: &'static str,
    /// The absorption probability q0; null: walks end by roulette.
    pub absorption: Option<f64>,
    /// The seed of the walks.
    pub seed: u64,
    /// The mean of u: exact, or the preconditioned estimate of the finest level.
    pub mean: f64,
    /// The standard error of the mean; `None` if it is exact.
    pub mean_std_error: Option<f64>,
    /// The levels, the coarsest first.
    pub rows: Vec<Row>,
    /// Deterministic solutions to compare with.
    pub nystrom: Vec<Deterministic>,
    /// The fitted exponents.
    pub fits: Fits,
}

/// One level of a sweep.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The degree of the polynomials on a cell.
    pub degree: usize,
    /// The number of cells; of a cube, per axis.
    pub cells: usize,
    /// The number n of unknowns.
    pub unknowns: usize,
    /// The number N = n² of walks.
    pub walks: u64,
    /// Kernel evaluations of the set-up; `None` if seconds tell the work.
    pub setup_evaluations: Option<f64>,
    /// Kernel evaluations of the set-up and N walks; `None` if seconds tell the work.
    pub evaluations: Option<f64>,
    /// Seconds of the set-up; `None` if kernel evaluations tell the work.
    pub setup_seconds: Option<f64>,
    /// Seconds of the set-up and N walks; `None` if kernel evaluations tell the work.
    pub seconds: Option<f64>,
    /// √Var of a plain walk.
    pub std_dev_plain: f64,
    /// √Var of a walk that both equations follow.
    pub std_dev: f64,
    /// √(Var/N) of the preconditioned estimate of N walks.
    pub error: f64,
    /// √(Var/N) of as many kernel evaluations spent on plain walks alone.
    #[serde(rename = "error_plain")]
    pub error_plain_in_evaluations: Option<f64>,
    /// √(Var/N) of plain walks that take as many seconds.
    pub error_plain_in_seconds: Option<f64>,
    /// The error by rounding, which more walks do not lower.
    pub rounding_floor: f64,
    /// The mean (v, Φ) of the Galerkin solution.
    pub galerkin: f64,
    /// The error of (v, Φ); `None` if it is not known well enough.
    pub error_galerkin: Option<f64>,
}

/// Exponents, found and expected.
#[derive(Debug, Serialize)]
pub struct Fits {
    /// √Var ~ n^this.
    pub std_dev: Option<f64>,
    /// The exponent of the standard deviation from a tenth of the finest level's cells on.
    pub std_dev_last_decade: Option<f64>,
    /// The exponent of √Var in theory.
    pub std_dev_theory: f64,
    /// error ~ evaluations^this.
    #[serde(rename = "error")]
    pub error_in_evaluations: Option<f64>,
    /// error ~ seconds^this.
    pub error_in_seconds: Option<f64>,
    /// The exponent of the error in theory.
    pub error_theory: f64,
}

/// The text of a fitted exponent; a dash if there is none.
#[must_use]
pub fn exponent(x: Option<f64>) -> String {
    x.map_or("-".to_owned(), |x| format!("{x:.3}"))
}

/// The number N = n² of walks on n unknowns.
#[must_use]
pub fn squared(unknowns: usize) -> u64 {
    (unknowns as u64).saturating_pow(2)
}

impl Row {
    /// The row of a level. Work is what the clock says or, if it is not asked, kernel evaluations.
    #[must_use]
    pub fn new(level: &Level, degree: usize) -> Self {
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

    /// Whether the standard deviation is above what rounding makes.
    #[must_use]
    pub fn is_above_rounding(&self) -> bool {
        self.std_dev > ROUNDING * self.std_dev_plain
    }

    /// √(Var/N) of as many walks as these seconds leave after the set-up, or what rounding leaves of it; `None` if the set-up
    /// takes longer, or if seconds were not measured.
    #[must_use]
    pub fn error_in(&self, seconds: f64) -> Option<f64> {
        let setup = self.setup_seconds?;
        let walk = (self.seconds? - setup) / self.walks as f64;
        let left = seconds - setup;
        let error = self.std_dev * (walk / left).sqrt();
        (left > 0.0).then(|| error.max(self.rounding_floor))
    }

    /// The heads of the table for people, with this unit of work.
    #[must_use]
    pub fn columns(unit: &str) -> [&str; 11] {
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

    /// The cells of the table for people.
    #[must_use]
    pub fn texts(&self) -> [String; 11] {
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

    /// The work of the set-up and of all, in kernel evaluations or seconds, and the error of plain walks with as much.
    #[must_use]
    pub fn work(&self) -> [f64; 3] {
        let one = |counted: Option<f64>, timed: Option<f64>| counted.or(timed).unwrap_or(f64::NAN);
        [
            one(self.setup_evaluations, self.setup_seconds),
            one(self.evaluations, self.seconds),
            one(self.error_plain_in_evaluations, self.error_plain_in_seconds),
        ]
    }
}

impl Rates {
    /// The rates of a sweep from its rows, the exact mean or the estimates of all levels, and deterministic solutions.
    #[must_use]
    pub fn new(
        sweep: &Sweep<'_>,
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
        let about = sweep.model.about();
        let order = sweep.order();
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
            lift: sweep.lift,
            pairs: match sweep.lift {
                Some(_) => Pairs::Pointwise,
                None => sweep.walk.pairs,
            }
            .word(),
            absorption: sweep.walk.absorption.probability(),
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

    /// The name of the problem: "cube of dimension 2".
    #[must_use]
    pub fn named(&self) -> String {
        named(self.problem, self.dimension)
    }

    /// The mean for people: "the mean of u, 5 (exact)".
    #[must_use]
    pub fn mean_text(&self) -> String {
        let error = self.mean_std_error;
        let error = error.map_or("(exact)".to_owned(), |e| {
            format!("± {e:.1e} (finest level)")
        });
        format!("the mean of u, {:.9} {error}", self.mean)
    }

    /// The reference of errors, in words.
    #[must_use]
    pub fn reference(&self) -> &'static str {
        match self.mean_std_error {
            Some(_) => "the finest level's estimate, where that is known well enough",
            None => "the exact value",
        }
    }

    /// The tables for people.
    #[must_use]
    pub fn text(&self) -> String {
        let mut rows = vec![Row::columns(self.unit()).map(str::to_owned).to_vec()];
        rows.extend(self.rows.iter().map(|row| row.texts().to_vec()));
        let mut text = format!(
            "{}, degree {}{}, {} pairs: {}\n\n{}",
            self.named(),
            self.degree,
            self.lift
                .map_or(String::new(), |lift| format!(" lifted to {lift}")),
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

    /// The unit of work: "seconds" or "evaluations".
    #[must_use]
    pub fn unit(&self) -> &'static str {
        match self.rows.first() {
            Some(row) if row.seconds.is_some() => "seconds",
            _ => "evaluations",
        }
    }
}
