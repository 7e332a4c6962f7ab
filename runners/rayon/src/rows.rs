//! Tables whose rows are independent.

use rayon::prelude::*;

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
    let rows = table.par_chunks_mut(width.max(1)).enumerate();
    let first = rows.find_map_first(|(i, row)| fill(i, row).err());
    first.map_or(Ok(()), Err)
}
