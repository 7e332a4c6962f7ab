//! Starts of walks other than points and means of u: what arrives at a face, and what a point in the air sees.

use fredholm_core::array::from_fn;
use fredholm_core::{Functional, Real, Sampler, Started, StateSpace, Uniforms, WithKnown};
use num_traits::{one, zero};

use crate::SceneError;
use crate::light::Receiver;
use crate::radiosity::{Point, Radiosity};
use crate::ray::Backs;
use crate::vector::{Vector, cross, unit};

/// The irradiance H of the points of another functional,
///
/// ```text
/// (H, Φ),  H(x) = ∫ u(y) cos θ_x cos θ_y V(x, y)/(π |x − y|²) dA(y),
/// ```
///
/// also where nothing is reflected: u = F + ρ H says nothing of H there. A walk starts where a ray of a cosine-distributed
/// direction from x arrives; the light of lights is estimated in x itself, as in all other states.
#[derive(Clone, Copy, Debug)]
pub struct Irradiance<'a, F, T> {
    /// The equation.
    pub radiosity: &'a Radiosity<'a, F>,
    /// The functional of which x is a start.
    pub of: T,
}

/// φ of a walk that has left the scene with its first ray: next to what is known there its score is nothing.
pub(crate) const LEFT: f64 = 1.0 / (1_u64 << 60) as f64;

/// The start of a walk that has left the scene, of whose score all is known.
fn left_with<F: Real>(point: Point<F>, known: F, phi: F) -> (Started<Point<F>, F>, F) {
    let left = F::from_f64(LEFT);
    let known = known / left;
    (Started { point, known }, phi * left)
}

impl<F: Real, T> Irradiance<'_, F, T> {
    /// A start of a walk, with what is known of its score, and φ.
    pub fn draw<E, U>(&self, uniforms: &mut U) -> (Started<Point<F>, F>, F)
    where
        E: StateSpace<Scalar = F, Point = Point<F>>,
        T: Functional<E>,
        U: Uniforms<F>,
    {
        let (x, phi) = self.of.start(uniforms);
        let Some(on) = self.radiosity.receiver(&x) else {
            return self.radiosity.nowhere();
        };
        let known =
            self.radiosity.sample_direct(&on, uniforms) + self.radiosity.irradiance_of_beams(&on);
        match self.radiosity.step(&x, uniforms) {
            Some(point) => (Started { point, known }, phi),
            None => left_with(x, known, phi),
        }
    }
}

impl<'e, F: Real, E, T> Functional<WithKnown<'e, E>> for Irradiance<'_, F, T>
where
    E: StateSpace<Scalar = F, Point = Point<F>>,
    T: Functional<E>,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Started<Point<F>, F>, F) {
        self.draw::<E, U>(uniforms)
    }
}

#[cfg(feature = "alloc")]
impl crate::Scene {
    /// The face [on which](crate::Geometry::is_on) a position is; of several that which comes first.
    ///
    /// ```
    /// use fredholm_scene::{Enclosure, Scene, shapes};
    ///
    /// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
    /// // Floor and ceiling are 0 and 1.
    /// assert_eq!(scene.face_at([0.5, 0.5, 1.0]), Some(1));
    /// assert_eq!(scene.face_at([0.5, 0.0, 0.0]), Some(0));
    /// assert_eq!(scene.face_at([0.5, 0.5, 0.5]), None);
    /// # Ok::<(), fredholm_scene::SceneError>(())
    /// ```
    #[must_use]
    pub fn face_at(&self, position: [f64; 3]) -> Option<u32> {
        let geometry = self.geometry();
        let all = self.nodes.first()?;
        // No face is wider.
        let slack = 1e-6 * crate::vector::norm(crate::vector::sub(all.high, all.low));
        let mut found: Option<u32> = None;
        geometry.visit(
            &mut |node| {
                (0..3).any(|k| {
                    !(position[k] >= node.low[k] - slack && position[k] <= node.high[k] + slack)
                })
            },
            &mut |triangle| {
                let is_first = found.is_none_or(|found| triangle.face < found);
                if is_first && geometry.is_on(triangle.face, position) {
                    found = Some(triangle.face);
                }
            },
        );
        found
    }

    /// Whether a position is between the surfaces: whether a ray from there meets a face's active side. In a closed scene
    /// one ray tells.
    ///
    /// ```
    /// use fredholm_scene::{Enclosure, Scene, shapes};
    ///
    /// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
    /// assert!(scene.is_between([0.5, 0.2, 0.9]));
    /// assert!(!scene.is_between([0.5, 0.2, 1.1]));
    /// # Ok::<(), fredholm_scene::SceneError>(())
    /// ```
    #[must_use]
    pub fn is_between(&self, position: [f64; 3]) -> bool {
        let meets = |direction| {
            let hit = self
                .geometry()
                .nearest(None, position, direction, Backs::Block);
            hit.is_some_and(|hit| !hit.back)
        };
        if self.enclosure() == crate::Enclosure::Closed {
            return meets([0.36, 0.48, 0.8]);
        }
        // Of equal height each, by the golden angle about the axis.
        (0..OPEN_RAYS).any(|i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(OPEN_RAYS);
            let r = Real::sqrt(1.0 - z * z);
            let angle = 2.399_963_229_728_653 * f64::from(i);
            meets([r * Real::cos(angle), r * Real::sin(angle), z])
        })
    }
}

/// Rays that look for a surface where light may leave.
#[cfg(feature = "alloc")]
const OPEN_RAYS: u32 = 1024;

/// The mean of u over all directions in which a point between the surfaces sees them, (1/4π) ∫ u dω: σT⁴ of the mean
/// radiant temperature T, where u is heat. Directions in which light leaves count with u = 0, or with the light of the sky.
#[derive(Clone, Copy, Debug)]
pub struct Air<'a, F> {
    /// The equation.
    pub radiosity: &'a Radiosity<'a, F>,
    /// The place.
    pub position: [F; 3],
}

impl<F: Real> Air<'_, F> {
    /// A start of a walk, with what is known of its score, and φ.
    pub fn draw<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Started<Point<F>, F>, F) {
        let numbers = [uniforms.uniform(), uniforms.uniform()];
        self.at(numbers)
    }

    /// The start of a walk that two numbers in [0, 1) give.
    pub fn at(&self, [a, b]: [F; 2]) -> (Started<Point<F>, F>, F) {
        // Archimedes: the height is uniform.
        let z = one::<F>() - F::from_f64(2.0) * a;
        let angle = F::from_f64(2.0) * F::PI * b;
        let r = Real::max(one::<F>() - z * z, zero()).sqrt();
        self.radiosity
            .seen(self.position, [r * angle.cos(), r * angle.sin(), z])
            .unwrap_or_else(|| self.radiosity.nowhere())
    }
}

/// The irradiance at a place between the surfaces of what faces in a direction n, a light meter say,
///
/// ```text
/// H(x, n) = (1/π) ∫ u max(cos θ, 0) dω,   cos θ = n · ω,
/// ```
///
/// in the unit of u, with u = 0 where light leaves, or the light of the sky. Where u is heat it is σT⁴ of the plane radiant
/// temperature T (ISO 7726). A walk starts where a ray of a cosine-distributed direction arrives; the light of lights, lamps and
/// the sun is estimated in x itself.
///
/// ```
/// use fredholm_core::{DefaultGenerator, RngUniforms, WalkSeeds};
/// use fredholm_scene::{
///     Cells, Enclosure, Facing, Material, Radiosity, Scene, Surface, Tables, form_factor_of_point, shapes,
/// };
///
/// // A black room whose ceiling, the second surface, is a lamp: nothing is left to walks.
/// let [black, lamp] = [0.0, 2.0].map(|emission| [Material { reflectance: 0.0, emission }]);
/// let room = shapes::room([0.0; 3], [1.0; 3]).surfaces;
/// let material = |number: usize| if number == 1 { &lamp } else { &black };
/// let surfaces = room.iter().enumerate();
/// let surfaces: Vec<_> = surfaces.map(|(i, polygons)| Surface { polygons, materials: material(i) }).collect();
/// let scene = Scene::new::<f64>(&surfaces, Enclosure::Closed)?;
/// let (tables, cells) = (Tables::<f64>::new(&scene), Cells::new(&scene, 6)?);
/// let radiosity = Radiosity::new(tables.geometry(), &cells, 0.3)?;
/// let (desk, up) = ([0.3, 0.6, 0.7], [0.0, 0.0, 1.0]);
/// let mut draws = RngUniforms(WalkSeeds::<DefaultGenerator>::new(1, 0).generator(0));
/// let (start, phi) = Facing::new(&radiosity, desk, up)?.draw(&mut draws);
/// let exact = 2.0 * form_factor_of_point(desk, up, scene.faces()[1].polygon());
/// assert!((start.known - exact).abs() < 1e-12 && phi == 1.0);
/// # Ok::<(), fredholm_scene::SceneError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Facing<'a, F> {
    radiosity: &'a Radiosity<'a, F>,
    position: Vector<F>,
    /// n.
    normal: Vector<F>,
    tangents: [Vector<F>; 2],
}

impl<'a, F: Real> Facing<'a, F> {
    /// What faces in a direction of any length at a place between the surfaces.
    ///
    /// # Errors
    /// [`SceneError::Direction`]: the direction has no length, or none that is finite.
    pub fn new(
        radiosity: &'a Radiosity<'a, F>,
        position: [f64; 3],
        direction: [f64; 3],
    ) -> Result<Self, SceneError> {
        // Of the largest coordinate: a square is never too large then.
        let largest = direction.into_iter().map(f64::abs).fold(0.0, f64::max);
        if !(largest > 0.0 && direction.into_iter().all(f64::is_finite)) {
            return Err(SceneError::Direction);
        }
        let normal = unit(direction.map(|c| c / largest));
        let least = (0..3).fold(0, |k, i| {
            if normal[i].abs() < normal[k].abs() {
                i
            } else {
                k
            }
        });
        let axis = from_fn(|i| if i == least { 1.0 } else { 0.0 });
        let across = unit(cross(normal, axis));
        let tangents = [across, cross(normal, across)];
        let rounded = |a: Vector<f64>| a.map(F::from_f64);
        Ok(Self {
            radiosity,
            position: rounded(position),
            normal: rounded(normal),
            tangents: tangents.map(rounded),
        })
    }

    /// A start of a walk, with what is known of its score, and φ.
    pub fn draw<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Started<Point<F>, F>, F) {
        let radiosity = self.radiosity;
        let on = Receiver {
            position: self.position,
            normal: self.normal,
            on: None,
        };
        let known = radiosity.sample_direct(&on, uniforms) + radiosity.irradiance_of_beams(&on);
        let numbers = [uniforms.uniform(), uniforms.uniform()];
        let direction = Radiosity::direction(self.tangents, self.normal, numbers);
        match radiosity.seen(self.position, direction) {
            // The emission of lights is in `known` already.
            Some((Started { point, .. }, phi)) => (Started { point, known }, phi),
            None => {
                let (Started { point, .. }, _) = radiosity.nowhere();
                left_with(point, known, one())
            }
        }
    }
}

impl<'e, F: Real, E> Functional<WithKnown<'e, E>> for Facing<'_, F>
where
    E: StateSpace<Scalar = F, Point = Point<F>>,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Started<Point<F>, F>, F) {
        self.draw(uniforms)
    }
}

impl<F: Real> Radiosity<'_, F> {
    /// The walk for u of what a ray meets that starts between the surfaces, with the emission that is known there, and φ = 1.
    /// `None`: it meets nothing, no sky either, or, where light may leave, a face from behind. In a closed scene, faces are not
    /// met from behind.
    #[must_use]
    pub fn seen(&self, from: [F; 3], direction: [F; 3]) -> Option<(Started<Point<F>, F>, F)> {
        self.met(from, direction, self.backs())
    }

    /// What a camera sees in this direction: [`seen`](Self::seen), but no back hides what is behind it, so that one may look
    /// into a room from outside.
    #[must_use]
    pub fn seen_through_backs(
        &self,
        from: [F; 3],
        direction: [F; 3],
    ) -> Option<(Started<Point<F>, F>, F)> {
        self.met(from, direction, Backs::Pass)
    }

    fn met(
        &self,
        from: Vector<F>,
        direction: Vector<F>,
        backs: Backs,
    ) -> Option<(Started<Point<F>, F>, F)> {
        let Some(hit) = self.geometry.nearest(None, from, direction, backs) else {
            let (point, known) = (self.sky_at(direction)?, zero());
            return Some((Started { point, known }, one()));
        };
        if hit.back {
            return None;
        }
        let point = Point {
            face: hit.face,
            position: hit.point,
        };
        let known = self.emission_of_light(hit.face);
        Some((Started { point, known }, one()))
    }

    /// The emission of a face if it is a light, to which the last step leads: it is known where a walk starts. Otherwise 0.
    #[must_use]
    pub fn emission_of_light(&self, face: u32) -> F {
        let own = self.geometry.face(face);
        let side = self.sides.get(face as usize);
        match (own, side) {
            (Some(own), Some(side)) => own.emission - side.emission,
            _ => F::NAN,
        }
    }

    /// A start of a walk that scores nothing: φ = 0.
    #[must_use]
    pub fn nowhere(&self) -> (Started<Point<F>, F>, F) {
        let middle = self.geometry.face(0).map(|face| face.middle());
        let point = Point {
            face: 0,
            position: middle.unwrap_or([F::NAN; 3]),
        };
        let known = zero();
        (Started { point, known }, zero())
    }
}

impl<'e, F: Real, E> Functional<WithKnown<'e, E>> for Air<'_, F>
where
    E: StateSpace<Scalar = F, Point = Point<F>>,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Started<Point<F>, F>, F) {
        self.draw(uniforms)
    }
}
