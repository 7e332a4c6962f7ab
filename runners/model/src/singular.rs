//! Kernels of one axis that are singular at x = y.

use fredholm_core::galerkin::buffer;

use crate::Error;
use crate::finite::radius_above;

/// The kernel of an axis, on [0, 1].
pub type AxisKernel<'a> = dyn Fn(f64, f64) -> f64 + 'a;

/// Where a singularity is looked for.
pub const PLACES: [f64; 6] = [0.0417, 0.2113, 0.3819, 0.5421, 0.7302, 0.9127];
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

/// The exponent a of |K(x, y)| ~ |x − y|^−a as y comes near to x, the largest of some x; 0 without a singularity.
#[must_use]
pub fn exponent(kernel: &AxisKernel<'_>) -> f64 {
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
pub fn squared_radius(kernel: &AxisKernel<'_>, exponent: f64) -> Result<f64, Error> {
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
    Ok(radius_above(CELLS, &entries))
}

/// ∫ f(y) dy of a function like |x − y|^−a with this a. With |y − x| = r t^s the integrand is smooth in t, if
/// s = 1/(1 − a).
pub fn integral(
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
