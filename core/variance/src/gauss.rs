//! Gauss–Legendre rules of any order.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::galerkin::{GalerkinError, buffer};

/// Nodes in [−1, 1] in growing order and weights that sum to 2: exact for polynomials of degree 2 `points` − 1. By
/// Newton's method on P_points from Tricomi's guess (Abramowitz and Stegun 1964, 22.16.6), for a quadrature's nodes.
///
/// # Errors
/// [`GalerkinError::Memory`].
pub fn gauss(points: usize) -> Result<Vec<(f64, f64)>, GalerkinError> {
    let mut rule = buffer(points)?;
    let count = points as f64;
    for (i, place) in rule.iter_mut().rev().enumerate() {
        let guess = core::f64::consts::PI * (i as f64 + 0.75) / (count + 0.5);
        let mut t = Real::cos(guess);
        let mut slope = 1.0;
        // The guess has an error of O(points⁻³), which three steps square away.
        for _ in 0..6 {
            let (value, before) = legendre(points, t);
            slope = count * (t * value - before) / (t * t - 1.0);
            t -= value / slope;
        }
        *place = (t, 2.0 / ((1.0 - t * t) * slope * slope));
    }
    Ok(rule)
}

/// Nodes and weights of the Gauss–Lobatto rule on [−1, 1], rising, −1 and 1 among them: exact for polynomials up to degree 2 `points` − 3. It
/// has two points at least.
///
/// ```
/// let rule = fredholm_variance::gauss_lobatto(3)?;
/// let expected = [(-1.0, 1.0 / 3.0), (0.0, 4.0 / 3.0), (1.0, 1.0 / 3.0)];
/// for ((t, w), (at, weight)) in rule.into_iter().zip(expected) {
///     assert!((t - at).abs() < 1e-15 && (w - weight).abs() < 1e-15);
/// }
/// # Ok::<(), fredholm_core::galerkin::GalerkinError>(())
/// ```
///
/// # Errors
/// [`GalerkinError::Memory`].
pub fn gauss_lobatto(points: usize) -> Result<Vec<(f64, f64)>, GalerkinError> {
    let points = points.max(2);
    let mut rule = buffer(points)?;
    let count = points as f64;
    for (i, place) in rule.iter_mut().rev().enumerate() {
        let mut t = Real::cos(core::f64::consts::PI * i as f64 / (count - 1.0));
        let mut value = 1.0;
        for _ in 0..16 {
            let (now, before) = legendre(points - 1, t);
            value = now;
            // The ends stay where they are.
            t -= (t * now - before) / (count * now);
        }
        *place = (t, 2.0 / (count * (count - 1.0) * value * value));
    }
    Ok(rule)
}

/// P_n(t) and P_(n−1)(t).
fn legendre(n: usize, t: f64) -> (f64, f64) {
    let (mut now, mut before) = (1.0, 0.0);
    for k in 0..n {
        let k = k as f64;
        (now, before) = (((2.0 * k + 1.0) * t * now - k * before) / (k + 1.0), now);
    }
    (now, before)
}

#[cfg(test)]
mod tests {
    use super::{gauss, gauss_lobatto};

    #[test]
    fn powers_are_exact_with_both_ends() {
        for points in 2..12 {
            let rule = gauss_lobatto(points).unwrap();
            assert!(rule.windows(2).all(|pair| pair[0].0 < pair[1].0));
            for power in 0..2 * points as i32 - 2 {
                let sum: f64 = rule.iter().map(|(t, w)| w * t.powi(power)).sum();
                let exact = if power % 2 == 0 {
                    2.0 / f64::from(power + 1)
                } else {
                    0.0
                };
                assert!((sum - exact).abs() < 1e-14, "{points}, {power}: {sum}");
            }
        }
    }

    #[test]
    fn powers_up_to_twice_the_points_are_exact() {
        for points in 1..12 {
            let rule = gauss(points).unwrap();
            assert!(rule.windows(2).all(|pair| pair[0].0 < pair[1].0));
            for power in 0..2 * points as i32 {
                let sum: f64 = rule.iter().map(|(t, w)| w * t.powi(power)).sum();
                let exact = if power % 2 == 0 {
                    2.0 / f64::from(power + 1)
                } else {
                    0.0
                };
                assert!((sum - exact).abs() < 1e-14, "{points} {power} {sum}");
            }
            let sum: f64 = rule
                .iter()
                .map(|(t, w)| w * t.powi(2 * points as i32))
                .sum();
            assert!((sum - 2.0 / (2 * points + 1) as f64).abs() > 1e-9);
        }
    }
}
