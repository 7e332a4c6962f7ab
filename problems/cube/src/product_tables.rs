//! Galerkin coefficients of a product kernel.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::galerkin::{Coefficients, GalerkinError, buffer, rounded};

use crate::functions::{FEW, Functions};
use crate::mesh::Mesh;
use crate::solution::radius_of;
use crate::table::add;
use crate::{Cube, CubeError, FactorTables, Function, KernelFactors, Product, Rule};

/// The coefficients K'_ij = Π_a K'_a(i_a, j_a) of a product kernel, from one m × m table for every
/// axis; with functions of degree p on a cell, from one of m (p + 1) rows: see [`FactorTables`].
///
/// They are those that the same rule gives for the product, up to rounding. Set-up costs D m² g²
/// evaluations of a factor and K'v costs D m n operations, D m n (p + 1)^(D+1) at degree p, so that n may be
/// far larger than a dense table would allow.
#[derive(Clone, Debug)]
pub struct ProductTables<F, const D: usize, const B: usize = 1> {
    mesh: Mesh<D>,
    /// Those of axis 0 row by row, then those of axis 1, and so on.
    entries: Vec<F>,
}

impl<const D: usize, const B: usize> ProductTables<f64, D, B> {
    /// The tables of a cube's kernel: 8 D (m (p + 1))² bytes.
    ///
    /// # Errors
    /// [`CubeError::Memory`], [`CubeError::Kernel`] where a factor is not finite.
    pub fn new<T, S>(cube: &Cube<f64, D, Product<T>, S, B>, rule: Rule) -> Result<Self, CubeError>
    where
        T: KernelFactors<f64>,
        S: Function<f64, D>,
    {
        let mesh = cube.mesh();
        let (m, functions) = (mesh.per_axis() as usize, Functions::<D, B>::PER_AXIS);
        let width = m.checked_mul(functions);
        let length = width.and_then(|w| w.checked_mul(w)?.checked_mul(D));
        let mut entries = buffer(length.ok_or(CubeError::Memory { bytes: None })?)?;
        let width = m * functions;
        let factors = &cube.integral_kernel().0;
        for (axis, table) in entries.chunks_exact_mut(width * width).enumerate() {
            for (row, rows) in table.chunks_exact_mut(functions * width).enumerate() {
                for column in 0..m {
                    let pair = [row, column].map(|place| [place as u32]);
                    let factor = |x, y| factors.factor(axis, x, y);
                    let out = rows
                        .chunks_exact_mut(width)
                        .flat_map(|row| row.iter_mut().skip(column * functions).take(functions));
                    let finite = if const { Functions::<D, B>::DEGREE < FEW } {
                        factor_block::<FEW>(pair, (mesh.per_axis(), functions), rule, factor, out)
                    } else {
                        factor_block::<B>(pair, (mesh.per_axis(), functions), rule, factor, out)
                    };
                    if !finite {
                        return Err(CubeError::Kernel { row, column });
                    }
                }
            }
        }
        Ok(Self { mesh, entries })
    }

    /// The tables in the walk's scalar.
    ///
    /// # Errors
    /// [`CubeError::Memory`].
    pub fn rounded<F: Real>(&self) -> Result<ProductTables<F, D, B>, CubeError> {
        Ok(ProductTables {
            mesh: self.mesh,
            entries: rounded(&self.entries)?,
        })
    }

    /// As [`absolute_radius`](crate::absolute_radius) of the means K'_(i0)(j0), for any number of cells:
    /// that of a product is the product of those of the factors.
    ///
    /// # Errors
    /// [`CubeError::Memory`].
    pub fn absolute_radius(&self) -> Result<f64, CubeError> {
        let functions = Functions::<D, B>::PER_AXIS;
        self.radius_by_axes(|axis, i, out| {
            let row = self
                .view()
                .row(axis, i * functions)
                .iter()
                .step_by(functions);
            for (out, k) in out.iter_mut().zip(row) {
                *out = k.abs();
            }
        })
    }

    /// As [`Cube::neighbour_radius`], for any number of cells, and a little more with functions of degree
    /// p > 0 in several dimensions, which leave out products of more than the degree p in all.
    ///
    /// # Errors
    /// [`CubeError::Memory`].
    pub fn neighbour_radius(&self, absorption: f64) -> Result<f64, CubeError> {
        let functions = Functions::<D, B>::PER_AXIS;
        let radius = self.radius_by_axes(|axis, i, out| {
            out.fill(0.0);
            for a in 0..functions {
                let row = self.view().row(axis, i * functions + a);
                for (out, block) in out.iter_mut().zip(row.chunks_exact(functions)) {
                    *out += block.iter().map(|k| k * k).sum::<f64>();
                }
            }
        })?;
        Ok(radius * self.mesh.cells() as f64 / (1.0 - absorption))
    }

    /// The product of the spectral radii of one m × m matrix an axis, whose rows `row` fills.
    fn radius_by_axes(&self, row: impl Fn(usize, usize, &mut [f64])) -> Result<f64, CubeError> {
        let m = self.mesh.per_axis() as usize;
        let mut entries = buffer(m)?;
        let mut radius = 1.0;
        for axis in 0..D {
            radius *= radius_of(m, |w, out| {
                for (i, out) in out.iter_mut().enumerate() {
                    row(axis, i, &mut entries);
                    *out = entries.iter().zip(w).map(|(k, w)| k * w).sum();
                }
            })?;
        }
        Ok(radius)
    }
}

/// The block K'_a(i_a ·, j_a ·) of a factor in `functions` rows and columns, at most N, into `out`; whether it is
/// finite.
fn factor_block<'o, const N: usize>(
    [from, to]: [[u32; 1]; 2],
    (per_axis, functions): (u32, usize),
    rule: Rule,
    factor: impl Fn(f64, f64) -> f64,
    out: impl Iterator<Item = &'o mut f64>,
) -> bool {
    let mut block = [[0.0; N]; N];
    for x in rule.in_cell(from, per_axis) {
        let mut inner = [0.0; N];
        for y in rule.in_cell(to, per_axis) {
            let k = y.weight * factor(x.point[0], y.point[0]);
            add(&mut inner, k, &Functions::<1, N>::at(y.local));
        }
        for (row, psi) in block.iter_mut().zip(Functions::<1, N>::at(x.local)) {
            add(row, x.weight * psi, &inner);
        }
    }
    let rows = block.iter().take(functions);
    let entries = rows.flat_map(|row| row.iter().take(functions));
    let mut finite = true;
    for (out, k) in out.zip(entries) {
        *out = k / f64::from(per_axis);
        finite &= out.is_finite();
    }
    finite
}

impl<F: Real, const D: usize, const B: usize> ProductTables<F, D, B> {
    /// The same coefficients, borrowed. Their provided methods need no memory.
    #[inline]
    #[must_use]
    pub fn view(&self) -> FactorTables<'_, F, D, B> {
        FactorTables::filled(self.mesh, &self.entries)
    }

    /// The tables: that of axis 0 row by row, then that of axis 1, and so on.
    #[must_use]
    pub fn entries(&self) -> &[F] {
        &self.entries
    }

    /// Multiplies numbers for all places of all axes by the tables, axis by axis in place: of every table
    /// the rows and columns whose numbers are multiples of `step`, their entries changed by `entry`.
    /// `fibre` has room for those of an axis.
    fn multiply(&self, out: &mut [F], fibre: &mut [F], step: usize, entry: impl Fn(F) -> F) {
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
                        let row = self.view().row(axis, place * step).iter().step_by(step);
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
        let functions = Functions::<D, B>::PER_AXIS;
        let width = self.view().width();
        let number = move |places: [usize; D]| {
            let along = places.iter();
            along.fold(0, |number, place| number * width + place)
        };
        let mesh = self.mesh;
        (0..mesh.cells()).flat_map(move |i| {
            let first = number(mesh.places(i).map(|place| place as usize * functions));
            let degrees = Functions::<D, B>::DEGREES.into_iter();
            degrees.map(move |degrees| first + number(degrees.map(usize::from)))
        })
    }

    /// out = K'v, unless there is no memory for it.
    fn apply_by_axes(&self, v: &[F], out: &mut [F]) -> Result<(), GalerkinError> {
        let width = self.view().width();
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

impl<F: Real, const D: usize, const B: usize> Coefficients<B> for ProductTables<F, D, B> {
    type Scalar = F;

    fn cells(&self) -> usize {
        self.mesh.cells()
    }

    #[inline]
    fn block(&self, i: usize, j: usize) -> [[F; B]; B] {
        self.view().block(i, j)
    }

    #[inline]
    fn contract(&self, i: usize, j: usize, left: &[F; B]) -> [F; B] {
        self.view().contract(i, j, left)
    }

    #[inline]
    fn mean(&self, i: usize, j: usize) -> F {
        self.view().mean(i, j)
    }

    /// O(D m): the row sums of the factors, multiplied.
    fn row_sum(&self, i: usize) -> F {
        self.view().row_sum(i)
    }

    /// O(D m n (p + 1)^(D+1)). Allocates n (p + 1)^D numbers; where there is no memory for them, O(n² B²).
    fn apply(&self, v: &[F], out: &mut [F]) {
        let fits = Some(v.len()) == self.cells().checked_mul(B) && v.len() == out.len();
        if !fits || self.apply_by_axes(v, out).is_err() {
            self.view().apply(v, out);
        }
    }

    /// O(D m n): the absolute value of a product is that of the factors. Allocates m numbers; where there
    /// is no memory for them, O(n²).
    fn apply_absolute(&self, w: &[F], out: &mut [F]) {
        match buffer(self.mesh.per_axis() as usize) {
            Ok(mut fibre) if w.len() == self.cells() && w.len() == out.len() => {
                out.copy_from_slice(w);
                self.multiply(out, &mut fibre, Functions::<D, B>::PER_AXIS, Real::abs);
            }
            _ => self.view().apply_absolute(w, out),
        }
    }

    /// As [`apply`](Self::apply): a sweep of Jacobi's iteration, which needs all of K'v at once and
    /// converges where the spectral radius of |K'| is below 1. Allocates n·B numbers besides; where
    /// there is no memory for them, a Gauss–Seidel sweep in O(n² B²).
    fn sweep(&self, source: &[F], v: &mut [F]) -> F {
        let Ok(mut product) = buffer(v.len()) else {
            return self.view().sweep(source, v);
        };
        self.apply(v, &mut product);
        let mut largest = F::zero();
        let known = product.chunks_exact(B).zip(source.chunks_exact(B));
        for (i, (v, (product, source))) in v.chunks_exact_mut(B).zip(known).enumerate() {
            let known = product.iter().zip(source).zip(self.view().diagonal(i));
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
