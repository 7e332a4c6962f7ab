//! Kernels of one axis that are singular at x = y.

use fredholm_cube::{KernelFactors, KernelFn, KernelIntegral, KernelMoments, KernelShape};

use super::functions::{WatchedKernel, with_values};
use super::global::LOOK_POINTS;
use super::{CubeModel, CubePartition};
use fredholm_model::Pairs;
use fredholm_model::pairs::Band;
use fredholm_model::singular::{PLACES, exponent, integral};

/// Cells in which jumps and kinks are looked for: what is narrower is as rough.
const ROUGH_CELLS: usize = 16;
/// The least order of √Var that is told: on a hundred times as many cells it is a half.
pub(super) const LEAST_ORDER: f64 = 0.05;
/// Points of the outer integral of a coefficient, in a cell [0, 1]: a Gauss rule of equal weights.
const GAUSS_POINTS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];
/// The number of these points.
pub(super) const POINTS: usize = GAUSS_POINTS.len();
/// The band around a singularity: k − h beyond it is smaller, and a score takes longer, the wider it is. With this width
/// both halves of the variance, of the source and of the pairs beyond, are alike on some hundred cells.
const SINGULAR: Band = Band { width: 8 };

impl CubeModel {
    /// The exponent a of a kernel like |x − y|^−a in one dimension, or of the factors of a product, the largest of them;
    /// 0 without a singularity.
    pub(super) fn exponent(&self) -> f64 {
        *self.exponent.get_or_init(|| {
            let is_product = self.functions.is_product();
            if self.dimension > 1 && !is_product {
                return 0.0;
            }
            let found = with_values::<f64, _>(&*self.functions, |values| {
                let kernel = values.kernel();
                let of = |axis: usize| {
                    exponent(&|x, y| {
                        if is_product {
                            kernel.factor(axis, x, y)
                        } else {
                            KernelFn::<f64, 1>::kernel(&kernel, &[x], &[y])
                        }
                    })
                };
                Ok((0..self.dimension).map(of).fold(0.0, f64::max))
            });
            found.unwrap_or(0.0)
        })
    }

    /// What rules for T_K are made for.
    pub(super) fn shape(&self) -> KernelShape {
        match self.exponent() {
            exponent if exponent > 0.0 => KernelShape::Singular { exponent },
            _ if self.is_rough() => KernelShape::Rough,
            _ => KernelShape::Smooth,
        }
    }

    /// Whether a kernel of one dimension has jumps or kinks but at x = y, seen from some x.
    pub(super) fn is_rough(&self) -> bool {
        *self.is_rough.get_or_init(|| {
            if self.dimension > 1 || self.exponent() > 0.0 {
                return false;
            }
            let found = with_values::<f64, _>(&*self.functions, |values| {
                let cube = values.cube::<1>(ROUGH_CELLS)?;
                let moments = KernelMoments::new(&cube, 0, LOOK_POINTS, KernelShape::Rough)?;
                let kernel = values.kernel();
                Ok(PLACES.iter().any(|&x| moments.is_rough(&kernel, &[x])))
            });
            found.unwrap_or(false)
        })
    }
}

impl CubePartition<'_> {
    /// The pairs near the diagonal that are pointwise by default if the kernel is singular there.
    pub(super) fn band(&self, pairs: Pairs) -> Option<Band> {
        let has_band = pairs == Pairs::Default && self.functions().has_integral();
        (has_band && self.has_integrals() && self.model.exponent() > 0.0).then_some(SINGULAR)
    }

    /// Whether coefficients come from integrals over cells, in which x = y is no quadrature point: means of piecewise
    /// constants in one dimension, whose kernel has an integral or a singularity.
    pub(super) fn has_integrals(&self) -> bool {
        let is_one = self.model.dimension == 1 && self.degree == 0;
        let may_be_singular = self.functions().has_integral() || self.model.exponent() > 0.0;
        is_one && !self.functions().is_product() && may_be_singular
    }

    /// K'_ij = n ∫_Xi ∫_Xj K(x, y) dy dx: the inner integral is exact if it is given, the outer one by Gauss points.
    pub(super) fn fill_by_integral(
        &self,
        kernel: &WatchedKernel<'_, f64>,
        i: usize,
        row: &mut [f64],
    ) {
        let width = 1.0 / self.per_axis as f64;
        let (exact, exponent) = (self.functions().has_integral(), self.model.exponent());
        row.fill(0.0);
        for t in GAUSS_POINTS {
            let x = (i as f64 + t) * width;
            for (j, entry) in row.iter_mut().enumerate() {
                let [low, high] = [j, j + 1].map(|j| j as f64 * width);
                let inner = if exact {
                    KernelIntegral::<f64, 1>::integral(kernel, &[x], &[low], &[high])
                } else {
                    let at = |y: f64| KernelFn::<f64, 1>::kernel(kernel, &[x], &[y]);
                    integral(at, exponent, x, [low, high])
                };
                *entry += inner / GAUSS_POINTS.len() as f64;
            }
        }
    }
}
