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
