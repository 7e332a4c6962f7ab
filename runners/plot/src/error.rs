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
    /// There are more numbers than pixels, pieces of walls, points or cells, or fewer.
    WrongLength {
        /// What the numbers are of.
        slice: &'static str,
        /// The number of values that is required.
        expected: usize,
        /// The number of values that are there.
        found: usize,
    },
    /// A [`Cell`](crate::Cell) has a corner that its mesh does not have.
    NoSuchPoint {
        /// The number of the point in the corner.
        corner: usize,
        /// The number of points of the mesh.
        points: usize,
    },
    /// A drawing package failed; the text is its own.
    Backend(String),
}

impl Error {
    pub(crate) fn backend(error: impl fmt::Display) -> Self {
        Self::Backend(error.to_string())
    }

    pub(crate) fn unless_equal(
        slice: &'static str,
        expected: usize,
        found: usize,
    ) -> Result<(), Self> {
        let wrong = Self::WrongLength {
            slice,
            expected,
            found,
        };
        (expected == found).then_some(()).ok_or(wrong)
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
            } => write!(f, "`{slice}` has {found} values instead of {expected}"),
            Self::NoSuchPoint { corner, points } => write!(
                f,
                "a cell has a corner in point {corner} of a mesh of {points} points"
            ),
            Self::Backend(message) => f.write_str(message),
        }
    }
}

impl core::error::Error for Error {}
