//! Owned tables for walks.

use alloc::vec::Vec;
use fredholm_core::array::Each;

use fredholm_core::Real;

use crate::geometry::{Geometry, Node, Strip, Wall};
use crate::outside::Outside;
use crate::partition::{Edge, Partition, PartitionTables};
use crate::scene::rounding;
use crate::{Enclosure, Mesh, Room, Scene};

/// The tables of a room in the walk's scalar.
#[derive(Clone, Debug)]
pub struct Tables<F> {
    walls: Vec<Wall<F>>,
    strips: Vec<Strip<F>>,
    nodes: Vec<Node<F>>,
    open: bool,
    edges: Vec<Edge<F>>,
    cell_walls: Vec<u32>,
    first: Vec<u32>,
    lengths: Vec<f64>,
    own: usize,
    outside: Vec<Outside<F>>,
}

impl<F: Real> Tables<F> {
    /// The tables of a scene and its mesh in this scalar.
    #[must_use]
    pub fn new(scene: &Scene, mesh: &Mesh) -> Self {
        let to = F::from_f64;
        let pair = |p: [f64; 2]| p.each(to);
        let wall = |w: &Wall<f64>| Wall {
            ends: w.ends.each(pair),
            vertices: w.vertices,
            tangent: pair(w.tangent),
            length: to(w.length),
            reflectance: to(w.reflectance),
            emission: to(w.emission),
        };
        let strip = |s: &Strip<f64>| Strip {
            places: s.places.each(|lanes| lanes.each(to)),
            vertices: s.vertices,
            walls: s.walls,
        };
        // What the rounding of the centre may cut off is less than a margin.
        let margin = rounding(&scene.walls, F::EPSILON.to_f64());
        let node = |n: &Node<f64>| Node {
            centre: pair(n.centre),
            half: n.half.each(|h| to(h + margin)),
            first: n.first,
            count: n.count,
            links: n.links,
        };
        let edge = |e: &Edge<f64>| Edge {
            along: to(e.along),
            position: pair(e.position),
        };
        let mut lengths = Vec::with_capacity(scene.own + 1);
        let mut sum = 0.0;
        lengths.push(sum);
        for wall in scene.geometry().walls() {
            sum += wall.length;
            lengths.push(sum);
        }
        Self {
            walls: scene.walls.iter().map(wall).collect(),
            strips: scene.strips.iter().map(strip).collect(),
            nodes: scene.nodes.iter().map(node).collect(),
            open: scene.enclosure() == Enclosure::Open,
            edges: mesh.edges.iter().map(edge).collect(),
            cell_walls: mesh.walls.clone(),
            first: mesh.first.clone(),
            lengths,
            own: scene.own,
            outside: scene.outside.iter().map(Outside::rounded).collect(),
        }
    }

    /// The walls.
    #[must_use]
    pub fn geometry(&self) -> Geometry<'_, F> {
        Geometry::made(&self.walls, &self.strips, &self.nodes, self.open).with_copies(self.own)
    }

    /// The partition.
    #[must_use]
    pub fn partition(&self) -> Partition<'_, F> {
        Partition::made(PartitionTables {
            edges: &self.edges,
            walls: &self.cell_walls,
            first: &self.first,
        })
    }

    /// The lengths of all walls before each, and of all.
    #[must_use]
    pub fn lengths(&self) -> &[f64] {
        &self.lengths
    }

    /// The room with these tables.
    #[must_use]
    pub fn room(&self) -> Room<'_, F> {
        Room::made(self.geometry(), self.partition(), &self.lengths).with_outside(&self.outside)
    }
}
