//! `fredholm fit`: quantities from measured targets.

use std::path::Path;

use fredholm::SolveError;
use fredholm_file::Placed;
use fredholm_file::parts::output::Output;

use crate::args::FitArgs;
use crate::failure::{Ended, Failure, print, say};
use crate::progress::{Progress, Signals};
use crate::solve::{Problem, read};
use crate::table;
use crate::threads::with_threads;

/// Runs `fit`.
pub(crate) fn fit(args: &FitArgs, signals: &Signals) -> Result<Ended, Failure> {
    let file = read(&args.file, |file| {
        args.walk.replace(&mut file.walk);
        if !args.quantity.is_empty() {
            let named = args.quantity.iter().cloned();
            file.fit = named.map(|name| Placed::flag("--quantity", name)).collect();
        }
    })?;
    let is_json = |path: &Path| path.extension().is_some_and(|e| e == "json");
    let open = |path: &Path| match path.extension().and_then(|e| e.to_str()) {
        Some("json" | "toml") => Ok(Output::open("--out", path)?),
        _ => Err(Failure::of_out(path, "the name must end in .toml or .json")),
    };
    let output = args.out.as_deref().map(open).transpose()?;
    let limit = args.walk.limit()?;
    let problem = Problem::new(file, limit)?;
    let fitting = problem.file.fitting(problem.model())?;
    let progress = Progress::new(u64::MAX, signals);
    progress.say("fitting".to_owned());
    let found = with_threads(args.common.threads, || {
        problem.file.find(&fitting, limit, &progress)
    })?;
    progress.done();
    let (fit, text) = match found {
        Ok(found) => found,
        Err(SolveError::Cancelled(_)) => {
            say("warning: interrupted");
            return Ok(Ended::Interrupted);
        }
        Err(SolveError::Failed(error)) => return Err(Failure::of(&problem.file)(error)),
        Err(error) => return Err(Failure::run(error)),
    };
    let json = table::json(&fit)?;
    let written = match (output, &args.out) {
        (Some(output), Some(path)) if is_json(path) => Ok(output.finish(json.clone())?),
        (Some(output), _) => Ok(output.finish(text)?),
        _ => Ok(()),
    };
    print(match args.common.json {
        true => json,
        false => fit.table(),
    })?;
    written.map(|()| match fit.is_plausible() {
        true => Ended::Done,
        false => Ended::Disagrees,
    })
}
