//! Galerkin coefficients of a cube, of either kind in one type.

use std::borrow::Cow;

use fredholm_core::galerkin::{Coefficients, Dense, GalerkinMatrix};
use fredholm_cube::{CubeError, ProductTables};
use fredholm_rayon::fill_rows;

/// What fills the numbers of a cell's rows, by the number of the cell.
type Rows<'a> = dyn Fn(usize, &mut [f64]) -> Result<(), CubeError> + Sync + 'a;

/// Fills so many numbers of a table at a time, on all threads: compiled once for all kernels, dimensions and degrees.
pub(super) fn fill(entries: &mut [f64], width: usize, rows: &Rows<'_>) -> Result<(), CubeError> {
    fill_rows(entries, width, rows)
}

/// Galerkin coefficients in f64: one type for all kinds, as every type has neighbour equations of its own for
/// every dimension and degree, which take their time to compile.
#[derive(Debug)]
pub(super) enum Table<'a, const D: usize> {
    /// The table of any kernel: (n·B)² entries.
    Dense {
        entries: Cow<'a, [f64]>,
        cells: usize,
        functions: usize,
    },
    /// The tables of a product.
    Product(ProductTables<Cow<'a, [f64]>, D>),
}

impl<const D: usize> Table<'_, D> {
    /// The numbers, of all kinds of tables.
    pub(super) fn entries(&self) -> &[f64] {
        match self {
            Self::Dense { entries, .. } => entries,
            Self::Product(tables) => tables.entries(),
        }
    }

    /// The table itself, if it is one of piecewise constants.
    pub(super) fn constants(&self) -> Option<Dense<'_, f64>> {
        match self {
            Self::Dense {
                entries,
                cells,
                functions: 1,
            } => Dense::new(entries, *cells, 1),
            _ => None,
        }
    }
}

/// What the coefficients of either kind answer. The length of a table was its own making.
macro_rules! either {
    ($table:expr, $matrix:ident => $then:expr, $otherwise:expr) => {
        match $table {
            Table::Dense {
                entries,
                cells,
                functions,
            } => match Dense::new(entries, *cells, *functions) {
                Some(dense) => {
                    let $matrix = &dense;
                    $then
                }
                None => $otherwise,
            },
            Table::Product($matrix) => $then,
        }
    };
}

impl<const D: usize, const B: usize> Coefficients<B> for Table<'_, D> {
    #[inline]
    fn left_times_block(&self, i: usize, j: usize, left: &[f64; B]) -> [f64; B] {
        either!(self, table => table.left_times_block(i, j, left), [f64::NAN; B])
    }
}

impl<const D: usize> GalerkinMatrix for Table<'_, D> {
    type Scalar = f64;

    fn cells(&self) -> usize {
        match self {
            Self::Dense { cells, .. } => *cells,
            Self::Product(tables) => tables.cells(),
        }
    }

    fn functions(&self) -> usize {
        match self {
            Self::Dense { functions, .. } => *functions,
            Self::Product(tables) => tables.functions(),
        }
    }

    #[inline]
    fn entry(&self, row: [usize; 2], column: [usize; 2]) -> f64 {
        either!(self, table => table.entry(row, column), f64::NAN)
    }

    fn row_sum(&self, i: usize) -> f64 {
        either!(self, table => table.row_sum(i), f64::NAN)
    }

    fn rows_times(&self, i: usize, v: &[f64], out: &mut [f64]) {
        either!(self, table => table.rows_times(i, v, out), out.fill(f64::NAN));
    }

    fn apply(&self, v: &[f64], out: &mut [f64]) {
        either!(self, table => table.apply(v, out), out.fill(f64::NAN));
    }

    fn apply_absolute(&self, w: &[f64], out: &mut [f64]) {
        either!(self, table => table.apply_absolute(w, out), out.fill(f64::NAN));
    }

    fn sweep(&self, source: &[f64], v: &mut [f64], scratch: &mut [f64]) -> f64 {
        either!(self, table => table.sweep(source, v, scratch), f64::NAN)
    }
}
