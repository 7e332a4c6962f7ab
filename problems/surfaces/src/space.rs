//! Vectors in space.

use fredholm_core::Real;
use fredholm_core::array::{Each, from_fn};

/// A place or a direction.
pub type Vector<F> = [F; 3];

/// a − b.
#[inline(always)]
pub fn sub<F: Real>(a: Vector<F>, b: Vector<F>) -> Vector<F> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a + s·d.
#[inline(always)]
pub fn along<F: Real>(a: Vector<F>, s: F, d: Vector<F>) -> Vector<F> {
    [a[0] + s * d[0], a[1] + s * d[1], a[2] + s * d[2]]
}

/// a·b.
#[inline(always)]
pub fn dot<F: Real>(a: Vector<F>, b: Vector<F>) -> F {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b.
#[inline(always)]
pub fn cross<F: Real>(a: Vector<F>, b: Vector<F>) -> Vector<F> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The length.
#[inline(always)]
pub fn norm<F: Real>(a: Vector<F>) -> F {
    dot(a, a).sqrt()
}

/// The vector of length 1 in this direction.
#[must_use]
pub fn unit(a: Vector<f64>) -> Vector<f64> {
    let length = norm(a);
    a.each(|x| x / length)
}

/// s·a.
#[must_use]
pub fn scale(a: Vector<f64>, s: f64) -> Vector<f64> {
    a.each(|x| s * x)
}

/// The mean of some points.
#[must_use]
pub fn centroid(points: &[Vector<f64>]) -> Vector<f64> {
    let sum = points
        .iter()
        .fold([0.0; 3], |s, p| from_fn(|k| s[k] + p[k]));
    scale(sum, 1.0 / points.len() as f64)
}

/// Twice the area vector of the triangle a, b, c: along the normal of its counter-clockwise side.
#[must_use]
pub fn turn(a: Vector<f64>, b: Vector<f64>, c: Vector<f64>) -> Vector<f64> {
    cross(sub(b, a), sub(c, a))
}

/// Each of some things with the next, the last with the first: the edges of a polygon.
pub fn ring<T: Copy>(points: &[T]) -> impl Iterator<Item = [T; 2]> {
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(&a, &b)| [a, b])
}

/// The coordinate axis that is least along a unit vector.
#[must_use]
pub fn least_axis(a: Vector<f64>) -> Vector<f64> {
    let least = (0..3).min_by(|&i, &j| a[i].abs().total_cmp(&a[j].abs()));
    from_fn(|k| f64::from(u8::from(Some(k) == least)))
}
