//! Building the hierarchy over the walls.

use alloc::vec::Vec;

use fredholm_core::array::{Each, from_fn};
use fredholm_surfaces::{Branch, Cutting, Item, hull};

use crate::geometry::{LANES, LEAF, NO_WALL, Node, Segment, Strip, Wall, links};
use crate::vector::Vector;

/// What it costs a ray to look into two boxes, in strips of a leaf that it may test in the same time.
const BOXES: f64 = 6.0;

/// The levels that a tree may have and a ray's stack has room for.
const LEVELS: usize = 38;

/// A tree over walls, and the strips of its leaves. Boxes are wider by `margin` on every side.
pub(crate) fn build(walls: &[Wall<f64>], margin: f64) -> (Vec<Strip<f64>>, Vec<Node<f64>>) {
    let mut strips = Vec::with_capacity(walls.len());
    let item = |(number, wall): (u32, &Wall<f64>)| Item {
        bounds: hull(&wall.ends),
        number,
    };
    let mut items: Vec<Item<2>> = (0..).zip(walls).map(item).collect();
    let cutting = Cutting {
        least: 0,
        levels: LEVELS,
        all_axes: false,
    };
    let branches = fredholm_surfaces::build(&mut items, cutting, |own, _, costs| {
        let leaf = leaf(walls, own)?;
        let count = leaf.len() as f64;
        let first = strips.len();
        (count <= BOXES + count * costs.cut / costs.whole).then(|| {
            strips.extend(leaf);
            first..strips.len()
        })
    });
    let node = |branch: Branch<2>| {
        let [low, high] = branch.bounds;
        let leaf = branch.first as usize..(branch.first + branch.count) as usize;
        Node {
            centre: from_fn(|k| 0.5 * (low[k] + high[k])),
            half: from_fn(|k| 0.5 * (high[k] - low[k]) + margin),
            first: branch.first,
            count: branch.count,
            links: links(strips.get(leaf).unwrap_or(&[])),
        }
    };
    let nodes = branches.into_iter().map(node).collect();
    (strips, nodes)
}

/// The strips of walls: chains of them, one after the other. `None`: they are more than fit into a leaf.
fn leaf(walls: &[Wall<f64>], items: &[Item<2>]) -> Option<Vec<Strip<f64>>> {
    if items.len() >= LANES * LEAF {
        return None;
    }
    let own = items
        .iter()
        .filter_map(|item| Some(walls.get(item.number as usize)?.segment(item.number)));
    let mut left: Vec<Segment<f64>> = own.collect();
    // Place, number, and the wall to the next.
    let mut vertices: Vec<(Vector<f64>, u32, u32)> = Vec::new();
    while !left.is_empty() {
        let starts = |own: &Segment<f64>| {
            let mut others = left.iter();
            !others.any(|other| other.vertices[1] == own.vertices[0])
        };
        let mut next = Some(left.iter().position(starts).unwrap_or(0));
        while let Some(at) = next {
            let own = left.remove(at);
            vertices.push((own.ends[0], own.vertices[0], own.wall));
            let goes_on = |other: &Segment<f64>| other.vertices[0] == own.vertices[1];
            next = left.iter().position(goes_on);
            if next.is_none() {
                vertices.push((own.ends[1], own.vertices[1], NO_WALL));
            }
        }
    }
    if vertices.len() > LANES * LEAF {
        return None;
    }
    let strip = |own: &[(Vector<f64>, u32, u32)]| {
        let at = |lane: usize| {
            let last = own
                .last()
                .map_or(([0.0; 2], NO_WALL, NO_WALL), |&(place, vertex, _)| {
                    (place, vertex, NO_WALL)
                });
            own.get(lane).copied().unwrap_or(last)
        };
        let lanes = [at(0), at(1), at(2), at(3)];
        Strip {
            places: [
                lanes.each(|(place, ..)| place[0]),
                lanes.each(|(place, ..)| place[1]),
            ],
            vertices: lanes.each(|(_, vertex, _)| vertex),
            walls: lanes.each(|(.., wall)| wall),
        }
    };
    Some(vertices.chunks(LANES).map(strip).collect())
}
