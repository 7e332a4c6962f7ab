//! Quadrature over the cells of a problem, for checks only.

use fredholm_core::galerkin::Partition;

/// Nodes and weights of the Gauss–Legendre rule of `degree` points on [0, 1].
///
/// # Panics
/// If `degree` is 0.
#[must_use]
pub fn gauss_legendre(degree: usize) -> Vec<(f64, f64)> {
    let degree = core::num::NonZeroUsize::new(degree).expect("a rule has at least one point");
    gauss_quad::GaussLegendre::new(degree)
        .iter()
        .map(|(node, weight)| (0.5 + 0.5 * node, 0.5 * weight))
        .collect()
}

/// A problem whose checks may integrate over cells.
pub trait Quadrature: Partition {
    /// Points y of cell `j` and weights such that Σ weight · r(y) is ∫_Xj r dμ to rounding for
    /// whatever smoothness p(x, ·) and K(x, ·) have: where they have a kink at `x` the rule is
    /// split there.
    fn nodes(&self, x: &Self::Point, j: usize) -> Vec<(Self::Point, f64)>;

    /// Points strictly inside cell `j`, at the fractions `t` ∈ (0, 1) of it.
    fn inside(&self, j: usize, t: f64) -> Self::Point;
}
