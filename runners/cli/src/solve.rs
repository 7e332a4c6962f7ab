//! `fredholm solve` and `fredholm check`.

use core::time::Duration;
use std::path::Path;

use fredholm::choice::choose;
use fredholm::memory::{bytes, refuse_beyond_memory};
use fredholm::report::Report;
use fredholm::resolvent::ResolventAnswer;
use fredholm::{
    Choices, Error, Goal, Model, Partitioned, Settings, SolveError, Solver, Target, asked_way_back,
};
use fredholm_core::STEP_LIMIT;
use fredholm_file::Resolved;
use fredholm_file::parts::{Keeper, Share, SystemFile};

use crate::Process;
use crate::args::SolveArgs;
use crate::drawing;
use crate::failure::{Ended, Failure, print, say};
use crate::file::{self, ProblemFile, SetByFlag as _};
use crate::global;
use crate::numbers::short;
use crate::progress::{Progress, Signals};
use crate::results::{self, Format, Results};
use crate::table;
use crate::threads::with_threads;
use fredholm::StopReason;
use fredholm_file::parts::output::Output;

/// Reads and validates a file, with the command line's values in place of its own.
pub(crate) fn read(
    path: &Path,
    replace: impl FnOnce(&mut ProblemFile),
) -> Result<ProblemFile, Failure> {
    let (name, bytes) = if path == Path::new("-") {
        let stdin = std::io::stdin().lock();
        let name = "standard input";
        (
            name.to_owned(),
            file::load_from(name, stdin, file::MAX_BYTES)?,
        )
    } else {
        (
            path.display().to_string(),
            file::load(path, file::MAX_BYTES)?,
        )
    };
    let text = file::utf8(&name, bytes)?;
    let mut file = file::read(&name, &text)?;
    replace(&mut file);
    file.validate()?;
    for remark in file.remarks() {
        say(format_args!("warning: {remark}"));
    }
    Ok(file)
}

/// The flags that were given, in place of the file's values.
fn replace(file: &mut ProblemFile, args: &SolveArgs) {
    args.method.replace(file);
    file.galerkin.lift.set_by("--lift", args.lift);
    let walk = &mut file.walk;
    walk.method.set_by("--method", args.by);
    walk.walks.set_by("--walks", args.walks);
    walk.sequence.set_by("--sequence", args.sequence);
    walk.forced_steps
        .set_by("--forced-steps", args.forced_steps);
    walk.last_step.set_by("--last-step", args.last_step);
    walk.adjoint.set_by("--adjoint", args.adjoint);
    walk.scalar.set_by("--scalar", args.scalar);
    walk.seed.set_by("--seed", args.seed);
    walk.sensitivities
        .set_by("--sensitivities", args.sensitivities.then_some(true));
    walk.target_error
        .set_by("--target-error", args.target_error);
    walk.relative
        .set_by("--relative", args.relative.then_some(true));
    walk.global.set_by("--global", args.global.then_some(true));
    walk.global
        .set_by("--no-global", args.no_global.then_some(false));
    walk.allow_infinite_variance = args.allow_infinite_variance;
}

/// Cells that fit into the memory that is free now.
pub(crate) fn cut<'m>(
    file: &ProblemFile,
    model: &'m dyn Model,
    settings: &Settings,
    goals: &[Goal],
) -> Result<Box<dyn Partitioned<'m> + 'm>, Failure> {
    let cells = model
        .partition(&settings.discretisation())
        .map_err(Failure::of(file))?;
    let needed = cells.memory(goals, settings.walk_options().pairs);
    let what = || format!("{} unknowns", cells.unknowns());
    refuse_beyond_memory(what, needed, model.about().less_memory).map_err(Failure::of(file))?;
    Ok(cells)
}

/// A file, and what it comes to.
pub(crate) struct Problem {
    pub(crate) file: ProblemFile,
    pub(crate) resolved: Resolved,
    pub(crate) goals: Vec<Goal>,
}

impl Problem {
    /// What was found, and nothing of an interrupted command, which is said.
    pub(crate) fn unless_interrupted<T>(
        &self,
        found: Result<T, Error>,
    ) -> Result<Option<T>, Failure> {
        match found {
            Err(Error::Cancelled) => {
                say("warning: interrupted");
                Ok(None)
            }
            found => found.map(Some).map_err(Failure::of(&self.file)),
        }
    }

    /// The problem, with notes to the user.
    pub(crate) fn new(file: ProblemFile, time_limit: Option<Duration>) -> Result<Self, Failure> {
        let problem = Self::without_notes(file, time_limit)?;
        for note in problem.model().notes() {
            say(format_args!("note: {note}"));
        }
        Ok(problem)
    }

    pub(crate) fn without_notes(
        file: ProblemFile,
        time_limit: Option<Duration>,
    ) -> Result<Self, Failure> {
        let mut resolved = file.resolve()?;
        resolved.settings.time_limit = time_limit;
        let goals = fredholm::goals(resolved.model.model(), &resolved.targets)
            .map_err(Failure::of(&file))?;
        Ok(Self {
            file,
            resolved,
            goals,
        })
    }

    pub(crate) fn model(&self) -> &dyn Model {
        self.resolved.model.model()
    }

    fn way_back(&self) -> Result<Option<Box<dyn Model + '_>>, Failure> {
        let back = asked_way_back(self.model(), &self.resolved.settings, &self.goals);
        back.map_err(Failure::of(&self.file))
    }
}

/// Runs `solve`.
pub(crate) fn solve(
    args: &SolveArgs,
    signals: &Signals,
    process: Option<Process<'_>>,
) -> Result<Ended, Failure> {
    let begun = begin(args, process)?;
    if begun.problem.resolved.settings.global == Some(true) {
        return global::solve(begun, &args.common, signals);
    }
    let problem = &begun.problem;
    let parts = args.part.map_or(1, |part| part.of);
    let answered = with_threads(args.common.threads, || answer(&begun, signals, parts))?;
    let Some((mut report, ended)) = answered? else {
        // Others may walk already, and wait for this one.
        if process.is_some() {
            return Err(Failure::run("interrupted before the walks"));
        }
        say("warning: interrupted before the walks");
        return Ok(Ended::Interrupted);
    };
    if !leads(process) {
        return Ok(ended);
    }
    report.part = args.part.map(|part| part.to_string());
    let written = show(&report, args.common.json, begun.output)?;
    let walks = problem.resolved.settings.walk_options().walks;
    let within = || format!(" within {walks} walks a target");
    let why = report.reason.as_ref().map(|why| format!(": {why}"));
    say_stop(report.stop, &why.unwrap_or_else(within));
    if let (Some(part), Some(path)) = (&report.part, &args.save) {
        say(format_args!(
            "note: this is part {part} alone, kept in {}; `fredholm merge` makes one result of all parts",
            path.display()
        ));
    }
    written.map(|()| ended)
}

/// Says why walks ended before what was asked for, and of a requested error why it was not reached.
pub(crate) fn say_stop(stop: StopReason, why: &str) {
    match stop {
        StopReason::ToleranceNotReached => say(format_args!(
            "warning: the requested error was not reached{why}"
        )),
        StopReason::TimeLimit => {
            say("warning: stopped at the time limit; these are partial results");
        }
        StopReason::Cancelled => say("warning: interrupted; these are partial results"),
        StopReason::Done => {}
    }
}

/// Prints a report, and writes it to its file. Results that cannot be written there are printed nevertheless.
pub(crate) fn show(
    report: &impl Results,
    as_json: bool,
    output: Vec<(Format, Output)>,
) -> Result<Result<(), Failure>, Failure> {
    let written = results::finish(output, report);
    print(if as_json {
        table::json(report)?
    } else {
        report.table()
    })?;
    for remark in report.remarks() {
        say(format_args!("warning: {remark}"));
    }
    Ok(written)
}

/// A command that is about to choose, to set up and to walk.
pub(crate) struct Begun<'a> {
    pub(crate) problem: Problem,
    pub(crate) output: Vec<(Format, Output)>,
    keeper: Option<Keeper<'a>>,
    systems: Option<SystemFile>,
}

impl Begun<'_> {
    /// The solver of these targets.
    pub(crate) fn solver(&self, targets: Vec<Target>) -> Solver<'_> {
        let problem = &self.problem;
        let solver = Solver::with(problem.model(), problem.resolved.settings.clone(), targets);
        match &self.systems {
            Some(systems) => solver.systems(systems),
            None => solver,
        }
    }
}

/// Whether this process prints and writes.
fn leads(process: Option<Process<'_>>) -> bool {
    process.is_none_or(|process| process.leads)
}

fn begin<'a>(args: &SolveArgs, process: Option<Process<'a>>) -> Result<Begun<'a>, Failure> {
    let (leads, is_alone) = (leads(process), process.is_none());
    let is_stdin = args.file == Path::new("-");
    if !is_alone && is_stdin {
        return Err(Failure::input(
            "several processes do not take the standard input: give this to `fredholm`",
        ));
    }
    let given = read(&args.file, |file| replace(file, args))?;
    let time_limit = args.time_limit.map(time_limit).transpose()?;
    let mut problem = Problem::new(given, time_limit)?;
    problem.resolved.settings.score_degree = args.score_degree;
    let settings = &problem.resolved.settings;
    if args.part.is_some() && settings.walks.is_none() && settings.tolerance.is_some() {
        return Err(Failure::input(
            "`--part` needs `--walks`, the number of walks of all parts together: which target error they reach is \
             known when they are merged",
        ));
    }
    let is_whole = settings.global == Some(true);
    if is_whole && (!is_alone || args.save.is_some() || args.part.is_some()) {
        return Err(Failure::input(
            "one set of walks for all targets (`global = true`, `--global`) is neither shared by processes nor kept in parts: \
             leave it out, or run `fredholm` without `--save` and `--part`",
        ));
    }
    let output = Format::open_all(args.out.as_deref(), &problem, leads)?;
    let header = problem.file.header(&problem.resolved)?;
    let share = args.part.map(|share| Share {
        after: args.after.unwrap_or(0),
        ..share
    });
    let save = args.save.as_deref().filter(|_| leads);
    let keeper = match process {
        Some(process) => Some(Keeper::open(save, &header, share)?.with_crew(process.crew)),
        None if save.is_some() => Some(Keeper::open(save, &header, share)?),
        None => None,
    };
    let systems = match (&args.system, &args.save_system) {
        (Some(path), _) => Some(SystemFile::open(path, &header)),
        // Others set up by themselves until it is there.
        (None, Some(path)) if leads || path.exists() => Some(SystemFile::make(path, &header)?),
        _ => None,
    };
    Ok(Begun {
        problem,
        output,
        keeper,
        systems,
    })
}

pub(crate) fn time_limit(seconds: f64) -> Result<Duration, Failure> {
    Duration::try_from_secs_f64(seconds)
        .ok()
        .filter(|limit| !limit.is_zero())
        .ok_or_else(|| {
            Failure::input(format_args!(
                "`--time-limit {seconds:?}`: a number of seconds from 1e-9 to 1e19 is needed"
            ))
        })
}

/// Chooses what is open, sets up, walks, and says what came; `None` if that was interrupted before the walks.
fn answer(
    begun: &Begun<'_>,
    signals: &Signals,
    parts: u64,
) -> Result<Option<(Report, Ended)>, Failure> {
    let problem = &begun.problem;
    let fail = Failure::of(&problem.file);
    let Resolved {
        targets, settings, ..
    } = &problem.resolved;
    let is_chosen = begun.systems.is_none() || settings.cells.is_none();
    let most = match settings.walks {
        // The choice predicts how many there are.
        None if settings.tolerance.is_some() => u64::MAX,
        _ => settings.walk_options().walks,
    };
    let (back, goals) = (problem.way_back()?, &problem.goals);
    let model = back.as_deref().unwrap_or(problem.model());
    // A room walks for net fluxes and irradiances, too.
    let starts = ((goals.len() + model.besides(goals)) / model.shared()) as u64;
    let progress = Progress::new((most / parts).saturating_mul(starts), signals);
    let doing = if is_chosen { "choosing" } else { "setting up" };
    progress.say(doing.to_owned());
    let solver = begun.solver(targets.clone());
    let solver = solver.means_between(results::means_between(&begun.output));
    let solver = match &begun.keeper {
        Some(keeper) => solver.execute(keeper),
        None => solver,
    };
    let solver = solver.observer(&progress);
    let solved = solver.solve();
    progress.done();
    Ok(match solved {
        Ok(report) => Some((report, Ended::Done)),
        Err(SolveError::Cancelled(None)) => None,
        Err(SolveError::Cancelled(Some(report))) => Some((*report, Ended::Interrupted)),
        Err(SolveError::NotReached(report)) => Some((*report, Ended::ErrorNotReached)),
        Err(SolveError::Failed(error)) => return Err(fail(error)),
        Err(error) => return Err(Failure::run(error)),
    })
}

/// The report of a problem, as its file says; `None` if it was interrupted.
pub(crate) fn report(
    problem: &Problem,
    progress: &Progress<'_>,
) -> Result<Option<Report>, Failure> {
    let Resolved {
        targets, settings, ..
    } = &problem.resolved;
    let solver = Solver::with(problem.model(), settings.clone(), targets.clone());
    match solver.observer(progress).solve() {
        Ok(report) => Ok(Some(report)),
        Err(SolveError::Cancelled(_)) => Ok(None),
        Err(SolveError::Failed(error)) => Err(Failure::of(&problem.file)(error)),
        Err(error) => Err(Failure::run(error)),
    }
}

/// What resolvent walks would do, for `check`.
fn resolvent_rows(
    path: &Path,
    model: &dyn Model,
    problem: &Problem,
    answer: &ResolventAnswer,
) -> String {
    let threads = std::thread::available_parallelism().map_or(1, core::num::NonZero::get);
    let numbers = 2 * size_of::<f64>() * answer.figures.unknowns.pow(2);
    let time = short(answer.setup_seconds + answer.walk_seconds / threads as f64);
    let rows = [
        ("problem", model.about().kind.to_owned()),
        ("method", "resolvent walks".to_owned()),
        ("cells", answer.cells.to_string()),
        ("degree", answer.degree.to_string()),
        ("unknowns", answer.figures.unknowns.to_string()),
        ("scalar", problem.resolved.settings.scalar.word().to_owned()),
        ("targets", problem.goals.len().to_string()),
        ("radius", short(answer.figures.radius)),
        ("condition", short(answer.figures.condition)),
        ("points", format!("about {:.1e}", answer.points as f64)),
        ("memory", format!("about {}", bytes(numbers as u64))),
        ("time", format!("about {time} s on {threads} threads")),
    ];
    let rows = rows.map(|(name, value)| format!("{name:<10} {value}\n"));
    format!("{} is valid\n{}", path.display(), rows.concat())
}

/// Runs `check`.
pub(crate) fn check(path: &Path, out: Option<&Path>, signals: &Signals) -> Result<Ended, Failure> {
    let scene = crate::scene::read(path, None)?;
    if let Some(scene) = &scene {
        let ended = crate::scene::check(scene, out)?;
        // Others are for form factors alone.
        if !scene.has_targets || scene.sky.is_some() {
            return Ok(ended);
        }
    }
    let file = read(path, |_| ())?;
    // Before what is drawn is refused.
    if let Some(out) = out.filter(|_| scene.is_none()) {
        drawing::draw(&file, out)?;
    }
    // Those of a scene have been said.
    let problem = match scene {
        Some(_) => Problem::without_notes(file, None)?,
        None => Problem::new(file, None)?,
    };
    let fail = Failure::of(&problem.file);
    let Resolved {
        targets, settings, ..
    } = &problem.resolved;
    let progress = Progress::new(u64::MAX, signals);
    progress.say("choosing".to_owned());
    let back = problem.way_back()?;
    let model = back.as_deref().unwrap_or(problem.model());
    let solver = Solver::with(model, settings.clone(), targets.clone()).observer(&progress);
    match solver.predict_resolvent() {
        Ok(Some(answer)) => {
            progress.done();
            return print(resolvent_rows(path, model, &problem, &answer)).map(|()| Ended::Done);
        }
        Ok(None) => {}
        Err(SolveError::Failed(error)) => return Err(fail(error)),
        Err(error) => return Err(Failure::run(error)),
    }
    let chosen = match choose(model, targets, settings, &progress) {
        Err(Error::Cancelled) => {
            progress.done();
            say("warning: interrupted");
            return Ok(Ended::Interrupted);
        }
        chosen => chosen.map_err(&fail)?,
    };
    progress.done();
    let settings = match &chosen {
        Some(chosen) => &chosen.settings,
        None => &problem.resolved.settings,
    };
    let (goals, walk) = (&problem.goals, settings.walk_options());
    let cells = match &chosen {
        Some(_) => model.partition(&settings.discretisation()).map_err(&fail)?,
        None => {
            let cells = cut(&problem.file, model, settings, goals)?;
            cells.check_variance(&walk).map_err(&fail)?;
            cells
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, core::num::NonZero::get);
    let mut rows = Vec::new();
    if scene.is_none() {
        rows.push(("problem", model.about().kind.to_owned()));
    }
    let neighbour = [
        ("cells", cells.cells_text()),
        ("degree", settings.discretisation().degree.to_string()),
        ("unknowns", cells.unknowns().to_string()),
        ("pairs", walk.pairs.word().to_owned()),
    ];
    match &chosen {
        Some(chosen) if chosen.plain => rows.push((
            "method",
            match walk.tolerance {
                Some(_) => "plain Monte Carlo: a neighbour equation does not pay at this error",
                None => "plain Monte Carlo: a neighbour equation does not pay for so few walks",
            }
            .to_owned(),
        )),
        Some(chosen) if chosen.is_whole() => {
            rows.push((
                "method",
                "global estimate: one set of walks for all targets".to_owned(),
            ));
            rows.extend(neighbour);
        }
        _ => rows.extend(neighbour),
    }
    let absorption = walk.absorption.probability();
    let text = absorption.map_or_else(|| "roulette".to_owned(), |q| q.to_string());
    rows.push(("absorption", text));
    rows.push(("estimator", walk.absorption.estimator().word().to_owned()));
    rows.push(("form", walk.form.word().to_owned()));
    rows.push(("scalar", settings.scalar.word().to_owned()));
    rows.push(("targets", goals.len().to_string()));
    let starts = (goals.len() + model.besides(goals)) / model.shared();
    let (walks, states, seconds, most) = match &chosen {
        Some(chosen) => {
            let report = &chosen.report;
            let sets = if chosen.is_whole() { 1 } else { starts };
            let limit = walk.walks as f64 * sets as f64;
            let share = (limit / report.predicted_walks).min(1.0);
            let states = share * report.predicted_states;
            let seconds = report.predicted_setup_seconds + share * report.predicted_walk_seconds;
            if walk.tolerance.is_none() {
                (limit.to_string(), states, seconds, "")
            } else if share < 1.0 {
                (format!("at most {limit}"), states, seconds, "at most ")
            } else {
                let walks = format!("about {:.1e}", report.predicted_walks);
                (walks, states, seconds, "")
            }
        }
        None => {
            let walks = walk.walks as f64 * starts as f64;
            // By roulette a walk goes on with the probability of its weight: √r in the mean, where r is the radius of T_k²p.
            let survival = match absorption {
                Some(q) => 1.0 - q,
                None => cells.plain_radius().map_err(&fail)?.sqrt(),
            };
            let steps = (1.0 / (1.0 - survival).max(0.0)).min(f64::from(STEP_LIMIT));
            let pairs = cells.pointwise_pairs(walk.pairs).map_err(&fail)?;
            let cost = cells.cost(walk.pairs);
            let each = cost.walk.seconds(walk.absorption.estimator(), steps, pairs)
                * model.shared() as f64;
            let (states, seconds) = (walks * steps, cost.setup + walks * each);
            let most = match walk.tolerance {
                Some(_) => "at most ",
                None => "",
            };
            (format!("{most}{walks}"), states, seconds, most)
        }
    };
    let time = short(seconds / threads as f64);
    rows.push(("walks", walks));
    rows.push(("states", format!("{most}about {states:.1e}")));
    let memory = cells.memory(goals, walk.pairs) as u64;
    rows.push(("memory", format!("about {}", bytes(memory))));
    rows.push(("time", format!("{most}about {time} s on {threads} threads")));
    let mut text = format!("{} is valid\n", path.display());
    if chosen.is_some() {
        let what = match walk.tolerance {
            Some(_) => "the target error".to_owned(),
            None if settings.global == Some(true) => format!("{} walks", walk.walks),
            None => format!("{} walks of each target", walk.walks),
        };
        text += &format!("chosen for {what}, as the file does not say:\n");
    }
    for (name, value) in rows {
        text += &format!("{name:<10} {value}\n");
    }
    print(text)?;
    Ok(Ended::Done)
}
