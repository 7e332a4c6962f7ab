//! The quantities on which the solution of an exchange of light or heat depends.

use fredholm_core::Dependence;
use fredholm_room::STEFAN_BOLTZMANN;
use serde::{Deserialize, Serialize};

use crate::Region;
use crate::channels::Colours;
use crate::heat::{Element, RadiativeExchange};

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

/// What a wall or a face depends on: a word, its value, unit and range, and what u' gains there and times u.
type Own = (&'static str, f64, Option<&'static str>, [f64; 2], [f64; 2]);

/// The range of numbers, of shares, and of temperatures.
const ANY: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
const SHARE: [f64; 2] = [0.0, 1.0];
const POSITIVE: [f64; 2] = [0.0, f64::INFINITY];

/// The quantities of a wall or a face. Of a black one its reflectance is none: walks end there, and tell nothing of what arrives.
fn of_element(element: &Element, is_heat: bool) -> Vec<Own> {
    let (reflectance, emission) = (element.material.reflectance, element.material.emission);
    let emissivity = 1.0 - reflectance;
    if !is_heat {
        let own = [-emission / reflectance, 1.0 / reflectance];
        let own = ("reflectance", reflectance, None, SHARE, own);
        let own = (reflectance > 0.0).then_some(own);
        let emission = ("emission", emission, None, ANY, [1.0, 0.0]);
        return own.into_iter().chain([emission]).collect();
    }
    if emissivity <= 0.0 {
        return vec![("net flux", emission, Some("W/m²"), ANY, [1.0, 0.0])];
    }
    let black = emission / emissivity;
    let temperature = (black / STEFAN_BOLTZMANN).sqrt().sqrt();
    let own = [black + emission / reflectance, -1.0 / reflectance];
    let own = ("emissivity", emissivity, None, SHARE, own);
    let own = (reflectance > 0.0).then_some(own);
    let by_temperature = [4.0 * emission / temperature, 0.0];
    let warm = (
        "temperature",
        temperature,
        Some("K"),
        POSITIVE,
        by_temperature,
    );
    let warm = (temperature > 0.0).then_some(warm);
    own.into_iter().chain(warm).collect()
}

/// The quantities of surfaces and lights, and what parts of surfaces have to do with these.
#[derive(Debug)]
pub struct SurfaceQuantities {
    /// The quantities: those of surfaces, and a factor of every other light.
    pub quantities: Vec<Quantity>,
    /// The number of those of surfaces.
    pub of_surfaces: usize,
    /// By the number of the channel, of the surface, and of its part.
    parts: Vec<Vec<Vec<Vec<Dependence>>>>,
}

impl SurfaceQuantities {
    /// The quantities of surfaces of these names, and in these colours, if there are some; and of other lights. Bands of heat have none.
    pub fn new<'n>(
        surfaces: &dyn RadiativeExchange,
        name: &dyn Fn(usize) -> Option<&'n str>,
        (colours, lights): (Option<&Colours>, Vec<String>),
    ) -> Self {
        let is_heat = surfaces.is_heat();
        let channels = colours.map_or(1, |colours| match colours.names.unit() {
            None => colours.names.channels(),
            Some(_) => 0,
        });
        let mut quantities = Vec::new();
        let mut all = vec![Vec::new(); channels];
        let names = (0..).map_while(|surface| Some((surface, name(surface)?)));
        for (surface, name) in names.take_while(|_| channels > 0) {
            let first = quantities.len();
            let elements = surfaces.elements(&Region::Part(surface));
            for (channel, all) in all.iter_mut().enumerate() {
                let mut parts: Vec<Vec<Dependence>> = Vec::new();
                for element in &elements {
                    let own = colours.and_then(|own| own.of_part(surface, element.part));
                    let own = own.and_then(|own| own.get(channel));
                    let element = Element {
                        material: *own.unwrap_or(&element.material),
                        ..*element
                    };
                    if parts.len() <= element.part {
                        parts.resize_with(element.part + 1, Vec::new);
                    }
                    let own = of_element(&element, is_heat).into_iter();
                    let own = own.map(|(word, value, unit, range, [source, of_u])| {
                        let quantity = Quantity {
                            name: format!("{name} {word}"),
                            value: Some(value),
                            unit,
                            range,
                        };
                        Dependence {
                            quantity: first + number(&mut quantities, first, quantity),
                            source,
                            of_u,
                        }
                    });
                    parts[element.part] = own.collect();
                }
                all.push(parts);
            }
        }
        let of_surfaces = quantities.len();
        let lights = lights.into_iter().take_while(|_| channels > 0);
        quantities.extend(lights.map(|name| Quantity {
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
        let parts = self.parts.get(channel).and_then(|all| all.get(surface));
        parts
            .and_then(|parts| parts.get(part))
            .map_or(&[], Vec::as_slice)
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
