//! Vertices that are one, edges with the vertices of others on them, and the triangles of both.

use alloc::vec::Vec;
use fredholm_core::array::from_fn;

use crate::geometry::{Face, Triangle};
use crate::scene::{Outlines, Scene};
use crate::vector::{Vector, dot, hull, norm, sub, turn};

/// The place of a vertex in a grid of cells which are so many smallest distances wide that few
/// vertices are next to a neighbouring cell.
const CELL: f64 = 1024.0;

/// For every point the number of the first one that it is one with: those nearer to each other than
/// `smallest`.
pub(crate) fn numbers(points: &[Vector<f64>], smallest: f64) -> Vec<u32> {
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let at = |v: u32| points.get(v as usize).copied().unwrap_or_default();
    let cell = |p: Vector<f64>| p.map(|x| (x / (CELL * smallest)).clamp(-4e18, 4e18) as i64);
    let keyed = |v: u32| (cell(at(v)), v);
    order.sort_unstable_by_key(|&v| keyed(v));
    let keys: Vec<[i64; 3]> = order.iter().map(|&v| cell(at(v))).collect();
    let mut parent: Vec<u32> = (0..points.len() as u32).collect();
    for (k, &v) in order.iter().enumerate() {
        let point = at(v);
        let (low, high) = (
            cell(point.map(|x| x - smallest)),
            cell(point.map(|x| x + smallest)),
        );
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let key = [x, y, z];
                    let from = if keys.get(k) == Some(&key) {
                        // Those before it in its own cell have met it already.
                        k
                    } else {
                        keys.partition_point(|other| *other < key)
                    };
                    for (&other, _) in order
                        .iter()
                        .zip(&keys)
                        .skip(from)
                        .take_while(|p| *p.1 == key)
                    {
                        // Copies in a row need not be compared with all others.
                        if other != v && norm(sub(at(other), point)) <= smallest {
                            unite(&mut parent, v, other);
                            if at(other) == point && from == k {
                                break;
                            }
                        }
                    }
                }
            }
        }
    }
    (0..points.len() as u32)
        .map(|v| root(&mut parent, v))
        .collect()
}

pub(crate) fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while let Some(&up) = parent.get(v as usize) {
        if up == v {
            break;
        }
        let over = parent.get(up as usize).copied().unwrap_or(up);
        if let Some(place) = parent.get_mut(v as usize) {
            *place = over;
        }
        v = over;
    }
    v
}

pub(crate) fn unite(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parent, a), root(parent, b));
    if let Some(place) = parent.get_mut(a.max(b) as usize) {
        *place = a.min(b);
    }
}

/// The faces' own vertices.
pub(crate) fn plain_outlines(faces: &[Face<f64>]) -> Outlines {
    let mut all = Outlines::default();
    for face in faces {
        all.first.push(all.vertices.len() as u32);
        let own = face.vertices.get(..face.count as usize);
        all.vertices
            .extend_from_slice(own.unwrap_or(&face.vertices));
    }
    all.first.push(all.vertices.len() as u32);
    all
}

/// The faces' own vertices, and those of others that lie on their edges: by the hierarchy over the
/// faces, whose boxes are wider by the smallest distance.
pub(crate) fn outlines(scene: &Scene, numbers: &[u32]) -> Outlines {
    // Face, edge, distance along it, vertex.
    let mut found: Vec<(u32, u32, f64, u32)> = Vec::new();
    let geometry = scene.geometry();
    for (v, &number) in numbers.iter().enumerate() {
        let vertex = v as u32;
        if vertex != number {
            continue;
        }
        let point = scene.vertex(vertex);
        geometry.visit(
            &mut |node| (0..3).any(|k| point[k] < node.low[k] || point[k] > node.high[k]),
            &mut |triangle| {
                let Some(face) = scene.faces.get(triangle.face as usize) else {
                    return;
                };
                if face.vertices.contains(&vertex)
                    || face.height(point).abs() > 2.0 * scene.smallest
                {
                    return;
                }
                for (edge, from) in face.polygon().iter().enumerate() {
                    let to = face.corners[(edge + 1) % face.count as usize];
                    let (span, aim) = (sub(to, *from), sub(point, *from));
                    let length = norm(span);
                    let ahead = dot(span, aim) / length;
                    let aside = norm(from_fn(|k| aim[k] - ahead * span[k] / length));
                    if aside <= scene.smallest && ahead > 0.0 && ahead < length {
                        found.push((triangle.face, edge as u32, ahead, vertex));
                    }
                }
            },
        );
    }
    found.sort_unstable_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)));
    // A quadrilateral is met once for each of its triangles.
    found.dedup_by_key(|f| (f.0, f.1, f.3));
    let mut all = Outlines::default();
    let mut found = found.into_iter().peekable();
    for (f, face) in (0..).zip(&scene.faces) {
        all.first.push(all.vertices.len() as u32);
        for (edge, &vertex) in (0..face.count).zip(&face.vertices) {
            all.vertices.push(vertex);
            while let Some(on) = found.next_if(|on| on.0 == f && on.1 == edge) {
                all.vertices.push(on.3);
            }
        }
    }
    all.first.push(all.vertices.len() as u32);
    all
}

/// The triangles of all faces. A face with vertices of others on its edges is a fan around its
/// middle, of which no triangle is flat; any other is a fan around its first vertex.
pub(crate) fn triangles(scene: &Scene) -> Vec<Triangle<f64>> {
    let mut all = Vec::with_capacity(2 * scene.faces.len());
    for (f, face) in (0..).zip(&scene.faces) {
        let mut add = |a: Vector<f64>, b: Vector<f64>, c: Vector<f64>| {
            all.push(Triangle {
                axes: from_fn(|k| [a[k], b[k], c[k]]),
                face: f,
                plane: face.plane,
            });
        };
        let [a, b, c, d] = face.corners;
        if scene.outlines.of(f as usize).len() > face.count as usize {
            for [from, to] in scene.outlines.edges(f as usize) {
                add(face.middle(), scene.vertex(from), scene.vertex(to));
            }
        } else if face.count == 3 {
            add(a, b, c);
        } else if dot(turn(a, b, c), face.normal) > 0.0 && dot(turn(a, c, d), face.normal) > 0.0 {
            add(a, b, c);
            add(a, c, d);
        } else {
            add(a, b, d);
            add(b, c, d);
        }
    }
    all
}

/// The bounding box of a face.
pub(crate) fn bounds(face: &Face<f64>) -> crate::vector::Box3 {
    hull(face.polygon())
}
