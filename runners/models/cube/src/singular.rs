//! Kernels of one axis that are singular at x = y.

use fredholm_core::galerkin::buffer;
use fredholm_cube::{KernelFactors, KernelFn, KernelIntegral, KernelMoments, KernelShape};

use super::functions::{WatchedKernel, with_values};
use super::global::LOOK_POINTS;
use super::radius::of_matrix;
use super::{CubeModel, CubePartition};
use fredholm_model::pairs::Band;
use fredholm_model::{Error, Pairs};

/// The kernel of an axis, on [0, 1].
pub(super) type AxisKernel<'a> = dyn Fn(f64, f64) -> f64 + 'a;

/// Where a singularity is looked for.
const PLACES: [f64; 6] = [0.0417, 0.2113, 0.3819, 0.5421, 0.7302, 0.9127];
/// The binary logarithms of the distances from x: a kernel that is narrow, but finite, does not grow over all of them.
const DISTANCES: [i32; 3] = [-14, -23, -32];
/// The least exponent of a singularity. That of a logarithm is 0.05 at these distances.
const LEAST: f64 = 0.02;
/// The most s of a substitution t^s, whose points near x would be x itself otherwise.
const MOST_POWER: f64 = 10.0;
/// Cells of the table of K².
const CELLS: usize = 200;
/// Nodes and weights of a Gauss rule on [0, 1].
const GAUSS: [[f64; 2]; 4] = [
    [0.069_431_844_202_973_71, 0.173_927_422_568_726_93],
    [0.330_009_478_207_571_87, 0.326_072_577_431_273_07],
    [0.669_990_521_792_428_1, 0.326_072_577_431_273_07],
    [0.930_568_155_797_026_3, 0.173_927_422_568_726_93],
];

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

/// The exponent a of |K(x, y)| ~ |x − y|^−a as y comes near to x, the largest of some x; 0 without a singularity.
pub(super) fn exponent(kernel: &AxisKernel<'_>) -> f64 {
    let at = |x: f64, side: f64| {
        let [far, middle, near] =
            DISTANCES.map(|log2| kernel(x, x + side * f64::from(log2).exp2()));
        let grows = |from: f64, to: f64, steps: i32| (to / from).abs().log2() / f64::from(steps);
        let first = grows(far, middle, DISTANCES[0] - DISTANCES[1]);
        let second = grows(middle, near, DISTANCES[1] - DISTANCES[2]);
        // NaN where the kernel vanishes, which is no singularity.
        if first.is_finite() && second.is_finite() {
            first.min(second)
        } else {
            0.0
        }
    };
    let all = PLACES.iter().flat_map(|&x| [at(x, -1.0), at(x, 1.0)]);
    let most = all.fold(0.0, f64::max);
    if most < LEAST { 0.0 } else { most }
}

/// The spectral radius of T_K² for a kernel with this exponent, which is infinite from ½ on.
///
/// # Errors
/// [`Error::Galerkin`]: memory.
pub(super) fn squared_radius(kernel: &AxisKernel<'_>, exponent: f64) -> Result<f64, Error> {
    if exponent >= 0.5 {
        return Ok(f64::INFINITY);
    }
    let mut entries: Vec<f64> = buffer(CELLS * CELLS)?;
    let width = 1.0 / CELLS as f64;
    for (i, row) in entries.chunks_exact_mut(CELLS).enumerate() {
        let x = (i as f64 + 0.5) * width;
        for (j, entry) in row.iter_mut().enumerate() {
            let low = j as f64 * width;
            let square = |y: f64| kernel(x, y) * kernel(x, y);
            *entry = integral(square, 2.0 * exponent, x, [low, low + width]);
        }
    }
    Ok(of_matrix(CELLS, &entries))
}

/// ∫ f(y) dy of a function like |x − y|^−a with this a. With |y − x| = r t^s the integrand is smooth in t, if
/// s = 1/(1 − a).
pub(super) fn integral(
    function: impl Fn(f64) -> f64,
    exponent: f64,
    x: f64,
    [low, high]: [f64; 2],
) -> f64 {
    let power = (1.0 / (1.0 - exponent)).min(MOST_POWER);
    // From x as far as to a point on one side of it.
    let up_to = |end: f64| {
        let far = end - x;
        let node = |&[t, weight]: &[f64; 2]| {
            weight * power * t.powf(power - 1.0) * function(x + far * t.powf(power))
        };
        far.abs() * GAUSS.iter().map(node).sum::<f64>()
    };
    if low <= x && x <= high {
        return up_to(low) + up_to(high);
    }
    let node = |&[t, weight]: &[f64; 2]| weight * function(low + (high - low) * t);
    (high - low) * GAUSS.iter().map(node).sum::<f64>()
}

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

#[cfg(test)]
mod tests {
    use super::{exponent, squared_radius};

    #[test]
    fn exponents_are_found() {
        for a in [0.1, 0.3, 0.45, 0.6] {
            let kernel = move |x: f64, y: f64| (1.0 + x * y) * (x - y).abs().powf(-a);
            assert!((exponent(&kernel) - a).abs() < 1e-4, "{a}");
        }
        let log = exponent(&|x, y| (x - y).abs().ln());
        assert!((0.02..0.1).contains(&log), "{log}");
    }

    #[test]
    fn smooth_narrow_and_jumping_kernels_have_none() {
        assert_eq!(exponent(&|x, y| (-(x - y) * (x - y)).exp()), 0.0);
        assert_eq!(exponent(&|x, y| (-1e10 * (x - y) * (x - y)).exp()), 0.0);
        assert_eq!(exponent(&|x, y| (x - y).abs()), 0.0);
        assert_eq!(exponent(&|x, y| f64::from(u8::from(x < y))), 0.0);
        assert_eq!(exponent(&|_, _| 0.0), 0.0);
    }

    /// That of 0.09 |x − y|^−0.6, by product integration with 2,000 points: 0.3239.
    #[test]
    fn the_square_is_integrated_up_to_the_singularity() {
        let kernel = |x: f64, y: f64| 0.3 * (x - y).abs().powf(-0.3);
        let found = squared_radius(&kernel, 0.3).unwrap();
        assert!((found - 0.3239).abs() < 0.002, "{found}");
        assert_eq!(squared_radius(&kernel, 0.6).unwrap(), f64::INFINITY);
    }
}
