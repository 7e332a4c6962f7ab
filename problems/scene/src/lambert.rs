//! From a point to a polygon.

use fredholm_core::Real;

use fredholm_core::array::Each;
use num_traits::zero;

use crate::vector::{Vector, cross, dot, sub};

/// Below this square of the sine of the angle between two vertices the series serves: its first term
/// that is left out is below 10⁻¹⁶.
const SMALL: f64 = 0.05;

/// (2k)!/(4ᵏ (k!)² (2k + 1)): asin(s)/s is their sum times s²ᵏ.
const SERIES: [f64; 11] = [
    1.0,
    1.0 / 6.0,
    3.0 / 40.0,
    5.0 / 112.0,
    35.0 / 1152.0,
    63.0 / 2816.0,
    231.0 / 13312.0,
    143.0 / 10240.0,
    6435.0 / 557_056.0,
    12155.0 / 1_245_184.0,
    46189.0 / 5_505_024.0,
];

/// The form factor from a point with this normal to a polygon that it sees wholly, no part of which
/// is below its horizon; dimensionless.
///
/// The sum over the edges of the angle at which each is seen times the cosine of the normal with
/// that of the plane through the point and the edge, over 2π (Lambert 1760; Schröder and Hanrahan
/// 1993). Negative where the polygon is seen from behind. Angles are by the arc tangent of cross and
/// dot product, or, if small, by a series of the sine: an arc cosine loses half of the digits.
///
/// ```
/// use fredholm_scene::form_factor_of_point;
///
/// // A square of side 1, seen from 1 below one of its corners: Howell's B-4 is
/// // (a/√(1 + a²) atan(b/√(1 + a²)) + b/√(1 + b²) atan(a/√(1 + b²)))/(2π), a = b = 1.
/// let square = [[0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 0.0, 1.0]];
/// let f = form_factor_of_point([0.0; 3], [0.0, 0.0, 1.0], &square);
/// assert!((f - (1.0 / 2_f64.sqrt()) * (1.0 / 2_f64.sqrt()).atan() / core::f64::consts::PI).abs() < 1e-16);
/// ```
#[inline]
#[must_use]
pub fn form_factor_of_point<F: Real>(point: [F; 3], normal: [F; 3], polygon: &[[F; 3]]) -> F {
    let Some(&last) = polygon.last() else {
        return zero();
    };
    let (mut sum, mut before) = (zero::<F>(), sub(last, point));
    for &corner in polygon {
        let at = sub(corner, point);
        sum += edge(normal, before, at);
        before = at;
    }
    -sum / (F::PI + F::PI)
}

/// The form factor from the origin, as [`form_factor_of_point`] has it.
#[inline]
#[must_use]
pub fn form_factor_from_origin<F: Real>(normal: [F; 3], polygon: &[[F; 3]]) -> F {
    // What is subtracted is a constant, which a compiler leaves out.
    form_factor_of_point([zero(); 3], normal, polygon)
}

/// The angle between two vectors times the normal's cosine with their cross product.
#[inline]
fn edge<F: Real>(normal: Vector<F>, a: Vector<F>, b: Vector<F>) -> F {
    let turn = cross(a, b);
    let (square, product) = (dot(turn, turn), dot(a, b));
    let lengths = dot(a, a) * dot(b, b);
    let rise = dot(normal, turn);
    if product > zero() && square <= F::from_f64(SMALL) * lengths {
        if square == zero() {
            return zero();
        }
        let s = square / lengths;
        let ratio = SERIES
            .each(F::from_f64)
            .iter()
            .rev()
            .fold(zero::<F>(), |sum, &c| sum * s + c);
        rise * ratio / lengths.sqrt()
    } else if square > zero() {
        let sine = square.sqrt();
        rise / sine * sine.atan2(product)
    } else {
        zero()
    }
}
