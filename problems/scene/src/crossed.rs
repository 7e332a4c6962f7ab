//! Faces that a ray would cross if nothing else were there.

use fredholm_core::Real;
use fredholm_core::sampled::{SampledStep, StepEvents};
use num_traits::{one, zero};

use crate::cells::FacePatch;
use crate::geometry::Face;
use crate::lambert::form_factor_from_origin as from_origin;
use crate::light::Seen;
use crate::radiosity::{Point, Radiosity};
use crate::skylight::SKY;
use crate::vector::{Vector, dot, sub};

/// The event of a face is that the ray crosses it from its active side, whatever is in between: its probability is the form
/// factor of the part above the horizon, a sum over edges. No visibility is asked for, so that these serve behind obstacles,
/// too.
impl<F: Real, C> StepEvents<2> for Radiosity<'_, F, C> {
    fn towards(&self, cell: usize) -> Option<u32> {
        self.patch_of(cell).map(|(face, _)| face)
    }

    fn probability(&self, x: &Point<F>, event: u32) -> F {
        let (Some(own), Some(face)) = (self.face(x), self.geometry.face(event)) else {
            return F::NAN;
        };
        let from = inwards(own, x.position);
        if face.plane == own.plane || height(face, from).is_none() {
            return zero();
        }
        let seen = Seen::new(face, from, own.normal);
        from_origin(own.normal, seen.polygon()).max(zero())
    }

    fn occurring(&self, step: &SampledStep<'_, Point<F>, F, 2>, events: &[u32]) -> u32 {
        let x = step.from;
        let (Some(own), Some(side)) = (self.face(x), self.tables.sides.get(x.face as usize)) else {
            return 0;
        };
        // Rays may have turned in mirrors, or ended in another period.
        let direction = match step.to.filter(|_| self.geometry.is_straight()) {
            Some(y) if y.face == SKY => y.position,
            Some(y) => sub(y.position, x.position),
            None => Self::direction(side.tangents, own.normal, *step.omega),
        };
        let from = inwards(own, x.position);
        let mut occurring = 0;
        for (place, &event) in events.iter().take(32).enumerate() {
            let crossed = self.geometry.face(event).is_some_and(|face| {
                face.plane != own.plane && self.crosses((event, face), from, direction)
            });
            occurring |= u32::from(crossed) << place;
        }
        occurring
    }
}

impl<F: Real, C> Radiosity<'_, F, C> {
    /// Whether a ray crosses a face from its active side.
    #[inline]
    fn crosses(&self, (number, face): (u32, &Face<F>), from: Vector<F>, along: Vector<F>) -> bool {
        let fall = -dot(face.normal, along);
        let Some(height) = height(face, from).filter(|_| fall > zero()) else {
            return false;
        };
        let length = height / fall;
        let at = crate::vector::along(from, length, along);
        let Some(side) = self.tables.sides.get(number as usize) else {
            return false;
        };
        let own = self
            .tables
            .patches
            .get(side.patch as usize..)
            .unwrap_or(&[]);
        let mut own = own.iter().take(side.patches as usize);
        own.any(|patch| is_on(patch, at))
    }
}

/// The share of a width below which rounding decides where a ray crosses a face beside the point from which it starts.
#[inline]
fn near<F: Real>() -> F {
    F::from_f64(16.0) * F::EPSILON.sqrt()
}

/// The point from which faces are seen to be crossed: a little nearer to the middle of its face, so that it is not on the edge
/// of another one. Any point will do, if it is the same for the probability of an event and for what occurs.
#[inline]
fn inwards<F: Real>(own: &Face<F>, point: Vector<F>) -> Vector<F> {
    crate::vector::along(point, near(), sub(own.middle(), point))
}

/// The distance of a point from a face's plane, if it is on the active side and not next to the plane.
#[inline]
fn height<F: Real>(face: &Face<F>, point: Vector<F>) -> Option<F> {
    let height = dot(face.normal, sub(point, face.corners[0]));
    let is_above =
        height > zero() && height * height > near::<F>() * near::<F>() * near::<F>() * face.area;
    is_above.then_some(height)
}

/// Whether a point of its plane is on a patch.
#[inline]
fn is_on<F: Real>(patch: &FacePatch<F>, point: Vector<F>) -> bool {
    let [a, b] = patch.coordinates(point);
    let most = one::<F>();
    let is_below = if patch.triangle == 1 {
        a + b <= most
    } else {
        a <= most && b <= most
    };
    a >= zero() && b >= zero() && is_below
}
