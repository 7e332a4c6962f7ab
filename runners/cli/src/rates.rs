//! `fredholm rates`: how fast the error falls, beside theory and beside other methods.
//!
//! A sweep over cells, with N = n² walks on n cells, for the mean of u over X. At one point the
//! standard deviation depends on where the point lies in its cell; the mean has no such place.

use std::io::Write;

use fredholm_core::{Estimate, Statistics};
use fredholm_rayon::{Plan, Stop};
use serde::Serialize;

use crate::args::RatesArgs;
use crate::failure::{Ended, Failure, say};
use crate::figure::{Curve, Figure, Style, log_log_svg};
use crate::file::Placed;
use crate::numbers::{aligned, short, slope};
use crate::output::{Output, open_all};
use crate::problem::{self, Problem};
use crate::progress::{Progress, catch_interrupts};
use crate::solve;
use crate::threads::with_threads;

/// A standard deviation is measured on so many walks at least; the error of fewer follows from it.
const ENOUGH_WALKS: u64 = 1 << 16;
/// And on so many where it is the reference for what has no known solution.
const REFERENCE_WALKS: u64 = 1 << 22;

/// What a sweep gave. Names are a promise; fields may be added.
#[derive(Debug, Serialize)]
struct Rates {
    problem: &'static str,
    dimension: Option<usize>,
    degree: usize,
    absorption: f64,
    seed: u64,
    /// The mean of u: exact, or the preconditioned estimate of the finest level.
    mean: f64,
    /// Its standard error; `null` where it is exact.
    mean_std_error: Option<f64>,
    rows: Vec<Row>,
    nystrom: Vec<Deterministic>,
    fits: Fits,
}

/// One level.
#[derive(Clone, Debug, Serialize)]
struct Row {
    /// As the file counts them: of a cube, per axis.
    cells: usize,
    /// n.
    unknowns: usize,
    /// N = n².
    walks: u64,
    /// Kernel evaluations of the set-up, and of all.
    setup_evaluations: f64,
    evaluations: f64,
    std_dev_plain: f64,
    std_dev: f64,
    /// √(Var/N) of the preconditioned estimate of N walks.
    error: f64,
    /// √(Var/N) of as many evaluations spent on plain walks alone.
    error_plain: f64,
    /// (v, Φ), and its error; `null` where that is not known well enough.
    galerkin: f64,
    error_galerkin: Option<f64>,
}

/// A deterministic solution.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Deterministic {
    /// The number of nodes.
    pub(crate) nodes: usize,
    /// Kernel evaluations.
    pub(crate) evaluations: f64,
    /// The mean that it gives.
    pub(crate) mean: f64,
    /// Its error; `null` where that is not known well enough.
    pub(crate) error: Option<f64>,
}

/// Exponents, found and expected.
#[derive(Debug, Serialize)]
struct Fits {
    /// √Var ~ n^this.
    std_dev: Option<f64>,
    std_dev_theory: f64,
    /// error ~ evaluations^this.
    error: Option<f64>,
    error_theory: f64,
}

/// Runs `rates`.
pub(crate) fn rates(args: &RatesArgs) -> Result<Ended, Failure> {
    let file = solve::read(&args.file, |file| {
        if let Some(seed) = args.seed {
            file.walk.seed = Placed::flag("--seed", seed);
        }
    })?;
    let whole = problem::of_file(&file)?;
    whole.refuse_infinite_variance()?;
    let outputs = match &args.out {
        Some(folder) => Some(open_all(folder, FILES)?),
        None => None,
    };
    catch_interrupts()?;
    let mut plan = solve::plan(&file, None);
    plan.target_error = None;
    let job = || sweep(&*whole, plan, file.galerkin.degree.value);
    let (rates, ended) = with_threads(args.common.threads, job)??;
    let mut json = serde_json::to_string_pretty(&rates).map_err(Failure::run)?;
    json.push('\n');
    let written = match outputs {
        Some(outputs) if ended == Ended::Done => rates.write(outputs, &json),
        _ => Ok(()),
    };
    let text = if args.common.json { json } else { rates.text() };
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()?;
    if ended == Ended::Interrupted {
        say("warning: interrupted; these are the levels that were finished");
    }
    written.map(|()| ended)
}

/// The files of `--out`.
const FILES: [&str; 4] = ["rates.csv", "rates.json", "work-error.svg", "deviation.svg"];

/// All levels, or those before an interruption.
fn sweep(whole: &dyn Problem, mut plan: Plan, degree: usize) -> Result<(Rates, Ended), Failure> {
    let levels = whole.levels();
    let finest = levels.last().copied().unwrap_or(1);
    let mut total = REFERENCE_WALKS;
    for &cells in &levels {
        total += squared(&*whole.mean_on(cells)?).max(ENOUGH_WALKS);
    }
    let progress = Progress::new(total);

    let (mut rows, mut estimates) = (Vec::new(), Vec::new());
    let (mut exact, mut ended) = (None, Ended::Done);
    for &cells in &levels {
        let level = whole.mean_on(cells)?;
        let wanted = squared(&*level);
        plan.walks = wanted.max(ENOUGH_WALKS);
        if cells == finest {
            plan.walks = plan.walks.max(REFERENCE_WALKS);
        }
        progress.say(format!("{} cells", level.unknowns()));
        let answer = level.answer(&plan, &progress)?;
        if answer.outcome.stop == Stop::Cancelled {
            ended = Ended::Interrupted;
            break;
        }
        let (Some(statistics), Some(known)) =
            (answer.outcome.statistics.first(), answer.known.first())
        else {
            return Err(Failure::run("a level has no result"));
        };
        exact = known.exact;
        let setup = level.evaluations(answer.solve.sweeps);
        estimates.push(statistics.preconditioned());
        rows.push(Row::new(&*level, wanted, setup, statistics, known.galerkin));
    }
    let nystrom = match ended {
        Ended::Done => whole.nystrom()?,
        _ => Vec::new(),
    };
    progress.done();
    let rates = Rates::new(whole, plan.seed, degree, (exact, &estimates), rows, nystrom);
    Ok((rates, ended))
}

/// N = n².
fn squared(level: &dyn Problem) -> u64 {
    (level.unknowns() as u64).pow(2)
}

impl Row {
    fn new(
        level: &dyn Problem,
        walks: u64,
        setup_evaluations: f64,
        statistics: &Statistics,
        galerkin: f64,
    ) -> Self {
        let deviation = |estimate: Estimate| estimate.std_dev.unwrap_or(f64::NAN);
        let (plain, std_dev) = (
            deviation(statistics.plain()),
            deviation(statistics.preconditioned()),
        );
        // A walk of m states evaluates the kernel m − 1 times.
        let steps = statistics.states() as f64 / statistics.walks() as f64 - 1.0;
        let evaluations = setup_evaluations + walks as f64 * steps;
        Self {
            cells: level.cells(),
            unknowns: level.unknowns(),
            walks,
            setup_evaluations,
            evaluations,
            std_dev_plain: plain,
            std_dev,
            error: std_dev / (walks as f64).sqrt(),
            error_plain: plain / (evaluations / steps).sqrt(),
            galerkin,
            error_galerkin: None,
        }
    }
}

impl Rates {
    fn new(
        whole: &dyn Problem,
        seed: u64,
        degree: usize,
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
        let fit =
            |points: Vec<(f64, f64)>| slope(points.into_iter().map(|(x, y)| (x.ln(), y.ln())));
        let order = (degree + 1) as f64 / whole.dimension().unwrap_or(1) as f64;
        Self {
            problem: whole.kind(),
            dimension: whole.dimension(),
            degree,
            absorption: whole.absorption(),
            seed,
            mean,
            mean_std_error,
            fits: Fits {
                std_dev: fit(rows
                    .iter()
                    .map(|r| (r.unknowns as f64, r.std_dev))
                    .collect()),
                std_dev_theory: -order,
                error: fit(rows.iter().map(|r| (r.evaluations, r.error)).collect()),
                error_theory: -0.5 * order - 0.5,
            },
            rows,
            nystrom,
        }
    }

    /// The tables for people.
    fn text(&self) -> String {
        let header = [
            "cells",
            "n",
            "walks",
            "evaluations",
            "√Var plain",
            "√Var",
            "error",
            "plain",
            "Galerkin",
        ];
        let optional = |error: Option<f64>| error.map_or("-".to_owned(), short);
        let mut rows = vec![header.map(str::to_owned).to_vec()];
        for row in &self.rows {
            rows.push(vec![
                row.cells.to_string(),
                row.unknowns.to_string(),
                row.walks.to_string(),
                short(row.evaluations),
                short(row.std_dev_plain),
                short(row.std_dev),
                short(row.error),
                short(row.error_plain),
                optional(row.error_galerkin),
            ]);
        }
        let mut text = format!(
            "{}{}, degree {}: the mean of u, {:.9} {}\n\n{}",
            self.problem,
            self.dimension
                .map_or(String::new(), |d| format!(" of dimension {d}")),
            self.degree,
            self.mean,
            self.mean_std_error
                .map_or("(exact)".to_owned(), |e| format!(
                    "± {e:.1e} (finest level)"
                )),
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
                    optional(solution.error),
                ]);
            }
            text += &format!("\n{}", aligned(&rows));
        }
        let exponent = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.3}"));
        text += &format!(
            "\nerrors are those of the mean: of walks √(Var/N), of the others the distance from {}\n\
             plain: as many kernel evaluations spent on plain walks alone\n\n\
             fitted exponents\n  √Var  ~ n^{:<18} theory {:.3}\n  error ~ evaluations^{:<8} \
             theory {:.3}\n",
            if self.mean_std_error.is_some() {
                "the finest level's estimate, where that is known well enough"
            } else {
                "the exact value"
            },
            exponent(self.fits.std_dev),
            self.fits.std_dev_theory,
            exponent(self.fits.error),
            self.fits.error_theory,
        );
        text
    }

    /// Writes the table and the two figures.
    fn write(&self, outputs: [Output; 4], json: &str) -> Result<(), Failure> {
        let [csv_file, json_file, work, deviation] = outputs;
        let mut writer = csv::Writer::from_writer(Vec::new());
        for row in &self.rows {
            writer.serialize(row).map_err(Failure::run)?;
        }
        let bytes = writer.into_inner().map_err(Failure::run)?;
        csv_file.finish(&String::from_utf8(bytes).map_err(Failure::run)?)?;
        json_file.finish(json)?;
        work.finish(&log_log_svg(&self.work_figure()).map_err(Failure::run)?)?;
        deviation.finish(&log_log_svg(&self.deviation_figure()).map_err(Failure::run)?)
    }

    fn what(&self) -> String {
        match self.dimension {
            Some(d) => format!("{}, d = {d}", self.problem),
            None => self.problem.to_owned(),
        }
    }

    /// Errors against work.
    fn work_figure(&self) -> Figure {
        let of = |y: &dyn Fn(&Row) -> Option<f64>| {
            let rows = self.rows.iter();
            rows.filter_map(|row| Some((row.evaluations, y(row)?)))
                .collect::<Vec<_>>()
        };
        // A deterministic solution ends where its walks would begin.
        let galerkin = self.rows.iter();
        let galerkin = galerkin.filter_map(|r| Some((r.setup_evaluations, r.error_galerkin?)));
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
            curve("plain Monte Carlo", of(&|r| Some(r.error_plain)), 0, 1),
            curve("Galerkin alone", galerkin.collect(), 5, 3),
            curve("Gauss–Nyström", nystrom.collect(), 3, 2),
            curve("preconditioned", of(&|r| Some(r.error)), 1, 0),
        ];
        if let (Some(first), Some(last)) = (self.rows.first(), self.rows.last()) {
            let exponent = self.fits.error_theory;
            let from = (first.evaluations, 2.0 * first.error);
            let name = format!("slope {exponent:.2}").replace('-', "−");
            curves.push(Curve::power_law(&name, exponent, from, last.evaluations));
        }
        Figure {
            title: format!("Error of the mean against work ({})", self.what()),
            x_label: "kernel evaluations, set-up included".to_owned(),
            y_label: "error".to_owned(),
            curves,
        }
    }

    /// √Var against n.
    fn deviation_figure(&self) -> Figure {
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
        Figure {
            title: format!("Standard deviation against cells ({})", self.what()),
            x_label: "cells n".to_owned(),
            y_label: "√Var of the mean".to_owned(),
            curves,
        }
    }
}
