//! `[problem]` with `kind = "circle"`, and what it asks of the rest of the file.

use core::f64::consts::TAU;

use fredholm::circle::{CircleModel, Emission as CircleEmission, common_multiple};
use fredholm::{Ask, Choices, Region, Target};
use fredholm_circle::Harmonic;
use toml::de::DeValue;

use super::{Kind, KindEntry, shared};
use crate::model::{NOTHING, grid};
use crate::place::{InputError, Placed};
use crate::points::numbers;
use crate::section::{Field, Section};
use crate::{MAX_CELLS, ProblemFile, Resolution, Scalar, What};

pub(super) const ENTRY: KindEntry = KindEntry {
    word: "circle",
    about: "Flatland radiosity on the unit circle",
    template: include_str!("../../templates/circle.toml"),
    has_channels: false,
    read: |section| shared(read(section)),
};

/// Radiosity on the circle: `[problem]` with `kind = "circle"`.
#[derive(Clone, Debug, PartialEq)]
pub struct Circle {
    /// The reflectance on equal arcs of [0, 2 pi).
    pub reflectance: Placed<Vec<Placed<f64>>>,
    /// The emission.
    pub emission: Emission,
}

/// The emission of a circle.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Emission {
    /// The emission for which `constant + amplitude sin(frequency s)` is the
    /// solution (Heinrich 1995, (57)-(58)).
    Harmonic {
        /// The constant part of the solution.
        constant: Placed<f64>,
        /// The amplitude of the wave.
        amplitude: Placed<f64>,
        /// The number of waves around the circle.
        frequency: Placed<u32>,
    },
    /// Constant on each of so many equal arcs of [0, 2 pi).
    Arcs(Placed<Vec<Placed<f64>>>),
}

/// Reads the rest of `[problem]` for a circle.
fn read(mut section: Section<'_, '_>) -> Result<Circle, InputError> {
    let reflectance = section.required("reflectance")?.numbers()?;
    let emission = read_emission(section.required("emission")?)?;
    section.finish()?;
    Ok(Circle {
        reflectance,
        emission,
    })
}

/// Reads `emission`: a formula, or values on arcs.
fn read_emission(field: Field<'_, '_>) -> Result<Emission, InputError> {
    match field.value {
        DeValue::Table(_) => read_harmonic(field.section("in `emission`")?),
        DeValue::Array(_) | DeValue::Integer(_) | DeValue::Float(_) => {
            Ok(Emission::Arcs(field.numbers()?))
        }
        _ => Err(field.mistyped(
            "a number, an array of numbers, \
             or a table { constant = ..., amplitude = ..., frequency = ... }",
        )),
    }
}

/// Reads the formula of an emission.
fn read_harmonic(mut section: Section<'_, '_>) -> Result<Emission, InputError> {
    let constant = section.required("constant")?.number()?;
    let amplitude = section.required("amplitude")?.number()?;
    let frequency = section.required("frequency")?.integer()?;
    section.finish()?;
    Ok(Emission::Harmonic {
        constant,
        amplitude,
        frequency,
    })
}

impl Kind for Circle {
    fn validate(&self, file: &ProblemFile) -> Result<(), InputError> {
        let Self {
            reflectance,
            emission,
        } = self;
        if reflectance.value.is_empty() {
            let message = "`reflectance` must have at least one number";
            return Err(file.error(&reflectance.place, message));
        }
        for rho in &reflectance.value {
            file.demand(
                rho,
                (0.0..1.0).contains(&rho.value),
                "a reflectance must be at least 0 and less than 1: \
                 only then does the series of reflections converge",
            )?;
        }
        match emission {
            Emission::Harmonic {
                constant,
                amplitude,
                frequency,
            } => {
                emitted(file, "constant", constant)?;
                emitted(file, "amplitude", amplitude)?;
                file.demand(
                    frequency,
                    frequency.value >= 1,
                    "`frequency` must be at least 1",
                )?;
            }
            Emission::Arcs(arcs) if arcs.value.is_empty() => {
                let message = "`emission` must have at least one number";
                return Err(file.error(&arcs.place, message));
            }
            Emission::Arcs(arcs) => {
                for value in &arcs.value {
                    emitted(file, "emission", value)?;
                }
            }
        }
        if let Some(points) = &file.galerkin.points {
            let message = "`points` belongs to cubes: a circle's coefficients are closed forms";
            return Err(file.refuse(points, message));
        }
        self.validate_cells(file)
    }

    fn validate_target(&self, file: &ProblemFile, what: &What) -> Result<(), InputError> {
        let (place, message) = match what {
            What::At(at) => return file.validate_point(at, check_angle),
            What::OverAll | What::Listed(_) => return Ok(()),
            What::Over(from, to) => {
                let message = format!("the angles `over` must be from 0 to 2 pi = {TAU}");
                let whole = 0.0..=TAU;
                file.demand(from, whole.contains(&from.value), &message)?;
                file.demand(to, whole.contains(&to.value), &message)?;
                let message = "the second angle of `over` must be more than the first";
                return file.demand(to, from.value < to.value, message);
            }
            What::Grid(points, None) => return file.validate_grid(points),
            What::OverSurface(word) => (
                &word.place,
                "`over` must be \"all\", or two angles `[from, to]`",
            ),
            What::Facing(_, facing) => (&facing.place, "`facing` belongs to scenes"),
            What::Grid(_, Some(surface)) | What::On(surface, _) | What::Spot(surface, _) => (
                &surface.place,
                "a circle has no surfaces: they belong to rooms",
            ),
            What::OverSurfaces(words) => (
                &words.place,
                "a circle has no surfaces: `over` must be \"all\", or two angles `[from, to]`",
            ),
            What::Lattice(points) => (
                &points.place,
                "a circle has one coordinate: `grid` must be one number of points",
            ),
            What::Weight(weight) => (
                &weight.place,
                "`weight` belongs to cubes; on a circle use `over = [from, to]`",
            ),
        };
        Err(file.error(place, message))
    }

    fn most_degree(&self) -> (usize, &'static str) {
        (4, "on a circle")
    }

    fn resolve(&self, file: &ProblemFile) -> Result<(Resolution, Vec<Target>), InputError> {
        let targets = file.ask(|target| {
            let region = match &target.what {
                What::At(at) => Region::Point(at.value.iter().map(|s| s.value).collect()),
                What::OverAll => Region::Arc(0.0, TAU),
                What::Over(from, to) => Region::Arc(from.value, to.value),
                What::Grid(points, _) => return Ok(grid(points, None)),
                What::Listed(path) => {
                    return file.listed(path, &mut |fields| {
                        let angle = numbers(fields)?;
                        check_angle(&angle).map_err(|(_, message)| message)?;
                        Ok(Region::Point(angle))
                    });
                }
                _ => return Ok(NOTHING),
            };
            Ok(vec![Ask::One(region)])
        })?;
        Ok((Resolution::Other(Box::new(self.model())), targets))
    }
}

impl Circle {
    /// Cells must fit the arcs.
    fn validate_cells(&self, file: &ProblemFile) -> Result<(), InputError> {
        let reflectance = &self.reflectance;
        let (arcs, unit) = match &self.emission {
            Emission::Harmonic { .. } => (
                format!("{} of `reflectance`", counted(reflectance.value.len())),
                reflectance.value.len(),
            ),
            Emission::Arcs(emission) => (
                format!(
                    "{} of `reflectance` and of the {} of `emission`",
                    counted(reflectance.value.len()),
                    counted(emission.value.len())
                ),
                common_multiple(reflectance.value.len(), emission.value.len()),
            ),
        };
        if unit > MAX_CELLS {
            let message = format!(
                "the number of cells must be a multiple of the {arcs}; the smallest, {unit}, \
                 is beyond the {MAX_CELLS} cells that this program keeps tables for"
            );
            return Err(file.error(&reflectance.place, message));
        }
        let Some(cells) = &file.galerkin.cells else {
            return Ok(());
        };
        file.demand(
            cells,
            cells.value.is_multiple_of(unit),
            format_args!(
                "the number of cells must be a multiple of the {arcs}; nearest: {}",
                neighbours(cells.value, unit)
            ),
        )
    }

    fn model(&self) -> CircleModel {
        let values = |array: &[Placed<f64>]| array.iter().map(|value| value.value).collect();
        let emission = match &self.emission {
            Emission::Harmonic {
                constant,
                amplitude,
                frequency,
            } => CircleEmission::Harmonic(Harmonic {
                constant: constant.value,
                amplitude: amplitude.value,
                frequency: frequency.value,
            }),
            Emission::Arcs(array) => CircleEmission::Arcs(values(&array.value)),
        };
        CircleModel::new(values(&self.reflectance.value), emission)
    }
}

/// Refuses what is no angle of the circle.
fn check_angle(angle: &[f64]) -> Result<(), (Option<usize>, String)> {
    match angle {
        [angle] if (0.0..TAU).contains(angle) => Ok(()),
        [_] => {
            let message = format!("the angle `at` must be at least 0 and less than 2 pi = {TAU}");
            Err((Some(0), message))
        }
        _ => Err((None, "`at` must be one angle on a circle".to_owned())),
    }
}

/// An error unless the squares of such an emission can be summed in the walks' scalar.
fn emitted(file: &ProblemFile, name: &str, value: &Placed<f64>) -> Result<(), InputError> {
    let (smallest, largest) = match file.walk.scalar.value {
        Scalar::F32 => (1e-30, 1e30),
        Scalar::F64 => (1e-100, 1e100),
    };
    let size = value.value.abs();
    file.demand(
        value,
        size == 0.0 || (smallest..=largest).contains(&size),
        format_args!(
            "`{name}` must be 0 or of a size between {smallest:e} and {largest:e}, or its \
             squares leave the range of {}: choose another unit",
            file.walk.scalar.value.word()
        ),
    )
}

/// "1 arc", "2 arcs".
fn counted(arcs: usize) -> String {
    let plural = if arcs == 1 { "" } else { "s" };
    format!("{arcs} arc{plural}")
}

/// The multiples of `unit` below and above, where they are numbers of cells.
fn neighbours(cells: usize, unit: usize) -> String {
    let below = cells / unit * unit;
    let above = below + unit;
    if below == 0 {
        above.to_string()
    } else if above > MAX_CELLS {
        below.to_string()
    } else {
        format!("{below} or {above}")
    }
}
