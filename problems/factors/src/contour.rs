//! Double integrals of the logarithm of the distance along pairs of edges.
//!
//! Two polygons that see each other wholly exchange
//!
//! ```text
//! A_1 F_12 = 1/(2π) Σ_{edges p of 1, q of 2} t_p·t_q ∫_p ∫_q ln |x − y| dx dy,
//! ```
//!
//! t the unit tangents (Stokes' theorem twice; Sparrow 1963). A pair of edges has a closed form if
//! the edges are parallel or have a vertex in common; otherwise the inner integral has one.

use fredholm_core::Real;
use fredholm_surfaces::space::{Vector, along, cross, dot, norm, ring, scale, sub};

use crate::rules::Rules;

type Edge = [Vector<f64>; 2];

/// A sine of an angle below which lines are parallel.
const PARALLEL: f64 = 1e-11;

/// A cosine below which edges contribute nothing.
const PERPENDICULAR: f64 = 1e-17;

/// Parallel edges have a closed form of squares of distances, which loses digits if one edge is shorter than the
/// largest distance by more than this.
const UNEVEN: f64 = 1e3;

/// How many times an edge may be halved towards another.
const HALVINGS: u32 = 48;

/// A_1 F_12 of two polygons that see each other wholly, whose vertices are off by `blur`.
pub(crate) fn exchange(a: &[Vector<f64>], b: &[Vector<f64>], blur: f64, rules: &Rules) -> f64 {
    let mut sum = 0.0;
    for p in ring(a) {
        for q in ring(b) {
            sum += term(p, q, blur, rules);
        }
    }
    sum / core::f64::consts::TAU
}

/// t_p·t_q ∫∫ ln |x − y| over two edges.
fn term(p: Edge, q: Edge, blur: f64, rules: &Rules) -> f64 {
    let (u, v) = (sub(p[1], p[0]), sub(q[1], q[0]));
    let (lu, lv) = (norm(u), norm(v));
    if lu == 0.0 || lv == 0.0 {
        return 0.0;
    }
    let (u, v) = (scale(u, 1.0 / lu), scale(v, 1.0 / lv));
    let cosine = dot(u, v);
    if cosine.abs() <= PERPENDICULAR {
        return 0.0;
    }
    // The shorter one is integrated over by points.
    let (short, length, long) = if lu <= lv { (p, lu, q) } else { (q, lv, p) };
    // Edges that were rounded are parallel if the shorter one's ends say no more.
    if norm(cross(u, v)) <= Real::max(PARALLEL, 2.0 * blur / length) {
        let far = q.iter().flat_map(|&x| p.map(|y| norm(sub(x, y))));
        let farthest = far.fold(0.0, |m: f64, x| Real::max(m, x));
        return if length * UNEVEN <= farthest {
            cosine * by_points(short, length, long, &to_ends, rules, HALVINGS)
        } else if lu <= lv {
            // The longer one knows the direction better.
            parallel(q, v, lv, p)
        } else {
            parallel(p, u, lu, q)
        };
    }
    for (i, at) in p.iter().enumerate() {
        for (j, other) in q.iter().enumerate() {
            if at == other {
                return cosine * from_vertex(*at, p[1 - i], q[1 - j]);
            }
        }
    }
    cosine * by_points(short, length, long, &distance, rules, HALVINGS)
}

/// Edges on parallel lines, with the sign of the cosine: second differences of K(z), whose second
/// derivative is ½ ln(z² + h²).
fn parallel(p: Edge, u: Vector<f64>, length: f64, q: Edge) -> f64 {
    let to = [sub(q[0], p[0]), sub(q[1], p[0])];
    let [from, until] = [dot(to[0], u), dot(to[1], u)];
    let across = along(to[0], -from, u);
    let square = dot(across, across);
    let h = Real::sqrt(square);
    let k = |z: f64| {
        let distance = z * z + square;
        if distance == 0.0 {
            return 0.0;
        }
        let angle = if h == 0.0 { 0.0 } else { Real::atan2(z, h) };
        0.25 * (z * z - square) * Real::ln(distance) - 0.75 * z * z + h * z * angle
    };
    k(until) - k(until - length) - k(from) + k(from - length)
}

/// Edges from a common vertex to `a` and to `b`. The integral over the edges scaled by λ is λ² times
/// it and λ² ln λ times the product of the lengths; its derivative at λ = 1 consists of the two
/// integrals along the far ends.
fn from_vertex(vertex: Vector<f64>, a: Vector<f64>, b: Vector<f64>) -> f64 {
    let (la, lb) = (norm(sub(a, vertex)), norm(sub(b, vertex)));
    let far = la * along_edge(a, [vertex, b]) + lb * along_edge(b, [vertex, a]);
    0.5 * (far - la * lb)
}

/// ∫ ln |x − y| dy over an edge.
fn along_edge(x: Vector<f64>, [from, to]: Edge) -> f64 {
    let span = sub(to, from);
    let length = norm(span);
    let unit = scale(span, 1.0 / length);
    let aim = sub(x, from);
    let foot = dot(aim, unit);
    let across = along(aim, -foot, unit);
    let square = dot(across, across);
    let h = Real::sqrt(square);
    let part = |z: f64| {
        let distance = z * z + square;
        if distance == 0.0 {
            return 0.0;
        }
        let angle = if h == 0.0 { 0.0 } else { Real::atan2(z, h) };
        0.5 * z * Real::ln(distance) - z + h * angle
    };
    part(length - foot) + part(foot)
}

/// Other edges: Gauss points along the first, halved until what is singular is far away in comparison.
fn by_points(
    p: Edge,
    length: f64,
    q: Edge,
    distance: &dyn Fn(Vector<f64>, Edge) -> f64,
    rules: &Rules,
    halvings: u32,
) -> f64 {
    let middle = along(p[0], 0.5, sub(p[1], p[0]));
    let ratio = distance(middle, q) / (0.5 * length);
    // The error falls like the distance over the half length, and its hypotenuse, to the power −2n.
    let points = if ratio >= 6.0 {
        7
    } else if ratio >= 3.0 {
        9
    } else if ratio >= 1.5 {
        14
    } else if halvings == 0 {
        16
    } else {
        let halves = [[p[0], middle], [middle, p[1]]];
        return halves
            .into_iter()
            .map(|half| by_points(half, 0.5 * length, q, distance, rules, halvings - 1))
            .sum();
    };
    let sum: f64 = rules
        .of(points)
        .iter()
        .map(|&(t, weight)| weight * along_edge(along(p[0], t, sub(p[1], p[0])), q))
        .sum();
    length * sum
}

/// The distance of a point from the ends of an edge: on a parallel line only these are singular.
fn to_ends(point: Vector<f64>, ends: Edge) -> f64 {
    let [a, b] = ends.map(|end| norm(sub(point, end)));
    a.min(b)
}

/// The distance of a point from an edge.
fn distance(point: Vector<f64>, [from, to]: Edge) -> f64 {
    let (span, aim) = (sub(to, from), sub(point, from));
    let t = (dot(span, aim) / dot(span, span)).clamp(0.0, 1.0);
    norm(along(aim, -t, span))
}
