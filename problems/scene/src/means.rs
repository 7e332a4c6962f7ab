//! Means over faces.

use fredholm_core::global::Stationary;
use fredholm_core::{
    Equation, Functional, Lights, Real, Space, Start, StartOf, Uniforms, Value, WideOf,
};
use num_traits::{one, zero};

use crate::SceneError;
use crate::cells::folded;
use crate::geometry::{Face, Geometry};
use crate::radiosity::{Point, Radiosity};
use crate::vector::{Vector, along, cross, least_axis, norm, sub, unit};

/// The mean of u over some faces by area: walks start on them uniformly.
///
/// ```
/// use fredholm_scene::{Enclosure, Mean, Scene, areas, shapes};
///
/// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0, 1.0, 2.0]).surfaces(), Enclosure::Closed)?;
/// // Of the floor and two sides.
/// let (geometry, faces) = (scene.geometry(), [0, 2, 3]);
/// let ends = areas(geometry, &faces)?;
/// assert_eq!(ends, [1.0, 3.0, 5.0]);
/// assert_eq!(Mean::new(geometry, &faces, &ends)?.area(), 5.0);
/// # Ok::<(), fredholm_scene::SceneError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Mean<'a, F> {
    geometry: Geometry<'a, F>,
    faces: &'a [u32],
    /// The area of each face with all before it.
    ends: &'a [F],
    area: F,
}

/// The area of every one of these faces together with all before it: where [`Mean`] looks for a start by bisection.
///
/// # Errors
/// [`SceneError::Face`]: there is no such face.
#[cfg(feature = "alloc")]
pub fn areas<F: Real>(
    geometry: Geometry<'_, F>,
    faces: &[u32],
) -> Result<alloc::vec::Vec<F>, SceneError> {
    // In f64, as sums of many small areas lose digits in f32.
    let mut sum = 0.0;
    let mut end = |&number: &u32| {
        let none = SceneError::Face {
            face: number as usize,
        };
        sum += geometry.face(number).ok_or(none)?.area.to_f64();
        Ok(F::from_f64(sum))
    };
    faces.iter().map(&mut end).collect()
}

impl<'a, F: Real> Mean<'a, F> {
    /// The mean over these faces, each once, whose [`areas`] are `ends`.
    ///
    /// # Errors
    /// [`SceneError::Face`]: there is no such face; [`SceneError::Empty`]: there is none; [`SceneError::Length`]: not one
    /// end for every face.
    pub fn new(
        geometry: Geometry<'a, F>,
        faces: &'a [u32],
        ends: &'a [F],
    ) -> Result<Self, SceneError> {
        let (expected, found) = (faces.len(), ends.len());
        if expected != found {
            return Err(SceneError::Length { expected, found });
        }
        let missing = faces.iter().find(|&&face| geometry.face(face).is_none());
        if let Some(&face) = missing {
            return Err(SceneError::Face {
                face: face as usize,
            });
        }
        let area = *ends.last().ok_or(SceneError::Empty)?;
        Ok(Self {
            geometry,
            faces,
            ends,
            area,
        })
    }

    /// The area of all of them.
    #[must_use]
    pub const fn area(&self) -> F {
        self.area
    }

    /// (F_s, Φ): the mean of the emission of lights, to which the last step leads.
    #[must_use]
    pub fn known<E>(&self, equation: &E) -> WideOf<E>
    where
        E: Lights<Scalar = F, Point = Point<F>>,
    {
        let mut sum = WideOf::<E>::splat(equation.channels(), 0.0);
        let mut areas = 0.0;
        for &number in self.faces {
            let Some(face) = self.geometry.face(number) else {
                continue;
            };
            let x = Point {
                face: number,
                position: face.middle(),
            };
            let area = face.area.to_f64();
            sum = sum.plus(&equation.known(&x).wide().scaled(area));
            areas += area;
        }
        sum.scaled(1.0 / areas)
    }

    /// A point that is uniform on the faces.
    pub(crate) fn point<U: Uniforms<F>>(&self, uniforms: &mut U) -> Point<F> {
        let numbers = [uniforms.uniform(), uniforms.uniform()];
        let (place, share) = chosen(self.ends, uniforms.uniform() * self.area);
        let number = self.faces.get(place).copied().unwrap_or(u32::MAX);
        on_face(self.geometry, number, share, numbers)
    }
}

impl Mean<'_, f64> {
    /// A ray that leaves the faces evenly, and by the cosine law, as light of one brightness does.
    pub fn ray<U: Uniforms<f64>>(&self, uniforms: &mut U) -> Ray {
        let from = self.point(uniforms);
        let numbers = [uniforms.uniform(), uniforms.uniform()];
        let normal = self.geometry.face(from.face).map(|face| face.normal);
        let normal = normal.unwrap_or([f64::NAN; 3]);
        let across = unit(cross(normal, least_axis(normal)));
        let tangents = [across, cross(normal, across)];
        let direction = Radiosity::<f64>::direction(tangents, normal, numbers);
        Ray { from, direction }
    }
}

/// A ray from the active side of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it begins.
    pub from: Point<f64>,
    /// Where it leads: a vector of length 1.
    pub direction: [f64; 3],
}

/// The place of the first of ascending ends above a number, and how far that is from the end before to this one, from 0 to 1.
pub(crate) fn chosen<F: Real>(ends: &[F], at: F) -> (usize, F) {
    // Rounding may lead behind the last.
    let place = ends.partition_point(|&end| end <= at);
    let place = place.min(ends.len().saturating_sub(1));
    let end = ends.get(place).copied().unwrap_or(F::NAN);
    let before = place.checked_sub(1).and_then(|i| ends.get(i)).copied();
    let before = before.unwrap_or(zero());
    (place, (at - before) / (end - before))
}

/// A point that is uniform on a face, of which `share` is uniform, too, and tells the triangle of a quadrilateral.
pub(crate) fn on_face<F: Real>(
    geometry: Geometry<'_, F>,
    face: u32,
    share: F,
    numbers: [F; 2],
) -> Point<F> {
    let on = |own: &Face<F>| -> Vector<F> {
        let [a, b, c, d] = own.corners;
        let half = F::from_f64(0.5) * norm(cross(sub(b, a), sub(c, a)));
        let is_first = own.count == 3 || share * own.area < half;
        let (p, q) = if is_first { (b, c) } else { (c, d) };
        let [s, t] = folded(numbers);
        along(along(a, s, sub(p, a)), t, sub(q, a))
    };
    Point {
        face,
        position: geometry.face(face).map_or([F::NAN; 3], on),
    }
}

impl<F: Real, E> Functional<E> for Mean<'_, F>
where
    E: Equation<Scalar = F, Point = Point<F>>,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, equation: &E, uniforms: &mut U) -> StartOf<E> {
        Start::of(equation, self.point(uniforms), one())
    }
}

/// Starts of the walks of a global estimate are uniform on the faces, p0 = 1/A.
///
/// p is symmetric, as light goes both ways: on all faces of a scene, a chain that no ray leaves preserves p0. Of others, which walks leave
/// more often in some places than in others, starts alone have it.
impl<F: Real, E> Stationary<E> for Mean<'_, F>
where
    E: Space<Scalar = F, Point = Point<F>>,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> Point<F> {
        self.point(uniforms)
    }

    #[inline]
    fn start_density(&self, _: &Point<F>) -> f64 {
        1.0 / self.area.to_f64()
    }

    fn is_preserved(&self) -> bool {
        // With mirrors it has the density 1 − ρ_s.
        let is_even = !self.geometry.is_open() && !self.geometry.has_mirrors();
        self.faces.len() == self.geometry.faces().len() && is_even
    }
}
