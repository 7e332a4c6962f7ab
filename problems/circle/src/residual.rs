//! All pairs pointwise: the neighbour source in closed form, in O(1) at any n.

use fredholm_core::array::Each;
use fredholm_core::galerkin::Basis;
use fredholm_core::{Located, Neighbour, Real, StateSpace, Uniforms};

use crate::cells::{Cells, Direction};
use crate::{CircleError, Point};

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
    /// Puts together the two numbers of [`parts`](Self::parts): for constants that were computed before.
    #[must_use]
    pub const fn new(cos: F, sin: F) -> Self {
        Self { cos, sin }
    }

    /// The sum of v_j cos(m_j/2), and that of v_j sin(m_j/2).
    #[must_use]
    pub const fn parts(&self) -> (F, F) {
        (self.cos, self.sin)
    }

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

/// An equation for which G = v − T_K v has a closed form: on the circle, of every degree.
pub trait ClosedForm<F: Real, const B: usize = 1>:
    Basis<B> + StateSpace<Scalar = F, Point = Point<F>>
{
    /// The cells.
    fn table(&self) -> Cells<'_, F>;

    /// ρ of a cell.
    fn reflectance(&self, cell: usize) -> F;

    /// What a cell with these B unknowns sends, as real and imaginary part of a multiple of exp(i m_j/2).
    fn amplitude(&self, v: &[F]) -> [F; 2];

    /// What the sums of amplitudes are multiplied by.
    fn scale(&self) -> F;

    /// ψ_0(x) … ψ_(B−1)(x), and ∫ |sin((t − s)/2)| ψ_b(t)/4 dt over the cell of x for all b.
    fn local(&self, x: &Located<Point<F>>) -> [[F; B]; 2];
}

/// Adds what a cell sends.
fn add<F: Real>(sum: &mut Sum<F>, middle: &Direction<F>, [re, im]: [F; 2]) {
    sum.add(middle, re);
    sum.add(&middle.turned(), im);
}

/// Fills the moments of the solution `v`.
///
/// # Errors
/// [`CircleError::Length`] unless `v` has n·B entries and `out` n.
pub fn moments<F: Real, P: ClosedForm<F, B>, const B: usize>(
    problem: &P,
    v: &[F],
    out: &mut [Moment<F>],
) -> Result<(), CircleError> {
    let cells = problem.table();
    check_lengths::<F, B>(cells.len(), v, out)?;
    let mut after = Sum::default();
    for (v, cell) in v.chunks_exact(B).zip(cells.iter()) {
        add(&mut after, &cell.middle, problem.amplitude(v));
    }
    let mut before = Sum::default();
    for ((out, v), cell) in out.iter_mut().zip(v.chunks_exact(B)).zip(cells.iter()) {
        let amplitude = problem.amplitude(v);
        add(&mut after, &cell.middle, amplitude.each(|part| -part));
        *out = Moment::between(&before, &after);
        add(&mut before, &cell.middle, amplitude);
    }
    Ok(())
}

fn check_lengths<F, const B: usize>(
    cells: usize,
    v: &[F],
    moments: &[Moment<F>],
) -> Result<(), CircleError> {
    for (expected, found) in [(cells * B, v.len()), (cells, moments.len())] {
        if expected != found {
            return Err(CircleError::Length { expected, found });
        }
    }
    Ok(())
}

/// The neighbour equation with all pairs pointwise: h = k, and G = v − T_K v in closed form, O(B) at any n. Its
/// preconditioned estimate differs from the plain one in the source only.
///
/// The generic [`Piecewise`](fredholm_core::galerkin::Piecewise) with all pairs pointwise is the
/// same equation, at the price of n integrals for every value of G.
#[derive(Clone, Copy, Debug)]
pub struct Residual<'a, F, P, const B: usize = 1> {
    problem: &'a P,
    solution: &'a [F],
    moments: &'a [Moment<F>],
}

impl<'a, F: Real, P: ClosedForm<F, B>, const B: usize> Residual<'a, F, P, B> {
    /// The residual of the solution v with its [`moments`], on a [`Circle`](crate::Circle) or with
    /// [`PolynomialCircle`](crate::PolynomialCircle).
    ///
    /// # Errors
    /// [`CircleError::Length`].
    pub fn new(
        problem: &'a P,
        solution: &'a [F],
        moments: &'a [Moment<F>],
    ) -> Result<Self, CircleError> {
        check_lengths::<F, B>(problem.table().len(), solution, moments)?;
        Ok(Self {
            problem,
            solution,
            moments,
        })
    }

    /// v_i0 … v_i(B−1) of a cell.
    #[inline]
    fn own(&self, cell: usize) -> [F; B] {
        let own = self.solution.get(cell * B..).and_then(<[F]>::first_chunk);
        own.copied().unwrap_or([F::NAN; B])
    }

    /// (T_K v)(x): of piecewise constants ρ_i [sin A Σ_{j≠i} v_j |sin((m_j − s)/2)| + v_i (1 − cos A cos((m_i − s)/2))].
    #[inline]
    pub fn reflected(&self, x: &Located<Point<F>>) -> F {
        let [_, integrals] = self.problem.local(x);
        self.reflected_with(x, &integrals)
    }

    #[inline]
    fn reflected_with(&self, x: &Located<Point<F>>, integrals: &[F; B]) -> F {
        let Some(moment) = self.moments.get(x.cell) else {
            return F::NAN;
        };
        let others = self.problem.scale() * moment.turn_from(&x.point);
        let own = dot(&self.own(x.cell), integrals);
        self.problem.reflectance(x.cell) * (others + own)
    }
}

/// Σ_b a_b b_b.
#[inline]
fn dot<F: Real, const B: usize>(a: &[F; B], b: &[F; B]) -> F {
    let mut products = a.iter().zip(b).map(|(&a, &b)| a * b);
    let first = products.next().unwrap_or(F::NAN);
    products.fold(first, |sum, product| sum + product)
}

impl<F: Real, P, const B: usize> StateSpace for Residual<'_, F, P, B> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real, P: ClosedForm<F, B>, const B: usize> Neighbour for Residual<'_, F, P, B> {
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
    fn source(&self, x: &Located<Point<F>>, _: &mut dyn Uniforms<F>) -> F {
        let [psi, integrals] = self.problem.local(x);
        dot(&self.own(x.cell), &psi) - self.reflected_with(x, &integrals)
    }
    #[inline]
    fn value(&self, x: &Located<Point<F>>) -> F {
        dot(&self.own(x.cell), &self.problem.basis(x))
    }
}
