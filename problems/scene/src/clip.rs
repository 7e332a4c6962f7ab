//! Convex polygons and planes.

use alloc::vec::Vec;

use fredholm_core::array::from_fn;

use crate::vector::Vector;

/// The point of the line from a to b where its heights at both are these.
fn crossing(a: Vector<f64>, b: Vector<f64>, from: f64, to: f64) -> Vector<f64> {
    let t = from / (from - to);
    from_fn(|k| a[k] + t * (b[k] - a[k]))
}

/// Writes into `kept` the part of a convex polygon of which `height` is not negative. Heights not
/// above `slack` are 0.
pub(crate) fn keep(
    polygon: &[Vector<f64>],
    height: &dyn Fn(Vector<f64>) -> f64,
    slack: f64,
    kept: &mut Vec<Vector<f64>>,
) {
    kept.clear();
    let rounded = |p: Vector<f64>| {
        let h = height(p);
        if h.abs() <= slack { 0.0 } else { h }
    };
    let Some(&last) = polygon.last() else { return };
    let (mut before, mut low) = (last, rounded(last));
    for &at in polygon {
        let high = rounded(at);
        if (low < 0.0 && high > 0.0) || (low > 0.0 && high < 0.0) {
            kept.push(crossing(before, at, low, high));
        }
        if high >= 0.0 {
            kept.push(at);
        }
        (before, low) = (at, high);
    }
    if kept.len() < 3 {
        kept.clear();
    }
}

/// The edges of a polygon.
pub(crate) fn ring(points: &[Vector<f64>]) -> impl Iterator<Item = [Vector<f64>; 2]> {
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(&a, &b)| [a, b])
}
