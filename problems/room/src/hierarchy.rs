//! Building the hierarchy over the walls.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::array::Each;

use crate::geometry::{LANES, LEAF, NO_WALL, Node, Segment, Strip, links};
use crate::vector::{Vector, bounds};

/// What it costs a ray to look into two boxes, in strips of a leaf that it may test in the same time.
const BOXES: f64 = 6.0;

/// How many bins the surface-area heuristic tries.
const BINS: usize = 16;

/// The levels that a tree may have and a ray's stack has room for.
const LEVELS: u32 = 38;

/// A tree over segments, and the strips of its leaves. Boxes are wider by `margin` on every side.
pub(crate) fn build(
    segments: &mut [Segment<f64>],
    margin: f64,
) -> (Vec<Strip<f64>>, Vec<Node<f64>>) {
    let mut nodes = Vec::with_capacity(segments.len());
    let mut strips = Vec::with_capacity(segments.len());
    let empty = Node {
        centre: [0.0; 2],
        half: [0.0; 2],
        first: 0,
        count: 0,
        links: [0; 2],
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
            first: nodes.len() as u32,
            count: 0,
            links: [0; 2],
        };
        // Unevenly, as long as equal halves could still end in time.
        let uneven = level + own.len().max(1).ilog2() + 1 < LEVELS;
        let leaf = leaf(own);
        let cut = split(own, uneven, leaf.as_ref().map(Vec::len));
        match (cut, leaf) {
            (Some(count), _) => {
                let middle = from + count;
                open.push((nodes.len(), from, middle, level + 1));
                open.push((nodes.len() + 1, middle, to, level + 1));
                nodes.extend([empty, empty]);
            }
            (None, leaf) => {
                let leaf = leaf.unwrap_or_default();
                node.first = strips.len() as u32;
                node.count = leaf.len() as u32;
                node.links = links(&leaf);
                strips.extend(leaf);
            }
        }
        if let Some(place) = nodes.get_mut(at) {
            *place = node;
        }
    }
    (strips, nodes)
}

/// The strips of segments: chains of them, one after the other. `None`: they are more than fit into a leaf.
fn leaf(segments: &[Segment<f64>]) -> Option<Vec<Strip<f64>>> {
    if segments.len() >= LANES * LEAF {
        return None;
    }
    let mut left: Vec<Segment<f64>> = segments.to_vec();
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
/// least one, and not all. `None`: they are better off in one leaf, which is one of so many `strips`.
fn split(segments: &mut [Segment<f64>], uneven: bool, strips: Option<usize>) -> Option<usize> {
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
    let bin = |s: &Segment<f64>| {
        let share = (middle(s, axis) - low[axis]) / extent;
        (share * BINS as f64) as usize
    };
    let best = if extent > 0.0 {
        best_cut(segments, &bin)
    } else {
        None
    };
    if let Some(strips) = strips.map(|strips| strips as f64) {
        let [low, high] = hull(segments);
        let own = perimeter(low, high) * segments.len() as f64;
        if best.is_none_or(|(cost, _)| strips <= BOXES + strips * cost / own) {
            return None;
        }
    }
    if let Some((_, cut)) = best.filter(|_| uneven) {
        let mut first = 0;
        for i in 0..segments.len() {
            if bin(&segments[i]) < cut {
                segments.swap(first, i);
                first += 1;
            }
        }
        if first > 0 && first < segments.len() {
            return Some(first);
        }
    }
    segments.select_nth_unstable_by(half, |a, b| middle(a, axis).total_cmp(&middle(b, axis)));
    Some(half)
}

/// The cut of least cost: the number of segments on either side times the perimeter of their box,
/// to which the number of rays that meet it is proportional.
fn best_cut(
    segments: &[Segment<f64>],
    bin: &impl Fn(&Segment<f64>) -> usize,
) -> Option<(f64, usize)> {
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
        (count > 0).then_some(count as f64 * perimeter(low, high))
    };
    let costs = (1..BINS).filter_map(|cut| {
        let (left, right) = bins.split_at(cut);
        Some((cost(left)? + cost(right)?, cut))
    });
    costs.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Half of it.
fn perimeter(low: Vector<f64>, high: Vector<f64>) -> f64 {
    (high[0] - low[0]) + (high[1] - low[1])
}
