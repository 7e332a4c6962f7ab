//! The equation, its chain and its cells.

use core::ops::Range;

use fredholm_core::array::Each;
use fredholm_core::galerkin::{Basis, Cells};
use fredholm_core::global::Stationary;
use fredholm_core::{
    Chain, Density, Equation, Located, Real, Space, Start, StartOf, Uniforms, Value,
};
use fredholm_surfaces::{Colours, Grey, Tint};
use num_traits::{one, zero};

use crate::geometry::{Backs, Geometry, Wall, lambert, nobody};
use crate::moments::MOST;
use crate::outside::Outside;
use crate::panels::Panels;
use crate::partition::Partition;
use crate::vector::{Vector, along, cross, dot, norm, sub};
use crate::visible::{Part, Viewer};
use crate::{Hit, RoomError};

/// A point of a wall, with what its maker knew: wall, distance from the wall's first vertex, cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point<F> {
    position: [F; 2],
    along: F,
    wall: u32,
    cell: u32,
}

impl<F: Real> Point<F> {
    /// The point of a wall or cell that there is not.
    const NOWHERE: Self = Self {
        position: [F::NAN; 2],
        along: F::NAN,
        wall: u32::MAX,
        cell: u32::MAX,
    };

    /// The coordinates of the point.
    #[inline]
    #[must_use]
    pub const fn position(&self) -> [F; 2] {
        self.position
    }

    /// The number of its wall.
    #[inline]
    #[must_use]
    pub const fn wall(&self) -> usize {
        self.wall as usize
    }

    /// The distance of the point from the wall's first vertex.
    #[inline]
    #[must_use]
    pub const fn along(&self) -> F {
        self.along
    }

    #[inline]
    pub(crate) const fn viewer(&self) -> Viewer<F> {
        Viewer {
            wall: self.wall,
            position: self.position,
        }
    }
}

/// Flatland radiosity in a room, (55) of Heinrich 1995 with shadows:
///
/// ```text
/// u(x) = F(x) + ρ(x) ∫ V(x,y) cos θ_x cos θ_y / (2 |x − y|) u(y) dy
/// ```
///
/// over all walls, where V is 1 where x and y see each other and 0 elsewhere, and θ are the angles
/// of the line from x to y with the walls' normals. The measure is length.
///
/// The chain is p(x,y) = V cos θ_x cos θ_y/(2|x − y|): a walk goes where light goes. Hence k(x,y) = ρ(x), and p_j(x) is
/// the form factor from the point to cell j. Where the room is open a walk that leaves ends.
///
/// A cell may have B = degree + 1 Legendre polynomials, at most 5. Light has one channel, or [several](Self::with_colours) that share the walks.
///
/// **Starts** of global estimates are uniform over the length of all walls. p is symmetric, as light goes both ways: a closed
/// room preserves their density. Of an open one, which walks leave more often in some places than in others, starts alone
/// have it.
#[derive(Clone, Copy, Debug)]
pub struct Room<'a, F, C = Grey> {
    geometry: Geometry<'a, F>,
    partition: Partition<'a, F>,
    /// The lengths of all walls before each, and of all.
    lengths: &'a [f64],
    /// The walls whose emission the last step leads to.
    pub(crate) lights: &'a [u32],
    pub(crate) outside: &'a [Outside<F>],
    /// Rules for every number of functions on a cell.
    panels: [Panels<F>; MOST],
    tint: C,
}

impl<'a, F: Real> Room<'a, F> {
    /// The room with these walls and this partition. `lengths` are those of all walls before each, and of all.
    ///
    /// # Errors
    /// [`RoomError::Length`]: `lengths` has not one entry more than there are walls.
    pub fn new(
        geometry: Geometry<'a, F>,
        partition: Partition<'a, F>,
        lengths: &'a [f64],
    ) -> Result<Self, RoomError> {
        let (expected, found) = (geometry.walls().len() + 1, lengths.len());
        if expected != found {
            return Err(RoomError::Length { expected, found });
        }
        Ok(Self::made(geometry, partition, lengths))
    }

    /// The room of tables that belong together.
    pub(crate) fn made(
        geometry: Geometry<'a, F>,
        partition: Partition<'a, F>,
        lengths: &'a [f64],
    ) -> Self {
        Self {
            geometry,
            partition,
            lengths,
            lights: &[],
            outside: &[],
            panels: core::array::from_fn(|b| Panels::new(b + 1)),
            tint: Grey,
        }
    }

    /// The equations of several channels, of which this one has the largest ρ and F on every wall.
    ///
    /// ```
    /// use fredholm_core::Equation;
    /// use fredholm_room::{Colours, Enclosure, Grading, Material, Mesh, Scene, Surface, Tables};
    ///
    /// let grey = [Material { reflectance: 0.5, emission: 0.0 }];
    /// let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
    /// let scene = Scene::new::<f64>(&[Surface { points: &points, materials: &grey }], Enclosure::Closed)?;
    /// let mesh = Mesh::new::<f64>(&scene, 4, Grading::default())?;
    /// let tables = Tables::<f64>::new(&scene, &mesh);
    /// // Four walls that reflect half of the red and a tenth of the green.
    /// let (reflectances, emissions) = ([1.0, 0.2].repeat(4), [0.0; 8]);
    /// let colours = Colours::<_, 2> { channels: 2, reflectances: &reflectances, emissions: &emissions };
    /// let room = tables.room().with_colours(colours)?;
    /// let x = room.on_wall(0, 0.5)?;
    /// assert_eq!(room.kernel(&x, &x).as_slice(), [0.5, 0.1]);
    /// # Ok::<(), fredholm_room::RoomError>(())
    /// ```
    ///
    /// # Errors
    /// [`RoomError::Length`]: more than M channels, or not one number for every wall and channel.
    pub fn with_colours<const M: usize>(
        self,
        colours: Colours<'a, F, M>,
    ) -> Result<Room<'a, F, Colours<'a, F, M>>, RoomError> {
        if let Some([expected, found]) = colours.misfit(self.geometry.walls().len()) {
            return Err(RoomError::Length { expected, found });
        }
        Ok(self.with_tint(colours))
    }
}

impl<'a, F: Real, C> Room<'a, F, C> {
    fn with_tint<D>(&self, tint: D) -> Room<'a, F, D> {
        Room {
            geometry: self.geometry,
            partition: self.partition,
            lengths: self.lengths,
            lights: self.lights,
            outside: self.outside,
            panels: self.panels,
            tint,
        }
    }

    /// The room in one channel, with the largest ρ and F of all.
    #[must_use]
    pub fn grey(&self) -> Room<'a, F> {
        self.with_tint(Grey)
    }

    /// The room with light from outside.
    #[cfg(feature = "alloc")]
    pub(crate) fn with_outside(mut self, outside: &'a [Outside<F>]) -> Self {
        self.outside = outside;
        self
    }

    /// Whether light comes from outside.
    #[must_use]
    pub const fn has_outside(&self) -> bool {
        !self.outside.is_empty()
    }

    /// The walls.
    #[must_use]
    pub const fn geometry(&self) -> &Geometry<'a, F> {
        &self.geometry
    }

    /// The partition.
    #[must_use]
    pub const fn partition(&self) -> &Partition<'a, F> {
        &self.partition
    }

    /// The rules for so many functions on a cell.
    #[inline]
    pub(crate) fn panels(&self, functions: usize) -> &Panels<F> {
        let [.., last] = &self.panels;
        self.panels.get(functions.wrapping_sub(1)).unwrap_or(last)
    }

    /// The point at this fraction of a wall.
    ///
    /// # Errors
    /// [`RoomError::Wall`] where there is no such wall, [`RoomError::Fraction`] outside [0, 1].
    pub fn on_wall(&self, wall: usize, fraction: f64) -> Result<Point<F>, RoomError> {
        let Some(found) = self.geometry.walls().get(wall) else {
            return Err(RoomError::Wall { wall });
        };
        if !(0.0..=1.0).contains(&fraction) {
            return Err(RoomError::Fraction);
        }
        Ok(self.point_of(wall as u32, found, F::from_f64(fraction)))
    }

    /// The point of a room with other cells, in those of this one.
    #[must_use]
    pub fn found(&self, x: &Point<F>) -> Point<F> {
        let cell = self.partition.find(x.wall, x.along);
        Point { cell, ..*x }
    }

    /// The point at the fraction `t` of cell `cell`.
    #[must_use]
    pub fn inside(&self, cell: usize, t: F) -> Option<Point<F>> {
        let (wall, from, to) = self.partition.edges(cell)?;
        let (near, distance) = if t <= F::from_f64(0.5) {
            (from, t * (to.along - from.along))
        } else {
            (to, (t - one::<F>()) * (to.along - from.along))
        };
        let tangent = self.geometry.wall(wall)?.tangent;
        Some(Point {
            position: along(near.position, distance, tangent),
            along: near.along + distance,
            wall,
            cell: cell as u32,
        })
    }

    #[inline]
    pub(crate) fn point_of(&self, wall: u32, found: &Wall<F>, fraction: F) -> Point<F> {
        let original = self.geometry.original(wall);
        let found = match self.geometry.wall(original) {
            Some(own) if original != wall => own,
            _ => found,
        };
        let wall = original;
        let hit = Hit {
            wall,
            fraction,
            distance: zero(),
            back: false,
        };
        let along = fraction * found.length;
        Point {
            position: hit.position(found),
            along,
            wall,
            cell: self.partition.find(wall, along),
        }
    }

    /// The length of all walls before this one.
    #[inline]
    pub(crate) fn length_before(&self, wall: usize) -> f64 {
        self.lengths.get(wall).copied().unwrap_or(f64::NAN)
    }

    /// A point of consecutive walls by a uniform number, with the same probability on equal lengths.
    #[inline]
    pub(crate) fn uniform_on(&self, walls: &Range<usize>, xi: F) -> Point<F> {
        let [begin, end] = [walls.start, walls.end].map(|wall| self.length_before(wall));
        let place = begin + xi.to_f64() * (end - begin);
        let later = self.lengths.get(walls.start + 1..walls.end).unwrap_or(&[]);
        let number = walls.start + later.partition_point(|&sum| sum <= place);
        let before = self.length_before(number);
        let fraction = (place - before) / (self.length_before(number + 1) - before);
        let Some(wall) = self.geometry.walls().get(number) else {
            return Point::NOWHERE;
        };
        self.point_of(number as u32, wall, F::from_f64(fraction.clamp(0.0, 1.0)))
    }

    /// A cell as it lies on its wall, or on a copy of that.
    #[inline]
    pub(crate) fn part_on(&self, cell: usize, w: u32) -> Option<Part<F>> {
        let part = self.partition.part(cell)?;
        if part.wall == w {
            return Some(part);
        }
        let (wall, (_, from, to)) = (self.geometry.wall(w)?, self.partition.edges(cell)?);
        Some(Part {
            wall: w,
            ends: [wall.at(from.along), wall.at(to.along)],
            length: part.length,
        })
    }

    /// Calls `each` with the cells of a wall that lie between two directions from a point, from right to left: the directions between which
    /// each is seen, and whether that is all of it.
    #[inline]
    pub(crate) fn cells_between(
        &self,
        x: Vector<F>,
        w: u32,
        [right, left]: [Vector<F>; 2],
        mut each: impl FnMut(usize, [Vector<F>; 2], bool),
    ) {
        let Some(wall) = self.geometry.wall(w) else {
            return;
        };
        // Where the first direction meets the wall.
        let [a, b] = wall.ends.each(|end| cross(right, sub(end, x)).abs());
        let sum = a + b;
        let fraction = if sum > zero() { a / sum } else { zero() };
        let own = self.geometry.original(w);
        let first = self.partition.find(own, fraction * wall.length) as usize;
        let skip = first.saturating_sub(self.partition.range(own).start);
        let edges = self.partition.of_wall(own).get(skip..).unwrap_or(&[]);
        let mut edges = edges.iter().map(|edge| {
            let position = match own == w {
                true => edge.position,
                false => wall.at(edge.along),
            };
            sub(position, x)
        });
        let mut begin = edges.next().unwrap_or(right);
        let mut from = right;
        for (cell, end) in (first..).zip(edges) {
            let is_last = !(cross(end, left) > zero());
            let to = if is_last { left } else { end };
            if cross(from, to) > zero() {
                each(cell, [from, to], from == begin && to == end);
                from = to;
            }
            if is_last {
                break;
            }
            begin = end;
        }
    }

    /// Where a ray from `x` leads, or `None` where it leaves: the cosine law, by one uniform
    /// number.
    #[inline(always)]
    pub(crate) fn scatter(&self, x: &Point<F>, xi: F) -> Option<Point<F>> {
        let from = self.geometry.wall(x.wall)?;
        let direction = lambert(from, xi);
        let hit = self.geometry.cast(x.wall, x.position, direction)?;
        let wall = self.geometry.wall(hit.wall)?;
        Some(self.point_of(hit.wall, wall, hit.fraction))
    }

    /// Where a ray from `x` leads, as [`scatter`](Self::scatter) has it, by a call: for what is compiled for every number of
    /// functions on a cell.
    #[inline(never)]
    pub(crate) fn ray(&self, x: &Point<F>, xi: F) -> Option<Point<F>> {
        self.scatter(x, xi)
    }

    /// The point of a wall that a ray from a point between the walls meets, or `None` where it
    /// leaves.
    #[inline]
    pub(crate) fn look(&self, position: [F; 2], direction: [F; 2]) -> Option<Point<F>> {
        let nobody = nobody(position);
        let hit = self
            .geometry
            .nearest(&nobody, u32::MAX, position, direction, Backs::Block);
        let hit = hit.filter(|hit| !hit.back)?;
        let wall = self.geometry.wall(hit.wall)?;
        Some(self.point_of(hit.wall, wall, hit.fraction))
    }

    /// ρ in a point.
    #[inline]
    pub(crate) fn reflectance(&self, x: &Point<F>) -> F {
        self.geometry
            .wall(x.wall)
            .map_or(F::NAN, |wall| wall.reflectance)
    }

    /// cos θ_x cos θ_y/(2|x − y|) where each is in front of the other, as if nothing else stood in the room; 0 elsewhere. y is in this
    /// place of this wall, or of a copy.
    #[inline]
    fn facing(&self, x: &Point<F>, (wall, position): (u32, Vector<F>)) -> F {
        let (Some(from), Some(to)) = (self.geometry.wall(x.wall), self.geometry.wall(wall)) else {
            return F::NAN;
        };
        let [out, into] = [from.height(position), to.height(x.position)];
        if x.wall == wall || !(out > zero() && into > zero()) {
            return zero();
        }
        let span = sub(position, x.position);
        let square = dot(span, span);
        F::from_f64(0.5) * out * into / (square * square.sqrt())
    }

    /// Whether `x` sees `y`: the first wall on the way from x is that of y.
    fn sees(&self, x: &Point<F>, (wall, position): (u32, Vector<F>)) -> bool {
        let to = sub(position, x.position);
        let length = norm(to);
        if !(length > zero()) {
            return false;
        }
        let direction = [to[0] / length, to[1] / length];
        let hit = self.geometry.cast(x.wall, x.position, direction);
        hit.is_some_and(|hit| hit.wall == wall)
    }
}

impl<F: Real, C> Space for Room<'_, F, C> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real, C> Chain for Room<'_, F, C> {
    #[inline]
    fn step<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> Option<Point<F>> {
        self.scatter(x, uniforms.uniform())
    }
}

impl<F: Real, C> Density for Room<'_, F, C> {
    fn density(&self, x: &Point<F>, y: &Point<F>) -> F {
        let mut sum = zero();
        for (number, wall) in self.geometry.copies(y.wall as usize) {
            let place = match number == y.wall {
                true => y.position,
                false => wall.at(y.along),
            };
            let density = self.facing(x, (number, place));
            if !(density > zero()) || self.sees(x, (number, place)) {
                sum += density;
            }
        }
        sum
    }
}

impl<F: Real, C: Tint<F>> Equation for Room<'_, F, C> {
    type Value = C::Value;

    #[inline]
    fn kernel(&self, x: &Point<F>, _: &Point<F>) -> C::Value {
        self.tint.reflectance(x.wall).scaled(self.reflectance(x))
    }

    /// The emission of the wall, and what it reflects of the light from outside.
    #[inline]
    fn source<U: Uniforms<F>>(&self, x: &Point<F>, _: &mut U) -> C::Value {
        let own = self.emission(x.wall);
        if self.outside.is_empty() {
            return own;
        }
        own.plus(&self.kernel(x, x).scaled(self.from_outside(x)))
    }

    #[inline(always)]
    fn channels(&self) -> usize {
        self.tint.channels()
    }

    /// ρ(x): with roulette weights stay 1.
    #[inline]
    fn size(&self, x: &Point<F>) -> F {
        self.reflectance(x)
    }

    /// What comes from outside is known.
    fn arriving<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> StartOf<Self> {
        let start = match self.step(x, uniforms) {
            Some(y) => Start::of(self, y, one()),
            None => Start::of(self, *x, zero()),
        };
        let known = self.white(self.from_outside(x));
        Start { known, ..start }
    }
}

impl<F: Real, C: Tint<F>> Room<'_, F, C> {
    /// F of a wall in every channel.
    #[inline]
    pub(crate) fn emission(&self, wall: u32) -> C::Value {
        let own = self.geometry.wall(wall).map_or(F::NAN, |own| own.emission);
        self.tint.emission(wall).scaled(own)
    }

    /// A value with one number in every channel.
    #[inline(always)]
    pub(crate) fn white(&self, x: F) -> C::Value {
        C::Value::splat(self.tint.channels(), x)
    }
}

impl<F: Real, C> Cells for Room<'_, F, C> {
    const DIMENSION: usize = 1;

    fn cells(&self) -> usize {
        self.partition.len()
    }

    #[inline]
    fn locate(&self, x: &Point<F>) -> usize {
        x.cell as usize
    }

    fn measure(&self, cell: usize) -> f64 {
        self.partition.length(cell).to_f64()
    }

    fn point(&self, cell: usize, t: &[f64]) -> Point<F> {
        let t = t.first().copied().unwrap_or(f64::NAN);
        let point = self.inside(cell, F::from_f64(t));
        point.unwrap_or(Point::NOWHERE)
    }

    /// The fraction of the cell before a point.
    #[inline]
    fn parameters(&self, x: &Located<Point<F>>, t: &mut [F]) {
        t.fill(match self.partition.edges(x.cell) {
            Some((_, from, to)) => (x.point.along - from.along) / (to.along - from.along),
            None => F::NAN,
        });
    }

    /// The point of a wall at a fraction of it: the coordinates are the wall's number and the fraction.
    fn at(&self, coordinates: &[f64]) -> Option<Point<F>> {
        match *coordinates {
            [wall, fraction] if wall >= 0.0 && wall as usize as f64 == wall => {
                self.on_wall(wall as usize, fraction).ok()
            }
            _ => None,
        }
    }
}

impl<F: Real, C, const B: usize> Basis<B> for Room<'_, F, C> {}

impl<F: Real, C, E: Space<Scalar = F, Point = Point<F>> + ?Sized> Stationary<E> for Room<'_, F, C> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> Point<F> {
        self.uniform_on(&(0..self.geometry.walls().len()), uniforms.uniform())
    }

    #[inline]
    fn start_density(&self, _: &Point<F>) -> f64 {
        1.0 / self.length_before(self.geometry.walls().len())
    }

    fn is_preserved(&self) -> bool {
        !self.geometry.is_open()
    }
}
