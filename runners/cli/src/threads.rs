//! The threads that a command asked for.

use crate::failure::Failure;

/// Runs `work` on so many threads, or on all cores.
pub(crate) fn with_threads<R: Send>(
    threads: Option<u16>,
    work: impl FnOnce() -> R + Send,
) -> Result<R, Failure> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.map_or(0, usize::from))
        .build()
        .map_err(|error| Failure::run(format_args!("cannot start threads: {error}")))?;
    Ok(pool.install(work))
}
