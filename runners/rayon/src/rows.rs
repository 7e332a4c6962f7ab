//! Tables whose rows are independent.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use crate::gather::all_gathered;

/// Fills a table of rows of `width` entries on the threads of the current rayon pool: `fill` gets the
/// number of a row and the row. As every row is written by one call, the bits do not depend on threads.
///
/// ```
/// let mut table = [0.0; 6];
/// fredholm_rayon::fill_rows(&mut table, 3, |i, row| {
///     row.fill(i as f64);
///     Ok::<(), ()>(())
/// })?;
/// assert_eq!(table, [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
/// # Ok::<(), ()>(())
/// ```
///
/// # Errors
/// That of the first row that has one, whichever thread meets it.
pub fn fill_rows<T, E>(
    table: &mut [T],
    width: usize,
    fill: impl Fn(usize, &mut [T]) -> Result<(), E> + Sync,
) -> Result<(), E>
where
    T: Send,
    E: Send,
{
    filled(table, width, &fill)
}

/// What fills a row.
type Fill<'f, T, E> = dyn Fn(usize, &mut [T]) -> Result<(), E> + Sync + 'f;

/// [`fill_rows`], compiled once for all that fill rows of this type.
fn filled<T: Send, E: Send>(table: &mut [T], width: usize, fill: &Fill<'_, T, E>) -> Result<(), E> {
    // Each row and each error is taken once, so that no thread ever waits for another.
    let rows: Vec<_> = table.chunks_mut(width.max(1)).map(Mutex::new).collect();
    let errors = Mutex::new(BTreeMap::new());
    let fails = |number: usize| {
        let Some(row) = rows.get(number) else {
            return false;
        };
        let filled = fill(number, &mut locked(row));
        let mut errors = locked(&errors);
        // A row that is filled again may have had an error of what was not known then.
        errors.remove(&number);
        let fails = filled.is_err();
        errors.extend(filled.err().map(|error| (number, error)));
        fails
    };
    let again = |number: usize| {
        fails(number);
    };
    if !all_gathered(rows.len(), &again) {
        let _ = first_failure(rows.len(), &fails);
    }
    let first = locked(&errors).pop_first();
    first.map_or(Ok(()), |(_, error)| Err(error))
}

/// The first of so many numbers that fails. It is the one place where threads share numbers out, compiled once for all tables.
fn first_failure(count: usize, fails: &(dyn Fn(usize) -> bool + Sync)) -> Option<usize> {
    (0..count)
        .into_par_iter()
        .find_first(|number| fails(*number))
}

/// What a lock guards. A panic elsewhere ends the whole, so a poisoned lock tells nothing new.
fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}
