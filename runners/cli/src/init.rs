//! `fredholm init`.

use std::io::Write;

use fredholm_file::KINDS;

use crate::failure::{Ended, Failure};

/// Prints the file of the kind of problem of this word, which the command line has checked.
pub(crate) fn init(kind: &str) -> Result<Ended, Failure> {
    let entry = KINDS.iter().find(|entry| entry.word == kind);
    // The command line lets no other word pass.
    let template = entry.map_or("", |entry| entry.template);
    std::io::stdout().lock().write_all(template.as_bytes())?;
    Ok(Ended::Done)
}
