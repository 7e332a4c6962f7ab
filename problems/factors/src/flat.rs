//! Half-planes of P's plane, and integrals over what they cut out.

use fredholm_core::Real;
use fredholm_surfaces::space::{Vector, cross, sub};

/// A place in P's plane, as seen from y.
pub(crate) type Point = [f64; 2];

/// A half-plane of P's plane: where a·u + b·v + c is not negative.
pub(crate) type Half = [f64; 3];

/// From this many widths on a polygon is far away: closed forms lose digits with the square of the ratio, and four points
/// leave 10⁻¹⁴ of an integral along an edge.
const FAR: f64 = 32.0;

/// Gauss's four points in [0, 1], and weights.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// The half-plane of the points x in P's plane from which the line to y passes the edge on its left, seen from x.
pub(crate) fn half(a: Vector<f64>, b: Vector<f64>, y: Vector<f64>) -> Half {
    // By the span: an edge that is short for its distance would lose digits.
    let m = cross(sub(a, y), sub(b, a));
    [m[0], m[1], -m[2] * y[2]]
}

pub(crate) fn at(half: Half, p: Point) -> f64 {
    half[0] * p[0] + half[1] * p[1] + half[2]
}

/// ∮ ln √(u² + v² + h²) times the cosine with a direction, along the outline of a polygon.
pub(crate) fn around(polygon: &[Point], h: f64, direction: Point) -> f64 {
    let Some(&last) = polygon.last() else {
        return 0.0;
    };
    let distance = |p: Point| p[0] * p[0] + p[1] * p[1] + h * h;
    let apart = |p: Point| {
        let [u, v] = [p[0] - last[0], p[1] - last[1]];
        u * u + v * v
    };
    let widest = polygon
        .iter()
        .fold(0.0, |m: f64, &p| Real::max(m, apart(p)));
    if distance(last) > FAR * FAR * widest {
        return around_far(polygon, last, distance(last), direction);
    }
    // z² ln z is 0 at 0.
    let logarithm = |d: f64| if d > 0.0 { 0.5 * Real::ln(d) } else { 0.0 };
    let mut before = last;
    let mut first = logarithm(distance(last));
    let mut sum = 0.0;
    for &p in polygon {
        let second = logarithm(distance(p));
        let span = [p[0] - before[0], p[1] - before[1]];
        let square = span[0] * span[0] + span[1] * span[1];
        let cosine = direction[0] * span[0] + direction[1] * span[1];
        if square > 0.0 && cosine != 0.0 {
            // The foot of y on the line divides it into z and w.
            let z = -(before[0] * span[0] + before[1] * span[1]) / square;
            let w = 1.0 - z;
            let aside = before[0] * span[1] - before[1] * span[0];
            let across = Real::sqrt(aside * aside / square + h * h);
            let length = Real::sqrt(square);
            let (z, w) = (z * length, w * length);
            let angle = if across > 0.0 {
                across * Real::atan2(across * length, across * across - z * w)
            } else {
                0.0
            };
            sum += cosine / length * (z * first + w * second - length + angle);
        }
        (before, first) = (p, second);
    }
    sum
}

/// Around a polygon that is far away from y in comparison with its width: with the logarithm of the distance by that of one
/// vertex, which is the same integral without the cancellation.
fn around_far(polygon: &[Point], last: Point, square: f64, direction: Point) -> f64 {
    let mut sum = 0.0;
    let mut before = last;
    for &p in polygon {
        let span = [p[0] - before[0], p[1] - before[1]];
        let cosine = direction[0] * span[0] + direction[1] * span[1];
        if cosine != 0.0 {
            let from = [before[0] - last[0], before[1] - last[1]];
            let mean: f64 = GAUSS
                .iter()
                .map(|&(t, weight)| {
                    let [u, v] = [from[0] + t * span[0], from[1] + t * span[1]];
                    let more = u * (2.0 * last[0] + u) + v * (2.0 * last[1] + v);
                    weight * half_logarithm(more / square)
                })
                .sum();
            sum += cosine * mean;
        }
        before = p;
    }
    sum
}

/// ½ ln (1 + x) = atanh s, where s = x/(2 + x): a series for |x| below 0.07.
fn half_logarithm(x: f64) -> f64 {
    let s = x / (2.0 + x);
    let q = s * s;
    s * (1.0 + q * (1.0 / 3.0 + q * (0.2 + q * (1.0 / 7.0 + q * (1.0 / 9.0 + q / 11.0)))))
}

/// The area of a convex polygon, whichever way round its vertices are.
pub(crate) fn area(polygon: &[Point]) -> f64 {
    let Some((hub, rest)) = polygon.split_first() else {
        return 0.0;
    };
    let to = |p: Point| [p[0] - hub[0], p[1] - hub[1]];
    let double: f64 = rest
        .windows(2)
        .map(|w| {
            let [u, v] = [to(w[0]), to(w[1])];
            u[0] * v[1] - u[1] * v[0]
        })
        .sum();
    0.5 * double.abs()
}
