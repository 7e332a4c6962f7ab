//! Light in several channels.

use fredholm_core::Real;
use fredholm_surfaces::Colours;

use crate::SceneError;
use crate::radiosity::Radiosity;

/// The equations of light in up to M channels: u_c = ρ_c T u_c + F_c, where T is the same for all. A last step chooses its light by the largest F.
/// Beams and the sky are white: as strong in every channel.
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
        match colours.misfit(self.geometry.faces().len()) {
            Some([expected, found]) => Err(SceneError::Length { expected, found }),
            None => Ok(self.with_tint(colours)),
        }
    }
}
