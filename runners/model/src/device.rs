//! What the device tables of all kinds have in common.

use fredholm_core::Real;
use fredholm_core::galerkin::{DiagonalRule, PairKind};
use fredholm_embedded::{Number, TableBuilder};

/// Rule by which a device knows the kind of every pair.
#[derive(Clone, Copy, Debug)]
pub enum PairRule {
    /// All in S.
    Galerkin = 0,
    /// The rest, on a circle and a cube the diagonal, pointwise.
    RestPointwise = 1,
    /// The rest left out.
    RestOut = 2,
    /// All pointwise.
    Pointwise = 3,
    /// h = k, and G from rays.
    Rays = 4,
}

impl PairRule {
    /// Adds the rule to the tables of a device.
    pub fn add_to(self, tables: &mut TableBuilder) {
        tables.numbers("pairs", &[self as u32]);
    }

    /// The rule of a diagonal; `None`: all pairs are pointwise.
    #[must_use]
    pub fn of(pairs: Option<DiagonalRule>) -> Self {
        match pairs.map(|pairs| pairs.diagonal) {
            Some(PairKind::Galerkin) => Self::Galerkin,
            Some(PairKind::Pointwise) => Self::RestPointwise,
            Some(PairKind::Dropped) => Self::RestOut,
            None => Self::Pointwise,
        }
    }
}

/// Adds coefficients in a dense table. As walks in f32 see them, contractions are rounded, not
/// coefficients: of one function on a cell these are the same.
pub fn add_dense<F: Real + Number>(tables: &mut TableBuilder, entries: &[f64], functions: usize) {
    if functions > 1 {
        tables.numbers("coeffs", entries);
    } else {
        let entries: Vec<F> = entries.iter().map(|&k| F::from_f64(k)).collect();
        tables.numbers("coeffs", &entries);
    }
}
