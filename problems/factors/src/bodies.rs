//! Convex bodies among what hides: from any point outside, the faces of one hide what its outline hides.
//!
//! A ray that passes through a convex body crosses two of its faces. If all but those in one plane are there, a building that
//! stands on the ground without a floor say, it crosses one of them at least. So the union of what the faces hide is what the
//! outline encloses: the edges between a face that is seen from the front and one that is not.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use fredholm_surfaces::Forest;
use fredholm_surfaces::space::{Vector, cross, dot, norm, sub, unit};

use crate::clear::Sheet;
use crate::occluders::Occluder;

/// The most faces of a body: whether it is convex takes time in proportion to their square.
const MOST: usize = 4096;

/// The plane of a face of a body: its normal, outwards, and a point.
#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: Vector<f64>,
    point: Vector<f64>,
}

impl Plane {
    fn height(&self, at: Vector<f64>) -> f64 {
        dot(self.normal, sub(at, self.point))
    }
}

/// An edge, and the faces to its left and right, seen from outside.
#[derive(Clone, Copy, Debug)]
struct Edge {
    ends: [Vector<f64>; 2],
    faces: [u32; 2],
}

/// A convex body.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    /// The numbers of its occluders.
    pub(crate) faces: Vec<u32>,
    pub(crate) points: Vec<Vector<f64>>,
    planes: Vec<Plane>,
    edges: Vec<Edge>,
}

impl Body {
    /// Whether one of its faces separates it from a polygon.
    pub(crate) fn is_apart(&self, polygon: &[Vector<f64>], slack: f64) -> bool {
        self.planes.iter().any(|plane| {
            let heights = || polygon.iter().map(|&p| plane.height(p));
            heights().all(|h| h >= -slack) && heights().any(|h| h > slack)
        })
    }

    /// A length that its distance from a point outside is not below.
    pub(crate) fn distance(&self, from: Vector<f64>) -> f64 {
        let heights = self.planes.iter().map(|plane| plane.height(from));
        heights.fold(f64::NEG_INFINITY, |m: f64, h| m.max(h))
    }

    /// Whether all of it is in front of a polygon.
    pub(crate) fn is_before(&self, sheet: Sheet<'_>, slack: f64) -> bool {
        let first = sheet.points.first().copied().unwrap_or_default();
        let mut points = self.points.iter();
        sheet.far || points.all(|&p| dot(sheet.normal, sub(p, first)) >= -slack)
    }

    /// The body elsewhere: where points are, and where vectors point. A face of it that is at z = 0, but for `slack`, has its normal along z.
    pub(crate) fn placed(
        &self,
        place: impl Fn(&Vector<f64>) -> Vector<f64>,
        turned: impl Fn(Vector<f64>) -> Vector<f64>,
        slack: f64,
    ) -> Self {
        let plane = |own: &Plane| {
            let (normal, point) = (turned(own.normal), place(&own.point));
            let mut corners = self
                .points
                .iter()
                .filter(|&&p| own.height(p).abs() <= slack);
            let is_flat = point[2] == 0.0 && corners.all(|p| place(p)[2] == 0.0);
            let normal = if is_flat {
                [0.0, 0.0, if normal[2] < 0.0 { -1.0 } else { 1.0 }]
            } else {
                normal
            };
            Plane { normal, point }
        };
        let edge = |own: &Edge| Edge {
            ends: own.ends.each_ref().map(&place),
            ..*own
        };
        Self {
            faces: self.faces.clone(),
            points: self.points.iter().map(&place).collect(),
            planes: self.planes.iter().map(plane).collect(),
            edges: self.edges.iter().map(edge).collect(),
        }
    }

    /// The edges of the outline that is seen from somewhere, counter-clockwise, and the planes of the faces at their left. Which planes are
    /// seen from the front is said by their normals and a point of them; `fronts` is a buffer.
    pub(crate) fn outline<'a>(
        &'a self,
        is_front: impl Fn(Vector<f64>, Vector<f64>) -> bool,
        fronts: &'a mut Vec<bool>,
    ) -> impl Iterator<Item = Rim> + 'a {
        fronts.clear();
        let planes = self.planes.iter();
        fronts.extend(planes.map(|plane| is_front(plane.normal, plane.point)));
        let fronts = &*fronts;
        self.edges.iter().filter_map(move |edge| {
            let is_front = |face: u32| fronts.get(face as usize) == Some(&true);
            let [a, b] = edge.ends;
            let (ends, face) = match edge.faces.map(is_front) {
                [true, false] => ([a, b], edge.faces[0]),
                [false, true] => ([b, a], edge.faces[1]),
                _ => return None,
            };
            let Plane { normal, point } = *self.planes.get(face as usize)?;
            Some(Rim {
                ends,
                normal,
                point,
            })
        })
    }
}

/// An edge of an outline, and the plane of the face of which it is an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rim {
    pub(crate) ends: [Vector<f64>; 2],
    pub(crate) normal: Vector<f64>,
    pub(crate) point: Vector<f64>,
}

/// The convex bodies that occluders make.
pub(crate) fn find(occluders: &[Occluder], slack: f64) -> Vec<Body> {
    let mut sides: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    let mut is_plain = alloc::vec![true; occluders.len()];
    for (number, occluder) in (0..).zip(occluders) {
        for edge in occluder.edges() {
            // An edge at which more than two faces meet is none of a body.
            if let Some(other) = sides.insert(edge, number) {
                is_plain[other as usize] = false;
                is_plain[number as usize] = false;
            }
        }
    }
    let mut parts = Forest::new(occluders.len());
    for (&[a, b], &face) in &sides {
        if let Some(&other) = sides.get(&[b, a])
            && is_ridge(occluders, [face, other], slack)
        {
            parts.unite(face, other);
        }
    }
    let mut groups: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for number in 0..occluders.len() as u32 {
        groups.entry(parts.root(number)).or_default().push(number);
    }
    let good = groups.into_values().filter(|faces| {
        (3..=MOST).contains(&faces.len()) && faces.iter().all(|&f| is_plain[f as usize])
    });
    good.filter_map(|faces| body(occluders, faces, &sides, slack))
        .collect()
}

/// Whether each of two faces is behind the other.
fn is_ridge(occluders: &[Occluder], pair: [u32; 2], slack: f64) -> bool {
    let [a, b] = pair.map(|f| occluders.get(f as usize));
    let is_behind = |a: &Occluder, b: &Occluder| b.points.iter().all(|&p| a.height(p) <= slack);
    a.zip(b)
        .is_some_and(|(a, b)| is_behind(a, b) && is_behind(b, a))
}

/// The body of these faces, if it is convex and what is missing of it is in one plane.
fn body(
    occluders: &[Occluder],
    faces: Vec<u32>,
    sides: &BTreeMap<[u32; 2], u32>,
    slack: f64,
) -> Option<Body> {
    let own = || faces.iter().filter_map(|&f| occluders.get(f as usize));
    let mut vertices: Vec<(u32, Vector<f64>)> = own().flat_map(Occluder::corners).collect();
    vertices.sort_unstable_by_key(|v| v.0);
    vertices.dedup_by_key(|v| v.0);
    let points: Vec<Vector<f64>> = vertices.iter().map(|v| v.1).collect();
    let mut planes = Vec::with_capacity(faces.len() + 1);
    for face in own() {
        let point = face.points.first().copied()?;
        let plane = Plane {
            normal: face.normal,
            point,
        };
        if points.iter().any(|&p| plane.height(p) > slack) {
            return None;
        }
        planes.push(plane);
    }
    let place = |face: u32| faces.binary_search(&face).ok().map(|at| at as u32);
    let at = |v: u32| {
        let found = vertices.binary_search_by_key(&v, |own| own.0).ok()?;
        vertices.get(found).map(|own| own.1)
    };
    let (mut edges, mut rim) = (Vec::new(), Vec::new());
    for (number, face) in (0..).zip(own()) {
        for [a, b] in face.edges() {
            let ends = [at(a)?, at(b)?];
            // At the foot of a building a face of the ground is no part of the building.
            match sides.get(&[b, a]).and_then(|&other| place(other)) {
                Some(other) if a < b => edges.push(Edge {
                    ends,
                    faces: [number, other],
                }),
                Some(_) => {}
                None => rim.push((ends, number)),
            }
        }
    }
    if !rim.is_empty() {
        // What is missing has the outline of the others, the other way round.
        let first = rim.first()?.0[0];
        let mut double = [0.0; 3];
        for ([a, b], _) in &rim {
            let turn = cross(sub(*b, first), sub(*a, first));
            for k in 0..3 {
                double[k] += turn[k];
            }
        }
        if norm(double) == 0.0 {
            return None;
        }
        let cap = Plane {
            normal: unit(double),
            point: first,
        };
        let is_flat = |(ends, _): &([Vector<f64>; 2], u32)| {
            ends.iter().all(|&p| cap.height(p).abs() <= slack)
        };
        if !rim.iter().all(is_flat) || points.iter().any(|&p| cap.height(p) > slack) {
            return None;
        }
        let number = planes.len() as u32;
        planes.push(cap);
        edges.extend(rim.into_iter().map(|(ends, face)| Edge {
            ends,
            faces: [face, number],
        }));
    }
    Some(Body {
        faces,
        points,
        planes,
        edges,
    })
}
