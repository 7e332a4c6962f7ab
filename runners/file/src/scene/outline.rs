//! A polygon with any number of vertices as triangles and convex quadrilaterals.

use core::array::from_fn;

use fredholm_scene::Polygon;

type Point = [f64; 3];

fn sub(a: Point, b: Point) -> Point {
    from_fn(|k| a[k] - b[k])
}

/// a · b.
pub(super) fn dot(a: Point, b: Point) -> f64 {
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
/// triangles, of which as few as possible are thinner than `off`, by which vertices may be wrong.
///
/// # Errors
/// The outline crosses itself, or has no area.
pub(super) fn cut(points: &[Point], off: f64, each: &mut dyn FnMut(Polygon)) -> Result<(), String> {
    match *points {
        [a, b, c] => {
            each(Polygon::Triangle([a, b, c]));
            Ok(())
        }
        [a, b, c, d] if is_flat([a, b, c, d]) => {
            each(Polygon::Quad([a, b, c, d]));
            Ok(())
        }
        _ => {
            let mut triangles = ears(points)?;
            swap_slivers(points, off, &mut triangles);
            for own in triangles {
                each(Polygon::Triangle(own.map(|k| points[k])));
            }
            Ok(())
        }
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

/// The outline of a polygon less some holes, each joined to it by a slit. A hole that touches the outline is left out: whoever lies on it
/// is cut out where faces meet.
///
/// # Errors
/// A hole is not in the polygon's plane to within `off`, or is not within the polygon: by how much, and where.
pub(super) fn without(
    points: &[Point],
    holes: &[Vec<Point>],
    off: f64,
) -> Result<Vec<Point>, String> {
    let (normal, hub) = (
        area_vector(points),
        points.first().copied().unwrap_or_default(),
    );
    let length = dot(normal, normal).sqrt();
    let size = points.iter().map(|&p| dot(sub(p, hub), sub(p, hub)));
    let size = size.fold(0.0, f64::max).sqrt();
    let mut all = points.to_vec();
    for hole in holes {
        let distance = |&p: &Point| (dot(normal, sub(p, hub)) / length).abs();
        let furthest = hole.iter().map(distance).fold(0.0, f64::max);
        if !(furthest <= off + IN_PLANE * size) {
            return Err(format!(
                "what is cut out of this polygon is {furthest:.3e} off its plane: a window lies in the plane of its wall"
            ));
        }
        let near = off + IN_PLANE * size;
        let outside = (hole.iter()).filter(|&&p| !is_within(points, p, normal, near));
        let outside: Vec<Point> = outside.copied().collect();
        for &[x, y, z] in &outside {
            let by = distance_to(points, [x, y, z]);
            if by > off + BESIDE * size {
                return Err(format!(
                    "what is cut out of this polygon reaches {by:.3e} beyond it, at ({x}, {y}, {z}): a window lies within its wall"
                ));
            }
        }
        if !outside.is_empty() {
            continue;
        }
        let mut ring = hole.clone();
        // Holes go round the other way.
        if dot(area_vector(&ring), normal) > 0.0 {
            ring.reverse();
        }
        let Some((at, from)) = slit(&all, &ring, normal) else {
            continue;
        };
        ring.rotate_left(from);
        let back = [ring[0], all[at]];
        all.splice(at + 1..at + 1, ring.into_iter().chain(back));
    }
    Ok(all)
}

/// By how much a hole may miss the plane of its polygon, as a share of the size of that: coordinates have few digits.
const IN_PLANE: f64 = 1e-6;

/// By how much a hole may reach beyond its polygon, as a share of the size of that: it touches the outline then.
const BESIDE: f64 = 1e-3;

/// Twice the area vector of a polygon.
pub(super) fn area_vector(points: &[Point]) -> Point {
    let hub = points.first().copied().unwrap_or_default();
    points.windows(2).skip(1).fold([0.0; 3], |sum, pair| {
        let t = turn(hub, pair[0], pair[1]);
        from_fn(|k| sum[k] + t[k])
    })
}

/// The edges of a closed outline.
fn edges(points: &[Point]) -> impl Iterator<Item = [Point; 2]> + '_ {
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(&a, &b)| [a, b])
}

/// How far a point is from an outline.
fn distance_to(points: &[Point], p: Point) -> f64 {
    let distance = |[a, b]: [Point; 2]| {
        let (span, aim) = (sub(b, a), sub(p, a));
        let t = (dot(span, aim) / dot(span, span)).clamp(0.0, 1.0);
        let aside: Point = from_fn(|k| aim[k] - t * span[k]);
        dot(aside, aside).sqrt()
    };
    edges(points).map(distance).fold(f64::INFINITY, f64::min)
}

/// Whether a point is inside of an outline, and further than `off` from it.
fn is_within(points: &[Point], p: Point, normal: Point, off: f64) -> bool {
    if distance_to(points, p) <= off {
        return false;
    }
    // The sum of the angles around it is a whole turn.
    let angle = |[a, b]: [Point; 2]| {
        let (a, b) = (sub(a, p), sub(b, p));
        let sine = dot(cross(a, b), normal) / dot(normal, normal).sqrt();
        libm::atan2(sine, dot(a, b))
    };
    edges(points).map(angle).sum::<f64>() > core::f64::consts::PI
}

/// The shortest line from an outline to a hole that crosses neither: the numbers of its ends.
fn slit(points: &[Point], hole: &[Point], normal: Point) -> Option<(usize, usize)> {
    let side = |a: Point, b: Point, c: Point| dot(turn(a, b, c), normal);
    let crosses = |p: Point, q: Point, [a, b]: [Point; 2]| {
        let is_end = [a, b].iter().any(|&end| end == p || end == q);
        !is_end && side(p, q, a) * side(p, q, b) <= 0.0 && side(a, b, p) * side(a, b, q) <= 0.0
    };
    // Of an outline with slits a vertex may be there twice: the line must leave into the inside.
    let is_inside = |k: usize, q: Point| {
        let n = points.len();
        let [a, b, c] = [points[(k + n - 1) % n], points[k], points[(k + 1) % n]];
        let [before, after] = [side(a, b, q) > 0.0, side(b, c, q) > 0.0];
        match side(a, b, c) > 0.0 {
            true => before && after,
            false => before || after,
        }
    };
    let mut best: Option<(f64, usize, usize)> = None;
    for (k, &p) in points.iter().enumerate() {
        for (l, &q) in hole.iter().enumerate() {
            let length = dot(sub(q, p), sub(q, p));
            let is_better = best.is_none_or(|(least, ..)| length < least);
            if is_better
                && is_inside(k, q)
                && !edges(points)
                    .chain(edges(hole))
                    .any(|edge| crosses(p, q, edge))
            {
                best = Some((length, k, l));
            }
        }
    }
    best.map(|(_, k, l)| (k, l))
}

/// Triangles of a polygon, by their vertices' numbers: ears are cut off, the fattest first (Meisters 1975). How fat they are is kept: an
/// ear that is cut off changes its neighbours.
fn ears(points: &[Point]) -> Result<Vec<[usize; 3]>, String> {
    let mut left: Vec<Point> = points.to_vec();
    let mut numbers: Vec<usize> = (0..points.len()).collect();
    let mut triangles = Vec::with_capacity(points.len());
    let normal = area_vector(points);
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
        triangles.push([numbers[(k + n - 1) % n], numbers[k], numbers[(k + 1) % n]]);
        left.remove(k);
        numbers.remove(k);
        fat.remove(k);
        for neighbour in [(k + n - 2) % (n - 1), k % (n - 1)] {
            fat[neighbour] = fatness(&left, neighbour, normal);
        }
    }
    triangles.push([numbers[0], numbers[1], numbers[2]]);
    Ok(triangles)
}

/// Whether a polygon is nowhere wider than this.
pub(super) fn is_thin(points: &[Point], width: f64) -> bool {
    if points.len() < 3 {
        return true;
    }
    let area = area_vector(points);
    let length = |[a, b]: [Point; 2]| dot(sub(a, b), sub(a, b)).sqrt();
    let longest = edges(points).map(length).fold(0.0, f64::max);
    dot(area, area).sqrt() <= 2.0 * width * longest
}

/// Joins triangles that are thinner than `off` with the neighbour at their longest edge, and cuts both across, where that makes none: a vertex
/// that is but for its error on an edge would leave a triangle whose plane is that error's.
fn swap_slivers(points: &[Point], off: f64, triangles: &mut [[usize; 3]]) {
    let normal = area_vector(points);
    let at = |own: [usize; 3]| own.map(|k| points[k]);
    let is_good = |own: [usize; 3]| {
        let [a, b, c] = at(own);
        dot(turn(a, b, c), normal) > 0.0 && !is_thin(&[a, b, c], off)
    };
    for k in 0..triangles.len() {
        if !is_thin(&at(triangles[k]), off) {
            continue;
        }
        let turned = |own: [usize; 3]| [0, 1, 2].map(|by| [0, 1, 2].map(|j| own[(by + j) % 3]));
        let length = |[a, b, _]: [usize; 3]| {
            let edge = sub(points[a], points[b]);
            dot(edge, edge)
        };
        let longest =
            (turned(triangles[k]).into_iter()).max_by(|&a, &b| length(a).total_cmp(&length(b)));
        let Some([a, b, tip]) = longest else { continue };
        let beyond = triangles.iter().enumerate().find_map(|(other, &own)| {
            let found = turned(own).into_iter().find(|own| own[..2] == [b, a])?;
            Some((other, found[2]))
        });
        if let Some((other, far)) = beyond
            && is_good([a, far, tip])
            && is_good([far, b, tip])
        {
            triangles[k] = [a, far, tip];
            triangles[other] = [far, b, tip];
        }
    }
}

/// The height of the triangle at a vertex over its longest side, if it is an ear: convex, and without other vertices.
fn fatness(points: &[Point], k: usize, normal: Point) -> Option<f64> {
    let n = points.len();
    let [a, b, c] = [points[(k + n - 1) % n], points[k], points[(k + 1) % n]];
    let length = |p: Point, q: Point| dot(sub(p, q), sub(p, q));
    let longest = length(a, b).max(length(b, c)).max(length(c, a));
    // What is on an edge, but for rounding, is inside: left for later it would make a triangle without an area.
    let nothing = FLAT * longest * dot(normal, normal).sqrt();
    let double = dot(turn(a, b, c), normal);
    if !(double > nothing) {
        return None;
    }
    let inside = |p: Point| {
        let sides = [turn(a, b, p), turn(b, c, p), turn(c, a, p)];
        p != a && p != b && p != c && sides.iter().all(|&s| dot(s, normal) >= -nothing)
    };
    if points.iter().any(|&p| inside(p)) {
        return None;
    }
    Some(double / longest)
}
