//! The equation, its chain and its cells.

use core::ops::Range;

use fredholm_core::galerkin::{Basis, Cells};
use fredholm_core::global::Stationary;
use fredholm_core::{Chain, Density, Equation, Located, Real, Space, Uniforms};
use num_traits::{one, zero};

use crate::geometry::{Backs, Geometry, Wall, lambert, nobody};
use crate::moments::MOST;
use crate::pairs::VisibilityTable;
use crate::panels::Panels;
use crate::partition::Partition;
use crate::vector::{along, dot, norm, sub};
use crate::visible::Viewer;
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
/// A cell may have B = degree + 1 Legendre polynomials, at most 5.
///
/// **Starts** of global estimates are uniform over the length of all walls. p is symmetric, as light goes both ways: a closed
/// room preserves their density. Of an open one, which walks leave more often in some places than in others, starts alone
/// have it.
#[derive(Clone, Copy, Debug)]
pub struct Room<'a, F> {
    geometry: Geometry<'a, F>,
    partition: Partition<'a, F>,
    /// The lengths of all walls before each, and of all.
    lengths: &'a [f64],
    views: VisibilityTable<'a>,
    /// The walls whose emission the last step leads to.
    pub(crate) lights: &'a [u32],
    /// Rules for every number of functions on a cell.
    panels: [Panels<F>; MOST],
}

impl<'a, F: Real> Room<'a, F> {
    /// The room with these walls and this partition. `lengths` are those of all walls before each, and of all; `views` are
    /// those of the partition.
    ///
    /// # Errors
    /// [`RoomError::Length`]: `lengths` has not one entry more than there are walls.
    pub fn new(
        geometry: Geometry<'a, F>,
        partition: Partition<'a, F>,
        lengths: &'a [f64],
        views: VisibilityTable<'a>,
    ) -> Result<Self, RoomError> {
        let (expected, found) = (geometry.walls().len() + 1, lengths.len());
        if expected != found {
            return Err(RoomError::Length { expected, found });
        }
        Ok(Self::made(geometry, partition, lengths, views))
    }

    /// The room of tables that belong together.
    pub(crate) fn made(
        geometry: Geometry<'a, F>,
        partition: Partition<'a, F>,
        lengths: &'a [f64],
        views: VisibilityTable<'a>,
    ) -> Self {
        Self {
            geometry,
            partition,
            lengths,
            views,
            lights: &[],
            panels: core::array::from_fn(|b| Panels::new(b + 1)),
        }
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

    /// The views of its pairs.
    #[must_use]
    pub const fn views(&self) -> VisibilityTable<'a> {
        self.views
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

    /// ρ, or another number, of the wall of a point.
    #[inline]
    fn of_wall(&self, x: &Point<F>, of: impl Fn(&Wall<F>) -> F) -> F {
        self.geometry.wall(x.wall).map_or(F::NAN, of)
    }

    /// cos θ_x cos θ_y/(2|x − y|) where each is in front of the other, as if nothing else stood in the room; 0 elsewhere.
    #[inline]
    pub(crate) fn facing(&self, x: &Point<F>, y: &Point<F>) -> F {
        let (Some(from), Some(to)) = (self.geometry.wall(x.wall), self.geometry.wall(y.wall))
        else {
            return F::NAN;
        };
        let [out, into] = [from.height(y.position), to.height(x.position)];
        if x.wall == y.wall || !(out > zero() && into > zero()) {
            return zero();
        }
        let span = sub(y.position, x.position);
        let square = dot(span, span);
        F::from_f64(0.5) * out * into / (square * square.sqrt())
    }

    /// Whether `x` sees `y`: the first wall on the way from x is that of y.
    fn sees(&self, x: &Point<F>, y: &Point<F>) -> bool {
        let Some(from) = self.geometry.wall(x.wall) else {
            return false;
        };
        let to = sub(y.position, x.position);
        let length = norm(to);
        if !(length > zero()) {
            return false;
        }
        let direction = [to[0] / length, to[1] / length];
        let backs = if self.geometry.is_open() {
            Backs::Block
        } else {
            Backs::Pass
        };
        let hit = self
            .geometry
            .nearest(from, x.wall, x.position, direction, backs);
        hit.is_some_and(|hit| hit.wall == y.wall && !hit.back)
    }
}

impl<F: Real> Space for Room<'_, F> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real> Chain for Room<'_, F> {
    #[inline]
    fn step<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> Option<Point<F>> {
        self.scatter(x, uniforms.uniform())
    }
}

impl<F: Real> Density for Room<'_, F> {
    fn density(&self, x: &Point<F>, y: &Point<F>) -> F {
        let density = self.facing(x, y);
        if density > zero() && !self.sees(x, y) {
            return zero();
        }
        density
    }
}

impl<F: Real> Equation for Room<'_, F> {
    type Value = F;

    #[inline]
    fn kernel(&self, x: &Point<F>, _: &Point<F>) -> F {
        self.of_wall(x, |wall| wall.reflectance)
    }

    #[inline]
    fn source<U: Uniforms<F>>(&self, x: &Point<F>, _: &mut U) -> F {
        self.of_wall(x, |wall| wall.emission)
    }

    /// ρ(x): with roulette weights stay 1.
    #[inline]
    fn size(&self, x: &Point<F>) -> F {
        self.kernel(x, x)
    }
}

impl<F: Real> Cells for Room<'_, F> {
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

impl<F: Real, const B: usize> Basis<B> for Room<'_, F> {}

impl<F: Real, E: Space<Scalar = F, Point = Point<F>> + ?Sized> Stationary<E> for Room<'_, F> {
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
