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

/// What a surface does with light.
pub(super) struct Given {
    material: Material,
    /// One material for each channel, if there are several.
    colours: Vec<Material>,
    /// The emissivity of a surface from which the net flux is given, if it is known.
    emissivity: Option<f64>,
    known: Known,
    /// Whether u is in W/m².
    pub(super) is_heat: bool,
}

impl SceneSurface {
    pub(super) fn give(&mut self, given: &Given) {
        self.known = given.known;
        self.material = given.material;
        self.colours.clone_from(&given.colours);
        self.emissivity = given.emissivity;
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
        let (is_light, is_grey) = (fields.light().is_some(), fields.heat().is_some());
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
        if self.scene.bands.is_some() {
            let colours = self.in_bands(emissivity.as_ref(), temperature.as_ref())?;
            return Ok(is_grey.then(|| Given {
                material: largest(&colours),
                colours,
                emissivity: None,
                known,
                is_heat: false,
            }));
        }
        let emissivity = number(&emissivity, &is_emissivity, EMISSIVITY)?;
        if let Some(flux) = number(&net_flux, &f64::is_finite, "a net flux must be finite")? {
            return Ok(Some(Given {
                material: Material::flux(flux),
                colours: Vec::new(),
                emissivity,
                known,
                is_heat: true,
            }));
        }
        if is_grey {
            return Ok(Some(Given {
                material: Material::grey(emissivity.unwrap_or(1.0), kelvin(temperature.as_ref())?),
                colours: Vec::new(),
                emissivity: None,
                known,
                is_heat: true,
            }));
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
        Ok(is_light.then(|| Given {
            material,
            colours: if count > 1 { colours } else { Vec::new() },
            emissivity: None,
            known,
            is_heat: false,
        }))
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
