//! Starts of walks other than points and means of u: what arrives at a face, and what a point in the air sees.

use fredholm_core::{
    Equation as _, Functional, LastStep, Lights as _, Real, Start, StartOf, Uniforms, Value as _,
};
use num_traits::{one, zero};

use crate::SceneError;
use crate::geometry::Face;
use crate::light::Receiver;
use crate::radiosity::{Point, Radiosity};
use crate::ray::Backs;
use crate::vector::{Vector, cross, unit};
use fredholm_surfaces::Tint;

/// The irradiance H of the points of another functional,
///
/// ```text
/// (H, Φ),  H(x) = ∫ u(y) cos θ_x cos θ_y V(x, y)/(π |x − y|²) dA(y),
/// ```
///
/// also where nothing is reflected: u = F + ρ H says nothing of H there. A walk starts where a ray of a cosine-distributed
/// direction from x arrives; the light of lights, lamps and the sun is estimated in x itself, as in all other states.
#[derive(Clone, Copy, Debug)]
pub struct Irradiance<T>(pub T);

impl<'e, 'r, F, C, T> Functional<LastStep<'e, Radiosity<'r, F, C>>> for Irradiance<T>
where
    F: Real,
    C: Tint<F>,
    T: Functional<LastStep<'e, Radiosity<'r, F, C>>>,
{
    fn start<U: Uniforms<F>>(
        &self,
        equation: &LastStep<'e, Radiosity<'r, F, C>>,
        uniforms: &mut U,
    ) -> StartOf<Radiosity<'_, F, C>> {
        let Start { point, phi, .. } = self.0.start(equation, uniforms);
        equation.arriving(&point, uniforms).scaled(phi)
    }
}

/// The mean of u over all directions in which a point between the surfaces sees them, (1/4π) ∫ u dω: σT⁴ of the mean
/// radiant temperature T, where u is heat. Directions in which light leaves count with u = 0, or with the light of the sky.
///
/// A start draws two numbers.
#[derive(Clone, Copy, Debug)]
pub struct Air<F> {
    /// The place.
    pub position: [F; 3],
}

impl<F: Real, C: Tint<F>> Functional<LastStep<'_, Radiosity<'_, F, C>>> for Air<F> {
    fn start<U: Uniforms<F>>(
        &self,
        equation: &LastStep<'_, Radiosity<'_, F, C>>,
        uniforms: &mut U,
    ) -> StartOf<Radiosity<'_, F, C>> {
        let direction = anywhere([uniforms.uniform(), uniforms.uniform()]);
        let seen = equation.0.seen(self.position, direction);
        let seen = equation.0.mirrored(seen, direction, uniforms);
        equation.0.start_at(seen, one())
    }
}

/// The direction that two numbers in [0, 1) give, uniform on the sphere.
pub(crate) fn anywhere<F: Real>([a, b]: [F; 2]) -> Vector<F> {
    // Archimedes: the height is uniform.
    let z = one::<F>() - F::from_f64(2.0) * a;
    let angle = F::from_f64(2.0) * F::PI * b;
    let r = Real::max(one::<F>() - z * z, zero()).sqrt();
    [r * angle.cos(), r * angle.sin(), z]
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
/// use fredholm_core::{DefaultGenerator, Functional, LastStep, RngUniforms, WalkSeeds};
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
/// let radiosity = Radiosity::new(tables.geometry(), &cells)?;
/// let (desk, up) = ([0.3, 0.6, 0.7], [0.0, 0.0, 1.0]);
/// let mut draws = RngUniforms(WalkSeeds::<DefaultGenerator>::new(1, 0).generator(0));
/// let start = Facing::new(desk, up)?.start(&LastStep(&radiosity), &mut draws);
/// let exact = 2.0 * form_factor_of_point(desk, up, scene.faces()[1].polygon());
/// assert!((start.known - exact).abs() < 1e-12 && start.phi == 1.0);
/// # Ok::<(), fredholm_scene::SceneError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Facing<F> {
    position: Vector<F>,
    /// n.
    normal: Vector<F>,
    tangents: [Vector<F>; 2],
}

impl<F: Real> Facing<F> {
    /// What faces in a direction of any length at a place between the surfaces.
    ///
    /// # Errors
    /// [`SceneError::Direction`]: the direction has no length, or none that is finite.
    pub fn new(position: [f64; 3], direction: [f64; 3]) -> Result<Self, SceneError> {
        // Of the largest coordinate: a square is never too large then.
        let largest = direction.into_iter().map(f64::abs).fold(0.0, f64::max);
        if !(largest > 0.0 && direction.into_iter().all(f64::is_finite)) {
            return Err(SceneError::Direction);
        }
        let normal = unit(direction.map(|c| c / largest));
        // One that is far from parallel.
        let axis = if normal[0].abs() < 0.6 {
            [1.0, 0.0, 0.0]
        } else {
            [0.0, 1.0, 0.0]
        };
        let across = unit(cross(normal, axis));
        let tangents = [across, cross(normal, across)];
        let rounded = |a: Vector<f64>| a.map(F::from_f64);
        Ok(Self {
            position: rounded(position),
            normal: rounded(normal),
            tangents: tangents.map(rounded),
        })
    }
}

impl<F: Real> Facing<F> {
    /// Hands on the number and the irradiance of every beam that reaches it.
    pub fn each_beam<C>(&self, radiosity: &Radiosity<'_, F, C>, each: &mut dyn FnMut(usize, F)) {
        radiosity.each_beam(&self.receiver(), each);
    }

    /// What a sun of strength 1 in the direction of this unit vector gives to it: see [`Radiosity::of_sun`].
    #[must_use]
    pub fn of_sun<C>(&self, radiosity: &Radiosity<'_, F, C>, towards: [F; 3]) -> F {
        let far = F::from_f64(f64::INFINITY);
        radiosity.cosine(&self.receiver(), towards, far)
    }

    const fn receiver(&self) -> Receiver<'_, F> {
        Receiver {
            position: self.position,
            normal: self.normal,
            on: None,
        }
    }
}

impl<F: Real, C: Tint<F>> Functional<LastStep<'_, Radiosity<'_, F, C>>> for Facing<F> {
    fn start<U: Uniforms<F>>(
        &self,
        equation: &LastStep<'_, Radiosity<'_, F, C>>,
        uniforms: &mut U,
    ) -> StartOf<Radiosity<'_, F, C>> {
        let radiosity = equation.0;
        // It has the emission of lights.
        let known = radiosity.irradiance(&self.receiver(), uniforms);
        let numbers = [uniforms.uniform(), uniforms.uniform()];
        let direction = Radiosity::<F>::direction(self.tangents, self.normal, numbers);
        let seen = radiosity.seen(self.position, direction);
        let seen = radiosity.mirrored(seen, direction, uniforms);
        Start {
            known,
            ..radiosity.start_at(seen, one())
        }
    }
}

impl<F: Real, C> Radiosity<'_, F, C> {
    /// What a ray meets that starts between the surfaces: a point of a face or of the sky. `None`: it meets nothing or, where light
    /// may leave, a face from behind. In a closed scene, faces are not met from behind.
    #[must_use]
    pub fn seen(&self, from: [F; 3], direction: [F; 3]) -> Option<Point<F>> {
        self.met(None, from, direction, self.geometry.backs())
    }

    /// What a camera sees in this direction: [`seen`](Self::seen), but no back hides what is behind it, so that one may look
    /// into a room from outside.
    #[must_use]
    pub fn seen_through_backs(&self, from: [F; 3], direction: [F; 3]) -> Option<Point<F>> {
        self.met(None, from, direction, Backs::Pass)
    }
}

impl<F: Real, C: Tint<F>> Radiosity<'_, F, C> {
    /// The start of a walk for φ u of what is seen, with the emission of lights that is known there. `None`: nothing is seen, and the
    /// walk scores nothing.
    pub fn start_at(&self, seen: Option<Point<F>>, phi: F) -> StartOf<Self> {
        let Some(point) = seen else {
            let middle = self.geometry.face(0).map(Face::middle);
            let point = Point {
                face: 0,
                position: middle.unwrap_or([F::NAN; 3]),
            };
            return Start::of(self, point, zero());
        };
        let known = self.known(&point).scaled(phi);
        Start { point, phi, known }
    }
}

#[cfg(feature = "alloc")]
impl crate::Scene {
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
        // By the golden ratio about the axis.
        (0..OPEN_RAYS).any(|i| {
            let height = (f64::from(i) + 0.5) / f64::from(OPEN_RAYS);
            meets(anywhere([height, 0.381_966_011_250_105 * f64::from(i)]))
        })
    }
}

/// Rays that look for a surface where light may leave.
#[cfg(feature = "alloc")]
const OPEN_RAYS: u32 = 1024;
