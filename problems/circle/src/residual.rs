//! All pairs pointwise: the neighbour source in closed form, in O(1) at any n.

use fredholm_core::{Located, Neighbour, Real, StateSpace};

use crate::cells::{Cells, Direction};
use crate::{Circle, CircleError, Emission, Point};

/// Σ v cos a and Σ v sin a over some cells, compensated (Neumaier 1974): their rounding errors may
/// not grow with the number of cells, as G is as exact as they are.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sum<F> {
    cos: F,
    sin: F,
    cos_low: F,
    sin_low: F,
}

impl<F: Real> Sum<F> {
    #[inline]
    pub(crate) fn add(&mut self, direction: &Direction<F>, v: F) {
        two_sum(&mut self.cos, &mut self.cos_low, v * direction.cos);
        two_sum(&mut self.sin, &mut self.sin_low, v * direction.sin);
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

/// The middles of all cells.
pub(crate) fn middles<'a, F: Real>(cells: &Cells<'a, F>) -> impl Iterator<Item = &'a Direction<F>> {
    cells.iter().map(|cell| &cell.middle)
}

/// Per cell i: Σ_{j<i} − Σ_{j>i} of v_j cos(m_j/2), and Σ_{j>i} − Σ_{j<i} of v_j sin(m_j/2).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Moment<F> {
    cos: F,
    sin: F,
}

impl<F: Real> Moment<F> {
    /// Of the two numbers of [`parts`](Self::parts): for constants that were computed before.
    #[must_use]
    pub const fn new(cos: F, sin: F) -> Self {
        Self { cos, sin }
    }

    /// The sum of v_j cos(m_j/2), and that of v_j sin(m_j/2).
    #[must_use]
    pub const fn parts(&self) -> (F, F) {
        (self.cos, self.sin)
    }

    /// Of the sums over the cells before and behind cell i.
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

/// Fills the moments of the solution `v`.
///
/// # Errors
/// [`CircleError::Length`]: `v` or `out` has another length than the number of cells.
pub fn moments<F: Real>(
    cells: &Cells<'_, F>,
    v: &[F],
    out: &mut [Moment<F>],
) -> Result<(), CircleError> {
    for found in [v.len(), out.len()] {
        if found != cells.len() {
            return Err(CircleError::Length {
                expected: cells.len(),
                found,
            });
        }
    }
    let mut after = Sum::default();
    for (&v, middle) in v.iter().zip(middles(cells)) {
        after.add(middle, v);
    }
    let mut before = Sum::default();
    for ((out, &v), middle) in out.iter_mut().zip(v).zip(middles(cells)) {
        after.add(middle, -v);
        *out = Moment::between(&before, &after);
        before.add(middle, v);
    }
    Ok(())
}

/// The neighbour equation with all pairs pointwise: h = k, and G = v − T_K v in closed form. Its
/// preconditioned estimate differs from the plain one in the source only.
///
/// The generic [`Piecewise`](fredholm_core::galerkin::Piecewise) with all pairs pointwise is the
/// same equation, at the price of n integrals for every value of G.
#[derive(Clone, Copy, Debug)]
pub struct Residual<'a, 'b, F, E> {
    circle: &'a Circle<'b, F, E>,
    solution: &'a [F],
    moments: &'a [Moment<F>],
}

impl<'a, 'b, F: Real, E: Emission<F>> Residual<'a, 'b, F, E> {
    /// Of the solution v and its [`moments`].
    ///
    /// # Errors
    /// [`CircleError::Length`].
    pub fn new(
        circle: &'a Circle<'b, F, E>,
        solution: &'a [F],
        moments: &'a [Moment<F>],
    ) -> Result<Self, CircleError> {
        let expected = circle.table().len();
        for found in [solution.len(), moments.len()] {
            if found != expected {
                return Err(CircleError::Length { expected, found });
            }
        }
        Ok(Self {
            circle,
            solution,
            moments,
        })
    }

    /// (T_K v)(x) = ρ_i [sin A Σ_{j≠i} v_j |sin((m_j − s)/2)| + v_i (1 − cos A cos((m_i − s)/2))].
    #[inline]
    pub fn reflected(&self, x: &Located<Point<F>>) -> F {
        let Some(moment) = self.moments.get(x.cell) else {
            return F::NAN;
        };
        let others = self.circle.form_factor_scale() * moment.turn_from(&x.point);
        let own = self.value(x) * self.circle.own_cell(&x.point, x.cell);
        self.circle.reflectance(x.cell) * (others + own)
    }
}

impl<F: Real, E> StateSpace for Residual<'_, '_, F, E> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real, E: Emission<F>> Neighbour for Residual<'_, '_, F, E> {
    #[inline]
    fn locate(&self, x: Point<F>) -> Located<Point<F>> {
        Located {
            point: x,
            cell: x.cell(),
        }
    }
    #[inline]
    fn kernel(&self, _: &Located<Point<F>>, _: &Located<Point<F>>, k: F) -> F {
        k
    }
    #[inline]
    fn source(&self, x: &Located<Point<F>>) -> F {
        self.value(x) - self.reflected(x)
    }
    #[inline]
    fn value(&self, x: &Located<Point<F>>) -> F {
        self.solution.get(x.cell).copied().unwrap_or(F::NAN)
    }
}
