//! The tables of a cube for a device: its kernel and source are for the device to know.

use fredholm_core::Real;
use fredholm_core::galerkin::DiagonalRule;
use fredholm_embedded::{Number, TableBuilder};

use super::table::Table;
use fredholm_model::device::{PairRule, add_dense};

/// The tables of a cube of this dimension, with so many cells per axis, of this degree.
pub(super) fn cube<F: Real + Number, const D: usize>(
    [dimension, per_axis, degree]: [usize; 3],
    coefficients: &Table<'_, D>,
    diagonal_rule: Option<DiagonalRule>,
    [v, g]: [&[F]; 2],
) -> TableBuilder {
    let mut tables = TableBuilder::new("cube");
    tables.numbers("axes", &[dimension as u32, per_axis as u32]);
    tables.numbers("degree", &[degree as u32]);
    match coefficients {
        Table::Dense {
            entries, functions, ..
        } => add_dense::<F>(&mut tables, entries, *functions),
        // Products are rounded, not factors, so that the walks are the library's own.
        Table::Product(factors) => tables.numbers("factors", factors.entries()),
    }
    tables.numbers("v", v);
    tables.numbers("source", g);
    PairRule::of(diagonal_rule).add_to(&mut tables);
    tables
}
