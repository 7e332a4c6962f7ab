//! `fredholm solve` and `fredholm check`.

use core::f64::consts::TAU;
use core::time::Duration;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

use fredholm_core::{DEFAULT_GENERATOR, Estimator, Real, STEP_LIMIT, Statistics, rounding_floor};
use fredholm_rayon::{Outcome, Plan, Stop, TargetError};

use crate::args::SolveArgs;
use crate::circle::{Known, Light, Question, Scene, Setup, light};
use crate::failure::{Ended, Failure, say};
use crate::file::{self, Placed, ProblemFile, Scalar, What, common_multiple, word};
use crate::numbers::short;
use crate::output::Output;
use crate::progress::{Progress, catch_interrupts};
use crate::report::{EndingsReport, EstimateReport, Report, TargetReport};
use crate::threads::with_threads;

/// Cells where the file has none: the first number from here on that fits the arcs.
const DEFAULT_CELLS: usize = 100;

/// A question with its name.
struct Asked {
    name: String,
    question: Question,
}

/// Reads and validates a file, with the command line's values in place of its own.
fn read(path: &Path, replace: impl FnOnce(&mut ProblemFile)) -> Result<ProblemFile, Failure> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|error| Failure::input(format_args!("cannot read {name}: {error}")))?;
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
    if let Some(error) = args.target_error {
        file.walk.target_error = Some(Placed::flag("--target-error", error));
    }
}

/// The number of cells: the file's, or one that fits its arcs.
fn cells(file: &ProblemFile) -> usize {
    let arcs = file.problem.reflectance.value.len();
    let unit = match &file.problem.emission {
        file::Emission::Harmonic { .. } => arcs,
        file::Emission::Arcs(values) => common_multiple(arcs, values.value.len()),
    };
    match &file.galerkin.cells {
        Some(cells) => cells.value,
        None => DEFAULT_CELLS.next_multiple_of(unit),
    }
}

/// Every target of the file; a grid is one for each of its points.
fn questions(file: &ProblemFile) -> Result<Vec<Asked>, Failure> {
    let mut all = Vec::new();
    for target in &file.targets {
        let name = &target.name.value;
        let mut ask = |name: String, question| all.push(Asked { name, question });
        match &target.what {
            What::At(angle) => ask(name.clone(), Question::At(angle.value)),
            What::OverAll => ask(name.clone(), Question::Over(0.0, TAU)),
            What::Over(from, to) => ask(name.clone(), Question::Over(from.value, to.value)),
            What::Grid(points) => {
                for i in 0..points.value {
                    let angle = TAU * i as f64 / points.value as f64;
                    ask(format!("{name}[{i}]"), Question::At(angle));
                }
            }
        }
    }
    let mut names: Vec<&str> = all.iter().map(|asked| asked.name.as_str()).collect();
    names.sort_unstable();
    if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Failure::input(format_args!(
            "two targets are named {:?}, one of them a point of a grid: rename one",
            pair[0]
        )));
    }
    Ok(all)
}

/// The values of an array.
fn values(array: &Placed<Vec<Placed<f64>>>) -> Vec<f64> {
    array.value.iter().map(|value| value.value).collect()
}

/// What stands in the file, as the circle wants it.
struct Owned {
    reflectance: Vec<f64>,
    emission: Vec<f64>,
}

impl Owned {
    fn new(file: &ProblemFile) -> Self {
        let emission = match &file.problem.emission {
            file::Emission::Harmonic { .. } => Vec::new(),
            file::Emission::Arcs(array) => values(array),
        };
        Self {
            reflectance: values(&file.problem.reflectance),
            emission,
        }
    }

    fn scene(&self, file: &ProblemFile) -> Result<Scene<'_>, Failure> {
        let cells = cells(file);
        let light: Light<'_> = light(&file.problem.emission, &self.emission, cells)?;
        Ok(Scene {
            reflectance: &self.reflectance,
            light,
            cells,
            absorption: file.walk.absorption.value,
            pairs: file.galerkin.pairs.value,
        })
    }
}

/// Bytes of the tables and of what is kept for each target.
fn memory(file: &ProblemFile, scene: &Scene<'_>, targets: usize) -> usize {
    let tables = match file.walk.scalar.value {
        Scalar::F32 => scene.memory::<f32>(),
        Scalar::F64 => scene.memory::<f64>(),
    };
    tables.saturating_add(targets.saturating_mul(1024))
}

/// Refuses what does not fit into the memory that is free now.
fn refuse_beyond_memory(file: &ProblemFile, needed: usize, cells: usize) -> Result<(), Failure> {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let available = system.available_memory();
    if available == 0 || (needed as u64) < available {
        return Ok(());
    }
    let message = format!(
        "{cells} cells need {} of memory, and {} are free: use fewer cells",
        bytes(needed as u64),
        bytes(available)
    );
    Err(match &file.galerkin.cells {
        Some(cells) => file.refuse(cells, message).into(),
        None => Failure::input(message),
    })
}

/// Refuses walks whose error bars would mean nothing.
fn refuse_infinite_variance(file: &ProblemFile, scene: &Scene<'_>) -> Result<(), Failure> {
    let radius = scene.second_moment()?;
    if radius < 1.0 {
        return Ok(());
    }
    // The radius is proportional to 1/(1 − q0).
    let most = 1.0 - radius * (1.0 - scene.absorption);
    let message = format!(
        "the variance of a walk is infinite with `absorption` = {}: reflectance²/(1 − absorption) \
         has an estimated spectral radius of {}, and it must be below 1; use an `absorption` below \
         {most:.2e} (or --allow-infinite-variance: error bars then mean nothing)",
        scene.absorption,
        short(radius)
    );
    Err(file.refuse(&file.walk.absorption, message).into())
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
fn plan(file: &ProblemFile, time_limit: Option<Duration>) -> Plan {
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
            TargetError::Relative(error.value)
        } else {
            TargetError::Absolute(error.value)
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
            let is_grid = |target: &&file::Target| matches!(target.what, What::Grid(_));
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
    let file = read(&args.file, |file| replace(file, args))?;
    let time_limit = args.time_limit.map(time_limit).transpose()?;
    let owned = Owned::new(&file);
    let scene = owned.scene(&file)?;
    let asked = questions(&file)?;
    if !args.allow_infinite_variance {
        refuse_infinite_variance(&file, &scene)?;
    }
    refuse_beyond_memory(&file, memory(&file, &scene, asked.len()), scene.cells)?;
    let output = match &args.out {
        Some(path) => Some(open_output(path, &file)?),
        None => None,
    };
    catch_interrupts()?;
    let plan = plan(&file, time_limit);
    let job = || match file.walk.scalar.value {
        Scalar::F32 => answer::<f32>(&file, scene, &asked, &plan),
        Scalar::F64 => answer::<f64>(&file, scene, &asked, &plan),
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
            plan.walks
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
fn answer<F: Real>(
    file: &ProblemFile,
    scene: Scene<'_>,
    asked: &[Asked],
    plan: &Plan,
) -> Result<(Report, Ended), Failure> {
    let walks = plan.walks.saturating_mul(asked.len() as u64);
    let progress = Progress::new(walks);
    progress.say("setting up".to_owned());
    let setup = Setup::<F>::new(scene)?;
    let questions: Vec<Question> = asked.iter().map(|asked| asked.question).collect();
    let known = setup.known(&questions)?;
    let start = Instant::now();
    let outcome = setup.run(&questions, &known, plan, &progress)?;
    let walk_seconds = start.elapsed().as_secs_f64();
    progress.done();

    let (stop, ended) = ending(&outcome, plan);
    let largest = setup.largest();
    let targets = asked
        .iter()
        .zip(&known)
        .zip(&outcome.statistics)
        .map(|((asked, known), statistics)| {
            let u = statistics.preconditioned().estimate;
            let floor = rounding_floor::<F>(largest, u, setup.contraction);
            target_report(asked, known, statistics, floor)
        })
        .collect();
    let report = Report {
        problem: "circle",
        cells: scene.cells,
        degree: file.galerkin.degree.value,
        pairs: word(&scene.pairs),
        absorption: scene.absorption,
        estimator: word(&file.walk.estimator.value),
        scalar: word(&file.walk.scalar.value),
        generator: DEFAULT_GENERATOR,
        batch: plan.batch,
        seed: plan.seed,
        stop,
        sweeps: setup.solve.sweeps,
        residual: setup.solve.residual,
        states: outcome.statistics.iter().map(Statistics::states).sum(),
        setup_seconds: setup.seconds,
        walk_seconds,
        targets,
    };
    Ok((report, ended))
}

fn ending(outcome: &Outcome, plan: &Plan) -> (&'static str, Ended) {
    match outcome.stop {
        Stop::Done => ("done", Ended::Done),
        Stop::ErrorNotReached => ("error_not_reached", Ended::ErrorNotReached),
        Stop::TimeLimit if plan.target_error.is_some() => ("time_limit", Ended::ErrorNotReached),
        Stop::TimeLimit => ("time_limit", Ended::Done),
        Stop::Cancelled => ("cancelled", Ended::Interrupted),
    }
}

fn target_report(
    asked: &Asked,
    known: &Known,
    statistics: &Statistics,
    rounding_floor: f64,
) -> TargetReport {
    let walks = statistics.walks();
    let (at, over) = match asked.question {
        Question::At(s) => (Some(s), None),
        Question::Over(from, to) => (None, Some([from, to])),
    };
    TargetReport {
        name: asked.name.clone(),
        at,
        over,
        exact: known.exact,
        galerkin: known.galerkin,
        walks,
        rounding_floor,
        endings: EndingsReport::new(statistics),
        plain: EstimateReport::new(statistics.plain(), walks),
        preconditioned: EstimateReport::new(statistics.preconditioned(), walks),
    }
}

/// Nanoseconds of a visited state on one thread, on the machines this was measured on.
const STATE_NANOSECONDS: f64 = 25.0;
/// Nanoseconds of the set-up for a cell: tables, and sweeps of a few nanoseconds each.
const SETUP_NANOSECONDS: f64 = 800.0;

/// Runs `check`.
pub(crate) fn check(path: &Path) -> Result<Ended, Failure> {
    let file = read(path, |_| ())?;
    let owned = Owned::new(&file);
    let scene = owned.scene(&file)?;
    let asked = questions(&file)?;
    refuse_infinite_variance(&file, &scene)?;
    let needed = memory(&file, &scene, asked.len());
    refuse_beyond_memory(&file, needed, scene.cells)?;
    let threads = std::thread::available_parallelism().map_or(1, core::num::NonZero::get);
    let walks = file.walk.walks.value as f64 * asked.len() as f64;
    let states = walks * (1.0 / file.walk.absorption.value).min(f64::from(STEP_LIMIT));
    let seconds = scene.cells as f64 * SETUP_NANOSECONDS * 1e-9
        + states * STATE_NANOSECONDS * 1e-9 / threads as f64;
    let most = if file.walk.target_error.is_some() {
        "at most "
    } else {
        ""
    };
    let rows = [
        ("problem", "circle".to_owned()),
        ("cells", scene.cells.to_string()),
        ("pairs", word(&scene.pairs)),
        ("estimator", word(&file.walk.estimator.value)),
        ("scalar", word(&file.walk.scalar.value)),
        ("targets", asked.len().to_string()),
        ("walks", format!("{most}{walks}")),
        ("states", format!("{most}about {states:.1e}")),
        ("memory", format!("about {}", bytes(needed as u64))),
        (
            "time",
            format!("{most}about {} s on {threads} threads", short(seconds)),
        ),
    ];
    let mut stdout = std::io::stdout().lock();
    writeln!(stdout, "{} is valid", path.display())?;
    for (name, value) in rows {
        writeln!(stdout, "{name:<10} {value}")?;
    }
    Ok(Ended::Done)
}
