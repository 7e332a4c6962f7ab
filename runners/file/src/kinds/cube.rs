//! `[problem]` with `kind = "cube"`, and what it asks of the rest of the file.

use std::sync::Arc;

use fredholm::cube::CubeModel;
use fredholm::{Ask, Error, Region, Subject, Target};
use toml::de::DeValue;

use super::functions::formulas;
use super::{Kind, KindEntry, shared};
use crate::model::{NOTHING, grid};
use crate::place::{InputError, Place, Placed};
use crate::points::numbers;
use crate::section::{Field, Section};
use crate::{MAX_GRID, ProblemFile, Resolution, Scalar, What};
use fredholm_formula::{self as formula, Variables};

pub(super) const ENTRY: KindEntry = KindEntry {
    word: "cube",
    about: "Any kernel on [0, 1]^d or another product of intervals, as a formula",
    template: include_str!("../../templates/cube.toml"),
    read: |section| shared(read(section)),
};

/// Microseconds of a formula from which on a set-up takes seconds.
const SLOW: f64 = 5.0;
/// The largest dimension: every one has walks of its own.
const MAX_DIMENSION: usize = 6;

/// An equation on [0, 1]^d or another product of intervals: `[problem]` with `kind = "cube"`.
#[derive(Clone, Debug, PartialEq)]
pub struct Cube {
    /// d.
    pub dimension: Placed<usize>,
    /// The interval of every axis; without it, [0, 1].
    pub domain: Option<Placed<Vec<Placed<[f64; 2]>>>>,
    /// K.
    pub kernel: KernelText,
    /// ∫ K(x, t) dt up to y, as the kernel is written: for kernels with a kink or a jump at x = y.
    pub integral: Option<KernelText>,
    /// F.
    pub source: Placed<String>,
    /// u, where it is known.
    pub solution: Option<Placed<String>>,
}

/// A kernel, or its integral, as formulas.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum KernelText {
    /// One formula in all coordinates.
    General(Placed<String>),
    /// A product of one formula in x and y for each axis.
    Factors(Placed<Vec<Placed<String>>>),
}

/// Reads the rest of `[problem]` for a cube.
fn read(mut section: Section<'_, '_>) -> Result<Cube, InputError> {
    let dimension = section.required("dimension")?.integer()?;
    let domain = section.optional("domain");
    let (kernel, factors) = (
        section.optional("kernel"),
        section.optional("kernel_factors"),
    );
    let integral = section.optional("kernel_integral");
    let source = section.required("source")?.string()?;
    let solution = section.optional("solution");
    section.finish()?;
    let kernel = match (kernel, factors) {
        (Some(kernel), None) => KernelText::General(kernel.string()?),
        (None, Some(factors)) => KernelText::Factors(factors.strings()?),
        (Some(_), Some(factors)) => {
            return Err(section.source.error(
                factors.key.clone(),
                "there is `kernel` besides: give one of `kernel` and `kernel_factors`",
            ));
        }
        (None, None) => {
            return Err(section.error("`kernel` (or `kernel_factors`) is missing in `[problem]`"));
        }
    };
    Ok(Cube {
        dimension,
        domain: domain.map(|field| field.pairs()).transpose()?,
        kernel,
        integral: integral.map(read_integral).transpose()?,
        source,
        solution: solution.map(|field| field.string()).transpose()?,
    })
}

fn read_integral(field: Field<'_, '_>) -> Result<KernelText, InputError> {
    match field.value {
        DeValue::Array(_) => field.strings().map(KernelText::Factors),
        _ => field.string().map(KernelText::General),
    }
}

impl Cube {
    /// Where the formula stands of which an error speaks first, between backticks.
    fn formula(&self, what: &str) -> Option<Place> {
        let name = what.split('`').nth(1)?;
        let (name, axis) = match name.strip_suffix(']').and_then(|name| name.split_once('[')) {
            Some((name, axis)) => (name, axis.parse().ok()?),
            None => (name, 0),
        };
        let of = |text: &KernelText| match text {
            KernelText::General(text) => Some(text.place.clone()),
            KernelText::Factors(texts) => Some(texts.value.get(axis)?.place.clone()),
        };
        match name {
            "kernel" | "kernel_factors" => of(&self.kernel),
            "source" => Some(self.source.place.clone()),
            "solution" => Some(self.solution.as_ref()?.place.clone()),
            _ => None,
        }
    }

    /// The names in functions of two points.
    fn pair(&self) -> Variables {
        Variables {
            dimension: self.dimension.value,
            two: true,
        }
    }

    /// The names in functions of one point.
    fn point(&self) -> Variables {
        Variables {
            two: false,
            ..self.pair()
        }
    }

    /// The ends of every axis' interval; none for [0, 1]^d.
    pub(super) fn ends(&self) -> Vec<[f64; 2]> {
        let domain = self.domain.iter().flat_map(|domain| &domain.value);
        domain.map(|ends| ends.value).collect()
    }

    /// The ends of the interval of an axis.
    fn interval(&self, axis: usize) -> [f64; 2] {
        let domain = self
            .domain
            .as_ref()
            .and_then(|domain| domain.value.get(axis));
        domain.map_or([0.0, 1.0], |ends| ends.value)
    }

    fn validate_domain(
        &self,
        file: &ProblemFile,
        domain: &Placed<Vec<Placed<[f64; 2]>>>,
    ) -> Result<(), InputError> {
        let (d, found) = (self.dimension.value, domain.value.len());
        if found != d {
            let message = format!("`domain` must have {d} intervals, one an axis, not {found}");
            return Err(file.error(&domain.place, message));
        }
        // As walks hold them: f32 may make an interval empty.
        let held = |value: f64| match file.walk.scalar.value {
            Scalar::F32 => f64::from(value as f32),
            Scalar::F64 => value,
        };
        domain.value.iter().try_for_each(|ends| {
            let [low, high] = ends.value.map(held);
            let length = high - low;
            let message = "an interval of `domain` must be `[from, to]`, the lower end first, and not too short or too \
                           long for the scalar of the walks";
            let good = length > 0.0 && length.is_finite() && length > 1e-5 * low.abs().max(high.abs());
            file.demand(ends, good, message)
        })
    }

    /// Refuses what is no point of the domain.
    fn check_point(&self, x: &[f64]) -> Result<(), (Option<usize>, String)> {
        let dimension = self.dimension.value;
        if x.len() != dimension {
            let plural = if dimension == 1 { "" } else { "s" };
            return Err((
                None,
                format!("`at` must have {dimension} coordinate{plural}"),
            ));
        }
        for (axis, &x) in x.iter().enumerate() {
            let [low, high] = self.interval(axis);
            if !(low..=high).contains(&x) {
                let message = format!("a coordinate must be from {low} to {high}");
                return Err((Some(axis), message));
            }
        }
        Ok(())
    }

    fn validate_lattice(
        &self,
        file: &ProblemFile,
        points: &Placed<Vec<Placed<usize>>>,
    ) -> Result<(), InputError> {
        let (d, found) = (self.dimension.value, points.value.len());
        if found != d {
            let message =
                format!("`grid` must have {d} numbers of points, one an axis, not {found}");
            return Err(file.error(&points.place, message));
        }
        points
            .value
            .iter()
            .try_for_each(|points| file.validate_grid(points))?;
        let all = points.value.iter().map(|points| points.value);
        if all.fold(1, usize::saturating_mul) > MAX_GRID {
            let message = format!("`grid` must be at most {MAX_GRID} points in all");
            return Err(file.error(&points.place, message));
        }
        Ok(())
    }

    /// All points of a grid, those of the last axis next to each other.
    fn lattice(&self, points: &[Placed<usize>]) -> Vec<Ask> {
        let mut all = vec![Vec::new()];
        for (axis, points) in points.iter().enumerate() {
            let [low, high] = self.interval(axis);
            let last = points.value.saturating_sub(1).max(1) as f64;
            let on_axis = (0..points.value).map(|i| i as f64 / last);
            let on_axis: Vec<f64> = on_axis.map(|t| (1.0 - t) * low + t * high).collect();
            let longer = |x: &Vec<f64>| {
                let x = x.clone();
                on_axis
                    .iter()
                    .map(move |&next| [x.as_slice(), &[next]].concat())
            };
            all = all.iter().flat_map(longer).collect();
        }
        let regions = all.into_iter().map(Region::Point);
        regions.map(Ask::One).collect()
    }

    fn validate_kernel(
        &self,
        file: &ProblemFile,
        name: &str,
        kernel: &KernelText,
    ) -> Result<(), InputError> {
        match kernel {
            KernelText::General(text) => formula_is_good(file, text, self.pair()),
            KernelText::Factors(factors) => {
                let (d, found) = (self.dimension.value, factors.value.len());
                if found != d {
                    let message =
                        format!("`{name}` must have {d} formulas, one an axis, not {found}");
                    return Err(file.error(&factors.place, message));
                }
                let mut factors = factors.value.iter();
                factors.try_for_each(|text| formula_is_good(file, text, Variables::FACTOR))
            }
        }
    }

    fn validate_integral(
        &self,
        file: &ProblemFile,
        integral: &KernelText,
    ) -> Result<(), InputError> {
        match (&self.kernel, integral) {
            (KernelText::General(_), KernelText::General(text)) if self.dimension.value > 1 => {
                Err(file.error(
                    &text.place,
                    "in more than one dimension `kernel_integral` belongs to `kernel_factors`",
                ))
            }
            (KernelText::General(_), KernelText::Factors(texts)) => Err(file.error(
                &texts.place,
                "`kernel_integral` must be one formula, as `kernel` is",
            )),
            (KernelText::Factors(_), KernelText::General(text)) => Err(file.error(
                &text.place,
                "`kernel_integral` must be an array of one formula an axis, as `kernel_factors` is",
            )),
            _ => self.validate_kernel(file, "kernel_integral", integral),
        }
    }
}

impl Kind for Cube {
    fn as_cube(&self) -> Option<&Self> {
        Some(self)
    }

    fn validate(&self, file: &ProblemFile) -> Result<(), InputError> {
        let dimension = self.dimension.value;
        file.demand(
            &self.dimension,
            (1..=MAX_DIMENSION).contains(&dimension),
            format_args!("`dimension` must be from 1 to {MAX_DIMENSION}"),
        )?;
        if let Some(domain) = &self.domain {
            self.validate_domain(file, domain)?;
        }
        self.validate_kernel(file, "kernel_factors", &self.kernel)?;
        if let Some(integral) = &self.integral {
            self.validate_integral(file, integral)?;
        }
        formula_is_good(file, &self.source, self.point())?;
        if let Some(solution) = &self.solution {
            formula_is_good(file, solution, self.point())?;
        }
        Ok(())
    }

    fn validate_target(&self, file: &ProblemFile, what: &What) -> Result<(), InputError> {
        let dimension = self.dimension.value;
        match what {
            What::At(at) => file.validate_point(at, |x| self.check_point(x)),
            What::OverAll | What::Listed(_) => Ok(()),
            What::Over(from, _) => Err(file.error(
                &from.place,
                "a part of a cube is not offered: use `over = \"all\"` or a `weight`",
            )),
            What::Weight(text) => formula_is_good(file, text, self.point()),
            What::OverSurface(word) => Err(file.error(
                &word.place,
                "`over` must be \"all\"; for a part of a cube use a `weight`",
            )),
            What::Facing(_, facing) => Err(file.error(&facing.place, "`facing` belongs to scenes")),
            What::Grid(_, Some(surface)) | What::On(surface, _) | What::Spot(surface, _) => {
                Err(file.error(
                    &surface.place,
                    "a cube has no surfaces: they belong to rooms",
                ))
            }
            What::OverSurfaces(words) => Err(file.error(
                &words.place,
                "`over` must be \"all\"; for a part of a cube use a `weight`",
            )),
            What::Grid(points, None) => {
                let message = format!(
                    "in {dimension} dimensions a `grid` needs a number of points for each: [{}]",
                    vec![points.value.to_string(); dimension].join(", ")
                );
                file.demand(points, dimension == 1, message)?;
                file.validate_grid(points)
            }
            What::Lattice(points) => self.validate_lattice(file, points),
        }
    }

    fn most_degree(&self) -> (usize, &'static str) {
        if self.dimension.value <= 3 {
            (4, "on a cube of up to 3 dimensions")
        } else {
            (2, "on a cube of more than 3 dimensions")
        }
    }

    fn resolve(&self, file: &ProblemFile) -> Result<(Resolution, Vec<Target>), InputError> {
        let mut weights = Vec::new();
        let targets = file.ask(|what| {
            let region = match what {
                What::At(at) => Region::Point(at.value.iter().map(|x| x.value).collect()),
                What::OverAll => Region::Whole,
                What::Weight(text) => {
                    weights.push(text.value.clone());
                    Region::Weight(weights.len() - 1)
                }
                What::Grid(points, _) => return Ok(grid(points, None)),
                What::Lattice(points) => return Ok(self.lattice(&points.value)),
                What::Listed(path) => {
                    return file.listed(path, &mut |fields| {
                        let x = numbers(fields)?;
                        self.check_point(&x).map_err(|(_, message)| message)?;
                        Ok(Region::Point(x))
                    });
                }
                _ => return Ok(NOTHING),
            };
            Ok(vec![Ask::One(region)])
        })?;
        let model = CubeModel::new(Arc::new(formulas(self, weights)));
        Ok((Resolution::Other(Box::new(model)), targets))
    }

    /// A value that is not finite is shown at its formula.
    fn explain(&self, file: &ProblemFile, error: &Error) -> Option<InputError> {
        let Error::NotFinite { what } = error else {
            return None;
        };
        Some(file.error(&self.formula(what)?, error))
    }

    fn remarks(&self, file: &ProblemFile) -> Vec<String> {
        let texts = match &self.kernel {
            KernelText::General(text) => core::slice::from_ref(text),
            KernelText::Factors(texts) => texts.value.as_slice(),
        };
        let slow = texts.iter().filter_map(|text| {
            let micros = 1e6 * formula::seconds(&text.value);
            let message = format!(
                "a value of this formula takes about {micros:.0} microseconds, and setting up asks for thousands of them"
            );
            (micros > SLOW).then(|| file.remark(&text.place, message))
        });
        slow.collect()
    }

    fn place(&self, subject: Subject) -> Option<Place> {
        let Subject::KernelIntegral(axis) = subject else {
            return None;
        };
        Some(match self.integral.as_ref()? {
            KernelText::General(text) => text.place.clone(),
            KernelText::Factors(texts) => match texts.value.get(axis) {
                Some(text) => text.place.clone(),
                None => texts.place.clone(),
            },
        })
    }
}

/// Checks a formula.
fn formula_is_good(
    file: &ProblemFile,
    text: &Placed<String>,
    variables: Variables,
) -> Result<(), InputError> {
    formula::check(&text.value, variables)
        .map_err(|error| file.error_within(text, error.span, error.message))
}
