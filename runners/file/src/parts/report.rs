//! Parts of a run, whose problem is that of a file.

use std::path::Path;

use fredholm::report::{Report, Run};

use super::{Header, Merged};
use crate::{InputError, ProblemFile, Resolved, read};

impl ProblemFile {
    /// What a part of a run says of the problem, so that parts are merged without the file: its name and text besides what it
    /// resolves to.
    ///
    /// # Errors
    /// A file that this one names cannot be read.
    pub fn header(&self, resolved: &Resolved) -> Result<Header, InputError> {
        let name = Path::new(&self.source.name);
        let path = std::path::absolute(name).unwrap_or_else(|_| name.to_owned());
        Ok(Header::new(
            self.identity(resolved)?,
            path.display().to_string(),
            self.source.text.clone(),
        ))
    }
}

/// The report of merged parts, and the problem file, read again as it was when they were begun.
///
/// # Errors
/// A file that the problem names has changed since, or is not there.
pub fn merged(merged: &Merged) -> Result<(Report, ProblemFile), InputError> {
    let Header { name, text, .. } = &merged.header;
    let mut file = read(name, text)?;
    let resolved = file.resolve_for(merged.job.settings.clone())?;
    let now = file.header(&resolved)?;
    if let Some(what) = now.difference(&merged.header) {
        return Err(InputError::new(format_args!(
            "{name}: this problem is not what it was when the parts were made: {what}; a file that it names has changed, or \
             the program has another version"
        )));
    }
    let explain = |error| file.explain(&error);
    let model = resolved.model.model();
    let goals = fredholm::goals(model, &resolved.targets).map_err(explain)?;
    let back = fredholm::asked_way_back(model, &resolved.settings, &goals).map_err(explain)?;
    let model = back.as_deref().unwrap_or(model);
    let exact = goals.iter().map(|goal| model.exact_of(goal));
    let exact: Vec<_> = exact.collect::<Result<_, _>>().map_err(explain)?;
    let run = Run {
        model,
        goals: &goals,
        exact: &exact,
        cells: &merged.job.cells,
        settings: &resolved.settings,
        choice: merged.job.choice.as_ref(),
        plain: merged.job.plain,
    };
    let mut report = Report::new(&run, merged.answer(model, &goals));
    report.reason = merged.missing_text().or(report.reason);
    report.add_budgets(&resolved.settings.uncertainties);
    Ok((report, file))
}
