//! What can be wrong with a cube.

use core::fmt;

use fredholm_core::galerkin::GalerkinError;
use fredholm_core::refused;

/// Why there is no such cube, rule or table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CubeError {
    /// The number m of cells per axis is 0, m^D is above 2³² − 1, or the scalar cannot tell m cells
    /// apart.
    Cells,
    /// There is no quadrature point, or the degree is above [`CubeScores::MOST_DEGREE`](crate::CubeScores::MOST_DEGREE).
    Points,
    /// There is no such cell.
    Cell {
        /// The number that was asked for.
        cell: usize,
    },
    /// A buffer has the wrong length.
    Length {
        /// The length that is needed.
        expected: usize,
        /// The length of the buffer.
        found: usize,
    },
    /// The kernel is infinite or NaN at a quadrature point (x, y), x in one cell and y in the other.
    Kernel {
        /// The number i of the cell of x; of an axis, for a factor of a product.
        row: usize,
        /// The number j of the cell of y, likewise.
        column: usize,
    },
    /// The source, or another function whose means are taken, is infinite or NaN at a quadrature point
    /// of a cell.
    Source {
        /// The number i of the cell.
        row: usize,
    },
    /// There is no Galerkin solution, or no memory for a table.
    Galerkin(GalerkinError),
}

impl CubeError {
    /// Refuses a buffer of a wrong length.
    pub(crate) const fn check_length(expected: usize, found: usize) -> Result<(), Self> {
        if expected == found {
            Ok(())
        } else {
            Err(Self::Length { expected, found })
        }
    }
}

impl fmt::Display for CubeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cells => f.write_str(
                "at least one cell per axis is needed, at most 2^32 - 1 cells in all, and per axis no more than the \
                 scalar can tell apart (2^24 in f32)",
            ),
            Self::Points => {
                f.write_str("a rule has a quadrature point per axis, and degrees are 7 at most")
            }
            Self::Cell { cell } => write!(f, "there is no cell {cell}"),
            Self::Length { expected, found } => refused::length(f, *expected, *found),
            Self::Kernel { row, column } => write!(
                f,
                "the kernel is not finite at a quadrature point of cells {row} and {column}"
            ),
            Self::Source { row } => write!(
                f,
                "the function is not finite at a quadrature point of cell {row}"
            ),
            Self::Galerkin(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for CubeError {}

impl From<GalerkinError> for CubeError {
    fn from(error: GalerkinError) -> Self {
        Self::Galerkin(error)
    }
}
