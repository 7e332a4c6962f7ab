//! How a solution may fail.

use core::fmt::{self, Display};

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
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum SolveError {
    /// The equation or what is asked of it cannot be solved.
    Failed(Error),
    /// The observer cancelled; the results so far, if walks had begun.
    Cancelled(Option<Box<Report>>),
    /// The walks ended before the error was reached that was asked for; the results so far.
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

impl Display for SolveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Failed(error) => error.fmt(f),
            Self::Cancelled(None) => f.write_str("cancelled before the walks"),
            Self::Cancelled(Some(_)) => f.write_str("cancelled; there are partial results"),
            Self::NotReached(report) => match &report.reason {
                Some(why) => write!(f, "the requested error was not reached: {why}"),
                None => f.write_str(
                    "the requested error was not reached within the walks and the time that were given",
                ),
            },
        }
    }
}

impl core::error::Error for SolveError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Failed(error) => Some(error),
            _ => None,
        }
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
