//! The materials of surfaces, as a problem file has them.

use fredholm::channels::Bands;
use fredholm::room::Surfaces;
use fredholm_room::Material as RoomMaterial;
use toml::de::DeValue;

use crate::channels::{FLUX_IN_BANDS, LIGHT_IN_BANDS, Lists, of_channel};
use crate::place::{InputError, Placed};
use crate::section::{Field, Section};

/// The material of a surface, as the file has it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Material {
    /// `reflectance` and `emission`.
    Light(Numbers, Numbers),
    /// `emissivity` and `temperature`.
    Grey(Numbers, Numbers),
    /// `net_flux` and, if it is known, `emissivity`.
    Flux(Numbers, Numbers),
    /// `reflectance` and `emission` in several channels.
    Coloured(Lists, Lists),
    /// `emissivity` in several bands, and `temperature`.
    Banded(Lists, Numbers),
}

impl Material {
    /// Whether u is in W/m².
    const fn is_heat(&self) -> bool {
        matches!(self, Self::Grey(..) | Self::Flux(..))
    }
}

/// What a surface says of its material, not yet read as numbers.
pub(crate) struct MaterialFields<'s, 'i> {
    pub(crate) reflectance: Option<Field<'s, 'i>>,
    pub(crate) emission: Option<Field<'s, 'i>>,
    pub(crate) emissivity: Option<Field<'s, 'i>>,
    pub(crate) temperature: Option<Field<'s, 'i>>,
    pub(crate) net_flux: Option<Field<'s, 'i>>,
}

impl<'s, 'i> MaterialFields<'s, 'i> {
    pub(crate) fn of(section: &mut Section<'s, 'i>) -> Self {
        Self {
            reflectance: section.optional("reflectance"),
            emission: section.optional("emission"),
            emissivity: section.optional("emissivity"),
            temperature: section.optional("temperature"),
            net_flux: section.optional("net_flux"),
        }
    }

    /// The first that is said of light.
    pub(crate) fn light(&self) -> Option<&Field<'s, 'i>> {
        self.reflectance.as_ref().or(self.emission.as_ref())
    }

    /// The first that is said of heat.
    pub(crate) fn heat(&self) -> Option<&Field<'s, 'i>> {
        let temperature = self.temperature.as_ref().or(self.net_flux.as_ref());
        self.emissivity.as_ref().or(temperature)
    }

    /// Refuses light beside heat, and a temperature beside a net flux.
    pub(crate) fn check(&self) -> Result<(), InputError> {
        if let (Some(_), Some(heat)) = (self.light(), self.heat()) {
            return Err(heat.unsuited(
                "give either `reflectance` and `emission`, or `emissivity` and `temperature`, or `net_flux`",
            ));
        }
        match (&self.temperature, &self.net_flux) {
            (Some(_), Some(net_flux)) => Err(net_flux.unsuited(
                "give either the `temperature` of a surface or its `net_flux`: one follows from the other",
            )),
            _ => Ok(()),
        }
    }

    /// Refuses what has no bands.
    pub(crate) fn check_bands(&self) -> Result<(), InputError> {
        match (self.light(), &self.net_flux) {
            (Some(light), _) => Err(light.unsuited(LIGHT_IN_BANDS)),
            (None, Some(net_flux)) => Err(net_flux.unsuited(FLUX_IN_BANDS)),
            (None, None) => Ok(()),
        }
    }
}

/// One number, or one for every segment; absent where the deck or a default gives it.
pub type Numbers = Option<Placed<Vec<Placed<f64>>>>;

/// A temperature in kelvin below which a room is hardly meant.
pub(super) const COLD: f64 = 60.0;
/// 0 °C in kelvin.
const FREEZING: f64 = 273.15;

/// Reads a temperature in kelvin: a number, or text with a unit, "19 C" or "292 K".
pub(crate) fn read_temperature(field: &Field<'_, '_>) -> Result<Placed<f64>, InputError> {
    match &field.value {
        DeValue::String(text) => {
            let value = kelvin(text).ok_or_else(|| {
                field.error(
                    "a temperature is a number of kelvin, or text such as \"19 C\" or \"292 K\"",
                )
            })?;
            Ok(Placed::file(field.span.clone(), value))
        }
        _ => field.number(),
    }
}

/// Reads temperatures in kelvin: one, or an array of them.
pub(super) fn read_temperatures(
    field: &Field<'_, '_>,
) -> Result<Placed<Vec<Placed<f64>>>, InputError> {
    match &field.value {
        DeValue::Array(_) => field.elements("an array", read_temperature),
        DeValue::String(_) => Ok(Placed::file(
            field.span.clone(),
            vec![read_temperature(field)?],
        )),
        _ => field.numbers(),
    }
}

/// The kelvin of "19 C", "19 °C" or "292 K".
fn kelvin(text: &str) -> Option<f64> {
    let text = text.trim();
    let (number, zero) = match text.strip_suffix('C') {
        Some(rest) => (rest.trim_end().trim_end_matches('°'), FREEZING),
        None => (text.strip_suffix('K')?, 0.0),
    };
    let number: f64 = number.trim_end().parse().ok()?;
    number.is_finite().then_some(number + zero)
}

/// What an emissivity is.
pub(crate) fn is_emissivity(emissivity: f64) -> bool {
    emissivity > 0.0 && emissivity <= 1.0
}

/// What is said of one that is none.
pub(crate) const EMISSIVITY: &str = "an emissivity must be more than 0 and at most 1 (a surface that \
     gives and takes no heat has `net_flux = 0`)";

/// What a temperature in kelvin is.
pub(crate) fn is_temperature(kelvin: f64) -> bool {
    (0.0..=1e6).contains(&kelvin)
}

/// What is said of one that is none.
pub(crate) const TEMPERATURE: &str = "a temperature must be from 0 to a million kelvin";

/// The numbers of a key, or a default.
fn list(numbers: &Numbers, default: f64) -> Vec<f64> {
    numbers.as_ref().map_or(vec![default], |numbers| {
        numbers.value.iter().map(|number| number.value).collect()
    })
}

/// Makes a surface of this material; `own` is its reflectance where nothing is said of it.
pub(super) fn set_material(all: &mut Surfaces, surface: usize, material: &Material, own: f64) {
    all.materials[surface] = materials(material, own);
    all.heat |= material.is_heat();
    if let Material::Flux(_, emissivity @ Some(_)) = material {
        all.emissivities.insert(surface, list(emissivity, 1.0));
    }
}

/// The materials of a surface in so many channels, of all of it or of every segment; `own` is its reflectance where nothing is
/// said of it.
pub(super) fn colours(
    material: &Material,
    own: f64,
    (channels, bands): (usize, Option<&Bands>),
) -> Vec<Vec<RoomMaterial>> {
    let lists = |lists: &Lists, default: f64| -> Vec<Vec<f64>> {
        lists.as_ref().map_or(vec![vec![default]], |lists| {
            let lists = lists.value.iter();
            let list = |list: &Vec<Placed<f64>>| list.iter().map(|number| number.value).collect();
            lists.map(list).collect()
        })
    };
    let at = |lists: &[Vec<f64>], segment: usize, channel: usize| match lists {
        [one] => of_channel(one, channel),
        many => many
            .get(segment)
            .map_or(f64::NAN, |list| of_channel(list, channel)),
    };
    match material {
        Material::Coloured(reflectance, emission) => {
            let (reflectances, emissions) = (lists(reflectance, own), lists(emission, 0.0));
            let of = |segment: usize| {
                let of = |channel| RoomMaterial {
                    reflectance: at(&reflectances, segment, channel),
                    emission: at(&emissions, segment, channel),
                };
                (0..channels).map(of).collect()
            };
            let segments = reflectances.len().max(emissions.len());
            (0..segments).map(of).collect()
        }
        Material::Banded(emissivity, temperature) => {
            let emissivities = lists(emissivity, 1.0 - own);
            let temperatures = list(temperature, 0.0);
            let of = |segment: usize| {
                let kelvin = of_channel(&temperatures, segment);
                let emissivity = |band| at(&emissivities, segment, band);
                bands.map_or_else(Vec::new, |bands| bands.materials(&emissivity, kelvin))
            };
            let segments = emissivities.len().max(temperatures.len());
            (0..segments).map(of).collect()
        }
        Material::Light(..) | Material::Grey(..) | Material::Flux(..) => {
            let alone = materials(material, own).into_iter();
            alone.map(|one| vec![one; channels]).collect()
        }
    }
}

/// The materials of a surface; `own` is its reflectance where nothing is said of it.
fn materials(material: &Material, own: f64) -> Vec<RoomMaterial> {
    let (first, second, make): (_, _, fn(f64, f64) -> RoomMaterial) = match material {
        // These are made with their channels.
        Material::Coloured(..) | Material::Banded(..) => return Vec::new(),
        Material::Light(reflectance, emission) => (
            list(reflectance, own),
            list(emission, 0.0),
            |reflectance, emission| RoomMaterial {
                reflectance,
                emission,
            },
        ),
        Material::Grey(emissivity, temperature) => (
            list(emissivity, 1.0 - own),
            list(temperature, 0.0),
            RoomMaterial::grey,
        ),
        // The emissivity plays no role. Its list has one number, or one for every segment, too.
        Material::Flux(net_flux, emissivity) => {
            (list(net_flux, 0.0), list(emissivity, 1.0), |net_flux, _| {
                RoomMaterial::flux(net_flux)
            })
        }
    };
    // A list of another length than the other's stays one: the scene refuses it.
    let at = |list: &[f64], i: usize| match list {
        [one] => *one,
        many => many.get(i).copied().unwrap_or(f64::NAN),
    };
    (0..first.len().max(second.len()))
        .map(|i| make(at(&first, i), at(&second, i)))
        .collect()
}
