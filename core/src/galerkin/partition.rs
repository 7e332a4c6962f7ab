//! What a problem says of its cells.

use super::small;
use crate::{Located, StateSpace};

/// A partition of X into cells X_0 … X_(n−1), of positive measure and disjoint up to null sets.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no cells",
    label = "`Partition` is missing",
    note = "implement `Partition`: the number of cells, and the cell of a point"
)]
pub trait Partition: StateSpace {
    /// n.
    fn cells(&self) -> usize;
    /// The number of the cell in which `x` lies.
    fn locate(&self, x: &Self::Point) -> usize;
}

/// The functions ψ_i0 … ψ_i(B−1) on every cell, orthonormal with respect to μ/μ(X_i); ψ_i0 = 1.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no basis of {B} functions per cell",
    label = "`Basis<{B}>` is missing",
    note = "implement `Basis<{B}>`; for piecewise constants, B = 1, it is `[1]` everywhere"
)]
pub trait Basis<const B: usize = 1>: Partition {
    /// ψ_i0(x) … ψ_i(B−1)(x), where i is the cell of `x`.
    fn basis(&self, x: &Located<Self::Point>) -> [Self::Scalar; B];
}

/// The transition moments, **exact**: they alone carry the unbiasedness.
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not say how probable a step into a cell is",
    label = "`TransitionMoments<{B}>` is missing",
    note = "implement `TransitionMoments<{B}>`: for B = 1 the exact integral of p(x, y) over y in cell j",
    note = "without it there is plain Monte Carlo, with `NoNeighbour`"
)]
pub trait TransitionMoments<const B: usize = 1>: Basis<B> {
    /// M_j(x)_bc = ∫_Xj p(x,y) ψ_jb(y) ψ_jc(y) dμ(y), symmetric. M_j(x)_00 is p_j(x), the
    /// transition mass (45): the probability that the step from `x` leads to cell `j`.
    ///
    /// It must be accurate relative to its own size: where a difference of nearly equal numbers
    /// would cancel for small cells, rewrite it.
    fn moments(&self, x: &Located<Self::Point>, j: usize) -> [[Self::Scalar; B]; B];

    /// The solution c of M_j(x) c = `right`: by elimination, unless a problem knows better. Where M is a
    /// multiple of the identity it is a division.
    #[inline]
    fn solve_moments(
        &self,
        x: &Located<Self::Point>,
        j: usize,
        right: [Self::Scalar; B],
    ) -> [Self::Scalar; B] {
        small::solve(self.moments(x, j), right)
    }
}

/// Exact first moments of the kernel, for pointwise pairs.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no exact integrals for pointwise pairs",
    label = "`PairIntegral<{B}>` is missing",
    note = "implement `PairIntegral<{B}>`: for B = 1 the integral of K(x, y) over y in cell j",
    note = "without it choose pairs in S or outside: `Piecewise::new`, and no `PairKind::Pointwise`"
)]
pub trait PairIntegral<const B: usize = 1>: Basis<B> {
    /// ∫_Xj K(x,y) ψ_jb(y) dμ(y) for b = 0 … B−1.
    fn pair_integral(&self, x: &Located<Self::Point>, j: usize) -> [Self::Scalar; B];
}
