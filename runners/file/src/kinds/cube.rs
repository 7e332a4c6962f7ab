//! `[problem]` with `kind = "cube"`, and what it asks of the rest of the file.

use std::sync::Arc;

use crate::formula::{Formula, Variables};
use fredholm::cube::CubeModel;
use fredholm::{Error, Region, Target};

use super::functions::Formulas;
use super::parameters::{derivatives, unused};
use super::space::{Space, check_formula};
use super::{Kind, KindEntry, shared};
use crate::place::{InputError, Place, Placed};
use crate::section::{Field, Section};
use crate::{ProblemFile, Resolution, What};

pub(super) const ENTRY: KindEntry = KindEntry {
    word: "cube",
    about: "Any kernel on [0, 1]^d or another product of intervals, as a formula",
    template: include_str!("../../templates/cube.toml"),
    has_channels: false,
    read: |section| shared(read(section)),
};

/// Microseconds of a formula from which on a set-up takes seconds.
const SLOW: f64 = 5.0;
/// The largest dimension: every one has walks of its own.
const MAX_DIMENSION: usize = 6;

/// An equation on [0, 1]^d or another product of intervals: `[problem]` with `kind = "cube"`.
#[derive(Clone, Debug, PartialEq)]
pub struct Cube {
    /// Dimension, domain, and numbers with names.
    pub space: Space,
    /// K.
    pub kernel: KernelText,
    /// F.
    pub source: Placed<String>,
    /// u, where it is known.
    pub solution: Option<Placed<String>>,
}

/// A kernel, as formulas.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum KernelText {
    /// One formula in all coordinates.
    General(Placed<String>),
    /// A product of one formula in x and y for each axis.
    Factors(Placed<Vec<Placed<String>>>),
}

impl KernelText {
    /// The formula, or those of all axes.
    pub(super) fn texts(&self) -> &[Placed<String>] {
        match self {
            Self::General(text) => core::slice::from_ref(text),
            Self::Factors(texts) => &texts.value,
        }
    }
}

/// Reads the rest of `[problem]` for a cube.
fn read(mut section: Section<'_, '_>) -> Result<Cube, InputError> {
    let space = Space::read(&mut section)?;
    let (kernel, factors) = (
        section.optional("kernel"),
        section.optional("kernel_factors"),
    );
    let source = section.required("source")?.string()?;
    let solution = section.read("solution", Field::string)?;
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
        space,
        kernel,
        source,
        solution,
    })
}

impl Cube {
    /// Where the formula stands of which an error speaks first, between backticks.
    fn formula(&self, what: &str) -> Option<Place> {
        let name = what.split('`').nth(1)?;
        let (name, axis) = match name.strip_suffix(']').and_then(|name| name.split_once('[')) {
            Some((name, axis)) => (name, axis.parse().ok()?),
            None => (name, 0),
        };
        match name {
            "kernel" | "kernel_factors" => Some(self.kernel.texts().get(axis)?.place.clone()),
            "source" => Some(self.source.place.clone()),
            "solution" => Some(self.solution.as_ref()?.place.clone()),
            _ => None,
        }
    }

    fn validate_kernel(&self, file: &ProblemFile) -> Result<(), InputError> {
        match &self.kernel {
            KernelText::General(text) => check_formula(file, text, self.space.pair()),
            KernelText::Factors(factors) => {
                let (d, found) = (self.space.dimension.value, factors.value.len());
                if found != d {
                    let message = format!(
                        "`kernel_factors` must have {d} formulas, one an axis, not {found}"
                    );
                    return Err(file.error(&factors.place, message));
                }
                let variables = Variables {
                    dimension: 1,
                    ..self.space.pair()
                };
                let mut factors = factors.value.iter();
                factors.try_for_each(|text| check_formula(file, text, variables))
            }
        }
    }
}

impl Kind for Cube {
    fn validate(&self, file: &ProblemFile) -> Result<(), InputError> {
        self.space.validate(file, MAX_DIMENSION)?;
        self.validate_kernel(file)?;
        check_formula(file, &self.source, self.space.point())?;
        if let Some(solution) = &self.solution {
            check_formula(file, solution, self.space.point())?;
        }
        Ok(())
    }

    fn validate_target(&self, file: &ProblemFile, what: &What) -> Result<(), InputError> {
        self.space.validate_target(file, what, "a cube")
    }

    fn space(&self) -> Option<&Space> {
        Some(&self.space)
    }

    fn most_degree(&self) -> (usize, &'static str) {
        if self.space.dimension.value <= 3 {
            (4, "on a cube of up to 3 dimensions")
        } else {
            (2, "on a cube of more than 3 dimensions")
        }
    }

    fn resolve(&self, file: &ProblemFile) -> Result<(Resolution, Vec<Target>), InputError> {
        let (targets, weights) =
            (self.space).targets(file, &|x, _| Region::Point(x), &|_| Region::Whole)?;
        let weights = weights.into_iter().map(|(text, _)| text.value).collect();
        let formulas = Formulas {
            cube: self.clone(),
            domain: self.space.ends(),
            weights,
        };
        let model = CubeModel::new(Arc::new(formulas)).with_edges(self.space.edges());
        let model = match derivatives(
            file,
            &self.space,
            &[vec![self.kernel.texts()]],
            &[&self.source],
        )? {
            Some(derivatives) => model.with_derivatives(derivatives),
            None => model,
        };
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
        let slow = self.kernel.texts().iter().filter_map(|text| {
            let compiled = Formula::<f64>::new(&text.value, &self.space.parameters.value);
            let micros = 1e6 * compiled.map_or(0.0, |compiled| compiled.seconds());
            let message = format!(
                "a value of this formula takes about {micros:.0} microseconds, and setting up asks for thousands of them"
            );
            (micros > SLOW).then(|| file.remark(&text.place, message))
        });
        slow.chain(unused(file, &self.space.parameters)).collect()
    }
}
