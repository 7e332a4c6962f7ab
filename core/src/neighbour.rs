//! The neighbour equation v = T_hp v + gq as the walk sees it: no degree, no kinds of pairs.

use crate::{Real, StateSpace, Uniforms};

/// A point and the cell that it lies in. The cell is found once per step and handed on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located<P> {
    /// The point.
    pub point: P,
    /// The number of its cell, from 0.
    pub cell: usize,
}

/// A neighbour equation v = T_hp v + G, (50) of Heinrich 1995, that holds **exactly** and whose
/// solution v is known. The walks of the original equation follow it: its kernel is given with
/// respect to the same transition density p.
///
/// The trait is object safe: where multiplying types is not worth it, box it.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no neighbour equation",
    label = "`Neighbour` is missing",
    note = "`Piecewise` makes one from cells and coefficients; `NoNeighbour` serves plain Monte Carlo"
)]
pub trait Neighbour: StateSpace {
    /// Finds the cell of `x`.
    fn locate(&self, x: Self::Point) -> Located<Self::Point>;

    /// h(x, y). `k` is k(x, y), for the pairs on which h = k.
    fn kernel(
        &self,
        x: &Located<Self::Point>,
        y: &Located<Self::Point>,
        k: Self::Scalar,
    ) -> Self::Scalar;

    /// G(x); with absorption g(x) = G(x)/q(x), (49). Or a random number whose mean is G(x): (50) asks for no more.
    ///
    /// `draws` are numbers of the walk that nothing else uses, so that the walk is the same whatever a neighbour equation
    /// draws. Whoever needs none ignores them.
    fn source(
        &self,
        x: &Located<Self::Point>,
        draws: &mut dyn Uniforms<Self::Scalar>,
    ) -> Self::Scalar;

    /// v(x).
    fn value(&self, x: &Located<Self::Point>) -> Self::Scalar;

    /// G(x), and the variance of what [`source`](Self::source) draws for it: what a prediction before any walk asks for,
    /// and it may take long. Whoever draws overrides it; otherwise it is G(x) and 0.
    fn source_moments(&self, x: &Located<Self::Point>) -> [Self::Scalar; 2] {
        [self.source(x, &mut NoDraws), num_traits::zero()]
    }
}

/// No numbers at all, for the G of neighbour equations that draw none: whoever draws gets NaN.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoDraws;

impl<F: Real> Uniforms<F> for NoDraws {
    #[inline]
    fn uniform(&mut self) -> F {
        F::NAN
    }
}

/// A neighbour equation on the space of `E`. Every [`Neighbour`] with its scalar and its points is
/// one.
pub trait NeighbourOf<E: StateSpace + ?Sized>:
    Neighbour<Scalar = E::Scalar, Point = E::Point>
{
}

impl<E, N> NeighbourOf<E> for N
where
    E: StateSpace + ?Sized,
    N: Neighbour<Scalar = E::Scalar, Point = E::Point> + ?Sized,
{
}

/// The neighbour equation 0 = 0. With it the preconditioned estimate is the plain one: for whoever
/// wants plain Monte Carlo only.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoNeighbour<E>(core::marker::PhantomData<E>);

impl<E> NoNeighbour<E> {
    /// The equation 0 = 0 on the space of `E`.
    #[must_use]
    pub const fn new() -> Self {
        Self(core::marker::PhantomData)
    }
}

impl<E: StateSpace> StateSpace for NoNeighbour<E> {
    type Scalar = E::Scalar;
    type Point = E::Point;
}

impl<E: StateSpace> Neighbour for NoNeighbour<E> {
    #[inline]
    fn locate(&self, x: E::Point) -> Located<E::Point> {
        Located { point: x, cell: 0 }
    }
    #[inline]
    fn kernel(&self, _: &Located<E::Point>, _: &Located<E::Point>, _: E::Scalar) -> E::Scalar {
        num_traits::zero()
    }
    #[inline]
    fn source(&self, _: &Located<E::Point>, _: &mut dyn Uniforms<E::Scalar>) -> E::Scalar {
        num_traits::zero()
    }
    #[inline]
    fn value(&self, _: &Located<E::Point>) -> E::Scalar {
        num_traits::zero()
    }
}
