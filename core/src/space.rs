//! The equation u = T_K u + F in terms of a chain: p, k and F.

use crate::{Located, Real, Uniforms, Value};

/// A set X with a measure μ: what its points are, and in which scalar type one computes.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no equation yet: it has no space",
    label = "`Space` is missing",
    note = "implement `Space`: the scalar (f32, f64 or any `Real`) and the type of a point"
)]
pub trait Space {
    /// `f32` or `f64`.
    type Scalar: Real;
    /// A point of X. It may carry what its maker knew and others would have to find again (a
    /// cell's or a segment's number), as long as it is a function of the point.
    type Point: Copy;
}

/// The Markov chain with the transition density p, ∫ p(x, y) dμ(y) ≤ 1.
///
/// Absorption is no part of it: how walks end is said by [`Absorption`](crate::Absorption).
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no chain to walk",
    label = "`Chain` is missing",
    note = "implement `Chain`: a step with density p(x, y), as a function of uniform numbers"
)]
pub trait Chain: Space {
    /// A point y with density p(x, y), by inversion: a pure function of `x` and of the
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
    label = "`Density` is missing",
    note = "implement `Density`: p(x, y), with integral 1 or, where steps leave the space, less"
)]
pub trait Density: Chain {
    /// p(x, y) with respect to μ(dy).
    fn density(&self, x: &Self::Point, y: &Self::Point) -> Self::Scalar;
}

/// An equation that walks can follow: its chain, its kernel and its right-hand side, of one channel or of several.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is a chain without an equation",
    label = "`Equation` is missing",
    note = "implement `Equation`: k(x, y) = K(x, y)/p(x, y) and F(x); `type Value` is the scalar, or `Channels`"
)]
pub trait Equation: Chain {
    /// The value of kernel and source: the scalar, or several channels that share the chain.
    type Value: Value<Self::Scalar>;

    /// k(x, y) = K(x, y)/p(x, y).
    fn kernel(&self, x: &Self::Point, y: &Self::Point) -> Self::Value;

    /// F(x), or a random number with this mean, which is drawn from the walk's own numbers: where F is an integral that
    /// nobody has in closed form, a sample of it serves as well.
    fn source<U: Uniforms<Self::Scalar>>(&self, x: &Self::Point, uniforms: &mut U) -> Self::Value;

    /// The number C of channels.
    #[inline(always)]
    fn channels(&self) -> usize {
        1
    }

    /// The size of k(x, y) as far as `x` tells it: [roulette](crate::Absorption::Roulette) is played with it before a step.
    /// Any positive number leaves the mean, and 0 where k(x, ·) is 0; |k| where k does not depend on y makes weights stay 1. By default
    /// 1.
    #[inline(always)]
    fn size(&self, x: &Self::Point) -> Self::Scalar {
        let _ = x;
        num_traits::one()
    }

    /// The start of a walk for ∫ p(x, y) u(y) dμ(y), the mean of u over steps from x: the point to which a step leads, with φ = 1. Nothing
    /// comes from where a step leaves the space. Of light that is the irradiance, of which black walls have one, too.
    fn arriving<U: Uniforms<Self::Scalar>>(
        &self,
        x: &Self::Point,
        uniforms: &mut U,
    ) -> StartOf<Self> {
        match self.step(x, uniforms) {
            Some(y) => Start::of(self, y, num_traits::one()),
            None => Start::of(self, *x, num_traits::zero()),
        }
    }
}

/// The start of a walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start<P, F, V> {
    /// x0, of density p0.
    pub point: P,
    /// φ(x0) = Φ(x0)/p0(x0).
    pub phi: F,
    /// A random number with the mean of what no state scores: the part of (u, Φ) that starts know by themselves.
    pub known: V,
}

/// The start of a walk of an equation.
pub type StartOf<E> = Start<<E as Space>::Point, <E as Space>::Scalar, <E as Equation>::Value>;

/// The value of an equation in f64.
pub type WideOf<E> = <<E as Equation>::Value as Value<<E as Space>::Scalar>>::Wide;

/// A functional Φ = φ p0 of the solution on the space of `E`, (2) of Heinrich 1995: where walks
/// start and with which weight. The estimate is of (u, Φ).
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no functional on the space of `{E}`",
    label = "`Functional` is missing",
    note = "`At(x)` is the value in a point of type `E::Point`; means are functionals of the problem's own"
)]
pub trait Functional<E: Equation + ?Sized> {
    /// A start: x0 with density p0, φ(x0), and what it knows by itself.
    fn start<U: Uniforms<E::Scalar>>(&self, equation: &E, uniforms: &mut U) -> StartOf<E>;

    /// A number whose mean over p0 is (v, Φ), from a start x0, φ(x0) and v(x0), for where (v, Φ) is not
    /// known: φ(x0) v(x0), unless a functional has one that varies less. Its variance stays in that of ζ.
    fn control_estimate(&self, x0: &Located<E::Point>, phi: E::Scalar, v: &E::Value) -> WideOf<E> {
        let _ = x0;
        v.scaled(phi).wide()
    }

    /// The number of starts by which a walk estimates (v, Φ) where that is not known: its own, and further ones. The more,
    /// the less of φ v's own variance is left in that of ζ.
    fn looks(&self) -> u32 {
        1
    }
}

/// The value of the solution in one point: every walk starts in it, φ = 1, and may be absorbed
/// there (section 5 of Heinrich 1995). (v, Φ) = v(x0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct At<P>(pub P);

impl<E: Equation + ?Sized> Functional<E> for At<E::Point> {
    #[inline]
    fn start<U: Uniforms<E::Scalar>>(&self, equation: &E, _: &mut U) -> StartOf<E> {
        Start::of(equation, self.0, num_traits::one())
    }
}

/// The mean of u over steps from a point, ∫ p(x, y) u(y) dμ(y): see [`Equation::arriving`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Arriving<P>(pub(crate) P);

impl<E: Equation + ?Sized> Functional<E> for Arriving<E::Point> {
    fn start<U: Uniforms<E::Scalar>>(&self, equation: &E, uniforms: &mut U) -> StartOf<E> {
        equation.arriving(&self.0, uniforms)
    }
}

/// A multiple of another functional: walks start in the same states, and φ is as many times as large.
///
/// ```
/// use fredholm_core::{At, Scaled};
///
/// let twice = Scaled { of: At(0.3), factor: 2.0 };
/// assert_eq!((twice.of.0, twice.factor), (0.3, 2.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaled<T, F> {
    /// The functional Φ.
    pub of: T,
    /// The factor by which Φ is multiplied.
    pub factor: F,
}

impl<E: Equation + ?Sized, T: Functional<E>> Functional<E> for Scaled<T, E::Scalar> {
    #[inline]
    fn start<U: Uniforms<E::Scalar>>(&self, equation: &E, uniforms: &mut U) -> StartOf<E> {
        self.of.start(equation, uniforms).scaled(self.factor)
    }

    /// φ has the factor already.
    #[inline]
    fn control_estimate(&self, x0: &Located<E::Point>, phi: E::Scalar, v: &E::Value) -> WideOf<E> {
        self.of.control_estimate(x0, phi, v)
    }

    #[inline]
    fn looks(&self) -> u32 {
        self.of.looks()
    }
}

impl<P, F: Real, V: Value<F>> Start<P, F, V> {
    /// A start that knows nothing by itself.
    #[inline(always)]
    pub fn of<E>(equation: &E, point: P, phi: F) -> Self
    where
        E: Equation<Scalar = F, Point = P, Value = V> + ?Sized,
    {
        Self {
            point,
            phi,
            known: V::splat(equation.channels(), F::zero()),
        }
    }

    /// The start of a walk for so many times as much.
    #[inline]
    #[must_use]
    pub fn scaled(self, factor: F) -> Self {
        Self {
            point: self.point,
            phi: self.phi * factor,
            known: self.known.scaled(factor),
        }
    }
}
