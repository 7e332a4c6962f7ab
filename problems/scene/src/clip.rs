//! Convex polygons and planes.

use alloc::vec::Vec;

use fredholm_core::array::from_fn;

use crate::vector::{Vector, cross, dot, norm, sub};

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

/// Cuts a convex polygon, whose vertices are relative to the origin, by a plane through the origin,
/// into the part on the side of the normal and the other. A part without area has no vertices.
pub(crate) fn cut(
    polygon: &[Vector<f64>],
    normal: Vector<f64>,
    above: &mut Vec<Vector<f64>>,
    below: &mut Vec<Vector<f64>>,
) {
    above.clear();
    below.clear();
    let Some(&last) = polygon.last() else { return };
    let (mut before, mut low) = (last, dot(normal, last));
    for &at in polygon {
        let high = dot(normal, at);
        if (low < 0.0 && high > 0.0) || (low > 0.0 && high < 0.0) {
            let both = crossing(before, at, low, high);
            above.push(both);
            below.push(both);
        }
        if high >= 0.0 {
            above.push(at);
        }
        if high <= 0.0 {
            below.push(at);
        }
        (before, low) = (at, high);
    }
    if above.len() < 3 {
        above.clear();
    }
    if below.len() < 3 {
        below.clear();
    }
}

/// The part of a segment that is inside of a convex polygon in its plane, as fractions of the
/// segment; `None` if it is not longer than `slack`.
pub(crate) fn within(
    [from, to]: [Vector<f64>; 2],
    polygon: &[Vector<f64>],
    normal: Vector<f64>,
    slack: f64,
) -> Option<[f64; 2]> {
    let span = sub(to, from);
    let length = norm(span);
    let (mut enter, mut leave) = (0.0, 1.0);
    let next = polygon.iter().cycle().skip(1);
    for (&a, &b) in polygon.iter().zip(next) {
        let inward = cross(normal, sub(b, a));
        let size = norm(inward);
        let (depth, slope) = (dot(inward, sub(from, a)), dot(inward, span));
        // Along an edge is not inside.
        if depth <= slack * size && depth + slope <= slack * size {
            return None;
        }
        if slope > 0.0 {
            let t = -depth / slope;
            enter = if t > enter { t } else { enter };
        } else if slope < 0.0 {
            let t = -depth / slope;
            leave = if t < leave { t } else { leave };
        }
    }
    (leave - enter > 0.0 && (leave - enter) * length > slack).then_some([enter, leave])
}

/// The edges of a polygon.
pub(crate) fn ring(points: &[Vector<f64>]) -> impl Iterator<Item = [Vector<f64>; 2]> {
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(&a, &b)| [a, b])
}

/// The part of a segment with heights up to `top`.
pub(crate) fn below(
    ends: [Vector<f64>; 2],
    heights: [f64; 2],
    top: f64,
) -> Option<[Vector<f64>; 2]> {
    let [a, b] = ends;
    let [low, high] = heights;
    let at = |t: f64| -> Vector<f64> { from_fn(|k| a[k] + t * (b[k] - a[k])) };
    match (low <= top, high <= top) {
        (true, true) => Some(ends),
        (true, false) => Some([a, at((top - low) / (high - low))]),
        (false, true) => Some([at((top - low) / (high - low)), b]),
        (false, false) => None,
    }
}

/// A triangle cut at the middle of its longest edge, a quadrilateral across its longer sides.
pub(crate) fn halves(part: &[Vector<f64>]) -> [Vec<Vector<f64>>; 2] {
    let middle = |a: Vector<f64>, b: Vector<f64>| from_fn(|k| 0.5 * (a[k] + b[k]));
    let length = |a: Vector<f64>, b: Vector<f64>| norm(sub(a, b));
    match *part {
        [a, b, c, d] => {
            if length(a, b) + length(c, d) >= length(b, c) + length(d, a) {
                let (m, n) = (middle(a, b), middle(c, d));
                [Vec::from([a, m, n, d]), Vec::from([m, b, c, n])]
            } else {
                let (m, n) = (middle(b, c), middle(d, a));
                [Vec::from([a, b, m, n]), Vec::from([n, m, c, d])]
            }
        }
        [a, b, c] => {
            let (x, y, z) = (length(a, b), length(b, c), length(c, a));
            if y >= x && y >= z {
                let m = middle(b, c);
                [Vec::from([a, b, m]), Vec::from([a, m, c])]
            } else if x >= z {
                let m = middle(a, b);
                [Vec::from([a, m, c]), Vec::from([m, b, c])]
            } else {
                let m = middle(c, a);
                [Vec::from([a, b, m]), Vec::from([m, b, c])]
            }
        }
        _ => [Vec::new(), Vec::new()],
    }
}
