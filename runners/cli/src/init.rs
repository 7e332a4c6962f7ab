//! `fredholm init`.

use fredholm_file::KINDS;

use crate::failure::{Ended, Failure, print};

/// Prints the file of the kind of problem of this word, which the command line has checked.
pub(crate) fn init(kind: &str) -> Result<Ended, Failure> {
    let entry = KINDS.iter().find(|entry| entry.word == kind);
    // The command line lets no other word pass.
    print(entry.map_or("", |entry| entry.template))?;
    Ok(Ended::Done)
}
