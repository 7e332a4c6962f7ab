//! Vectors in the plane.

use fredholm_core::Real;

pub(crate) type Vector<F> = [F; 2];

#[inline]
pub(crate) fn sub<F: Real>(a: Vector<F>, b: Vector<F>) -> Vector<F> {
    [a[0] - b[0], a[1] - b[1]]
}

/// a + s·d.
#[inline]
pub(crate) fn along<F: Real>(a: Vector<F>, s: F, d: Vector<F>) -> Vector<F> {
    [a[0] + s * d[0], a[1] + s * d[1]]
}

#[inline]
pub(crate) fn dot<F: Real>(a: Vector<F>, b: Vector<F>) -> F {
    a[0] * b[0] + a[1] * b[1]
}

/// Positive where the turn from `a` to `b` is to the left.
#[inline]
pub(crate) fn cross<F: Real>(a: Vector<F>, b: Vector<F>) -> F {
    a[0] * b[1] - a[1] * b[0]
}

#[inline]
pub(crate) fn norm<F: Real>(a: Vector<F>) -> F {
    dot(a, a).sqrt()
}
