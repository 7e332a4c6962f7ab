//! `fredholm merge`.

use fredholm::Tolerance;

use crate::args::MergeArgs;
use crate::failure::{Ended, Failure, say};
use crate::results::Format;
use crate::solve::{Problem, show};
use fredholm::StopReason;

/// Runs `merge`.
pub(crate) fn merge(args: &MergeArgs) -> Result<Ended, Failure> {
    let tolerance = match (args.target_error, args.relative) {
        (None, _) => None,
        (Some(error), _) if !(error > 0.0) => {
            return Err(Failure::input(format_args!(
                "`--target-error {error:?}`: it must be a number above 0"
            )));
        }
        (Some(error), true) => Some(Tolerance::Relative(error)),
        (Some(error), false) => Some(Tolerance::Absolute(error)),
    };
    let merged = fredholm_file::parts::merge(&args.parts, tolerance)?;
    let (report, file) = fredholm_file::parts::merged(&merged)?;
    let output = match &args.out {
        Some(path) => vec![Format::open(path, &Problem::without_notes(file, None)?)?],
        None => Vec::new(),
    };
    let written = show(&report, args.json, output)?;
    if let Some(missing) = merged.missing_text() {
        say(format_args!(
            "warning: {missing}; this is the result of the walks before the first of them"
        ));
    } else if report.stop != StopReason::Done {
        let why = report
            .reason
            .map_or(String::new(), |why| format!(": {why}"));
        say(format_args!(
            "warning: the requested error was not reached{why}"
        ));
    }
    if let Some(needed) = merged.needed() {
        let batch = merged.job.settings.batch();
        say(format_args!(
            "note: the target error takes about {needed} walks of each target: make parts of them with `--walks {needed} \
             --after {}`, and merge all",
            merged.job.walks() / batch * batch
        ));
    }
    let is_done = report.stop == StopReason::Done;
    written.map(|()| {
        if is_done {
            Ended::Done
        } else {
            Ended::ErrorNotReached
        }
    })
}
