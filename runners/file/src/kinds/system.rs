//! `[problem]` with `kind = "system"`, and what it asks of the rest of the file.

use crate::formula::Formula;
use fredholm::system::{MOST_COMPONENTS, MOST_DIMENSIONS, SystemModel};
use fredholm::{Error, Region, Scalar, Target};

use super::parameters::{derivatives, unused};
use super::space::{Space, check_formula};
use super::{Kind, KindEntry, shared};
use crate::place::{InputError, Place, Placed};
use crate::section::{Field, Section};
use crate::{ProblemFile, Resolution, What};

pub(super) const ENTRY: KindEntry = KindEntry {
    word: "system",
    about: "Several equations for as many unknown functions, as formulas",
    template: include_str!("../../templates/system.toml"),
    has_channels: false,
    read: |section| shared(read(section)),
};

/// Several equations for as many functions on a product of intervals: `[problem]` with `kind = "system"`.
#[derive(Clone, Debug, PartialEq)]
pub struct System {
    /// Dimension, domain, and numbers with names.
    pub space: Space,
    /// The equations.
    pub equations: Placed<Vec<SystemEquation>>,
}

/// One of the equations: `[[problem.equation]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct SystemEquation {
    /// K_i1 … K_im.
    pub kernel: Placed<Vec<Placed<String>>>,
    /// F_i.
    pub source: Placed<String>,
    /// u_i, where it is known.
    pub solution: Option<Placed<String>>,
}

/// Reads the rest of `[problem]` for a system.
fn read(mut section: Section<'_, '_>) -> Result<System, InputError> {
    let space = Space::read(&mut section)?;
    let equations = section.required("equation")?;
    section.finish()?;
    let all = equations.tables("in `[[problem.equation]]`", |mut section| {
        let equation = SystemEquation {
            kernel: section.required("kernel")?.strings()?,
            source: section.required("source")?.string()?,
            solution: section.read("solution", Field::string)?,
        };
        section.finish()?;
        Ok(equation)
    });
    Ok(System {
        space,
        equations: Placed::file(equations.span.clone(), all?),
    })
}

impl System {
    fn all(&self) -> &[SystemEquation] {
        &self.equations.value
    }

    fn validate_equation(
        &self,
        file: &ProblemFile,
        equation: &SystemEquation,
    ) -> Result<(), InputError> {
        let (point, pair) = (self.space.point(), self.space.pair());
        let (m, found) = (self.all().len(), equation.kernel.value.len());
        if found != m {
            let message = format!(
                "`kernel` must have {m} formulas, one for each `[[problem.equation]]`, not {found}"
            );
            return Err(file.error(&equation.kernel.place, message));
        }
        for text in &equation.kernel.value {
            check_formula(file, text, pair)?;
        }
        check_formula(file, &equation.source, point)?;
        match &equation.solution {
            Some(solution) => check_formula(file, solution, point),
            None if self.all().iter().any(|other| other.solution.is_some()) => Err(file.error(
                &equation.source.place,
                "a `solution` is missing: give that of every equation, or of none",
            )),
            None => Ok(()),
        }
    }

    fn validate_component(
        &self,
        file: &ProblemFile,
        target: &crate::Target,
    ) -> Result<(), InputError> {
        let m = self.all().len();
        let Some(component) = &target.component else {
            let message = format!(
                "a target of a system needs its `component`, the number of an equation, from 1 to {m}"
            );
            return Err(file.error(&target.name.place, message));
        };
        file.demand(
            component,
            (1..=m).contains(&component.value),
            format_args!("`component` must be the number of an equation, from 1 to {m}"),
        )
    }

    fn formula(&self, text: &Placed<String>) -> Result<Formula<f64>, Error> {
        Formula::new(&text.value, &self.space.parameters.value)
            .map_err(|_| Error::Internal("a formula that was not checked"))
    }

    /// The formulas as functions.
    fn model(&self) -> Result<SystemModel, Error> {
        let (mut kernels, mut sources, mut solutions) = (Vec::new(), Vec::new(), Vec::new());
        for own in self.all() {
            let row = own.kernel.value.iter().map(|text| self.formula(text));
            kernels.push(row.collect::<Result<Vec<_>, _>>()?);
            sources.push(self.formula(&own.source)?);
            let solution = own.solution.as_ref().map(|text| self.formula(text));
            solutions.extend(solution.transpose()?);
        }
        let all = kernels.iter().flatten().map(Formula::seconds).sum::<f64>();
        let mean = all / self.all().len().pow(2) as f64;
        let model = SystemModel::new(
            self.space.intervals(),
            self.all().len(),
            move |[i, j], x, y| kernels[i][j].value(x, y),
            move |i, x| sources[i].value(x, &[]),
        )
        .with_seconds(mean)
        .with_edges(self.space.edges());
        Ok(match solutions.is_empty() {
            true => model,
            false => model.with_solution(move |i, x| solutions[i].value(x, &[])),
        })
    }
}

impl Kind for System {
    fn has_components(&self) -> bool {
        true
    }

    fn validate(&self, file: &ProblemFile) -> Result<(), InputError> {
        self.space.validate(file, MOST_DIMENSIONS)?;
        let m = self.all().len();
        if !(1..=MOST_COMPONENTS).contains(&m) {
            let message = format!("a system has from 1 to {MOST_COMPONENTS} equations, not {m}");
            return Err(file.error(&self.equations.place, message));
        }
        for equation in self.all() {
            self.validate_equation(file, equation)?;
        }
        for target in &file.targets {
            self.validate_component(file, target)?;
        }
        file.demand(
            &file.walk.scalar,
            file.walk.scalar.value == Scalar::F64,
            "systems are walked in f64",
        )
    }

    fn validate_target(&self, file: &ProblemFile, what: &What) -> Result<(), InputError> {
        self.space.validate_target(file, what, "a system")
    }

    fn space(&self) -> Option<&Space> {
        Some(&self.space)
    }

    fn most_degree(&self) -> (usize, &'static str) {
        (4, "of a system")
    }

    fn resolve(&self, file: &ProblemFile) -> Result<(Resolution, Vec<Target>), InputError> {
        let point = |mut x: Vec<f64>, component: usize| {
            x.push((component + 1) as f64);
            Region::Point(x)
        };
        let (targets, weights) = self.space.targets(file, &point, &Region::Part)?;
        let fail = |error| file.explain(&error);
        let mut model = self.model().map_err(fail)?;
        let kernels = self.all().iter().map(|own| {
            let row = own.kernel.value.iter();
            row.map(core::slice::from_ref).collect()
        });
        let kernels: Vec<Vec<&[Placed<String>]>> = kernels.collect();
        let sources: Vec<&Placed<String>> = self.all().iter().map(|own| &own.source).collect();
        if let Some(derivatives) = derivatives(file, &self.space, &kernels, &sources)? {
            model = model.with_derivatives(derivatives);
        }
        for (text, component) in weights {
            let weight = self.formula(&text).map_err(fail)?;
            model = model.weight(&text.value, component, move |x| weight.value(x, &[]));
        }
        Ok((Resolution::Other(Box::new(model)), targets))
    }

    /// A value that is not finite is shown at its formula: `source` or `kernel[j]` "of equation i".
    fn explain(&self, file: &ProblemFile, error: &Error) -> Option<InputError> {
        let Error::NotFinite { what } = error else {
            return None;
        };
        let name = what.split('`').nth(1)?;
        let number = what.split("of equation ").nth(1)?.split(' ').next()?;
        let equation = self
            .all()
            .get(number.parse::<usize>().ok()?.checked_sub(1)?)?;
        let place: &Place = match name
            .strip_prefix("kernel[")
            .and_then(|j| j.strip_suffix(']'))
        {
            Some(j) => &equation.kernel.value.get(j.parse::<usize>().ok()?)?.place,
            None => &equation.source.place,
        };
        Some(file.error(place, error))
    }

    fn remarks(&self, file: &ProblemFile) -> Vec<String> {
        unused(file, &self.space.parameters).into_iter().collect()
    }
}
