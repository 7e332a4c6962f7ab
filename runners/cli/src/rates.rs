//! `fredholm rates`: how fast the error falls, beside theory and beside other methods.
//!
//! A sweep over cells, with N = n² walks on n cells, for the mean of u over X. At one point the
//! standard deviation depends on where the point lies in its cell; the mean has no such place.

mod by_degree;

use std::io::Write;
use std::time::Instant;

use fredholm_core::{Estimate, Statistics, StopReason};
use serde::Serialize;

use crate::args::RatesArgs;
use crate::failure::{Ended, Failure, say};
use crate::figure::{Curve, Figure, Style, log_log_svg};
use crate::file::{Placed, ProblemFile, word};
use crate::numbers::{aligned, short, slope};
use crate::output::{Output, open_all};
use crate::problem::{self, Problem};
use crate::progress::Progress;
use crate::solve;
use crate::threads::with_threads;
use crate::walks::Plan;
use by_degree::ByDegree;

/// A standard deviation is measured on so many walks at least; the error of fewer follows from it.
const ENOUGH_WALKS: u64 = 1 << 16;
/// And on so many where it is the reference for what has no known solution.
const REFERENCE_WALKS: u64 = 1 << 22;

/// The time of a plain walk is that of so many at most.
const PLAIN_WALKS: u64 = 1 << 18;

/// A standard deviation is left out of fits where it is below this part of the plain one: rounding may hold
/// it there.
const ROUNDING: f64 = 1e-12;

/// What a sweep gave. Names are a promise; fields may be added.
#[derive(Debug, Serialize)]
struct Rates {
    problem: &'static str,
    dimension: Option<usize>,
    degree: usize,
    pairs: String,
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
    /// p.
    degree: usize,
    /// As the file counts them: of a cube, per axis.
    cells: usize,
    /// n.
    unknowns: usize,
    /// N = n².
    walks: u64,
    /// Kernel evaluations of the set-up, and of all; `null` where seconds tell the work.
    setup_evaluations: Option<f64>,
    evaluations: Option<f64>,
    /// Seconds of the set-up, and of all; `null` where kernel evaluations tell the work.
    setup_seconds: Option<f64>,
    seconds: Option<f64>,
    std_dev_plain: f64,
    std_dev: f64,
    /// √(Var/N) of the preconditioned estimate of N walks.
    error: f64,
    /// √(Var/N) of as much work spent on plain walks alone.
    #[serde(rename = "error_plain")]
    error_plain_in_evaluations: Option<f64>,
    error_plain_in_seconds: Option<f64>,
    /// What rounding leaves of the error however many walks there are.
    rounding_floor: f64,
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
    /// The same from a tenth of the finest level's cells on.
    std_dev_last_decade: Option<f64>,
    std_dev_theory: f64,
    /// error ~ evaluations^this, or seconds^this.
    #[serde(rename = "error")]
    error_in_evaluations: Option<f64>,
    error_in_seconds: Option<f64>,
    error_theory: f64,
}

/// Runs `rates`.
pub(crate) fn rates(args: &RatesArgs) -> Result<Ended, Failure> {
    let files = files(args)?;
    let mut sweeps = Vec::new();
    for file in &files {
        let whole = problem::of_file(file)?;
        let levels = levels(file, &*whole, &args.cells)?;
        whole.refuse_infinite_variance()?;
        sweeps.push(Sweep {
            file,
            levels,
            measured: args.walks,
            timed: files.len() > 1 || !whole.counts_evaluations(),
            whole,
        });
    }
    let outputs = match &args.out {
        Some(folder) => Some(open_all(folder, FILES)?),
        None => None,
    };
    let (all, ended) = with_threads(args.common.threads, || run(&sweeps))??;
    let report = match <[Rates; 1]>::try_from(all) {
        Ok([one]) if sweeps.len() == 1 => Report::One(one),
        Ok([first]) => Report::Several(ByDegree::new(vec![first])),
        Err(all) => Report::Several(ByDegree::new(all)),
    };
    let mut json = serde_json::to_string_pretty(&report).map_err(Failure::run)?;
    json.push('\n');
    let written = match outputs {
        Some(outputs) if ended == Ended::Done => report.write(outputs, &json),
        _ => Ok(()),
    };
    let text = if args.common.json {
        json
    } else {
        report.text()
    };
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()?;
    if ended == Ended::Interrupted {
        say("warning: interrupted; these are the levels that were finished");
    }
    written.map(|()| ended)
}

/// The file as the command line changes it, once for every degree.
fn files(args: &RatesArgs) -> Result<Vec<ProblemFile>, Failure> {
    let read = |degree: Option<usize>| {
        solve::read(&args.file, |file| {
            if let Some(seed) = args.seed {
                file.walk.seed = Placed::flag("--seed", seed);
            }
            if let Some(pairs) = args.pairs {
                file.galerkin.pairs = Placed::flag("--pairs", pairs);
            }
            if let Some(grading) = args.grading {
                file.galerkin.grading = Some(Placed::flag("--grading", grading));
            }
            if args.shadow_cuts {
                file.galerkin.shadow_cuts = Some(Placed::flag("--shadow-cuts", true));
            }
            if let Some(degree) = degree {
                file.galerkin.degree = Placed::flag("--degree", degree);
            }
        })
    };
    let mut degrees = args.degree.clone();
    degrees.sort_unstable();
    degrees.dedup();
    if degrees.is_empty() {
        return Ok(vec![read(None)?]);
    }
    degrees
        .into_iter()
        .map(|degree| read(Some(degree)))
        .collect()
}

/// The files of `--out`.
const FILES: [&str; 4] = ["rates.csv", "rates.json", "work-error.svg", "deviation.svg"];

/// What was measured.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Report {
    /// At one degree.
    One(Rates),
    /// At several.
    Several(ByDegree),
}

impl Report {
    fn text(&self) -> String {
        match self {
            Self::One(rates) => rates.text(),
            Self::Several(several) => several.text(),
        }
    }

    /// Writes the table and the two figures.
    fn write(&self, outputs: [Output; 4], json: &str) -> Result<(), Failure> {
        let [csv_file, json_file, work_file, deviation_file] = outputs;
        let (sweeps, work, deviation) = match self {
            Self::One(rates) => (
                core::slice::from_ref(rates),
                rates.work_figure(),
                rates.deviation_figure(),
            ),
            Self::Several(several) => (
                several.sweeps(),
                several.work_figure(),
                several.deviation_figure(),
            ),
        };
        let mut writer = csv::Writer::from_writer(Vec::new());
        for row in sweeps.iter().flat_map(|sweep| &sweep.rows) {
            writer.serialize(row).map_err(Failure::run)?;
        }
        let bytes = writer.into_inner().map_err(Failure::run)?;
        csv_file.finish(&String::from_utf8(bytes).map_err(Failure::run)?)?;
        json_file.finish(json)?;
        work_file.finish(&log_log_svg(&work).map_err(Failure::run)?)?;
        deviation_file.finish(&log_log_svg(&deviation).map_err(Failure::run)?)
    }
}

/// All sweeps, or those before an interruption and as much as was finished of the one it met.
fn run(sweeps: &[Sweep<'_>]) -> Result<(Vec<Rates>, Ended), Failure> {
    let mut all = Vec::new();
    for sweep in sweeps {
        let (rates, ended) = sweep.run()?;
        all.push(rates);
        if ended != Ended::Done {
            return Ok((all, ended));
        }
    }
    Ok((all, Ended::Done))
}

/// The levels that were asked for, each as good as the file's own cells; or those of the problem.
fn levels(file: &ProblemFile, whole: &dyn Problem, asked: &[usize]) -> Result<Vec<usize>, Failure> {
    let mut levels = asked.to_vec();
    levels.sort_unstable();
    levels.dedup();
    for &cells in &levels {
        let mut file = file.clone();
        file.galerkin.cells = Some(Placed::flag("--cells", cells));
        file.validate()?;
        solve::refuse_beyond_memory(&file, &*problem::of_file(&file)?)?;
    }
    Ok(if levels.is_empty() {
        whole.levels()
    } else {
        levels
    })
}

/// The fitted exponents of √Var in n and of the error in kernel evaluations, from so many walks on every
/// one of these cells; `None` where the walks were interrupted.
pub(crate) fn exponents(
    file: &ProblemFile,
    cells: &[usize],
    walks: u64,
) -> Result<Option<[f64; 2]>, Failure> {
    let sweep = Sweep {
        file,
        whole: problem::of_file(file)?,
        levels: cells.to_vec(),
        timed: false,
        measured: Some(walks),
    };
    let (rates, ended) = sweep.run()?;
    let fits = (rates.fits.std_dev, rates.fits.error_in_evaluations);
    match (ended, fits) {
        (Ended::Done, (Some(std_dev), Some(error))) => Ok(Some([std_dev, error])),
        (Ended::Done, _) => Err(Failure::run("a sweep has no slope")),
        _ => Ok(None),
    }
}

/// What is to be measured.
struct Sweep<'a> {
    file: &'a ProblemFile,
    whole: Box<dyn Problem + 'a>,
    levels: Vec<usize>,
    /// Whether work is told by the clock.
    timed: bool,
    /// Walks of a level's standard deviation, if the command line says how many.
    measured: Option<u64>,
}

impl Sweep<'_> {
    /// The walks that are made on a level.
    fn walks(&self, cells: usize) -> Result<u64, Failure> {
        if let Some(measured) = self.measured {
            return Ok(measured);
        }
        let enough = squared(&*self.whole.mean_on(cells)?).max(ENOUGH_WALKS);
        Ok(if self.levels.last() == Some(&cells) {
            enough.max(REFERENCE_WALKS)
        } else {
            enough
        })
    }

    /// Seconds of a plain walk, where the clock tells the work.
    fn clock(&self, level: &dyn Problem, plan: &Plan) -> Result<Option<f64>, Failure> {
        if !self.timed {
            return Ok(None);
        }
        let mut plan = plan.clone();
        plan.walks = plan.walks.min(PLAIN_WALKS);
        let plain = level.plain(&plan, &Progress::hidden())?;
        Ok(Some(plain.walk_seconds / plan.walks as f64))
    }

    /// All levels, or those before an interruption.
    fn run(&self) -> Result<(Rates, Ended), Failure> {
        let mut plan = solve::plan(self.file, None);
        plan.target_error = None;
        let mut total = 0_u64;
        for &cells in &self.levels {
            total = total.saturating_add(self.walks(cells)?);
        }
        let progress = Progress::new(total);

        let (mut rows, mut estimates) = (Vec::new(), Vec::new());
        let (mut exact, mut ended) = (None, Ended::Done);
        for &cells in &self.levels {
            plan.walks = self.walks(cells)?;
            let start = Instant::now();
            let level = self.whole.mean_on(cells)?;
            let cutting = start.elapsed().as_secs_f64();
            progress.say(format!("{} unknowns", level.unknowns()));
            let answer = level.answer(&plan, &progress)?;
            if answer.outcome.stop == StopReason::Cancelled {
                ended = Ended::Interrupted;
                break;
            }
            let (Some(statistics), Some(known), Some(&floor)) = (
                answer.outcome.statistics.first(),
                answer.known.first(),
                answer.floors.first(),
            ) else {
                return Err(Failure::run("a level has no result"));
            };
            exact = known.exact;
            let clock = self.clock(&*level, &plan)?.map(|plain| Clock {
                setup: cutting + answer.setup_seconds,
                walk: answer.walk_seconds / statistics.walks() as f64,
                plain,
            });
            let evaluations = level.evaluations(answer.solve.sweeps);
            estimates.push(statistics.preconditioned());
            let work = clock.ok_or(evaluations);
            let degree = self.file.galerkin.degree.value;
            let found = (statistics, known.galerkin, floor);
            rows.push(Row::new(&*level, degree, work, found));
        }
        let nystrom = match ended {
            Ended::Done if !self.timed => self.whole.nystrom()?,
            _ => Vec::new(),
        };
        progress.done();
        let rates = Rates::new(self, plan.seed, (exact, &estimates), rows, nystrom);
        Ok((rates, ended))
    }
}

/// An exponent, where there is one.
fn exponent(x: Option<f64>) -> String {
    x.map_or("-".to_owned(), |x| format!("{x:.3}"))
}

/// N = n².
fn squared(level: &dyn Problem) -> u64 {
    (level.unknowns() as u64).saturating_pow(2)
}

/// Seconds of a set-up, of a walk that both equations follow, and of a plain one.
#[derive(Clone, Copy, Debug)]
struct Clock {
    setup: f64,
    walk: f64,
    plain: f64,
}

impl Row {
    /// `work`: what the clock says or, where it is not asked, the kernel evaluations of the set-up.
    fn new(
        level: &dyn Problem,
        degree: usize,
        work: Result<Clock, f64>,
        (statistics, galerkin, rounding_floor): (&Statistics, f64, f64),
    ) -> Self {
        let deviation = |estimate: Estimate| estimate.std_dev.unwrap_or(f64::NAN);
        let (plain, std_dev) = (
            deviation(statistics.plain()),
            deviation(statistics.preconditioned()),
        );
        let walks = squared(level);
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
            cells: level.cells(),
            unknowns: level.unknowns(),
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
            rounding_floor,
            galerkin,
            error_galerkin: None,
        }
    }

    /// Whether the deviation is none of rounding.
    fn is_above_rounding(&self) -> bool {
        self.std_dev > ROUNDING * self.std_dev_plain
    }

    /// The columns of the table for people.
    fn columns(unit: &str) -> [&str; 11] {
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
    fn texts(&self) -> [String; 11] {
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
    fn work(&self) -> [f64; 3] {
        let one = |counted: Option<f64>, timed: Option<f64>| counted.or(timed).unwrap_or(f64::NAN);
        [
            one(self.setup_evaluations, self.setup_seconds),
            one(self.evaluations, self.seconds),
            one(self.error_plain_in_evaluations, self.error_plain_in_seconds),
        ]
    }
}

impl Rates {
    fn new(
        sweep: &Sweep<'_>,
        seed: u64,
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
        let galerkin = &sweep.file.galerkin;
        let (whole, degree) = (&*sweep.whole, galerkin.degree.value);
        let order = whole.order(degree);
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
            problem: whole.kind(),
            dimension: whole.dimension(),
            degree,
            pairs: word(&galerkin.pairs.value),
            absorption: whole.absorption(),
            seed,
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
    fn named(&self) -> String {
        let dimension = self.dimension;
        let dimension = dimension.map_or(String::new(), |d| format!(" of dimension {d}"));
        format!("{}{dimension}", self.problem)
    }

    /// "the mean of u, 5 (exact)".
    fn mean_text(&self) -> String {
        let error = self.mean_std_error;
        let error = error.map_or("(exact)".to_owned(), |e| {
            format!("± {e:.1e} (finest level)")
        });
        format!("the mean of u, {:.9} {error}", self.mean)
    }

    /// From where errors are told.
    fn reference(&self) -> &'static str {
        match self.mean_std_error {
            Some(_) => "the finest level's estimate, where that is known well enough",
            None => "the exact value",
        }
    }

    /// The tables for people.
    fn text(&self) -> String {
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
    fn unit(&self) -> &'static str {
        match self.rows.first() {
            Some(row) if row.seconds.is_some() => "seconds",
            _ => "evaluations",
        }
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
        Figure {
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
