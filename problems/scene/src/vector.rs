//! Vectors in space.

use fredholm_core::Real;
use fredholm_core::array::Each as _;

pub(crate) type Vector<F> = [F; 3];

#[inline(always)]
pub(crate) fn sub<F: Real>(a: Vector<F>, b: Vector<F>) -> Vector<F> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a + s·d.
#[inline(always)]
pub(crate) fn along<F: Real>(a: Vector<F>, s: F, d: Vector<F>) -> Vector<F> {
    [a[0] + s * d[0], a[1] + s * d[1], a[2] + s * d[2]]
}

#[inline(always)]
pub(crate) fn dot<F: Real>(a: Vector<F>, b: Vector<F>) -> F {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(crate) fn cross<F: Real>(a: Vector<F>, b: Vector<F>) -> Vector<F> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
pub(crate) fn norm<F: Real>(a: Vector<F>) -> F {
    dot(a, a).sqrt()
}

/// The vector of length 1 in this direction.
pub(crate) fn unit(a: Vector<f64>) -> Vector<f64> {
    let length = norm(a);
    a.each(|x| x / length)
}

#[cfg(feature = "alloc")]
pub(crate) use owned::{Box3, centroid, empty_box, hull, join, scale, turn};

#[cfg(feature = "alloc")]
mod owned {
    use super::{Vector, cross, sub};
    use fredholm_core::Real;
    use fredholm_core::array::{Each, from_fn};

    /// The lowest and the highest coordinates.
    pub(crate) type Box3 = [Vector<f64>; 2];

    pub(crate) fn scale(a: Vector<f64>, s: f64) -> Vector<f64> {
        a.each(|x| s * x)
    }

    /// The box of nothing.
    pub(crate) const fn empty_box() -> Box3 {
        [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]]
    }

    pub(crate) fn join(a: Box3, b: Box3) -> Box3 {
        [
            from_fn(|k| a[0][k].min(b[0][k])),
            from_fn(|k| Real::max(a[1][k], b[1][k])),
        ]
    }

    /// The box of some points.
    pub(crate) fn hull(points: &[Vector<f64>]) -> Box3 {
        points.iter().fold(empty_box(), |all, &p| join(all, [p, p]))
    }

    /// The mean of some points.
    pub(crate) fn centroid(points: &[Vector<f64>]) -> Vector<f64> {
        let sum = points
            .iter()
            .fold([0.0; 3], |s, p| from_fn(|k| s[k] + p[k]));
        scale(sum, 1.0 / points.len() as f64)
    }

    /// Twice the area vector of the triangle a, b, c: along the normal of its counter-clockwise side.
    pub(crate) fn turn(a: Vector<f64>, b: Vector<f64>, c: Vector<f64>) -> Vector<f64> {
        cross(sub(b, a), sub(c, a))
    }
}
