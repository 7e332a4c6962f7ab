//! What values must be, and what they ask of one another.

use core::f64::consts::TAU;
use core::fmt::{Debug, Display};
use std::collections::HashMap;

use super::place::{InputError, Place, Placed};
use super::{
    Circle, Emission, Galerkin, MAX_BATCH, MAX_CELLS, MAX_GRID, MAX_SEED, ProblemFile, Scalar, What,
};

impl ProblemFile {
    /// Checks every range, and what the values ask of one another.
    ///
    /// To be called after the flags of the command line have replaced values.
    pub(crate) fn validate(&self) -> Result<(), InputError> {
        self.validate_problem()?;
        self.validate_galerkin()?;
        self.validate_walk()?;
        self.validate_targets()
    }

    /// An error about what stands at `place`.
    pub(crate) fn error(&self, place: &Place, message: impl Display) -> InputError {
        let rendered = match place {
            Place::File(span) => return self.source.error(span.clone(), message),
            Place::Flag(flag) => format!("`{flag}`: {message}"),
            Place::Default => format!("{}: {message}", self.source.name),
        };
        InputError { rendered }
    }

    /// An error about a value; one given by a flag is shown with the flag.
    pub(crate) fn refuse<T: Debug>(&self, placed: &Placed<T>, message: impl Display) -> InputError {
        match placed.place {
            // Debug, since Display writes 1e-300 with all its zeros.
            Place::Flag(flag) => InputError {
                rendered: format!("`{flag} {:?}`: {message}", placed.value),
            },
            _ => self.error(&placed.place, message),
        }
    }

    /// An error about a value unless it is `good`.
    fn demand<T: Debug>(
        &self,
        placed: &Placed<T>,
        good: bool,
        message: impl Display,
    ) -> Result<(), InputError> {
        if good {
            Ok(())
        } else {
            Err(self.refuse(placed, message))
        }
    }

    /// Checks `[problem]`.
    fn validate_problem(&self) -> Result<(), InputError> {
        let Circle {
            reflectance,
            emission,
        } = &self.problem;
        if reflectance.value.is_empty() {
            let message = "`reflectance` must have at least one number";
            return Err(self.error(&reflectance.place, message));
        }
        for rho in &reflectance.value {
            self.demand(
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
                self.emitted("constant", constant)?;
                self.emitted("amplitude", amplitude)?;
                self.demand(
                    frequency,
                    frequency.value >= 1,
                    "`frequency` must be at least 1",
                )
            }
            Emission::Arcs(arcs) if arcs.value.is_empty() => {
                Err(self.error(&arcs.place, "`emission` must have at least one number"))
            }
            Emission::Arcs(arcs) => arcs
                .value
                .iter()
                .try_for_each(|value| self.emitted("emission", value)),
        }
    }

    /// An error unless the squares of such an emission can be summed in the walks' scalar.
    fn emitted(&self, name: &str, value: &Placed<f64>) -> Result<(), InputError> {
        let (smallest, largest) = match self.walk.scalar.value {
            Scalar::F32 => (1e-30, 1e30),
            Scalar::F64 => (1e-100, 1e100),
        };
        let size = value.value.abs();
        self.demand(
            value,
            size == 0.0 || (smallest..=largest).contains(&size),
            format_args!(
                "`{name}` must be 0 or of a size between {smallest:e} and {largest:e}, or its \
                 squares leave the range of {}: choose another unit",
                super::word(&self.walk.scalar.value)
            ),
        )
    }

    /// Checks `[galerkin]`.
    fn validate_galerkin(&self) -> Result<(), InputError> {
        let Galerkin { cells, degree, .. } = &self.galerkin;
        self.demand(
            degree,
            degree.value == 0,
            "only `degree = 0`, piecewise constant functions, is in this version",
        )?;
        let reflectance = &self.problem.reflectance;
        let (arcs, unit) = match &self.problem.emission {
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
            return Err(self.error(&reflectance.place, message));
        }
        let Some(cells) = cells else { return Ok(()) };
        self.demand(cells, cells.value >= 1, "`cells` must be at least 1")?;
        self.demand(
            cells,
            cells.value <= MAX_CELLS,
            format_args!(
                "`cells` must be at most {MAX_CELLS}: \
                 beyond that the tables need more memory than this program asks for"
            ),
        )?;
        self.demand(
            cells,
            cells.value.is_multiple_of(unit),
            format_args!(
                "the number of cells must be a multiple of the {arcs}; nearest: {}",
                neighbours(cells.value, unit)
            ),
        )
    }

    /// Checks `[walk]`.
    fn validate_walk(&self) -> Result<(), InputError> {
        let walk = &self.walk;
        self.demand(
            &walk.walks,
            walk.walks.value >= 1,
            "`walks` must be at least 1",
        )?;
        let absorption = walk.absorption.value;
        self.demand(
            &walk.absorption,
            0.0 < absorption && absorption < 1.0,
            "`absorption` must be more than 0, or walks never end, \
             and less than 1, or they never start",
        )?;
        let single = absorption as f32;
        self.demand(
            &walk.absorption,
            walk.scalar.value != Scalar::F32 || (0.0 < single && single < 1.0),
            format_args!(
                "`absorption` is rounded to {single} in `scalar = \"f32\"`: use \"f64\", \
                 or a number further from 0 and 1"
            ),
        )?;
        self.demand(
            &walk.seed,
            walk.seed.value <= MAX_SEED,
            format_args!("`seed` must be at most {MAX_SEED}"),
        )?;
        self.demand(
            &walk.batch,
            (1..=MAX_BATCH).contains(&walk.batch.value),
            format_args!("`batch` must be from 1 to {MAX_BATCH}"),
        )?;
        match &walk.target_error {
            Some(error) => self.demand(
                error,
                error.value > 0.0 && error.value.is_finite(),
                "`target_error` must be a finite number more than 0",
            ),
            None if walk.relative.place != Place::Default => Err(self.error(
                &walk.relative.place,
                "`relative` does nothing without a `target_error`",
            )),
            None => Ok(()),
        }
    }

    /// Checks the targets.
    fn validate_targets(&self) -> Result<(), InputError> {
        if self.targets.is_empty() {
            return Err(self.error(
                &self.targets_place,
                "there must be at least one `[[target]]`: nothing is asked for",
            ));
        }
        let mut seen = HashMap::new();
        for target in &self.targets {
            let name = &target.name;
            self.demand(
                name,
                !name.value.trim().is_empty(),
                "the name of a target must not be empty",
            )?;
            if let Some(first) = seen.insert(name.value.as_str(), &name.place) {
                let first = self.line(first);
                return Err(self.refuse(
                    name,
                    format_args!("a second target named {:?}{first}", name.value),
                ));
            }
            self.validate_what(&target.what)?;
        }
        Ok(())
    }

    /// Checks what a target asks for.
    fn validate_what(&self, what: &What) -> Result<(), InputError> {
        match what {
            What::At(angle) => self.demand(
                angle,
                (0.0..TAU).contains(&angle.value),
                format_args!("the angle `at` must be at least 0 and less than 2 pi = {TAU}"),
            ),
            What::OverAll => Ok(()),
            What::Over(from, to) => {
                let message = format!("the angles `over` must be from 0 to 2 pi = {TAU}");
                let whole = 0.0..=TAU;
                self.demand(from, whole.contains(&from.value), &message)?;
                self.demand(to, whole.contains(&to.value), &message)?;
                self.demand(
                    to,
                    from.value < to.value,
                    "the second angle of `over` must be more than the first",
                )
            }
            What::Grid(points) => self.demand(
                points,
                (1..=MAX_GRID).contains(&points.value),
                format_args!("`grid` must be from 1 to {MAX_GRID} points"),
            ),
        }
    }

    /// Says on which line a place is, if it is in the file.
    fn line(&self, place: &Place) -> String {
        match place {
            Place::File(span) => {
                let line = self.source.locate(span.start).line;
                format!("; the first is on line {line}")
            }
            _ => String::new(),
        }
    }
}

/// "1 arc", "2 arcs".
fn counted(arcs: usize) -> String {
    let plural = if arcs == 1 { "" } else { "s" };
    format!("{arcs} arc{plural}")
}

/// The smallest number which both numbers divide; both are at least 1.
pub(crate) fn common_multiple(a: usize, b: usize) -> usize {
    let (mut divisor, mut rest) = (a, b);
    while rest != 0 {
        (divisor, rest) = (rest, divisor % rest);
    }
    (a / divisor).saturating_mul(b)
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
