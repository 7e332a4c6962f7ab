//! What the core and several problem crates refuse, in the same words.

use core::fmt;

/// Writes that a buffer has a wrong length.
///
/// # Errors
/// Those of the formatter.
pub fn length(f: &mut fmt::Formatter<'_>, expected: usize, found: usize) -> fmt::Result {
    write!(f, "a buffer of length {expected} is needed, not of {found}")
}

/// Writes that a table of `bytes` bytes does not fit into memory, or into the address space if they are `None`, and what would
/// help: "; fewer cells need less", or nothing.
///
/// # Errors
/// Those of the formatter.
pub fn memory(f: &mut fmt::Formatter<'_>, bytes: Option<usize>, remedy: &str) -> fmt::Result {
    match bytes {
        Some(bytes) => write!(f, "there is no memory for a table of {bytes} bytes{remedy}"),
        None => write!(f, "a table of this size cannot be addressed{remedy}"),
    }
}
