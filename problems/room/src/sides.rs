//! The regions into which walls cut the plane, by the cycles of sides around them. Exact, by signs.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;
use core::cmp::Ordering;

use fredholm_surfaces::Forest;
use fredholm_surfaces::space::ring;

use crate::scene::{Scene, turn};
use crate::vector::Vector;

/// By the angles in (−π, π] of the directions from `hub` to two points: exact signs.
fn by_direction(hub: Vector<f64>, a: Vector<f64>, b: Vector<f64>) -> Ordering {
    // Below, or to the left on the level of the hub: −π is no angle, π is.
    let lower = |end: Vector<f64>| end[1] < hub[1];
    let left = |end: Vector<f64>| end[1] == hub[1] && end[0] < hub[0];
    let half = |end| {
        if lower(end) {
            0
        } else {
            1 + u8::from(left(end))
        }
    };
    let turn = turn(hub, a, b);
    half(a)
        .cmp(&half(b))
        .then(0.0.partial_cmp(&turn).unwrap_or(Ordering::Equal))
}

/// Sides of walls, two for every pair of vertices between which there are walls, one on each side at most: side 2e has the first
/// vertex of pair e at its start, and side 2e + 1 the second. Both have their region on the left.
pub(crate) struct Sides {
    /// The vertex at which each starts.
    pub(crate) starts: Vec<u32>,
    /// The wall whose active side each is, if it is one's.
    pub(crate) walls: Vec<Option<u32>>,
    /// The side that is active of every wall.
    pub(crate) of_walls: Vec<usize>,
    /// The sides by the numbers of their starts, and by angle.
    around: Vec<usize>,
    /// The number of the cycle of each.
    pub(crate) cycle: Vec<usize>,
    /// The number of cycles.
    pub(crate) cycles: usize,
    /// The last side of the leftmost vertex, the lowest of these, of every set of connected walls: to its left is what is around
    /// the set.
    pub(crate) outermost: Vec<usize>,
}

impl Sides {
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut sides = Self {
            starts: Vec::new(),
            walls: Vec::new(),
            of_walls: Vec::new(),
            around: Vec::new(),
            cycle: Vec::new(),
            cycles: 0,
            outermost: Vec::new(),
        };
        let mut numbers = BTreeMap::new();
        for (w, wall) in (0..).zip(&scene.walls) {
            let [from, to] = wall.vertices;
            let key = [from.min(to), from.max(to)];
            let first = *numbers.entry(key).or_insert_with(|| {
                sides.starts.extend(key);
                sides.walls.extend([None; 2]);
                sides.walls.len() - 2
            });
            let side = first + usize::from(from > to);
            sides.walls[side] = Some(w);
            sides.of_walls.push(side);
        }
        sides.around = (0..sides.walls.len()).collect();
        let at = |side: usize| sides.place(scene, side);
        let mut around = sides.around.clone();
        around.sort_by(|&a, &b| {
            let directions = || by_direction(at(a), at(a ^ 1), at(b ^ 1));
            sides.starts[a].cmp(&sides.starts[b]).then_with(directions)
        });
        sides.around = around;
        sides.go_round();
        sides.find_outermost(scene);
        sides
    }

    /// Follows all cycles: at the end of a side comes the next to the right of the way back.
    fn go_round(&mut self) {
        let mut next = alloc::vec![0; self.walls.len()];
        for fan in self.fans() {
            for [right, left] in ring(fan) {
                next[left ^ 1] = right;
            }
        }
        self.cycle = alloc::vec![usize::MAX; next.len()];
        for first in 0..next.len() {
            let mut side = first;
            while self.cycle[side] == usize::MAX {
                self.cycle[side] = self.cycles;
                side = next[side];
            }
            self.cycles += usize::from(self.cycle[first] == self.cycles);
        }
    }

    fn find_outermost(&mut self, scene: &Scene) {
        let mut set = Forest::new(scene.vertices.len());
        for ends in self.starts.chunks_exact(2) {
            set.unite(ends[0], ends[1]);
        }
        let mut leftmost: BTreeMap<u32, (Vector<f64>, usize)> = BTreeMap::new();
        for fan in self.fans() {
            // The last before the direction to the left.
            let Some(&last) = fan.last() else { continue };
            let own = (self.place(scene, last), last);
            let best = leftmost.entry(set.root(self.starts[last])).or_insert(own);
            if (own.0[0], own.0[1]) < (best.0[0], best.0[1]) {
                *best = own;
            }
        }
        self.outermost = leftmost.into_values().map(|(_, side)| side).collect();
    }

    /// Where a side starts.
    pub(crate) fn place(&self, scene: &Scene, side: usize) -> Vector<f64> {
        scene.vertices[self.starts[side] as usize]
    }

    /// The sides that start at each vertex, by angle.
    pub(crate) fn fans(&self) -> impl Iterator<Item = &[usize]> {
        self.around
            .chunk_by(|&a, &b| self.starts[a] == self.starts[b])
    }
}
