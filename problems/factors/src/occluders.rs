//! The faces of a plane made into few large convex polygons, which hide the same.

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_scene::{Face, Scene};
use fredholm_surfaces::space::{Vector, cross, dot, norm, ring, sub};
use fredholm_surfaces::{Branch, Enclosure, Item, balanced, hull, leaves, margin};

use crate::bodies::{self, Body};
use crate::holes::Covers;
use crate::rules::{area, double_area};

/// The most vertices of a large polygon: every one costs where it hides something.
const MOST: usize = 12;

/// A convex polygon that hides what is behind it.
#[derive(Clone, Debug)]
pub(crate) struct Occluder {
    /// The vertices, counter-clockwise seen from the active side.
    pub(crate) points: Vec<Vector<f64>>,
    /// Their numbers.
    vertices: Vec<u32>,
    pub(crate) normal: Vector<f64>,
    /// The number of the convex body of which it is a face.
    pub(crate) body: Option<u32>,
}

impl Occluder {
    /// The edges by the numbers of their ends.
    pub(crate) fn edges(&self) -> impl Iterator<Item = [u32; 2]> {
        ring(&self.vertices)
    }

    /// The numbers and places of its vertices.
    pub(crate) fn corners(&self) -> impl Iterator<Item = (u32, Vector<f64>)> {
        self.vertices
            .iter()
            .copied()
            .zip(self.points.iter().copied())
    }

    /// A length that its distance from a point is not below.
    pub(crate) fn distance(&self, from: Vector<f64>) -> f64 {
        let beyond = ring(&self.points).map(|[a, b]| {
            let out = cross(sub(b, a), self.normal);
            dot(out, sub(from, a)) / norm(out)
        });
        beyond.fold(self.height(from).abs(), Real::max)
    }

    #[inline]
    pub(crate) fn height(&self, point: Vector<f64>) -> f64 {
        let first = self.points.first().copied().unwrap_or_default();
        dot(self.normal, sub(point, first))
    }
}

/// All of them, and a hierarchy.
#[derive(Clone, Debug)]
pub(crate) struct Occluders {
    all: Vec<Occluder>,
    bodies: Vec<Body>,
    order: Vec<u32>,
    nodes: Vec<Branch<3>>,
}

impl Occluders {
    /// The occluders of a scene, whose faces have the normals of their planes; what is nearer than `slack` to a line is on it.
    pub(crate) fn new(scene: &Scene, faces: &[Face<f64>], slack: f64) -> Self {
        let mut groups: BTreeMap<(u32, bool), Vec<u32>> = BTreeMap::new();
        for (f, face) in (0..).zip(faces) {
            let first = faces.get(face.plane as usize).unwrap_or(face);
            let same = dot(first.normal, face.normal) > 0.0;
            groups.entry((face.plane, same)).or_default().push(f);
        }
        let mut all: Vec<Occluder> = Vec::new();
        let covers = Covers::new(scene, slack);
        for own in groups.values() {
            let first = own.first().and_then(|&f| faces.get(f as usize));
            let plane = Plane {
                scene,
                covers: &covers,
                faces: own,
                normal: first.map_or([0.0; 3], |face| face.normal),
                slack,
            };
            plane.merge(&mut all);
        }
        // Of twins back to back one hides what both do: in a closed scene that one which is seen.
        if scene.enclosure() == Enclosure::Open {
            let mut seen = BTreeSet::new();
            all.retain(|occluder| {
                let mut vertices = occluder.vertices.clone();
                vertices.sort_unstable();
                seen.insert(vertices)
            });
        }
        let bodies = bodies::find(&all, slack);
        for (number, body) in (0..).zip(&bodies) {
            for &face in &body.faces {
                if let Some(occluder) = all.get_mut(face as usize) {
                    occluder.body = Some(number);
                }
            }
        }
        let item = |(number, occluder): (u32, &Occluder)| Item {
            bounds: hull(&occluder.points),
            number,
        };
        let mut items: Vec<Item<3>> = (0..).zip(&all).map(item).collect();
        let mut nodes = balanced(&mut items);
        let corners = scene.faces().iter().flat_map(|face| face.corners);
        let margin = margin(corners.flatten(), f64::EPSILON);
        for node in &mut nodes {
            node.bounds = node.widened(margin);
        }
        Self {
            all,
            bodies,
            order: items.iter().map(|item| item.number).collect(),
            nodes,
        }
    }

    pub(crate) fn body(&self, number: u32) -> Option<&Body> {
        self.bodies.get(number as usize)
    }

    pub(crate) fn get(&self, number: u32) -> Option<&Occluder> {
        self.all.get(number as usize)
    }

    /// The number of occluders.
    pub(crate) const fn len(&self) -> usize {
        self.all.len()
    }

    /// All occluders but those of boxes that are `outside`.
    pub(crate) fn but(
        &self,
        outside: impl Fn(&Branch<3>) -> bool,
    ) -> impl Iterator<Item = &Occluder> {
        let numbers = leaves(&self.nodes, outside).filter_map(|range| self.order.get(range));
        let numbers = numbers.flatten();
        numbers.filter_map(|&number| self.all.get(number as usize))
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Turn {
    Left,
    Straight,
    Right,
}

/// The faces of one plane and one side.
struct Plane<'a> {
    scene: &'a Scene,
    covers: &'a Covers<'a>,
    faces: &'a [u32],
    normal: Vector<f64>,
    /// What is nearer than this to a line is on it.
    slack: f64,
}

/// An edge of an outline, the numbers of its vertices.
fn edge(outline: &[u32], k: usize) -> [u32; 2] {
    [outline[k], outline[(k + 1) % outline.len()]]
}

impl Plane<'_> {
    /// Adds the polygons that the faces make.
    fn merge(&self, all: &mut Vec<Occluder>) {
        let loops = match self.faces {
            [face] => Vec::from([self.simplified(self.scene.outline(*face as usize))]),
            _ => self.together(),
        };
        for vertices in loops {
            let points = self.points(&vertices);
            // The plane of what is large is better known than that of its pieces.
            let double = double_area(&points);
            let length = norm(double);
            all.push(Occluder {
                normal: double.map(|x| x / length),
                points,
                vertices,
                body: None,
            });
        }
    }

    fn points(&self, outline: &[u32]) -> Vec<Vector<f64>> {
        outline.iter().map(|&v| self.scene.vertex(v)).collect()
    }

    /// The outline without vertices on straight edges.
    fn simplified(&self, outline: &[u32]) -> Vec<u32> {
        let mut own: Vec<u32> = outline.to_vec();
        let mut k = 0;
        while own.len() > 3 && k < own.len() {
            let n = own.len();
            let three = [own[(k + n - 1) % n], own[k], own[(k + 1) % n]];
            if self.turn(three) == Turn::Straight {
                own.remove(k);
            } else {
                k += 1;
            }
        }
        own
    }

    /// How an outline turns at a vertex: it is straight if the three are on a line, but for the smallest distance, and right if it
    /// goes back on that line.
    fn turn(&self, three: [u32; 3]) -> Turn {
        let [a, b, c] = three.map(|v| self.scene.vertex(v));
        let turn = dot(self.normal, cross(sub(b, a), sub(c, b)));
        let sides = [sub(b, a), sub(c, b), sub(c, a)].map(norm);
        let slack = self.slack * sides.into_iter().fold(0.0, Real::max);
        if turn > slack {
            Turn::Left
        } else if turn < -slack || dot(sub(b, a), sub(c, b)) < 0.0 {
            Turn::Right
        } else {
            Turn::Straight
        }
    }

    fn is_convex(&self, outline: &[u32]) -> bool {
        let n = outline.len();
        let three = |k: usize| [outline[k], outline[(k + 1) % n], outline[(k + 2) % n]];
        n <= MOST && (0..n).all(|k| self.turn(three(k)) == Turn::Left)
    }

    /// The length of an outline.
    fn length(&self, outline: &[u32]) -> f64 {
        ring(&self.points(outline))
            .map(|[a, b]| norm(sub(b, a)))
            .sum()
    }

    /// The outlines of all faces together if they are convex, else of few large parts; holes over which something stands are filled.
    fn together(&self) -> Vec<Vec<u32>> {
        let Some(loops) = self.loops() else {
            return self.greedy(Vec::new());
        };
        let is_hole =
            |outline: &Vec<u32>| dot(self.normal, double_area(&self.points(outline))) < 0.0;
        let (holes, outer): (Vec<_>, Vec<_>) = loops.into_iter().partition(is_hole);
        let is_filled = |hole: &Vec<u32>| self.covers.is_covered(hole, self.faces, self.normal);
        let (filled, open): (Vec<_>, Vec<_>) = holes.into_iter().partition(is_filled);
        let simplified = |outline: &Vec<u32>| self.simplified(outline);
        let outer: Vec<Vec<u32>> = outer.iter().map(simplified).collect();
        let mut filled: Vec<Vec<u32>> = filled.iter().map(simplified).collect();
        for hole in &mut filled {
            hole.reverse();
        }
        let size =
            |all: &[Vec<u32>]| -> f64 { all.iter().map(|own| area(&self.points(own))).sum() };
        let faces = self.faces.iter();
        let faces = faces.filter_map(|&f| self.scene.faces().get(f as usize));
        let pieces = faces.map(|face| face.area).sum::<f64>() + size(&filled);
        let around: f64 = outer.iter().map(|outline| self.length(outline)).sum();
        // Outlines that cross each other do not hold the area of their pieces.
        let is_same = (size(&outer) - pieces).abs() <= 1e-9 * pieces + self.slack * around;
        if open.is_empty() && is_same && outer.iter().all(|own| self.is_convex(own)) {
            return outer;
        }
        filled.retain(|hole| self.is_convex(hole));
        self.greedy(filled)
    }

    /// The outlines of all faces together, and those of their holes the other way round. `None` if two of them meet at a vertex.
    fn loops(&self) -> Option<Vec<Vec<u32>>> {
        let mut edges: BTreeSet<[u32; 2]> = BTreeSet::new();
        for &f in self.faces {
            let outline = self.scene.outline(f as usize);
            for k in 0..outline.len() {
                let [a, b] = edge(outline, k);
                if !edges.remove(&[b, a]) {
                    edges.insert([a, b]);
                }
            }
        }
        let mut next: BTreeMap<u32, u32> = BTreeMap::new();
        for [a, b] in edges {
            if next.insert(a, b).is_some() {
                return None;
            }
        }
        let mut loops = Vec::new();
        while let Some((start, mut at)) = next.pop_first() {
            let mut outline = Vec::from([start]);
            while at != start {
                outline.push(at);
                at = next.remove(&at)?;
            }
            loops.push(outline);
        }
        Some(loops)
    }

    /// Pairs of polygons with a common edge become one while it is convex: rows first, then rows of rows. Holes that are filled are
    /// polygons, too.
    fn greedy(&self, filled: Vec<Vec<u32>>) -> Vec<Vec<u32>> {
        let outlines = self.faces.iter().map(|&f| self.scene.outline(f as usize));
        let outlines = outlines.map(|outline| self.simplified(outline));
        let mut own: Vec<Vec<u32>> = outlines.chain(filled).collect();
        let mut edges: BTreeMap<[u32; 2], usize> = BTreeMap::new();
        for (i, outline) in own.iter().enumerate() {
            edges.extend((0..outline.len()).map(|k| (edge(outline, k), i)));
        }
        for i in 0..own.len() {
            while let Some((j, union)) = self.larger(&own, &edges, i) {
                for outline in [i, j].map(|k| core::mem::take(&mut own[k])) {
                    for k in 0..outline.len() {
                        edges.remove(&edge(&outline, k));
                    }
                }
                edges.extend((0..union.len()).map(|k| (edge(&union, k), i)));
                own[i] = union;
            }
        }
        own.retain(|outline| !outline.is_empty());
        own
    }

    /// The first polygon with which this one makes a convex one, and that.
    fn larger(
        &self,
        own: &[Vec<u32>],
        edges: &BTreeMap<[u32; 2], usize>,
        i: usize,
    ) -> Option<(usize, Vec<u32>)> {
        let outline = &own[i];
        (0..outline.len()).find_map(|k| {
            let [a, b] = edge(outline, k);
            let j = *edges.get(&[b, a]).filter(|&&j| j != i)?;
            let union = self.simplified(&joined(outline, &own[j], [a, b])?);
            self.is_convex(&union).then_some((j, union))
        })
    }
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
