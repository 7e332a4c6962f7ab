//! Trees of boxes, whose children stand side by side behind their parents.

use core::iter::from_fn;
use core::ops::Range;

/// The most levels of any tree.
pub const DEPTH: usize = 60;

/// A box of a tree.
pub trait TreeNode {
    /// The first of what a leaf holds, otherwise the first of two children.
    fn first(&self) -> u32;

    /// The number of what a leaf holds, 0 for other nodes.
    fn count(&self) -> u32;
}

/// Whether nodes make a tree of at most so many levels, [`DEPTH`] or fewer, in which children follow their parents, and in which
/// all leaves are `right`.
pub fn is_tree<N: TreeNode>(nodes: &[N], levels: usize, right: impl Fn(&N) -> bool) -> bool {
    let lead = nodes.iter().enumerate().all(|(i, node)| {
        let first = node.first() as usize;
        if node.count() == 0 {
            first > i && first + 1 < nodes.len()
        } else {
            right(node)
        }
    });
    // No node has two parents: the children of all others are as many as the nodes.
    let inner = nodes.iter().filter(|node| node.count() == 0).count();
    if !lead || 2 * inner + 1 != nodes.len() {
        return false;
    }
    let mut stack = [(0, 0); DEPTH + 2];
    let mut top = 1;
    while top > 0 {
        top -= 1;
        // Nothing here may panic: devices ask, too.
        let Some(&(at, level)) = stack.get(top) else {
            return false;
        };
        let Some(node) = nodes.get(at).filter(|_| level <= levels.min(DEPTH)) else {
            return false;
        };
        if node.count() == 0 {
            let first = node.first() as usize;
            let Some(places) = stack.get_mut(top..top + 2) else {
                return false;
            };
            places.copy_from_slice(&[(first, level + 1), (first + 1, level + 1)]);
            top += 2;
        }
    }
    true
}

/// What the leaves hold that are in no box that is `outside`.
#[inline(always)]
pub fn leaves<N: TreeNode>(
    nodes: &[N],
    mut outside: impl FnMut(&N) -> bool,
) -> impl Iterator<Item = Range<usize>> {
    let mut stack = [0_u32; DEPTH + 2];
    let mut top = 1;
    from_fn(move || {
        while top > 0 {
            top -= 1;
            let node = nodes.get(*stack.get(top)? as usize)?;
            if outside(node) {
                continue;
            }
            let first = node.first();
            if node.count() > 0 {
                return Some(first as usize..(first + node.count()) as usize);
            }
            stack
                .get_mut(top..top + 2)?
                .copy_from_slice(&[first, first + 1]);
            top += 2;
        }
        None
    })
}

/// A ray that looks for the first thing that it meets in a tree.
pub trait Trace<N> {
    /// The type of distances.
    type Distance: PartialOrd;

    /// The distance at which the ray may enter a box, if it does before what it has met.
    fn entry(&self, node: &N) -> Option<Self::Distance>;

    /// Meets what a leaf holds.
    fn meet(&mut self, leaf: &N);
}

/// Lets a ray meet the leaves of a tree in the order in which it enters boxes. `STACK` is the number of nodes for which there is room
/// beside it: two more than levels.
#[inline(always)]
pub fn trace<N: TreeNode, const STACK: usize>(nodes: &[N], ray: &mut impl Trace<N>) {
    // Numbers alone: what waits is looked at again, which is seldom and costs less than clearing distances, too.
    let mut stack = [0_u32; STACK];
    let mut top = 0;
    let mut current = 0;
    while let Some(node) = nodes.get(current as usize) {
        let first = node.first();
        let mut next = None;
        if node.count() > 0 {
            ray.meet(node);
        } else if let Some([left, right, ..]) = nodes.get(first as usize..) {
            next = match (ray.entry(left), ray.entry(right)) {
                (Some(a), Some(b)) => {
                    let is_left = a <= b;
                    if let Some(place) = stack.get_mut(top) {
                        *place = first + u32::from(is_left);
                        top += 1;
                    }
                    Some(first + u32::from(!is_left))
                }
                (Some(_), None) => Some(first),
                (None, Some(_)) => Some(first + 1),
                (None, None) => None,
            };
        }
        while next.is_none() && top > 0 {
            top -= 1;
            let waits = |&number: &u32| ray.entry(nodes.get(number as usize)?);
            next = stack
                .get(top)
                .copied()
                .filter(|number| waits(number).is_some());
        }
        let Some(number) = next else { return };
        current = number;
    }
}
