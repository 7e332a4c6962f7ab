//! Faces that lie on each other or go through each other, and which lie in one plane.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_surfaces::{Bounds, hull};

use crate::SceneError;
use crate::contacts::Contacts;
use crate::geometry::{Face, Node};
use crate::planes::{self, may_be_one};
use crate::scene::Scene;
use crate::vector::{Vector, along, cross, dot, norm, ring, scale, sub};

/// What a scene looks like before it is cut.
#[derive(Clone, Debug)]
pub(crate) struct Survey {
    pub(crate) contacts: Contacts,
    /// Faces that overlap or cross, if there are any.
    pub(crate) fault: Option<SceneError>,
    /// What is as near to a plane as this is in it.
    pub(crate) touch: f64,
}

/// Looks for faces that touch, overlap or cross, and numbers the planes.
pub(crate) fn survey(scene: &mut Scene) -> Survey {
    let touch = Real::max(2.0 * scene.smallest, 2.0 * scene.flat);
    let mut found = Survey {
        contacts: Contacts::default(),
        fault: None,
        touch,
    };
    let mut pairs: Vec<[u32; 2]> = Vec::new();
    let mut others: Vec<u32> = Vec::new();
    for (f, face) in (0..).zip(&scene.faces) {
        // A quadrilateral is met once for each of its triangles.
        others.clear();
        others.extend(near(scene, hull(face.polygon())).map(|(g, _)| g));
        others.sort_unstable();
        others.dedup();
        for &g in others.iter().filter(|&&g| g != f) {
            let Some(other) = scene.faces.get(g as usize) else {
                continue;
            };
            if may_be_one(face, other, scene.flat) {
                pairs.push([f, g]);
            }
            if coplanar(face, other, touch) {
                if g < f && !separated(face, other, touch) && !separated(other, face, touch) {
                    found.contacts.lie([g, f], [other, face], touch);
                    let fault = overlap(scene, (g, other), (f, face));
                    found.contacts.has_twins |= matches!(fault, Some(SceneError::Duplicate { .. }));
                    found.fault = found.fault.or(fault);
                }
                continue;
            }
            if g < f {
                found.contacts.meet([g, f], [other, face], touch);
            }
            if let Some(at) = crossing(face, other, touch) {
                found.contacts.cross = true;
                found.fault = found.fault.or_else(|| {
                    Some(SceneError::Crossing {
                        first: scene.place_of(f),
                        second: scene.place_of(g),
                        at,
                    })
                });
            }
        }
    }
    planes::number(&mut scene.faces, &pairs, scene.flat);
    found
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

/// The error of two faces that overlap in one plane, if they face the same side.
fn overlap(
    scene: &Scene,
    (g, first): (u32, &Face<f64>),
    (f, second): (u32, &Face<f64>),
) -> Option<SceneError> {
    if dot(first.normal, second.normal) < 0.0 {
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
