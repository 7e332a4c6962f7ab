//! The choices of pairs.

use fredholm_core::galerkin::{PairKind, Pairs};

/// All pairs in S: right for a kernel that is smooth everywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AllPairs;

impl Pairs for AllPairs {
    #[inline]
    fn kind(&self, _: usize, _: usize) -> PairKind {
        PairKind::Galerkin
    }

    #[inline]
    fn pointwise(&self, _: usize, _: usize) -> impl Iterator<Item = usize> {
        core::iter::empty()
    }

    #[inline]
    fn outside(&self, _: usize, _: usize) -> impl Iterator<Item = usize> {
        core::iter::empty()
    }
}

/// All pairs with i ≠ j in S; the kind of the diagonal is free.
///
/// For kernels with a kink or a jump where x = y: on the diagonal no constant is close to them, so
/// with [`CellIntegral`](crate::CellIntegral) it is [`PairKind::Pointwise`].
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
