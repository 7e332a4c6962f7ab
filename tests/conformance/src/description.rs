//! What the kit needs to know of a problem.

use core::fmt;

use fredholm_core::galerkin::{Basis, TransitionMoments};
use fredholm_core::{
    Kernel, Located, RandomSource, Real, Sampler, Source, StateSpace, TransitionDensity,
};

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

/// The points of the space of an equation of steps.
pub type StepPointOf<D, const B: usize> =
    <<D as StepDescription<B>>::Equation as StateSpace>::Point;
/// The scalar of an equation of steps.
pub type StepScalarOf<D, const B: usize> =
    <<D as StepDescription<B>>::Equation as StateSpace>::Scalar;

/// How an equation of which nothing is known but how to step offers itself to the kit, with B functions per cell.
///
/// It has no density, no transition moments and perhaps no F, but a random number with this mean: what
/// [`sampled`](fredholm_core::sampled) asks for. Integrals over steps are then means over draws, and checks that compare them
/// are statistical. Every [`Description`] is one.
pub trait StepDescription<const B: usize = 1>: Sized {
    /// The equation and its chain, cells and basis.
    type Equation: StateSpace<Point: fmt::Debug + Send + Sync>
        + Sampler
        + Kernel
        + RandomSource
        + Basis<B>
        + Sync;

    /// The number of parameters of a cell: the dimension of X.
    const DIMENSION: usize;

    /// The equation.
    fn equation(&self) -> &Self::Equation;

    /// The point of a closed cell at the parameters t: see [`Description::point`].
    fn point(&self, cell: usize, t: &[f64]) -> StepPointOf<Self, B>;

    /// Whether `x` lies in a closed cell, by geometry: see [`Description::contains`].
    fn contains(&self, cell: usize, x: &StepPointOf<Self, B>) -> bool;

    /// Points y of cell `cell` and weights such that Σ weight · r(y) is ∫_Xj r dμ to rounding for products of two functions of
    /// the basis.
    fn cell_nodes(&self, cell: usize) -> Vec<(StepPointOf<Self, B>, f64)>;

    /// The probability that a step from `x` leaves the space, where [`mass`](Self::mass) is known.
    fn leaving(&self, _: &StepPointOf<Self, B>) -> f64 {
        0.0
    }

    /// μ(X_j), where the equation implements `CellMap`: see [`Description::measure`].
    fn measure(&self, _cell: usize) -> Option<f64> {
        None
    }

    /// The parameters of a point of a cell, where the equation's `CellMap` has them.
    fn parameters(&self, _: &Located<StepPointOf<Self, B>>) -> Option<Vec<f64>> {
        None
    }

    /// The exact solution u(x), where it is known.
    fn solution(&self, _: &StepPointOf<Self, B>) -> Option<f64> {
        None
    }

    /// p_j(x), the probability of a step from `x` into a cell, where it is known.
    fn mass(&self, _x: &Located<StepPointOf<Self, B>>, _cell: usize) -> Option<f64> {
        None
    }
}

impl<D: Description<B>, const B: usize> StepDescription<B> for D {
    type Equation = <D as Description<B>>::Equation;
    const DIMENSION: usize = <D as Description<B>>::DIMENSION;

    fn equation(&self) -> &Self::Equation {
        Description::equation(self)
    }
    fn point(&self, cell: usize, t: &[f64]) -> PointOf<D, B> {
        Description::point(self, cell, t)
    }
    fn contains(&self, cell: usize, x: &PointOf<D, B>) -> bool {
        Description::contains(self, cell, x)
    }
    fn cell_nodes(&self, cell: usize) -> Vec<(PointOf<D, B>, f64)> {
        let middle = Description::point(self, cell, &vec![0.5; <D as Description<B>>::DIMENSION]);
        self.nodes(&middle, cell)
    }
    fn leaving(&self, x: &PointOf<D, B>) -> f64 {
        Description::leaving(self, x)
    }
    fn measure(&self, cell: usize) -> Option<f64> {
        Description::measure(self, cell)
    }
    fn parameters(&self, x: &Located<PointOf<D, B>>) -> Option<Vec<f64>> {
        Description::parameters(self, x)
    }
    fn solution(&self, x: &PointOf<D, B>) -> Option<f64> {
        Description::solution(self, x)
    }
    fn mass(&self, x: &Located<PointOf<D, B>>, cell: usize) -> Option<f64> {
        Description::mass(self, x, cell)
    }
}

/// ε of a described problem's scalar.
pub(crate) fn epsilon<D: StepDescription<B>, const B: usize>() -> f64 {
    StepScalarOf::<D, B>::EPSILON.to_f64()
}

/// The name of a described problem's scalar.
pub(crate) fn scalar_name<D: StepDescription<B>, const B: usize>() -> &'static str {
    // The two scalars that there are.
    if StepScalarOf::<D, B>::EPSILON.to_f64() > 1e-10 {
        "f32"
    } else {
        "f64"
    }
}
