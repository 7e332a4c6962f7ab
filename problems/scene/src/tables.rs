//! Owned tables for walks.

use alloc::vec::Vec;

use fredholm_core::Real;

use crate::geometry::{Face, Geometry, Node, Period, Sunlight, Triangle};
use crate::scene::rounding;
use crate::{Enclosure, Scene};

/// The tables of a scene in the walk's scalar.
#[derive(Clone, Debug)]
pub struct Tables<F> {
    faces: Vec<Face<F>>,
    triangles: Vec<Triangle<F>>,
    nodes: Vec<Node<F>>,
    open: bool,
    specular: Vec<F>,
    period: Option<Period<F>>,
    absorptances: Vec<F>,
    sun_in_sky: bool,
}

/// What faces do with sunlight, if there is one absorptance for each.
pub(crate) fn sunlight<F>(absorptances: &[F], of_sky: bool) -> Option<Sunlight<'_, F>> {
    (!absorptances.is_empty()).then_some(Sunlight {
        absorptances,
        of_sky,
    })
}

impl<F: Real> Tables<F> {
    /// Tables of a scene that was made for this scalar.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let to = F::from_f64;
        let vector = |p: [f64; 3]| p.map(to);
        let face = |f: &Face<f64>| Face {
            corners: f.corners.map(vector),
            vertices: f.vertices,
            count: f.count,
            plane: f.plane,
            normal: vector(f.normal),
            area: to(f.area),
            reflectance: to(f.reflectance),
            emission: to(f.emission),
        };
        let triangle = |t: &Triangle<f64>| Triangle {
            axes: t.axes.map(vector),
            face: t.face,
            plane: t.plane,
        };
        // What the rounding of a corner may cut off is less than a margin.
        let margin = rounding(&scene.faces, F::EPSILON.to_f64());
        let node = |n: &Node<f64>| Node {
            low: n.low.map(|x| to(x - margin)),
            high: n.high.map(|x| to(x + margin)),
            first: n.first,
            count: n.count,
        };
        Self {
            faces: scene.faces.iter().map(face).collect(),
            triangles: scene.triangles.iter().map(triangle).collect(),
            nodes: scene.nodes.iter().map(node).collect(),
            open: scene.enclosure() == Enclosure::Open,
            specular: scene.specular.iter().map(|&r| to(r)).collect(),
            absorptances: scene.absorptances.iter().map(|&a| to(a)).collect(),
            sun_in_sky: scene.sun_in_sky,
            period: scene.period.map(|own| Period {
                lengths: own.lengths.map(to),
                low: own.low.map(to),
            }),
        }
    }

    /// The geometry.
    #[must_use]
    pub fn geometry(&self) -> Geometry<'_, F> {
        Geometry::made(&self.faces, &self.triangles, &self.nodes, self.open)
            .with_specular(&self.specular)
            .with_period(self.period)
            .with_sunlight(sunlight(&self.absorptances, self.sun_in_sky))
    }
}
