//! All pairs pointwise: the neighbour source in closed form, in O(1) at any n.

use fredholm_core::galerkin::GalerkinError;
use fredholm_core::{Located, Neighbour, Real, Space, Uniforms, Value};

use crate::geometry::{Geometry, Local};
use crate::{Direction, Point, Tables};

/// Σ v exp(ia) over some cells, compensated (Neumaier 1974): their rounding errors may
/// not grow with the number of cells, as G is as exact as they are.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sum<F> {
    cos: F,
    sin: F,
    cos_low: F,
    sin_low: F,
}

impl<F: Real> Sum<F> {
    /// Adds a multiple of a direction, by the real and imaginary part of what it is multiplied by.
    #[inline]
    pub(crate) fn add(&mut self, direction: &Direction<F>, [re, im]: [F; 2]) {
        let Direction { cos, sin, .. } = *direction;
        two_sum(&mut self.cos, &mut self.cos_low, re * cos - im * sin);
        two_sum(&mut self.sin, &mut self.sin_low, re * sin + im * cos);
    }

    /// Σ_j v_j sin(a − a_j).
    #[inline]
    pub(crate) fn turn_to(&self, direction: &Direction<F>) -> F {
        direction.sin * (self.cos + self.cos_low) - direction.cos * (self.sin + self.sin_low)
    }
}

/// sum + low += x, with the rounding error of the sum in low.
#[inline]
fn two_sum<F: Real>(sum: &mut F, low: &mut F, x: F) {
    let total = *sum + x;
    let part = total - *sum;
    *low += (*sum - (total - part)) + (x - part);
    *sum = total;
}

/// Per cell i: Σ_{j<i} − Σ_{j>i} of v_j cos(m_j/2), and Σ_{j>i} − Σ_{j<i} of v_j sin(m_j/2), with what a cell sends for v_j.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Moment<F> {
    /// The first.
    pub cos: F,
    /// The second.
    pub sin: F,
}

impl<F: Real> Moment<F> {
    /// The moment of the sums over the cells before and behind cell i.
    pub(crate) fn between(before: &Sum<F>, after: &Sum<F>) -> Self {
        Self {
            cos: (before.cos - after.cos) + (before.cos_low - after.cos_low),
            sin: (after.sin - before.sin) + (after.sin_low - before.sin_low),
        }
    }

    /// Σ_{j≠i} v_j |sin((m_j − s)/2)| for s in cell i.
    #[inline]
    pub(crate) fn turn_from(&self, x: &Point<F>) -> F {
        let (cos, sin) = x.half_angle();
        sin * self.cos + cos * self.sin
    }

    /// The nearest in another scalar.
    #[must_use]
    pub fn cast<T: Real>(&self) -> Moment<T> {
        Moment {
            cos: T::from_f64(self.cos.to_f64()),
            sin: T::from_f64(self.sin.to_f64()),
        }
    }
}

/// The neighbour equation with all pairs pointwise and B polynomials on every cell: h = k, and G = v − T_K v in closed form, O(B)
/// at any n and in every channel. Its preconditioned estimate differs from the plain one in the source only.
///
/// The generic [`Piecewise`](fredholm_core::galerkin::Piecewise) with all pairs pointwise is the
/// same equation, at the price of n integrals for every value of G.
#[derive(Clone, Copy, Debug)]
pub struct Residual<'a, T: Tables, const B: usize = 1> {
    tables: &'a T,
    solution: &'a [T::Scalar],
    moments: &'a [Moment<T::Scalar>],
}

impl<'a, T: Tables, const B: usize> Residual<'a, T, B> {
    /// The residual of the solution v with its [`moments`](crate::GalerkinSystem::moments), of all channels one after the other.
    ///
    /// # Errors
    /// [`GalerkinError::Length`].
    pub fn new(
        tables: &'a T,
        solution: &'a [T::Scalar],
        moments: &'a [Moment<T::Scalar>],
    ) -> Result<Self, GalerkinError> {
        let cells = tables.cells().len() * tables.reflectance(0).channels();
        for (expected, found) in [(cells * B, solution.len()), (cells, moments.len())] {
            if expected != found {
                return Err(GalerkinError::Length { expected, found });
            }
        }
        Ok(Self::unchecked(tables, solution, moments))
    }

    /// The residual of vectors whose lengths are right.
    #[inline]
    pub(crate) const fn unchecked(
        tables: &'a T,
        solution: &'a [T::Scalar],
        moments: &'a [Moment<T::Scalar>],
    ) -> Self {
        Self {
            tables,
            solution,
            moments,
        }
    }

    /// Σ_b v_ib a_b of a channel in cell i.
    #[inline]
    fn sum(&self, cell: usize, channel: usize, a: &[T::Scalar; B]) -> T::Scalar {
        let place = channel * self.tables.cells().len() + cell;
        let own = self
            .solution
            .get(place * B..)
            .and_then(<[_]>::first_chunk::<B>);
        let Some(v) = own else {
            return T::Scalar::NAN;
        };
        let mut products = a.iter().zip(v).map(|(&a, &v)| a * v);
        let first = products.next().unwrap_or(T::Scalar::NAN);
        products.fold(first, |sum, product| sum + product)
    }

    /// (T_K v)(x): of piecewise constants ρ_i [sin A Σ_{j≠i} v_j |sin((m_j − s)/2)| + v_i (1 − cos A cos((m_i − s)/2))].
    #[inline]
    pub fn reflected(&self, x: &Located<Point<T::Scalar>>) -> T::Value {
        let Local { integrals, .. } = self.tables.local(x);
        let reflectance = self.tables.reflectance(x.cell);
        T::Value::from_fn(reflectance.channels(), |c| {
            reflectance.get(c) * self.gathered(x, c, &integrals)
        })
    }

    /// ∫ ¼|sin((t − s)/2)| v(t) dt of a channel.
    #[inline]
    fn gathered(
        &self,
        x: &Located<Point<T::Scalar>>,
        channel: usize,
        integrals: &[T::Scalar; B],
    ) -> T::Scalar {
        let Some(moment) = self
            .moments
            .get(channel * self.tables.cells().len() + x.cell)
        else {
            return T::Scalar::NAN;
        };
        let others = self.tables.constants().root * moment.turn_from(&x.point);
        others + self.sum(x.cell, channel, integrals)
    }
}

impl<T: Tables, const B: usize> Space for Residual<'_, T, B> {
    type Scalar = T::Scalar;
    type Point = Point<T::Scalar>;
}

impl<T: Tables, const B: usize> Neighbour for Residual<'_, T, B> {
    type Value = T::Value;

    #[inline]
    fn locate(&self, x: Point<T::Scalar>) -> Located<Point<T::Scalar>> {
        Located {
            point: x,
            cell: x.cell(),
        }
    }

    #[inline]
    fn kernel(
        &self,
        _: &Located<Point<T::Scalar>>,
        _: &Located<Point<T::Scalar>>,
        k: &T::Value,
    ) -> T::Value {
        *k
    }

    #[inline]
    fn source(&self, x: &Located<Point<T::Scalar>>, _: &mut dyn Uniforms<T::Scalar>) -> T::Value {
        let Local { psi, integrals } = self.tables.local(x);
        let reflectance = self.tables.reflectance(x.cell);
        T::Value::from_fn(reflectance.channels(), |c| {
            self.sum(x.cell, c, &psi) - reflectance.get(c) * self.gathered(x, c, &integrals)
        })
    }

    #[inline]
    fn value(&self, x: &Located<Point<T::Scalar>>) -> T::Value {
        let Local { psi, .. } = self.tables.local(x);
        let channels = self.tables.reflectance(x.cell).channels();
        T::Value::from_fn(channels, |c| self.sum(x.cell, c, &psi))
    }

    #[inline]
    fn is_pointwise(&self) -> bool {
        true
    }
}
