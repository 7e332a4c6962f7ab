//! Whether what is given as the integral of a kernel is that.

use super::functions::{CubeFunctions, Watched};
use super::mean::mean;
use fredholm_model::Error;

/// The ends of the intervals that are looked at.
const TICKS: [f64; 6] = [0.0, 0.21, 0.4, 0.62, 0.8, 1.0];
/// Cells of a composite Gauss rule on an interval.
const CELLS: usize = 200;

/// Refuses an integral that is not that of the kernel: it would be a bias that no error bar shows. Composite Gauss rules
/// of 200 × 5 points on intervals without x = y.
pub(super) fn check(functions: &dyn CubeFunctions, values: &Watched<'_, f64>) -> Result<(), Error> {
    let axes = if functions.is_product() {
        functions.dimension()
    } else {
        1
    };
    let (values, domain) = (values.values(), values.domain());
    let kernel = |axis: usize, x: f64, y: f64| {
        if functions.is_product() {
            values.factor(axis, x, y)
        } else {
            values.kernel(&[x], &[y])
        }
    };
    for axis in 0..axes {
        for x in [0.1, 0.3, 0.5, 0.7, 0.9] {
            let at = |t: f64| domain.coordinate(axis, t);
            let x = at(x);
            let intervals = TICKS.windows(2).map(|ends| (at(ends[0]), at(ends[1])));
            for (low, high) in intervals.filter(|&(low, high)| x < low || high < x) {
                let found = values.integral(axis, x, high) - values.integral(axis, x, low);
                let width = high - low;
                let at = |t: &[f64; 1]| kernel(axis, x, low + width * t[0]);
                let expected = width * mean(&at, CELLS)?;
                let size = width * mean(&|t| at(t).abs(), CELLS)?;
                if !((found - expected).abs() <= 1e-3 * size + 1e-12) {
                    return Err(Error::WrongIntegral {
                        axis,
                        x,
                        ends: [low, high],
                        values: [expected, found],
                    });
                }
            }
        }
    }
    Ok(())
}
