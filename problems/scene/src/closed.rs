//! Is a scene closed? And if not, where light leaves.

use alloc::vec::Vec;
use core::f64::consts::{PI, TAU};

use fredholm_core::Real;
use fredholm_surfaces::Forest;

use crate::SceneError;
use crate::geometry::{Face, Node};
use crate::ray::Backs;
use crate::scene::Scene;
use crate::vector::{Vector, along, centroid, cross, dot, least_axis, norm, ring, sub, turn, unit};

/// A face at one of the edges around it.
#[derive(Clone, Copy, Debug)]
struct Spoke {
    /// The vertices of the edge, the smaller number first.
    edge: [u32; 2],
    face: u32,
    /// Whether the face has the edge in this order: then its active side is counter-clockwise of
    /// it, seen against the edge; otherwise clockwise.
    starts: bool,
    /// The direction of the face at the edge, in (−π, π].
    angle: f64,
}

/// Around every edge, active sectors between a face and the next must alternate with sectors behind
/// faces. Then what bounds the space on one side of a face is connected through edges to shells, and
/// a ray from a shell into its space must meet a shell of the same kind.
pub(crate) fn check(scene: &Scene) -> Result<(), SceneError> {
    let mut spokes = spokes(scene);
    spokes.sort_unstable_by_key(|s| s.edge);
    // The active and the other side of every face.
    let mut shells = Forest::new(2 * scene.faces.len());
    let side = |face: u32, active: bool| 2 * face + u32::from(!active);
    for around in spokes.chunk_by_mut(|a, b| a.edge == b.edge) {
        sort(scene, around);
        if !alternates(around) {
            return Err(wrong_at_edge(scene, around));
        }
        for [a, b] in ring(around) {
            shells.unite(side(a.face, a.starts), side(b.face, a.starts));
        }
    }
    check_shells(scene, &mut shells)
}

/// The faces at all edges.
fn spokes(scene: &Scene) -> Vec<Spoke> {
    let mut all = Vec::with_capacity(scene.outlines.vertices.len());
    for (f, face) in (0..).zip(&scene.faces) {
        for [a, b] in scene.outlines.edges(f as usize) {
            let edge = [a.min(b), a.max(b)];
            all.push(Spoke {
                edge,
                face: f,
                starts: a < b,
                angle: angle(scene, face, edge, a < b),
            });
        }
    }
    all
}

/// The direction in which a face lies at an edge: its angle around the edge in a frame that only
/// depends on the edge.
fn angle(scene: &Scene, face: &Face<f64>, edge: [u32; 2], starts: bool) -> f64 {
    let axis = unit(sub(scene.vertex(edge[1]), scene.vertex(edge[0])));
    let x = unit(cross(axis, least_axis(axis)));
    let y = cross(axis, x);
    let inward = cross(face.normal, axis);
    let sign = if starts { 1.0 } else { -1.0 };
    Real::atan2(sign * dot(inward, y), sign * dot(inward, x))
}

/// By angle. Of two faces in one direction, such as those of a thin plate, that goes first which
/// lets sectors alternate.
fn sort(scene: &Scene, around: &mut [Spoke]) {
    if around.len() < 3 {
        return;
    }
    around.sort_unstable_by(|a, b| a.angle.total_cmp(&b.angle));
    // From the first after a real sector, as one direction may be at −π and at π.
    let sectors = around.windows(2);
    let after = sectors
        .enumerate()
        .find(|(_, pair)| !same_direction(scene, &pair[0], &pair[1]));
    if let Some((k, _)) = after {
        around.rotate_left(k + 1);
    }
    if let Some(first) = around.first().copied() {
        alternate(scene, around, first.starts);
        // Twins may be first, and then the other one.
        if !alternates(around) {
            alternate(scene, around, !first.starts);
        }
    }
}

fn alternates(around: &[Spoke]) -> bool {
    ring(around).all(|[a, b]| a.starts != b.starts)
}

/// Swaps neighbours in one direction where sectors would not alternate, beginning with one of the
/// kind `starts`.
fn alternate(scene: &Scene, around: &mut [Spoke], starts: bool) {
    for k in 0..around.len().saturating_sub(1) {
        let (at, next) = (around[k], around[k + 1]);
        let wanted = starts == k.is_multiple_of(2);
        if at.starts != wanted && next.starts == wanted && same_direction(scene, &at, &next) {
            around.swap(k, k + 1);
        }
    }
}

/// Whether two faces at one edge lie on each other, as far as the smallest distance tells.
fn same_direction(scene: &Scene, a: &Spoke, b: &Spoke) -> bool {
    let apart = (a.angle - b.angle).abs();
    let apart = apart.min(TAU - apart);
    if apart > 0.5 * PI {
        return false;
    }
    let (Some(f), Some(g)) = (
        scene.faces.get(a.face as usize),
        scene.faces.get(b.face as usize),
    ) else {
        return false;
    };
    let flat = |f: &Face<f64>, g: &Face<f64>| {
        let heights = g.polygon().iter().map(|&p| f.height(p).abs());
        heights.fold(0.0, |m: f64, h| Real::max(m, h)) <= 4.0 * scene.smallest
    };
    flat(f, g) || flat(g, f)
}

/// What is wrong at an edge around which active sides and backs do not alternate.
fn wrong_at_edge(scene: &Scene, around: &[Spoke]) -> SceneError {
    let Some(first) = around.first() else {
        return SceneError::Empty;
    };
    let middle = centroid(&first.edge.map(|v| scene.vertex(v)));
    if let [a, b] = around {
        return SceneError::Flipped {
            first: scene.place_of(a.face.min(b.face)),
            second: scene.place_of(a.face.max(b.face)),
            edge: middle,
        };
    }
    if around.len() == 1
        && let Some((face, vertex, distance)) = near_edge(scene, first)
    {
        return SceneError::TJunction {
            at: scene.place_of(face),
            vertex,
            distance,
        };
    }
    leaving(scene, around, middle)
}

/// A vertex so close to the inside of an edge that it may have been meant to be on it: one close to
/// this edge, or one of its ends close to another. The face with the edge, the vertex, their distance.
fn near_edge(scene: &Scene, spoke: &Spoke) -> Option<(u32, Vector<f64>, f64)> {
    let mut best: Option<(u32, Vector<f64>, f64)> = None;
    let mut look = |face: u32, edge: [u32; 2], v: u32| {
        if edge.contains(&v) {
            return;
        }
        let ([a, b], point) = (edge.map(|v| scene.vertex(v)), scene.vertex(v));
        let span = sub(b, a);
        let length = norm(span);
        let ahead = dot(span, sub(point, a)) / (length * length);
        let aside = norm(sub(point, along(a, ahead, span)));
        let near = (0.001..0.999).contains(&ahead) && aside <= 0.01 * length;
        if near && best.is_none_or(|(_, _, least)| aside < least) {
            best = Some((face, point, aside));
        }
    };
    for &v in &scene.outlines.vertices {
        look(spoke.face, spoke.edge, v);
    }
    for f in 0..scene.faces.len() {
        for edge in scene.outlines.edges(f) {
            for v in spoke.edge {
                look(f as u32, edge, v);
            }
        }
    }
    // On the edge it is no gap.
    best.filter(|(_, _, aside)| *aside > scene.smallest)
}

/// A ray that leaves at an edge: from the faces at it and from everywhere, to points next to it.
fn leaving(scene: &Scene, around: &[Spoke], middle: Vector<f64>) -> SceneError {
    let at = around.first().map_or(0, |s| s.face);
    let near = (1..=12).flat_map(|power| {
        let share = 1.0 / 10_u64.pow(power) as f64;
        around.iter().flat_map(move |spoke| {
            let face = scene.faces[spoke.face as usize];
            let from = face.middle();
            // Beyond the edge, and a little above.
            let beyond = along(middle, share, sub(middle, from));
            let above = along(beyond, share * norm(sub(middle, from)), face.normal);
            let others = spread(scene).take(200);
            let others = others.map(move |(other, from, _)| (other, from, sub(beyond, from)));
            core::iter::once((spoke.face, from, sub(above, from))).chain(others)
        })
    });
    let mut rays = near.chain(spread(scene)).peekable();
    let (_, from, direction) = rays.peek().copied().unwrap_or((at, middle, [0.0; 3]));
    let found = rays.find_map(|(face, from, to)| leaves(scene, at, face, from, to));
    let found = found.unwrap_or_else(|| SceneError::Open {
        at: scene.place_of(at),
        from,
        direction,
        gap: None,
        to: None,
    });
    let nearest = match around {
        [alone] => nearest(scene, alone, middle),
        _ => None,
    };
    match found {
        SceneError::Open {
            at,
            from,
            direction,
            ..
        } => SceneError::Open {
            at,
            from,
            direction,
            gap: nearest.map(|(gap, _)| gap),
            to: nearest.map(|(_, face)| scene.place_of(face)),
        },
        other => other,
    }
}

/// The distance from the middle of an edge that one face has alone to the nearest face that has no vertex of it, and that face.
fn nearest(scene: &Scene, spoke: &Spoke, middle: Vector<f64>) -> Option<(f64, u32)> {
    let around = scene.outlines.of(spoke.face as usize);
    let others = scene.faces.iter().enumerate().filter(|(number, _)| {
        let mut own = scene.outlines.of(*number).iter();
        own.all(|v| !around.contains(v))
    });
    let distance = |face: &Face<f64>| {
        let points = face.polygon();
        let inward = |[a, b]: [Vector<f64>; 2]| dot(cross(face.normal, sub(b, a)), sub(middle, a));
        if ring(points).all(|ends| inward(ends) >= 0.0) {
            return face.height(middle).abs();
        }
        let to_edge = |[a, b]: [Vector<f64>; 2]| {
            let span = sub(b, a);
            let t = (dot(span, sub(middle, a)) / dot(span, span)).clamp(0.0, 1.0);
            norm(sub(middle, along(a, t, span)))
        };
        ring(points)
            .map(to_edge)
            .fold(f64::INFINITY, |least: f64, d| least.min(d))
    };
    let distances = others.map(|(number, face)| (distance(face), number as u32));
    distances.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// The error, if this ray from a face leaves or meets a back.
fn leaves(
    scene: &Scene,
    at: u32,
    face: u32,
    from: Vector<f64>,
    direction: Vector<f64>,
) -> Option<SceneError> {
    let emitter = scene.faces.get(face as usize)?;
    if !(dot(emitter.normal, direction) > 0.0) {
        return None;
    }
    let geometry = scene.geometry();
    let hit = geometry.nearest(Some(emitter), from, unit(direction), Backs::Block);
    hit.is_none_or(|hit| hit.back).then(|| SceneError::Open {
        at: scene.place_of(at),
        from,
        direction,
        gap: None,
        to: None,
    })
}

/// Rays from everywhere, evenly spread: multiples of irrational numbers (Weyl 1916).
fn spread(scene: &Scene) -> impl Iterator<Item = (u32, Vector<f64>, Vector<f64>)> {
    let fraction = |x: f64| x - (x as u64) as f64;
    let count = scene.faces.len() as f64;
    (1..20_000_u32).filter_map(move |k| {
        let k = f64::from(k);
        let f = (count * fraction(k * 0.618_033_988_749_895)) as u32;
        let face = scene.faces.get(f as usize)?;
        let [a, b, c, _] = face.corners;
        let (mut s, mut t) = (
            fraction(k * core::f64::consts::SQRT_2),
            fraction(k * 0.732_050_807_568_877_2),
        );
        if s + t > 1.0 {
            (s, t) = (1.0 - s, 1.0 - t);
        }
        let from = along(along(a, s, sub(b, a)), t, sub(c, a));
        let aim = |x: f64| 2.0 * fraction(k * x) - 1.0;
        let d = [
            aim(2.236_067_977_499_79),
            aim(2.645_751_311_064_590_7),
            aim(3.316_624_790_355_4),
        ];
        let rise = dot(face.normal, d);
        let d = if rise > 0.0 { d } else { d.map(|x| -x) };
        Some((f, from, d))
    })
}

/// How many faces at most send a ray to either side.
const PROBES: usize = 20_000;

/// From every shell, and from as many of its faces as there is time for, a ray goes to its side. It
/// must meet an active side from an active side, and none from a back.
fn check_shells(scene: &Scene, shells: &mut Forest) -> Result<(), SceneError> {
    let geometry = scene.geometry();
    let every = scene.faces.len().div_ceil(PROBES);
    let mut probed = alloc::vec![false; 2 * scene.faces.len()];
    for (f, face) in (0..).zip(&scene.faces) {
        for active in [true, false] {
            let shell = shells.root(2 * f + u32::from(!active));
            let done = probed.get_mut(shell as usize);
            let due = (f as usize).is_multiple_of(every) || done.as_ref().is_none_or(|d| !**d);
            if due && (active || !is_covered(scene, f, face)) {
                if let Some(done) = done {
                    *done = true;
                }
                let sign = if active { 1.0 } else { -1.0 };
                let direction = face.normal.map(|x| sign * x);
                let from = face.middle();
                let own = if active { *face } else { flipped(face) };
                let hit = geometry.nearest(Some(&own), from, direction, Backs::Block);
                let sees_active = hit.is_some_and(|hit| !hit.back);
                if sees_active == active {
                    continue;
                }
                // From the back an active side is seen: that one sees this back.
                let (at, from, direction) = match hit {
                    Some(hit) if !active => (hit.face, hit.point, face.normal),
                    _ => (f, from, direction),
                };
                return Err(SceneError::Open {
                    at: scene.place_of(at),
                    from,
                    direction,
                    gap: None,
                    to: None,
                });
            }
        }
    }
    Ok(())
}

/// Whether another face lies on the back of a face, at its middle: that of a thin plate.
fn is_covered(scene: &Scene, f: u32, face: &Face<f64>) -> bool {
    let at = face.middle();
    let off = |node: &Node<f64>| (0..3).any(|k| at[k] < node.low[k] || at[k] > node.high[k]);
    scene.geometry().but(off).any(|triangle| {
        let [xs, ys, zs] = triangle.axes;
        let corner = |k: usize| [xs[k], ys[k], zs[k]];
        let is_right = |(a, b)| dot(turn(corner(a), corner(b), at), face.normal) <= 0.0;
        triangle.plane == face.plane
            && triangle.face != f
            && [(0, 1), (1, 2), (2, 0)].into_iter().all(is_right)
    })
}

/// The face seen from the other side.
fn flipped(face: &Face<f64>) -> Face<f64> {
    Face {
        normal: face.normal.map(|x| -x),
        ..*face
    }
}
