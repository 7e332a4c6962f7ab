//! The quantities on which the solution of an exchange of light or heat depends.

use fredholm_core::global::Dependence;
use fredholm_room::STEFAN_BOLTZMANN;

use crate::Region;
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
}

/// What a wall or a face depends on: a word, its value and unit, and what u' gains there and times u.
type Own = (&'static str, f64, Option<&'static str>, [f64; 2]);

/// The quantities of a wall or a face. Of a black one its reflectance is none: walks end there, and tell nothing of what arrives.
fn of_element(element: &Element, is_heat: bool) -> Vec<Own> {
    let (reflectance, emission) = (element.material.reflectance, element.material.emission);
    let emissivity = 1.0 - reflectance;
    if !is_heat {
        let own = [-emission / reflectance, 1.0 / reflectance];
        let own = ("reflectance", reflectance, None, own);
        let own = (reflectance > 0.0).then_some(own);
        let emission = ("emission", emission, None, [1.0, 0.0]);
        return own.into_iter().chain([emission]).collect();
    }
    if emissivity <= 0.0 {
        return vec![("net flux", emission, Some("W/m²"), [1.0, 0.0])];
    }
    let black = emission / emissivity;
    let temperature = (black / STEFAN_BOLTZMANN).sqrt().sqrt();
    let own = [black + emission / reflectance, -1.0 / reflectance];
    let own = ("emissivity", emissivity, None, own);
    let own = (reflectance > 0.0).then_some(own);
    let by_temperature = [4.0 * emission / temperature, 0.0];
    let warm = ("temperature", temperature, Some("K"), by_temperature);
    let warm = (temperature > 0.0).then_some(warm);
    own.into_iter().chain(warm).collect()
}

/// All quantities, and what walls and faces have to do with them.
#[derive(Debug)]
pub struct Dependent {
    /// The quantities.
    pub quantities: Vec<Quantity>,
    /// What the parts of every surface have to do with them.
    parts: Vec<Vec<(usize, Vec<Dependence>)>>,
}

impl Dependent {
    /// The quantities of surfaces of these names.
    pub fn new<'n>(
        surfaces: &dyn RadiativeExchange,
        name: &dyn Fn(usize) -> Option<&'n str>,
    ) -> Self {
        let is_heat = surfaces.is_heat();
        let mut all = Self {
            quantities: Vec::new(),
            parts: Vec::new(),
        };
        for (surface, name) in (0..).map_while(|surface| Some((surface, name(surface)?))) {
            let first = all.quantities.len();
            let mut parts: Vec<(usize, Vec<Dependence>)> = Vec::new();
            for element in surfaces.elements(&Region::Part(surface)) {
                if parts.iter().any(|(part, _)| *part == element.part) {
                    continue;
                }
                let own = of_element(&element, is_heat).into_iter();
                let own = own.map(|(word, value, unit, [source, of_u])| {
                    let name = format!("{name} {word}");
                    let known = all.quantities.iter_mut().enumerate().skip(first);
                    let mut known = known.filter(|(_, known)| known.name == name);
                    let quantity = match known.next() {
                        Some((quantity, known)) => {
                            known.value = known.value.filter(|own| *own == value);
                            quantity
                        }
                        None => {
                            drop(known);
                            all.quantities.push(Quantity {
                                name,
                                value: Some(value),
                                unit,
                            });
                            all.quantities.len() - 1
                        }
                    };
                    Dependence {
                        quantity,
                        source,
                        of_u,
                    }
                });
                parts.push((element.part, own.collect()));
            }
            all.parts.push(parts);
        }
        all
    }

    /// What a part of a surface has to do with the quantities.
    pub fn of_part(&self, surface: usize, part: usize) -> &[Dependence] {
        let parts = self.parts.get(surface).into_iter().flatten();
        let mut own = parts.filter(|(own, _)| *own == part);
        own.next().map_or(&[], |(_, own)| own)
    }
}
