//! What the kit needs to know of a problem.

use core::fmt;

use fredholm_core::galerkin::{Basis, Cells};
use fredholm_core::{Equation, Real, Space, WideOf};

/// The points of the space of a described problem.
pub type PointOf<D, const B: usize> = <<D as Description<B>>::Equation as Space>::Point;
/// The scalar of a described problem.
pub type ScalarOf<D, const B: usize> = <<D as Description<B>>::Equation as Space>::Scalar;
/// The value of kernel and source of a described problem.
pub type ValueOf<D, const B: usize> = <<D as Description<B>>::Equation as Equation>::Value;

/// How a problem offers itself to the kit, with B functions per cell.
///
/// It is a type of the test's own, so that it may stand in the tests of any crate. What it must
/// give is how to integrate over cells; what it may give makes further checks possible.
pub trait Description<const B: usize = 1>: Sized {
    /// The equation and its chain, cells and basis. [`examine`](crate::examine()) also asks for the density p and the transition
    /// moments, [`examine_steps`](crate::examine_steps) does not.
    type Equation: Equation<Point: fmt::Debug + Send + Sync> + Basis<B> + Sync;

    /// The equation.
    fn equation(&self) -> &Self::Equation;

    /// Whether `x` lies in the closed cell `cell`, up to a few rounding errors at its edge: by
    /// geometry, not by `locate`, which is tested against it.
    fn contains(&self, cell: usize, x: &PointOf<Self, B>) -> bool;

    /// Points y of cell `cell` and weights such that Σ weight · r(y) is ∫_Xj r dμ to rounding for
    /// whatever smoothness p(x, ·) and K(x, ·) have: where they have a kink at `x` the rule is
    /// split there. [`quadrature`](crate::quadrature) has rules. Of an equation of steps products of two functions of the basis suffice.
    fn nodes(&self, x: &PointOf<Self, B>, cell: usize) -> Vec<(PointOf<Self, B>, f64)>;

    /// The probability that a step from `x` leaves the space.
    fn leaving(&self, _: &PointOf<Self, B>) -> f64 {
        0.0
    }

    /// The exact solution u(x), where it is known.
    fn solution(&self, _: &PointOf<Self, B>) -> Option<WideOf<Self::Equation>> {
        None
    }

    /// The value of u where u is constant.
    fn constant(&self) -> Option<WideOf<Self::Equation>> {
        None
    }

    /// The probability that a step from `x` that does not leave leads to a point before `y`, in
    /// whatever order of the points: the distribution function of some real function of y. In one
    /// dimension that is the coordinate, on a sphere it may be the height.
    fn cumulative(&self, _x: &PointOf<Self, B>, _y: &PointOf<Self, B>) -> Option<f64> {
        None
    }

    /// How far, in units of ε, ∫_Xj p(x, ·) dμ may be off because `x` and the nodes are stored to ε
    /// of the size of X, where p varies over less than that: to first order ∫_Xj |∂p/∂x| + |∂p/∂y|
    /// dμ(y) times the size of X. The kit adds it to the size of what it compares. 0 where p is
    /// computed to a few ε whatever the points are, as on a circle, where points are angles.
    fn sensitivity(&self, _x: &PointOf<Self, B>, _cell: usize) -> f64 {
        0.0
    }

    /// p_j(x) by another formula in f64 or better, of the point as it is stored: to see whether
    /// masses are accurate relative to their own size where quadrature cannot, in tiny cells.
    fn mass(&self, _x: &fredholm_core::Located<PointOf<Self, B>>, _cell: usize) -> Option<f64> {
        None
    }

    /// q0 of the walks with constant absorption that the kit compares with those by roulette. By default 0.2.
    fn absorption(&self) -> f64 {
        0.2
    }
}

/// The middle of a cell.
pub(crate) fn middle<D: Description<B>, const B: usize>(
    description: &D,
    cell: usize,
) -> PointOf<D, B> {
    let t = vec![0.5; D::Equation::DIMENSION];
    description.equation().point(cell, &t)
}

/// Points of a cell and weights, for functions that are smooth on it.
pub(crate) fn cell_nodes<D: Description<B>, const B: usize>(
    description: &D,
    cell: usize,
) -> Vec<(PointOf<D, B>, f64)> {
    description.nodes(&middle(description, cell), cell)
}

/// ε of a described problem's scalar.
pub(crate) fn epsilon<D: Description<B>, const B: usize>() -> f64 {
    ScalarOf::<D, B>::EPSILON.to_f64()
}

/// The name of a described problem's scalar.
pub(crate) fn scalar_name<D: Description<B>, const B: usize>() -> &'static str {
    // The two scalars that there are.
    if epsilon::<D, B>() > 1e-10 {
        "f32"
    } else {
        "f64"
    }
}
