//! Exceptions: the classes are those of `fredholm.errors`.

use fredholm::{Error, SolveError};
use fredholm_file::{InputError, ProblemFile};
use pyo3::prelude::*;

/// An exception of a class of `fredholm.errors`.
pub(crate) fn exception(py: Python<'_>, class: &str, message: String) -> PyErr {
    let made = py
        .import("fredholm.errors")
        .and_then(|errors| errors.getattr(class))
        .and_then(|class| class.call1((message,)));
    match made {
        Ok(exception) => PyErr::from_value(exception),
        Err(error) => error,
    }
}

/// The exception of an error of the input.
pub(crate) fn of_input(py: Python<'_>, error: &InputError) -> PyErr {
    exception(py, "InputError", error.to_string())
}

/// The class of an error.
const fn class(error: &Error) -> &'static str {
    match error {
        Error::InfiniteVariance { .. } | Error::NoMean => "InfiniteVarianceError",
        Error::Galerkin(_) => "ConvergenceError",
        Error::Memory { .. } => "TooLargeError",
        Error::TooLong { .. } | Error::TooMuch { .. } => "TooLongError",
        Error::Run(_)
        | Error::NoSetting
        | Error::Internal(_)
        | Error::Variance(_)
        | Error::Dark => "FredholmError",
        _ => "InputError",
    }
}

/// The exception of an error, which says where in the file its cause stands, if it does.
pub(crate) fn of(py: Python<'_>, error: &Error, file: &ProblemFile) -> PyErr {
    exception(py, class(error), file.explain(error).to_string())
}

/// The exception of a solution without a report.
pub(crate) fn of_solve(py: Python<'_>, error: &SolveError, file: &ProblemFile) -> PyErr {
    match error {
        SolveError::Failed(error) => of(py, error, file),
        other => exception(py, "FredholmError", other.to_string()),
    }
}
