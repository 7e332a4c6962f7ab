//! Walls, the hierarchy over them, and what a ray meets.

use fredholm_core::Real;
use fredholm_core::array::Each;
use num_traits::{one, zero};

use crate::RoomError;
use crate::vector::{Vector, along, cross, dot, sub};

/// A straight wall. Its active side is on the left of the direction from its first vertex to its
/// second.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Wall<F> {
    /// The vertices of the segment.
    pub ends: [[F; 2]; 2],
    /// The numbers of its vertices: walls that meet have a number in common.
    pub vertices: [u32; 2],
    /// The unit vector from the first vertex to the second.
    pub tangent: [F; 2],
    /// The length of the segment.
    pub length: F,
    /// ρ.
    pub reflectance: F,
    /// F.
    pub emission: F,
}

impl<F: Real> Wall<F> {
    /// The unit vector to the active side.
    #[inline]
    pub(crate) fn normal(&self) -> Vector<F> {
        [-self.tangent[1], self.tangent[0]]
    }

    /// The distance of `point` from the line of the wall, positive on the active side.
    #[inline]
    pub(crate) fn height(&self, point: Vector<F>) -> F {
        cross(self.tangent, sub(point, self.ends[0]))
    }
}

/// A wall as rays see it, in the order of the hierarchy's leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Segment<F> {
    /// The wall's vertices.
    pub ends: [[F; 2]; 2],
    /// Their numbers.
    pub vertices: [u32; 2],
    /// The number of the wall.
    pub wall: u32,
}

/// A box of the hierarchy: centre and half extents, widened so that no rounding error of a test
/// makes a ray miss a wall in it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Node<F> {
    /// The middle of the box.
    pub centre: [F; 2],
    /// Half its width and height.
    pub half: [F; 2],
    /// A leaf's first segment, otherwise the first of two children, which stand side by side.
    pub first: u32,
    /// The number of a leaf's segments, 0 for other nodes.
    pub count: u32,
}

/// The levels that a hierarchy may have.
const DEPTH: usize = 40;

/// The geometry of a room: borrowed tables, all in one scalar.
#[derive(Clone, Copy, Debug)]
pub struct Geometry<'a, F> {
    walls: &'a [Wall<F>],
    segments: &'a [Segment<F>],
    nodes: &'a [Node<F>],
    open: bool,
}

/// The wall and the place that a ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit<F> {
    /// The number of the wall.
    pub wall: u32,
    /// The place on the wall, as a fraction in [0, 1].
    pub fraction: F,
    /// The distance from the ray's origin.
    pub distance: F,
    /// Whether it came from behind.
    pub back: bool,
}

/// Which walls a ray meets, beside the active sides of walls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Backs {
    Pass,
    Block,
}

impl<'a, F: Real> Geometry<'a, F> {
    /// Borrows tables that were made elsewhere, for instance kept as constants of a program. `open` as
    /// in [`Enclosure`](crate::Enclosure).
    ///
    /// What cannot be is refused; whether the numbers are right is not looked at.
    ///
    /// # Errors
    /// [`RoomError::Tables`]: a number in them leads nowhere, a segment is not its wall's, a
    /// material is none, or the hierarchy is no tree of at most 40 levels in which children follow
    /// their parents.
    pub fn new(
        walls: &'a [Wall<F>],
        segments: &'a [Segment<F>],
        nodes: &'a [Node<F>],
        open: bool,
    ) -> Result<Self, RoomError> {
        let geometry = Self {
            walls,
            segments,
            nodes,
            open,
        };
        let possible = zero::<F>()..=one::<F>();
        let materials = walls
            .iter()
            .all(|w| possible.contains(&w.reflectance) && w.emission.is_finite());
        // What rays meet is held twice.
        let segments_lead = segments.len() == walls.len()
            && segments.iter().all(|s| {
                let wall = walls.get(s.wall as usize);
                wall.is_some_and(|w| w.ends == s.ends && w.vertices == s.vertices)
            });
        let nodes_lead = nodes.iter().enumerate().all(|(i, node)| {
            let first = node.first as usize;
            if node.count == 0 {
                first > i && first + 1 < nodes.len()
            } else {
                first + node.count as usize <= segments.len()
            }
        });
        // In a tree no node has two parents: the children of all others are as many as its nodes.
        let inner = nodes.iter().filter(|node| node.count == 0).count();
        let tree = 2 * inner + 1 == nodes.len();
        if materials && segments_lead && nodes_lead && tree && geometry.depth() <= DEPTH {
            Ok(geometry)
        } else {
            Err(RoomError::Tables)
        }
    }

    /// Tables that this crate made.
    #[cfg(feature = "alloc")]
    pub(crate) const fn made(
        walls: &'a [Wall<F>],
        segments: &'a [Segment<F>],
        nodes: &'a [Node<F>],
        open: bool,
    ) -> Self {
        Self {
            walls,
            segments,
            nodes,
            open,
        }
    }

    /// The largest number of nodes that wait on the stack.
    fn depth(&self) -> usize {
        let mut stack = [(0, 0); DEPTH + 2];
        let (mut top, mut deepest) = (1, 0);
        while top > 0 {
            top -= 1;
            let Some(&(node, level)) = stack.get(top) else {
                return usize::MAX;
            };
            deepest = if level > deepest { level } else { deepest };
            let Some(node) = self.nodes.get(node) else {
                return usize::MAX;
            };
            if node.count == 0 {
                let first = node.first as usize;
                let Some(places) = stack.get_mut(top..top + 2) else {
                    return usize::MAX;
                };
                places.copy_from_slice(&[(first, level + 1), (first + 1, level + 1)]);
                top += 2;
            }
        }
        deepest
    }

    /// The walls.
    #[must_use]
    pub const fn walls(&self) -> &'a [Wall<F>] {
        self.walls
    }

    /// The walls as rays see them.
    #[must_use]
    pub const fn segments(&self) -> &'a [Segment<F>] {
        self.segments
    }

    /// The hierarchy.
    #[must_use]
    pub const fn nodes(&self) -> &'a [Node<F>] {
        self.nodes
    }

    /// Whether light may leave.
    #[must_use]
    pub const fn is_open(&self) -> bool {
        self.open
    }

    #[inline]
    pub(crate) fn wall(&self, wall: u32) -> Option<&'a Wall<F>> {
        self.walls.get(wall as usize)
    }

    /// The first wall that a ray from a point of wall `from` to its active side meets; `direction`
    /// has length 1.
    ///
    /// **Rays and vertices.** A vertex V lies on the left or on the right of the ray by the sign of
    /// (direction × (V − origin)), where 0 is left; the number is computed once per vertex and ray
    /// in the same way for every wall that has it, so that a ray passes a vertex on one definite
    /// side and no gap is between walls that share it. A wall is met from its active side where its
    /// first vertex is on the right and its second on the left. The emitting wall is left out by
    /// its number, its own vertices are on the sides where an exact ray from it has them, and a
    /// wall that shares a vertex with it is met where its other end is on the active side, whatever
    /// rounding says about the distance.
    ///
    /// In a closed room walls are not met from behind: an active side comes first. In an open one
    /// they are, and a ray that meets a back first has left.
    #[inline(always)]
    #[must_use]
    pub fn cast(&self, from: u32, origin: [F; 2], direction: [F; 2]) -> Option<Hit<F>> {
        let emitter = self.wall(from)?;
        if self.open {
            let hit = self.nearest(emitter, from, origin, direction, Backs::Block)?;
            (!hit.back).then_some(hit)
        } else {
            self.nearest(emitter, from, origin, direction, Backs::Pass)
        }
    }

    #[inline(always)]
    pub(crate) fn nearest(
        &self,
        emitter: &Wall<F>,
        from: u32,
        origin: Vector<F>,
        direction: Vector<F>,
        backs: Backs,
    ) -> Option<Hit<F>> {
        let mut best: Option<Hit<F>> = None;
        let mut limit = F::from_f64(1e300);
        let spread = [direction[0].abs(), direction[1].abs()];
        // The distance at which the ray may enter a box.
        let entry = |node: &Node<F>, limit: F| -> Option<F> {
            let to = sub(node.centre, origin);
            let aside = spread[0] * node.half[1] + spread[1] * node.half[0];
            let ahead = dot(spread, node.half);
            let distance = dot(direction, to);
            let near = distance - ahead;
            let met =
                cross(direction, to).abs() <= aside && distance + ahead >= zero() && near <= limit;
            met.then_some(near)
        };
        // Numbers alone: what waits is looked at again, which is seldom and costs less than clearing distances, too.
        let mut stack = [0_u32; DEPTH + 2];
        let mut top = 0;
        let mut current = 0;
        'nodes: while let Some(node) = self.nodes.get(current as usize) {
            if node.count == 0 {
                let children = self.nodes.get(node.first as usize..);
                let (left, right) = match children {
                    Some([left, right, ..]) => (entry(left, limit), entry(right, limit)),
                    _ => break,
                };
                let (a, b) = (node.first, node.first + 1);
                match (left, right) {
                    (Some(near_a), Some(near_b)) => {
                        let (next, wait) = if near_a <= near_b { (a, b) } else { (b, a) };
                        if let Some(place) = stack.get_mut(top) {
                            *place = wait;
                            top += 1;
                        }
                        current = next;
                        continue;
                    }
                    (Some(_), None) => {
                        current = a;
                        continue;
                    }
                    (None, Some(_)) => {
                        current = b;
                        continue;
                    }
                    (None, None) => {}
                }
            } else {
                let first = node.first as usize;
                let leaf = self.segments.get(first..first + node.count as usize);
                for segment in leaf.unwrap_or(&[]) {
                    let met = meets(segment, emitter, from, origin, direction, backs);
                    if let Some(hit) = met {
                        // Twins back to back are met at one distance: the active side counts.
                        if hit.distance < limit || (hit.distance == limit && !hit.back) {
                            limit = hit.distance;
                            best = Some(hit);
                        }
                    }
                }
            }
            loop {
                if top == 0 {
                    break 'nodes;
                }
                top -= 1;
                let Some(&number) = stack.get(top) else {
                    break 'nodes;
                };
                let waiting = self.nodes.get(number as usize);
                if waiting.is_some_and(|node| entry(node, limit).is_some()) {
                    current = number;
                    break;
                }
            }
        }
        best
    }

    /// Calls `each` for all segments of leaves that `outside` does not leave out.
    #[inline(always)]
    pub(crate) fn visit(
        &self,
        outside: impl Fn(&Node<F>) -> bool,
        mut each: impl FnMut(&Segment<F>),
    ) {
        let mut stack = [0_u32; DEPTH + 2];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let Some(&number) = stack.get(top) else { break };
            let Some(node) = self.nodes.get(number as usize) else {
                break;
            };
            // All the room is seldom outside.
            if number > 0 && outside(node) {
                continue;
            }
            let first = node.first as usize;
            if node.count > 0 {
                let leaf = self.segments.get(first..first + node.count as usize);
                // Not `for_each`, which calls the closure through a reference and keeps it from being inlined.
                for segment in leaf.unwrap_or(&[]) {
                    each(segment);
                }
            } else if let Some(places) = stack.get_mut(top..top + 2) {
                places.copy_from_slice(&[node.first, node.first + 1]);
                top += 2;
            }
        }
    }
}

/// The widest that two walls at a vertex may be out of line and count as one straight wall, in
/// units of ε: a wall that starts where the emitting one ends, and goes on in its direction, is met
/// by rays that pass its far end on the other side.
const STRAIGHT: f64 = 16.0;

/// Where a ray meets a segment; see [`Geometry::cast`].
#[inline(always)]
fn meets<F: Real>(
    segment: &Segment<F>,
    emitter: &Wall<F>,
    from: u32,
    origin: Vector<F>,
    direction: Vector<F>,
    backs: Backs,
) -> Option<Hit<F>> {
    let to = segment.ends.each(|end| sub(end, origin));
    let turn = to.each(|to| cross(direction, to));
    let [start, end] = emitter.vertices;
    // Whether a vertex is on the left.
    let left = |k: usize| {
        let vertex = segment.vertices[k];
        if vertex == start {
            true
        } else if vertex == end {
            false
        } else {
            turn[k] >= zero()
        }
    };
    let (left_a, left_b) = (left(0), left(1));
    if left_a == left_b {
        return None;
    }
    let back = left_a;
    if (back && backs == Backs::Pass) || segment.wall == from {
        return None;
    }
    // From the vertex on the right to the one on the left, so that twins compute the same.
    let (r, l) = if left_a { (1, 0) } else { (0, 1) };
    let (on_right, on_left) = (turn[r].abs(), turn[l].abs());
    let sum = on_right + on_left;
    let weight = if sum > zero() {
        on_right / sum
    } else {
        F::from_f64(0.5)
    };
    let [near, far] = [dot(direction, to[r]), dot(direction, to[l])];
    let mut distance = near + weight * (far - near);
    let shares = |k: usize| segment.vertices[k] == start || segment.vertices[k] == end;
    let (shares_a, shares_b) = (shares(0), shares(1));
    if shares_a || shares_b {
        if shares_a && shares_b {
            return None;
        }
        let (at, other) = if shares_a { (0, 1) } else { (1, 0) };
        let span = sub(segment.ends[other], segment.ends[at]);
        let height = cross(emitter.tangent, span);
        let straight = F::from_f64(-STRAIGHT) * F::EPSILON;
        if !(height > straight * (span[0].abs() + span[1].abs())) {
            return None;
        }
        distance = distance.max(zero());
    } else if !(distance > zero()) {
        return None;
    }
    Some(Hit {
        wall: segment.wall,
        fraction: if back { one::<F>() - weight } else { weight },
        distance,
        back,
    })
}

impl<F: Real> Hit<F> {
    /// The point of the wall.
    #[inline]
    pub(crate) fn position(&self, wall: &Wall<F>) -> Vector<F> {
        // From the nearer end, so that both ends are met exactly.
        let half = F::from_f64(0.5);
        let span = sub(wall.ends[1], wall.ends[0]);
        if self.fraction <= half {
            along(wall.ends[0], self.fraction, span)
        } else {
            along(wall.ends[1], self.fraction - one::<F>(), span)
        }
    }
}

/// The emitter of rays that do not start on a wall: none, and none of its vertices is any wall's.
#[inline]
pub(crate) fn nobody<F: Real>(at: Vector<F>) -> Wall<F> {
    Wall {
        ends: [at; 2],
        vertices: [u32::MAX; 2],
        tangent: [zero(), one()],
        length: zero(),
        reflectance: zero(),
        emission: zero(),
    }
}

/// The direction of the cosine law: sin φ = 2ξ − 1 is uniform, φ measured from the normal of the
/// wall towards its second vertex.
#[inline]
pub(crate) fn lambert<F: Real>(wall: &Wall<F>, xi: F) -> Vector<F> {
    let sine = xi + xi - one::<F>();
    let root = (xi * (one::<F>() - xi)).max(zero()).sqrt();
    let (cosine, normal) = (root + root, wall.normal());
    [
        wall.tangent[0] * sine + normal[0] * cosine,
        wall.tangent[1] * sine + normal[1] * cosine,
    ]
}

/// ½(sin b − sin a) for two directions from a point of a wall, both in front of it: the form factor
/// from the point to whatever fills the angle between them.
///
/// With e_1, e_2 the unit vectors and n_1, n_2 their heights above the wall,
///
/// ```text
/// sin b − sin a = |e_1 × e_2| (n_1 + n_2)/(1 + e_1·e_2),
/// ```
///
/// a product of numbers of one sign that nothing cancels in; for an obtuse angle the denominator is
/// (e_1 × e_2)²/(1 − e_1·e_2). `turn` is r_1 r_2 e_1 × e_2, from whoever knows it best.
#[inline]
pub(crate) fn factor<F: Real>(normal: Vector<F>, a: Vector<F>, b: Vector<F>, turn: F) -> F {
    let (ra, rb) = (dot(a, a).sqrt(), dot(b, b).sqrt());
    let per = one::<F>() / (ra * rb);
    let (sine, cosine) = ((turn * per).abs(), dot(a, b) * per);
    let heights = dot(normal, a).max(zero()) / ra + dot(normal, b).max(zero()) / rb;
    let ratio = if cosine >= zero() {
        sine / (one::<F>() + cosine)
    } else {
        (one::<F>() - cosine) / sine
    };
    F::from_f64(0.5) * ratio * heights
}
