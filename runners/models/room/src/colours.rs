//! Materials of walls in several channels.

use fredholm_core::Real;
use fredholm_model::Error;
use fredholm_model::channels::{self, ChannelNames};
use fredholm_model::heat::Optics;
use fredholm_room::{Material, Scene, WallColours};

use crate::Surfaces;

/// Reflectances and emissions of all surfaces of a room in several channels, such as colours or bands of wavelengths.
///
/// Red, green and blue have their luminance as a weighted sum, 0.2126 R + 0.7152 G + 0.0722 B; other channels have their sum.
///
/// ```
/// use fredholm::room::{Colours, Material};
///
/// let red = [0.6, 0.1, 0.1].map(|reflectance| Material { reflectance, emission: 0.0 });
/// // One surface, all of one material.
/// let names = ["red", "green", "blue"].map(str::to_owned).to_vec();
/// let colours = Colours::new(names, vec![vec![red.to_vec()]]);
/// assert_eq!(colours.names().shared(), ["red", "green", "blue", "luminance"]);
/// assert_eq!(colours.largest(0), [Material { reflectance: 0.6, emission: 0.0 }]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Colours {
    names: ChannelNames,
    /// The materials of every surface, one list for all of it or one for every segment, in each channel.
    materials: Vec<Vec<Vec<Material>>>,
}

impl Colours {
    /// The materials of every surface in each of these channels: one list of them, or one for every segment.
    #[must_use]
    pub fn new(channels: Vec<String>, materials: Vec<Vec<Vec<Material>>>) -> Self {
        Self {
            names: ChannelNames::new(channels),
            materials,
        }
    }

    /// The materials of every surface in bands of heat: u is in W/m².
    #[must_use]
    pub fn of_heat(bands: Vec<String>, materials: Vec<Vec<Vec<Material>>>) -> Self {
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

    /// The largest reflectance and the largest emission of a surface, one of each or one for every segment: the
    /// [materials](Surfaces::materials) of the chain that all channels share.
    #[must_use]
    pub fn largest(&self, surface: usize) -> Vec<Material> {
        let own = self.materials.get(surface).into_iter().flatten();
        own.map(|segment| {
            let [reflectance, emission] = channels::largest(&numbers(segment));
            Material {
                reflectance,
                emission,
            }
        })
        .collect()
    }

    /// The one material of some surfaces in every channel, if they have one.
    pub(crate) fn common(&self, surfaces: &[usize]) -> Option<Vec<Optics>> {
        let own = surfaces
            .iter()
            .flat_map(|&surface| self.materials.get(surface));
        let mut segments = own.flatten();
        let first = segments.next()?;
        segments.all(|other| other == first).then(|| optics(first))
    }

    /// The material of a segment of a surface in every channel.
    pub(crate) fn of_segment(&self, surface: usize, vertex: usize) -> Option<Vec<Optics>> {
        let own = self.materials.get(surface)?;
        Some(optics(own.get(vertex).or(own.first())?))
    }

    /// Refuses what is none of these surfaces.
    pub(crate) fn check(&self, surfaces: &Surfaces) -> Result<(), Error> {
        for (surface, segments) in self.materials.iter().enumerate() {
            let what = surfaces.names.get(surface).map_or("?", String::as_str);
            for segment in segments {
                self.names.check(what, &numbers(segment))?;
            }
        }
        let is_largest = |(own, colours): (&Vec<Material>, &Vec<Vec<Material>>)| {
            let pairs = own.iter().zip(colours);
            own.len() == colours.len()
                && pairs.into_iter().all(|(own, colours)| {
                    channels::is_largest([own.reflectance, own.emission], &numbers(colours))
                })
        };
        let mut pairs = surfaces.materials.iter().zip(&self.materials);
        if surfaces.materials.len() == self.materials.len() && pairs.all(is_largest) {
            Ok(())
        } else {
            channels::refuse_other_materials()
        }
    }

    /// The colours of all walls.
    pub(crate) fn of_walls(&self, scene: &Scene) -> WallTables<f64> {
        let (mut reflectances, mut emissions) = (Vec::new(), Vec::new());
        for wall in 0..scene.geometry().walls().len() {
            let own = scene.place(wall).and_then(|place| {
                let own = self.materials.get(place.surface)?;
                own.get(place.vertex).or(own.first())
            });
            for one in own.into_iter().flatten() {
                reflectances.push(one.reflectance);
                emissions.push(one.emission);
            }
        }
        WallTables {
            channels: self.names.channels(),
            reflectances,
            emissions,
        }
    }
}

fn optics(segment: &[Material]) -> Vec<Optics> {
    let of = |one: &Material| Optics {
        reflectance: one.reflectance,
        emission: one.emission,
    };
    segment.iter().map(of).collect()
}

/// Reflectance and emission in every channel.
fn numbers(segment: &[Material]) -> Vec<[f64; 2]> {
    let own = segment.iter();
    own.map(|one| [one.reflectance, one.emission]).collect()
}

/// The colours of all walls in a scalar.
#[derive(Clone, Debug)]
pub(crate) struct WallTables<F> {
    channels: usize,
    reflectances: Vec<F>,
    emissions: Vec<F>,
}

impl WallTables<f64> {
    pub(crate) fn rounded<F: Real>(&self) -> WallTables<F> {
        let rounded = |table: &[f64]| table.iter().map(|&x| F::from_f64(x)).collect();
        WallTables {
            channels: self.channels,
            reflectances: rounded(&self.reflectances),
            emissions: rounded(&self.emissions),
        }
    }
}

impl<F: Real> WallTables<F> {
    pub(crate) const fn channels(&self) -> usize {
        self.channels
    }

    pub(crate) fn colours(&self) -> Result<WallColours<'_, F>, Error> {
        let tables = (&*self.reflectances, &*self.emissions);
        Ok(WallColours::new(self.channels, tables)?)
    }
}
