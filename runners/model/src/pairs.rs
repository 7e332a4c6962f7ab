//! Pairs of cells as models make them.

use fredholm_core::galerkin::{DiagonalRule, PairKind, Pairs as PairsTrait};

/// Pairs of any kind, for an analysis.
#[derive(Clone, Copy, Debug)]
pub enum AnyPairs {
    /// All pointwise.
    AllPointwise,
    /// A rule for the diagonal, all others in S.
    Diagonal(DiagonalRule),
}

impl PairsTrait for AnyPairs {
    fn kind(&self, i: usize, j: usize) -> PairKind {
        match self {
            Self::AllPointwise => PairKind::Pointwise,
            Self::Diagonal(pairs) => pairs.kind(i, j),
        }
    }
}
