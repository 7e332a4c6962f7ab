//! The equation of light and heat on a scene, and its chain.

use fredholm_core::galerkin::{Basis, Cells};
use fredholm_core::{
    Chain, Density, Equation, Lights, Located, Real, Space, Start, StartOf, Uniforms, Value,
};
use num_traits::{one, zero};

use crate::SceneError;
use crate::cells::{CellTables, FacePatch, folded, polynomials};
use crate::geometry::{Face, Geometry};
use crate::ray::{Backs, Hit};
use crate::skylight::SKY;
use crate::vector::{Vector, along, cross, dot, norm, ring, sub};
use fredholm_surfaces::{Grey, Tint};

/// A point of a face, or of the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point<F> {
    /// The number of the face.
    pub face: u32,
    /// The place; in the sky the direction.
    pub position: [F; 3],
}

impl<F> Point<F> {
    /// The point that a ray met.
    fn of(hit: Hit<F>) -> Self {
        Self {
            face: hit.face,
            position: hit.point,
        }
    }
}

/// Light or heat between the faces of a scene (Heinrich 1995, section 5, in space):
///
/// ```text
/// u(x) = ρ(x) ∫ u(y) cos θ_x cos θ_y V(x, y)/(π |x − y|²) dA(y) + F(x),
/// ```
///
/// where V is 1 if x and y see each other. Walks step to what a ray of a cosine-distributed direction meets:
/// p = cos θ_x cos θ_y V/(π |x − y|²) and k = ρ(x), so that a walk's only work is its rays.
///
/// Where faces are mirrors in part a ray goes on from them: see `Scene::with_specular`.
///
/// μ is the area. A step draws two numbers, which the area-preserving map of the square to the disc (Shirley and Chiu 1997)
/// takes to a direction, and one more at every mirror. Light has one channel, or several: see [`Coloured`](crate::Coloured).
///
/// ```
/// use fredholm_core::{Chain, Uniforms};
/// use fredholm_scene::{Cells, Enclosure, Radiosity, Scene, Tables, shapes};
///
/// struct Middle;
/// impl Uniforms<f64> for Middle {
///     fn uniform(&mut self) -> f64 {
///         0.5
///     }
/// }
/// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
/// let (tables, cells) = (Tables::new(&scene), Cells::new(&scene, 6)?);
/// let room = Radiosity::new(tables.geometry(), &cells)?;
/// // Straight up from the floor, which is face 0.
/// let x = room.at(0, [0.25, 0.75, 0.0])?;
/// let y = room.step(&x, &mut Middle).unwrap();
/// assert_eq!(y.face, 1);
/// assert!((y.position[0] - 0.25).abs() < 1e-12 && y.position[2] == 1.0);
/// # Ok::<(), fredholm_scene::SceneError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Radiosity<'a, F, C = Grey> {
    pub(crate) geometry: Geometry<'a, F>,
    pub(crate) tables: CellTables<'a, F>,
    /// What of each light each cell sees: see `with_visible_shares`.
    pub(crate) shares: &'a [u8],
    pub(crate) tint: C,
    cells: u32,
}

impl<'a, F: Real> Radiosity<'a, F> {
    /// The equation on the faces of a geometry.
    ///
    /// # Errors
    /// [`SceneError::Tables`]: the cells are those of another scene.
    #[cfg(feature = "alloc")]
    pub fn new(geometry: Geometry<'a, F>, cells: &'a crate::Cells<F>) -> Result<Self, SceneError> {
        Self::of_tables(geometry, cells.tables())
    }

    /// The equation on tables that were made elsewhere.
    ///
    /// # Errors
    /// [`SceneError::Tables`]: a number in them leads nowhere, or there is a side for more or fewer faces than the geometry
    /// has.
    pub fn of_tables(
        geometry: Geometry<'a, F>,
        tables: CellTables<'a, F>,
    ) -> Result<Self, SceneError> {
        Ok(Self {
            geometry,
            tables,
            shares: &[],
            tint: Grey,
            cells: tables.check(geometry.faces().len())?,
        })
    }

    pub(crate) fn with_tint<C>(self, tint: C) -> Radiosity<'a, F, C> {
        Radiosity {
            geometry: self.geometry,
            tables: self.tables,
            shares: self.shares,
            tint,
            cells: self.cells,
        }
    }

    /// The equation with shares of lights that are visible: see [`Radiosity::visible_shares`].
    ///
    /// # Errors
    /// [`SceneError::Length`]: not one for every cell and light.
    pub fn with_visible_shares(self, shares: &'a [u8]) -> Result<Self, SceneError> {
        let expected = self.tables.lights.len().saturating_mul(self.cells as usize);
        let found = shares.len();
        if found != expected {
            return Err(SceneError::Length { expected, found });
        }
        Ok(Self { shares, ..self })
    }
}

/// Where a point lies in its cell.
struct InCell<F> {
    cell: usize,
    at: [F; 2],
    is_triangle: bool,
}

impl<'a, F: Real, C> Radiosity<'a, F, C> {
    /// The point of a face that is nearest to `position` on its plane; from an edge it is moved inwards, by some rounding
    /// errors of the face's width.
    ///
    /// # Errors
    /// [`SceneError::Point`]: there is no such face, or the position is not [on it](Geometry::is_on).
    pub fn at(&self, face: u32, position: [f64; 3]) -> Result<Point<F>, SceneError> {
        let wrong = SceneError::Point { face };
        let foot = self.geometry.foot(face, position).ok_or(wrong)?;
        let middle = self.geometry.face(face).ok_or(wrong)?.middle();
        // On an edge u is the limit from inside, where the face beside it has a height.
        let share = F::from_f64(64.0) * F::EPSILON;
        let position = along(foot, share, sub(middle, foot));
        Ok(Point { face, position })
    }

    /// The geometry.
    #[must_use]
    pub const fn geometry(&self) -> Geometry<'a, F> {
        self.geometry
    }

    #[inline]
    pub(crate) fn face(&self, x: &Point<F>) -> Option<&'a Face<F>> {
        self.geometry.face(x.face)
    }

    /// ρ in a point. Nothing comes back from the sky.
    #[inline]
    fn reflectance(&self, x: &Point<F>) -> F {
        match self.face(x) {
            Some(face) => face.reflectance,
            None if x.face == SKY => zero(),
            None => F::NAN,
        }
    }

    #[inline]
    fn in_cell(&self, x: &Point<F>) -> Option<InCell<F>> {
        if x.face == SKY {
            let (patch, at) = self.sky_patch(x.position)?;
            return Some(InCell {
                cell: self.cells_of_faces() + patch as usize,
                at,
                is_triangle: false,
            });
        }
        let side = self.tables.sides.get(x.face as usize)?;
        let own = self.tables.patches.get(side.patch as usize..)?;
        let mut patch = own.first()?;
        let mut at = patch.coordinates(x.position);
        if side.patches == 2 && patch.is_beyond(at) {
            patch = own.get(1)?;
            at = patch.coordinates(x.position);
        }
        let (cell, at) = patch.cell(at);
        Some(InCell {
            cell: (patch.first + cell) as usize,
            at,
            is_triangle: patch.triangle == 1,
        })
    }

    /// The number of cells of faces, without those of the sky.
    pub(crate) const fn cells_of_faces(&self) -> usize {
        self.cells as usize
    }

    /// The face and the patch of a cell, by bisection: for set-ups. `None`: it is no cell of a face.
    pub(crate) fn patch_of(&self, cell: usize) -> Option<(u32, &'a FacePatch<F>)> {
        if cell >= self.cells_of_faces() {
            return None;
        }
        let CellTables { sides, patches, .. } = self.tables;
        let after = patches.partition_point(|patch| patch.first as usize <= cell);
        let number = after.checked_sub(1)?;
        let side = sides.partition_point(|side| side.patch as usize <= number);
        Some((side.checked_sub(1)? as u32, patches.get(number)?))
    }

    /// The face of a cell, and the cell's corners in the order of the face's. `None`: it is a cell of the sky, or none.
    ///
    /// ```
    /// use fredholm_scene::{Cells, Enclosure, Radiosity, Scene, Tables, shapes};
    ///
    /// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
    /// let (tables, cells) = (Tables::<f64>::new(&scene), Cells::new(&scene, 24)?);
    /// let room = Radiosity::new(tables.geometry(), &cells)?;
    /// // The floor, which is face 0, has four cells.
    /// let (face, corners) = room.corners(0).unwrap();
    /// assert_eq!((face, corners.len()), (0, 4));
    /// assert!(corners.iter().all(|c| c[0] <= 0.5 && c[1] <= 0.5 && c[2] == 0.0));
    /// assert_eq!(room.corners(24), None);
    /// # Ok::<(), fredholm_scene::SceneError>(())
    /// ```
    #[cfg(feature = "alloc")]
    #[must_use]
    pub fn corners(&self, cell: usize) -> Option<(u32, alloc::vec::Vec<[F; 3]>)> {
        let (face, patch) = self.patch_of(cell)?;
        let ends = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].into_iter();
        let own = ends.filter(|&end| patch.triangle == 0 || end != [1.0; 2]);
        Some((
            face,
            own.map(|end| self.point(cell, &end).position).collect(),
        ))
    }

    /// What a ray from a point of a face meets: a point of another, or of the sky.
    #[inline]
    fn meets(&self, x: &Point<F>, direction: Vector<F>) -> Option<Point<F>> {
        if self.geometry.is_open() {
            return self.met(Some(self.face(x)?), x.position, direction, Backs::Block);
        }
        let hit = self.geometry.cast(x.face, x.position, direction);
        hit.map(Point::of)
    }

    /// Where a ray ends that met something: there, or, if it goes on as from a mirror, at what it meets further on.
    #[inline(always)]
    pub fn mirrored<U: Uniforms<F>>(
        &self,
        met: Option<Point<F>>,
        direction: Vector<F>,
        uniforms: &mut U,
    ) -> Option<Point<F>> {
        match self.geometry.has_mirrors() {
            true => self.followed(met?, direction, uniforms),
            false => met,
        }
    }

    #[inline(never)]
    fn followed<U: Uniforms<F>>(
        &self,
        mut at: Point<F>,
        mut direction: Vector<F>,
        uniforms: &mut U,
    ) -> Option<Point<F>> {
        loop {
            let specular = self.geometry.specular(at.face);
            if specular == zero() || uniforms.uniform() >= specular {
                return Some(at);
            }
            let normal = self.face(&at)?.normal;
            let into = dot(direction, normal);
            direction = along(direction, -(into + into), normal);
            at = self.meets(&at, direction)?;
        }
    }

    /// What a ray meets: a point of a face, or of the sky. A back is black.
    #[inline]
    pub(crate) fn met(
        &self,
        emitter: Option<&Face<F>>,
        from: Vector<F>,
        direction: Vector<F>,
        backs: Backs,
    ) -> Option<Point<F>> {
        match self.geometry.nearest(emitter, from, direction, backs) {
            Some(hit) => (!hit.back).then(|| Point::of(hit)),
            None => self.sky_at(direction),
        }
    }

    /// The direction that two numbers in [0, 1) give above a plane of these tangents, cosine-distributed.
    #[inline]
    pub(crate) fn direction(
        [p, q]: [Vector<F>; 2],
        normal: Vector<F>,
        numbers: [F; 2],
    ) -> Vector<F> {
        let [s, t] = disc(numbers);
        // Rounding may leave less than nothing.
        let z = Real::max(one::<F>() - s * s - t * t, zero()).sqrt();
        [
            s * p[0] + t * q[0] + z * normal[0],
            s * p[1] + t * q[1] + z * normal[1],
            s * p[2] + t * q[2] + z * normal[2],
        ]
    }
}

impl<F: Real> Geometry<'_, F> {
    /// What backs do to rays that start between the faces.
    pub(crate) const fn backs(&self) -> Backs {
        if self.is_open() {
            Backs::Block
        } else {
            Backs::Pass
        }
    }

    /// Whether a position is on a face, within a millionth of the face's width.
    #[must_use]
    pub fn is_on(&self, face: u32, position: [f64; 3]) -> bool {
        self.foot(face, position).is_some()
    }

    /// The face [on which](Self::is_on) a position is; of several that which comes first.
    ///
    /// ```
    /// # #[cfg(feature = "alloc")] {
    /// use fredholm_scene::{Enclosure, Scene, shapes};
    ///
    /// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
    /// // Floor and ceiling are 0 and 1.
    /// let face_at = |position| scene.geometry().face_at(position);
    /// assert_eq!([face_at([0.5, 0.5, 1.0]), face_at([0.5, 0.0, 0.0])], [Some(1), Some(0)]);
    /// assert_eq!(face_at([0.5, 0.5, 0.5]), None);
    /// # }
    /// # Ok::<(), fredholm_scene::SceneError>(())
    /// ```
    #[must_use]
    pub fn face_at(&self, position: [f64; 3]) -> Option<u32> {
        (0..self.faces().len() as u32).find(|&face| self.is_on(face, position))
    }

    /// The point of a face's plane that is nearest to a position on the face.
    fn foot(&self, face: u32, position: [f64; 3]) -> Option<Vector<F>> {
        let own = self.face(face)?;
        let position = position.map(F::from_f64);
        let height = dot(own.normal, sub(position, own.corners[0]));
        let width = own.area.sqrt();
        let slack = width * Real::max(F::from_f64(1e-6), F::from_f64(64.0) * F::EPSILON);
        let foot = along(position, -height, own.normal);
        let is_inside = ring(own.polygon()).all(|[a, b]| {
            let edge = sub(b, a);
            let inwards = cross(own.normal, edge);
            dot(inwards, sub(foot, a)) >= -slack * norm(edge)
        });
        // Written so that NaN fails.
        (is_inside && height.abs() <= slack).then_some(foot)
    }
}

/// The map of the unit square to the unit disc that preserves areas up to a factor (Shirley and Chiu 1997).
#[inline]
fn disc<F: Real>([a, b]: [F; 2]) -> [F; 2] {
    let (a, b) = (a + a - one(), b + b - one());
    let quarter = F::PI * F::from_f64(0.25);
    if a.abs() > b.abs() {
        let angle = quarter * (b / a);
        [a * angle.cos(), a * angle.sin()]
    } else if b != zero() {
        let angle = quarter * (a / b);
        [b * angle.sin(), b * angle.cos()]
    } else {
        [zero(), zero()]
    }
}

impl<F: Real, C> Space for Radiosity<'_, F, C> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real, C> Chain for Radiosity<'_, F, C> {
    #[inline]
    fn step<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> Option<Point<F>> {
        let numbers = [uniforms.uniform(), uniforms.uniform()];
        let side = self.tables.sides.get(x.face as usize)?;
        let direction = Self::direction(side.tangents, self.face(x)?.normal, numbers);
        self.mirrored(self.meets(x, direction), direction, uniforms)
    }
}

impl<F: Real, C> Density for Radiosity<'_, F, C> {
    /// The transition density, with respect to areas on faces and to solid angles in the sky; NaN where there are mirrors, or
    /// where the scene repeats.
    fn density(&self, x: &Point<F>, y: &Point<F>) -> F {
        if x.face == SKY {
            return zero();
        }
        let Some(from) = self.face(x).filter(|_| self.geometry.is_straight()) else {
            return F::NAN;
        };
        let (direction, fall) = match self.face(y) {
            Some(to) => {
                let between = sub(y.position, x.position);
                let per_length = one::<F>() / norm(between);
                let direction = between.map(|d| d * per_length);
                let fall = -dot(to.normal, direction);
                (direction, fall * per_length * per_length)
            }
            None if y.face == SKY => (y.position, one()),
            None => return F::NAN,
        };
        let rise = dot(from.normal, direction);
        let is_met = |met: Point<F>| met.face == y.face;
        if rise > zero() && fall > zero() && self.meets(x, direction).is_some_and(is_met) {
            rise * fall / F::PI
        } else {
            zero()
        }
    }
}

impl<F: Real, C: Tint<F>> Radiosity<'_, F, C> {
    /// A value with one number in every channel.
    #[inline(always)]
    pub(crate) fn white(&self, x: F) -> C::Value {
        C::Value::splat(self.tint.channels(), x)
    }
}

impl<F: Real, C: Tint<F>> Equation for Radiosity<'_, F, C> {
    type Value = C::Value;

    #[inline]
    fn kernel(&self, x: &Point<F>, _: &Point<F>) -> C::Value {
        self.tint.reflectance(x.face).scaled(self.reflectance(x))
    }

    #[inline]
    fn source<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> C::Value {
        let own = self.known(x).plus(&self.rest(x));
        match self.geometry.sunlight {
            None => own,
            Some(_) => own.plus(&self.white(self.less_sunlight(x, uniforms))),
        }
    }

    #[inline(always)]
    fn channels(&self) -> usize {
        self.tint.channels()
    }

    /// ρ(x).
    #[inline]
    fn size(&self, x: &Point<F>) -> F {
        self.reflectance(x)
    }
}

/// F_s is the emission of the brightest faces. What lamps at points and the sun give is known everywhere, and part of the rest.
impl<F: Real, C: Tint<F>> Lights for Radiosity<'_, F, C> {
    #[inline]
    fn light<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> C::Value {
        if x.face == SKY {
            return self.white(zero());
        }
        let Some(on) = self.receiver(x) else {
            return self.white(F::NAN);
        };
        let own = self.kernel(x, x).times(&self.direct(&on, uniforms));
        match self.geometry.sunlight {
            None => own,
            Some(_) => own.plus(&self.white(self.less_sunlight(x, uniforms))),
        }
    }

    /// The emission of a face that is a light; it is the same on all of it.
    #[inline]
    fn known(&self, x: &Point<F>) -> C::Value {
        match (self.face(x), self.tables.sides.get(x.face as usize)) {
            (Some(own), Some(side)) => {
                let emission = own.emission - side.emission;
                self.tint.emission(x.face).scaled(emission)
            }
            _ if x.face == SKY => self.white(zero()),
            _ => self.white(F::NAN),
        }
    }

    /// What arrives at x directly is estimated in x itself.
    fn arriving_lit<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> StartOf<Self> {
        let Some(on) = self.receiver(x) else {
            return self.start_at(None, zero());
        };
        let known = self.irradiance(&on, uniforms);
        Start {
            known,
            ..self.arriving(x, uniforms)
        }
    }

    /// The emission of faces that are no lights, the light of the sky, and what lamps at points and the sun give to x.
    #[inline]
    fn rest(&self, x: &Point<F>) -> C::Value {
        if x.face == SKY {
            return self.white(self.sky_emission(x));
        }
        let side = self.tables.sides.get(x.face as usize);
        let emission = side.map_or(F::NAN, |side| side.emission);
        let own = self.tint.emission(x.face).scaled(emission);
        if self.tables.beams.is_empty() {
            return own;
        }
        let of_beams = self.receiver(x).map(|on| self.irradiance_of_beams(&on));
        own.plus(&self.kernel(x, x).scaled(of_beams.unwrap_or(F::NAN)))
    }
}

impl<F: Real, C> Cells for Radiosity<'_, F, C> {
    const DIMENSION: usize = 2;

    /// The number of cells: those of faces, and one for every patch of the sky.
    fn cells(&self) -> usize {
        self.cells_of_faces() + self.tables.sky_emissions.len()
    }

    #[inline]
    fn locate(&self, x: &Point<F>) -> usize {
        self.in_cell(x).map_or(usize::MAX, |place| place.cell)
    }

    /// The area of a cell; 0 in the sky.
    fn measure(&self, cell: usize) -> f64 {
        if (self.cells_of_faces()..self.cells()).contains(&cell) {
            return 0.0;
        }
        self.patch_of(cell).map_or(f64::NAN, |(_, patch)| {
            let [p, q] = patch.spans.map(|span| span.map(Real::to_f64));
            let share = if patch.triangle == 1 { 0.5 } else { 1.0 };
            share * norm(cross(p, q)) / f64::from(patch.cells())
        })
    }

    /// The point with these coordinates; a triangle is half of a square, folded.
    fn point(&self, cell: usize, t: &[f64]) -> Point<F> {
        let missing = Point {
            face: u32::MAX,
            position: [F::NAN; 3],
        };
        let &[s, t, ..] = t else { return missing };
        let t = [s, t].map(F::from_f64);
        if let Some((face, patch)) = self.patch_of(cell) {
            let t = if patch.triangle == 1 { folded(t) } else { t };
            let at = patch.within(cell as u32 - patch.first, t);
            let position = patch.point(at);
            return Point { face, position };
        }
        let patch = cell.saturating_sub(self.cells_of_faces()) as u32;
        let direction = self.sky_direction(patch, t);
        direction.map_or(missing, |position| Point {
            face: SKY,
            position,
        })
    }

    fn parameters(&self, x: &Located<Point<F>>, t: &mut [F]) {
        let position = x.point.position;
        let at = match self.patch_of(x.cell) {
            Some((_, patch)) => {
                let at = patch.coordinates(position);
                Some(patch.parameters(x.cell as u32 - patch.first, at))
            }
            None => {
                let patch = x.cell.saturating_sub(self.cells_of_faces()) as u32;
                self.sky_parameters(patch, position)
            }
        };
        for (t, at) in t.iter_mut().zip(at.unwrap_or([F::NAN; 2])) {
            *t = at;
        }
    }

    /// The point of any face with three coordinates.
    fn at(&self, coordinates: &[f64]) -> Option<Point<F>> {
        let &[x, y, z] = coordinates else { return None };
        let face = self.geometry.face_at([x, y, z])?;
        Self::at(self, face, [x, y, z]).ok()
    }
}

/// Polynomials of degree 0, 1 and 2: B = 1, 3 and 6.
impl<F: Real, C, const B: usize> Basis<B> for Radiosity<'_, F, C> {
    #[inline]
    fn basis(&self, x: &Located<Point<F>>) -> [F; B] {
        const {
            assert!(
                B == 1 || B == 3 || B == 6,
                "polynomials of degree 0, 1 or 2"
            );
        }
        if B == 1 {
            return [one(); B];
        }
        let place = self.in_cell(&x.point);
        place.map_or([F::NAN; B], |place| {
            polynomials(place.at, place.is_triangle)
        })
    }
}
