//! Which faces lie in one plane.
//!
//! Vertices that were rounded miss their plane by the precision of their coordinates, and the plane of one small face misses those
//! of its neighbours by many times that. So the plane of a set of faces is fitted to all of them, and grows from the largest face
//! on as long as all vertices of the next one are in it.

use alloc::vec::Vec;

use crate::geometry::Face;
use crate::vector::{Vector, centroid, dot, norm, ring, scale, sub};

/// How many times a plane is fitted again to the faces that are in it.
const FITS: usize = 8;

/// A plane: a unit normal and a point.
#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: Vector<f64>,
    point: Vector<f64>,
}

impl Plane {
    /// The plane that fits some faces, whose vectors of area point to the side of `normal`.
    fn of<'a>(faces: impl Iterator<Item = &'a Face<f64>>, normal: Vector<f64>) -> Option<Self> {
        let (mut vector, mut point, mut area) = ([0.0; 3], [0.0; 3], 0.0);
        for face in faces {
            let sign = if dot(face.normal, normal) < 0.0 {
                -1.0
            } else {
                1.0
            };
            let middle = centroid(face.polygon());
            for k in 0..3 {
                vector[k] += sign * face.area * face.normal[k];
                point[k] += face.area * middle[k];
            }
            area += face.area;
        }
        let length = norm(vector);
        (length > 0.0 && area > 0.0).then(|| Self {
            normal: scale(vector, 1.0 / length),
            point: scale(point, 1.0 / area),
        })
    }

    fn holds(&self, face: &Face<f64>, distance: f64) -> bool {
        let mut points = face.polygon().iter();
        points.all(|&p| dot(self.normal, sub(p, self.point)).abs() <= distance)
    }
}

/// Whether two faces may be in one plane whose vertices are off by `distance`: the smaller one then misses the plane of the larger by
/// that and as many times more as it is further away than the larger is thick.
pub(crate) fn may_be_one(a: &Face<f64>, b: &Face<f64>, distance: f64) -> bool {
    let (small, large) = if a.area <= b.area { (a, b) } else { (b, a) };
    let longest = ring(large.polygon()).fold(0.0, |m: f64, [p, q]| m.max(norm(sub(q, p))));
    let thickness = large.area / longest;
    small.polygon().iter().all(|&p| {
        let apart = norm(sub(p, large.corners[0]));
        large.height(p).abs() <= distance * (1.0 + 2.0 * apart / thickness)
    })
}

/// Numbers the planes: faces that are connected by `pairs`, all of whose vertices are within `distance` of one plane, get the smallest
/// number of them. Pairs stand in both directions, in ascending order.
pub(crate) fn number(faces: &mut [Face<f64>], pairs: &[[u32; 2]], distance: f64) {
    let count = faces.len();
    let mut plane: Vec<u32> = (0..count as u32).collect();
    let mut is_done = alloc::vec![false; count];
    let mut order: Vec<u32> = pairs.iter().map(|pair| pair[0]).collect();
    order.dedup();
    let area = |f: u32| faces.get(f as usize).map_or(0.0, |face| face.area);
    order.sort_by(|&a, &b| area(b).total_cmp(&area(a)));
    let neighbours = |f: u32| {
        let from = pairs.partition_point(|pair| pair[0] < f);
        let own = pairs.get(from..).unwrap_or(&[]).iter();
        own.take_while(move |pair| pair[0] == f).map(|pair| pair[1])
    };
    // The region that has seen a face last.
    let mut seen = alloc::vec![u32::MAX; count];
    let mut round = 0;
    let (mut region, mut next): (Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new());
    for seed in order {
        let Some(face) = faces.get(seed as usize) else {
            continue;
        };
        if is_done.get(seed as usize).copied().unwrap_or(true) {
            continue;
        }
        let mut fit = Plane {
            normal: face.normal,
            point: face.corners[0],
        };
        region.clear();
        for _ in 0..FITS {
            next.clear();
            next.push(seed);
            round += 1;
            let mut at = 0;
            while let Some(&f) = next.get(at) {
                at += 1;
                for g in neighbours(f) {
                    let (Some(other), Some(mark)) =
                        (faces.get(g as usize), seen.get_mut(g as usize))
                    else {
                        continue;
                    };
                    let is_free = g != seed && *mark != round && !is_done[g as usize];
                    if is_free && fit.holds(other, distance) {
                        *mark = round;
                        next.push(g);
                    }
                }
            }
            let is_whole = next.len() <= region.len();
            if !is_whole {
                core::mem::swap(&mut region, &mut next);
            }
            let own = region.iter().filter_map(|&f| faces.get(f as usize));
            match Plane::of(own, fit.normal) {
                Some(better) if !is_whole => fit = better,
                _ => break,
            }
        }
        let least = region.iter().copied().min().unwrap_or(seed);
        for &f in &region {
            plane[f as usize] = least;
            is_done[f as usize] = true;
        }
    }
    for (face, plane) in faces.iter_mut().zip(plane) {
        face.plane = plane;
    }
}
