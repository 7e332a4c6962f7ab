//! Light from a point, and light from one direction: a known part of the source.

use fredholm_core::Real;
use num_traits::zero;

use crate::light::Receiver;
use crate::radiosity::Radiosity;
use crate::vector::{dot, sub};

/// Light that no surface emits. What it gives directly is a known function of the place, so that it belongs to F: the
/// source of u is F(x) + ρ(x) E(x), with the irradiance E that follows.
///
/// ```
/// use fredholm_scene::Beam;
///
/// // The irradiance 3 below a lamp of 18 watts per steradian is 18/3² = 2; that of the sun does not depend on the place.
/// let lamp = Beam::Point { at: [0.0, 0.0, 3.0], intensity: 18.0 };
/// let sun = Beam::Parallel { towards: [0.0, 0.0, 1.0], irradiance: 900.0 };
/// assert_ne!(lamp, sun);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Beam<F> {
    /// A point source: E = I cos θ/r² where it is seen.
    Point {
        /// The place.
        at: [F; 3],
        /// I, the radiant intensity, in the unit of u times that of an area, per steradian; in all directions the same.
        intensity: F,
    },
    /// A source so far away that its rays are parallel: E = E_0 cos θ where it is seen.
    Parallel {
        /// The direction towards the source, a unit vector.
        towards: [F; 3],
        /// E_0, the irradiance of a surface that faces it, in the unit of u.
        irradiance: F,
    },
}

#[cfg(feature = "alloc")]
impl Beam<f64> {
    /// The beam with coordinates rounded to a scalar, and a direction of length 1; `None`: a number is not finite, the
    /// strength is negative, or the direction is none.
    pub(crate) fn rounded<F: Real>(&self) -> Option<Beam<F>> {
        let is_good = |vector: &[f64; 3], strength: f64| {
            vector.iter().all(|x| x.is_finite()) && strength >= 0.0 && strength.is_finite()
        };
        match *self {
            Self::Point { at, intensity } => is_good(&at, intensity).then(|| Beam::Point {
                at: at.map(F::from_f64),
                intensity: F::from_f64(intensity),
            }),
            Self::Parallel {
                towards,
                irradiance,
            } => {
                let length = crate::vector::norm(towards);
                (is_good(&towards, irradiance) && length > 0.0 && length.is_finite()).then(|| {
                    Beam::Parallel {
                        towards: towards.map(|x| F::from_f64(x / length)),
                        irradiance: F::from_f64(irradiance),
                    }
                })
            }
        }
    }
}

impl<F: Real> Radiosity<'_, F> {
    /// E, the irradiance by beams: a ray for each.
    pub(crate) fn irradiance_of_beams(&self, x: &Receiver<'_, F>) -> F {
        let emitter = x.on.and_then(|(point, _)| self.face(point));
        let mut sum = zero::<F>();
        for beam in self.beams {
            let (direction, distance, strength) = match *beam {
                Beam::Point { at, intensity } => {
                    let to = sub(at, x.position);
                    let square = dot(to, to);
                    let length = square.sqrt();
                    (to.map(|c| c / length), length, intensity / square)
                }
                Beam::Parallel {
                    towards,
                    irradiance,
                } => (towards, F::from_f64(f64::INFINITY), irradiance),
            };
            let cosine = dot(x.normal, direction);
            if !(cosine > zero()) {
                continue;
            }
            // A back is in the way, too, where there may be one.
            let backs = self.backs();
            let hit = self.geometry.nearest(emitter, x.position, direction, backs);
            if hit.is_none_or(|hit| hit.distance >= distance) {
                sum += strength * cosine;
            }
        }
        sum
    }
}
