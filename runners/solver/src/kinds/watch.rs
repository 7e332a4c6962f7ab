//! Values that are not finite, in words.

use std::sync::{Mutex, PoisonError};

use fredholm_core::Real;
use fredholm_rayon::is_incomplete;

use crate::Error;
use crate::custom::Coordinates;

/// Advice on a value at x = y.
const AT_X_EQUALS_Y: &str = ", where x = y (if the kernel has a limit there, write it as a case, \
     `condition ? limit : …`; the walks of a chain take no singularity, those that are chosen by themselves do)";

/// The first values that were not finite, in words.
#[derive(Debug, Default)]
pub(super) struct Watch {
    anywhere: Mutex<Option<String>>,
    /// The first one of the kernel at x = y, where it may be singular.
    together: Mutex<Option<String>>,
}

impl Watch {
    /// Refuses a value that was not finite, but for one of the kernel at x = y.
    pub(super) fn check(&self) -> Result<(), Error> {
        let mut first = self.anywhere.lock().unwrap_or_else(PoisonError::into_inner);
        first
            .take()
            .map_or(Ok(()), |what| Err(Error::NotFinite { what }))
    }

    /// The error with the words of such a value, if it may come of one.
    pub(super) fn explain(&self, error: Error) -> Error {
        let [anywhere, together] = [&self.anywhere, &self.together]
            .map(|first| first.lock().unwrap_or_else(PoisonError::into_inner).take());
        match anywhere.or(together) {
            Some(what) if error.is_of_values() => Error::NotFinite { what },
            _ => error,
        }
    }

    /// Keeps these words, if they are the first.
    #[cold]
    pub(super) fn note(&self, what: impl FnOnce() -> String) {
        keep(&self.anywhere, what);
    }

    /// Returns a value, and keeps the words of the first that is not finite.
    #[inline]
    pub(super) fn finite<F: Real>(&self, value: F, what: impl FnOnce() -> String) -> F {
        if !value.is_finite() {
            self.note(what);
        }
        value
    }

    /// Returns a value of a kernel from x to y, or of a factor of it, and keeps the words of the first that is not finite.
    #[inline]
    pub(super) fn kernel<F: Real>(
        &self,
        value: F,
        [x, y]: [&[F]; 2],
        name: impl FnOnce() -> String,
    ) -> F {
        if value.is_finite() {
            return value;
        }
        let (first, advice) = match x == y {
            true => (&self.together, AT_X_EQUALS_Y),
            false => (&self.anywhere, ""),
        };
        keep(first, || {
            let (name, x, y) = (name(), Coordinates(x), Coordinates(y));
            format!("{name} is {value} at x = {x}, y = {y}{advice}")
        });
        value
    }
}

#[cold]
fn keep(first: &Mutex<Option<String>>, what: impl FnOnce() -> String) {
    // What is not known yet is not wrong.
    if is_incomplete() {
        return;
    }
    let mut first = first.lock().unwrap_or_else(PoisonError::into_inner);
    first.get_or_insert_with(what);
}
