//! Building the hierarchy over boxes by the surface-area heuristic.

use alloc::vec::Vec;
use fredholm_core::array::from_fn;

use crate::geometry::{DEPTH, Node};
use crate::vector::{Box3, empty_box, join};

/// The most boxes of a leaf.
const LEAF: usize = 4;

/// How many bins the heuristic tries on an axis.
const BINS: usize = 16;

/// What is put into a tree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Item {
    pub(crate) bounds: Box3,
    pub(crate) number: u32,
}

impl Item {
    /// Twice the middle on an axis.
    fn middle(&self, axis: usize) -> f64 {
        self.bounds[0][axis] + self.bounds[1][axis]
    }
}

/// A tree over the items, which it puts in the order of its leaves. Boxes are wider by `margin` on
/// every side. Without items there is one node, an empty leaf.
pub(crate) fn build(items: &mut [Item], margin: f64) -> Vec<Node<f64>> {
    let mut nodes = Vec::with_capacity(items.len());
    let empty = Node {
        low: [0.0; 3],
        high: [0.0; 3],
        first: 0,
        count: 0,
    };
    nodes.push(empty);
    // Node, range of items, level.
    let mut open = Vec::from([(0, 0, items.len(), 0_usize)]);
    while let Some((at, from, to, level)) = open.pop() {
        let Some(own) = items.get_mut(from..to) else {
            continue;
        };
        let [low, high] = own.iter().fold(empty_box(), |b, item| join(b, item.bounds));
        let mut node = Node {
            low: low.map(|x| x - margin),
            high: high.map(|x| x + margin),
            first: from as u32,
            count: own.len() as u32,
        };
        if own.len() > LEAF {
            // Unevenly, as long as equal halves could still end in time.
            let uneven = level + own.len().ilog2() as usize + 2 < DEPTH;
            let middle = from + split(own, uneven);
            node.first = nodes.len() as u32;
            node.count = 0;
            open.push((nodes.len(), from, middle, level + 1));
            open.push((nodes.len() + 1, middle, to, level + 1));
            nodes.extend([empty, empty]);
        }
        if let Some(place) = nodes.get_mut(at) {
            *place = node;
        }
    }
    nodes
}

/// Puts the items of the first child before those of the second, and says how many they are: at
/// least one, and not all.
fn split(items: &mut [Item], uneven: bool) -> usize {
    let half = items.len() / 2;
    let middles = items.iter().fold(empty_box(), |b, item| {
        let m = from_fn(|k| item.middle(k));
        join(b, [m, m])
    });
    let extent: [f64; 3] = from_fn(|k| middles[1][k] - middles[0][k]);
    let bin = |item: &Item, axis: usize| {
        let share = (item.middle(axis) - middles[0][axis]) / extent[axis];
        ((share * BINS as f64) as usize).min(BINS - 1)
    };
    if uneven {
        let cuts = (0..3)
            .filter(|&axis| extent[axis] > 0.0)
            .filter_map(|axis| best_cut(items, axis, &bin));
        if let Some((_, axis, cut)) = cuts.min_by(|a, b| a.0.total_cmp(&b.0)) {
            let mut first = 0;
            for i in 0..items.len() {
                if bin(&items[i], axis) < cut {
                    items.swap(first, i);
                    first += 1;
                }
            }
            if first > 0 && first < items.len() {
                return first;
            }
        }
    }
    let widest = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b]));
    let axis = widest.unwrap_or(0);
    items.select_nth_unstable_by(half, |a, b| a.middle(axis).total_cmp(&b.middle(axis)));
    half
}

/// The cut of an axis of least cost, and its cost: the number of items on either side times the
/// surface of their box, to which the number of rays that meet it is proportional (Goldsmith and
/// Salmon 1987).
fn best_cut(
    items: &[Item],
    axis: usize,
    bin: &impl Fn(&Item, usize) -> usize,
) -> Option<(f64, usize, usize)> {
    let mut bins = [(0_usize, empty_box()); BINS];
    for item in items {
        let (count, all) = &mut bins[bin(item, axis)];
        *count += 1;
        *all = join(*all, item.bounds);
    }
    let add = |a: (usize, Box3), b: &(usize, Box3)| (a.0 + b.0, join(a.1, b.1));
    let cost = |(count, [low, high]): (usize, Box3)| {
        let [x, y, z] = from_fn(|k| high[k] - low[k]);
        count as f64 * (x * y + y * z + z * x)
    };
    // Those above each cut, from the last to the first.
    let mut above = [(0_usize, empty_box()); BINS];
    let mut sum = (0, empty_box());
    for k in (0..BINS).rev() {
        sum = add(sum, &bins[k]);
        above[k] = sum;
    }
    let mut below = (0, empty_box());
    let mut best = None;
    for cut in 1..BINS {
        below = add(below, &bins[cut - 1]);
        if below.0 > 0 && above[cut].0 > 0 {
            let total = cost(below) + cost(above[cut]);
            if best.is_none_or(|(least, _, _)| total < least) {
                best = Some((total, axis, cut));
            }
        }
    }
    best
}
