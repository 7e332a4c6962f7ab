//! Means over faces.

use fredholm_core::{Functional, Real, StateSpace, Uniforms};
use num_traits::{one, zero};

use crate::geometry::{Face, Geometry};
use crate::radiosity::Point;
use crate::vector::{Vector, along, cross, norm, sub};

/// The mean of u over some faces by area: walks start on them uniformly.
///
/// ```
/// use fredholm_scene::{Enclosure, Mean, Scene, shapes};
///
/// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0, 1.0, 2.0]).surfaces(), Enclosure::Closed)?;
/// let geometry = scene.geometry();
/// // Of floor and one side, and of all.
/// assert_eq!(Mean::new(geometry, &[0, 2])?.area(), 3.0);
/// assert_eq!(Mean::new(geometry, &[0, 1, 2, 3, 4, 5])?.area(), 10.0);
/// # Ok::<(), fredholm_scene::SceneError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Mean<'a, F> {
    geometry: Geometry<'a, F>,
    faces: &'a [u32],
    area: F,
}

impl<'a, F: Real> Mean<'a, F> {
    /// The mean over these faces.
    ///
    /// # Errors
    /// [`SceneError::Face`](crate::SceneError::Face): there is no such face; [`SceneError::Empty`](crate::SceneError::Empty):
    /// there is none.
    pub fn new(geometry: Geometry<'a, F>, faces: &'a [u32]) -> Result<Self, crate::SceneError> {
        let mut area = zero::<F>();
        for &number in faces {
            let face = geometry.face(number);
            let none = crate::SceneError::Face {
                face: number as usize,
            };
            area += face.ok_or(none)?.area;
        }
        if faces.is_empty() {
            return Err(crate::SceneError::Empty);
        }
        Ok(Self {
            geometry,
            faces,
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
fn on_face<F: Real>(face: &Face<F>, share: F, [s, t]: [F; 2]) -> Vector<F> {
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
        let mut rest = uniforms.uniform() * self.area;
        let mut last = None;
        for &number in self.faces {
            let Some(face) = self.geometry.face(number) else {
                continue;
            };
            last = Some((number, face, rest / face.area));
            if rest < face.area {
                break;
            }
            rest -= face.area;
        }
        let start = last.map(|(face, polygon, share)| Point {
            face,
            position: on_face(polygon, share, numbers),
        });
        let nowhere = Point {
            face: u32::MAX,
            position: [F::NAN; 3],
        };
        (start.unwrap_or(nowhere), one())
    }
}
