//! The faces of a plane made into few large convex polygons, which hide the same.

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;
use core::cell::Cell;

use crate::Enclosure;
use crate::geometry::Node;
use crate::hierarchy::{self, Item};
use crate::rules::{area, double_area};
use crate::scene::{Scene, margin};
use crate::vector::{Vector, cross, dot, hull, norm, sub};

/// The most vertices of a large polygon: every one costs where it hides something.
const MOST: usize = 12;

/// A convex polygon that hides what is behind it.
#[derive(Clone, Debug)]
pub(crate) struct Occluder {
    /// The vertices, counter-clockwise seen from the active side.
    pub(crate) points: Vec<Vector<f64>>,
    /// Their numbers.
    pub(crate) vertices: Vec<u32>,
    pub(crate) normal: Vector<f64>,
}

impl Occluder {
    #[inline]
    pub(crate) fn height(&self, point: Vector<f64>) -> f64 {
        let first = self.points.first().copied().unwrap_or_default();
        dot(self.normal, sub(point, first))
    }
}

/// All of them, and a hierarchy.
#[derive(Clone, Debug)]
pub(crate) struct Occluders {
    pub(crate) all: Vec<Occluder>,
    order: Vec<u32>,
    nodes: Vec<Node<f64>>,
}

impl Occluders {
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut groups: BTreeMap<(u32, bool), Vec<u32>> = BTreeMap::new();
        for (f, face) in (0..).zip(&scene.faces) {
            let first = scene.faces.get(face.plane as usize).unwrap_or(face);
            let same = dot(first.normal, face.normal) > 0.0;
            groups.entry((face.plane, same)).or_default().push(f);
        }
        let mut all = Vec::new();
        for faces in groups.values() {
            merge(scene, faces, &mut all);
        }
        // Of twins back to back one hides what both do: in a closed scene that one which is seen.
        if scene.enclosure() == Enclosure::Open {
            let mut seen = BTreeSet::new();
            all.retain(|occluder: &Occluder| {
                let mut vertices = occluder.vertices.clone();
                vertices.sort_unstable();
                seen.insert(vertices)
            });
        }
        let mut items: Vec<Item> = (0..)
            .zip(&all)
            .map(|(number, occluder): (u32, &Occluder)| Item {
                bounds: hull(&occluder.points),
                number,
            })
            .collect();
        let nodes = hierarchy::build(&mut items, margin(&scene.faces, f64::EPSILON));
        Self {
            all,
            order: items.iter().map(|item| item.number).collect(),
            nodes,
        }
    }

    /// Calls `each` with the numbers of occluders in leaves that `outside` does not leave out.
    pub(crate) fn visit(
        &self,
        outside: &mut dyn FnMut(&Node<f64>) -> bool,
        each: &mut dyn FnMut(u32),
    ) {
        let mut stack = [0_u32; crate::geometry::DEPTH + 2];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let node = stack.get(top).and_then(|&i| self.nodes.get(i as usize));
            let Some(node) = node else { break };
            if outside(node) {
                continue;
            }
            let first = node.first as usize;
            if node.count > 0 {
                let leaf = self.order.get(first..first + node.count as usize);
                leaf.unwrap_or(&[]).iter().for_each(|&o| each(o));
            } else if let Some(places) = stack.get_mut(top..top + 2) {
                places.copy_from_slice(&[node.first, node.first + 1]);
                top += 2;
            }
        }
    }
}

/// Adds the polygons that faces of one plane and one side make.
fn merge(scene: &Scene, faces: &[u32], all: &mut Vec<Occluder>) {
    let Some(first) = faces.first().and_then(|&f| scene.faces.get(f as usize)) else {
        return;
    };
    let normal = first.normal;
    let loops = if faces.len() == 1 {
        Vec::from([simplified(
            scene,
            normal,
            scene.outlines.of(faces[0] as usize),
        )])
    } else {
        whole(scene, normal, faces).unwrap_or_else(|| greedy(scene, normal, faces))
    };
    for vertices in loops {
        let points: Vec<Vector<f64>> = vertices.iter().map(|&v| scene.vertex(v)).collect();
        // The plane of what is large is better known than that of its pieces.
        let double = double_area(&points);
        let length = norm(double);
        all.push(Occluder {
            normal: double.map(|x| x / length),
            points,
            vertices,
        });
    }
}

/// The outline without vertices on straight edges.
fn simplified(scene: &Scene, normal: Vector<f64>, outline: &[u32]) -> Vec<u32> {
    let mut own: Vec<u32> = outline.to_vec();
    let mut k = 0;
    while own.len() > 3 && k < own.len() {
        let n = own.len();
        if turns(
            scene,
            normal,
            [own[(k + n - 1) % n], own[k], own[(k + 1) % n]],
        ) == Turn::Straight
        {
            own.remove(k);
        } else {
            k += 1;
        }
    }
    own
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Turn {
    Left,
    Straight,
    Right,
}

/// How an outline turns at a vertex: it is straight if the vertex is on the line between its
/// neighbours, but for the smallest distance.
fn turns(scene: &Scene, normal: Vector<f64>, [a, b, c]: [u32; 3]) -> Turn {
    let [a, b, c] = [a, b, c].map(|v| scene.vertex(v));
    let turn = dot(normal, cross(sub(b, a), sub(c, b)));
    let slack = scene.smallest * norm(sub(c, a));
    if turn > slack {
        Turn::Left
    } else if turn < -slack || dot(sub(b, a), sub(c, b)) < 0.0 {
        Turn::Right
    } else {
        Turn::Straight
    }
}

fn is_convex(scene: &Scene, normal: Vector<f64>, outline: &[u32]) -> bool {
    let n = outline.len();
    n <= MOST
        && (0..n).all(|k| {
            let three = [outline[k], outline[(k + 1) % n], outline[(k + 2) % n]];
            turns(scene, normal, three) == Turn::Left
        })
}

/// The outlines of all faces together, if they are convex and hold the same area.
fn whole(scene: &Scene, normal: Vector<f64>, faces: &[u32]) -> Option<Vec<Vec<u32>>> {
    let mut next: BTreeMap<u32, u32> = BTreeMap::new();
    let mut edges: BTreeMap<[u32; 2], ()> = BTreeMap::new();
    for &f in faces {
        for [a, b] in scene.outlines.edges(f as usize) {
            if edges.remove(&[b, a]).is_none() {
                edges.insert([a, b], ());
            }
        }
    }
    for [a, b] in edges.keys() {
        // A vertex at which two outlines meet.
        if next.insert(*a, *b).is_some() {
            return None;
        }
    }
    let mut loops = Vec::new();
    let mut sum = 0.0;
    while let Some((start, mut at)) = next.pop_first() {
        let mut outline = Vec::from([start]);
        while at != start {
            outline.push(at);
            at = next.remove(&at)?;
        }
        let outline = simplified(scene, normal, &outline);
        if !is_convex(scene, normal, &outline) {
            return None;
        }
        let points: Vec<Vector<f64>> = outline.iter().map(|&v| scene.vertex(v)).collect();
        sum += area(&points);
        loops.push(outline);
    }
    let pieces: f64 = faces
        .iter()
        .filter_map(|&f| scene.faces.get(f as usize))
        .map(|face| face.area)
        .sum();
    ((sum - pieces).abs() <= 1e-9 * pieces).then_some(loops)
}

/// Pairs of polygons with a common edge become one while it is convex: rows first, then rows of
/// rows.
fn greedy(scene: &Scene, normal: Vector<f64>, faces: &[u32]) -> Vec<Vec<u32>> {
    let mut own: Vec<Option<Vec<u32>>> = faces
        .iter()
        .map(|&f| Some(simplified(scene, normal, scene.outlines.of(f as usize))))
        .collect();
    let mut edges: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    let ends = |outline: &[u32], k: usize| [outline[k], outline[(k + 1) % outline.len()]];
    for (i, outline) in own.iter().enumerate() {
        let outline = outline.as_deref().unwrap_or(&[]);
        for k in 0..outline.len() {
            edges.insert(ends(outline, k), i);
        }
    }
    for i in 0..own.len() {
        let grown = Cell::new(true);
        while grown.replace(false) {
            let Some(outline) = own[i].clone() else { break };
            for k in 0..outline.len() {
                let [a, b] = ends(&outline, k);
                let other = edges.get(&[b, a]).copied().filter(|&j| j != i);
                let Some((j, second)) = other.and_then(|j| Some((j, own[j].clone()?))) else {
                    continue;
                };
                let Some(union) = joined(&outline, &second, [a, b]) else {
                    continue;
                };
                let union = simplified(scene, normal, &union);
                if !is_convex(scene, normal, &union) {
                    continue;
                }
                for outline in [&outline, &second] {
                    for k in 0..outline.len() {
                        edges.remove(&ends(outline, k));
                    }
                }
                for k in 0..union.len() {
                    edges.insert(ends(&union, k), i);
                }
                own[j] = None;
                own[i] = Some(union);
                grown.set(true);
                break;
            }
        }
    }
    own.into_iter().flatten().collect()
}

/// The outline around two that have the edge a → b of the first in common.
fn joined(first: &[u32], second: &[u32], [a, b]: [u32; 2]) -> Option<Vec<u32>> {
    let from = first.iter().position(|&v| v == b)?;
    let other = second.iter().position(|&v| v == a)?;
    let mut all: Vec<u32> = (0..first.len())
        .map(|k| first[(from + k) % first.len()])
        .collect();
    // From a, which is last in the first, on to what is before b in the second.
    all.extend((1..second.len() - 1).map(|k| second[(other + k) % second.len()]));
    Some(all)
}
