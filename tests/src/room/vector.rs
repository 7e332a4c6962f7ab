//! Vectors in the plane, in f64.

use fredholm_core::Real;

pub(super) type Vector = [f64; 2];

pub(super) fn sub(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1]]
}
pub(super) fn cross(a: Vector, b: Vector) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}
pub(super) fn wide<F: Real>(p: [F; 2]) -> Vector {
    p.map(Real::to_f64)
}
pub(super) fn dist(a: Vector, b: Vector) -> f64 {
    dot(sub(a, b), sub(a, b)).sqrt()
}
