//! Scenes of molecules, `kind = "vacuum"`: a gas, and surfaces to which they stick, which pump, and which give off gas.

use fredholm::scene::Vacuum;
use fredholm_scene::Material;
use toml::de::DeValue;

use super::outline::{area_vector, dot};
use super::{Known, SceneFile};
use crate::kinds::material::{TEMPERATURE, is_temperature, read_temperature};
use crate::place::{InputError, Place, Placed, Source};
use crate::section::{Field, Section, unknown_word};

/// Molar masses in g/mol (IUPAC 2021, abridged); that of air is dry air's.
const GASES: &[(&str, f64)] = &[
    ("H2", 2.016),
    ("D2", 4.0282),
    ("He", 4.0026),
    ("CH4", 16.043),
    ("H2O", 18.015),
    ("Ne", 20.180),
    ("CO", 28.010),
    ("N2", 28.014),
    ("air", 28.965),
    ("O2", 31.998),
    ("Ar", 39.95),
    ("CO2", 44.009),
    ("Kr", 83.798),
    ("Xe", 131.29),
];

/// The temperature of a gas of which nothing is said, 20 °C, in kelvin.
const ROOM_TEMPERATURE: f64 = 293.15;

/// The share of a square metre that is a square centimetre.
const SQUARE_CENTIMETRE: f64 = 1e-4;

/// The gas of `[problem]`: nitrogen at 20 °C if nothing is said.
pub(super) fn read(problem: &mut Section<'_, '_>) -> Result<Vacuum, InputError> {
    for key in ["light", "sky", "photometric", "channels", "wavelengths"] {
        if let Some(field) = problem.optional(key) {
            return Err(field.unsuited(
                "this is of light or heat, and a vacuum has molecules alone: leave it out",
            ));
        }
    }
    let gas = problem.optional("gas");
    let mass = match &gas {
        None => 28.014,
        Some(field) if matches!(field.value, DeValue::String(_)) => {
            let word = field.string()?.value;
            let found = GASES
                .iter()
                .find(|(name, _)| name.eq_ignore_ascii_case(&word));
            let names: Vec<String> = GASES.iter().map(|(name, _)| (*name).to_owned()).collect();
            let unknown = || field.error(unknown_word("gas", &word, &names));
            found.map(|(_, mass)| *mass).ok_or_else(unknown)?
        }
        Some(field) => {
            let mass = field.number()?.value;
            if !(mass > 0.0 && mass.is_finite()) {
                return Err(field.error("`gas` is a name, or a molar mass in g/mol above 0"));
            }
            mass
        }
    };
    let temperature = problem.optional("temperature");
    let kelvin = match &temperature {
        None => ROOM_TEMPERATURE,
        Some(field) => read_temperature(field)?.value,
    };
    match &temperature {
        Some(field) if !(is_temperature(kelvin) && kelvin > 0.0) => Err(field.error(TEMPERATURE)),
        _ => Ok(Vacuum::new(mass, kelvin)),
    }
}

/// What a surface does with molecules, as the file says it.
#[derive(Clone, Debug, Default)]
pub(super) struct Words {
    /// The probability that a molecule stays.
    sticking: Option<Placed<f64>>,
    /// What the surface pumps, in l/s.
    pump: Option<Placed<f64>>,
    /// What it gives off, in mbar l/s.
    outgassing: Option<Placed<f64>>,
    /// What each square centimetre gives off, in mbar l/(s cm²).
    outgassing_rate: Option<Placed<f64>>,
}

impl Words {
    /// The words of a surface with this sticking factor, which gives off so much in mbar l/s.
    #[cfg(feature = "parts")]
    pub(super) fn of(sticking: f64, outgassing: f64) -> Self {
        Self {
            sticking: Some(Placed::default(sticking)),
            outgassing: Some(Placed::default(outgassing)),
            ..Self::default()
        }
    }

    /// Reads what a surface says; `None` if it says nothing of gas.
    pub(super) fn read(section: &mut Section<'_, '_>) -> Result<Option<Self>, InputError> {
        let mut read = |key: &'static str, most: f64, message: &str| {
            let Some(field) = section.optional(key) else {
                return Ok(None);
            };
            let number = field.number()?;
            match number.value >= 0.0 && number.value <= most {
                true => Ok(Some((number, field))),
                false => Err(field.error(message)),
            }
        };
        let sticking = read("sticking", 1.0, "a sticking factor is from 0 to 1")?;
        let pump = read("pump", f64::MAX, "a pump has a speed in l/s, at least 0")?;
        let [whole, each] = [
            read(
                "outgassing",
                f64::MAX,
                "an outgassing is in mbar l/s, at least 0",
            )?,
            read(
                "outgassing_rate",
                f64::MAX,
                "an outgassing rate is in mbar l/(s cm²), at least 0",
            )?,
        ];
        if let (Some(_), Some((_, field))) = (&sticking, &pump) {
            return Err(field.unsuited(
                "give either `sticking` or the speed of a `pump`: one follows from the other",
            ));
        }
        if let (Some(_), Some((_, field))) = (&whole, &each) {
            return Err(field.unsuited("give either the `outgassing` of the whole surface, or the `outgassing_rate` of a square centimetre"));
        }
        let number = |found: Option<(Placed<f64>, Field<'_, '_>)>| found.map(|(number, _)| number);
        let words = Self {
            sticking: number(sticking),
            pump: number(pump),
            outgassing: number(whole),
            outgassing_rate: number(each),
        };
        let all = [
            &words.sticking,
            &words.pump,
            &words.outgassing,
            &words.outgassing_rate,
        ];
        Ok(all.iter().any(|own| own.is_some()).then_some(words))
    }

    /// The material of a surface of this area in m²: what leaves is in millibar.
    fn material(&self, gas: &Vacuum, area: f64, source: &Source) -> Result<Material, InputError> {
        let value = |own: &Option<Placed<f64>>| own.as_ref().map_or(0.0, |own| own.value);
        let most = gas.speed_of(area);
        let sticking = match &self.pump {
            Some(pump) if pump.value > most => {
                let message = format!(
                    "an area of {area:.4} m² pumps at most {most:.4} l/s, where every molecule stays"
                );
                return Err(match &pump.place {
                    Place::File(span) => source.error(span.clone(), message),
                    _ => InputError::new(message),
                });
            }
            Some(pump) => pump.value / most,
            None => value(&self.sticking),
        };
        let given =
            value(&self.outgassing) + value(&self.outgassing_rate) * area / SQUARE_CENTIMETRE;
        Ok(Material {
            reflectance: 1.0 - sticking,
            emission: given / most,
        })
    }
}

/// Gives surfaces their materials, now that their areas are known; what says nothing keeps no molecule and gives none.
pub(super) fn finish(
    scene: &mut SceneFile,
    all: &[(String, Words)],
    source: &Source,
) -> Result<(), InputError> {
    let Some(gas) = scene.gas else {
        return Ok(());
    };
    for surface in &mut scene.surfaces {
        surface.known = Known::Material;
        surface.material = Material {
            reflectance: 1.0,
            emission: 0.0,
        };
    }
    // A later one replaces what is said of the same surface before.
    for (name, words) in all {
        let at = scene.surfaces.iter().position(|own| own.name == *name);
        let Some(surface) = at.and_then(|at| scene.surfaces.get_mut(at)) else {
            continue;
        };
        let double = surface.polygons.iter().map(|own| {
            let vector = area_vector(own.points());
            dot(vector, vector).sqrt()
        });
        let material = words.material(&gas, 0.5 * double.sum::<f64>(), source)?;
        surface.material = material;
        // Of a thin plate both sides are as it says.
        let back = scene.surfaces.iter_mut().find(|own| own.back_of == at);
        if let Some(back) = back {
            back.material = material;
        }
    }
    Ok(())
}
