//! Building the hierarchy over the walls.

use alloc::vec::Vec;

use fredholm_core::Real;

use crate::geometry::{Node, Segment};
use crate::vector::{Vector, bounds};

/// The most segments of a leaf.
const LEAF: usize = 4;

/// How many bins the surface-area heuristic tries.
const BINS: usize = 16;

/// The levels that a tree may have and a ray's stack has room for.
const LEVELS: u32 = 38;

/// A tree over segments, which it puts in the order of its leaves. Boxes are wider by `margin` on
/// every side.
pub(crate) fn build(segments: &mut [Segment<f64>], margin: f64) -> Vec<Node<f64>> {
    let mut nodes = Vec::with_capacity(segments.len());
    let empty = Node {
        centre: [0.0; 2],
        half: [0.0; 2],
        first: 0,
        count: 0,
    };
    nodes.push(empty);
    // Node, range of segments, level.
    let mut open = Vec::from([(0, 0, segments.len(), 0_u32)]);
    while let Some((at, from, to, level)) = open.pop() {
        let Some(own) = segments.get_mut(from..to) else {
            continue;
        };
        let [low, high] = hull(own);
        let mut node = Node {
            centre: [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])],
            half: [
                0.5 * (high[0] - low[0]) + margin,
                0.5 * (high[1] - low[1]) + margin,
            ],
            first: from as u32,
            count: own.len() as u32,
        };
        if own.len() > LEAF {
            // Unevenly, as long as equal halves could still end in time.
            let uneven = level + own.len().ilog2() + 1 < LEVELS;
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

fn hull(segments: &[Segment<f64>]) -> [Vector<f64>; 2] {
    let mut boxes = segments.iter().map(|s| bounds(s.ends[0], s.ends[1]));
    let first = boxes.next().unwrap_or_default();
    boxes.fold(first, join)
}

fn join([low, high]: [Vector<f64>; 2], [other, top]: [Vector<f64>; 2]) -> [Vector<f64>; 2] {
    [
        [low[0].min(other[0]), low[1].min(other[1])],
        [Real::max(high[0], top[0]), Real::max(high[1], top[1])],
    ]
}

/// Twice the middle of a segment on an axis.
fn middle(segment: &Segment<f64>, axis: usize) -> f64 {
    segment.ends[0][axis] + segment.ends[1][axis]
}

/// Puts the segments of the first child before those of the second, and says how many they are: at
/// least one, and not all.
fn split(segments: &mut [Segment<f64>], uneven: bool) -> usize {
    let half = segments.len() / 2;
    let [mut low, mut high] = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for segment in segments.iter() {
        for axis in [0, 1] {
            let middle = middle(segment, axis);
            low[axis] = low[axis].min(middle);
            high[axis] = high[axis].max(middle);
        }
    }
    let axis = usize::from(high[1] - low[1] > high[0] - low[0]);
    let extent = high[axis] - low[axis];
    if uneven && extent > 0.0 {
        let bin = |s: &Segment<f64>| {
            let share = (middle(s, axis) - low[axis]) / extent;
            (share * BINS as f64) as usize
        };
        if let Some(cut) = best_cut(segments, &bin) {
            let mut first = 0;
            for i in 0..segments.len() {
                if bin(&segments[i]) < cut {
                    segments.swap(first, i);
                    first += 1;
                }
            }
            if first > 0 && first < segments.len() {
                return first;
            }
        }
    }
    segments.select_nth_unstable_by(half, |a, b| middle(a, axis).total_cmp(&middle(b, axis)));
    half
}

/// The cut of least cost: the number of segments on either side times the perimeter of their box,
/// to which the number of rays that meet it is proportional.
fn best_cut(segments: &[Segment<f64>], bin: &impl Fn(&Segment<f64>) -> usize) -> Option<usize> {
    let mut bins = [(0_usize, [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]]); BINS];
    for segment in segments {
        let (count, hull) = &mut bins[bin(segment).min(BINS - 1)];
        *count += 1;
        *hull = join(*hull, bounds(segment.ends[0], segment.ends[1]));
    }
    let cost = |bins: &[(usize, [Vector<f64>; 2])]| {
        let empty = (0, [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]]);
        let (count, [low, high]) = bins
            .iter()
            .fold(empty, |(n, hull), &(m, other)| (n + m, join(hull, other)));
        let perimeter = (high[0] - low[0]) + (high[1] - low[1]);
        (count > 0).then_some(count as f64 * perimeter)
    };
    let costs = (1..BINS).filter_map(|cut| {
        let (left, right) = bins.split_at(cut);
        Some((cost(left)? + cost(right)?, cut))
    });
    costs.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, cut)| cut)
}
