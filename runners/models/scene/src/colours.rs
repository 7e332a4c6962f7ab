//! Materials in several channels.

use fredholm_model::Error;
use fredholm_model::channels::{self, ChannelNames};
use fredholm_model::heat::Optics;
use fredholm_scene::{Material, Scene};

use crate::channels::PerFace;

/// Reflectances and emissions of all surfaces in several channels, such as colours or bands of wavelengths.
///
/// Red, green and blue have their luminance as a weighted sum, 0.2126 R + 0.7152 G + 0.0722 B; other channels have their sum.
///
/// ```
/// use fredholm::scene::{Colours, Material};
///
/// let red = [0.6, 0.1, 0.1].map(|reflectance| Material { reflectance, emission: 0.0 });
/// let colours = Colours::new(["red", "green", "blue"].map(str::to_owned).to_vec(), vec![red.to_vec()]);
/// assert_eq!(colours.shared_names(), ["red", "green", "blue", "luminance"]);
/// assert_eq!(colours.largest(0).reflectance, 0.6);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Colours {
    names: ChannelNames,
    /// The materials of every surface, one for each channel.
    materials: Vec<Vec<Material>>,
}

impl Colours {
    /// The materials of every surface, one for each of these channels.
    #[must_use]
    pub fn new(channels: Vec<String>, materials: Vec<Vec<Material>>) -> Self {
        Self {
            names: ChannelNames::new(channels),
            materials,
        }
    }

    /// The materials of every surface in bands of heat: u is in W/m².
    #[must_use]
    pub fn of_heat(bands: Vec<String>, materials: Vec<Vec<Material>>) -> Self {
        Self {
            names: ChannelNames::of_heat(bands),
            materials,
        }
    }

    /// The names of the channels.
    #[must_use]
    pub const fn names(&self) -> &ChannelNames {
        &self.names
    }

    /// The names of what shares the walks of a target: the channels, and last their sum.
    #[must_use]
    pub fn shared_names(&self) -> &[String] {
        self.names.shared()
    }

    /// The number of channels, without the sum.
    #[must_use]
    pub const fn channels(&self) -> usize {
        self.names.channels()
    }

    /// The weights of the sum.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        self.names.weights()
    }

    /// The largest reflectance and the largest emission of a surface: those of the chain that all channels share.
    #[must_use]
    pub fn largest(&self, surface: usize) -> Material {
        let [reflectance, emission] = channels::largest(&self.numbers(surface));
        Material {
            reflectance,
            emission,
        }
    }

    /// Reflectance and emission of a surface in every channel.
    fn numbers(&self, surface: usize) -> Vec<[f64; 2]> {
        let own = self.materials.get(surface).into_iter().flatten();
        own.map(|one| [one.reflectance, one.emission]).collect()
    }

    /// The one material of some surfaces in every channel, if they have one.
    pub(crate) fn common(&self, surfaces: &[usize]) -> Option<Vec<Optics>> {
        let (first, rest) = surfaces.split_first()?;
        let first = self.materials.get(*first)?;
        let is_same = |surface: &usize| self.materials.get(*surface) == Some(first);
        let optics = |one: &Material| Optics {
            reflectance: one.reflectance,
            emission: one.emission,
        };
        rest.iter()
            .all(is_same)
            .then(|| first.iter().map(optics).collect())
    }

    /// Refuses what is none of a scene.
    pub(crate) fn check(&self, scene: &Scene) -> Result<(), Error> {
        for surface in 0..self.materials.len() {
            let what = format!("surface {surface}");
            self.names.check(&what, &self.numbers(surface))?;
        }
        let is_largest = (0..scene.faces().len()).all(|face| {
            let (own, place) = (scene.faces().get(face), scene.place(face));
            own.zip(place).is_some_and(|(own, place)| {
                let own = [own.reflectance, own.emission];
                place.surface < self.materials.len()
                    && channels::is_largest(own, &self.numbers(place.surface))
            })
        });
        if is_largest {
            Ok(())
        } else {
            channels::refuse_other_materials()
        }
    }

    /// The channels by faces: reflectances and emissions over the largest.
    pub(crate) fn per_face(&self, scene: &Scene) -> PerFace {
        let share = |own: f64, largest: f64| if largest > 0.0 { own / largest } else { 0.0 };
        let (mut factors, mut shares) = (Vec::new(), Vec::new());
        for face in 0..scene.faces().len() {
            let surface = scene.place(face).map_or(usize::MAX, |place| place.surface);
            let largest = self.largest(surface);
            for one in self.materials.get(surface).map_or(&[][..], Vec::as_slice) {
                factors.push(share(one.reflectance, largest.reflectance));
                shares.push(share(one.emission, largest.emission));
            }
        }
        PerFace {
            channels: self.channels(),
            factors,
            shares,
            weights: self.weights().to_vec(),
        }
    }
}
