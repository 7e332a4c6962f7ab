//! Materials of surfaces in several channels.

use fredholm_room::{ColourTables, Material};

use crate::Error;
use crate::channels::{ChannelNames, refuse_other_materials};

/// Reflectances and emissions of all surfaces in several channels, such as colours or bands of wavelengths.
///
/// ```
/// use fredholm_model::channels::{ChannelNames, Colours};
/// use fredholm_room::Material;
///
/// let red = [0.6, 0.1, 0.1].map(|reflectance| Material { reflectance, emission: 0.0 });
/// let names = ChannelNames::new(["red", "green", "blue"].map(str::to_owned).to_vec());
/// // One surface, all of one material.
/// let colours = Colours { names, materials: vec![vec![red.to_vec()]] };
/// assert_eq!(colours.largest(0), [Material { reflectance: 0.6, emission: 0.0 }]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Colours {
    /// The names of the channels, and of a weighted sum of them.
    pub names: ChannelNames,
    /// The materials of every surface, one list for all of it or one for every part, in each channel.
    pub materials: Vec<Vec<Vec<Material>>>,
}

/// A part of a surface, and the material that it has in the scene behind all channels.
#[derive(Clone, Copy, Debug)]
pub struct ColouredPart {
    /// The number of the surface.
    pub surface: usize,
    /// The number of the part within the surface.
    pub part: usize,
    /// The largest reflectance and the largest emission of all channels.
    pub largest: Material,
}

impl Colours {
    /// The largest reflectance and the largest emission of a surface, one of each or one for every part: the materials of the chain that
    /// all channels share.
    #[must_use]
    pub fn largest(&self, surface: usize) -> Vec<Material> {
        let own = self.materials.get(surface).into_iter().flatten();
        own.map(|part| Material::largest(part)).collect()
    }

    /// Whether no surface emits anything in this channel or, if it is that of the sum, in any.
    pub(crate) fn is_dark(&self, channel: usize) -> bool {
        let mut parts = self.materials.iter().flatten();
        parts.all(|part| match part.get(channel) {
            Some(own) => own.emission == 0.0,
            None => part.iter().all(|own| own.emission == 0.0),
        })
    }

    /// The material of a part of a surface in every channel.
    #[must_use]
    pub fn of_part(&self, surface: usize, part: usize) -> Option<&[Material]> {
        let own = self.materials.get(surface)?;
        Some(own.get(part).or(own.first())?)
    }

    /// Refuses what is none of a scene with these parts of so many surfaces, of these names.
    ///
    /// # Errors
    /// [`Error::Option`].
    pub fn check(
        &self,
        surfaces: &[String],
        parts: impl IntoIterator<Item = ColouredPart>,
    ) -> Result<(), Error> {
        for (own, name) in self.materials.iter().zip(surfaces) {
            for part in own {
                self.names.check(name, part)?;
            }
        }
        let is_near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
        let is_largest = |own: ColouredPart| {
            let all = self.of_part(own.surface, own.part).map(Material::largest);
            all.is_some_and(|all| {
                is_near(own.largest.reflectance, all.reflectance)
                    && is_near(own.largest.emission, all.emission)
            })
        };
        if self.materials.len() == surfaces.len() && parts.into_iter().all(is_largest) {
            Ok(())
        } else {
            refuse_other_materials()
        }
    }

    /// The tables of walks, of the parts of surfaces to which the faces of a scene belong.
    #[must_use]
    pub fn tables(&self, faces: impl IntoIterator<Item = (usize, usize)>) -> ColourTables<f64> {
        let faces = faces.into_iter();
        let of = |(surface, part)| self.of_part(surface, part).unwrap_or_default();
        ColourTables::new(self.names.channels(), faces.map(of))
    }
}
