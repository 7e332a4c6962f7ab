//! Galerkin coefficients of a product kernel.

use alloc::vec::Vec;
use fredholm_core::array::Each;

use fredholm_core::Real;
use fredholm_core::galerkin::{Coefficients, GalerkinError, GalerkinMatrix, buffer, rounded};

use crate::factors::Axes;
use crate::functions::{CellFunctions, Functions, values_at};
use crate::mesh::Mesh;
use crate::solution::radius_of;
use crate::table::add;
use crate::{Cube, CubeError, FactorTables, KernelFactors, Product, Rule, ScalarField};

/// The coefficients K'_ij = Π_a K'_a(i_a, j_a) of a product kernel, from one m × m table for every
/// axis; with functions of degree p on a cell, from one of m (p + 1) rows: see [`FactorTables`].
///
/// They are those that the same rule gives for the product, up to rounding. Set-up costs D m² g²
/// evaluations of a factor and K'v costs D m n operations, D m n (p + 1)^(D+1) at degree p, so that n may be
/// far larger than a dense table would allow.
///
/// The number of functions is that of the cube from which they come, known at run time; walks with another are
/// refused.
#[derive(Clone, Debug)]
pub struct ProductTables<F, const D: usize> {
    mesh: Mesh<D>,
    functions: CellFunctions<D>,
    /// The entries of axis 0 row by row, then those of axis 1, and so on.
    entries: Vec<F>,
}

impl<const D: usize> ProductTables<f64, D> {
    /// The tables of a cube's kernel: 8 D (m (p + 1))² bytes.
    ///
    /// # Errors
    /// [`CubeError::Memory`], [`CubeError::Kernel`] where a factor is not finite.
    pub fn new<T, S, const B: usize>(
        cube: &Cube<f64, D, Product<T>, S, B>,
        rule: Rule,
    ) -> Result<Self, CubeError>
    where
        T: KernelFactors<f64>,
        S: ScalarField<f64, D>,
    {
        let factors = &cube.integral_kernel().0;
        Self::of_factors(factors, cube.mesh(), Functions::<D, B>::ALL, rule)
    }

    pub(crate) fn of_factors(
        factors: &dyn KernelFactors<f64>,
        mesh: Mesh<D>,
        functions: CellFunctions<D>,
        rule: Rule,
    ) -> Result<Self, CubeError> {
        let m = mesh.per_axis() as usize;
        let width = m.checked_mul(functions.per_axis());
        let length = width.and_then(|w| w.checked_mul(w)?.checked_mul(D));
        let mut entries = buffer(length.ok_or(CubeError::Memory { bytes: None })?)?;
        let per_axis = functions.per_axis();
        let width = m * per_axis;
        let mut block = FactorBlock::new(per_axis)?;
        for (axis, table) in entries.chunks_exact_mut(width * width).enumerate() {
            for (row, rows) in table.chunks_exact_mut(per_axis * width).enumerate() {
                for column in 0..m {
                    let pair = [row, column].each(|place| [place as u32]);
                    let factor = |x, y| factors.factor(axis, x, y);
                    block.integrate(pair, mesh.per_axis(), rule, &factor);
                    let out = rows
                        .chunks_exact_mut(width)
                        .flat_map(|row| row.iter_mut().skip(column * per_axis).take(per_axis));
                    for (out, k) in out.zip(&block.sums) {
                        *out = k / f64::from(mesh.per_axis());
                        if !out.is_finite() {
                            return Err(CubeError::Kernel { row, column });
                        }
                    }
                }
            }
        }
        Ok(Self {
            mesh,
            functions,
            entries,
        })
    }

    /// The tables of a cube's kernel, of [`entries`](Self::entries) that were computed before.
    ///
    /// # Errors
    /// [`CubeError::Length`]: they are not D (m (p + 1))².
    ///
    /// ```
    /// use fredholm_core::galerkin::GalerkinMatrix;
    /// use fredholm_cube::{Cube, Product, ProductTables, Rule};
    ///
    /// let factor = |_: usize, x: f64, y: f64| 0.5 + 0.1 * x * y;
    /// let cube = Cube::<f64, 2, _, _>::new(Product(factor), |_: &[f64; 2]| 1.0, 3, 0.2)?;
    /// let tables = ProductTables::new(&cube, Rule::new(2)?)?;
    /// let again = ProductTables::from_entries(&cube, tables.entries().to_vec())?;
    /// assert_eq!(again.mean(1, 5), tables.mean(1, 5));
    /// # Ok::<(), fredholm_cube::CubeError>(())
    /// ```
    pub fn from_entries<K, S, const B: usize>(
        cube: &Cube<f64, D, K, S, B>,
        entries: Vec<f64>,
    ) -> Result<Self, CubeError> {
        Self::of_entries(cube.mesh(), CellFunctions::new::<B>(), entries)
    }

    pub(crate) fn of_entries(
        mesh: Mesh<D>,
        functions: CellFunctions<D>,
        entries: Vec<f64>,
    ) -> Result<Self, CubeError> {
        let width = (mesh.per_axis() as usize).saturating_mul(functions.per_axis());
        let expected = width.saturating_mul(width).saturating_mul(D);
        let found = entries.len();
        if expected != found {
            return Err(CubeError::Length { expected, found });
        }
        Ok(Self {
            mesh,
            functions,
            entries,
        })
    }

    /// The tables in the walk's scalar.
    ///
    /// # Errors
    /// [`CubeError::Memory`].
    pub fn rounded<F: Real>(&self) -> Result<ProductTables<F, D>, CubeError> {
        Ok(ProductTables {
            mesh: self.mesh,
            functions: self.functions,
            entries: rounded(&self.entries)?,
        })
    }

    /// The [`absolute_radius`](crate::absolute_radius) of the means K'_(i0)(j0), for any number of cells:
    /// that of a product is the product of those of the factors.
    ///
    /// # Errors
    /// [`CubeError::Memory`].
    pub fn absolute_radius(&self) -> Result<f64, CubeError> {
        let (axes, functions) = (self.axes(), self.functions.per_axis());
        self.radius_by_axes(&|axis, i, out| {
            let row = axes.row(axis, i * functions).iter().step_by(functions);
            for (out, k) in out.iter_mut().zip(row) {
                *out = k.abs();
            }
        })
    }

    /// The [`Cube::neighbour_second_moment_radius`], for any number of cells, and a little more
    /// with functions of degree p > 0 in several dimensions, which leave out products of more than
    /// the degree p in all.
    ///
    /// # Errors
    /// [`CubeError::Memory`].
    pub fn neighbour_second_moment_radius(&self, absorption: f64) -> Result<f64, CubeError> {
        let (axes, functions) = (self.axes(), self.functions.per_axis());
        let radius = self.radius_by_axes(&|axis, i, out| {
            out.fill(0.0);
            for a in 0..functions {
                let row = axes.row(axis, i * functions + a);
                for (out, block) in out.iter_mut().zip(row.chunks_exact(functions)) {
                    *out += block.iter().map(|k| k * k).sum::<f64>();
                }
            }
        })?;
        Ok(radius * self.mesh.cells() as f64 / (1.0 - absorption))
    }

    /// The product of the spectral radii of one m × m matrix an axis, whose rows `row` fills.
    fn radius_by_axes(&self, row: &dyn Fn(usize, usize, &mut [f64])) -> Result<f64, CubeError> {
        let m = self.mesh.per_axis() as usize;
        let mut entries = buffer(m)?;
        let mut radius = 1.0;
        for axis in 0..D {
            radius *= radius_of(m, &mut |w, out| {
                for (i, out) in out.iter_mut().enumerate() {
                    row(axis, i, &mut entries);
                    *out = entries.iter().zip(w).map(|(k, w)| k * w).sum();
                }
            })?;
        }
        Ok(radius)
    }
}

/// A block K'_a(i_a ·, j_a ·) of a factor, times the number of cells an axis.
struct FactorBlock {
    /// Row by row.
    sums: Vec<f64>,
    inner: Vec<f64>,
    psi: Vec<f64>,
}

impl FactorBlock {
    /// A zero matrix with this number of rows and columns.
    fn new(per_axis: usize) -> Result<Self, CubeError> {
        Ok(Self {
            sums: buffer(per_axis * per_axis)?,
            inner: buffer(per_axis)?,
            psi: buffer(per_axis)?,
        })
    }

    fn integrate(
        &mut self,
        [from, to]: [[u32; 1]; 2],
        per_axis: u32,
        rule: Rule,
        factor: &dyn Fn(f64, f64) -> f64,
    ) {
        let degree = self.psi.len().saturating_sub(1);
        self.sums.fill(0.0);
        for x in rule.in_cell(from, per_axis) {
            self.inner.fill(0.0);
            for y in rule.in_cell(to, per_axis) {
                let k = y.weight * factor(x.point[0], y.point[0]);
                values_at(y.local, degree, &mut self.psi);
                add(&mut self.inner, k, &self.psi);
            }
            values_at(x.local, degree, &mut self.psi);
            let rows = self.sums.chunks_exact_mut(self.psi.len());
            for (row, psi) in rows.zip(&self.psi) {
                add(row, x.weight * psi, &self.inner);
            }
        }
    }
}

impl<F: Real, const D: usize> ProductTables<F, D> {
    /// The tables: that of axis 0 row by row, then that of axis 1, and so on.
    #[must_use]
    pub fn entries(&self) -> &[F] {
        &self.entries
    }

    /// These coefficients, borrowed. Their provided methods need no memory.
    #[inline]
    fn axes(&self) -> Axes<'_, F, D> {
        Axes::new(self.mesh, self.functions, &self.entries)
    }

    /// Multiplies numbers for all places of all axes by the tables, axis by axis in place: of every table
    /// the rows and columns whose numbers are multiples of `step`, their entries changed by `entry`.
    /// `fibre` has room for those of an axis.
    fn multiply(&self, out: &mut [F], fibre: &mut [F], step: usize, entry: fn(F) -> F) {
        let axes = self.axes();
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
                        let row = axes.row(axis, place * step).iter().step_by(step);
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
        let (mesh, functions) = (self.mesh, self.functions);
        let width = self.axes().width();
        let number = move |places: [usize; D]| {
            let along = places.iter();
            along.fold(0, |number, place| number * width + place)
        };
        (0..mesh.cells()).flat_map(move |i| {
            let places = mesh.places(i);
            let first = number(places.each(|place| place as usize * functions.per_axis()));
            let degrees = functions.degrees.iter();
            degrees.map(move |degrees| first + number(degrees.each(usize::from)))
        })
    }

    /// out = K'v, unless there is no memory for it.
    fn apply_by_axes(&self, v: &[F], out: &mut [F]) -> Result<(), GalerkinError> {
        let width = self.axes().width();
        let length = (0..D).try_fold(1_usize, |length, _| length.checked_mul(width));
        let mut tensor = buffer(length.ok_or(GalerkinError::Memory { bytes: None })?)?;
        let mut fibre = buffer(width)?;
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

impl<F: Real, const D: usize, const B: usize> Coefficients<B> for ProductTables<F, D> {
    #[inline]
    fn left_times_block(&self, i: usize, j: usize, left: &[F; B]) -> [F; B] {
        let factors: FactorTables<'_, F, D, B> = FactorTables::of_axes(self.axes());
        factors.left_times_block(i, j, left)
    }
}

impl<F: Real, const D: usize> GalerkinMatrix for ProductTables<F, D> {
    type Scalar = F;

    fn cells(&self) -> usize {
        self.mesh.cells()
    }

    fn functions(&self) -> usize {
        self.functions.count()
    }

    fn entry(&self, row: [usize; 2], column: [usize; 2]) -> F {
        self.axes().entry(row, column)
    }

    /// O(D m): the row sums of the factors, multiplied.
    fn row_sum(&self, i: usize) -> F {
        self.axes().row_sum(i)
    }

    fn rows_times(&self, i: usize, v: &[F], out: &mut [F]) {
        self.axes().rows_times(i, v, out);
    }

    /// O(D m n (p + 1)^(D+1)). Allocates n (p + 1)^D numbers; where there is no memory for them, O(n² B²).
    fn apply(&self, v: &[F], out: &mut [F]) {
        let unknowns = self.cells().checked_mul(self.functions.count());
        let fits = Some(v.len()) == unknowns && v.len() == out.len();
        if !fits || self.apply_by_axes(v, out).is_err() {
            self.axes().apply(v, out);
        }
    }

    /// O(D m n): the absolute value of a product is that of the factors. Allocates m numbers; where there
    /// is no memory for them, O(n²).
    fn apply_absolute(&self, w: &[F], out: &mut [F]) {
        match buffer(self.mesh.per_axis() as usize) {
            Ok(mut fibre) if w.len() == self.cells() && w.len() == out.len() => {
                out.copy_from_slice(w);
                self.multiply(out, &mut fibre, self.functions.per_axis(), Real::abs);
            }
            _ => self.axes().apply_absolute(w, out),
        }
    }

    /// Applies K' as [`apply`](Self::apply) does: a sweep of Jacobi's iteration, which needs all of K'v at once and
    /// converges where the spectral radius of |K'| is below 1. Allocates n·B numbers besides; where
    /// there is no memory for them, a Gauss–Seidel sweep in O(n² B²).
    fn sweep(&self, source: &[F], v: &mut [F], scratch: &mut [F]) -> F {
        let Ok(mut product) = buffer(v.len()) else {
            return self.axes().sweep(source, v, scratch);
        };
        self.apply(v, &mut product);
        let (axes, functions) = (self.axes(), self.functions.count());
        let mut largest = F::zero();
        let known = product
            .chunks_exact(functions)
            .zip(source.chunks_exact(functions));
        for (i, (v, (product, source))) in v.chunks_exact_mut(functions).zip(known).enumerate() {
            let known = product.iter().zip(source).zip(axes.diagonal(i));
            for (v, ((&product, &source), own)) in v.iter_mut().zip(known) {
                let residual = source + product - *v;
                // Written so that NaN stays.
                if !(residual.abs() <= largest) && !largest.is_nan() {
                    largest = residual.abs();
                }
                *v += residual / (F::one() - own);
            }
        }
        largest
    }
}
