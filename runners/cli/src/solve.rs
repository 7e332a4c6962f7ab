//! `fredholm solve` and `fredholm check`.

use core::time::Duration;
use std::io::Write;
use std::path::Path;

use fredholm_core::{DEFAULT_GENERATOR, Estimator, STEP_LIMIT, Statistics, StopReason, Tolerance};
use fredholm_rayon::Outcome;

use crate::args::SolveArgs;
use crate::failure::{Ended, Failure, say};
use crate::file::{self, Placed, ProblemFile, What, word};
use crate::numbers::short;
use crate::output::Output;
use crate::problem::{self, Asked, Known, Problem, Where};
use crate::progress::Progress;
use crate::report::{
    Coordinates, EndingsReport, EnergyReport, EstimateReport, Over, Report, TargetReport,
};
use crate::split::{self, Split};
use crate::threads::with_threads;
use crate::walks::Plan;

/// Reads and validates a file, with the command line's values in place of its own.
pub(crate) fn read(
    path: &Path,
    replace: impl FnOnce(&mut ProblemFile),
) -> Result<ProblemFile, Failure> {
    let name = path.display().to_string();
    let text = file::utf8(&name, file::load(path, file::MAX_BYTES)?)?;
    let mut file = file::read(&name, &text)?;
    replace(&mut file);
    file.validate()?;
    Ok(file)
}

/// The flags that were given, in place of the file's values.
fn replace(file: &mut ProblemFile, args: &SolveArgs) {
    fn set<T: Copy>(to: &mut Placed<T>, flag: &'static str, value: Option<T>) {
        if let Some(value) = value {
            *to = Placed::flag(flag, value);
        }
    }
    if let Some(cells) = args.cells {
        file.galerkin.cells = Some(Placed::flag("--cells", cells));
    }
    set(&mut file.galerkin.degree, "--degree", args.degree);
    set(&mut file.galerkin.pairs, "--pairs", args.pairs);
    set(&mut file.walk.walks, "--walks", args.walks);
    set(&mut file.walk.estimator, "--estimator", args.estimator);
    set(&mut file.walk.scalar, "--scalar", args.scalar);
    set(&mut file.walk.seed, "--seed", args.seed);
    set(
        &mut file.walk.relative,
        "--relative",
        args.relative.then_some(true),
    );
    file.walk.allow_infinite_variance = args.allow_infinite_variance;
    if let Some(error) = args.target_error {
        file.walk.target_error = Some(Placed::flag("--target-error", error));
    }
}

/// Refuses what does not fit into the memory that is free now.
pub(crate) fn refuse_beyond_memory(
    file: &ProblemFile,
    problem: &dyn Problem,
) -> Result<(), Failure> {
    refuse_memory(file, problem.unknowns(), problem.memory())
}

/// "2.0 GB of memory, and 1.0 GB are free", where it is so.
pub(crate) fn lacking_memory(needed: usize) -> Option<String> {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let available = system.available_memory();
    (available > 0 && needed as u64 >= available).then(|| {
        format!(
            "{} of memory, and {} are free",
            bytes(needed as u64),
            bytes(available)
        )
    })
}

/// The same of so many cells that need so many bytes.
pub(crate) fn refuse_memory(
    file: &ProblemFile,
    unknowns: usize,
    needed: usize,
) -> Result<(), Failure> {
    let Some(lacking) = lacking_memory(needed) else {
        return Ok(());
    };
    let message = format!(
        "{unknowns} unknowns need {lacking}: use fewer cells{}",
        match &file.problem {
            file::Problem::Cube(_) => ", or `kernel_factors` if the kernel is a product",
            file::Problem::Circle(_) | file::Problem::Room(_) => "",
        }
    );
    Err(match &file.galerkin.cells {
        Some(cells) => file.refuse(cells, message).into(),
        None => Failure::input(message),
    })
}

fn bytes(count: u64) -> String {
    let mega = count as f64 / 1e6;
    if mega < 1000.0 {
        format!("{mega:.1} MB")
    } else {
        format!("{:.1} GB", mega / 1000.0)
    }
}

/// The plan of the file.
pub(crate) fn plan(file: &ProblemFile, time_limit: Option<Duration>) -> Plan {
    let walk = &file.walk;
    let mut plan = Plan::new(walk.walks.value);
    plan.seed = walk.seed.value;
    plan.batch = walk.batch.value;
    plan.estimator = match walk.estimator.value {
        file::Estimator::Absorption => Estimator::Absorption,
        file::Estimator::Collision => Estimator::Collision,
    };
    plan.target_error = walk.target_error.as_ref().map(|error| {
        if walk.relative.value {
            Tolerance::Relative(error.value)
        } else {
            Tolerance::Absolute(error.value)
        }
    });
    plan.time_limit = time_limit;
    plan
}

/// The kinds of result files.
enum Format {
    Json,
    Csv,
    /// Of the grid target with this name.
    Svg(String),
}

/// What to write where, known to be possible before any work is done.
fn open_output(path: &Path, file: &ProblemFile) -> Result<(Format, Output), Failure> {
    let refuse = |why: &str| Failure::input(format_args!("`--out {}`: {why}", path.display()));
    let format = match path.extension().and_then(|e| e.to_str()) {
        Some("json") => Format::Json,
        Some("csv") => Format::Csv,
        Some("svg") => {
            let is_grid = |target: &&file::Target| matches!(target.what, What::Grid(..));
            let mut grids = file.targets.iter().filter(is_grid);
            match (grids.next(), grids.next()) {
                (Some(grid), None) => Format::Svg(grid.name.value.clone()),
                (None, _) => {
                    return Err(refuse("a picture needs a target with `grid = points`"));
                }
                _ => return Err(refuse("a picture shows one grid; the file has several")),
            }
        }
        _ => return Err(refuse("the name must end in .json, .csv or .svg")),
    };
    Ok((format, Output::open(path)?))
}

/// Runs `solve`.
pub(crate) fn solve(args: &SolveArgs) -> Result<Ended, Failure> {
    let given = read(&args.file, |file| replace(file, args))?;
    let time_limit = args.time_limit.map(time_limit).transpose()?;
    let output = match &args.out {
        Some(path) => Some(open_output(path, &given)?),
        None => None,
    };
    let job = || -> Result<_, Failure> {
        match split::choose(&given)? {
            Some(split) => answer(&split.file, &plan(&split.file, time_limit), Some(&split)),
            None => answer(&given, &plan(&given, time_limit), None),
        }
    };
    let (report, ended) = with_threads(args.common.threads, job)??;

    // Results that cannot be written to their file are printed nevertheless.
    let written = output.map_or(Ok(()), |(format, output)| {
        output.finish(&match format {
            Format::Json => report.json()?,
            Format::Csv => report.csv()?,
            Format::Svg(name) => report.svg(&name)?,
        })
    });
    let text = if args.common.json {
        report.json()?
    } else {
        report.table()
    };
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()?;
    for remark in report.remarks() {
        say(format_args!("warning: {remark}"));
    }
    match report.stop {
        "error_not_reached" => say(format_args!(
            "warning: the asked error was not reached within {} walks a target",
            given.walk.walks.value
        )),
        "time_limit" => say("warning: stopped at the time limit; these are partial results"),
        "cancelled" => say("warning: interrupted; these are partial results"),
        _ => {}
    }
    written.map(|()| ended)
}

fn time_limit(seconds: f64) -> Result<Duration, Failure> {
    Duration::try_from_secs_f64(seconds)
        .ok()
        .filter(|limit| !limit.is_zero())
        .ok_or_else(|| {
            Failure::input(format_args!(
                "`--time-limit {seconds:?}`: a number of seconds from 1e-9 to 1e19 is needed"
            ))
        })
}

/// Sets up, walks, and says what came.
fn answer(
    file: &ProblemFile,
    plan: &Plan,
    split: Option<&Split>,
) -> Result<(Report, Ended), Failure> {
    let problem: &dyn Problem = &*problem::of_file(file)?;
    let plain = split.is_some_and(|split| split.plain);
    if split.is_none() {
        refuse_beyond_memory(file, problem)?;
        if !file.walk.allow_infinite_variance {
            problem.refuse_infinite_variance()?;
        }
    }
    let asked = problem.asked();
    let predicted = split.map(|split| split.report.predicted_walks as u64);
    let all = plan.walks.saturating_mul(asked.len() as u64);
    let progress = Progress::new(predicted.map_or(all, |predicted| predicted.min(all)));
    progress.say("setting up".to_owned());
    let mut answer = match split.and_then(|split| split.solved.as_ref()) {
        _ if plain => problem.plain(plan, &progress)?,
        Some(solved) => problem.walk(solved, plan, &progress)?,
        None => problem.answer(plan, &progress)?,
    };
    progress.done();
    if plain {
        // There is no Galerkin solution.
        for known in &mut answer.known {
            known.galerkin = f64::NAN;
        }
    }

    let (stop, ended) = ending(&answer.outcome, plan);
    let statistics = answer.outcome.statistics.iter();
    let targets = asked
        .iter()
        .zip(&answer.known)
        .zip(statistics.clone().zip(&answer.floors))
        .map(|((asked, known), (statistics, &floor))| {
            target_report(problem, asked, known, statistics, floor)
        })
        .collect();
    let mut targets: Vec<TargetReport> = targets;
    for (target, besides) in targets.iter_mut().zip(&answer.besides) {
        let report = |estimate| EstimateReport::new(estimate, target.walks);
        target.irradiance = besides.irradiance.map(report);
        target.net_flux = besides.net_flux.map(report);
    }
    let report = Report {
        problem: problem.kind(),
        dimension: problem.dimension(),
        cells: if plain { 0 } else { problem.cells() },
        unknowns: if plain { 0 } else { problem.unknowns() },
        degree: file.galerkin.degree.value,
        pairs: if plain {
            "no".to_owned()
        } else {
            word(&file.galerkin.pairs.value)
        },
        pair_counts: answer.pair_counts,
        absorption: file.walk.absorption.value,
        estimator: word(&file.walk.estimator.value),
        scalar: word(&file.walk.scalar.value),
        generator: DEFAULT_GENERATOR,
        batch: plan.batch,
        seed: plan.seed,
        stop,
        sweeps: answer.solve.sweeps,
        residual: answer.solve.residual,
        states: statistics.map(Statistics::states).sum(),
        setup_seconds: answer.setup_seconds,
        walk_seconds: answer.walk_seconds,
        split: split.map(|split| split.report.clone()),
        choice: split.map_or(String::new(), |split| {
            split.report.text(file, &problem.cells_text())
        }),
        energy: EnergyReport::new(answer.fluxes),
        targets,
    };
    Ok((report, ended))
}

fn ending(outcome: &Outcome, plan: &Plan) -> (&'static str, Ended) {
    match outcome.stop {
        StopReason::Done => ("done", Ended::Done),
        StopReason::ToleranceNotReached => ("error_not_reached", Ended::ErrorNotReached),
        StopReason::TimeLimit if plan.target_error.is_some() => {
            ("time_limit", Ended::ErrorNotReached)
        }
        StopReason::TimeLimit => ("time_limit", Ended::Done),
        StopReason::Cancelled => ("cancelled", Ended::Interrupted),
    }
}

fn target_report(
    problem: &dyn Problem,
    asked: &Asked,
    known: &Known,
    statistics: &Statistics,
    rounding_floor: f64,
) -> TargetReport {
    let walks = statistics.walks();
    TargetReport {
        name: asked.name.clone(),
        at: match &asked.place {
            Where::Angle(s) => Some(Coordinates::One(*s)),
            Where::Point(x) => Some(Coordinates::Many(x.clone())),
            Where::On(surface, t) => problem.surface(*surface).map(|name| Coordinates::On {
                surface: name.to_owned(),
                t: *t,
            }),
            _ => None,
        },
        over: match asked.place {
            Where::Arc(from, to) => Some(Over::Interval([from, to])),
            Where::All => Some(Over::Word("all".to_owned())),
            Where::Surface(surface) => {
                let name = problem.surface(surface);
                name.map(|name| Over::Word(name.to_owned()))
            }
            _ => None,
        },
        weight: match &asked.place {
            Where::Weight(text) => Some(text.clone()),
            _ => None,
        },
        exact: known.exact,
        galerkin: known.galerkin,
        walks,
        rounding_floor,
        endings: EndingsReport::new(statistics),
        plain: EstimateReport::new(statistics.plain(), walks),
        preconditioned: EstimateReport::new(statistics.preconditioned(), walks),
        irradiance: None,
        net_flux: None,
    }
}

/// Runs `check`.
pub(crate) fn check(path: &Path) -> Result<Ended, Failure> {
    let given = read(path, |_| ())?;
    let split = split::choose(&given)?;
    let file = split.as_ref().map_or(&given, |split| &split.file);
    let problem = problem::of_file(file)?;
    if split.is_none() {
        refuse_beyond_memory(file, &*problem)?;
        problem.refuse_infinite_variance()?;
    }
    let threads = std::thread::available_parallelism().map_or(1, core::num::NonZero::get);
    let targets = problem.asked().len();
    let mut rows = vec![("problem", problem.kind().to_owned())];
    let neighbour = [
        ("cells", problem.cells_text()),
        ("degree", file.galerkin.degree.value.to_string()),
        ("unknowns", problem.unknowns().to_string()),
        ("pairs", word(&file.galerkin.pairs.value)),
    ];
    match &split {
        Some(split) if split.plain => rows.push((
            "walks are",
            "plain: a neighbour equation does not pay at this error".to_owned(),
        )),
        _ => rows.extend(neighbour),
    }
    rows.push(("absorption", file.walk.absorption.value.to_string()));
    rows.push(("estimator", word(&file.walk.estimator.value)));
    rows.push(("scalar", word(&file.walk.scalar.value)));
    rows.push(("targets", targets.to_string()));
    let (walks, states, seconds, most) = match &split {
        Some(split) => {
            let report = &split.report;
            let seconds = report.predicted_setup_seconds + report.predicted_walk_seconds;
            let walks = format!("about {:.1e}", report.predicted_walks);
            (walks, report.predicted_states, seconds, "")
        }
        None => {
            let walks = file.walk.walks.value as f64 * problem.starts() as f64;
            let steps = (1.0 / file.walk.absorption.value).min(f64::from(STEP_LIMIT));
            let (cost, pairs) = (problem.cost(), problem.pointwise_pairs()?);
            let walk = cost.walk.seconds(file.walk.estimator.value, steps, pairs);
            let (states, seconds) = (walks * steps, cost.setup + walks * walk);
            let most = match file.walk.target_error {
                Some(_) => "at most ",
                None => "",
            };
            (format!("{most}{walks}"), states, seconds, most)
        }
    };
    let time = short(seconds / threads as f64);
    rows.push(("walks", walks));
    rows.push(("states", format!("{most}about {states:.1e}")));
    rows.push((
        "memory",
        format!("about {}", bytes(problem.memory() as u64)),
    ));
    rows.push(("time", format!("{most}about {time} s on {threads} threads")));
    let mut stdout = std::io::stdout().lock();
    writeln!(stdout, "{} is valid", path.display())?;
    if split.is_some() {
        writeln!(
            stdout,
            "chosen for the target error, as the file does not say:"
        )?;
    }
    for (name, value) in rows {
        writeln!(stdout, "{name:<10} {value}")?;
    }
    Ok(Ended::Done)
}
