//! What can be wrong with what is asked for.

use core::fmt;

use fredholm_core::refused;

/// Why there are no such form factors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FactorsError {
    /// The error that is asked for is NaN or outside [1e-13, 0.1].
    Tolerance,
    /// Rows of an open scene do not sum to 1.
    Leaves,
    /// A closed scene sees no sky.
    NoSky,
    /// The scene repeats without end, and form factors are of one.
    Repeats,
    /// There is no such face.
    Face {
        /// The number that was asked for.
        face: usize,
    },
    /// There is no such group.
    Group {
        /// The number that was given.
        group: usize,
    },
    /// A slice has the wrong length.
    Length {
        /// The length that is needed.
        expected: usize,
        /// The length that was given.
        found: usize,
    },
    /// An emissivity is NaN or outside [0, 1], or adiabatic groups see each other alone.
    Emissivity {
        /// The number of the group.
        group: usize,
    },
    /// There is no memory for a table.
    Memory {
        /// The size of the buffer in bytes; `None` if it exceeds the address space.
        bytes: Option<usize>,
    },
}

impl FactorsError {
    /// Refuses another length than is needed.
    pub(crate) const fn length(expected: usize, found: usize) -> Result<(), Self> {
        if expected == found {
            Ok(())
        } else {
            Err(Self::Length { expected, found })
        }
    }
}

impl fmt::Display for FactorsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tolerance => {
                f.write_str("the error of form factors must lie between 1e-13 and 0.1")
            }
            Self::Leaves => f.write_str(
                "the scene is open: light leaves, and the rows of its form factors do not sum to 1",
            ),
            Self::NoSky => f.write_str("the scene is closed: no sky is seen from it"),
            Self::Repeats => f.write_str(
                "form factors are of one scene, and this one repeats: leave the period out, or give the copies as surfaces",
            ),
            Self::Face { face } => write!(f, "there is no face {face}"),
            Self::Group { group } => write!(f, "there is no surface {group}"),
            Self::Length { expected, found } => {
                write!(f, "{expected} numbers are needed, not {found}")
            }
            Self::Emissivity { group } => write!(
                f,
                "surface {group}: the emissivity must be from 0 to 1, and one that it sees above 0"
            ),
            Self::Memory { bytes } => refused::memory(f, *bytes, ""),
        }
    }
}

impl core::error::Error for FactorsError {}
