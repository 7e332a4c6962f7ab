//! What is seen from places in a cell.

use alloc::vec::Vec;

use crate::geometry::{Wall, lambert};
use crate::rays::omega_of;
use crate::vector::{Vector, dot, sub};
use crate::{Point, Room};

/// How often a cell is halved, where its two ends see different walls: what is left of an end of a shadow is 1/64 of it.
const HALVINGS: u32 = 6;
/// The most intervals of a stretch, whose ends are all computed in a score. Of more the narrowest are parts of others.
const INTERVALS: usize = 48;

/// A vertex at which another wall begins to be seen, or the end of a shadow, and its ω.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    omega: f64,
    /// The number of the vertex; ends of shadows are counted down from the largest.
    vertex: u32,
    pub(crate) position: Vector<f64>,
}

/// The end of a shadow on a wall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadowEnd {
    pub(crate) wall: u32,
    pub(crate) position: Vector<f64>,
}

/// The parts of a cell from which the same walls and ends of shadows are seen in the same order, or nearly so.
pub(crate) fn parts(room: &Room<'_, f64>, cell: usize, shadows: &[ShadowEnd]) -> Vec<[f64; 2]> {
    let mut parts = Vec::new();
    split(room, cell, shadows, [0.0, 1.0], HALVINGS, &mut parts);
    parts
}

/// Halves a part of a cell until both ends of each see the same walls, or it is small.
fn split(
    room: &Room<'_, f64>,
    cell: usize,
    shadows: &[ShadowEnd],
    part: [f64; 2],
    halvings: u32,
    out: &mut Vec<[f64; 2]>,
) {
    let [from, to] = part;
    // In a corner itself everything is seen under no angle.
    let inset = 1e-6 * (to - from);
    let vertices = |t: f64| {
        let edges = edges(room, cell, t, shadows).into_iter();
        edges.map(|edge| edge.vertex).collect::<Vec<u32>>()
    };
    if halvings == 0 || vertices(from + inset) == vertices(to - inset) {
        out.push(part);
        return;
    }
    let middle = 0.5 * (from + to);
    split(room, cell, shadows, [from, middle], halvings - 1, out);
    split(room, cell, shadows, [middle, to], halvings - 1, out);
}

/// The vertices at which another wall begins to be seen from a place in a cell, and the ends of shadows that are seen, in the order
/// of their ω.
pub(crate) fn edges(room: &Room<'_, f64>, cell: usize, t: f64, shadows: &[ShadowEnd]) -> Vec<Edge> {
    let geometry = room.geometry();
    let Some(x) = room.inside(cell, t) else {
        return Vec::new();
    };
    let Some(own) = geometry.wall(x.wall() as u32) else {
        return Vec::new();
    };
    let mut all: Vec<Edge> = Vec::new();
    for wall in geometry.all() {
        for (&position, &vertex) in wall.ends.iter().zip(&wall.vertices) {
            let ahead = dot(own.normal(), sub(position, x.position())) > 0.0;
            if ahead && !own.vertices.contains(&vertex) {
                let omega = omega_of(x.position(), own.tangent, position);
                all.push(Edge {
                    omega,
                    vertex,
                    position,
                });
            }
        }
    }
    all.sort_by(|a, b| a.omega.total_cmp(&b.omega).then(a.vertex.cmp(&b.vertex)));
    all.dedup_by_key(|edge| edge.vertex);
    let mut kept = changes(room, &x, own, &all);
    for (number, end) in (0..).zip(shadows) {
        let to = sub(end.position, x.position());
        let is_ahead = end.wall as usize != x.wall() && dot(own.normal(), to) > 0.0;
        if !is_ahead || kept.len() + 1 >= INTERVALS {
            continue;
        }
        let omega = omega_of(x.position(), own.tangent, end.position);
        let hit = geometry.cast(x.wall() as u32, x.position(), lambert(own, omega));
        if hit.is_some_and(|hit| hit.wall == end.wall) {
            let edge = Edge {
                omega,
                vertex: u32::MAX - number,
                position: end.position,
            };
            kept.insert(kept.partition_point(|edge| edge.omega <= omega), edge);
        }
    }
    kept
}

/// The vertices at which another wall is seen: between two neighbours in the list it is one wall.
fn changes(room: &Room<'_, f64>, x: &Point<f64>, own: &Wall<f64>, all: &[Edge]) -> Vec<Edge> {
    let geometry = room.geometry();
    let sees = |omega: f64| {
        let hit = geometry.cast(x.wall() as u32, x.position(), lambert(own, omega));
        hit.map(|hit| hit.wall)
    };
    let mut kept: Vec<Edge> = Vec::new();
    let mut before: Option<(Option<u32>, Option<&Edge>)> = None;
    let ends = all.iter().map(Some).chain([None]);
    let mut from = 0.0;
    for edge in ends {
        let to = edge.map_or(1.0, |edge| edge.omega);
        if to > from {
            let wall = sees(0.5 * (from + to));
            if let Some((old, Some(at))) = before
                && old != wall
            {
                kept.push(*at);
            }
            before = Some((wall, edge));
        } else if let Some((_, at)) = &mut before {
            *at = edge;
        }
        from = to;
    }
    while kept.len() >= INTERVALS {
        let omega = |k: usize| kept.get(k).map_or(1.0, |edge: &Edge| edge.omega);
        let width = |k: &usize| omega(*k + 1) - omega(*k);
        let narrowest = (0..kept.len()).min_by(|a, b| width(a).total_cmp(&width(b)));
        kept.remove(narrowest.unwrap_or(0));
    }
    kept
}
