//! Galerkin coefficients as a capability: a closed form, a table, or anything that answers.

use num_traits::{one, zero};

use super::small::{self, dot};
use crate::Real;

/// The coefficients K' of the Galerkin system v − K'v = F', (41), with B unknowns per cell.
///
/// K'_(ia)(jb) = μ(X_i)⁻¹ ∫_Xi ∫_Xj K(x,y) ψ_ia(x) ψ_jb(y) dμ(y) dμ(x), (39), or an approximation:
/// approximate coefficients cost variance, not correctness.
///
/// Vectors hold the B unknowns of cell 0, then those of cell 1, and so on.
#[diagnostic::on_unimplemented(
    message = "`{Self}` gives no Galerkin coefficients with {B} functions per cell",
    label = "`Coefficients<{B}>` is missing",
    note = "a table of (n B)^2 numbers is `Dense::new(&table, n * B)`"
)]
pub trait Coefficients<const B: usize = 1> {
    /// The scalar of the coefficients.
    type Scalar: Real;

    /// The number n of cells.
    fn cells(&self) -> usize;

    /// The block K'_(i·)(j·): rows a, columns b.
    fn block(&self, i: usize, j: usize) -> [[Self::Scalar; B]; B];

    /// Σ_a left_a K'_(ia)(jb) for every b.
    #[inline]
    fn contract(&self, i: usize, j: usize, left: &[Self::Scalar; B]) -> [Self::Scalar; B] {
        let block = self.block(i, j);
        core::array::from_fn(|b| dot(left, &block.map(|row| row[b])))
    }

    /// K'_(i0)(j0) = μ(X_i)⁻¹ ∫_Xi ∫_Xj K(x,y) dμ(y) dμ(x): the coefficient of the piecewise constants,
    /// as ψ_i0 = 1.
    #[inline]
    fn mean(&self, i: usize, j: usize) -> Self::Scalar {
        let block = self.block(i, j);
        block
            .first()
            .and_then(|row| row.first())
            .map_or(Self::Scalar::NAN, |k| *k)
    }

    /// Σ_j |K'_(i0)(j0)|: the mean over X_i of ∫ |K(x,y)| dμ(y), if K keeps its sign on pairs of cells.
    fn row_sum(&self, i: usize) -> Self::Scalar {
        let sum = |sum: Self::Scalar, j| sum + self.mean(i, j).abs();
        (0..self.cells()).fold(zero(), sum)
    }

    /// out = K'v. Both have n·B entries.
    fn apply(&self, v: &[Self::Scalar], out: &mut [Self::Scalar]) {
        for (i, out) in out.chunks_exact_mut(B).enumerate() {
            out.copy_from_slice(&row_times(self, i, v));
        }
    }

    /// out_i = Σ_j |K'_(i0)(j0)| w_j. Both have n entries.
    fn apply_absolute(&self, w: &[Self::Scalar], out: &mut [Self::Scalar]) {
        for (i, out) in out.iter_mut().enumerate() {
            *out = zero();
            for (j, &w) in w.iter().enumerate() {
                *out += self.mean(i, j).abs() * w;
            }
        }
    }

    /// One Gauss–Seidel sweep of (41) in place, or another step that converges to its solution. Returns the largest residual
    /// |F'_ia + (K'v)_ia − v_ia| that it met, before it mended it. Both have n·B entries.
    fn sweep(&self, source: &[Self::Scalar], v: &mut [Self::Scalar]) -> Self::Scalar {
        let mut largest = zero();
        for i in 0..self.cells() {
            let old: [Self::Scalar; B] = small::block(v, i);
            let right: [Self::Scalar; B] = small::block(source, i);
            let product: [Self::Scalar; B] = row_times(self, i, v);
            let residual = core::array::from_fn(|a| right[a] + product[a] - old[a]);
            largest = residual.iter().fold(largest, |m, r| max_or_nan(m, r.abs()));
            let step = small::solve(identity_minus(self.block(i, i)), residual);
            for (v, step) in v.iter_mut().skip(i * B).zip(step) {
                *v += step;
            }
        }
        largest
    }
}

/// Row i of K' times v.
fn row_times<C: Coefficients<B> + ?Sized, const B: usize>(
    coefficients: &C,
    i: usize,
    v: &[C::Scalar],
) -> [C::Scalar; B] {
    let mut sum = [zero::<C::Scalar>(); B];
    for (j, v) in v.chunks_exact(B).enumerate() {
        for (sum, row) in sum.iter_mut().zip(coefficients.block(i, j)) {
            for (&k, &v) in row.iter().zip(v) {
                *sum += k * v;
            }
        }
    }
    sum
}

fn identity_minus<F: Real, const B: usize>(mut block: [[F; B]; B]) -> [[F; B]; B] {
    for (a, row) in block.iter_mut().enumerate() {
        for (b, k) in row.iter_mut().enumerate() {
            *k = if a == b { one::<F>() } else { zero() } - *k;
        }
    }
    block
}

/// The larger of the two, NaN where either is: a residual that is not a number may not hide.
#[inline]
fn max_or_nan<F: Real>(a: F, b: F) -> F {
    if a >= b || a.is_nan() { a } else { b }
}

/// Coefficients in f64 as walks in `F` see them, one table for both: a block is rounded entry by entry, a
/// contraction is computed in f64 and rounded then.
#[derive(Clone, Copy, Debug)]
pub struct Rounded<'a, C, F> {
    coefficients: &'a C,
    scalar: core::marker::PhantomData<F>,
}

impl<'a, C, F> Rounded<'a, C, F> {
    /// These coefficients.
    #[must_use]
    pub const fn new(coefficients: &'a C) -> Self {
        Self {
            coefficients,
            scalar: core::marker::PhantomData,
        }
    }
}

impl<C: Coefficients<B, Scalar = f64>, F: Real, const B: usize> Coefficients<B>
    for Rounded<'_, C, F>
{
    type Scalar = F;

    fn cells(&self) -> usize {
        self.coefficients.cells()
    }

    #[inline]
    fn block(&self, i: usize, j: usize) -> [[F; B]; B] {
        self.coefficients
            .block(i, j)
            .map(|row| row.map(F::from_f64))
    }

    #[inline]
    fn contract(&self, i: usize, j: usize, left: &[F; B]) -> [F; B] {
        let left = left.map(|left| left.to_f64());
        let right = self.coefficients.contract(i, j, &left);
        right.map(F::from_f64)
    }
}

/// Coefficients in a table of (n·B)² numbers, row by row: entry (i·B + a)·n·B + j·B + b is
/// K'_(ia)(jb).
#[derive(Clone, Copy, Debug)]
pub struct Dense<'a, F> {
    entries: &'a [F],
    unknowns: usize,
}

impl<'a, F> Dense<'a, F> {
    /// A table of n·B = `unknowns` rows; `None` where the slice has another length than
    /// `unknowns`².
    #[must_use]
    pub fn new(entries: &'a [F], unknowns: usize) -> Option<Self> {
        (unknowns.checked_mul(unknowns) == Some(entries.len()))
            .then_some(Self { entries, unknowns })
    }
}

impl<F: Real, const B: usize> Coefficients<B> for Dense<'_, F> {
    type Scalar = F;

    fn cells(&self) -> usize {
        self.unknowns / B
    }

    #[inline]
    fn block(&self, i: usize, j: usize) -> [[F; B]; B] {
        core::array::from_fn(|a| {
            let row = (i * B + a) * self.unknowns;
            match self.entries.get(row + j * B..) {
                Some(rest) => small::block(rest, 0),
                None => [F::NAN; B],
            }
        })
    }

    /// Row by row from the table: a block of many unknowns is never copied.
    #[inline]
    fn contract(&self, i: usize, j: usize, left: &[F; B]) -> [F; B] {
        let mut sums = [zero(); B];
        for (a, &left) in left.iter().enumerate() {
            let start = (i * B + a) * self.unknowns + j * B;
            let row: [F; B] = match self.entries.get(start..) {
                Some(rest) => small::block(rest, 0),
                None => [F::NAN; B],
            };
            for (sum, k) in sums.iter_mut().zip(row) {
                *sum = if a == 0 { left * k } else { *sum + left * k };
            }
        }
        sums
    }
}
