//! `[problem]` with `kind = "tube"`, and what it asks of the rest of the file.

use fredholm::tube::{Parameters, TubeModel};
use fredholm::{Ask, Region, Target};

use super::{Kind, KindEntry, shared};
use crate::model::{NOTHING, grid};
use crate::place::{InputError, Placed};
use crate::points::numbers;
use crate::section::{Field, Section};
use crate::{ProblemFile, Resolution, What};

pub(super) const ENTRY: KindEntry = KindEntry {
    word: "tube",
    about: "Light, heat or molecules in a circular tube",
    template: include_str!("../../templates/tube.toml"),
    has_channels: false,
    read: |section| shared(read(section)),
};

/// The words for the ends in `over`.
const ENDS: [&str; 2] = ["left", "right"];

/// Circular tube with black ends: `[problem]` with `kind = "tube"`.
#[derive(Clone, Debug, PartialEq)]
pub struct Tube {
    /// L/R.
    pub length: Placed<f64>,
    /// ρ of the wall.
    pub reflectance: Placed<f64>,
    /// What the wall emits.
    pub emission: Placed<f64>,
    /// What the two ends emit.
    pub ends: Placed<Vec<Placed<f64>>>,
}

/// Reads the rest of `[problem]` for a tube.
fn read(mut section: Section<'_, '_>) -> Result<Tube, InputError> {
    let tube = Tube {
        length: section.required("length")?.number()?,
        reflectance: section.required("reflectance")?.number()?,
        emission: section.read_or("emission", Field::number, 0.0)?,
        ends: section.required("ends")?.numbers()?,
    };
    section.finish()?;
    Ok(tube)
}

impl Kind for Tube {
    fn validate(&self, file: &ProblemFile) -> Result<(), InputError> {
        let length = &self.length;
        let is_length = (1e-6..=1e6).contains(&length.value);
        file.demand(length, is_length, "`length` must be from 1e-6 to 1e6 radii")?;
        let reflectance = &self.reflectance;
        let is_part = (0.0..=1.0).contains(&reflectance.value);
        file.demand(reflectance, is_part, "`reflectance` must be from 0 to 1")?;
        if self.ends.value.len() != 2 {
            let message = "`ends` must be two numbers: what the end at 0 emits, and what that at `length` does";
            return Err(file.error(&self.ends.place, message));
        }
        let mut emissions = self.ends.value.iter().chain([&self.emission]);
        emissions.try_for_each(|e| {
            let message = "emissions must be of a size up to 1e15: choose another unit";
            file.demand(e, e.value.abs() <= 1e15, message)
        })?;
        match &file.galerkin.points {
            Some(points) => Err(file.refuse(
                points,
                "`points` belongs to cubes: a tube's coefficients are closed forms",
            )),
            None => Ok(()),
        }
    }

    fn validate_target(&self, file: &ProblemFile, what: &What) -> Result<(), InputError> {
        let over = "`over` must be \"all\", the mean of u over the wall, or \"left\" or \"right\", what comes to an end";
        let (place, message) = match what {
            What::At(at) => return file.validate_point(at, |at| self.check(at)),
            What::Grid(points, None) => return file.validate_grid(points),
            What::OverAll | What::Listed(_) => return Ok(()),
            What::OverSurface(word) if ENDS.contains(&&*word.value) => return Ok(()),
            What::OverSurface(word) => (&word.place, over),
            What::OverSurfaces(words) => (&words.place, over),
            What::Over(from, _) => (&from.place, over),
            What::Facing(_, facing) => (&facing.place, "`facing` belongs to scenes"),
            What::Grid(_, Some(surface)) | What::On(surface, _) | What::Spot(surface, _) => (
                &surface.place,
                "a tube's points are numbers along its axis: `at = 0.5`, or a `grid`",
            ),
            What::Lattice(points) => (
                &points.place,
                "a tube has one coordinate: `grid` must be one number of points",
            ),
            What::Weight(weight) => (&weight.place, "`weight` belongs to cubes"),
        };
        Err(file.error(place, message))
    }

    fn most_degree(&self) -> (usize, &'static str) {
        (0, "of walks of the chain in a tube")
    }

    fn resolve(&self, file: &ProblemFile) -> Result<(Resolution, Vec<Target>), InputError> {
        let targets = file.ask(|target| {
            let region = match &target.what {
                What::At(at) => Region::Point(at.value.iter().map(|z| z.value).collect()),
                What::Grid(points, _) => return Ok(grid(points, None)),
                What::Listed(path) => {
                    return file.listed(path, &mut |fields| {
                        let at = numbers(fields)?;
                        self.check(&at).map_err(|(_, message)| message)?;
                        Ok(Region::Point(at))
                    });
                }
                What::OverAll => Region::Weight(0),
                What::OverSurface(word) if word.value == ENDS[0] => Region::Weight(1),
                What::OverSurface(_) => Region::Weight(2),
                _ => return Ok(NOTHING),
            };
            Ok(vec![Ask::One(region)])
        })?;
        let [left, right] =
            [0, 1].map(|end| self.ends.value.get(end).map_or(f64::NAN, |e| e.value));
        let model = TubeModel::new(Parameters {
            length: self.length.value,
            reflectance: self.reflectance.value,
            emission: self.emission.value,
            ends: [left, right],
        });
        Ok((Resolution::Other(Box::new(model)), targets))
    }
}

impl Tube {
    /// Refuses what is no place on the wall.
    fn check(&self, at: &[f64]) -> Result<(), (Option<usize>, String)> {
        match at {
            [z] if (0.0..=self.length.value).contains(z) => Ok(()),
            _ => Err((
                None,
                format!(
                    "`at` must be one number from 0 to the length, {}",
                    self.length.value
                ),
            )),
        }
    }
}
