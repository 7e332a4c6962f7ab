//! What can be wrong with a cube.

use core::fmt;

use fredholm_core::galerkin::GalerkinError;
use fredholm_core::refused;

/// Why there is no such cube, table or solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CubeError {
    /// The absorption probability q0 is NaN or outside (0, 1).
    Absorption,
    /// The number m of cells per axis is 0, m^D is above 2³² − 1, or the scalar cannot tell m cells
    /// apart.
    Cells,
    /// The number of quadrature points per axis is not 1 to 5.
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
    /// There is no memory for a table.
    Memory {
        /// The size of the buffer in bytes; `None` if it exceeds the address space.
        bytes: Option<usize>,
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
    /// There is no Galerkin solution.
    Galerkin(GalerkinError),
}

impl fmt::Display for CubeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Absorption => f.write_str(refused::ABSORPTION),
            Self::Cells => write!(
                f,
                "at least one cell per axis is needed, at most 2^32 - 1 cells in all, and per axis \
                 no more than the scalar can tell apart (2^24 in f32)"
            ),
            Self::Points => write!(f, "a rule has 1 to 5 quadrature points per axis"),
            Self::Cell { cell } => write!(f, "there is no cell {cell}"),
            Self::Length { expected, found } => refused::length(f, *expected, *found),
            Self::Memory { bytes } => {
                refused::memory(f, *bytes, "; fewer cells, or a product kernel, need less")
            }
            Self::Kernel { row, column } => write!(
                f,
                "the kernel is not finite at a quadrature point of cells {row} and {column}"
            ),
            Self::Source { row } => {
                write!(
                    f,
                    "the function is not finite at a quadrature point of cell {row}"
                )
            }
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
