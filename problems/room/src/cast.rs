//! What a ray meets.

use fredholm_core::Real;
use fredholm_core::array::Each;
use fredholm_surfaces::{Trace, trace};
use num_traits::{one, zero};

use crate::geometry::{
    Backs, DEPTH, Geometry, Hit, LANES, LEAF, Node, Segment, Strip, Wall, link, take_bit,
};
use crate::vector::{Vector, cross, dot, sub};

/// A ray from a point of a wall, and what it met.
struct Ray<'e, F> {
    geometry: &'e Geometry<'e, F>,
    emitter: &'e Wall<F>,
    /// The number of the emitting wall.
    from: u32,
    origin: Vector<F>,
    direction: Vector<F>,
    backs: Backs,
    /// Whether rounding has the emitting wall's vertices on the sides of the ray where they are.
    is_plain: bool,
    limit: F,
    best: Option<Hit<F>>,
}

impl<F: Real> Geometry<'_, F> {
    /// The first wall that a ray from a point of wall `from` to its active side meets; `direction`
    /// has length 1.
    ///
    /// **Rays and vertices.** A vertex V lies on the left or on the right of the ray by the sign of
    /// (direction × (V − origin)), where 0 is left; the number is computed in the same way for every
    /// wall that has it, so that a ray passes a vertex on one definite
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
        if self.is_open() {
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
        let mut ray = Ray::new(self, emitter, from, origin, direction, backs);
        trace::<_, { DEPTH + 2 }>(self.nodes(), &mut ray);
        ray.best
    }
}

impl<'e, F: Real> Ray<'e, F> {
    #[inline(always)]
    fn new(
        geometry: &'e Geometry<'e, F>,
        emitter: &'e Wall<F>,
        from: u32,
        origin: Vector<F>,
        direction: Vector<F>,
        backs: Backs,
    ) -> Self {
        let [start, end] = emitter.ends.each(|end| cross(direction, sub(end, origin)));
        // Rays from nowhere on a wall have no vertices that are theirs.
        let free = from == u32::MAX;
        Self {
            geometry,
            emitter,
            from,
            origin,
            direction,
            backs,
            is_plain: free || (start >= zero() && end < zero()),
            limit: F::from_f64(1e300),
            best: None,
        }
    }

    /// Which vertices of a leaf are on the left of the ray: of the four of every strip a bit in the numbers of their lanes.
    ///
    /// Lanes are independent of each other, so that a compiler computes several at a time.
    #[inline(always)]
    fn left(&self, leaf: &[Strip<F>]) -> [u64; LANES] {
        let ([x, y], [dx, dy]) = (self.origin, self.direction);
        let mut left = [0; LANES];
        let mut bit = 1;
        for strip in leaf {
            let [xs, ys] = &strip.places;
            for lane in 0..LANES {
                let turn = dx * (ys[lane] - y) - dy * (xs[lane] - x);
                left[lane] |= if turn >= zero() { bit } else { 0 };
            }
            bit <<= 1;
        }
        left
    }

    /// Meets a wall.
    #[inline(always)]
    fn meet_one(&mut self, segment: &Segment<F>) {
        if let Some(hit) = self.meets(segment) {
            // Twins back to back are met at one distance: the active side counts.
            if hit.distance < self.limit || (hit.distance == self.limit && !hit.back) {
                self.limit = hit.distance;
                self.best = Some(hit);
            }
        }
    }

    /// Where it meets a segment; see [`Geometry::cast`].
    #[inline(always)]
    fn meets(&self, segment: &Segment<F>) -> Option<Hit<F>> {
        let Self {
            emitter,
            from,
            origin,
            direction,
            backs,
            ..
        } = *self;
        if segment.wall == from {
            return None;
        }
        let to = segment.ends.each(|end| sub(end, origin));
        let turn = to.each(|to| cross(direction, to));
        let [start, end] = emitter.vertices;
        // Whether a vertex is on the left.
        let left = |k: usize| match segment.vertices[k] {
            vertex if vertex == start => true,
            vertex if vertex == end => false,
            _ => turn[k] >= zero(),
        };
        let left_a = if self.is_plain {
            turn[0] >= zero()
        } else {
            left(0)
        };
        if !self.is_plain && (left_a == left(1) || (left_a && backs == Backs::Pass)) {
            return None;
        }
        let back = left_a && backs == Backs::Block;
        let along = to.each(|to| dot(direction, to));
        // From the vertex on the right to the one on the left, so that twins compute the same.
        let (r, l) = if back { (1, 0) } else { (0, 1) };
        let (on_right, on_left) = (turn[r].abs(), turn[l].abs());
        let sum = on_right + on_left;
        let weight = if sum > zero() {
            on_right / sum
        } else {
            F::from_f64(0.5)
        };
        let mut distance = along[r] + weight * (along[l] - along[r]);
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
}

impl<F: Real> Trace<Node<F>> for Ray<'_, F> {
    type Distance = F;

    #[inline(always)]
    fn entry(&self, node: &Node<F>) -> Option<F> {
        let direction = self.direction;
        let spread = direction.each(|d| d.abs());
        let to = sub(node.centre, self.origin);
        let aside = spread[0] * node.half[1] + spread[1] * node.half[0];
        let ahead = dot(spread, node.half);
        let distance = dot(direction, to);
        let near = distance - ahead;
        let met =
            cross(direction, to).abs() <= aside && distance + ahead >= zero() && near <= self.limit;
        met.then_some(near)
    }

    /// Meets the walls of a leaf.
    #[inline(always)]
    fn meet(&mut self, node: &Node<F>) {
        let (leaf, links) = (self.geometry.leaf(node), node.bits());
        let [a, b, c, d] = self.left(leaf);
        // Of each vertex with the next one: in sixteen bits each lane.
        let from = a | b << LEAF | c << (2 * LEAF) | d << (3 * LEAF);
        let to = b | c << LEAF | d << (2 * LEAF) | (a >> 1) << (3 * LEAF);
        let met = match self.backs {
            Backs::Pass => !from & to,
            Backs::Block => from ^ to,
        };
        // Where rounding tells otherwise than what is known, all are looked at.
        let mut met = if self.is_plain { met & links } else { links };
        while let Some(at) = take_bit(&mut met) {
            if let Some(segment) = link(leaf, at) {
                self.meet_one(&segment);
            }
        }
    }
}

/// The widest that two walls at a vertex may be out of line and count as one straight wall, in
/// units of ε: a wall that starts where the emitting one ends, and goes on in its direction, is met
/// by rays that pass its far end on the other side.
const STRAIGHT: f64 = 16.0;

#[cfg(all(test, feature = "alloc"))]
mod tests {
    use alloc::vec;
    use alloc::vec::Vec;

    use super::{Backs, Geometry, Hit, Ray, sub};
    use crate::vector::{along, dot, norm};
    use crate::{Enclosure, Material, Scene, Surface};

    /// A square with blocks on a lattice: many rays go through vertices, and along walls.
    fn blocks(side: usize) -> Scene {
        let corners = |[x, y]: [f64; 2], [a, b]: [f64; 2]| {
            vec![[x, y], [x, y + b], [x + a, y + b], [x + a, y], [x, y]]
        };
        let size = 4.0 * side as f64 + 1.0;
        let mut outlines = vec![corners([0.0; 2], [size; 2])];
        outlines[0].reverse();
        for k in 0..side * side {
            let [i, j] = [k / side, k % side];
            let at = [i, j].map(|k| 4.0 * k as f64 + 1.0);
            outlines.push(corners(
                at,
                [1.0 + ((i + j) % 3) as f64, 1.0 + (i % 2) as f64],
            ));
        }
        let material = [Material {
            reflectance: 0.5,
            emission: 0.0,
        }];
        let of = |points| Surface {
            points,
            materials: &material,
        };
        let surfaces: Vec<Surface<'_>> = outlines.iter().map(|points| of(points)).collect();
        Scene::new::<f64>(&surfaces, Enclosure::Open).unwrap()
    }

    /// Meets every wall by itself.
    fn one_by_one(geometry: &Geometry<'_, f64>, mut ray: Ray<'_, f64>) -> Option<Hit<f64>> {
        ray.is_plain = false;
        for (wall, own) in (0..).zip(geometry.walls()) {
            ray.meet_one(&own.segment(wall));
        }
        ray.best
    }

    /// What is met four at a time, by its place in strips, and by boxes of a hierarchy is what is met one by one.
    #[test]
    fn walls_are_met_as_one_by_one() {
        let mut state = 1_u64;
        let mut next = |below: u64| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % below
        };
        for side in [0, 1, 2, 3, 7] {
            let scene = blocks(side);
            let geometry = scene.geometry();
            let mut met = 0;
            for _ in 0..20_000 {
                let from = next(geometry.walls().len() as u64) as u32;
                let wall = geometry.wall(from).unwrap();
                let origin = along(
                    wall.ends[0],
                    next(9) as f64 / 8.0,
                    sub(wall.ends[1], wall.ends[0]),
                );
                // Towards a vertex or the middle of a wall, or anywhere.
                let aim = geometry
                    .wall(next(geometry.walls().len() as u64) as u32)
                    .unwrap();
                let part = [0.0, 1.0, 0.5, 0.3][next(4) as usize];
                let to = sub(
                    along(aim.ends[0], part, sub(aim.ends[1], aim.ends[0])),
                    origin,
                );
                if !(dot(wall.normal(), to) > 0.0) {
                    continue;
                }
                let direction = to.map(|d| d / norm(to));
                for backs in [Backs::Pass, Backs::Block] {
                    let hit = geometry.nearest(wall, from, origin, direction, backs);
                    let ray = Ray::new(&geometry, wall, from, origin, direction, backs);
                    assert_eq!(hit, one_by_one(&geometry, ray), "{origin:?} {direction:?}");
                    met += u32::from(hit.is_some());
                }
            }
            assert!(met > 5000, "{met}");
        }
    }
}
