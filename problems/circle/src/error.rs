//! What can be wrong with a circle.

use core::fmt;

use fredholm_core::refused;

/// Why there is no such circle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CircleError {
    /// No reflectance was given.
    NoReflectance,
    /// A reflectance is NaN or outside [0, 1) in a channel.
    Reflectance {
        /// The number of its arc, from 0.
        arc: usize,
    },
    /// The number of cells is 0, or more than 2³¹.
    Cells,
    /// The number of cells is not a multiple of the number of arcs.
    NotAMultiple {
        /// The number of cells.
        cells: usize,
        /// The number of arcs.
        arcs: usize,
    },
    /// Values of arcs have different numbers of channels.
    Channels,
    /// A parameter of the emission is not finite, or its frequency is 0.
    Emission,
    /// A buffer has the wrong length.
    Length {
        /// The length that is needed.
        expected: usize,
        /// The length of the buffer.
        found: usize,
    },
    /// A slot of a ready-made table names a cell that is not there, or ends nowhere.
    Slot {
        /// The number of the slot.
        slot: usize,
    },
    /// There is no memory for the tables.
    Memory {
        /// The number of cells.
        cells: usize,
    },
    /// The ends of an interval are not 0 ≤ from < to ≤ 2π.
    Interval,
}

impl fmt::Display for CircleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoReflectance => write!(f, "at least one reflectance is needed"),
            Self::Reflectance { arc } => write!(
                f,
                "the reflectance of arc {arc} must be at least 0 and below 1, or the series of \
                 reflections does not converge"
            ),
            Self::Cells => write!(f, "the number of cells must be between 1 and 2^31"),
            Self::NotAMultiple { cells, arcs } => write!(
                f,
                "the number of cells ({cells}) must be a multiple of the number of arcs ({arcs})"
            ),
            Self::Channels => write!(
                f,
                "all reflectances and emissions must have the same channels"
            ),
            Self::Emission => write!(
                f,
                "the emission must be finite, and its frequency at least 1"
            ),
            Self::Length { expected, found } => refused::length(f, *expected, *found),
            Self::Slot { slot } => write!(
                f,
                "slot {slot} of the table leads to no cell: the table is no circle's"
            ),
            Self::Memory { cells } => write!(f, "there is no memory for {cells} cells"),
            Self::Interval => write!(f, "an interval needs 0 <= from < to <= 2 pi"),
        }
    }
}

impl core::error::Error for CircleError {}
