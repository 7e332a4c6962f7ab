//! Why a file of batches is refused.

use core::fmt::{self, Display};
use std::path::{Path, PathBuf};

/// Why a part is refused, with its path.
///
/// ```
/// use fredholm_parts::Content;
///
/// let error = Content::read("notes.txt".as_ref(), b"buy milk").unwrap_err();
/// assert_eq!(error.to_string(), "notes.txt: this is no part of a run: its first bytes are others");
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PartError {
    /// The file.
    pub path: PathBuf,
    /// The reason, and what would help.
    pub message: String,
    /// Whether another file or other input would help, and not another machine or more room.
    pub is_input: bool,
}

impl PartError {
    /// A file that is refused.
    pub(crate) fn refused(path: &Path, message: impl Display) -> Self {
        Self {
            path: path.to_owned(),
            // What a file says is not for a terminal as it is.
            message: message.to_string().replace(char::is_control, "\u{fffd}"),
            is_input: true,
        }
    }

    /// A file that cannot be written.
    pub(crate) fn failed(path: &Path, message: impl Display) -> Self {
        Self {
            is_input: false,
            ..Self::refused(path, message)
        }
    }
}

impl Display for PartError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.path.display(), self.message)
    }
}

impl core::error::Error for PartError {}

impl From<PartError> for fredholm::Error {
    fn from(error: PartError) -> Self {
        Self::Kept {
            message: error.to_string(),
            is_input: error.is_input,
        }
    }
}
