//! The materials of surfaces, in one channel or in several.

use fredholm::channels::Bands;
use fredholm_core::MOST_CHANNELS;
use fredholm_scene::Material;

use super::description::Reader;
use super::{Known, SceneSurface};
use crate::channels::{HEAT, NEGATIVE, default_names, of_channel, wrong_count};
use crate::kinds::material::{
    EMISSIVITY, MaterialFields, TEMPERATURE, is_emissivity, is_temperature, read_temperature,
};
use crate::place::InputError;
use crate::section::{Field, Section};

/// What a specular reflectance is.
const SPECULAR: &str = "a specular reflectance must be at least 0 and below 1";
/// What an absorptance is.
const ABSORPTANCE: &str = "an absorptance must be from 0 to 1";
/// What has an absorptance.
const ABSORBS_HEAT: &str = "`absorptance` is what a surface of temperature or net flux absorbs of sunlight, in one band of heat: of light alone \
     `reflectance` says it";
/// What is said of shares that are more than all.
const TOO_MUCH: &str = "what is reflected as by a mirror and what is reflected diffusely, or absorbed, is more than all: \
     `specular` and `reflectance`, or `emissivity`, must not be above 1 together";
/// Why bands have no mirrors.
const MIRROR_IN_BANDS: &str =
    "mirrors are of light, or of heat in one band: leave `specular` out, or `wavelengths`";
/// What shares that sum up to 1 are off by.
const ROUNDING: f64 = 1e-12;

/// What a surface does with light.
pub(super) struct Given {
    material: Material,
    /// One material for each channel, if there are several.
    colours: Vec<Material>,
    /// The emissivity of a surface from which the net flux is given, if it is known.
    emissivity: Option<f64>,
    /// ρ_s, the part of what arrives that leaves as from a mirror.
    specular: f64,
    /// α, the part of sunlight that is absorbed, if it is given.
    absorptance: Option<f64>,
    known: Known,
    /// Whether u is in W/m².
    pub(super) is_heat: bool,
}

/// A material that reflects all that it does not absorb, of which this part leaves as from a mirror.
///
/// ```
/// use fredholm_file::scene::less_specular;
/// use fredholm_scene::Material;
///
/// // ε = 0.5 and ρ_s = 0.25.
/// let plate = less_specular(Material::grey(0.5, 300.0), 0.25);
/// assert_eq!(plate.reflectance, 0.25);
/// ```
#[must_use]
pub fn less_specular(material: Material, specular: f64) -> Material {
    let rest = material.reflectance - specular;
    Material {
        // Shares may be off by rounding; a scene refuses what is more than all.
        reflectance: if rest.abs() < ROUNDING { 0.0 } else { rest },
        ..material
    }
}

impl SceneSurface {
    pub(super) fn give(&mut self, given: &Given) {
        self.known = given.known;
        self.material = given.material;
        self.colours.clone_from(&given.colours);
        self.emissivity = given.emissivity;
        self.specular = given.specular;
        self.absorptance = given.absorptance;
    }
}

/// The number of a key that may be left out.
fn number(
    field: &Option<Field<'_, '_>>,
    good: &dyn Fn(f64) -> bool,
    message: &str,
) -> Result<Option<f64>, InputError> {
    let Some(field) = field else {
        return Ok(None);
    };
    let value = field.number()?.value;
    if good(value) {
        Ok(Some(value))
    } else {
        Err(field.error(message))
    }
}

/// A temperature in kelvin; 0 if none is given.
fn kelvin(field: Option<&Field<'_, '_>>) -> Result<f64, InputError> {
    let Some(field) = field else {
        return Ok(0.0);
    };
    let kelvin = read_temperature(field)?.value;
    if is_temperature(kelvin) {
        Ok(kelvin)
    } else {
        Err(field.error(TEMPERATURE))
    }
}

impl Reader<'_> {
    /// What a surface does with light; `None` if nothing is said.
    pub(super) fn material(
        &mut self,
        section: &mut Section<'_, '_>,
    ) -> Result<Option<Given>, InputError> {
        let fields = MaterialFields::of(section);
        fields.check()?;
        if self.scene.bands.is_some() {
            fields.check_bands()?;
        }
        let mirror = section.optional("specular");
        let specular = number(&mirror, &|r| (0.0..1.0).contains(&r), SPECULAR)?.unwrap_or(0.0);
        // What is left to reflectance and emissivity.
        let rest = 1.0 - specular;
        let refuse_more = |share: f64| match &mirror {
            Some(mirror) if share > rest + ROUNDING => Err(mirror.error(TOO_MUCH)),
            _ => Ok(()),
        };
        let of_sun = section.optional("absorptance");
        let absorptance = number(&of_sun, &|a| (0.0..=1.0).contains(&a), ABSORPTANCE)?;
        let (is_light, is_grey) = (fields.light().is_some(), fields.heat().is_some());
        if let Some(of_sun) = of_sun.filter(|_| !is_grey || self.scene.bands.is_some()) {
            return Err(of_sun.unsuited(ABSORBS_HEAT));
        }
        let is_warm = fields.temperature.is_some() || fields.net_flux.is_some();
        let known = match is_grey && !is_warm {
            true => Known::Emissivity,
            false => Known::Material,
        };
        let MaterialFields {
            reflectance,
            emission,
            emissivity,
            temperature,
            net_flux,
        } = fields;
        let given = |material, colours, is_heat| Given {
            material,
            colours,
            emissivity: None,
            specular,
            absorptance,
            known,
            is_heat,
        };
        if self.scene.bands.is_some() {
            if let Some(mirror) = &mirror {
                return Err(mirror.unsuited(MIRROR_IN_BANDS));
            }
            let colours = self.in_bands(emissivity.as_ref(), temperature.as_ref())?;
            return Ok(is_grey.then(|| given(largest(&colours), colours, false)));
        }
        let emissivity = number(&emissivity, &is_emissivity, EMISSIVITY)?;
        refuse_more(emissivity.unwrap_or(0.0))?;
        if let Some(flux) = number(&net_flux, &f64::is_finite, "a net flux must be finite")? {
            let material = less_specular(Material::flux(flux), specular);
            return Ok(Some(Given {
                emissivity,
                ..given(material, Vec::new(), true)
            }));
        }
        if is_grey {
            let emissivity = emissivity.unwrap_or(rest);
            let grey = Material::grey(emissivity, kelvin(temperature.as_ref())?);
            let material = less_specular(grey, specular);
            return Ok(Some(given(material, Vec::new(), true)));
        }
        let reflectances = self.of_channels(
            reflectance.as_ref(),
            &|r| (0.0..=1.0).contains(&r),
            "a reflectance must be from 0 to 1",
        )?;
        let emissions = self.of_channels(
            emission.as_ref(),
            &f64::is_finite,
            "an emission must be finite",
        )?;
        let count = reflectances.len().max(emissions.len());
        let colours: Vec<Material> = (0..count)
            .map(|channel| Material {
                reflectance: of_channel(&reflectances, channel),
                emission: of_channel(&emissions, channel),
            })
            .collect();
        let material = largest(&colours);
        refuse_more(material.reflectance)?;
        let colours = if count > 1 { colours } else { Vec::new() };
        let is_said = is_light || mirror.is_some();
        Ok(is_said.then(|| given(material, colours, false)))
    }

    /// The material in every band: ε and, of the heat of its temperature, ε times the part in the band.
    fn in_bands(
        &mut self,
        emissivity: Option<&Field<'_, '_>>,
        temperature: Option<&Field<'_, '_>>,
    ) -> Result<Vec<Material>, InputError> {
        let emissivities = match emissivity {
            Some(_) => self.of_channels(emissivity, &is_emissivity, EMISSIVITY)?,
            None => vec![1.0],
        };
        let kelvin = kelvin(temperature)?;
        let bands = self.scene.bands.iter();
        let of = |bands: &Bands| bands.materials(&|band| of_channel(&emissivities, band), kelvin);
        Ok(bands.flat_map(of).collect())
    }

    /// Refuses light that is as strong in every channel, which that of bands is not.
    pub(super) fn refuse_light_in_bands(&self, field: &Field<'_, '_>) -> Result<(), InputError> {
        let has_sky = self.scene.sky.as_ref();
        if has_sky.is_some_and(|sky| sky.emissions.is_some()) || !self.scene.lights.is_empty() {
            return Err(field.error(super::NO_BANDS));
        }
        Ok(())
    }

    /// The numbers of a key: one, or one for every channel; none if it is left out.
    fn of_channels(
        &mut self,
        field: Option<&Field<'_, '_>>,
        good: &dyn Fn(f64) -> bool,
        message: &str,
    ) -> Result<Vec<f64>, InputError> {
        let Some(field) = field else {
            return Ok(Vec::new());
        };
        let numbers = field.numbers()?.value;
        if let Some(bad) = numbers.iter().find(|number| !good(number.value)) {
            return Err(self.error(&bad.place, message));
        }
        let found = numbers.len();
        if found != 1 {
            let channels = *self.channels.get_or_insert(found);
            if found != channels || found > MOST_CHANNELS {
                return Err(wrong_count(field, channels, found));
            }
            if let Some(dark) = numbers.iter().find(|number| number.value < 0.0) {
                return Err(self.error(&dark.place, NEGATIVE));
            }
        }
        Ok(numbers.iter().map(|number| number.value).collect())
    }

    /// Gives every surface a material in every channel, and every channel a name.
    pub(super) fn finish_channels(
        &mut self,
        field: Option<&Field<'_, '_>>,
    ) -> Result<(), InputError> {
        let Some(count) = self.channels else {
            return Ok(());
        };
        if self.scene.heat {
            return Err(match field {
                Some(field) => field.error(HEAT),
                None => InputError::new(format_args!("{}: {HEAT}", self.source.name)),
            });
        }
        if self.scene.channels.is_empty() {
            self.scene.channels = default_names(count);
        }
        for surface in &mut self.scene.surfaces {
            if surface.colours.is_empty() {
                if surface.material.emission < 0.0 {
                    return Err(InputError::new(format_args!(
                        "{}: {}: {NEGATIVE}",
                        self.source.name, surface.name
                    )));
                }
                surface.colours = vec![surface.material; count];
            }
        }
        Ok(())
    }
}

/// The largest reflectance and the largest emission.
fn largest(colours: &[Material]) -> Material {
    let first = colours.first().copied().unwrap_or(Material::BLACK);
    colours.iter().fold(first, |largest, one| Material {
        reflectance: largest.reflectance.max(one.reflectance),
        emission: largest.emission.max(one.emission),
    })
}
