//! Light from a point, and light from one direction: a known part of the source.

use fredholm_core::{Equation, Real, Value};
use fredholm_surfaces::Tint;
use num_traits::zero;

use crate::light::Receiver;
use crate::radiosity::{Point, Radiosity};
use crate::vector::{dot, sub};

/// Light that no surface emits. What it gives directly is a known function of the place, so that it belongs to F: the
/// source of u is F(x) + ρ(x) E(x), with the irradiance E that follows.
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
    /// Whether it comes from a point.
    pub(crate) const fn is_lamp(&self) -> bool {
        matches!(self, Self::Point { .. })
    }

    /// The beam with coordinates rounded to a scalar, and a direction of length 1; `None`: a number is not finite, the
    /// strength is negative, or the direction is none.
    pub(crate) fn rounded<F: Real>(&self) -> Option<Beam<F>> {
        let (Self::Point {
            at: vector,
            intensity: strength,
        }
        | Self::Parallel {
            towards: vector,
            irradiance: strength,
        }) = *self;
        let is_good =
            vector.iter().all(|x| x.is_finite()) && (0.0..f64::INFINITY).contains(&strength);
        let size = F::from_f64(strength);
        match self {
            Self::Point { .. } => is_good.then(|| Beam::Point {
                at: vector.map(F::from_f64),
                intensity: size,
            }),
            Self::Parallel { .. } => {
                let length = crate::vector::norm(vector);
                (is_good && length > 0.0 && length.is_finite()).then(|| Beam::Parallel {
                    towards: vector.map(|x| F::from_f64(x / length)),
                    irradiance: size,
                })
            }
        }
    }
}

impl<F: Real, C: Tint<F>> Radiosity<'_, F, C> {
    /// Hands on the number of every beam that reaches a point of a face, and what is reflected of it: its part of the source.
    pub fn reflected_of_beams(&self, x: &Point<F>, each: &mut dyn FnMut(usize, C::Value)) {
        if let Some(on) = self.receiver(x) {
            self.each_beam(&on, &mut |beam, irradiance| {
                each(beam, self.kernel(x, x).scaled(irradiance));
            });
        }
    }

    /// The irradiance of a point of a face by a sun of strength 1 in the direction of this unit vector: the cosine of the angle at which the
    /// light arrives, and 0 where something hides the sun.
    ///
    /// ```
    /// use fredholm_scene::{Cells, Enclosure, Radiosity, Scene, Tables, shapes};
    ///
    /// // The floor of a room without a ceiling, 1 wide and high: a sun that is twice as high as far reaches one half of it.
    /// let mut sides = shapes::room([0.0; 3], [1.0; 3]).surfaces;
    /// sides.remove(1);
    /// let scene = Scene::new::<f64>(&shapes::Shape { surfaces: sides }.surfaces(), Enclosure::Open)?;
    /// let (tables, cells) = (Tables::<f64>::new(&scene), Cells::new(&scene, 5)?);
    /// let room = Radiosity::new(tables.geometry(), &cells)?;
    /// let unit = 1.0 / f64::sqrt(5.0);
    /// let lit = |x| room.at(0, [x, 0.5, 0.0]).map(|x| room.of_sun(&x, [unit, 0.0, 2.0 * unit]));
    /// assert!((lit(0.4)? - 2.0 * unit).abs() < 1e-15 && lit(0.6)? == 0.0);
    /// # Ok::<(), fredholm_scene::SceneError>(())
    /// ```
    #[inline]
    pub fn of_sun(&self, x: &Point<F>, towards: [F; 3]) -> F {
        let far = F::from_f64(f64::INFINITY);
        let on = self.receiver(x);
        on.map_or(zero(), |on| self.cosine(&on, towards, far))
    }
}

impl<F: Real, C> Radiosity<'_, F, C> {
    /// E, the irradiance by beams: a ray for each.
    pub(crate) fn irradiance_of_beams(&self, x: &Receiver<'_, F>) -> F {
        let mut sum = zero::<F>();
        self.each_beam(x, &mut |_, irradiance| sum += irradiance);
        sum
    }

    /// Hands on the number and the irradiance of every beam that reaches a receiver.
    pub(crate) fn each_beam(&self, x: &Receiver<'_, F>, each: &mut dyn FnMut(usize, F)) {
        for (number, beam) in self.tables.beams.iter().enumerate() {
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
            let cosine = self.cosine(x, direction, distance);
            if cosine > zero() {
                each(number, strength * cosine);
            }
        }
    }

    /// The cosine of the angle at which light that comes from a distance reaches a receiver; 0: where it does not.
    pub(crate) fn cosine(&self, x: &Receiver<'_, F>, direction: [F; 3], distance: F) -> F {
        let cosine = dot(x.normal, direction);
        // Written so that NaN fails.
        if !(cosine > zero()) {
            return zero();
        }
        let emitter = x.on.and_then(|(point, _)| self.face(point));
        // A back is in the way, too, where there may be one.
        let backs = self.geometry.backs();
        let hit = self.geometry.nearest(emitter, x.position, direction, backs);
        match hit {
            Some(hit) if hit.distance < distance => zero(),
            _ => cosine,
        }
    }
}
