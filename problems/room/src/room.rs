//! The equation, its chain and its partition.

use fredholm_core::galerkin::{Basis, PairIntegral, Partition, TransitionMoments};
use fredholm_core::{
    Kernel, Located, Real, Sampler, Source, StateSpace, TransitionDensity, Uniforms,
};
use num_traits::{one, zero};

use crate::RoomError;
use crate::cells::Cells;
use crate::geometry::{Backs, Geometry, Wall, lambert, nobody};
use crate::moments::Rules;
use crate::pairs::{Visibility, VisibilityTable};
use crate::vector::{along, dot, norm, sub};
use crate::visible::{Part, Viewer};

/// A point of a wall, with what its maker knew: wall, distance from the wall's first vertex, cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point<F> {
    position: [F; 2],
    along: F,
    wall: u32,
    cell: u32,
}

impl<F: Real> Point<F> {
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
    const fn viewer(&self) -> Viewer<F> {
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
/// The chain is p(x,y) = (1 − q0) V cos θ_x cos θ_y/(2|x − y|), q ≡ q0: a walk goes where light
/// goes. Hence k(x,y) = ρ(x)/(1 − q0), and p_j(x) is 1 − q0 times the form factor from the point to
/// cell j. Where the room is open a walk that leaves ends.
#[derive(Clone, Copy, Debug)]
pub struct Room<'a, F> {
    geometry: Geometry<'a, F>,
    cells: Cells<'a, F>,
    views: VisibilityTable<'a>,
    /// The walls whose emission the last step leads to.
    lights: &'a [u32],
    absorption: F,
    survival: F,
    per_survival: F,
}

impl<'a, F: Real> Room<'a, F> {
    /// The room with these walls, this partition and absorption probability q0. `views` are those
    /// of the same partition.
    ///
    /// # Errors
    /// [`RoomError::Absorption`] for q0 outside (0, 1).
    pub fn new(
        geometry: Geometry<'a, F>,
        cells: Cells<'a, F>,
        views: VisibilityTable<'a>,
        absorption: f64,
    ) -> Result<Self, RoomError> {
        let q = F::from_f64(absorption);
        if !(q > zero() && q < one()) {
            return Err(RoomError::Absorption);
        }
        let survival = one::<F>() - q;
        Ok(Self {
            geometry,
            cells,
            views,
            lights: &[],
            absorption: q,
            survival,
            per_survival: one::<F>() / survival,
        })
    }

    /// The equation w = T_K w + T_K F_s + F − F_s of w = u − F_s, where F_s is the emission of some walls, the lights: a small
    /// light is met by few walks, and a last step to it is made in every state that scores. See
    /// [`LastStep`](fredholm_core::LastStep).
    ///
    /// In a room nothing has to be drawn for it: (T_K F_s)(x) is ρ Σ_l F_l F_x→l with the form factors of what x sees of the
    /// lights, in closed form.
    ///
    /// `lights` are numbers of walls that grow. Without any it is the equation of u.
    ///
    /// # Errors
    /// [`RoomError::Lights`]: there is no such wall, or numbers do not grow.
    ///
    /// ```
    /// use fredholm_core::Source;
    /// use fredholm_room::{
    ///     Enclosure, Grading, Material, Mesh, Room, Scene, Surface, Tables, VisibilityTable,
    /// };
    ///
    /// let material = |emission| [Material { reflectance: 0.5, emission }];
    /// let (lamp, dark) = (material(1.0), material(0.0));
    /// let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
    /// let floor = Surface { points: &corners[..2], materials: &lamp };
    /// let rest = Surface { points: &corners[1..], materials: &dark };
    /// let scene = Scene::new::<f64>(&[floor, rest], Enclosure::Closed)?;
    /// let mesh = Mesh::new::<f64>(&scene, 4, Grading::default())?;
    /// let tables = Tables::<f64>::new(&scene, &mesh);
    /// let (geometry, cells) = (tables.geometry(), tables.cells());
    /// let room = Room::new(geometry, cells, VisibilityTable::none(), 0.5)?;
    /// let to_the_light = room.with_lights(&[0])?;
    /// // The floor's emission is known; from the middle of the ceiling it is seen under twice the angle whose tangent is ½.
    /// assert_eq!(to_the_light.source(&room.point(0, 0.5)?), 0.0);
    /// let ceiling = to_the_light.source(&room.point(2, 0.5)?);
    /// assert!((ceiling - 0.5 / 5f64.sqrt()).abs() < 1e-15);
    /// # Ok::<(), fredholm_room::RoomError>(())
    /// ```
    pub fn with_lights(self, lights: &'a [u32]) -> Result<Self, RoomError> {
        let grow = lights.iter().zip(lights.iter().skip(1)).all(|(a, b)| a < b);
        let walls = self.geometry().walls().len();
        let lead = lights.iter().all(|&light| (light as usize) < walls);
        if grow && lead {
            Ok(Self { lights, ..self })
        } else {
            Err(RoomError::Lights)
        }
    }

    /// The numbers of the walls whose emission is F_s.
    #[must_use]
    pub const fn lights(&self) -> &'a [u32] {
        self.lights
    }

    /// The walls.
    #[must_use]
    pub const fn geometry(&self) -> &Geometry<'a, F> {
        &self.geometry
    }

    /// The partition.
    #[must_use]
    pub const fn table(&self) -> Cells<'a, F> {
        self.cells
    }

    /// The views of its pairs.
    #[must_use]
    pub const fn views(&self) -> VisibilityTable<'a> {
        self.views
    }

    /// The point at this fraction of a wall.
    ///
    /// # Errors
    /// [`RoomError::Wall`] where there is no such wall, [`RoomError::Fraction`] outside [0, 1].
    pub fn point(&self, wall: usize, fraction: f64) -> Result<Point<F>, RoomError> {
        let Some(found) = self.geometry.walls().get(wall) else {
            return Err(RoomError::Wall { wall });
        };
        if !(0.0..=1.0).contains(&fraction) {
            return Err(RoomError::Fraction);
        }
        Ok(self.at(wall as u32, found, F::from_f64(fraction)))
    }

    /// The point at the fraction `t` of cell `cell`.
    #[must_use]
    pub fn inside(&self, cell: usize, t: F) -> Option<Point<F>> {
        let (wall, from, to) = self.cells.edges(cell)?;
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

    /// The point at a fraction of a wall that exists.
    #[inline]
    pub(crate) fn point_at(&self, wall: usize, fraction: F) -> Point<F> {
        match self.geometry.walls().get(wall) {
            Some(found) => self.at(wall as u32, found, fraction),
            None => Point {
                position: [F::NAN; 2],
                along: F::NAN,
                wall: u32::MAX,
                cell: u32::MAX,
            },
        }
    }

    #[inline]
    pub(crate) fn at(&self, wall: u32, found: &Wall<F>, fraction: F) -> Point<F> {
        let hit = crate::Hit {
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
            cell: self.cells.find(wall, along),
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
        Some(self.at(hit.wall, wall, hit.fraction))
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
        Some(self.at(hit.wall, wall, hit.fraction))
    }

    #[inline]
    pub(crate) fn reflectance(&self, x: &Point<F>) -> F {
        self.geometry.wall(x.wall).map_or(F::NAN, |w| w.reflectance)
    }

    /// The form factor from `x` to cell `j`: the light that leaves x and arrives there.
    #[inline]
    #[must_use]
    pub fn form_factor(&self, x: &Point<F>, j: usize) -> F {
        let Some(part) = self.cells.part(j) else {
            return F::NAN;
        };
        match self.views.visibility(x.cell as usize, j) {
            Visibility::None => zero(),
            Visibility::Partial => self.geometry.visible(&x.viewer(), &part),
            Visibility::Full | Visibility::FullBounded => {
                self.geometry.unobstructed(&x.viewer(), &part)
            }
        }
    }

    /// The form factor from `x` to a whole wall, by what x sees of it; NaN if there is no such wall.
    #[must_use]
    pub fn form_factor_of_wall(&self, x: &Point<F>, wall: usize) -> F {
        let Some(found) = self.geometry.walls().get(wall) else {
            return F::NAN;
        };
        let part = Part {
            wall: wall as u32,
            ends: found.ends,
            length: found.length,
        };
        self.geometry.visible(&x.viewer(), &part)
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

    /// Calls `each` with what [`Geometry::measure`] says of cell `j`.
    #[inline]
    pub(crate) fn measure<const B: usize>(
        &self,
        rules: &Rules<F, B>,
        x: &Point<F>,
        j: usize,
        mut each: impl FnMut(F, &[F; B]),
    ) {
        match self.cells.part(j) {
            Some(part) => {
                let view = self.views.visibility(x.cell as usize, j);
                self.geometry.measure(rules, &x.viewer(), &part, view, each);
            }
            None => each(F::NAN, &[F::NAN; B]),
        }
    }

    /// Where in cell `i` a point of it is: −1 and 1 are the cell's ends.
    #[inline]
    pub(crate) fn coordinate(&self, x: &Point<F>, i: usize) -> F {
        let Some((_, from, to)) = self.cells.edges(i) else {
            return F::NAN;
        };
        let t = (x.along - from.along) / (to.along - from.along);
        t + t - one()
    }

    /// 1 − q0.
    #[inline]
    pub(crate) const fn survival(&self) -> F {
        self.survival
    }

    /// 1/(1 − q0).
    #[inline]
    pub(crate) const fn per_survival(&self) -> F {
        self.per_survival
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

impl<F: Real> StateSpace for Room<'_, F> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real> Sampler for Room<'_, F> {
    #[inline]
    fn absorption(&self, _: &Point<F>) -> F {
        self.absorption
    }

    #[inline]
    fn step<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> Option<Point<F>> {
        self.scatter(x, uniforms.uniform())
    }
}

impl<F: Real> TransitionDensity for Room<'_, F> {
    fn density(&self, x: &Point<F>, y: &Point<F>) -> F {
        let density = self.facing(x, y);
        if density > zero() && !self.sees(x, y) {
            return zero();
        }
        self.survival * density
    }
}

impl<F: Real> Kernel for Room<'_, F> {
    #[inline]
    fn kernel(&self, x: &Point<F>, _: &Point<F>) -> F {
        self.reflectance(x) * self.per_survival
    }
}

impl<F: Real> Source for Room<'_, F> {
    #[inline]
    fn source(&self, x: &Point<F>) -> F {
        if !self.lights.is_empty() {
            return self.source_of_lights(x);
        }
        self.geometry.wall(x.wall).map_or(F::NAN, |w| w.emission)
    }
}

impl<F: Real> Partition for Room<'_, F> {
    fn cells(&self) -> usize {
        self.cells.len()
    }

    #[inline]
    fn locate(&self, x: &Point<F>) -> usize {
        x.cell as usize
    }
}

impl<F: Real> Basis for Room<'_, F> {
    #[inline]
    fn basis(&self, _: &Located<Point<F>>) -> [F; 1] {
        [one()]
    }
}

impl<F: Real> TransitionMoments for Room<'_, F> {
    #[inline]
    fn moments(&self, x: &Located<Point<F>>, j: usize) -> [[F; 1]; 1] {
        [[self.survival * self.form_factor(&x.point, j)]]
    }
}

impl<F: Real> PairIntegral for Room<'_, F> {
    #[inline]
    fn pair_integral(&self, x: &Located<Point<F>>, j: usize) -> [F; 1] {
        [self.reflectance(&x.point) * self.form_factor(&x.point, j)]
    }
}
