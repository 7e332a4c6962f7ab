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
    let available = available_memory();
    (available > 0 && needed as u64 >= available).then_some(available)
}

/// Bytes of memory that are free now; 0 if the system does not say.
#[cfg(target_os = "linux")]
fn available_memory() -> u64 {
    let text = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let mut lines = text.lines();
    let available = lines.find_map(|line| line.strip_prefix("MemAvailable:"));
    let kibibytes = available.and_then(|text| text.trim().strip_suffix(" kB")?.parse().ok());
    kibibytes.map_or(0, |count: u64| count.saturating_mul(1024))
}

/// Bytes of memory that are free now; 0 if the system does not say.
#[cfg(not(target_os = "linux"))]
fn available_memory() -> u64 {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    system.available_memory()
}

/// Bytes for people: "40 kB", "1.5 MB", "2.0 GB".
#[must_use]
pub fn bytes(count: u64) -> String {
    let mega = count as f64 / 1e6;
    if mega < 0.1 {
        format!("{:.0} kB", (1000.0 * mega).ceil())
    } else if mega < 1000.0 {
        format!("{mega:.1} MB")
    } else {
        format!("{:.1} GB", mega / 1000.0)
    }
}
