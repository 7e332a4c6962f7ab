//! The equation of light and heat on a scene, and its chain.

use fredholm_core::galerkin::{Basis, CellMap, Partition};
use fredholm_core::{
    Kernel, Located, Real, Sampler, Source, StateSpace, TransitionDensity, Uniforms,
};
use num_traits::{one, zero};

use crate::SceneError;
use crate::beam::Beam;
use crate::cells::{FacePatch, Side, square_polynomials};
use crate::geometry::{Face, Geometry};
use crate::ray::Backs;
use crate::skylight::{SKY, SkyBand};
use crate::vector::{Vector, along, dot, norm, sub};

/// A point of a face, or of the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point<F> {
    /// The number of the face.
    pub face: u32,
    /// The place; in the sky the direction.
    pub position: [F; 3],
}

/// Light or heat between the faces of a scene (Heinrich 1995, section 5, in space):
///
/// ```text
/// u(x) = ρ(x) ∫ u(y) cos θ_x cos θ_y V(x, y)/(π |x − y|²) dA(y) + F(x),
/// ```
///
/// where V is 1 if x and y see each other. Walks step to what a ray of a cosine-distributed direction meets:
/// p = (1 − q0) cos θ_x cos θ_y V/(π |x − y|²) and k = ρ(x)/(1 − q0), so that a walk's only work is its rays.
///
/// μ is the area. A step draws two numbers, which the area-preserving map of the square to the disc (Shirley and Chiu 1997)
/// takes to a direction.
///
/// ```
/// use fredholm_core::{Kernel, Sampler, Source, Uniforms};
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
/// let room = Radiosity::new(tables.geometry(), &cells, 0.25)?;
/// // Straight up from the floor, which is face 0.
/// let x = room.at(0, [0.25, 0.75, 0.0])?;
/// let y = room.step(&x, &mut Middle).unwrap();
/// assert_eq!(y.face, 1);
/// assert!((y.position[0] - 0.25).abs() < 1e-12 && y.position[2] == 1.0);
/// # Ok::<(), fredholm_scene::SceneError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Radiosity<'a, F> {
    pub(crate) geometry: Geometry<'a, F>,
    pub(crate) sides: &'a [Side<F>],
    pub(crate) patches: &'a [FacePatch<F>],
    pub(crate) lights: &'a [u32],
    pub(crate) beams: &'a [Beam<F>],
    pub(crate) sky_bands: &'a [SkyBand<F>],
    pub(crate) sky_emissions: &'a [F],
    /// What of each light each cell sees: see `with_visible_shares`.
    pub(crate) shares: &'a [u8],
    cells: u32,
    absorption: F,
    per_survival: F,
}

impl<'a, F: Real> Radiosity<'a, F> {
    /// The equation on the faces of a geometry, with absorption probability q0 = `absorption` in every state.
    ///
    /// # Errors
    /// [`SceneError::Absorption`]: q0 is not in (0, 1). [`SceneError::Tables`]: the cells are those of another scene.
    #[cfg(feature = "alloc")]
    pub fn new(
        geometry: Geometry<'a, F>,
        cells: &'a crate::Cells<F>,
        absorption: f64,
    ) -> Result<Self, SceneError> {
        let tables = (&*cells.sides, &*cells.patches, &*cells.lights);
        let radiosity = Self::of_tables(geometry, tables, absorption)?.with_beams(&cells.beams);
        Ok(match &cells.sky {
            Some(sky) => radiosity.with_sky(&sky.bands, &sky.emissions),
            None => radiosity,
        })
    }

    /// The equation with light that no surface emits: directions have the length 1.
    #[must_use]
    pub const fn with_beams(self, beams: &'a [Beam<F>]) -> Self {
        Self { beams, ..self }
    }

    /// The equation with the light of the sky: its bands, and L of every patch. Rays that leave upwards end in the sky, of which
    /// every patch is one cell more, behind those of faces.
    #[must_use]
    pub const fn with_sky(self, bands: &'a [SkyBand<F>], emissions: &'a [F]) -> Self {
        Self {
            sky_bands: bands,
            sky_emissions: emissions,
            ..self
        }
    }

    /// The equation on tables that were made elsewhere: sides of faces, patches, and the numbers of the faces that emit.
    ///
    /// # Errors
    /// [`SceneError::Absorption`]: q0 is not in (0, 1). [`SceneError::Tables`]: a number in them leads nowhere, or there is
    /// a side for more or fewer faces than the geometry has.
    pub fn of_tables(
        geometry: Geometry<'a, F>,
        (sides, patches, lights): (&'a [Side<F>], &'a [FacePatch<F>], &'a [u32]),
        absorption: f64,
    ) -> Result<Self, SceneError> {
        let q = F::from_f64(absorption);
        // Written so that NaN fails.
        if !(q > zero() && q < one()) {
            return Err(SceneError::Absorption);
        }
        let mut cells = 0_u32;
        let patches_follow = patches.iter().all(|patch| {
            let first = cells;
            let [m, n] = patch.intervals;
            let own = m.checked_mul(n).and_then(|own| cells.checked_add(own));
            cells = own.unwrap_or(0);
            own.is_some()
                && patch.first == first
                && m > 0
                && n > 0
                && (patch.triangle == 0 || (patch.triangle == 1 && m == n))
        });
        let sides_lead = sides.iter().all(|side| {
            let last = side.patch.checked_add(side.patches);
            matches!(side.patches, 1 | 2) && last.is_some_and(|last| last as usize <= patches.len())
        });
        let faces = geometry.faces().len();
        let lights_lead = lights.iter().all(|&light| (light as usize) < faces);
        if !patches_follow || !sides_lead || !lights_lead || sides.len() != faces {
            return Err(SceneError::Tables);
        }
        Ok(Self {
            geometry,
            sides,
            patches,
            lights,
            beams: &[],
            sky_bands: &[],
            sky_emissions: &[],
            shares: &[],
            cells,
            absorption: q,
            per_survival: one::<F>() / (one::<F>() - q),
        })
    }

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

    /// q0.
    #[must_use]
    pub const fn absorption_probability(&self) -> F {
        self.absorption
    }

    /// The equation with shares of lights that are visible: see [`Radiosity::visible_shares`].
    ///
    /// # Errors
    /// [`SceneError::Length`]: not one for every cell and light.
    pub fn with_visible_shares(self, shares: &'a [u8]) -> Result<Self, SceneError> {
        let expected = self.lights.len().saturating_mul(self.cells as usize);
        let found = shares.len();
        if found != expected {
            return Err(SceneError::Length { expected, found });
        }
        Ok(Self { shares, ..self })
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

    /// ρ in a point.
    #[inline]
    pub(crate) fn reflectance(&self, x: &Point<F>) -> F {
        self.face(x).map_or(F::NAN, |face| face.reflectance)
    }

    /// The patch of a point, and its coordinates there.
    #[inline]
    fn patch(&self, x: &Point<F>) -> Option<(&'a FacePatch<F>, [F; 2])> {
        let side = self.sides.get(x.face as usize)?;
        let own = self.patches.get(side.patch as usize..)?;
        let first = own.first()?;
        let coordinates = first.coordinates(x.position);
        if side.patches == 2 && first.is_beyond(coordinates) {
            let second = own.get(1)?;
            return Some((second, second.coordinates(x.position)));
        }
        Some((first, coordinates))
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
        let after = self
            .patches
            .partition_point(|patch| patch.first as usize <= cell);
        let number = after.checked_sub(1)?;
        let face = self
            .sides
            .partition_point(|side| side.patch as usize <= number)
            .checked_sub(1)?;
        Some((face as u32, self.patches.get(number)?))
    }

    /// The face of a cell, and the cell's corners in the order of the face's. `None`: it is a cell of the sky, or none.
    ///
    /// ```
    /// use fredholm_scene::{Cells, Enclosure, Radiosity, Scene, Tables, shapes};
    ///
    /// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
    /// let (tables, cells) = (Tables::<f64>::new(&scene), Cells::new(&scene, 24)?);
    /// let room = Radiosity::new(tables.geometry(), &cells, 0.25)?;
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
        let [o, i] = [zero::<F>(), one::<F>()];
        let corner = |&at: &[F; 2]| patch.point(patch.within(cell as u32 - patch.first, at));
        let corners = if patch.triangle == 1 {
            [[o, o], [i, o], [o, i]].iter().map(corner).collect()
        } else {
            [[o, o], [i, o], [i, i], [o, i]]
                .iter()
                .map(corner)
                .collect()
        };
        Some((face, corners))
    }

    /// What a ray from a point of a face meets: a point of another, or of the sky.
    #[inline]
    fn meets(&self, x: &Point<F>, direction: Vector<F>) -> Option<Point<F>> {
        let hit = if self.sky_bands.is_empty() {
            self.geometry.cast(x.face, x.position, direction)?
        } else {
            let from = Some(self.face(x)?);
            let hit = self
                .geometry
                .nearest(from, x.position, direction, Backs::Block);
            let Some(hit) = hit else {
                return self.sky_at(direction);
            };
            // A back is black.
            Some(hit).filter(|hit| !hit.back)?
        };
        Some(Point {
            face: hit.face,
            position: hit.point,
        })
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
    /// Whether a position is on a face, within a millionth of the face's width.
    ///
    /// ```
    /// # #[cfg(feature = "alloc")] {
    /// use fredholm_scene::{Enclosure, Scene, shapes};
    ///
    /// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
    /// assert!(scene.geometry().is_on(0, [0.5, 0.5, 0.0]));
    /// assert!(!scene.geometry().is_on(0, [0.5, 0.5, 0.1]));
    /// # }
    /// # Ok::<(), fredholm_scene::SceneError>(())
    /// ```
    #[must_use]
    pub fn is_on(&self, face: u32, position: [f64; 3]) -> bool {
        self.foot(face, position).is_some()
    }

    /// The point of a face's plane that is nearest to a position on the face.
    fn foot(&self, face: u32, position: [f64; 3]) -> Option<Vector<F>> {
        let own = self.face(face)?;
        let position = position.map(F::from_f64);
        let height = dot(own.normal, sub(position, own.corners[0]));
        let width = own.area.sqrt();
        let slack = width * Real::max(F::from_f64(1e-6), F::from_f64(64.0) * F::EPSILON);
        let foot = along(position, -height, own.normal);
        let polygon = own.polygon();
        let next = polygon.iter().cycle().skip(1);
        let is_inside = polygon.iter().zip(next).all(|(&a, &b)| {
            let edge = sub(b, a);
            let inwards = crate::vector::cross(own.normal, edge);
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

impl<F: Real> StateSpace for Radiosity<'_, F> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real> Sampler for Radiosity<'_, F> {
    #[inline]
    fn absorption(&self, x: &Point<F>) -> F {
        // Nothing comes back from the sky.
        if x.face == SKY {
            one()
        } else {
            self.absorption
        }
    }

    #[inline]
    fn step<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> Option<Point<F>> {
        let numbers = [uniforms.uniform(), uniforms.uniform()];
        let side = self.sides.get(x.face as usize)?;
        let direction = Self::direction(side.tangents, self.face(x)?.normal, numbers);
        self.meets(x, direction)
    }
}

impl<F: Real> TransitionDensity for Radiosity<'_, F> {
    /// The transition density, with respect to areas on faces and to solid angles in the sky.
    fn density(&self, x: &Point<F>, y: &Point<F>) -> F {
        if let (Some(from), SKY) = (self.face(x), y.face) {
            let rise = dot(from.normal, y.position);
            let is_met = rise > zero() && self.meets(x, y.position).is_some_and(|y| y.face == SKY);
            return if is_met {
                (one::<F>() - self.absorption) * rise / F::PI
            } else {
                zero()
            };
        }
        let (Some(from), Some(to)) = (self.face(x), self.face(y)) else {
            return F::NAN;
        };
        let between = sub(y.position, x.position);
        let square = dot(between, between);
        let (rise, fall) = (dot(from.normal, between), -dot(to.normal, between));
        if !(rise > zero() && fall > zero()) {
            return zero();
        }
        let per_length = one::<F>() / square.sqrt();
        let direction = between.map(|d| d * per_length);
        let hit = self.geometry.cast(x.face, x.position, direction);
        if hit.is_some_and(|hit| hit.face == y.face) {
            (one::<F>() - self.absorption) * rise * fall / (F::PI * square * square)
        } else {
            zero()
        }
    }
}

impl<F: Real> Kernel for Radiosity<'_, F> {
    #[inline]
    fn kernel(&self, x: &Point<F>, _: &Point<F>) -> F {
        self.reflectance(x) * self.per_survival
    }
}

impl<F: Real> Source for Radiosity<'_, F> {
    #[inline]
    fn source(&self, x: &Point<F>) -> F {
        if x.face == SKY {
            return self.sky_emission(x);
        }
        let (Some(face), Some(on)) = (self.face(x), self.receiver(x)) else {
            return F::NAN;
        };
        face.emission + face.reflectance * self.irradiance_of_beams(&on)
    }
}

impl<F: Real> Partition for Radiosity<'_, F> {
    /// The number of cells: those of faces, and one for every patch of the sky.
    fn cells(&self) -> usize {
        self.cells_of_faces() + self.sky_emissions.len()
    }

    #[inline]
    fn locate(&self, x: &Point<F>) -> usize {
        if x.face == SKY {
            let patch = self.sky_patch(x.position);
            return patch.map_or(usize::MAX, |(patch, _)| {
                self.cells_of_faces() + patch as usize
            });
        }
        self.patch(x).map_or(usize::MAX, |(patch, at)| {
            (patch.first + patch.cell(at).0) as usize
        })
    }
}

/// Polynomials of degree 0, 1 and 2: B = 1, 3 and 6.
impl<F: Real, const B: usize> Basis<B> for Radiosity<'_, F> {
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
        if x.point.face == SKY {
            let place = self.sky_patch(x.point.position);
            return place.map_or([F::NAN; B], |(_, at)| square_polynomials(at));
        }
        self.patch(&x.point).map_or([F::NAN; B], |(patch, at)| {
            patch.polynomials(patch.cell(at).1)
        })
    }
}

impl<F: Real> CellMap for Radiosity<'_, F> {
    const DIMENSION: usize = 2;

    /// The area of a cell; 0 in the sky.
    fn measure(&self, cell: usize) -> f64 {
        if (self.cells_of_faces()..self.cells()).contains(&cell) {
            return 0.0;
        }
        self.patch_of(cell).map_or(f64::NAN, |(_, patch)| {
            let [p, q] = patch.spans.map(|span| span.map(Real::to_f64));
            let area = norm(crate::vector::cross(p, q));
            let whole = if patch.triangle == 1 {
                0.5 * area
            } else {
                area
            };
            whole / f64::from(patch.cells())
        })
    }

    fn point(&self, cell: usize, t: &[f64]) -> Point<F> {
        let missing = Point {
            face: u32::MAX,
            position: [F::NAN; 3],
        };
        let &[s, t, ..] = t else { return missing };
        let Some((face, patch)) = self.patch_of(cell) else {
            let patch = cell.saturating_sub(self.cells_of_faces()) as u32;
            let direction = self.sky_direction(patch, [s, t].map(F::from_f64));
            return direction.map_or(missing, |position| Point {
                face: SKY,
                position,
            });
        };
        // A triangle is half of a square, folded.
        let folded = patch.triangle == 1 && s + t > 1.0;
        let place = if folded { [1.0 - s, 1.0 - t] } else { [s, t] };
        let at = patch.within(cell as u32 - patch.first, place.map(F::from_f64));
        Point {
            face,
            position: patch.point(at),
        }
    }

    /// The point of any face with three coordinates.
    fn at(&self, coordinates: &[f64]) -> Option<Point<F>> {
        let &[x, y, z] = coordinates else { return None };
        (0..self.sides.len() as u32).find_map(|face| self.at(face, [x, y, z]).ok())
    }
}
