//! Why a file is not read or written.

use core::fmt::{self, Display};
use std::path::Path;

/// Why a file is refused, or cannot be written.
///
/// ```
/// use fredholm_file::parts::Part;
///
/// let error = Part::read("notes.txt".as_ref(), b"buy milk").unwrap_err();
/// assert_eq!(error.to_string(), "notes.txt: this is no part of a run: its first bytes are others");
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileError {
    /// Which file it is, as a message begins.
    pub file: String,
    /// The reason, and what would help.
    pub message: String,
    /// Whether another file or other input would help, and not another machine or more room.
    pub is_input: bool,
}

impl FileError {
    /// A file that is refused.
    pub(crate) fn refused(path: &Path, message: impl Display) -> Self {
        Self {
            file: path.display().to_string(),
            // What a file says is not for a terminal as it is.
            message: message.to_string().replace(char::is_control, "\u{fffd}"),
            is_input: true,
        }
    }

    /// A file that cannot be opened.
    pub(crate) fn not_opened(path: &Path, error: impl Display) -> Self {
        Self::refused(path, format_args!("cannot open it: {error}"))
    }

    /// The path of an option at which nothing can be written.
    pub(crate) fn of_option(option: &str, path: &Path, message: impl Display) -> Self {
        Self {
            file: format!("`{option} {}`", path.display()),
            ..Self::refused(path, message)
        }
    }

    /// A file that could not be written.
    pub(crate) fn not_written(path: &Path, message: impl Display) -> Self {
        Self {
            file: format!("cannot write {}", path.display()),
            is_input: false,
            ..Self::refused(path, message)
        }
    }
}

impl Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.file, self.message)
    }
}

impl core::error::Error for FileError {}

impl From<FileError> for fredholm::Error {
    fn from(error: FileError) -> Self {
        Self::Kept {
            message: error.to_string(),
            is_input: error.is_input,
        }
    }
}
