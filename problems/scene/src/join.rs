//! Vertices that are one, edges with the vertices of others on them, and the triangles of both.

use alloc::collections::BTreeSet;
use alloc::vec::Vec;

use fredholm_core::array::from_fn;
use fredholm_surfaces::Forest;

use crate::geometry::{Face, Node, Triangle};
use crate::scene::{Outlines, Scene};
use crate::vector::{Vector, dot, norm, ring, sub, turn};

/// How many smallest distances the cells of a grid are wide: so many that few vertices are next to a neighbouring cell.
const CELL: f64 = 1024.0;

/// For every point the number of the first one that it is one with: those nearer to each other than
/// `smallest`.
pub(crate) fn numbers(points: &[Vector<f64>], smallest: f64) -> Vec<u32> {
    let cell = |p: Vector<f64>| p.map(|x| (x / (CELL * smallest)).clamp(-4e18, 4e18) as i64);
    let mut grid: BTreeSet<([i64; 3], u32)> = BTreeSet::new();
    let mut parts = Forest::new(points.len());
    for (v, &point) in (0..).zip(points) {
        let [low, high] = [-smallest, smallest].map(|by| cell(point.map(|x| x + by)));
        let mut is_copy = false;
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let key = [x, y, z];
                    for &(_, other) in grid.range((key, 0)..=(key, u32::MAX)) {
                        let there = points.get(other as usize).copied().unwrap_or_default();
                        if norm(sub(there, point)) <= smallest {
                            parts.unite(v, other);
                            is_copy |= there == point;
                        }
                    }
                }
            }
        }
        // One of several copies stands for all.
        if !is_copy {
            grid.insert((cell(point), v));
        }
    }
    (0..points.len() as u32).map(|v| parts.root(v)).collect()
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
/// faces, whose boxes are wider by `near`.
pub(crate) fn outlines(scene: &Scene, numbers: &[u32], near: f64) -> Outlines {
    // Face, edge, distance along it, vertex.
    let mut found: Vec<(u32, u32, f64, u32)> = Vec::new();
    let geometry = scene.geometry();
    for (v, &number) in numbers.iter().enumerate() {
        let vertex = v as u32;
        if vertex != number {
            continue;
        }
        let point = scene.vertex(vertex);
        let off =
            |node: &Node<f64>| (0..3).any(|k| point[k] < node.low[k] || point[k] > node.high[k]);
        for triangle in geometry.but(off) {
            let Some(face) = scene.faces.get(triangle.face as usize) else {
                continue;
            };
            if face.vertices.contains(&vertex) || face.height(point).abs() > 2.0 * near {
                continue;
            }
            for (edge, [from, to]) in (0..).zip(ring(face.polygon())) {
                let (span, aim) = (sub(to, from), sub(point, from));
                let length = norm(span);
                let ahead = dot(span, aim) / length;
                let aside = norm(from_fn(|k| aim[k] - ahead * span[k] / length));
                if aside <= near && ahead > 0.0 && ahead < length {
                    found.push((triangle.face, edge, ahead, vertex));
                }
            }
        }
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
