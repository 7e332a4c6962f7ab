//! Faces that lie on each other or go through each other, and which lie in one plane.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_surfaces::{Bounds, hull};

use crate::SceneError;
use crate::geometry::{Face, Node};
use crate::planes::{self, may_be_one};
use crate::scene::Scene;
use crate::vector::{Vector, along, cross, dot, norm, ring, scale, sub};

/// Refuses faces that overlap or cross, and numbers the planes.
pub(crate) fn check(scene: &mut Scene) -> Result<(), SceneError> {
    // What is as near to a plane as this is in it.
    let touch = Real::max(2.0 * scene.smallest, 2.0 * scene.flat);
    let mut pairs: Vec<[u32; 2]> = Vec::new();
    for (f, face) in (0..).zip(&scene.faces) {
        for (g, other) in near(scene, hull(face.polygon())).filter(|&(g, _)| g != f) {
            if may_be_one(face, other, scene.flat) {
                pairs.push([f, g]);
            }
            if coplanar(face, other, touch) {
                if g < f {
                    overlap(scene, (g, other), (f, face), touch)?;
                }
            } else if let Some(at) = crossing(face, other, touch) {
                return Err(SceneError::Crossing {
                    first: scene.place_of(f),
                    second: scene.place_of(g),
                    at,
                });
            }
        }
    }
    pairs.sort_unstable();
    pairs.dedup();
    planes::number(&mut scene.faces, &pairs, scene.flat);
    Ok(())
}

/// The faces whose boxes meet a box, perhaps more than once for one.
fn near(scene: &Scene, [low, high]: Bounds<3>) -> impl Iterator<Item = (u32, &Face<f64>)> {
    let apart =
        move |node: &Node<f64>| (0..3).any(|k| node.low[k] > high[k] || node.high[k] < low[k]);
    let slack = scene.smallest;
    scene.geometry().but(apart).filter_map(move |triangle| {
        let face = scene.faces.get(triangle.face as usize)?;
        let [from, to] = hull(face.polygon());
        let meets = (0..3).all(|k| from[k] <= high[k] + slack && to[k] >= low[k] - slack);
        meets.then_some((triangle.face, face))
    })
}

/// Whether the smaller face lies in the plane of the larger.
fn coplanar(a: &Face<f64>, b: &Face<f64>, distance: f64) -> bool {
    let (small, large) = if a.area <= b.area { (a, b) } else { (b, a) };
    small
        .polygon()
        .iter()
        .all(|&p| large.height(p).abs() <= distance)
}

/// Refuses two faces of one plane that overlap and face the same side.
fn overlap(
    scene: &Scene,
    (g, first): (u32, &Face<f64>),
    (f, second): (u32, &Face<f64>),
    touch: f64,
) -> Result<(), SceneError> {
    if dot(first.normal, second.normal) < 0.0
        || separated(first, second, touch)
        || separated(second, first, touch)
    {
        return Ok(());
    }
    let same =
        first.count == second.count && first.vertices.iter().all(|v| second.vertices.contains(v));
    let (first, second) = (scene.place_of(g), scene.place_of(f));
    Err(if same {
        SceneError::Duplicate { first, second }
    } else {
        SceneError::Overlap { first, second }
    })
}

/// Whether all of another face in the same plane is outside of an edge of a face, but for `slack`.
fn separated(face: &Face<f64>, other: &Face<f64>, slack: f64) -> bool {
    edges(face).any(|(from, out)| {
        let mut points = other.polygon().iter();
        points.all(|&p| dot(out, sub(p, from)) >= -slack)
    })
}

/// The edges of a face: where each begins, and the unit vector in its plane away from the face.
fn edges(face: &Face<f64>) -> impl Iterator<Item = (Vector<f64>, Vector<f64>)> {
    ring(face.polygon()).map(|[a, b]| {
        let out = cross(sub(b, a), face.normal);
        (a, scale(out, 1.0 / norm(out)))
    })
}

/// Where an edge of a face goes through the inside of another, by more than `slack`.
fn crossing(face: &Face<f64>, other: &Face<f64>, slack: f64) -> Option<Vector<f64>> {
    ring(face.polygon()).find_map(|[a, b]| {
        let (from, to) = (other.height(a), other.height(b));
        let through = (from > slack && to < -slack) || (from < -slack && to > slack);
        if !through {
            return None;
        }
        let at = along(a, from / (from - to), sub(b, a));
        let inside = edges(other).all(|(start, out)| dot(out, sub(at, start)) < -slack);
        inside.then_some(at)
    })
}
