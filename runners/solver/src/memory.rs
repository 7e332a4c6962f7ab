//! Refusals of what does not fit into memory.

use crate::Error;

/// Refuses what needs more bytes than are free now: `what`, such as "1000 unknowns", and what needs less, as the end of
/// a sentence.
///
/// # Errors
/// [`Error::Memory`].
pub fn refuse_beyond_memory(
    what: impl FnOnce() -> String,
    needed: usize,
    advice: &'static str,
) -> Result<(), Error> {
    match lacking(needed) {
        Some(available) => Err(Error::Memory {
            what: what(),
            needed: needed as u64,
            available,
            advice,
        }),
        None => Ok(()),
    }
}

/// The bytes that are free, if so many are more.
fn lacking(needed: usize) -> Option<u64> {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let available = system.available_memory();
    (available > 0 && needed as u64 >= available).then_some(available)
}

/// Bytes for people: "1.5 MB", "2.0 GB".
#[must_use]
pub fn bytes(count: u64) -> String {
    let mega = count as f64 / 1e6;
    if mega < 1000.0 {
        format!("{mega:.1} MB")
    } else {
        format!("{:.1} GB", mega / 1000.0)
    }
}
