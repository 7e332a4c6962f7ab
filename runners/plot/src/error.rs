//! Why there is no picture.

use core::fmt;

/// The reason why nothing was drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// No point has a place on the axes, or no wall has an extent.
    NothingToDraw,
    /// The picture has more bytes than this machine can address.
    TooLarge,
    /// A [`Panel`](crate::Panel) does not fit its canvas.
    WrongLength {
        /// The slice of the panel: `air` or `walls`.
        slice: &'static str,
        /// The number of values that the canvas requires.
        expected: usize,
        /// The number of values of the panel.
        found: usize,
    },
    /// A drawing package failed; the text is its own.
    Backend(String),
}

impl Error {
    pub(crate) fn backend(error: impl fmt::Display) -> Self {
        Self::Backend(error.to_string())
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NothingToDraw => write!(f, "the figure has no point that can be drawn"),
            Self::TooLarge => write!(f, "the picture is too large"),
            Self::WrongLength {
                slice,
                expected,
                found,
            } => write!(
                f,
                "`{slice}` of a panel has {found} values instead of {expected}"
            ),
            Self::Backend(message) => f.write_str(message),
        }
    }
}

impl core::error::Error for Error {}
