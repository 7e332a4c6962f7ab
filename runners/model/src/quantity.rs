//! The quantities on which the solution of an exchange of light or heat depends.

use fredholm_core::{Dependence, Direct};
use fredholm_room::{Material, STEFAN_BOLTZMANN};
use serde::{Deserialize, Serialize};

use crate::channels::Colours;
use crate::heat::{Asked, Carried, RadiativeExchange};
use crate::{GlobalQuantity, Region};

/// A quantity on which u depends: the reflectance of a surface, say.
///
/// ```
/// use fredholm::room::{Material, Surfaces};
/// use fredholm::{Model, RoomModel, Scalar};
///
/// let wall = Material { reflectance: 0.6, emission: 0.4 };
/// let triangle = Surfaces::default().with("wall", &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], wall);
/// let room = RoomModel::new(triangle, Scalar::F64)?;
/// let names: Vec<String> = room.quantities().into_iter().map(|quantity| quantity.name).collect();
/// assert_eq!(names, ["wall reflectance", "wall emission"]);
/// # Ok::<(), fredholm::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// The name in results: "floor reflectance".
    pub name: String,
    /// The value; of a surface whose material changes along it there is none, and the derivative is that of a change by the same number
    /// everywhere.
    pub value: Option<f64>,
    /// The unit of the value, if it has one.
    pub unit: Option<&'static str>,
    /// The least and the largest value that there may be.
    pub range: [f64; 2],
}

impl Quantity {
    /// A number without a unit, which may be any.
    #[must_use]
    pub fn number(name: &str, value: f64) -> Self {
        Self {
            name: name.to_owned(),
            value: Some(value),
            unit: None,
            range: [f64::NEG_INFINITY, f64::INFINITY],
        }
    }
}

/// How well a quantity is known: its name, and its standard error.
///
/// ```
/// use fredholm_model::Uncertainty;
///
/// let own = Uncertainty { quantity: "floor emissivity".to_owned(), std_error: 0.02 };
/// assert!(own.std_error < 0.05);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Uncertainty {
    /// The name of the quantity, as results have it.
    pub quantity: String,
    /// The standard error of the quantity, in the unit of that.
    pub std_error: f64,
}

/// What a wall or a face depends on: a word, its value, unit and range, and the slopes of its material.
struct Own {
    word: &'static str,
    value: f64,
    unit: Option<&'static str>,
    range: [f64; 2],
    slopes: Slopes,
}

/// The derivatives of the emission and the reflectance of a material by a quantity.
#[derive(Clone, Copy, Debug)]
struct Slopes {
    emission: f64,
    reflectance: f64,
}

impl Slopes {
    const fn of_emission(emission: f64) -> Self {
        Self {
            emission,
            reflectance: 0.0,
        }
    }

    /// Slopes by a quantity that is so many times this one.
    fn over(self, times: f64) -> Self {
        Self {
            emission: self.emission / times,
            reflectance: self.reflectance / times,
        }
    }

    /// What a point of the material has to do with the quantity: u = F + ρ H changes by ∂F/∂λ + (∂ρ/∂λ) H.
    fn dependence(self, material: &Material, quantity: usize) -> Dependence {
        let of_reflectance = match self.reflectance {
            0.0 => Dependence::on(quantity),
            _ => Dependence::on_factor(quantity, material.emission, material.reflectance),
        };
        Dependence {
            source: self.emission + self.reflectance * of_reflectance.source,
            of_u: self.reflectance * of_reflectance.of_u,
            of_arriving: self.reflectance * of_reflectance.of_arriving,
            quantity,
        }
    }
}

/// The range of numbers, of shares, and of temperatures.
const ANY: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
const SHARE: [f64; 2] = [0.0, 1.0];
const POSITIVE: [f64; 2] = [0.0, f64::INFINITY];

/// The heat of a wall or a face in one band.
#[derive(Clone, Copy)]
struct InBand {
    /// The temperature in kelvin.
    kelvin: f64,
    /// The part of the heat of a black body that is in the band, and its derivative by the temperature.
    part: f64,
    slope: f64,
}

/// The quantities of a wall or a face in one channel or a band, of which this part is no mirror. `speed` is what all of its surface would pump if it
/// took every molecule, where molecules are carried.
fn of_element(
    (material, part): (&Material, f64),
    carried: Carried,
    speed: f64,
    band: Option<InBand>,
) -> Vec<Own> {
    let (reflectance, emission) = (material.reflectance, material.emission);
    let emissivity = 1.0 - reflectance;
    let share = |word, value, slopes| Own {
        word,
        value: part * value,
        unit: None,
        range: SHARE,
        slopes: Slopes::over(slopes, part),
    };
    let number = |word, unit| Own {
        word,
        value: part * emission,
        unit,
        range: ANY,
        slopes: Slopes::of_emission(1.0 / part),
    };
    let of_reflectance = |reflectance| Slopes {
        emission: 0.0,
        reflectance,
    };
    match carried {
        Carried::Heat => {}
        Carried::Light => {
            return vec![
                share("reflectance", reflectance, of_reflectance(1.0)),
                number("emission", None),
            ];
        }
        Carried::Gas { .. } => {
            let outgassing = Own {
                word: "outgassing",
                value: speed * emission,
                unit: Some("mbar l/s"),
                range: POSITIVE,
                slopes: Slopes::of_emission(1.0 / speed),
            };
            return vec![
                share("sticking", emissivity, of_reflectance(-1.0)),
                outgassing,
            ];
        }
    }
    if emissivity <= 0.0 && band.is_none() {
        return vec![number("net flux", Some("W/m²"))];
    }
    let (black, kelvin, slope) = match band {
        None => {
            let black = emission / emissivity;
            (black, (black / STEFAN_BOLTZMANN).sqrt().sqrt(), 0.0)
        }
        Some(band) => {
            let all = Material::grey(1.0, band.kelvin).emission;
            (band.part * all, band.kelvin, emissivity * all * band.slope)
        }
    };
    // F = ε B and ρ = 1 − ε.
    let by = Slopes {
        emission: black,
        reflectance: -1.0,
    };
    let emissivity = share("emissivity", emissivity, by);
    let warm = (kelvin > 0.0).then(|| Own {
        word: "temperature",
        value: kelvin,
        unit: Some("K"),
        range: POSITIVE,
        slopes: Slopes::of_emission(4.0 * emission / kelvin + slope),
    });
    [emissivity].into_iter().chain(warm).collect()
}

/// What a part of a surface has to do with the quantities in a channel.
#[derive(Clone, Debug, Default)]
struct OfPart {
    /// What its points have to do with them.
    dependences: Vec<Dependence>,
    /// The slopes of its material by the quantities of the same places.
    slopes: Vec<Slopes>,
}

/// The quantities of surfaces and lights, and what parts of surfaces have to do with these.
#[derive(Debug)]
pub struct SurfaceQuantities {
    /// The quantities: those of surfaces, and a factor of every other light.
    pub quantities: Vec<Quantity>,
    /// The number of those of surfaces.
    pub of_surfaces: usize,
    /// By the number of the channel, of the surface, and of its part.
    parts: Vec<Vec<Vec<OfPart>>>,
}

impl SurfaceQuantities {
    /// The quantities of surfaces of these names, and in these colours or bands, if there are some; and of other lights.
    pub fn new<'n>(
        surfaces: &dyn RadiativeExchange,
        name: &dyn Fn(usize) -> Option<&'n str>,
        (colours, lights): (Option<&Colours>, Vec<String>),
    ) -> Self {
        let channels = colours.map_or(1, |colours| colours.names.channels());
        let bands = colours.and_then(|colours| colours.names.bands());
        let carried = match bands {
            Some(_) => Carried::Heat,
            None => surfaces.carried(),
        };
        let mut quantities = Vec::new();
        let mut all = vec![Vec::new(); channels];
        let names = (0..).map_while(|surface| Some((surface, name(surface)?)));
        for (surface, name) in names {
            let first = quantities.len();
            let elements = surfaces.elements(&Region::Part(surface));
            let size: f64 = elements.iter().map(|own| own.size).sum();
            let speed = carried.flux_scale() * size;
            for (channel, all) in all.iter_mut().enumerate() {
                let mut parts: Vec<OfPart> = Vec::new();
                for element in &elements {
                    let own = colours.and_then(|own| own.of_part(surface, element.part));
                    let kelvin = bands.and_then(|bands| bands.temperature(own?));
                    let material = own.and_then(|own| own.get(channel));
                    let band = bands.map(|bands| {
                        let kelvin = kelvin.unwrap_or(0.0);
                        let of = |all: Vec<f64>| all.get(channel).copied().unwrap_or(f64::NAN);
                        InBand {
                            kelvin,
                            part: of(bands.parts(kelvin)),
                            slope: of(bands.slopes(kelvin)),
                        }
                    });
                    if parts.len() <= element.part {
                        parts.resize_with(element.part + 1, OfPart::default);
                    }
                    let material = material.unwrap_or(&element.material);
                    let mut part = OfPart::default();
                    for own in of_element((material, element.share), carried, speed, band) {
                        let quantity = Quantity {
                            name: format!("{name} {}", own.word),
                            value: Some(own.value),
                            unit: own.unit,
                            range: own.range,
                        };
                        let number = first + number(&mut quantities, first, quantity);
                        part.dependences
                            .push(own.slopes.dependence(material, number));
                        part.slopes.push(own.slopes);
                    }
                    parts[element.part] = part;
                }
                all.push(parts);
            }
        }
        let of_surfaces = quantities.len();
        quantities.extend(lights.into_iter().map(|name| Quantity {
            range: POSITIVE,
            ..Quantity::number(&name, 1.0)
        }));
        Self {
            quantities,
            of_surfaces,
            parts: all,
        }
    }

    /// What a part of a surface has to do with the quantities in a channel.
    pub fn of_part(&self, channel: usize, surface: usize, part: usize) -> &[Dependence] {
        self.part(channel, surface, part)
            .map_or(&[], |own| &own.dependences)
    }

    fn part(&self, channel: usize, surface: usize, part: usize) -> Option<&OfPart> {
        self.parts.get(channel)?.get(surface)?.get(part)
    }

    /// What a goal itself has to do with every quantity: a net flux F − (1 − ρ) H depends on the material of its own surface besides by H, and
    /// nothing else that a region asks for does.
    pub fn direct(
        &self,
        surfaces: &dyn RadiativeExchange,
        region: &Region,
        asked: &Asked,
    ) -> Vec<Direct> {
        let mut all = vec![Direct::NONE; self.quantities.len()];
        let (GlobalQuantity::NetFlux, place) = region.asked() else {
            return all;
        };
        let elements = surfaces.elements(place);
        let Some(own) = elements.first() else {
            return all;
        };
        let Some(part) = self.part(0, own.surface, own.part) else {
            return all;
        };
        for (on, slopes) in part.dependences.iter().zip(&part.slopes) {
            // Where no factor is left nothing of H is asked for.
            let share = match asked.factor {
                0.0 => 0.0,
                factor => own.share * slopes.reflectance / factor,
            };
            all[on.quantity] = Direct {
                known: own.share * slopes.emission - share * asked.constant,
                share,
            };
        }
        all
    }
}

/// The number of a quantity among those of one surface, which begin here; a further one is added.
fn number(all: &mut Vec<Quantity>, first: usize, quantity: Quantity) -> usize {
    let own = &mut all[first..];
    let known = own.iter().position(|known| known.name == quantity.name);
    if let Some(number) = known {
        let known = &mut own[number];
        known.value = known.value.filter(|own| Some(*own) == quantity.value);
        return number;
    }
    all.push(quantity);
    all.len() - 1 - first
}
