//! The neighbour equation v = T_hp v + G as the walk sees it: no degree, no kinds of pairs.

use core::marker::PhantomData;

use crate::{Equation, Real, Space, Uniforms, Value};

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
pub trait Neighbour: Space {
    /// The value of h, G and v: that of the equation.
    type Value: Value<Self::Scalar>;

    /// Finds the cell of `x`.
    fn locate(&self, x: Self::Point) -> Located<Self::Point>;

    /// h(x, y). `k` is k(x, y), for the pairs on which h = k.
    fn kernel(
        &self,
        x: &Located<Self::Point>,
        y: &Located<Self::Point>,
        k: &Self::Value,
    ) -> Self::Value;

    /// G(x), (49) without the division by q. Or a random number whose mean is G(x): (50) asks for no more.
    ///
    /// `draws` are numbers of the walk that nothing else uses, so that the walk is the same whatever a neighbour equation
    /// draws. One that needs none ignores them.
    fn source(
        &self,
        x: &Located<Self::Point>,
        draws: &mut dyn Uniforms<Self::Scalar>,
    ) -> Self::Value;

    /// v(x).
    fn value(&self, x: &Located<Self::Point>) -> Self::Value;

    /// Whether h = k for all pairs, so that walks of the neighbour equation end where those of the equation do. By default
    /// it is not known, and [roulette](crate::Absorption::Roulette) takes a step more where k is 0.
    fn is_pointwise(&self) -> bool {
        false
    }

    /// G(x), and the variance of what [`source`](Self::source) draws for it: what a prediction before any walk asks for,
    /// and it may take long. A neighbour equation that draws overrides it; otherwise it is G(x) and 0.
    fn source_moments(&self, x: &Located<Self::Point>) -> [Self::Value; 2] {
        let source = self.source(x, &mut NoDraws);
        let nothing = Self::Value::splat(source.channels(), num_traits::zero());
        [source, nothing]
    }
}

/// No numbers at all, for the F and G of equations that draw none: one that draws gets NaN.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoDraws;

impl<F: Real> Uniforms<F> for NoDraws {
    #[inline]
    fn uniform(&mut self) -> F {
        F::NAN
    }
}

/// A neighbour equation on the space of `E`. Every [`Neighbour`] with its scalar, points and values is
/// one.
pub trait NeighbourOf<E: Equation + ?Sized>:
    Neighbour<Scalar = E::Scalar, Point = E::Point, Value = E::Value>
{
}

impl<E, N> NeighbourOf<E> for N
where
    E: Equation + ?Sized,
    N: Neighbour<Scalar = E::Scalar, Point = E::Point, Value = E::Value> + ?Sized,
{
}

/// The neighbour equation 0 = 0. With it the preconditioned estimate is the plain one: for callers that
/// want plain Monte Carlo only.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoNeighbour<E> {
    channels: usize,
    equation: PhantomData<fn() -> E>,
}

impl<E: Equation> NoNeighbour<E> {
    /// The equation 0 = 0 beside an equation.
    #[must_use]
    pub fn new(equation: &E) -> Self {
        Self {
            channels: equation.channels(),
            equation: PhantomData,
        }
    }

    #[inline(always)]
    fn nothing(&self) -> E::Value {
        E::Value::splat(self.channels, num_traits::zero())
    }
}

impl<E: Space> Space for NoNeighbour<E> {
    type Scalar = E::Scalar;
    type Point = E::Point;
}

impl<E: Equation> Neighbour for NoNeighbour<E> {
    type Value = E::Value;

    #[inline]
    fn locate(&self, x: E::Point) -> Located<E::Point> {
        Located { point: x, cell: 0 }
    }
    #[inline]
    fn kernel(&self, _: &Located<E::Point>, _: &Located<E::Point>, k: &E::Value) -> E::Value {
        // v and G are 0 whatever h is: with h = k nothing is scored for a difference.
        *k
    }
    #[inline]
    fn source(&self, _: &Located<E::Point>, _: &mut dyn Uniforms<E::Scalar>) -> E::Value {
        self.nothing()
    }
    #[inline]
    fn value(&self, _: &Located<E::Point>) -> E::Value {
        self.nothing()
    }
    #[inline]
    fn is_pointwise(&self) -> bool {
        true
    }
}
