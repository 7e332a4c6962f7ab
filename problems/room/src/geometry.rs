//! Walls, the hierarchy over them, and what a ray meets.

use fredholm_core::Real;
pub(crate) use fredholm_surfaces::Backs;
use fredholm_surfaces::{TreeNode, is_tree, leaves};
use num_traits::{one, zero};

#[cfg(feature = "alloc")]
use crate::Material;
use crate::RoomError;
use crate::vector::{Vector, along, cross, dot, sub};
use crate::visible::Part;

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

    /// The point at this distance from the first vertex.
    #[inline]
    pub(crate) fn at(&self, distance: F) -> Vector<F> {
        // From the nearer end, so that both ends are met exactly.
        if distance <= F::from_f64(0.5) * self.length {
            along(self.ends[0], distance, self.tangent)
        } else {
            along(self.ends[1], distance - self.length, self.tangent)
        }
    }

    /// All of the wall, of this number.
    #[inline]
    pub(crate) fn part(&self, number: u32) -> Part<F> {
        Part {
            wall: number,
            ends: self.ends,
            length: self.length,
        }
    }

    /// The ends of the wall, of this number.
    #[inline(always)]
    pub(crate) fn segment(&self, number: u32) -> Segment<F> {
        Segment {
            ends: self.ends,
            vertices: self.vertices,
            wall: number,
        }
    }

    /// The distance of `point` from the line of the wall, positive on the active side.
    #[inline]
    pub(crate) fn height(&self, point: Vector<F>) -> F {
        cross(self.tangent, sub(point, self.ends[0]))
    }
}

/// The ends of a wall, their numbers, and its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Segment<F> {
    pub(crate) ends: [Vector<F>; 2],
    pub(crate) vertices: [u32; 2],
    pub(crate) wall: u32,
}

/// The vertices of a [`Strip`].
pub(crate) const LANES: usize = 4;

/// Four vertices as rays see them, and the walls that lead from each to the next one of the same leaf.
///
/// On which side of a ray a vertex lies is computed once for all walls of a leaf that meet there, four at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Strip<F> {
    /// The coordinates x of the vertices, and y.
    pub places: [[F; 4]; 2],
    /// The numbers of the vertices.
    pub vertices: [u32; 4],
    /// The number of the wall from each vertex to the next, `u32::MAX` where there is none.
    pub walls: [u32; 4],
}

/// In place of the number of a wall.
pub(crate) const NO_WALL: u32 = u32::MAX;

/// The most strips of a leaf: a ray keeps a bit for every vertex.
pub(crate) const LEAF: usize = 16;

impl<F: Real> Strip<F> {
    /// A vertex and its number.
    #[inline(always)]
    fn vertex(&self, lane: usize) -> Option<(Vector<F>, u32)> {
        let [x, y] = &self.places;
        Some(([*x.get(lane)?, *y.get(lane)?], *self.vertices.get(lane)?))
    }
}

/// The bits of the vertices of a leaf from which a wall leads to the next: [`Node::links`].
pub(crate) fn links<F>(leaf: &[Strip<F>]) -> [u32; 2] {
    let mut links = 0_u64;
    for (s, strip) in leaf.iter().enumerate().take(LEAF) {
        for (l, &wall) in strip.walls.iter().enumerate() {
            links |= u64::from(wall != NO_WALL) << (LEAF * l + s);
        }
    }
    [links as u32, (links >> 32) as u32]
}

/// From vertex number `at` of a leaf to the next. `None`: there is no next one.
#[inline(always)]
pub(crate) fn link<F: Real>(leaf: &[Strip<F>], at: usize) -> Option<Segment<F>> {
    let strip = leaf.get(at / LANES)?;
    let (a, first) = strip.vertex(at % LANES)?;
    let (b, second) = leaf.get((at + 1) / LANES)?.vertex((at + 1) % LANES)?;
    Some(Segment {
        ends: [a, b],
        vertices: [first, second],
        wall: *strip.walls.get(at % LANES)?,
    })
}

/// Takes the lowest of the bits of [`Node::links`], and says which vertex of the leaf it is.
#[inline(always)]
pub(crate) fn take_bit(bits: &mut u64) -> Option<usize> {
    if *bits == 0 {
        return None;
    }
    let bit = bits.trailing_zeros() as usize;
    *bits &= *bits - 1;
    Some(LANES * (bit % LEAF) + bit / LEAF)
}

impl<F> Node<F> {
    /// The links in one number.
    #[inline(always)]
    pub(crate) fn bits(&self) -> u64 {
        let [low, high] = self.links;
        u64::from(low) | u64::from(high) << 32
    }
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
    /// A leaf's first strip, otherwise the first of two children, which stand side by side.
    pub first: u32,
    /// The number of a leaf's strips, at most 16; 0 for other nodes.
    pub count: u32,
    /// The vertices of a leaf from which a wall leads to the next: of each number in its strip 16 bits, the first lowest, with
    /// one for every strip. 0 for other nodes.
    pub links: [u32; 2],
}

impl<F> TreeNode for Node<F> {
    fn first(&self) -> u32 {
        self.first
    }

    fn count(&self) -> u32 {
        self.count
    }
}

/// The levels that a hierarchy may have.
pub(crate) const DEPTH: usize = 40;

/// The geometry of a room: borrowed tables, all in one scalar.
#[derive(Clone, Copy, Debug)]
pub struct Geometry<'a, F> {
    walls: &'a [Wall<F>],
    strips: &'a [Strip<F>],
    nodes: &'a [Node<F>],
    open: bool,
    /// The number of walls that are no copies of others: behind them come whole copies of all, moved by periods.
    own: usize,
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

impl<'a, F: Real> Geometry<'a, F> {
    /// Borrows tables that were made elsewhere, for instance kept as constants of a program. `open` as
    /// in [`Enclosure`](crate::Enclosure).
    ///
    /// What cannot be is refused; whether the numbers are right is not looked at.
    ///
    /// # Errors
    /// [`RoomError::Tables`]: a number in them leads nowhere, a strip's wall is another, a
    /// material is none, or the hierarchy is no tree of at most 40 levels in which children follow
    /// their parents.
    pub fn new(
        walls: &'a [Wall<F>],
        strips: &'a [Strip<F>],
        nodes: &'a [Node<F>],
        open: bool,
    ) -> Result<Self, RoomError> {
        let geometry = Self {
            walls,
            strips,
            nodes,
            open,
            own: walls.len(),
        };
        let possible = zero::<F>()..=one::<F>();
        let materials = walls
            .iter()
            .all(|w| possible.contains(&w.reflectance) && w.emission.is_finite());
        let leads = |node: &Node<F>| {
            let first = node.first as usize;
            let leaf = strips.get(first..first + node.count as usize);
            // No wall leads out of a leaf.
            let last = leaf.and_then(|leaf| leaf.last());
            node.count as usize <= LEAF
                && last.is_some_and(|last| last.walls[3] == NO_WALL)
                && leaf.is_some_and(|leaf| node.links == links(leaf))
        };
        if materials && is_tree(nodes, DEPTH, leads) && geometry.strips_lead() {
            Ok(geometry)
        } else {
            Err(RoomError::Tables)
        }
    }

    /// Tables that this crate made.
    #[cfg(feature = "alloc")]
    pub(crate) const fn made(
        walls: &'a [Wall<F>],
        strips: &'a [Strip<F>],
        nodes: &'a [Node<F>],
        open: bool,
    ) -> Self {
        Self {
            walls,
            strips,
            nodes,
            open,
            own: walls.len(),
        }
    }

    /// Tables of which the first walls are so many, and the rest copies of these.
    #[cfg(feature = "alloc")]
    pub(crate) const fn with_copies(mut self, own: usize) -> Self {
        self.own = own;
        self
    }

    /// The walls, and the copies of them that rays meet, too.
    pub(crate) const fn all(&self) -> &'a [Wall<F>] {
        self.walls
    }

    /// The number of the wall of which this one is a copy, or its own.
    #[inline(always)]
    pub(crate) const fn original(&self, wall: u32) -> u32 {
        if (wall as usize) < self.own {
            return wall;
        }
        match (wall as usize).checked_rem(self.own) {
            Some(original) => original as u32,
            None => wall,
        }
    }

    /// A wall and its copies, with their numbers.
    pub(crate) fn copies(
        &self,
        wall: usize,
    ) -> impl Iterator<Item = (u32, &'a Wall<F>)> + use<'a, F> {
        let all = (0..).zip(self.walls);
        all.skip(wall).step_by(self.own.max(1))
    }

    /// Whether what rays meet are the walls, which are held twice.
    fn strips_lead(&self) -> bool {
        let mut met = 0;
        let lead = (0..self.strips.len() * LANES).all(|at| {
            let strip = self.strips.get(at / LANES);
            if strip.is_some_and(|strip| strip.walls.get(at % LANES) == Some(&NO_WALL)) {
                return true;
            }
            met += 1;
            link(self.strips, at).is_some_and(|segment| {
                let wall = self.wall(segment.wall);
                wall.is_some_and(|w| w.ends == segment.ends && w.vertices == segment.vertices)
            })
        });
        lead && met == self.walls.len()
    }

    /// The walls.
    #[must_use]
    pub const fn walls(&self) -> &'a [Wall<F>] {
        match self.walls.split_at_checked(self.own) {
            Some((own, _)) => own,
            None => self.walls,
        }
    }

    /// The walls as rays see them.
    #[must_use]
    pub const fn strips(&self) -> &'a [Strip<F>] {
        self.strips
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

    /// The strips of a leaf.
    #[inline(always)]
    pub(crate) fn leaf(&self, node: &Node<F>) -> &'a [Strip<F>] {
        let first = node.first as usize;
        let leaf = self.strips.get(first..first + node.count as usize);
        leaf.unwrap_or(&[])
    }

    /// Calls `each` for all segments of leaves that `outside` does not leave out.
    #[inline(always)]
    pub(crate) fn visit(
        &self,
        outside: impl Fn(&Node<F>) -> bool,
        mut each: impl FnMut(&Segment<F>),
    ) {
        for range in leaves(self.nodes, outside) {
            // Not `for_each`, which calls the closure through a reference and keeps it from being inlined.
            for strip in self.strips.get(range).unwrap_or(&[]) {
                for number in strip.walls {
                    if let Some(wall) = self.wall(number) {
                        each(&wall.segment(number));
                    }
                }
            }
        }
    }
}

#[cfg(feature = "alloc")]
impl Geometry<'_, f64> {
    /// The material of a wall; NaN if there is none of this number.
    #[must_use]
    pub fn material(&self, wall: usize) -> Material {
        let of = |own: fn(&Wall<f64>) -> f64| self.walls.get(wall).map_or(f64::NAN, own);
        Material {
            reflectance: of(|wall| wall.reflectance),
            emission: of(|wall| wall.emission),
        }
    }
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
