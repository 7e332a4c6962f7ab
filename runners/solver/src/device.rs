//! What the device tables of all kinds have in common.

use fredholm_core::Real;
use fredholm_core::galerkin::{OffDiagonal, PairKind};
use fredholm_embedded::{Number, TableBuilder};

/// Which pairs are treated how, as a device knows them: by a rule.
#[derive(Clone, Copy)]
pub(crate) enum PairRule {
    /// All in S.
    Galerkin = 0,
    /// The rest, on a circle and a cube the diagonal, pointwise.
    RestPointwise = 1,
    /// The rest left out.
    RestOut = 2,
    /// All pointwise.
    Pointwise = 3,
}

impl PairRule {
    pub(crate) fn add_to(self, tables: &mut TableBuilder) {
        tables.numbers("pairs", &[self as u32]);
    }

    /// The rule of a diagonal; `None`: all pairs are pointwise.
    pub(crate) fn of(pairs: Option<OffDiagonal>) -> Self {
        match pairs.map(|pairs| pairs.diagonal) {
            Some(PairKind::Galerkin) => Self::Galerkin,
            Some(PairKind::Pointwise) => Self::RestPointwise,
            Some(PairKind::None) => Self::RestOut,
            None => Self::Pointwise,
        }
    }
}

/// Numbers as bytes.
pub(crate) fn bytes<T: Number>(numbers: &[T]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.bytes()).collect()
}

/// Numbers as literals with commas between them.
pub(crate) fn list<T: Number>(numbers: &[T]) -> String {
    let texts: Vec<String> = numbers.iter().map(|x| x.literal()).collect();
    texts.join(", ")
}

/// Adds coefficients in a dense table. As walks in f32 see them, contractions are rounded, not
/// coefficients: of one function on a cell these are the same.
pub(crate) fn add_dense<F: Real + Number>(
    tables: &mut TableBuilder,
    entries: &[f64],
    functions: usize,
) {
    if functions > 1 {
        tables.numbers("coeffs", entries);
    } else {
        let entries: Vec<F> = entries.iter().map(|&k| F::from_f64(k)).collect();
        tables.numbers("coeffs", &entries);
    }
}
