//! The surfaces of a room, `[[problem.surface]]`.

use super::material::{
    EMISSIVITY, Material, MaterialFields, Numbers, TEMPERATURE, is_emissivity, is_temperature,
    read_temperatures,
};
use crate::ProblemFile;
use crate::channels::{HEAT, Lists, NEGATIVE, read_lists, refuse_lists};
use crate::place::{InputError, Placed};
use crate::section::{Field, Section};

/// A surface: `[[problem.surface]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// The name of the surface in targets and results.
    pub name: Placed<String>,
    /// The vertices of the surface, the active side on the left; none for a surface of the deck.
    pub points: Option<Placed<Vec<Placed<[f64; 2]>>>>,
    /// Whether the right side is active, too, as a surface of its own.
    pub two_sided: Placed<bool>,
    /// The materials of the surface: one, or one for every segment.
    pub material: Material,
}

/// Reads a surface of a room in so many channels, and whether these are bands; 0: nothing is said of channels.
pub(super) fn read_surface(
    mut section: Section<'_, '_>,
    (channels, in_bands): (usize, bool),
) -> Result<Surface, InputError> {
    let name = section.required("name")?.string()?;
    let points = section.read("points", read_points)?;
    let two_sided = section.read_or("two_sided", Field::boolean, false)?;
    let fields = MaterialFields::of(&mut section);
    section.finish()?;
    let lists = |field: &Option<Field<'_, '_>>| {
        let lists = field.as_ref().map(|field| read_lists(field, channels));
        lists.transpose()
    };
    let numbers = |field: &Option<Field<'_, '_>>| {
        let numbers = field.as_ref().map(|field| {
            refuse_lists(field)?;
            field.numbers()
        });
        numbers.transpose()
    };
    let temperatures = || {
        let temperatures = fields.temperature.as_ref().map(read_temperatures);
        temperatures.transpose()
    };
    let material = if channels == 0 {
        fields.check()?;
        if fields.net_flux.is_some() {
            Material::Flux(numbers(&fields.net_flux)?, numbers(&fields.emissivity)?)
        } else if fields.heat().is_some() {
            Material::Grey(numbers(&fields.emissivity)?, temperatures()?)
        } else {
            Material::Light(numbers(&fields.reflectance)?, numbers(&fields.emission)?)
        }
    } else if in_bands {
        fields.check_bands()?;
        Material::Banded(lists(&fields.emissivity)?, temperatures()?)
    } else {
        if let Some(heat) = fields.heat() {
            return Err(heat.unsuited(HEAT));
        }
        Material::Coloured(lists(&fields.reflectance)?, lists(&fields.emission)?)
    };
    Ok(Surface {
        name,
        points,
        two_sided,
        material,
    })
}

/// What a reflectance and an emission are.
const REFLECTANCE: &str = "a reflectance must be at least 0 and at most 1";
const EMISSION: &str = "an emission must be finite";

/// Reads a list of points.
fn read_points(field: &Field<'_, '_>) -> Result<Placed<Vec<Placed<[f64; 2]>>>, InputError> {
    field.elements("a list of points [x, y]", |point| {
        let numbers = point.elements("a point [x, y]", Field::number)?;
        match numbers.value.as_slice() {
            [x, y] => Ok(Placed::file(point.span.clone(), [x.value, y.value])),
            _ => Err(point.error("a point has two coordinates: [x, y]")),
        }
    })
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
        if self.two_sided.value && is_of_deck {
            let message = "surfaces of a deck have their sides there: leave `two_sided` out";
            return Err(file.error(&self.two_sided.place, message));
        }
        if !is_of_deck {
            let missing = match &self.material {
                Material::Light(None, _) | Material::Coloured(None, _) => Some("`reflectance`"),
                Material::Grey(None, _) | Material::Banded(None, _) => Some("`emissivity`"),
                Material::Grey(_, None) => Some("`temperature` or `net_flux`"),
                Material::Banded(_, None) => Some("`temperature`"),
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
        let each_of_lists = |lists: &Lists, good: &dyn Fn(f64) -> bool, message: &str| {
            let Some(lists) = lists else { return Ok(()) };
            let segments = self.points.as_ref().map(|p| p.value.len().max(2) - 1);
            let count = lists.value.len();
            let fits = count == 1 || segments.is_none_or(|segments| count == segments);
            let of_count = "give one list for the surface, or one for each of its segments";
            file.demand(lists, fits, of_count)?;
            let mut numbers = lists.value.iter().flatten();
            numbers.try_for_each(|number| file.demand(number, good(number.value), message))
        };
        match &self.material {
            Material::Light(reflectance, emission) => {
                each(reflectance, &is_reflectance, REFLECTANCE)?;
                each(emission, &f64::is_finite, EMISSION)
            }
            Material::Coloured(reflectance, emission) => {
                each_of_lists(reflectance, &is_reflectance, REFLECTANCE)?;
                each_of_lists(emission, &f64::is_finite, EMISSION)?;
                each_of_lists(emission, &|emission| emission >= 0.0, NEGATIVE)
            }
            Material::Banded(emissivity, temperature) => {
                each_of_lists(emissivity, &is_emissivity, EMISSIVITY)?;
                each(temperature, &is_temperature, TEMPERATURE)
            }
            Material::Grey(emissivity, temperature) => {
                each(emissivity, &is_emissivity, EMISSIVITY)?;
                each(temperature, &is_temperature, TEMPERATURE)
            }
            Material::Flux(net_flux, emissivity) => {
                each(emissivity, &is_emissivity, EMISSIVITY)?;
                each(net_flux, &f64::is_finite, "a net flux must be finite")
            }
        }
    }
}
