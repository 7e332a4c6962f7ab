//! `[problem]` with `kind = "sphere"`, and what it asks of the rest of the file.

use core::f64::consts::{PI, TAU};

use fredholm::sphere::{Parameters, SphereModel};
use fredholm::{Ask, Choices, Region, Scalar, Target};

use super::{Kind, KindEntry, shared};
use crate::model::NOTHING;
use crate::place::{InputError, Placed};
use crate::points::numbers;
use crate::section::{Field, Section};
use crate::{ProblemFile, Resolution, What};

pub(super) const ENTRY: KindEntry = KindEntry {
    word: "sphere",
    about: "Scattering on the unit sphere",
    template: include_str!("../../templates/sphere.toml"),
    has_channels: false,
    read: |section| shared(read(section)),
};

/// The chain prefers to jump forward at most so much.
const MOST_FORWARD: f64 = 0.5;

/// Scattering on the unit sphere: `[problem]` with `kind = "sphere"`.
#[derive(Clone, Debug, PartialEq)]
pub struct Sphere {
    /// a, the part of what comes that is scattered.
    pub albedo: Placed<f64>,
    /// g, the mean cosine of the angle by which it is scattered.
    pub asymmetry: Placed<f64>,
    /// e, one number, or four: F(x) = e₀ + e₁x₁ + e₂x₂ + e₃x₃.
    pub emission: Placed<Vec<Placed<f64>>>,
    /// b: how much rather the chain jumps forward.
    pub forward: Option<Placed<f64>>,
}

/// Reads the rest of `[problem]` for a sphere.
fn read(mut section: Section<'_, '_>) -> Result<Sphere, InputError> {
    let sphere = Sphere {
        albedo: section.required("albedo")?.number()?,
        asymmetry: section.read_or("asymmetry", Field::number, 0.0)?,
        emission: section.required("emission")?.numbers()?,
        forward: section.read("forward", Field::number)?,
    };
    section.finish()?;
    Ok(sphere)
}

impl Sphere {
    fn parameters(&self) -> Parameters {
        let mut emission = [0.0; 4];
        for (to, from) in emission.iter_mut().zip(&self.emission.value) {
            *to = from.value;
        }
        // The chain of this preference has the mean cosine of the kernel.
        let like_kernel = (3.0 * self.asymmetry.value).min(MOST_FORWARD);
        Parameters {
            albedo: self.albedo.value,
            asymmetry: self.asymmetry.value,
            emission,
            forward: self.forward.as_ref().map_or(like_kernel, |b| b.value),
        }
    }

    fn validate_emission(&self, file: &ProblemFile) -> Result<(), InputError> {
        let emission = &self.emission;
        if !matches!(emission.value.len(), 1 | 4) {
            let message = "`emission` must be one number, or four: [e0, e1, e2, e3] for e0 + e1 x1 + e2 x2 + e3 x3";
            return Err(file.error(&emission.place, message));
        }
        let scalar = file.walk.scalar.value;
        let largest = match scalar {
            Scalar::F32 => 1e15,
            Scalar::F64 => 1e100,
        };
        emission.value.iter().try_for_each(|e| {
            file.demand(
                e,
                e.value.abs() <= largest,
                format_args!(
                    "`emission` must be of a size up to {largest:e}, or its squares leave the range of {}: choose \
                     another unit",
                    scalar.word()
                ),
            )
        })
    }
}

impl Kind for Sphere {
    fn validate(&self, file: &ProblemFile) -> Result<(), InputError> {
        // As walks hold them: what is nearly 1 may be 1 in f32.
        let held = |value: f64| match file.walk.scalar.value {
            Scalar::F32 => f64::from(value as f32),
            Scalar::F64 => value,
        };
        let albedo = held(self.albedo.value);
        file.demand(
            &self.albedo,
            0.0 < albedo && albedo < 1.0,
            "`albedo` must be more than 0 and less than 1: only then does the series of scatterings converge",
        )?;
        file.demand(
            &self.asymmetry,
            (0.0..0.5).contains(&held(self.asymmetry.value)),
            "`asymmetry` must be at least 0 and less than 1/2",
        )?;
        self.validate_emission(file)?;
        if let Some(forward) = &self.forward {
            file.demand(
                forward,
                (0.0..=MOST_FORWARD).contains(&forward.value),
                "`forward` must be from 0 to 1/2",
            )?;
        }
        match &file.galerkin.points {
            Some(points) => {
                let message =
                    "`points` belongs to cubes: a sphere's coefficients have a rule of their own";
                Err(file.refuse(points, message))
            }
            None => Ok(()),
        }
    }

    fn validate_target(&self, file: &ProblemFile, what: &What) -> Result<(), InputError> {
        let (place, message) = match what {
            What::At(at) => return file.validate_point(at, check_angles),
            What::OverAll | What::Listed(_) => return Ok(()),
            What::Grid(points, None) => (
                &points.place,
                "a `grid` is along a line: on a sphere give points, `at = [theta, phi]`",
            ),
            What::Lattice(points) => (
                &points.place,
                "a `grid` is along a line: on a sphere give points, `at = [theta, phi]`, or `at = \"points.csv\"`",
            ),
            What::OverSurfaces(words) => (&words.place, "`over` must be \"all\""),
            What::Over(from, _) => (
                &from.place,
                "a part of a sphere is not offered: use `over = \"all\"`",
            ),
            What::OverSurface(word) => (&word.place, "`over` must be \"all\""),
            What::Facing(_, facing) => (&facing.place, "`facing` belongs to scenes"),
            What::Grid(_, Some(surface)) | What::On(surface, _) | What::Spot(surface, _) => (
                &surface.place,
                "a sphere has no other surfaces: they belong to rooms",
            ),
            What::Weight(weight) => (&weight.place, "`weight` belongs to cubes"),
        };
        Err(file.error(place, message))
    }

    fn most_degree(&self) -> (usize, &'static str) {
        (0, "on a sphere")
    }

    fn resolve(&self, file: &ProblemFile) -> Result<(Resolution, Vec<Target>), InputError> {
        let targets = file.ask(|target| {
            let region = match &target.what {
                What::At(at) => Region::Point(at.value.iter().map(|angle| angle.value).collect()),
                What::OverAll => Region::Whole,
                What::Listed(path) => {
                    return file.listed(path, &mut |fields| {
                        let angles = numbers(fields)?;
                        check_angles(&angles).map_err(|(_, message)| message)?;
                        Ok(Region::Point(angles))
                    });
                }
                _ => return Ok(NOTHING),
            };
            Ok(vec![Ask::One(region)])
        })?;
        let model = SphereModel::new(self.parameters());
        Ok((Resolution::Other(Box::new(model)), targets))
    }
}

/// Refuses what is no point of the sphere.
fn check_angles(angles: &[f64]) -> Result<(), (Option<usize>, String)> {
    match angles {
        [colatitude, _] if !(0.0..=PI).contains(colatitude) => Err((
            Some(0),
            format!("the first angle `at` must be from 0, the north pole, to pi = {PI}"),
        )),
        [_, azimuth] if !(-PI..=TAU).contains(azimuth) => Err((
            Some(1),
            format!("the second angle `at` must be from -pi to 2 pi = {TAU}"),
        )),
        [_, _] => Ok(()),
        _ => Err((
            None,
            "`at` must be two angles on a sphere: [theta, phi], from the north pole and around it"
                .to_owned(),
        )),
    }
}
