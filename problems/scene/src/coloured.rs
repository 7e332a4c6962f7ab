//! Light in one channel, or in several.

use core::fmt::Debug;

use fredholm_core::{Channels, Real, Value};
use num_traits::one;

use crate::SceneError;
use crate::radiosity::Radiosity;

/// The channels of light, as ratios to the [`Radiosity`] that has the largest ρ and F of all, which are constant on a face.
///
/// They share the walks, and a last step chooses its light by the largest F. Beams and the sky are white: as strong in every channel.
pub trait Tint<F: Real>: Copy + Debug + Send + Sync {
    /// One number for each channel.
    type Value: Value<F>;

    /// C.
    fn channels(&self) -> usize;

    /// ρ_c/ρ of a face.
    fn reflectance(&self, face: u32) -> Self::Value;

    /// F_c/F of a face.
    fn emission(&self, face: u32) -> Self::Value;
}

/// One channel.
#[derive(Clone, Copy, Debug)]
pub struct Grey;

impl<F: Real> Tint<F> for Grey {
    type Value = F;

    #[inline(always)]
    fn channels(&self) -> usize {
        1
    }
    #[inline(always)]
    fn reflectance(&self, _: u32) -> F {
        one()
    }
    #[inline(always)]
    fn emission(&self, _: u32) -> F {
        one()
    }
}

/// Up to M channels: colours, bands of wavelengths, receivers.
#[derive(Clone, Copy, Debug)]
pub struct Colours<'a, F, const M: usize> {
    /// C.
    pub channels: usize,
    /// ρ_c/ρ from 0 to 1, for every face and there for every channel.
    pub reflectances: &'a [F],
    /// F_c/F from 0 to 1, for every face and there for every channel.
    pub emissions: &'a [F],
}

impl<F: Real, const M: usize> Colours<'_, F, M> {
    #[inline]
    fn of_face(&self, table: &[F], face: u32) -> Channels<F, M> {
        let own = table.get((face as usize).saturating_mul(self.channels)..);
        let own = own.unwrap_or(&[]);
        Channels::from_fn(self.channels, |c| own.get(c).copied().unwrap_or(F::NAN))
    }
}

impl<F: Real, const M: usize> Tint<F> for Colours<'_, F, M> {
    type Value = Channels<F, M>;

    #[inline(always)]
    fn channels(&self) -> usize {
        self.channels
    }
    #[inline]
    fn reflectance(&self, face: u32) -> Channels<F, M> {
        self.of_face(self.reflectances, face)
    }
    #[inline]
    fn emission(&self, face: u32) -> Channels<F, M> {
        self.of_face(self.emissions, face)
    }
}

/// The equations of light in up to M channels: u_c = ρ_c T u_c + F_c, where T is the same for all.
///
/// ```
/// use fredholm_core::{Equation, Value};
/// use fredholm_scene::{
///     Cells, Colours, Enclosure, Material, Radiosity, Scene, Surface, Tables, shapes,
/// };
///
/// // A cube that reflects half of the red and a tenth of the green.
/// let room = shapes::room([0.0; 3], [1.0; 3]);
/// let materials = [Material { reflectance: 0.5, emission: 0.0 }];
/// let surfaces = room.surfaces.iter().map(|polygons| Surface { polygons, materials: &materials });
/// let scene = Scene::new::<f64>(&surfaces.collect::<Vec<_>>(), Enclosure::Closed)?;
/// let (tables, cells) = (Tables::new(&scene), Cells::new(&scene, 6)?);
/// let (reflectances, emissions) = ([1.0, 0.2].repeat(6), [0.0, 0.0].repeat(6));
/// let colours = Colours::<_, 4> { channels: 2, reflectances: &reflectances, emissions: &emissions };
/// let room = Radiosity::new(tables.geometry(), &cells)?.with_colours(colours)?;
/// let x = room.at(0, [0.5, 0.5, 0.0])?;
/// assert_eq!(room.kernel(&x, &x).as_slice(), [0.5, 0.1]);
/// # Ok::<(), fredholm_scene::SceneError>(())
/// ```
pub type Coloured<'a, F, const M: usize> = Radiosity<'a, F, Colours<'a, F, M>>;

impl<'a, F: Real> Radiosity<'a, F> {
    /// The equations of several channels, of which this one has the largest ρ and F.
    ///
    /// # Errors
    /// [`SceneError::Length`]: more than M channels, or not one number for every face and channel.
    pub fn with_colours<const M: usize>(
        self,
        colours: Colours<'a, F, M>,
    ) -> Result<Coloured<'a, F, M>, SceneError> {
        let numbers = self.geometry.faces().len().saturating_mul(colours.channels);
        for (expected, found) in [
            (colours.channels.min(M), colours.channels),
            (numbers, colours.reflectances.len()),
            (numbers, colours.emissions.len()),
        ] {
            if found != expected {
                return Err(SceneError::Length { expected, found });
            }
        }
        Ok(self.with_tint(colours))
    }
}
