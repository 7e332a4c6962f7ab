//! Galerkin coefficients of a product kernel.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::galerkin::{Coefficients, Dense, buffer, rounded};

use crate::mesh::Mesh;
use crate::solution::absolute_radius;
use crate::{Cube, CubeError, FactorTables, Function, KernelFactors, Product, Rule};

/// The coefficients K'_ij = Π_a K'_a(i_a, j_a) of a product kernel, from one m × m table for every
/// axis.
///
/// They are those that the same rule gives for the product, up to rounding. Set-up costs D m² g²
/// evaluations of a factor and K'v costs D m n operations, so that n may be far larger than a dense
/// table would allow.
#[derive(Clone, Debug)]
pub struct ProductTables<F, const D: usize> {
    mesh: Mesh<D>,
    /// Those of axis 0 row by row, then those of axis 1, and so on.
    entries: Vec<F>,
}

impl<const D: usize> ProductTables<f64, D> {
    /// The tables of a cube's kernel: 8 D m² bytes.
    ///
    /// # Errors
    /// [`CubeError::Memory`], [`CubeError::Kernel`] where a factor is not finite.
    pub fn new<T, S>(cube: &Cube<f64, D, Product<T>, S>, rule: Rule) -> Result<Self, CubeError>
    where
        T: KernelFactors<f64>,
        S: Function<f64, D>,
    {
        let mesh = cube.mesh();
        let m = mesh.per_axis();
        let width = m as usize;
        let length = width.checked_mul(width).and_then(|e| e.checked_mul(D));
        let mut entries = buffer(length.ok_or(CubeError::Memory { bytes: None })?)?;
        let factors = &cube.integral_kernel().0;
        for (axis, table) in entries.chunks_exact_mut(width * width).enumerate() {
            for (e, out) in table.iter_mut().enumerate() {
                let (row, column) = (e / width, e % width);
                let mut sum = 0.0;
                for ([x], weight) in rule.in_cell([row as u32], m) {
                    let inner: f64 = rule
                        .in_cell([column as u32], m)
                        .map(|([y], weight)| weight * factors.factor(axis, x, y))
                        .sum();
                    sum += weight * inner;
                }
                if !sum.is_finite() {
                    return Err(CubeError::Kernel { row, column });
                }
                *out = sum / f64::from(m);
            }
        }
        Ok(Self { mesh, entries })
    }

    /// The tables in the walk's scalar.
    ///
    /// # Errors
    /// [`CubeError::Memory`].
    pub fn rounded<F: Real>(&self) -> Result<ProductTables<F, D>, CubeError> {
        Ok(ProductTables {
            mesh: self.mesh,
            entries: rounded(&self.entries)?,
        })
    }

    /// As [`absolute_radius`], for any number of cells: that of a product is the product of those of the
    /// factors.
    ///
    /// # Errors
    /// [`CubeError::Memory`].
    pub fn absolute_radius(&self) -> Result<f64, CubeError> {
        let m = self.mesh.per_axis() as usize;
        let mut radius = 1.0;
        for table in self.entries.chunks_exact(m * m) {
            if let Some(axis) = Dense::new(table, m) {
                radius *= absolute_radius(&axis)?;
            }
        }
        Ok(radius)
    }
}

impl<F: Real, const D: usize> ProductTables<F, D> {
    /// The same coefficients, borrowed. Their provided methods need no memory.
    #[inline]
    #[must_use]
    pub fn view(&self) -> FactorTables<'_, F, D> {
        FactorTables::filled(self.mesh, &self.entries)
    }

    /// The tables: that of axis 0 row by row, then that of axis 1, and so on.
    #[must_use]
    pub fn entries(&self) -> &[F] {
        &self.entries
    }

    /// out = K'v with the factors' entries changed by `entry`, axis by axis in place; `fibre` has m
    /// entries.
    fn multiply(&self, v: &[F], out: &mut [F], fibre: &mut [F], entry: impl Fn(F) -> F) {
        out.copy_from_slice(v);
        let m = fibre.len();
        let mut stride = self.mesh.cells();
        for axis in 0..D {
            let block = stride;
            stride /= m;
            for block in out.chunks_exact_mut(block) {
                for offset in 0..stride {
                    let along = || (offset..).step_by(stride).take(m);
                    for (to, i) in fibre.iter_mut().zip(along()) {
                        *to = block.get(i).copied().unwrap_or(F::NAN);
                    }
                    for (place, i) in along().enumerate() {
                        let row = self.view().row(axis, place as u32);
                        let sum = row
                            .iter()
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
}

impl<F: Real, const D: usize> Coefficients for ProductTables<F, D> {
    type Scalar = F;

    fn cells(&self) -> usize {
        self.mesh.cells()
    }

    #[inline]
    fn block(&self, i: usize, j: usize) -> [[F; 1]; 1] {
        self.view().block(i, j)
    }

    /// O(D m): the row sums of the factors, multiplied.
    fn row_sum(&self, i: usize) -> F {
        self.view().row_sum(i)
    }

    /// O(D m n). Allocates m numbers; where there is no memory for them, O(n²).
    fn apply(&self, v: &[F], out: &mut [F]) {
        match buffer(self.mesh.per_axis() as usize) {
            Ok(mut fibre) if v.len() == self.cells() && v.len() == out.len() => {
                self.multiply(v, out, &mut fibre, |k| k);
            }
            _ => self.view().apply(v, out),
        }
    }

    /// As [`apply`](Self::apply): the absolute value of a product is that of the factors.
    fn apply_absolute(&self, w: &[F], out: &mut [F]) {
        match buffer(self.mesh.per_axis() as usize) {
            Ok(mut fibre) if w.len() == self.cells() && w.len() == out.len() => {
                self.multiply(w, out, &mut fibre, Real::abs);
            }
            _ => self.view().apply_absolute(w, out),
        }
    }

    /// O(D m n): a sweep of Jacobi's iteration, which needs all of K'v at once and converges where
    /// the spectral radius of |K'| is below 1. Allocates n numbers; where there is no memory for them, a
    /// Gauss–Seidel sweep in O(n²).
    fn sweep(&self, source: &[F], v: &mut [F]) -> F {
        let Ok(mut product) = buffer(v.len()) else {
            return self.view().sweep(source, v);
        };
        self.apply(v, &mut product);
        let mut largest = F::zero();
        for (i, ((v, &product), &source)) in v.iter_mut().zip(&product).zip(source).enumerate() {
            let residual = source + product - *v;
            // Written so that NaN stays.
            if !(residual.abs() <= largest) && !largest.is_nan() {
                largest = residual.abs();
            }
            let [[own]] = self.block(i, i);
            *v += residual / (F::one() - own);
        }
        largest
    }
}
