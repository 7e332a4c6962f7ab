//! A polygon with any number of vertices as triangles and convex quadrilaterals.

use core::array::from_fn;

use fredholm_scene::Polygon;

type Point = [f64; 3];

fn sub(a: Point, b: Point) -> Point {
    from_fn(|k| a[k] - b[k])
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
    from_fn(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
}

/// Twice the area vector of a triangle.
fn turn(a: Point, b: Point, c: Point) -> Point {
    cross(sub(b, a), sub(c, a))
}

/// How far a quadrilateral's vertices may be off a plane, as a share of its size: rounding of what was turned.
const FLAT: f64 = 1e-13;

/// Calls `each` with the parts of a polygon: itself, if it is a triangle or a planar convex quadrilateral, else
/// triangles.
///
/// # Errors
/// The outline crosses itself, or has no area.
pub(super) fn cut(points: &[Point], each: &mut dyn FnMut(Polygon)) -> Result<(), String> {
    match *points {
        [a, b, c] => {
            each(Polygon::Triangle([a, b, c]));
            Ok(())
        }
        [a, b, c, d] if is_flat([a, b, c, d]) => {
            each(Polygon::Quad([a, b, c, d]));
            Ok(())
        }
        _ => ears(points, each),
    }
}

/// Whether four points are in a plane, in a convex order.
fn is_flat([a, b, c, d]: [Point; 4]) -> bool {
    let double = cross(sub(c, a), sub(d, b));
    let size = dot(double, double);
    let across = dot(sub(c, a), sub(c, a))
        .max(dot(sub(d, b), sub(d, b)))
        .sqrt();
    let off = dot(double, sub(b, a))
        .abs()
        .max(dot(double, sub(d, c)).abs());
    let turns = [turn(a, b, c), turn(b, c, d), turn(c, d, a), turn(d, a, b)];
    off <= FLAT * across * size.sqrt() && turns.iter().all(|&t| dot(t, double) > 0.0)
}

/// Ears are cut off, the fattest first (Meisters 1975). How fat they are is kept: an ear that is cut off changes its
/// neighbours.
fn ears(points: &[Point], each: &mut dyn FnMut(Polygon)) -> Result<(), String> {
    let mut left: Vec<Point> = points.to_vec();
    let normal = left.windows(2).skip(1).fold([0.0; 3], |sum: Point, pair| {
        let t = turn(points[0], pair[0], pair[1]);
        from_fn(|k| sum[k] + t[k])
    });
    let all = |left: &[Point]| -> Vec<Option<f64>> {
        (0..left.len()).map(|k| fatness(left, k, normal)).collect()
    };
    let best = |fat: &[Option<f64>]| {
        let known = fat
            .iter()
            .enumerate()
            .filter_map(|(k, fat)| Some(((*fat)?, k)));
        known.max_by(|a, b| a.0.total_cmp(&b.0))
    };
    let mut fat = all(&left);
    while left.len() > 3 {
        // What was in the way of an ear may be gone.
        let found = best(&fat).or_else(|| {
            fat = all(&left);
            best(&fat)
        });
        let Some((_, k)) = found else {
            return Err("the outline of this polygon crosses itself, or has no area".to_owned());
        };
        let n = left.len();
        each(Polygon::Triangle([
            left[(k + n - 1) % n],
            left[k],
            left[(k + 1) % n],
        ]));
        left.remove(k);
        fat.remove(k);
        for neighbour in [(k + n - 2) % (n - 1), k % (n - 1)] {
            fat[neighbour] = fatness(&left, neighbour, normal);
        }
    }
    each(Polygon::Triangle([left[0], left[1], left[2]]));
    Ok(())
}

/// The height of the triangle at a vertex over its longest side, if it is an ear: convex, and without other vertices.
fn fatness(points: &[Point], k: usize, normal: Point) -> Option<f64> {
    let n = points.len();
    let [a, b, c] = [points[(k + n - 1) % n], points[k], points[(k + 1) % n]];
    let double = dot(turn(a, b, c), normal);
    if !(double > 0.0) {
        return None;
    }
    let inside = |p: Point| {
        let sides = [turn(a, b, p), turn(b, c, p), turn(c, a, p)];
        p != a && p != b && p != c && sides.iter().all(|&s| dot(s, normal) >= 0.0)
    };
    if points.iter().any(|&p| inside(p)) {
        return None;
    }
    let length = |p: Point, q: Point| dot(sub(p, q), sub(p, q));
    Some(double / length(a, b).max(length(b, c)).max(length(c, a)))
}
