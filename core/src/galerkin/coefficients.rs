//! Galerkin coefficients as capabilities: a matrix that is solved, and rows that a walk contracts.

use crate::array::{Each, from_fn};
use num_traits::{one, zero};

use super::small::{self, dot};
use crate::Real;

/// The coefficients K' of the Galerkin system v − K'v = F', (41), as a matrix that is solved, bounded and
/// written out. The number B of functions per cell is known at run time, and the trait is object safe, so
/// that set-up code is compiled once for all degrees.
///
/// K'_(ia)(jb) = μ(X_i)⁻¹ ∫_Xi ∫_Xj K(x,y) ψ_ia(x) ψ_jb(y) dμ(y) dμ(x), (39), or an approximation:
/// approximate coefficients cost variance, not correctness.
///
/// Vectors hold the B unknowns of cell 0, then those of cell 1, and so on.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no matrix of Galerkin coefficients",
    label = "`GalerkinMatrix` is missing",
    note = "a table of (n B)^2 numbers is `Dense::new(&table, n, B)`"
)]
pub trait GalerkinMatrix {
    /// The scalar of the coefficients.
    type Scalar: Real;

    /// The number n of cells.
    fn cells(&self) -> usize;

    /// The number B of functions per cell.
    fn functions(&self) -> usize;

    /// K'_(ia)(jb) for `row` = [i, a] and `column` = [j, b].
    fn entry(&self, row: [usize; 2], column: [usize; 2]) -> Self::Scalar;

    /// The block K'_(i·)(j·) into B² numbers: row a after row a − 1.
    fn block(&self, i: usize, j: usize, out: &mut [Self::Scalar]) {
        for (a, row) in out.chunks_exact_mut(self.functions().max(1)).enumerate() {
            for (b, entry) in row.iter_mut().enumerate() {
                *entry = self.entry([i, a], [j, b]);
            }
        }
    }

    /// K'_(i0)(j0) = μ(X_i)⁻¹ ∫_Xi ∫_Xj K(x,y) dμ(y) dμ(x): the coefficient of the piecewise constants,
    /// as ψ_i0 = 1.
    #[inline]
    fn mean(&self, i: usize, j: usize) -> Self::Scalar {
        self.entry([i, 0], [j, 0])
    }

    /// Σ_j |K'_(i0)(j0)|: the mean over X_i of ∫ |K(x,y)| dμ(y), if K keeps its sign on pairs of cells.
    fn row_sum(&self, i: usize) -> Self::Scalar {
        let sum = |sum: Self::Scalar, j| sum + self.mean(i, j).abs();
        (0..self.cells()).fold(zero(), sum)
    }

    /// The B rows of cell i times v, which has n·B entries.
    fn rows_times(&self, i: usize, v: &[Self::Scalar], out: &mut [Self::Scalar]) {
        for (a, out) in out.iter_mut().enumerate() {
            *out = zero();
            for (j, v) in v.chunks_exact(self.functions().max(1)).enumerate() {
                for (b, &v) in v.iter().enumerate() {
                    *out += self.entry([i, a], [j, b]) * v;
                }
            }
        }
    }

    /// out = K'v. Both have n·B entries.
    fn apply(&self, v: &[Self::Scalar], out: &mut [Self::Scalar]) {
        let rows = out.chunks_exact_mut(self.functions().max(1));
        for (i, out) in rows.enumerate() {
            self.rows_times(i, v, out);
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

    /// How many numbers of scratch [`sweep`](Self::sweep) needs: B² + B, for the equations of one cell.
    fn scratch(&self) -> usize {
        let functions = self.functions();
        functions.saturating_mul(functions.saturating_add(1))
    }

    /// One Gauss–Seidel sweep of (41) in place, or another step that converges to its solution. Returns the
    /// largest residual |F'_ia + (K'v)_ia − v_ia| that it met, before it mended it. `source` and `v` have n·B
    /// entries; `scratch` has at least as many as [`scratch`](Self::scratch) says, and what it holds is lost.
    fn sweep(
        &self,
        source: &[Self::Scalar],
        v: &mut [Self::Scalar],
        scratch: &mut [Self::Scalar],
    ) -> Self::Scalar {
        let functions = self.functions();
        let room = scratch
            .split_at_mut_checked(functions)
            .and_then(|(step, rest)| Some((step, rest.get_mut(..functions * functions)?)));
        let Some((step, block)) = room else {
            return Self::Scalar::NAN;
        };
        let mut largest = zero();
        for i in 0..self.cells() {
            self.rows_times(i, v, step);
            let own = i * functions..(i + 1) * functions;
            let (Some(v), Some(source)) = (v.get_mut(own.clone()), source.get(own)) else {
                return Self::Scalar::NAN;
            };
            for ((step, &right), &old) in step.iter_mut().zip(source).zip(&*v) {
                *step = right + *step - old;
                largest = max_or_nan(largest, step.abs());
            }
            self.block(i, i, block);
            subtract_from_identity(block, functions);
            small::solve_in_place(block, step);
            for (v, &step) in v.iter_mut().zip(&*step) {
                *v += step;
            }
        }
        largest
    }
}

/// I − A in place of a matrix A of `size` rows.
fn subtract_from_identity<F: Real>(matrix: &mut [F], size: usize) {
    for (a, row) in matrix.chunks_exact_mut(size.max(1)).enumerate() {
        for (b, k) in row.iter_mut().enumerate() {
            *k = if a == b { one::<F>() } else { zero() } - *k;
        }
    }
}

/// The larger of the two, NaN where either is: a residual that is not a number may not hide.
#[inline]
fn max_or_nan<F: Real>(a: F, b: F) -> F {
    if a >= b || a.is_nan() { a } else { b }
}

/// Galerkin coefficients as a step of a walk uses them: a vector times a block, whose size B is a constant.
#[diagnostic::on_unimplemented(
    message = "walks with {B} functions per cell cannot use `{Self}`",
    label = "`Coefficients<{B}>` is missing",
    note = "an empty `impl Coefficients<{B}>` beside `GalerkinMatrix` is enough; a table of (n B)^2 numbers is \
            `Dense::new(&table, n, B)`"
)]
pub trait Coefficients<const B: usize = 1>: GalerkinMatrix {
    /// Σ_a left_a K'_(ia)(jb) for every b.
    #[inline]
    fn left_times_block(&self, i: usize, j: usize, left: &[Self::Scalar; B]) -> [Self::Scalar; B] {
        from_fn(|b| {
            let column: [Self::Scalar; B] = from_fn(|a| self.entry([i, a], [j, b]));
            dot(left, &column)
        })
    }
}

/// Coefficients in f64 as walks in `F` see them, one table for both: an entry is rounded, and a vector times a
/// block is computed in f64 and rounded then.
#[derive(Debug)]
pub struct Rounded<'a, C: ?Sized, F> {
    coefficients: &'a C,
    scalar: core::marker::PhantomData<F>,
}

impl<'a, C: ?Sized, F> Rounded<'a, C, F> {
    /// These coefficients.
    #[must_use]
    pub const fn new(coefficients: &'a C) -> Self {
        Self {
            coefficients,
            scalar: core::marker::PhantomData,
        }
    }
}

impl<C: ?Sized, F> Clone for Rounded<'_, C, F> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<C: ?Sized, F> Copy for Rounded<'_, C, F> {}

impl<C: GalerkinMatrix<Scalar = f64> + ?Sized, F: Real> GalerkinMatrix for Rounded<'_, C, F> {
    type Scalar = F;

    fn cells(&self) -> usize {
        self.coefficients.cells()
    }

    fn functions(&self) -> usize {
        self.coefficients.functions()
    }

    #[inline]
    fn entry(&self, row: [usize; 2], column: [usize; 2]) -> F {
        F::from_f64(self.coefficients.entry(row, column))
    }
}

impl<C: Coefficients<B, Scalar = f64> + ?Sized, F: Real, const B: usize> Coefficients<B>
    for Rounded<'_, C, F>
{
    #[inline]
    fn left_times_block(&self, i: usize, j: usize, left: &[F; B]) -> [F; B] {
        let left = left.each(|left| left.to_f64());
        let right = self.coefficients.left_times_block(i, j, &left);
        right.each(F::from_f64)
    }
}

/// Coefficients in a table of (n·B)² numbers, row by row: entry (i·B + a)·n·B + j·B + b is
/// K'_(ia)(jb).
#[derive(Clone, Copy, Debug)]
pub struct Dense<'a, F> {
    entries: &'a [F],
    cells: usize,
    functions: usize,
    unknowns: usize,
}

impl<'a, F> Dense<'a, F> {
    /// A table for n = `cells` cells with B = `functions` functions each; `None` where the slice has another
    /// length than (n·B)², or B is 0.
    #[must_use]
    pub fn new(entries: &'a [F], cells: usize, functions: usize) -> Option<Self> {
        let unknowns = cells.checked_mul(functions)?;
        let fits = functions > 0 && unknowns.checked_mul(unknowns) == Some(entries.len());
        fits.then_some(Self {
            entries,
            cells,
            functions,
            unknowns,
        })
    }

    /// What is left of row [i, a] from column [j, 0] on, and all rows after it.
    #[inline]
    fn from(&self, [i, a]: [usize; 2], j: usize) -> Option<&'a [F]> {
        let row = (i * self.functions + a) * self.unknowns;
        self.entries.get(row + j * self.functions..)
    }
}

impl<F: Real> GalerkinMatrix for Dense<'_, F> {
    type Scalar = F;

    fn cells(&self) -> usize {
        self.cells
    }

    fn functions(&self) -> usize {
        self.functions
    }

    #[inline]
    fn entry(&self, row: [usize; 2], [j, b]: [usize; 2]) -> F {
        let entry = self.from(row, j).and_then(|rest| rest.get(b));
        entry.copied().unwrap_or(F::NAN)
    }

    fn rows_times(&self, i: usize, v: &[F], out: &mut [F]) {
        for (a, out) in out.iter_mut().enumerate() {
            let row = self.from([i, a], 0).and_then(|row| row.get(..v.len()));
            *out = row.map_or(F::NAN, |row| {
                let products = row.iter().zip(v).map(|(&k, &v)| k * v);
                products.fold(zero(), |sum: F, product| sum + product)
            });
        }
    }
}

impl<F: Real, const B: usize> Coefficients<B> for Dense<'_, F> {
    /// Row by row from the table: a block of many unknowns is never copied.
    #[inline]
    fn left_times_block(&self, i: usize, j: usize, left: &[F; B]) -> [F; B] {
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
