//! Galerkin coefficients of a product kernel.

#[cfg(feature = "alloc")]
use alloc::vec::Vec;
use core::ops::Deref;

use fredholm_core::Real;
use fredholm_core::array::{Each, from_fn};
use fredholm_core::galerkin::{Coefficients, GalerkinMatrix, functions};
#[cfg(feature = "alloc")]
use fredholm_core::galerkin::{GalerkinError, buffer, rounded};

use crate::CubeError;
use crate::functions::{Functions, PER_AXIS, degrees_of};
use crate::mesh::Mesh;
use crate::product::product;

/// The coefficients K'_ij = Π_a K'_a(i_a, j_a) of a product kernel, from one m × m table for every
/// axis, wherever they lie: in flash, on a stack, or in a `Vec`, as
/// [`CubeRule::product_tables`](crate::CubeRule::product_tables) makes them.
///
/// With functions of degree p on a cell, K'_(iα)(jβ) = Π_a K'_a(i_a α_a, j_a β_a) in the degrees α_a and β_a
/// along the axes, and a table has m (p + 1) rows: those of the p + 1 polynomials of the first place, then
/// those of the next.
///
/// Set-up costs D m² g² evaluations of a factor and K'v costs D m n operations, D m n (p + 1)^(D+1) at degree p, so that n may
/// be far larger than a dense table would allow. Without the feature `alloc` K'v is O(n² B²).
///
/// The degree is known at run time; walks with another number of functions are refused.
///
/// ```
/// use fredholm_core::galerkin::GalerkinMatrix;
/// use fredholm_cube::ProductTables;
///
/// // Two axes of two cells.
/// let entries = [0.1, 0.2, 0.3, 0.4, 1.0, 0.5, 0.5, 1.0];
/// let tables = ProductTables::<&[f64], 2>::new(2, 0, &entries)?;
/// // From cell (1, 0) to cell (0, 1).
/// assert_eq!(tables.mean(2, 1), 0.3 * 0.5);
/// # Ok::<(), fredholm_cube::CubeError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ProductTables<E, const D: usize> {
    mesh: Mesh<D>,
    degree: usize,
    /// m (p + 1), the rows of a table.
    width: usize,
    entries: E,
}

impl<F: Real, E: Deref<Target = [F]>, const D: usize> ProductTables<E, D> {
    /// The factors of functions of degree p on m = `per_axis` cells an axis: D tables of (m (p + 1))² numbers, that of axis
    /// 0 row by row, then that of axis 1, and so on.
    ///
    /// # Errors
    /// [`CubeError::Cells`], [`CubeError::Points`], [`CubeError::Length`].
    pub fn new(per_axis: usize, degree: usize, entries: E) -> Result<Self, CubeError> {
        Self::on_mesh(Mesh::new(per_axis)?, degree, entries)
    }

    pub(crate) fn on_mesh(mesh: Mesh<D>, degree: usize, entries: E) -> Result<Self, CubeError> {
        if degree >= PER_AXIS {
            return Err(CubeError::Points);
        }
        let width = (mesh.per_axis() as usize).saturating_mul(degree + 1);
        let expected = width.saturating_mul(width).saturating_mul(D);
        CubeError::check_length(expected, entries.len())?;
        Ok(Self {
            mesh,
            degree,
            width,
            entries,
        })
    }

    /// The tables: that of axis 0 row by row, then that of axis 1, and so on.
    #[must_use]
    pub fn entries(&self) -> &[F] {
        &self.entries
    }

    /// Row `row` of the table of `axis`; empty where there is none.
    #[inline]
    fn row(&self, axis: usize, row: usize) -> &[F] {
        let start = (axis * self.width + row) * self.width;
        self.entries.get(start..start + self.width).unwrap_or(&[])
    }

    #[inline]
    fn number(&self, axis: usize, row: usize, column: usize) -> F {
        let at = (axis * self.width + row) * self.width + column;
        self.entries.get(at).copied().unwrap_or(F::NAN)
    }

    /// Where the functions of the places of a cell with these degrees stand in the tables.
    #[inline]
    fn rows(&self, i: usize, degrees: &[u8; D]) -> [usize; D] {
        let places = self.mesh.places(i);
        from_fn(|a| places[a] as usize * (self.degree + 1) + degrees[a] as usize)
    }
}

impl<F: Real, E: Deref<Target = [F]>, const D: usize, const B: usize> Coefficients<B>
    for ProductTables<E, D>
{
    #[inline]
    fn left_times_block(&self, i: usize, j: usize, left: &[F; B]) -> [F; B] {
        let places = [self.mesh.places(i), self.mesh.places(j)];
        let per_axis = Functions::<D, B>::PER_AXIS;
        let [from, to] = places.each(|places| places.each(|place| place as usize * per_axis));
        if const { B == 1 } {
            let mean = product(from_fn::<_, D>(|a| self.number(a, from[a], to[a])));
            return left.each(|left| left * mean);
        }
        // What the tables have of these places, in arrays of a size that is a constant.
        let mut blocks = [[[F::NAN; PER_AXIS]; PER_AXIS]; D];
        for (axis, block) in blocks.iter_mut().enumerate() {
            for (degree, row) in block.iter_mut().enumerate().take(per_axis) {
                let numbers = self.row(axis, from[axis] + degree).iter().skip(to[axis]);
                for (entry, &number) in row.iter_mut().take(per_axis).zip(numbers) {
                    *entry = number;
                }
            }
        }
        let mut out = [F::zero(); B];
        let all = &Functions::<D, B>::DEGREES;
        for (&left, degrees) in left.iter().zip(all) {
            let rows = from_fn::<_, D>(|a| &blocks[a][usize::from(degrees[a]) % PER_AXIS]);
            for (out, degrees) in out.iter_mut().zip(all) {
                let at = |a: usize| rows[a][usize::from(degrees[a]) % PER_AXIS];
                *out += (0..D).fold(left, |product, a| product * at(a));
            }
        }
        out
    }
}

impl<F: Real, E: Deref<Target = [F]>, const D: usize> GalerkinMatrix for ProductTables<E, D> {
    type Scalar = F;

    fn cells(&self) -> usize {
        self.mesh.cells()
    }

    fn functions(&self) -> usize {
        functions(D, self.degree)
    }

    fn entry(&self, [i, a]: [usize; 2], [j, b]: [usize; 2]) -> F {
        if a.max(b) >= self.functions() {
            return F::NAN;
        }
        let row = self.rows(i, &degrees_of(a, self.degree));
        let column = self.rows(j, &degrees_of(b, self.degree));
        product(from_fn::<_, D>(|axis| {
            self.number(axis, row[axis], column[axis])
        }))
    }

    /// O(D m): the row sums of the factors, multiplied.
    fn row_sum(&self, i: usize) -> F {
        let rows = self.rows(i, &[0; D]);
        product(from_fn::<_, D>(|a| {
            let means = self.row(a, rows[a]).iter().step_by(self.degree + 1);
            means.fold(F::zero(), |sum, k| sum + k.abs())
        }))
    }

    /// O(D m n (p + 1)^(D+1)). Allocates n (p + 1)^D numbers; where there is no memory for them, O(n² B²).
    #[cfg(feature = "alloc")]
    fn apply(&self, v: &[F], out: &mut [F]) {
        let unknowns = self.cells().checked_mul(self.functions());
        let fits = Some(v.len()) == unknowns && v.len() == out.len();
        if !fits || self.apply_by_axes(v, out).is_err() {
            for (i, out) in out.chunks_exact_mut(self.functions()).enumerate() {
                self.rows_times(i, v, out);
            }
        }
    }

    /// O(D m n): the absolute value of a product is that of the factors. Allocates m numbers.
    #[cfg(feature = "alloc")]
    fn apply_absolute(&self, w: &[F], out: &mut [F]) {
        match buffer(self.mesh.per_axis() as usize) {
            Ok(mut fibre) if w.len() == self.cells() && w.len() == out.len() => {
                out.copy_from_slice(w);
                self.multiply(out, &mut fibre, self.degree + 1, Real::abs);
            }
            _ => out.fill(F::NAN),
        }
    }

    /// Applies K' as [`apply`](Self::apply) does: a sweep of Jacobi's iteration, which needs all of K'v at once and
    /// converges where the spectral radius of |K'| is below 1. Allocates n·B numbers besides.
    #[cfg(feature = "alloc")]
    fn sweep(&self, source: &[F], v: &mut [F], _: &mut [F]) -> F {
        let Ok(mut product) = buffer(v.len()) else {
            return F::NAN;
        };
        self.apply(v, &mut product);
        let functions = self.functions();
        let mut largest = F::zero();
        let rows = product.iter().zip(source).zip(v).enumerate();
        for (row, ((&product, &source), v)) in rows {
            let residual = source + product - *v;
            // Written so that NaN stays.
            if !(residual.abs() <= largest) && !largest.is_nan() {
                largest = residual.abs();
            }
            let own = [row / functions, row % functions];
            *v += residual / (F::one() - self.entry(own, own));
        }
        largest
    }
}

#[cfg(feature = "alloc")]
impl<E: Deref<Target = [f64]>, const D: usize> ProductTables<E, D> {
    /// The tables in the walk's scalar.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`] as [`CubeError::Galerkin`].
    pub fn rounded<F: Real>(&self) -> Result<ProductTables<Vec<F>, D>, CubeError> {
        Ok(ProductTables {
            mesh: self.mesh,
            degree: self.degree,
            width: self.width,
            entries: rounded(&self.entries)?,
        })
    }
}

#[cfg(feature = "alloc")]
impl<F: Real, E: Deref<Target = [F]>, const D: usize> ProductTables<E, D> {
    /// Multiplies numbers for all places of all axes by the tables, axis by axis in place: of every table
    /// the rows and columns whose numbers are multiples of `step`, their entries changed by `entry`.
    /// `fibre` has room for those of an axis.
    fn multiply(&self, out: &mut [F], fibre: &mut [F], step: usize, entry: fn(F) -> F) {
        let width = fibre.len();
        let mut stride = out.len();
        for axis in 0..D {
            let block = stride;
            stride /= width;
            for block in out.chunks_exact_mut(block) {
                for offset in 0..stride {
                    let along = || (offset..).step_by(stride).take(width);
                    for (to, i) in fibre.iter_mut().zip(along()) {
                        *to = block.get(i).copied().unwrap_or(F::NAN);
                    }
                    for (place, i) in along().enumerate() {
                        let row = self.row(axis, place * step).iter().step_by(step);
                        let sum = row
                            .zip(&*fibre)
                            .fold(F::zero(), |s, (&k, &v)| s + entry(k) * v);
                        if let Some(out) = block.get_mut(i) {
                            *out = sum;
                        }
                    }
                }
            }
        }
    }

    /// The numbers of the unknowns among those for all places of all axes, which have all products of
    /// degree p along every axis: cell by cell.
    fn places(&self) -> impl Iterator<Item = usize> {
        let functions = self.functions();
        (0..self.cells() * functions).map(move |unknown| {
            let degrees = degrees_of(unknown % functions, self.degree);
            let rows = self.rows(unknown / functions, &degrees);
            rows.iter().fold(0, |number, row| number * self.width + row)
        })
    }

    /// out = K'v, unless there is no memory for it.
    fn apply_by_axes(&self, v: &[F], out: &mut [F]) -> Result<(), GalerkinError> {
        let length = (0..D).try_fold(1_usize, |length, _| length.checked_mul(self.width));
        let mut tensor = buffer(length.ok_or(GalerkinError::Memory { bytes: None })?)?;
        let mut fibre = buffer(self.width)?;
        for (at, &v) in self.places().zip(v) {
            if let Some(entry) = tensor.get_mut(at) {
                *entry = v;
            }
        }
        self.multiply(&mut tensor, &mut fibre, 1, |k| k);
        for (at, out) in self.places().zip(out) {
            *out = tensor.get(at).copied().unwrap_or(F::NAN);
        }
        Ok(())
    }
}
