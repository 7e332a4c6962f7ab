//! `fredholm times`: targets of a scene under the suns and skies of many times.

use std::path::Path;

use fredholm::report::TimesReport;
use fredholm::scene::TimesRequest;
use fredholm::{Error, SceneModel};
use fredholm_file::kinds::Scene;
use fredholm_file::parts::output::Output;
use fredholm_file::scene::Times;

use crate::args::TimesArgs;
use crate::failure::{Ended, Failure, print, say};
use crate::file::Resolution;
use crate::progress::{Progress, Signals};
use crate::solve::{Problem, read};
use crate::table;
use crate::threads::with_threads;

/// Walks of a target where nothing is said, and the first ones where an error is asked for.
const WALKS: [u64; 2] = [4096, 1024];

/// Runs `times`.
pub(crate) fn times(args: &TimesArgs, signals: &Signals) -> Result<Ended, Failure> {
    let file = read(&args.file, |file| args.walks.set(&mut file.walk))?;
    let Some(scene) = file.problem.of::<Scene>() else {
        return Err(Failure::input(format_args!(
            "{}: suns and skies over time shine on scenes, `kind = \"scene\"`",
            args.file.display()
        )));
    };
    let times = Times::read(&args.times, scene.file.sky.as_ref())?;
    for remark in &times.remarks {
        say(format_args!("note: {remark}"));
    }
    let output = args.out.as_deref().map(open).transpose()?;
    let mut problem = Problem::new(file, None)?;
    let settings = &mut problem.resolved.settings;
    let is_asked = settings.tolerance.is_some();
    settings.walks = settings.walks.or(Some(WALKS[usize::from(is_asked)]));
    let Resolution::Scene(model) = &problem.resolved.model else {
        return Err(Failure::run("a scene without a model"));
    };
    let found = with_threads(args.common.threads, || {
        at_times(&problem, model, &times, signals)
    })?;
    let Some(report) = problem.unless_interrupted(found)? else {
        return Ok(Ended::Interrupted);
    };
    if let Some((is_json, output)) = output {
        let text = match is_json {
            true => table::json(&report)?,
            false => report.csv().map_err(Failure::run)?,
        };
        output.finish(text.into_bytes())?;
    }
    print(match args.common.json {
        true => table::json(&report)?,
        false => report.table(),
    })?;
    Ok(Ended::Done)
}

/// The file of `--out`, and whether it is JSON.
fn open(path: &Path) -> Result<(bool, Output), Failure> {
    let is_json = match path.extension().and_then(|end| end.to_str()) {
        Some("json") => true,
        Some("csv") => false,
        _ => return Err(Failure::of_out(path, "the name must end in .csv or .json")),
    };
    Ok((is_json, Output::open("--out", path)?))
}

fn at_times(
    problem: &Problem,
    model: &SceneModel,
    times: &Times,
    signals: &Signals,
) -> Result<TimesReport, Error> {
    let settings = &problem.resolved.settings;
    let walk = settings.walk_options();
    let progress = Progress::of_each(problem.goals.len(), &walk, signals);
    let request = TimesRequest {
        goals: &problem.goals,
        times: &times.lights,
        walk: &walk,
    };
    let found = model.at_times(&settings.discretisation(), &request, &progress);
    progress.done();
    let names = times.names.clone();
    Ok(TimesReport::new(model, &problem.goals, names, &found?))
}
