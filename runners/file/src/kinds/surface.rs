//! The surfaces of a room, `[[problem.surface]]`.

use toml::de::DeValue;

use super::material::{EMISSIVITY, Material, Numbers, is_emissivity, read_temperatures};
use crate::ProblemFile;
use crate::channels::{HEAT, NEGATIVE, read_lists, refuse_lists};
use crate::place::{InputError, Placed};
use crate::section::{Field, Section};

/// A surface: `[[problem.surface]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// The name of the surface in targets and results.
    pub name: Placed<String>,
    /// The vertices of the surface, the active side on the left; none for a surface of the deck.
    pub points: Option<Placed<Vec<Placed<[f64; 2]>>>>,
    /// The materials of the surface: one, or one for every segment.
    pub material: Material,
}

/// Reads the surfaces of a room in so many channels; 0: nothing is said of channels.
pub(super) fn read_surfaces(
    field: Field<'_, '_>,
    channels: usize,
) -> Result<Vec<Surface>, InputError> {
    let DeValue::Array(array) = &field.value else {
        return Err(field.mistyped("a list of tables: write `[[problem.surface]]`"));
    };
    let items = array.iter().enumerate();
    items
        .map(|(index, item)| {
            let table = field.element(index, item);
            read_surface(table.section("in `[[problem.surface]]`")?, channels)
        })
        .collect()
}

fn read_surface(mut section: Section<'_, '_>, channels: usize) -> Result<Surface, InputError> {
    let name = section.required("name")?.string()?;
    let points = section.optional("points").map(read_points).transpose()?;
    if channels > 0 {
        let mut lists = |key| {
            let lists = section.optional(key).map(|f| read_lists(&f, channels));
            lists.transpose()
        };
        let material = Material::Coloured(lists("reflectance")?, lists("emission")?);
        for key in ["emissivity", "temperature", "net_flux"] {
            if let Some(field) = section.optional(key) {
                return Err(section.source.error(field.key.clone(), HEAT));
            }
        }
        section.finish()?;
        return Ok(Surface {
            name,
            points,
            material,
        });
    }
    let mut numbers = |key| {
        let field = section.optional(key)?;
        let numbers = match key {
            "temperature" => read_temperatures(&field),
            _ => refuse_lists(&field).and_then(|()| field.numbers()),
        };
        Some((field.key.clone(), numbers))
    };
    let keys = [
        "reflectance",
        "emission",
        "emissivity",
        "temperature",
        "net_flux",
    ];
    let [reflectance, emission, emissivity, temperature, net_flux] = keys.map(&mut numbers);
    section.finish()?;
    let light = reflectance.as_ref().or(emission.as_ref());
    let heat = temperature.as_ref().or(net_flux.as_ref());
    let grey = emissivity.as_ref().or(heat);
    if let (Some(_), Some((key, _))) = (light, grey) {
        return Err(section.source.error(
            key.clone(),
            "give either `reflectance` and `emission`, or `emissivity` and `temperature`, or `net_flux`",
        ));
    }
    if let (Some(_), Some((key, _))) = (&temperature, &net_flux) {
        return Err(section.source.error(
            key.clone(),
            "give either the `temperature` of a surface or its `net_flux`: one follows from the other",
        ));
    }
    let is_grey = grey.is_some();
    let value =
        |field: Option<(_, Result<_, InputError>)>| field.map(|(_, value)| value).transpose();
    Ok(Surface {
        name,
        points,
        material: if net_flux.is_some() {
            Material::Flux(value(net_flux)?, value(emissivity)?)
        } else if is_grey {
            Material::Grey(value(emissivity)?, value(temperature)?)
        } else {
            Material::Light(value(reflectance)?, value(emission)?)
        },
    })
}

/// What a reflectance and an emission are.
const REFLECTANCE: &str = "a reflectance must be at least 0 and at most 1";
const EMISSION: &str = "an emission must be finite";

/// Reads a list of points.
fn read_points(field: Field<'_, '_>) -> Result<Placed<Vec<Placed<[f64; 2]>>>, InputError> {
    let DeValue::Array(array) = &field.value else {
        return Err(field.mistyped("a list of points [x, y]"));
    };
    let items = array.iter().enumerate();
    let points = items
        .map(|(index, item)| {
            let point = field.element(index, item);
            let numbers = match &point.value {
                DeValue::Array(_) => point.numbers()?,
                _ => return Err(point.mistyped("a point [x, y]")),
            };
            match numbers.value.as_slice() {
                [x, y] => Ok(Placed::file(point.span.clone(), [x.value, y.value])),
                _ => Err(point.error("a point has two coordinates: [x, y]")),
            }
        })
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Placed::file(field.span.clone(), points))
}

impl Surface {
    /// Refuses what is none of a room, or of the deck whose surface it is.
    pub(super) fn validate(&self, file: &ProblemFile, is_of_deck: bool) -> Result<(), InputError> {
        let name = &self.name;
        match (&self.points, is_of_deck) {
            (Some(points), true) => {
                let message = "surfaces of a deck have their points there: leave `points` out";
                return Err(file.error(&points.place, message));
            }
            (None, false) => return Err(file.error(&name.place, "this surface has no `points`")),
            _ => {}
        }
        if !is_of_deck {
            let missing = match &self.material {
                Material::Light(None, _) | Material::Coloured(None, _) => Some("`reflectance`"),
                Material::Grey(None, _) => Some("`emissivity`"),
                Material::Grey(_, None) => Some("`temperature` or `net_flux`"),
                _ => None,
            };
            if let Some(missing) = missing {
                return Err(file.error(&name.place, format_args!("this surface has no {missing}")));
            }
        }
        let each = |numbers: &Numbers, good: &dyn Fn(f64) -> bool, message: &str| {
            let numbers = numbers.iter().flat_map(|numbers| &numbers.value);
            numbers
                .into_iter()
                .try_for_each(|number| file.demand(number, good(number.value), message))
        };
        let is_reflectance = |rho: f64| (0.0..=1.0).contains(&rho);
        match &self.material {
            Material::Light(reflectance, emission) => {
                each(reflectance, &is_reflectance, REFLECTANCE)?;
                each(emission, &f64::is_finite, EMISSION)
            }
            Material::Coloured(reflectance, emission) => {
                let segments = self.points.as_ref().map(|p| p.value.len().max(2) - 1);
                for (lists, good, message) in [
                    (
                        reflectance,
                        &is_reflectance as &dyn Fn(f64) -> bool,
                        REFLECTANCE,
                    ),
                    (emission, &f64::is_finite, EMISSION),
                    (emission, &|emission| emission >= 0.0, NEGATIVE),
                ] {
                    let Some(lists) = lists else { continue };
                    let count = lists.value.len();
                    let fits = count == 1 || segments.is_none_or(|segments| count == segments);
                    let message_of_count =
                        "give one list for the surface, or one for each of its segments";
                    file.demand(lists, fits, message_of_count)?;
                    let mut numbers = lists.value.iter().flatten();
                    numbers
                        .try_for_each(|number| file.demand(number, good(number.value), message))?;
                }
                Ok(())
            }
            Material::Grey(emissivity, temperature) => {
                each(emissivity, &is_emissivity, EMISSIVITY)?;
                each(
                    temperature,
                    &|t| (0.0..=1e6).contains(&t),
                    "a temperature must be from 0 to a million kelvin",
                )
            }
            Material::Flux(net_flux, emissivity) => {
                each(emissivity, &is_emissivity, EMISSIVITY)?;
                each(net_flux, &f64::is_finite, "a net flux must be finite")
            }
        }
    }
}
