//! The choices of pairs that have the diagonal apart.

use fredholm_core::galerkin::{PairKind, Pairs};

/// All pairs with i ≠ j in S; the kind of the diagonal is free.
///
/// On the diagonal p(x, ·) has a kink, so it is no Galerkin pair of any use. [`PairKind::None`] is
/// the paper's S (section 5); [`PairKind::Pointwise`] is the default of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OffDiagonal {
    /// The kind of (i, i).
    pub diagonal: PairKind,
}

impl Pairs for OffDiagonal {
    #[inline]
    fn kind(&self, i: usize, j: usize) -> PairKind {
        if i == j {
            self.diagonal
        } else {
            PairKind::Galerkin
        }
    }

    #[inline]
    fn pointwise(&self, i: usize, _: usize) -> impl Iterator<Item = usize> {
        (self.diagonal == PairKind::Pointwise)
            .then_some(i)
            .into_iter()
    }

    #[inline]
    fn outside(&self, i: usize, _: usize) -> impl Iterator<Item = usize> {
        (self.diagonal != PairKind::Galerkin)
            .then_some(i)
            .into_iter()
    }
}
