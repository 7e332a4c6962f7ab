//! Materials in several channels.

use fredholm_core::channels::MOST_CHANNELS;
use fredholm_model::{Error, Subject};
use fredholm_scene::{Material, Scene};

use crate::channels::PerFace;

/// The weights of red, green and blue in luminance (ITU-R BT.709, the primaries of sRGB).
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

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
    /// The names of the channels, and that of the sum.
    names: Vec<String>,
    weights: Vec<f64>,
    /// The materials of every surface, one for each channel.
    materials: Vec<Vec<Material>>,
}

impl Colours {
    /// The materials of every surface, one for each of these channels.
    #[must_use]
    pub fn new(channels: Vec<String>, materials: Vec<Vec<Material>>) -> Self {
        let is_rgb = channels == ["red", "green", "blue"];
        let weights = match is_rgb {
            true => LUMINANCE.to_vec(),
            false => vec![1.0; channels.len()],
        };
        let sum = if is_rgb { "luminance" } else { "sum" };
        let mut names = channels;
        names.push(sum.to_owned());
        Self {
            names,
            weights,
            materials,
        }
    }

    /// The names of what shares the walks of a target: the channels, and last their sum.
    #[must_use]
    pub fn shared_names(&self) -> &[String] {
        &self.names
    }

    /// The number of channels, without the sum.
    #[must_use]
    pub const fn channels(&self) -> usize {
        self.weights.len()
    }

    /// The weights of the sum.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The largest reflectance and the largest emission of a surface: those of the chain that all channels share.
    #[must_use]
    pub fn largest(&self, surface: usize) -> Material {
        let own = self.materials.get(surface).map_or(&[][..], Vec::as_slice);
        own.iter().fold(Material::BLACK, |largest, one| Material {
            reflectance: largest.reflectance.max(one.reflectance),
            emission: largest.emission.max(one.emission),
        })
    }

    /// Refuses what is none of a scene.
    pub(crate) fn check(&self, scene: &Scene) -> Result<(), Error> {
        let refuse = |message: String| {
            Err(Error::Option {
                subject: Subject::Problem,
                message,
            })
        };
        let channels = self.channels();
        if !(1..=MOST_CHANNELS).contains(&channels) {
            return refuse(format!(
                "a scene has 1 to {MOST_CHANNELS} channels, not {channels}"
            ));
        }
        for (surface, own) in self.materials.iter().enumerate() {
            if own.len() != channels {
                return refuse(format!(
                    "surface {surface} has {} materials, and there are {channels} channels",
                    own.len()
                ));
            }
            let is_good = |one: &Material| {
                (0.0..=1.0).contains(&one.reflectance)
                    && one.emission >= 0.0
                    && one.emission.is_finite()
            };
            if !own.iter().all(is_good) {
                return refuse(format!(
                    "surface {surface}: in every channel a reflectance must be from 0 to 1, and an emission 0 or more"
                ));
            }
        }
        let is_largest = (0..scene.faces().len()).all(|face| {
            let (own, place) = (scene.faces().get(face), scene.place(face));
            own.zip(place).is_some_and(|(own, place)| {
                let largest = self.largest(place.surface);
                let is_same = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
                place.surface < self.materials.len()
                    && is_same(own.reflectance, largest.reflectance)
                    && is_same(own.emission, largest.emission)
            })
        });
        if !is_largest {
            return refuse(
                "the surfaces of a scene with colours must have the largest reflectance and emission of all channels"
                    .to_owned(),
            );
        }
        Ok(())
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
            weights: self.weights.clone(),
        }
    }
}
