//! Boxes, polygons with many vertices and meshes of rectangles, as polygons of surfaces.

use alloc::vec::Vec;
use fredholm_core::array::from_fn;
use fredholm_surfaces::Material;

use crate::scene::{Polygon, Surface};

/// Surfaces with polygons of their own, all black.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    /// The polygons of each surface.
    pub surfaces: Vec<Vec<Polygon>>,
}

impl Shape {
    /// The surfaces, as [`Scene::new`](crate::Scene::new) takes them.
    #[must_use]
    pub fn surfaces(&self) -> Vec<Surface<'_>> {
        let surface = |polygons| Surface {
            polygons,
            materials: &[Material::BLACK],
        };
        self.surfaces.iter().map(|p| surface(p)).collect()
    }

    /// This shape and another.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.surfaces.extend(other.surfaces);
        self
    }
}

/// The six sides of the box between two corners, seen from inside: low and high in z, y, x.
///
/// ```
/// let room = fredholm_scene::shapes::room([0.0; 3], [2.0, 1.0, 1.0]);
/// assert_eq!(room.surfaces.len(), 6);
/// ```
#[must_use]
pub fn room(low: [f64; 3], high: [f64; 3]) -> Shape {
    let ends = [low, high];
    let side = |axis: usize, upper: usize| {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut corners: [[f64; 3]; 4] = from_fn(|k| {
            let (a, b) = [(0, 0), (1, 0), (1, 1), (0, 1)][k];
            let mut p = [0.0; 3];
            p[axis] = ends[upper][axis];
            p[u] = ends[a][u];
            p[v] = ends[b][v];
            p
        });
        if upper == 1 {
            corners.reverse();
        }
        Vec::from([Polygon::Quad(corners)])
    };
    let order = [(2, 0), (2, 1), (1, 0), (1, 1), (0, 0), (0, 1)];
    Shape {
        surfaces: order.iter().map(|&(axis, end)| side(axis, end)).collect(),
    }
}

/// The six sides of the box between two corners, seen from outside, in the order of [`room`].
#[must_use]
pub fn block(low: [f64; 3], high: [f64; 3]) -> Shape {
    let mut shape = room(low, high);
    for polygon in shape.surfaces.iter_mut().flatten() {
        *polygon = reversed(polygon);
    }
    shape
}

/// The polygon with its active side on the other side.
#[must_use]
pub fn reversed(polygon: &Polygon) -> Polygon {
    match polygon {
        Polygon::Triangle([a, b, c]) => Polygon::Triangle([*a, *c, *b]),
        Polygon::Quad([a, b, c, d]) => Polygon::Quad([*a, *d, *c, *b]),
    }
}

/// A quadrilateral cut into n × n, row by row from its first vertex.
#[must_use]
pub fn grid(corners: [[f64; 3]; 4], n: usize) -> Vec<Polygon> {
    let at = |i: usize, j: usize| {
        let (s, t) = (i as f64 / n as f64, j as f64 / n as f64);
        let [a, b, c, d] = corners;
        from_fn(|k| (1.0 - t) * ((1.0 - s) * a[k] + s * b[k]) + t * ((1.0 - s) * d[k] + s * c[k]))
    };
    let mut all = Vec::with_capacity(n * n);
    for j in 0..n {
        for i in 0..n {
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            all.push(Polygon::Quad(corners));
        }
    }
    all
}

/// A convex polygon with any number of vertices, at least three, as quadrilaterals and at most one
/// triangle: a fan around its first vertex.
#[must_use]
pub fn fan(points: &[[f64; 3]]) -> Vec<Polygon> {
    let Some((&hub, rest)) = points.split_first() else {
        return Vec::new();
    };
    let mut all = Vec::new();
    let mut k = 0;
    while k + 1 < rest.len() {
        if let Some(&[a, b, c]) = rest.get(k..k + 3) {
            all.push(Polygon::Quad([hub, a, b, c]));
            k += 2;
        } else {
            all.push(Polygon::Triangle([hub, rest[k], rest[k + 1]]));
            k += 1;
        }
    }
    all
}
