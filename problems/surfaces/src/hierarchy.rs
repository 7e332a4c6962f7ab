//! Building trees of boxes by the surface-area heuristic.

use alloc::vec::Vec;
use core::ops::Range;

use fredholm_core::Real;
use fredholm_core::array::from_fn;

use crate::tree::{DEPTH, TreeNode};

/// How many bins the heuristic tries on an axis.
const BINS: usize = 16;

/// The lowest and the highest coordinates.
pub type Bounds<const D: usize> = [[f64; D]; 2];

/// The box of nothing.
#[must_use]
pub const fn nothing<const D: usize>() -> Bounds<D> {
    [[f64::INFINITY; D], [f64::NEG_INFINITY; D]]
}

/// The box of two boxes.
#[must_use]
pub fn join<const D: usize>(a: Bounds<D>, b: Bounds<D>) -> Bounds<D> {
    [
        from_fn(|k| a[0][k].min(b[0][k])),
        from_fn(|k| Real::max(a[1][k], b[1][k])),
    ]
}

/// The box of some points.
#[must_use]
pub fn hull<const D: usize>(points: &[[f64; D]]) -> Bounds<D> {
    points.iter().fold(nothing(), |all, &p| join(all, [p, p]))
}

/// The extents' sum over all axes of the products of the others: half the surface in space, half the perimeter in the plane.
fn surface<const D: usize>([low, high]: Bounds<D>) -> f64 {
    let extent = |k: usize| high[k % D] - low[k % D];
    let side = |k: usize| (1..D).map(|j| extent(k + j)).product::<f64>();
    (0..D).map(|k| side(k + D - 1)).sum()
}

/// What is put into a tree.
#[derive(Clone, Copy, Debug)]
pub struct Item<const D: usize> {
    /// The box around it.
    pub bounds: Bounds<D>,
    /// The number of what the box is around.
    pub number: u32,
}

impl<const D: usize> Item<D> {
    /// Twice the middle on an axis.
    fn middle(&self, axis: usize) -> f64 {
        self.bounds[0][axis] + self.bounds[1][axis]
    }
}

/// A box of a tree.
#[derive(Clone, Copy, Debug)]
pub struct Branch<const D: usize> {
    /// The box around all that is in it.
    pub bounds: Bounds<D>,
    /// The first of what a leaf holds, otherwise the first of two children.
    pub first: u32,
    /// The number of what a leaf holds, 0 for other nodes.
    pub count: u32,
}

impl<const D: usize> Branch<D> {
    /// The box, wider by `margin` on every side.
    #[must_use]
    pub fn widened(&self, margin: f64) -> Bounds<D> {
        let [low, high] = self.bounds;
        [from_fn(|k| low[k] - margin), from_fn(|k| high[k] + margin)]
    }
}

impl<const D: usize> TreeNode for Branch<D> {
    fn first(&self) -> u32 {
        self.first
    }

    fn count(&self) -> u32 {
        self.count
    }
}

/// How nodes are cut.
#[derive(Clone, Copy, Debug)]
pub struct Cutting {
    /// The most items of nodes for which no cut is looked for.
    pub least: usize,
    /// The levels that a tree may have.
    pub levels: usize,
    /// Whether all axes are looked at, or that one alone along which the middles of items are furthest apart.
    pub all_axes: bool,
}

/// What rays take, in the number of items times the surface of their box, to which the number of rays that meet it is proportional
/// (Goldsmith and Salmon 1987).
#[derive(Clone, Copy, Debug)]
pub struct Costs {
    /// In both parts after the best cut; infinite, if there is none.
    pub cut: f64,
    /// Without a cut.
    pub whole: f64,
}

/// A tree over items, which it puts in the order of leaves. `leaf` says what a leaf of these items holds, of which the first has this
/// number in the order, or that there is none.
pub fn build<const D: usize>(
    items: &mut [Item<D>],
    cutting: Cutting,
    mut leaf: impl FnMut(&[Item<D>], usize, Costs) -> Option<Range<usize>>,
) -> Vec<Branch<D>> {
    let mut nodes = Vec::with_capacity(items.len());
    let empty = Branch {
        bounds: nothing(),
        first: 0,
        count: 0,
    };
    nodes.push(empty);
    // Node, range of items, level.
    let mut open = Vec::from([(0, 0..items.len(), 0)]);
    while let Some((at, range, level)) = open.pop() {
        let Some(own) = items.get_mut(range.clone()) else {
            continue;
        };
        let bounds = own
            .iter()
            .fold(nothing(), |all, item| join(all, item.bounds));
        let spread = Spread::new(own);
        let axes = 0..if own.len() > cutting.least { D } else { 0 };
        let axes = axes.filter(|&axis| cutting.all_axes || axis == spread.widest());
        let cuts = axes.filter_map(|axis| spread.best_cut(own, axis));
        let cut = cuts.min_by(|a, b| a.cost.total_cmp(&b.cost));
        let costs = Costs {
            cut: cut.map_or(f64::INFINITY, |cut| cut.cost),
            whole: surface(bounds) * own.len() as f64,
        };
        let (first, count) = if let Some(held) = leaf(own, range.start, costs) {
            (held.start, held.len())
        } else {
            // Unevenly, as long as equal halves could still end in time.
            let uneven = level + own.len().max(1).ilog2() as usize + 1 < cutting.levels;
            let middle = range.start + spread.split(own, cut.filter(|_| uneven));
            let first = nodes.len();
            open.push((first, range.start..middle, level + 1));
            open.push((first + 1, middle..range.end, level + 1));
            nodes.extend([empty, empty]);
            (first, 0)
        };
        if let Some(node) = nodes.get_mut(at) {
            *node = Branch {
                bounds,
                first: first as u32,
                count: count as u32,
            };
        }
    }
    nodes
}

/// A cut between bins of an axis.
#[derive(Clone, Copy)]
struct Cut {
    cost: f64,
    axis: usize,
    bin: usize,
}

/// Where the middles of items are.
struct Spread<const D: usize> {
    low: [f64; D],
    /// Twice how far the middles are apart on every axis.
    extent: [f64; D],
}

impl<const D: usize> Spread<D> {
    fn new(items: &[Item<D>]) -> Self {
        let [low, high] = items.iter().fold(nothing(), |all, item| {
            let m = from_fn(|k| item.middle(k));
            join(all, [m, m])
        });
        let extent = from_fn(|k| high[k] - low[k]);
        Self { low, extent }
    }

    fn widest(&self) -> usize {
        (1..D).fold(0, |a, b| {
            if self.extent[b] > self.extent[a] {
                b
            } else {
                a
            }
        })
    }

    fn bin(&self, item: &Item<D>, axis: usize) -> usize {
        let share = (item.middle(axis) - self.low[axis]) / self.extent[axis];
        ((share * BINS as f64) as usize).min(BINS - 1)
    }

    /// The cut of an axis of least cost.
    fn best_cut(&self, items: &[Item<D>], axis: usize) -> Option<Cut> {
        if !(self.extent[axis] > 0.0) {
            return None;
        }
        let mut bins = [(0_usize, nothing()); BINS];
        for item in items {
            let (count, all) = &mut bins[self.bin(item, axis)];
            *count += 1;
            *all = join(*all, item.bounds);
        }
        let add = |a: (usize, Bounds<D>), b: (usize, Bounds<D>)| (a.0 + b.0, join(a.1, b.1));
        let cost =
            |(count, bounds): (usize, _)| (count > 0).then(|| count as f64 * surface(bounds));
        // Those from each bin on, from the last to the first.
        let mut above = bins;
        for bin in (0..BINS - 1).rev() {
            above[bin] = add(above[bin], above[bin + 1]);
        }
        let mut below = (0, nothing());
        let cuts = (1..BINS).filter_map(|bin| {
            below = add(below, bins[bin - 1]);
            let cost = cost(below)? + cost(above[bin])?;
            Some(Cut { cost, axis, bin })
        });
        cuts.min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// Puts the items below a cut first, or without one those in the lower half of the widest axis, and says how many they are: at
    /// least one, and not all of two or more.
    fn split(&self, items: &mut [Item<D>], cut: Option<Cut>) -> usize {
        if let Some(cut) = cut {
            let mut first = 0;
            for i in 0..items.len() {
                if self.bin(&items[i], cut.axis) < cut.bin {
                    items.swap(first, i);
                    first += 1;
                }
            }
            if first > 0 && first < items.len() {
                return first;
            }
        }
        let (half, axis) = (items.len() / 2, self.widest());
        items.select_nth_unstable_by(half, |a, b| a.middle(axis).total_cmp(&b.middle(axis)));
        half
    }
}

/// The most items of a leaf.
const LEAF: usize = 4;

/// A tree over items, which it puts in the order of its leaves.
pub fn balanced<const D: usize>(items: &mut [Item<D>]) -> Vec<Branch<D>> {
    let cutting = Cutting {
        least: LEAF,
        levels: DEPTH - 1,
        all_axes: true,
    };
    build(items, cutting, |own, from, _| {
        (own.len() <= LEAF).then(|| from..from + own.len())
    })
}
