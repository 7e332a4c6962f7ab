//! What the kit needs to know of a problem.

use core::fmt;

use fredholm_core::galerkin::TransitionMoments;
use fredholm_core::{Kernel, Located, Real, Source, StateSpace, TransitionDensity};

/// The points of the space of a described problem.
pub type PointOf<D, const B: usize> = <<D as Description<B>>::Equation as StateSpace>::Point;
/// The scalar of a described problem.
pub type ScalarOf<D, const B: usize> = <<D as Description<B>>::Equation as StateSpace>::Scalar;

/// How a problem offers itself to the kit, with B functions per cell.
///
/// It is a type of the test's own, so that it may stand in the tests of any crate. What it must
/// give is where the cells are and how to integrate over them; what it may give makes further
/// checks possible.
pub trait Description<const B: usize = 1>: Sized {
    /// The equation and its chain, cells, basis and transition moments.
    type Equation: StateSpace<Point: fmt::Debug + Send + Sync>
        + TransitionDensity
        + Kernel
        + Source
        + TransitionMoments<B>
        + Sync;

    /// The number of parameters of a cell: the dimension of X.
    const DIMENSION: usize;

    /// The equation.
    fn equation(&self) -> &Self::Equation;

    /// The point of the closed cell `cell` at the parameters t ∈ [0, 1]^[`DIMENSION`]: any map of
    /// the cube onto the cell whose faces go to the cell's edge.
    ///
    /// [`DIMENSION`]: Self::DIMENSION
    fn point(&self, cell: usize, t: &[f64]) -> PointOf<Self, B>;

    /// Whether `x` lies in the closed cell `cell`, up to a few rounding errors at its edge: by
    /// geometry, not by `locate`, which is tested against it.
    fn contains(&self, cell: usize, x: &PointOf<Self, B>) -> bool;

    /// Points y of cell `cell` and weights such that Σ weight · r(y) is ∫_Xj r dμ to rounding for
    /// whatever smoothness p(x, ·) and K(x, ·) have: where they have a kink at `x` the rule is
    /// split there. [`quadrature`](crate::quadrature) has rules.
    fn nodes(&self, x: &PointOf<Self, B>, cell: usize) -> Vec<(PointOf<Self, B>, f64)>;

    /// The probability that a step from `x` leaves the space.
    fn leaving(&self, _: &PointOf<Self, B>) -> f64 {
        0.0
    }

    /// μ(X_j) of cell j, where the equation implements `CellMap`: give both, [`point`](Self::point) and this, as `CellMap`
    /// has them. Uniform parameters must then give points that are uniform with respect to μ.
    fn measure(&self, _cell: usize) -> Option<f64> {
        None
    }

    /// The parameters of a point of a cell, where the equation's `CellMap` has them.
    fn parameters(&self, _: &Located<PointOf<Self, B>>) -> Option<Vec<f64>> {
        None
    }

    /// The exact solution u(x), where it is known.
    fn solution(&self, _: &PointOf<Self, B>) -> Option<f64> {
        None
    }

    /// The value of u where u is constant.
    fn constant(&self) -> Option<f64> {
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
    fn mass(&self, _x: &Located<PointOf<Self, B>>, _cell: usize) -> Option<f64> {
        None
    }
}

/// ε of a described problem's scalar.
pub(crate) fn epsilon<D: Description<B>, const B: usize>() -> f64 {
    ScalarOf::<D, B>::EPSILON.to_f64()
}

/// The name of a described problem's scalar.
pub(crate) fn scalar_name<D: Description<B>, const B: usize>() -> &'static str {
    // The two scalars that there are.
    if ScalarOf::<D, B>::EPSILON.to_f64() > 1e-10 {
        "f32"
    } else {
        "f64"
    }
}
