//! `fredholm solve --global`.

use fredholm::SolveError;
use fredholm::StopReason;
use fredholm::report::GlobalReport;
use fredholm_file::Resolved;

use crate::args::Common;
use crate::failure::{Ended, Failure, say};
use crate::progress::{Progress, Signals};
use crate::results::{self, Format};
use crate::solve::{Begun, say_stop, show};
use crate::threads::with_threads;

/// Answers all targets of a problem from one set of walks.
pub(crate) fn solve(
    begun: Begun<'_>,
    common: &Common,
    signals: &Signals,
) -> Result<Ended, Failure> {
    let answered = with_threads(common.threads, || answer(&begun, signals))?;
    let Some(report) = answered? else {
        say("warning: interrupted before the walks");
        return Ok(Ended::Interrupted);
    };
    let written = show(&report, common.json, begun.output)?;
    let summary = &report.summary;
    let why = format!(" at every point within {} walks", summary.walks);
    say_stop(summary.stop, &why);
    let asks_error = begun.problem.resolved.settings.tolerance.is_some();
    let ended = match summary.stop {
        StopReason::ToleranceNotReached => Ended::ErrorNotReached,
        StopReason::TimeLimit if asks_error => Ended::ErrorNotReached,
        StopReason::Cancelled => Ended::Interrupted,
        StopReason::TimeLimit | StopReason::Done => Ended::Done,
    };
    written.map(|()| ended)
}

/// Sets up, walks, and takes the values of all targets; `None` if that was interrupted before the walks.
fn answer(begun: &Begun<'_>, signals: &Signals) -> Result<Option<GlobalReport>, Failure> {
    let problem = &begun.problem;
    let fail = Failure::of(&problem.file);
    let Resolved { settings, .. } = &problem.resolved;
    let most = match settings.tolerance {
        Some(_) => settings.walks.unwrap_or(u64::MAX),
        None => settings.walk_options().walks,
    };
    let progress = Progress::new(most, signals);
    progress.say("setting up".to_owned());
    let solver = begun.solver(problem.resolved.targets.clone());
    let whole = solver.observer(&progress).whole();
    progress.done();
    match whole {
        Ok(whole) => {
            let mut report = whole.report(&problem.goals).map_err(&fail)?;
            let cells = results::means_between(&begun.output);
            report
                .add_means(&whole, &problem.goals, &cells)
                .map_err(fail)?;
            let is_json = |(format, _): &(Format, _)| matches!(format, Format::Json);
            if begun.output.iter().any(is_json) {
                report.coefficients = whole.coefficients();
            }
            Ok(Some(report))
        }
        Err(SolveError::Cancelled(_)) => Ok(None),
        Err(SolveError::Failed(error)) => Err(fail(error)),
        Err(error) => Err(Failure::run(error)),
    }
}
