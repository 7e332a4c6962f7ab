//! The light of the sun where it is told apart from heat: see `Scene::with_absorptances`.

use fredholm_core::{Chain, Real, Uniforms};
use fredholm_surfaces::Tint;
use num_traits::{one, zero};

use crate::radiosity::{Point, Radiosity};
use crate::skylight::SKY;

/// The most reflections of a walk in sunlight.
const MOST_REFLECTIONS: u32 = 1_000_000;

impl<F: Real, C: Tint<F>> Radiosity<'_, F, C> {
    /// (ε − α) H_s where a temperature is given, by an estimate of H_s; 0 elsewhere.
    pub(crate) fn less_sunlight<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> F {
        let Some(face) = self.face(x).filter(|face| face.reflectance < one()) else {
            return zero();
        };
        let absorbed = self.absorptance(x.face);
        let share = one::<F>() - face.reflectance - absorbed;
        // What absorbs as much of both is so but for rounding.
        match share.abs() <= F::from_f64(4.0) * F::EPSILON {
            true => zero(),
            false => share * self.sunlight(x, uniforms),
        }
    }

    /// α of a face.
    #[inline]
    fn absorptance(&self, face: u32) -> F {
        let all = self
            .geometry
            .sunlight
            .map_or(&[][..], |own| own.absorptances);
        all.get(face as usize).copied().unwrap_or(F::NAN)
    }

    /// An unbiased estimate of H_s, the irradiance of a point of a face by the light of the sun, direct and reflected: of a walk that ends in every
    /// point with the probability α. NaN if it does not end, where nothing absorbs.
    pub fn sunlight<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> F {
        let of_sky = self.geometry.sunlight.is_some_and(|own| own.of_sky);
        let (mut at, mut sum) = (*x, zero::<F>());
        for _ in 0..MOST_REFLECTIONS {
            let Some(on) = self.receiver(&at) else {
                return F::NAN;
            };
            sum += self.irradiance_of_beams(&on);
            let Some(next) = self.step(&at, uniforms) else {
                return sum;
            };
            if next.face == SKY {
                return if of_sky {
                    sum + self.sky_emission(&next)
                } else {
                    sum
                };
            }
            if uniforms.uniform() < self.absorptance(next.face) {
                return sum;
            }
            at = next;
        }
        F::NAN
    }
}
