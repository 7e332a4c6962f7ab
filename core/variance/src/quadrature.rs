//! Where functions are represented, and how integrals are taken.

use fredholm_core::Space;

/// A place to which a step may lead, with the probability that it stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step<P> {
    /// y.
    pub point: P,
    /// The weight: that of the quadrature times p(x,y).
    pub weight: f64,
    /// Which node of its site it is, in the order of [`Quadrature::nodes`], if it is one.
    pub node: Option<usize>,
}

/// A partition of X into sites, with quadrature on each and for the steps that lead into it.
///
/// A site may be a part of a cell, a cell, or several cells. There should be enough nodes per cell that the square of
/// k − h, which is of degree 2(p + 1) for a neighbour equation of degree p, is integrated exactly: p + 2 Gauss points
/// an axis. With p + 1 the nodes are nearly the zeros of k − h.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no quadrature to predict variances with",
    label = "`Quadrature` is missing",
    note = "implement `Quadrature`: sites, their nodes with weights, and where steps into a site lead"
)]
pub trait Quadrature: Space<Scalar = f64> {
    /// The number of sites.
    fn sites(&self) -> usize;

    /// The site of a point.
    fn locate(&self, x: &Self::Point) -> usize;

    /// Σ weight f(x) ≈ ∫ f dμ over a site; as many nodes, in the same order, at each call.
    fn nodes(&self, site: usize, visit: impl FnMut(Self::Point, f64));

    /// Σ weight f(y) ≈ ∫ f(y) p(x,y) dμ(y) over a site. The weights sum to the mass of the site, exactly where it has a
    /// closed form.
    fn steps(&self, x: &Self::Point, site: usize, visit: impl FnMut(Step<Self::Point>));
}
