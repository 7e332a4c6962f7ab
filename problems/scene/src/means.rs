//! Means over faces.

#[cfg(feature = "alloc")]
use fredholm_core::LastStep;
#[cfg(feature = "alloc")]
use fredholm_core::whole::Starts;
use fredholm_core::{Functional, Real, StateSpace, Uniforms};
use num_traits::{one, zero};

use crate::SceneError;
use crate::geometry::{Face, Geometry};
use crate::radiosity::Point;
#[cfg(feature = "alloc")]
use crate::radiosity::Radiosity;
use crate::vector::{Vector, along, cross, norm, sub};

/// The mean of u over some faces by area: walks start on them uniformly.
///
/// ```
/// use fredholm_scene::{Enclosure, Mean, Scene, areas, shapes};
///
/// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0, 1.0, 2.0]).surfaces(), Enclosure::Closed)?;
/// let geometry = scene.geometry();
/// // Of floor and one side, and of all.
/// assert_eq!(Mean::new(geometry, &[0, 2], &areas(geometry, &[0, 2])?)?.area(), 3.0);
/// let all = [0, 1, 2, 3, 4, 5];
/// assert_eq!(Mean::new(geometry, &all, &areas(geometry, &all)?)?.area(), 10.0);
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
///
/// ```
/// use fredholm_scene::{Enclosure, Scene, areas, shapes};
///
/// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0, 1.0, 2.0]).surfaces(), Enclosure::Closed)?;
/// assert_eq!(areas(scene.geometry(), &[0, 2, 3])?, [1.0, 3.0, 5.0]);
/// # Ok::<(), fredholm_scene::SceneError>(())
/// ```
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
    /// The mean over these faces, whose [`areas`] are `ends`.
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
}

/// A point that is uniform on a face, of which `share` is uniform, too, and tells the triangle of a quadrilateral.
pub(crate) fn on_face<F: Real>(face: &Face<F>, share: F, [s, t]: [F; 2]) -> Vector<F> {
    let [a, b, c, d] = face.corners;
    let half = F::from_f64(0.5) * norm(cross(sub(b, a), sub(c, a)));
    let is_first = face.count == 3 || share * face.area < half;
    let (p, q) = if is_first { (b, c) } else { (c, d) };
    let (s, t) = if s + t > one() {
        (one::<F>() - s, one::<F>() - t)
    } else {
        (s, t)
    };
    along(along(a, s, sub(p, a)), t, sub(q, a))
}

impl<F: Real, E> Functional<E> for Mean<'_, F>
where
    E: StateSpace<Scalar = F, Point = Point<F>>,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Point<F>, F) {
        self.draw(uniforms)
    }
}

impl<F: Real> Mean<'_, F> {
    /// A start of a walk, and φ = 1: for whoever has functionals of several kinds.
    pub fn draw<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Point<F>, F) {
        let numbers = [uniforms.uniform(), uniforms.uniform()];
        let at = uniforms.uniform() * self.area;
        // Rounding may lead behind the last.
        let place = self.ends.partition_point(|&end| end <= at);
        let place = place.min(self.faces.len().saturating_sub(1));
        let before = place.checked_sub(1).and_then(|i| self.ends.get(i)).copied();
        let number = self.faces.get(place).copied().unwrap_or(u32::MAX);
        let position = self.geometry.face(number).map_or([F::NAN; 3], |face| {
            let share = (at - before.unwrap_or(zero())) / face.area;
            on_face(face, share, numbers)
        });
        let start = Point {
            face: number,
            position,
        };
        (start, one())
    }
}

/// Starts of the walks of a whole function that are uniform on all faces, p0 = 1/A.
///
/// p is symmetric, as light goes both ways, and q0 constant: a chain that no ray leaves preserves p0, with s = 1 − q0. Of others, which
/// walks leave more often in some places than in others, starts alone have it.
///
/// ```
/// use fredholm_core::{LastStep, whole::Starts};
/// use fredholm_scene::{Cells, Enclosure, FaceStarts, Radiosity, Scene, Tables, areas, shapes};
///
/// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0, 1.0, 2.0]).surfaces(), Enclosure::Closed)?;
/// let (tables, cells) = (Tables::new(&scene), Cells::new(&scene, 6)?);
/// let room = Radiosity::new(tables.geometry(), &cells, 0.25)?;
/// let all = [0, 1, 2, 3, 4, 5];
/// let ends = areas(room.geometry(), &all)?;
/// let starts = FaceStarts::new(&room, &all, &ends, scene.enclosure())?;
/// let survival = Starts::<LastStep<'_, Radiosity<'_, f64>>>::survival(&starts);
/// assert_eq!(survival, Some(0.75));
/// # Ok::<(), fredholm_scene::SceneError>(())
/// ```
#[cfg(feature = "alloc")]
#[derive(Clone, Copy, Debug)]
pub struct FaceStarts<'a, F> {
    everywhere: Mean<'a, F>,
    density: f64,
    survival: Option<f64>,
}

#[cfg(feature = "alloc")]
impl<'a, F: Real> FaceStarts<'a, F> {
    /// The starts of a scene: `faces` are all of them, and `ends` their [`areas`].
    ///
    /// # Errors
    /// As [`Mean::new`]; [`SceneError::Length`]: these are not as many as there are faces.
    pub fn new(
        radiosity: &Radiosity<'a, F>,
        faces: &'a [u32],
        ends: &'a [F],
        enclosure: crate::Enclosure,
    ) -> Result<Self, SceneError> {
        let geometry = radiosity.geometry();
        let (expected, found) = (geometry.faces().len(), faces.len());
        if expected != found {
            return Err(SceneError::Length { expected, found });
        }
        let everywhere = Mean::new(geometry, faces, ends)?;
        let stays = one::<F>() - radiosity.absorption_probability();
        Ok(Self {
            everywhere,
            density: 1.0 / everywhere.area().to_f64(),
            survival: (enclosure == crate::Enclosure::Closed).then_some(stays.to_f64()),
        })
    }
}

#[cfg(feature = "alloc")]
impl<'a, F: Real> Starts<LastStep<'a, Radiosity<'a, F>>> for FaceStarts<'_, F> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> Point<F> {
        self.everywhere.draw(uniforms).0
    }

    #[inline]
    fn start_density(&self, _: &Point<F>) -> f64 {
        self.density
    }

    fn survival(&self) -> Option<f64> {
        self.survival
    }
}
