//! Building trees of boxes by the surface-area heuristic.

use alloc::vec::Vec;

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
    /// Its number.
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

/// What becomes of the items of a node.
#[derive(Clone, Debug)]
pub enum Part {
    /// They are a leaf, which holds what has these numbers.
    Leaf(core::ops::Range<usize>),
    /// As many as said are in the first child, the others in the second: at least one in each.
    Children(usize),
}

/// A tree over items. `part` says what becomes of those of a node, which it may put into another order, where they begin among all
/// items, and on which level they are.
pub fn build<const D: usize>(
    items: &mut [Item<D>],
    mut part: impl FnMut(&mut [Item<D>], usize, usize) -> Part,
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
        let (first, count) = match part(own, range.start, level) {
            Part::Leaf(held) => (held.start as u32, held.len() as u32),
            Part::Children(count) => {
                let (first, middle) = (nodes.len(), range.start + count);
                open.push((first, range.start..middle, level + 1));
                open.push((first + 1, middle..range.end, level + 1));
                nodes.extend([empty, empty]);
                (first as u32, 0)
            }
        };
        if let Some(node) = nodes.get_mut(at) {
            *node = Branch {
                bounds,
                first,
                count,
            };
        }
    }
    nodes
}

/// A cut between bins of an axis.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// The number of items on either side times the surface of their box, to which the number of rays that meet it is
    /// proportional (Goldsmith and Salmon 1987).
    pub cost: f64,
    axis: usize,
    bin: usize,
}

/// What items in one box cost: see [`Cut::cost`].
#[must_use]
pub fn cost<const D: usize>(items: &[Item<D>]) -> f64 {
    let bounds = items
        .iter()
        .fold(nothing(), |all, item| join(all, item.bounds));
    surface(bounds) * items.len() as f64
}

/// Where the middles of items are.
#[derive(Clone, Copy, Debug)]
pub struct Spread<const D: usize> {
    low: [f64; D],
    /// Twice how far the middles are apart on every axis.
    pub extent: [f64; D],
}

impl<const D: usize> Spread<D> {
    /// Of these items.
    #[must_use]
    pub fn new(items: &[Item<D>]) -> Self {
        let [low, high] = items.iter().fold(nothing(), |all, item| {
            let m = from_fn(|k| item.middle(k));
            join(all, [m, m])
        });
        let extent = from_fn(|k| high[k] - low[k]);
        Self { low, extent }
    }

    fn bin(&self, item: &Item<D>, axis: usize) -> usize {
        let share = (item.middle(axis) - self.low[axis]) / self.extent[axis];
        ((share * BINS as f64) as usize).min(BINS - 1)
    }

    /// The cut of an axis of least cost.
    #[must_use]
    pub fn best_cut(&self, items: &[Item<D>], axis: usize) -> Option<Cut> {
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

    /// Puts the items below a cut first, or without one those in the lower half of an axis, and says how many they are: at least
    /// one, and not all of two or more.
    pub fn split(&self, items: &mut [Item<D>], cut: Option<Cut>, axis: usize) -> usize {
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
        let half = items.len() / 2;
        items.select_nth_unstable_by(half, |a, b| a.middle(axis).total_cmp(&b.middle(axis)));
        half
    }
}

/// The most items of a leaf.
const LEAF: usize = 4;

/// A tree over items, which it puts in the order of its leaves: cut where it costs least of all axes, as long as equal halves could
/// still end in time.
pub fn balanced<const D: usize>(items: &mut [Item<D>]) -> Vec<Branch<D>> {
    build(items, |own, from, level| {
        if own.len() <= LEAF {
            return Part::Leaf(from..from + own.len());
        }
        let spread = Spread::new(own);
        let uneven = level + own.len().ilog2() as usize + 2 < DEPTH;
        let cuts = (0..D).filter_map(|axis| spread.best_cut(own, axis));
        let cut = cuts
            .min_by(|a, b| a.cost.total_cmp(&b.cost))
            .filter(|_| uneven);
        let extent = spread.extent;
        let widest = (0..D).max_by(|&a, &b| extent[a].total_cmp(&extent[b]));
        Part::Children(spread.split(own, cut, widest.unwrap_or(0)))
    })
}
