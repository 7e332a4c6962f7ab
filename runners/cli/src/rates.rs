//! `fredholm rates`: how fast the error falls, beside theory and beside other methods.
//!
//! A sweep over cells, with N = n² walks on n cells, for the mean of u over X. At one point the
//! standard deviation depends on where the point lies in its cell; the mean has no such place.

mod by_degree;
mod figures;

use fredholm::sweep::{PLAIN_WALKS, Rates, Row, Sweep, squared};
use serde::Serialize;

use crate::args::RatesArgs;
use crate::failure::{Ended, Failure, print, say};
use crate::file::{ProblemFile, SetByFlag as _};
use crate::progress::{Progress, Signals};
use crate::solve::{self, Problem};
use crate::table;
use crate::threads::with_threads;
use by_degree::ByDegree;
use figures::{deviation_figure, work_figure};
use fredholm_file::parts::output::{Output, open_all};

/// A standard deviation is measured on so many walks at least; the error of fewer follows from it.
const ENOUGH_WALKS: u64 = 1 << 16;
/// And on so many where it is the reference for what has no known solution.
const REFERENCE_WALKS: u64 = 1 << 22;

/// Runs `rates`.
pub(crate) fn rates(args: &RatesArgs, signals: &Signals) -> Result<Ended, Failure> {
    let files = files(args)?;
    let several = files.len() > 1;
    let mut problems = Vec::new();
    for file in files {
        file.refuse_adjoint()?;
        problems.push(if problems.is_empty() {
            Problem::new(file, None)?
        } else {
            Problem::without_notes(file, None)?
        });
    }
    let mut sweeps = Vec::new();
    for problem in &problems {
        let levels = levels(problem, &args.cells)?;
        let is_counted = problem.model().about().counts_evaluations;
        let is_timed = several || !is_counted || problem.resolved.settings.lifted().is_some();
        let sweeping = Sweeping::new(problem, levels, args.walks, is_timed);
        sweeping.check_variance()?;
        sweeps.push(sweeping);
    }
    let outputs = match &args.out {
        Some(folder) => Some(open_all("--out", folder, FILES)?),
        None => None,
    };
    let (all, ended) = with_threads(args.common.threads, || run(&sweeps, signals))??;
    let report = match <[Rates; 1]>::try_from(all) {
        Ok([one]) if sweeps.len() == 1 => Report::One(one),
        Ok([first]) => Report::Several(ByDegree::new(vec![first])),
        Err(all) => Report::Several(ByDegree::new(all)),
    };
    let json = table::json(&report)?;
    let written = match outputs {
        Some(outputs) if ended == Ended::Done => report.write(outputs, &json),
        _ => Ok(()),
    };
    print(if args.common.json {
        json
    } else {
        report.text()
    })?;
    if ended == Ended::Interrupted {
        say("warning: interrupted; these are the levels that were finished");
    }
    written.map(|()| ended)
}

/// The file as the command line changes it, once for every degree.
fn files(args: &RatesArgs) -> Result<Vec<ProblemFile>, Failure> {
    let read = |degree: Option<usize>| {
        solve::read(&args.file, |file| {
            let galerkin = &mut file.galerkin;
            galerkin.pairs.set_by("--pairs", args.pairs);
            galerkin.degree.set_by("--degree", degree);
            galerkin.grading.set_by("--grading", args.grading);
            let cuts = args.shadow_cuts.then_some(true);
            galerkin.shadow_cuts.set_by("--shadow-cuts", cuts);
            file.walk.seed.set_by("--seed", args.seed);
        })
    };
    let mut degrees = args.degree.clone();
    degrees.sort_unstable();
    degrees.dedup();
    if degrees.is_empty() {
        return Ok(vec![read(None)?]);
    }
    degrees.into_iter().map(Some).map(read).collect()
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
        let (sweeps, figures) = match self {
            Self::One(rates) => (
                core::slice::from_ref(rates),
                [work_figure(rates), deviation_figure(rates)].map(Some),
            ),
            Self::Several(several) => (
                several.sweeps(),
                [several.work_figure(), several.deviation_figure()],
            ),
        };
        let mut writer = csv::Writer::from_writer(Vec::new());
        for row in sweeps.iter().flat_map(|sweep| &sweep.rows) {
            writer.serialize(row).map_err(Failure::run)?;
        }
        let [csv_file, json_file, work_file, deviation_file] = outputs;
        csv_file.finish(writer.into_inner().map_err(Failure::run)?)?;
        json_file.finish(json)?;
        for (file, figure) in [work_file, deviation_file].into_iter().zip(figures) {
            let figure = figure.ok_or(fredholm_plot::Error::NothingToDraw);
            file.finish(table::drawn(figure.and_then(|figure| figure.draw()))?)?;
        }
        Ok(())
    }
}

/// All sweeps, or those before an interruption and as much as was finished of the one it met.
fn run(sweeps: &[Sweeping<'_>], signals: &Signals) -> Result<(Vec<Rates>, Ended), Failure> {
    let mut all = Vec::new();
    for sweep in sweeps {
        let (rates, ended) = sweep.run(signals)?;
        all.push(rates);
        if ended != Ended::Done {
            return Ok((all, ended));
        }
    }
    Ok((all, Ended::Done))
}

/// The levels that were asked for, each as good as the file's own cells; or those of the model.
fn levels(problem: &Problem, asked: &[usize]) -> Result<Vec<usize>, Failure> {
    let mut levels = asked.to_vec();
    levels.sort_unstable();
    levels.dedup();
    for &cells in &levels {
        let mut file = problem.file.clone();
        file.galerkin.cells.set_by("--cells", Some(cells));
        file.validate()?;
        let mut settings = problem.resolved.settings.clone();
        settings.cells = Some(cells);
        solve::cut(&file, problem.model(), &settings, &problem.goals)?;
    }
    Ok(if levels.is_empty() {
        let cut = problem.resolved.settings.discretisation();
        problem.model().levels(&cut)
    } else {
        levels
    })
}

/// The fitted exponents of √Var in n and of the error in kernel evaluations, from the file's walks on every one of these cells.
pub(crate) fn exponents(
    file: ProblemFile,
    cells: &[usize],
    signals: &Signals,
) -> Result<[Option<f64>; 2], Failure> {
    let problem = Problem::new(file, None)?;
    let walks = problem.resolved.settings.walk_options().walks;
    let sweeping = Sweeping::new(&problem, cells.to_vec(), Some(walks), false);
    let (rates, _) = sweeping.run(signals)?;
    Ok([rates.fits.std_dev, rates.fits.error_in_evaluations])
}

/// What is to be measured.
struct Sweeping<'a> {
    problem: &'a Problem,
    sweep: Sweep<'a>,
    levels: Vec<usize>,
    /// Walks of a level's standard deviation, if the command line says how many.
    measured: Option<u64>,
}

impl<'a> Sweeping<'a> {
    fn new(
        problem: &'a Problem,
        levels: Vec<usize>,
        measured: Option<u64>,
        is_timed: bool,
    ) -> Self {
        let settings = &problem.resolved.settings;
        Self {
            problem,
            sweep: Sweep {
                model: problem.model(),
                discretisation: settings.discretisation(),
                walk: settings.walk_options(),
                lift: settings.lifted(),
                timed: is_timed.then_some(PLAIN_WALKS),
            },
            levels,
            measured,
        }
    }

    /// Refuses walks of infinite variance on the file's own cells.
    fn check_variance(&self) -> Result<(), Failure> {
        let sweep = &self.sweep;
        let cells = sweep.model.partition(&sweep.discretisation);
        let checked = cells.and_then(|cells| cells.check_variance(&sweep.walk));
        checked.map_err(Failure::of(&self.problem.file))
    }

    /// The walks that are made on a level.
    fn walks(&self, cells: usize) -> Result<u64, Failure> {
        if let Some(measured) = self.measured {
            return Ok(measured);
        }
        let cut = self.sweep.cut(cells);
        let unknowns = cut.map_err(Failure::of(&self.problem.file))?.unknowns();
        let enough = squared(unknowns).max(ENOUGH_WALKS);
        Ok(if self.levels.last() == Some(&cells) {
            enough.max(REFERENCE_WALKS)
        } else {
            enough
        })
    }

    /// All levels, or those before an interruption.
    fn run(&self, signals: &Signals) -> Result<(Rates, Ended), Failure> {
        let fail = Failure::of(&self.problem.file);
        let mut total = 0_u64;
        for &cells in &self.levels {
            total = total.saturating_add(self.walks(cells)?);
        }
        let progress = Progress::new(total, signals);
        let (mut rows, mut estimates) = (Vec::new(), Vec::new());
        let (mut exact, mut ended) = (None, Ended::Done);
        for &cells in &self.levels {
            progress.say(format!("{cells} cells"));
            let walks = self.walks(cells)?;
            let level = self.sweep.level(cells, walks, &progress).map_err(&fail)?;
            let Some(level) = level else {
                ended = Ended::Interrupted;
                break;
            };
            exact = level.exact;
            estimates.push(level.statistics.preconditioned());
            rows.push(Row::new(&level, self.sweep.discretisation.degree));
        }
        let nystrom = match ended {
            Ended::Done if self.sweep.timed.is_none() => {
                self.sweep.model.nystrom().map_err(&fail)?
            }
            _ => Vec::new(),
        };
        progress.done();
        let rates = Rates::new(&self.sweep, (exact, &estimates), rows, nystrom);
        Ok((rates, ended))
    }
}
