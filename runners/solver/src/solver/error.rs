//! How a solution may fail.

use crate::Error;
use crate::report::Report;

/// Why a [`Solver`](crate::Solver) gives no report, or one that is not all that was asked for.
///
/// ```
/// use fredholm::{CubeModel, Method, SolveError, Solver};
///
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let solver = Solver::new(&u).method(Method::Walks).mean().cells(4).walks(5000);
/// let Err(SolveError::NotReached(report)) = solver.solve_to(1e-12) else {
///     panic!("5000 walks do not reach this error");
/// };
/// assert_eq!(report.goals[0].walks, 5000);
/// ```
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// The equation or what is asked of it cannot be solved.
    #[error("{0}")]
    Failed(#[source] Error),
    /// The observer cancelled; the results so far, if walks had begun.
    #[error("{}", cancelled(.0.is_some()))]
    Cancelled(Option<Box<Report>>),
    /// The walks ended before the error was reached that was asked for; the results so far.
    #[error("the requested error was not reached{}", why(.0))]
    NotReached(Box<Report>),
}

impl SolveError {
    /// The results so far, if there are some.
    #[must_use]
    pub fn report(&self) -> Option<&Report> {
        match self {
            Self::Failed(_) => None,
            Self::Cancelled(report) => report.as_deref(),
            Self::NotReached(report) => Some(report),
        }
    }
}

const fn cancelled(has_results: bool) -> &'static str {
    match has_results {
        false => "cancelled before the walks",
        true => "cancelled; there are partial results",
    }
}

fn why(report: &Report) -> String {
    match &report.reason {
        Some(why) => format!(": {why}"),
        None => " within the walks and the time that were given".to_owned(),
    }
}

impl From<Error> for SolveError {
    fn from(error: Error) -> Self {
        match error {
            Error::Cancelled => Self::Cancelled(None),
            error => Self::Failed(error),
        }
    }
}
