//! Light in several channels: colours.

use fredholm_core::channels::Channels;
use fredholm_core::galerkin::{Basis, Partition};
use fredholm_core::{Kernel, Located, Real, Sampler, SourceSampler as _, StateSpace, Uniforms};
use num_traits::zero;

use crate::SceneError;
use crate::radiosity::{Point, Radiosity};
use crate::skylight::SKY;

/// The equations of light in several channels on a scene: u_c = ρ_c T u_c + F_c, where T is the same for all.
///
/// The [`Radiosity`] behind them has the largest ρ_c and the largest F_c of every face. One walk of it serves all channels, and a
/// last step chooses its light by the largest F_c. Beams and the sky are white: as strong in every channel.
///
/// ```
/// use fredholm_core::channels::Channels;
/// use fredholm_scene::{Cells, Coloured, Enclosure, Material, Radiosity, Scene, Surface, Tables, shapes};
///
/// // A cube that reflects half of the red and a tenth of the green.
/// let room = shapes::room([0.0; 3], [1.0; 3]);
/// let material = [Material { reflectance: 0.5, emission: 0.0 }];
/// let surfaces: Vec<Surface<'_>> = room
///     .surfaces
///     .iter()
///     .map(|polygons| Surface { polygons, materials: &material })
///     .collect();
/// let scene = Scene::new::<f64>(&surfaces, Enclosure::Closed)?;
/// let (tables, cells) = (Tables::new(&scene), Cells::new(&scene, 6)?);
/// let radiosity = Radiosity::new(tables.geometry(), &cells, 0.25)?;
/// let (factors, shares) = ([1.0, 0.2].repeat(6), [0.0, 0.0].repeat(6));
/// let coloured = Coloured::new(radiosity, 2, (&factors, &shares))?;
/// let mut own = [0.0; 2];
/// coloured.factors(&radiosity.at(0, [0.5, 0.5, 0.0])?, &mut own);
/// assert_eq!(own.map(|factor| 0.5 * factor), [0.5, 0.1]);
/// # Ok::<(), fredholm_scene::SceneError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Coloured<'a, F> {
    radiosity: Radiosity<'a, F>,
    channels: usize,
    factors: &'a [F],
    shares: &'a [F],
}

impl<'a, F: Real> Coloured<'a, F> {
    /// The equations of so many channels: for every face, and there for every channel, ρ_c over that of `radiosity`, and F_c
    /// over that of `radiosity`, both from 0 to 1.
    ///
    /// # Errors
    /// [`SceneError::Length`]: not one number for every face and channel.
    pub fn new(
        radiosity: Radiosity<'a, F>,
        channels: usize,
        (factors, shares): (&'a [F], &'a [F]),
    ) -> Result<Self, SceneError> {
        let expected = radiosity.geometry().faces().len().saturating_mul(channels);
        for found in [factors.len(), shares.len()] {
            if found != expected {
                return Err(SceneError::Length { expected, found });
            }
        }
        Ok(Self {
            radiosity,
            channels,
            factors,
            shares,
        })
    }

    /// The equation of the largest ρ_c and F_c.
    #[must_use]
    pub const fn radiosity(&self) -> &Radiosity<'a, F> {
        &self.radiosity
    }

    /// The numbers of a face.
    #[inline]
    fn of_face(&self, table: &'a [F], face: u32) -> &'a [F] {
        let first = (face as usize).saturating_mul(self.channels);
        table.get(first..first + self.channels).unwrap_or(&[])
    }
}

impl<F: Real> StateSpace for Coloured<'_, F> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real> Sampler for Coloured<'_, F> {
    #[inline]
    fn absorption(&self, x: &Point<F>) -> F {
        self.radiosity.absorption(x)
    }

    #[inline]
    fn step<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> Option<Point<F>> {
        self.radiosity.step(x, uniforms)
    }
}

impl<F: Real> Kernel for Coloured<'_, F> {
    #[inline]
    fn kernel(&self, x: &Point<F>, y: &Point<F>) -> F {
        self.radiosity.kernel(x, y)
    }
}

impl<F: Real> Partition for Coloured<'_, F> {
    fn cells(&self) -> usize {
        self.radiosity.cells()
    }

    #[inline]
    fn locate(&self, x: &Point<F>) -> usize {
        self.radiosity.locate(x)
    }
}

impl<F: Real, const B: usize> Basis<B> for Coloured<'_, F> {
    #[inline]
    fn basis(&self, x: &Located<Point<F>>) -> [F; B] {
        self.radiosity.basis(x)
    }
}

impl<F: Real> Channels for Coloured<'_, F> {
    fn channels(&self) -> usize {
        self.channels
    }

    #[inline]
    fn factors(&self, x: &Point<F>, factors: &mut [F]) {
        // Nothing comes back from the sky.
        factors.fill(zero());
        for (to, &factor) in factors.iter_mut().zip(self.of_face(self.factors, x.face)) {
            *to = factor;
        }
    }

    /// F_c of a last step to a light, and of what walks score where they meet it.
    fn sample_sources<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U, sources: &mut [F]) {
        if x.face == SKY {
            sources.fill(self.radiosity.rest_of_source(x));
            return;
        }
        let Some(on) = self.radiosity.receiver(x) else {
            sources.fill(F::NAN);
            return;
        };
        let reflectance = self.radiosity.reflectance(x);
        let white = reflectance * self.radiosity.irradiance_of_beams(&on);
        let emission = self.radiosity.own_emission(x);
        let (light, direct) = match self.radiosity.sample_light(&on, uniforms) {
            Some((light, direct)) => (self.of_face(self.shares, light), reflectance * direct),
            None => (&[][..], zero()),
        };
        let own = self.of_face(self.shares, x.face);
        let factors = self.of_face(self.factors, x.face);
        for (((place, source), &own), &factor) in
            sources.iter_mut().enumerate().zip(own).zip(factors)
        {
            let of_light = light.get(place).copied().unwrap_or(zero());
            *source = own * emission + factor * (white + of_light * direct);
        }
    }
}

impl<F: Real> Coloured<'_, F> {
    /// Estimates the light of lights that reaches x directly, in every channel, by a last step.
    #[cfg(feature = "alloc")]
    pub(crate) fn direct<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U, to: &mut [F]) {
        let Some(on) = self.radiosity.receiver(x) else {
            to.fill(F::NAN);
            return;
        };
        to.fill(zero());
        if let Some((light, direct)) = self.radiosity.sample_light(&on, uniforms) {
            for (to, &share) in to.iter_mut().zip(self.of_face(self.shares, light)) {
                *to = share * direct;
            }
        }
    }

    /// The emission of lights in x in every channel, to which the last step leads: what a start there adds to what its walk scores.
    pub fn known(&self, x: &Point<F>, known: &mut [F]) {
        known.fill(zero());
        if x.face == SKY {
            return;
        }
        let emission = self.radiosity.emission_of_light(x.face);
        for (to, &share) in known.iter_mut().zip(self.of_face(self.shares, x.face)) {
            *to = share * emission;
        }
    }
}
