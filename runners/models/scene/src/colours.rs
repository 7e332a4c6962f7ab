//! Materials in several channels.

use fredholm_core::Real;
use fredholm_model::Error;
use fredholm_model::channels::{self, ChannelNames};
use fredholm_scene::{Material, Scene};

/// Reflectances and emissions of all surfaces in several channels, such as colours or bands of wavelengths.
///
/// ```
/// use fredholm::channels::ChannelNames;
/// use fredholm::scene::{Colours, Material};
///
/// let red = [0.6, 0.1, 0.1].map(|reflectance| Material { reflectance, emission: 0.0 });
/// let names = ChannelNames::new(["red", "green", "blue"].map(str::to_owned).to_vec());
/// let colours = Colours { names, materials: vec![red.to_vec()] };
/// assert_eq!(colours.largest(0).reflectance, 0.6);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Colours {
    /// The names of the channels, and of a weighted sum of them.
    pub names: ChannelNames,
    /// The materials of every surface, one for each channel.
    pub materials: Vec<Vec<Material>>,
}

impl Colours {
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
    pub(crate) fn per_face(&self, scene: &Scene) -> FaceChannels<f64> {
        let mut all = FaceChannels {
            channels: self.names.channels(),
            reflectances: Vec::new(),
            emissions: Vec::new(),
        };
        for face in 0..scene.faces().len() {
            let surface = scene.place(face).map_or(usize::MAX, |place| place.surface);
            let largest = self.largest(surface);
            for one in self.materials.get(surface).into_iter().flatten() {
                all.reflectances
                    .push(share(one.reflectance, largest.reflectance));
                all.emissions.push(share(one.emission, largest.emission));
            }
        }
        all
    }
}

/// A number over the largest, or 0 of nothing.
pub(crate) fn share(own: f64, largest: f64) -> f64 {
    if largest > 0.0 { own / largest } else { 0.0 }
}

/// The channels of walks: for every face, and there for every channel, reflectance and emission over the scene's own.
#[derive(Clone, Debug)]
pub(crate) struct FaceChannels<F> {
    pub(crate) channels: usize,
    pub(crate) reflectances: Vec<F>,
    pub(crate) emissions: Vec<F>,
}

impl FaceChannels<f64> {
    pub(crate) fn rounded<F: Real>(&self) -> FaceChannels<F> {
        let rounded = |table: &[f64]| table.iter().map(|&x| F::from_f64(x)).collect();
        FaceChannels {
            channels: self.channels,
            reflectances: rounded(&self.reflectances),
            emissions: rounded(&self.emissions),
        }
    }
}

impl<F> FaceChannels<F> {
    /// The channels for walks of at most M.
    pub(crate) fn tint<const M: usize>(&self) -> fredholm_scene::Colours<'_, F, M> {
        fredholm_scene::Colours {
            channels: self.channels,
            reflectances: &self.reflectances,
            emissions: &self.emissions,
        }
    }
}
