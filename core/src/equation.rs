//! The equation u = T_K u + F in terms of an absorbing chain: p0, p, q, φ, k and F.

use crate::{Located, Real, Uniforms};

/// A set X with a measure μ: what its points are, and in which scalar type one computes.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no equation yet: it has no space",
    label = "`StateSpace` is missing",
    note = "implement `StateSpace`: the scalar (f32, f64 or any `Real`) and the type of a point"
)]
pub trait StateSpace {
    /// `f32` or `f64`.
    type Scalar: Real;
    /// A point of X. It may carry what its maker knew and others would have to find again (a
    /// cell's or a segment's number), as long as it is a function of the point.
    type Point: Copy;
}

/// The absorbing Markov chain: absorption probability q and transition density p.
///
/// ∫ p(x, y) dμ(y) = 1 − q(x), (4) of Heinrich 1995.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no chain to walk",
    label = "`Sampler` is missing",
    note = "implement `Sampler`: the absorption probability q(x), and a step with density p(x, y)/(1 - q(x))"
)]
pub trait Sampler: StateSpace {
    /// q(x) ∈ [0, 1]: the probability that a walk ends in `x`.
    fn absorption(&self, x: &Self::Point) -> Self::Scalar;

    /// A point y with density p(x, y)/(1 − q(x)), by inversion: a pure function of `x` and of the
    /// numbers drawn. `None`: the walk left the space, with the probability that this density
    /// lacks to 1; it ends and scores nothing more.
    fn step<U: Uniforms<Self::Scalar>>(
        &self,
        x: &Self::Point,
        uniforms: &mut U,
    ) -> Option<Self::Point>;
}

/// The transition density p as a function, where it is known: for tests and for quadrature.
#[diagnostic::on_unimplemented(
    message = "the transition density of `{Self}` is not known",
    label = "`TransitionDensity` is missing",
    note = "implement `TransitionDensity`: p(x, y), with integral 1 - q(x); checks and quadrature ask for it"
)]
pub trait TransitionDensity: Sampler {
    /// p(x, y) with respect to μ(dy).
    fn density(&self, x: &Self::Point, y: &Self::Point) -> Self::Scalar;
}

/// The kernel in terms of the chain: K(x, y) = k(x, y) p(x, y).
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no kernel",
    label = "`Kernel` is missing",
    note = "implement `Kernel`: k(x, y) = K(x, y)/p(x, y)"
)]
pub trait Kernel: StateSpace {
    /// k(x, y) = K(x, y)/p(x, y).
    fn kernel(&self, x: &Self::Point, y: &Self::Point) -> Self::Scalar;
}

/// The right-hand side of the equation.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no source",
    label = "`Source` is missing",
    note = "implement `Source`: F(x), the right-hand side"
)]
pub trait Source: StateSpace {
    /// F(x); with absorption f(x) = F(x)/q(x).
    fn source(&self, x: &Self::Point) -> Self::Scalar;
}

/// What a walk scores in a state: a random number whose mean is F(x).
///
/// Every [`Source`] is one, without randomness. Where F is an integral that nobody has in closed form, a sample of it
/// serves as well: see [`LastStep`](crate::LastStep).
pub trait RandomSource: StateSpace {
    /// A number with mean F(x). What it draws is drawn from the walk's own numbers.
    fn sample_source<U: Uniforms<Self::Scalar>>(
        &self,
        x: &Self::Point,
        uniforms: &mut U,
    ) -> Self::Scalar;
}

impl<E: Source + ?Sized> RandomSource for E {
    #[inline(always)]
    fn sample_source<U: Uniforms<E::Scalar>>(&self, x: &E::Point, _: &mut U) -> E::Scalar {
        self.source(x)
    }
}

/// An equation that walks can follow: its chain, its kernel and its right-hand side. Every type that
/// has these three is one.
pub trait Equation: Sampler + Kernel + RandomSource {}

impl<E: Sampler + Kernel + RandomSource + ?Sized> Equation for E {}

/// A functional Φ = φ p0 of the solution on the space of `E`, (2) of Heinrich 1995: where walks
/// start and with which weight. The estimate is of (u, Φ).
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no functional on the space of `{E}`",
    label = "`Functional` is missing",
    note = "`At(x)` is the value in a point of type `E::Point`; means are functionals of the problem's own"
)]
pub trait Functional<E: StateSpace> {
    /// A point x0 with density p0, and φ(x0) = Φ(x0)/p0(x0).
    fn start<U: Uniforms<E::Scalar>>(&self, uniforms: &mut U) -> (E::Point, E::Scalar);

    /// A number whose mean over p0 is (v, Φ), from a start x0, φ(x0) and v(x0), for where (v, Φ) is not
    /// known: φ(x0) v(x0), unless a functional has one that varies less. Its variance stays in that of ζ.
    fn control_estimate(&self, x0: &Located<E::Point>, phi: E::Scalar, v: E::Scalar) -> f64 {
        let _ = x0;
        (phi * v).to_f64()
    }

    /// The part of (u, Φ) that is known besides what walks estimate, and is added to their scores: (F_s, Φ), if they are for
    /// u − F_s, as with a [`LastStep`](crate::LastStep). Otherwise 0.
    fn known(&self) -> f64 {
        0.0
    }
}

/// The value of the solution in one point: every walk starts in it, φ = 1, and may be absorbed
/// there (section 5 of Heinrich 1995). (v, Φ) = v(x0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct At<P>(pub P);

impl<E: StateSpace> Functional<E> for At<E::Point> {
    #[inline]
    fn start<U: Uniforms<E::Scalar>>(&self, _: &mut U) -> (E::Point, E::Scalar) {
        (self.0, num_traits::one())
    }
}
