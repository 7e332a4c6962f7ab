//! Faces that lie on each other or go through each other, and which lie in one plane.

use alloc::vec::Vec;

use crate::SceneError;
use crate::geometry::{Face, Node};
use crate::join::{bounds, root, unite};
use crate::scene::Scene;
use crate::vector::{Box3, Vector, along, cross, dot, norm, scale, sub};

/// Refuses faces that overlap or cross, and numbers the planes, in which faces are but for
/// `rounding`.
pub(crate) fn check(scene: &mut Scene, rounding: f64) -> Result<(), SceneError> {
    let mut planes: Vec<u32> = (0..scene.faces.len() as u32).collect();
    for (f, face) in (0..).zip(&scene.faces) {
        let box3 = bounds(face);
        let mut wrong = None;
        for_each_near(scene, box3, &mut |g, other| {
            if wrong.is_some() || g == f {
                return;
            }
            if coplanar(face, other, 2.0 * scene.smallest) {
                if g < f {
                    // Not a chain of faces each of which is almost in one plane with the next.
                    let ends = [f, g].map(|k| root(&mut planes, k));
                    let [a, b] = ends.map(|k| scene.faces.get(k as usize).unwrap_or(face));
                    if coplanar(a, b, rounding) {
                        unite(&mut planes, f, g);
                    }
                    wrong = overlap(scene, (g, other), (f, face));
                }
            } else if let Some(at) = crossing(face, other, scene.smallest) {
                wrong = Some(SceneError::Crossing {
                    first: scene.place_of(f),
                    second: scene.place_of(g),
                    at,
                });
            }
        });
        if let Some(error) = wrong {
            return Err(error);
        }
    }
    for f in 0..scene.faces.len() {
        let plane = root(&mut planes, f as u32);
        if let Some(face) = scene.faces.get_mut(f) {
            face.plane = plane;
        }
    }
    Ok(())
}

/// Calls `each` for faces whose boxes meet a box, perhaps more than once for one.
fn for_each_near(scene: &Scene, [low, high]: Box3, each: &mut dyn FnMut(u32, &Face<f64>)) {
    let apart = |node: &Node<f64>| (0..3).any(|k| node.low[k] > high[k] || node.high[k] < low[k]);
    let slack = scene.smallest;
    scene
        .geometry()
        .visit(&mut |node| apart(node), &mut |triangle| {
            let Some(face) = scene.faces.get(triangle.face as usize) else {
                return;
            };
            let [from, to] = bounds(face);
            let meets = (0..3).all(|k| from[k] <= high[k] + slack && to[k] >= low[k] - slack);
            if meets {
                each(triangle.face, face);
            }
        });
}

/// Whether the smaller face lies in the plane of the larger.
fn coplanar(a: &Face<f64>, b: &Face<f64>, distance: f64) -> bool {
    let (small, large) = if a.area <= b.area { (a, b) } else { (b, a) };
    small
        .polygon()
        .iter()
        .all(|&p| large.height(p).abs() <= distance)
}

/// What is wrong with two faces of one plane, if they overlap and face the same side.
fn overlap(
    scene: &Scene,
    (g, first): (u32, &Face<f64>),
    (f, second): (u32, &Face<f64>),
) -> Option<SceneError> {
    if dot(first.normal, second.normal) < 0.0
        || separated(first, second, scene.smallest)
        || separated(second, first, scene.smallest)
    {
        return None;
    }
    let same =
        first.count == second.count && first.vertices.iter().all(|v| second.vertices.contains(v));
    let (first, second) = (scene.place_of(g), scene.place_of(f));
    Some(if same {
        SceneError::Duplicate { first, second }
    } else {
        SceneError::Overlap { first, second }
    })
}

/// Whether all of another face in the same plane is outside of an edge of a face.
fn separated(face: &Face<f64>, other: &Face<f64>, smallest: f64) -> bool {
    edges(face).any(|(from, out)| {
        let mut points = other.polygon().iter();
        points.all(|&p| dot(out, sub(p, from)) >= -2.0 * smallest)
    })
}

/// The edges of a face: where each begins, and the unit vector in its plane away from the face.
fn edges(face: &Face<f64>) -> impl Iterator<Item = (Vector<f64>, Vector<f64>)> {
    let points = face.polygon();
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(&a, &b)| {
        let out = cross(sub(b, a), face.normal);
        (a, scale(out, 1.0 / norm(out)))
    })
}

/// Where an edge of a face goes through the inside of another, by more than the smallest distance.
fn crossing(face: &Face<f64>, other: &Face<f64>, smallest: f64) -> Option<Vector<f64>> {
    let points = face.polygon();
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).find_map(|(&a, &b)| {
        let (from, to) = (other.height(a), other.height(b));
        let through = (from > 2.0 * smallest && to < -2.0 * smallest)
            || (from < -2.0 * smallest && to > 2.0 * smallest);
        if !through {
            return None;
        }
        let at = along(a, from / (from - to), sub(b, a));
        let inside = edges(other).all(|(start, out)| dot(out, sub(at, start)) < -2.0 * smallest);
        inside.then_some(at)
    })
}
