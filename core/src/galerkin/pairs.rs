//! Which pairs of cells the neighbour equation treats how.

/// How the neighbour equation treats steps from cell i to cell j.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PairKind {
    /// (i, j) ∈ S: h from the Galerkin coefficient, (44). Needs inf p_j(x) > 0 on X_i, (46).
    Galerkin,
    /// h = k. Costs an exact integral over X_j wherever G is scored.
    Pointwise,
    /// h = 0: the paper's (i, j) ∉ S.
    None,
}

/// The kind of every pair.
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not say the kind of a pair of cells",
    label = "`Pairs` is missing",
    note = "`OffDiagonal {{ diagonal: PairKind::Galerkin }}` puts all pairs in S"
)]
pub trait Pairs {
    /// The kind of the pair (i, j).
    fn kind(&self, i: usize, j: usize) -> PairKind;

    /// All j of n cells with (i, j) pointwise. A problem that can list them faster than by asking
    /// all `cells` of them overrides this, in agreement with [`kind`](Self::kind): a disagreement
    /// is a bias that no error bar shows, and the conformance kit looks for it.
    fn pointwise(&self, i: usize, cells: usize) -> impl Iterator<Item = usize> {
        (0..cells).filter(move |&j| self.kind(i, j) == PairKind::Pointwise)
    }

    /// All j of n cells with (i, j) ∉ S, pointwise or none; overridden as the former.
    fn outside(&self, i: usize, cells: usize) -> impl Iterator<Item = usize> {
        (0..cells).filter(move |&j| self.kind(i, j) != PairKind::Galerkin)
    }
}

/// All pairs with i ≠ j in S; the kind of the diagonal is free. With [`PairKind::Galerkin`] all pairs are
/// in S: right for a kernel and a density that are smooth everywhere.
///
/// Where they have a kink or a jump at x = y no polynomial is close to them on the diagonal. Then it is
/// best [`PairKind::Pointwise`], if the problem has the exact integrals, or [`PairKind::None`], as in
/// Heinrich 1995, section 5.
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
        let pointwise = self.diagonal == PairKind::Pointwise;
        pointwise.then_some(i).into_iter()
    }

    #[inline]
    fn outside(&self, i: usize, _: usize) -> impl Iterator<Item = usize> {
        let outside = self.diagonal != PairKind::Galerkin;
        outside.then_some(i).into_iter()
    }
}

/// All pairs pointwise: h = k, the residual estimator. The neighbour equation differs from the equation
/// in its source only, and every score costs n exact integrals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AllPointwise;

impl Pairs for AllPointwise {
    #[inline]
    fn kind(&self, _: usize, _: usize) -> PairKind {
        PairKind::Pointwise
    }

    #[inline]
    fn pointwise(&self, _: usize, cells: usize) -> impl Iterator<Item = usize> {
        0..cells
    }

    #[inline]
    fn outside(&self, _: usize, cells: usize) -> impl Iterator<Item = usize> {
        0..cells
    }
}

#[cfg(test)]
mod tests {
    use super::{AllPointwise, OffDiagonal, PairKind, Pairs};

    /// Asks every pair, as the provided methods do.
    struct Slow<P>(P);
    impl<P: Pairs> Pairs for Slow<P> {
        fn kind(&self, i: usize, j: usize) -> PairKind {
            self.0.kind(i, j)
        }
    }

    #[test]
    fn the_lists_agree_with_the_kinds() {
        fn check<P: Pairs + Copy>(pairs: P) {
            let slow = Slow(pairs);
            for i in 0..5 {
                assert!(pairs.pointwise(i, 5).eq(slow.pointwise(i, 5)));
                assert!(pairs.outside(i, 5).eq(slow.outside(i, 5)));
            }
        }
        check(AllPointwise);
        for diagonal in [PairKind::Galerkin, PairKind::Pointwise, PairKind::None] {
            check(OffDiagonal { diagonal });
        }
    }
}
