//! What is known of (u, Φ) besides what walks estimate.

use num_traits::zero;

use crate::{Functional, Kernel, Located, Neighbour, RandomSource, Sampler, StateSpace, Uniforms};

/// An equation, or a neighbour equation, of w = u − F whose walks score (F, Φ) besides, which is known, where they start: their
/// estimate is of (u, Φ).
///
/// A walk of [`LastStep`](crate::LastStep) estimates (w, Φ). With this around the equation and around its neighbour equation,
/// and walks that start by [`KnownPart`], nobody who sees results has to add anything. The part is scored with the start, and
/// so, by the absorption estimator, where a walk is absorbed at once: there it has a variance of its own, which both
/// equations share, so that none of it is left in ζ.
///
/// ```
/// use fredholm_core::{At, KnownPart, RandomSource, Source, StateSpace, WithKnown, Functional, Uniforms};
///
/// struct One;
/// impl StateSpace for One {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl Source for One {
///     fn source(&self, _: &f64) -> f64 {
///         1.0
///     }
/// }
/// struct NoNumbers;
/// impl Uniforms<f64> for NoNumbers {
///     fn uniform(&mut self) -> f64 {
///         f64::NAN
///     }
/// }
/// let start = KnownPart { functional: At(0.5), known: 3.0 };
/// let (x0, phi) = Functional::<WithKnown<One>>::start(&start, &mut NoNumbers);
/// assert_eq!(phi * WithKnown(&One).sample_source(&x0, &mut NoNumbers), 4.0);
/// ```
#[derive(Debug)]
pub struct WithKnown<'a, T: ?Sized>(pub &'a T);

// By hand: a derive would ask what it borrows to be `Clone` and `Copy`.
impl<T: ?Sized> Clone for WithKnown<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T: ?Sized> Copy for WithKnown<'_, T> {}

/// A point, and what is known of (u, Φ) if a walk starts there: 0 for all other states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Started<P, F> {
    /// The point.
    pub point: P,
    /// The known part over φ(x0).
    pub known: F,
}

/// A functional, and the part of (u, Φ) that is known.
///
/// ```
/// use fredholm_core::{At, KnownPart};
///
/// let start = KnownPart { functional: At(0.5), known: 3.0 };
/// assert_eq!(start.known, 3.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownPart<T, F> {
    /// The functional, whose φ may not vanish.
    pub functional: T,
    /// The part that is known: (F, Φ).
    pub known: F,
}

/// A functional of u, of which `known` is known and walks estimate the rest.
///
/// ```
/// use fredholm_core::{At, Functional, Shifted, StateSpace};
///
/// struct Line;
/// impl StateSpace for Line {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// // u(0.5) = 3 + w(0.5).
/// let start = Shifted { functional: At(0.5), known: 3.0 };
/// assert_eq!(Functional::<Line>::known(&start), 3.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shifted<T> {
    /// The functional of what walks estimate.
    pub functional: T,
    /// What is known.
    pub known: f64,
}

impl<E: StateSpace, T: Functional<E>> Functional<E> for Shifted<T> {
    #[inline]
    fn start<U: Uniforms<E::Scalar>>(&self, uniforms: &mut U) -> (E::Point, E::Scalar) {
        self.functional.start(uniforms)
    }

    fn control_estimate(&self, x0: &Located<E::Point>, phi: E::Scalar, v: E::Scalar) -> f64 {
        self.functional.control_estimate(x0, phi, v)
    }

    fn known(&self) -> f64 {
        self.functional.known() + self.known
    }
}

impl<'a, E, T> Functional<WithKnown<'a, E>> for KnownPart<T, E::Scalar>
where
    E: StateSpace,
    T: Functional<E>,
{
    #[inline]
    fn start<U: Uniforms<E::Scalar>>(
        &self,
        uniforms: &mut U,
    ) -> (Started<E::Point, E::Scalar>, E::Scalar) {
        let (point, phi) = self.functional.start(uniforms);
        let known = self.known / phi;
        (Started { point, known }, phi)
    }
}

impl<T: StateSpace + ?Sized> StateSpace for WithKnown<'_, T> {
    type Scalar = T::Scalar;
    type Point = Started<T::Point, T::Scalar>;
}

impl<E: Sampler> Sampler for WithKnown<'_, E> {
    #[inline(always)]
    fn absorption(&self, x: &Self::Point) -> E::Scalar {
        self.0.absorption(&x.point)
    }

    #[inline(always)]
    fn step<U: Uniforms<E::Scalar>>(
        &self,
        x: &Self::Point,
        uniforms: &mut U,
    ) -> Option<Self::Point> {
        let point = self.0.step(&x.point, uniforms)?;
        Some(Started {
            point,
            known: zero(),
        })
    }
}

impl<E: Kernel> Kernel for WithKnown<'_, E> {
    #[inline(always)]
    fn kernel(&self, x: &Self::Point, y: &Self::Point) -> E::Scalar {
        self.0.kernel(&x.point, &y.point)
    }
}

impl<E: RandomSource> RandomSource for WithKnown<'_, E> {
    #[inline(always)]
    fn sample_source<U: Uniforms<E::Scalar>>(
        &self,
        x: &Self::Point,
        uniforms: &mut U,
    ) -> E::Scalar {
        x.known + self.0.sample_source(&x.point, uniforms)
    }
}

/// A state as the neighbour equation inside has it.
fn inner<P: Copy, F>(x: &Located<Started<P, F>>) -> Located<P> {
    Located {
        point: x.point.point,
        cell: x.cell,
    }
}

impl<N: Neighbour + ?Sized> Neighbour for WithKnown<'_, N> {
    #[inline]
    fn locate(&self, x: Self::Point) -> Located<Self::Point> {
        Located {
            point: x,
            cell: self.0.locate(x.point).cell,
        }
    }

    #[inline]
    fn kernel(
        &self,
        x: &Located<Self::Point>,
        y: &Located<Self::Point>,
        k: N::Scalar,
    ) -> N::Scalar {
        self.0.kernel(&inner(x), &inner(y), k)
    }

    #[inline]
    fn source(&self, x: &Located<Self::Point>, draws: &mut dyn Uniforms<N::Scalar>) -> N::Scalar {
        x.point.known + self.0.source(&inner(x), draws)
    }

    #[inline]
    fn value(&self, x: &Located<Self::Point>) -> N::Scalar {
        x.point.known + self.0.value(&inner(x))
    }
}
