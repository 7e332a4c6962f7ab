//! What values must be, and what they ask of one another.

use core::fmt::{Debug, Display};
use core::ops::Range;
use std::collections::HashMap;

use crate::place::{InputError, Place, Placed};
use crate::{
    Galerkin, MAX_BATCH, MAX_CELLS, MAX_FORCED_STEPS, MAX_GRID, MAX_SEED, ProblemFile, Scalar,
};

/// What is wrong with a name that a terminal, a table or a picture would not show.
pub(crate) const UNPRINTABLE: &str = "a name must not have control characters or line breaks";

/// Whether a name can be shown.
pub(crate) fn is_printable(name: &str) -> bool {
    !name.contains(char::is_control)
}

impl ProblemFile {
    /// Checks every range, and what the values ask of one another.
    ///
    /// To be called after the flags of the command line have replaced values.
    pub fn validate(&self) -> Result<(), InputError> {
        self.validate_galerkin()?;
        self.problem.validate(self)?;
        self.validate_walk()?;
        self.refuse_other_walks()?;
        self.validate_targets()
    }

    /// Refuses sensitivities beside walks that tell none.
    fn refuse_other_walks(&self) -> Result<(), InputError> {
        let others = [&self.walk.global, &self.walk.adjoint];
        let mut others = others.into_iter().flatten();
        match others.find(|own| own.value && self.asks_sensitivities()) {
            None => Ok(()),
            Some(own) => Err(self.refuse(
                own,
                "sensitivities are told by walks from every target: leave `global` and `adjoint` out",
            )),
        }
    }

    /// Whether sensitivities are asked for, or [uncertainties](Self::uncertainties) to which they lead.
    pub(crate) fn asks_sensitivities(&self) -> bool {
        self.walk.sensitivities.value || !self.uncertainties.is_empty()
    }

    /// An error about what stands at `place`.
    pub fn error(&self, place: &Place, message: impl Display) -> InputError {
        let rendered = match place {
            Place::File(span) => return self.source.error(span.clone(), message),
            Place::Flag(flag) => format!("`{flag}`: {message}"),
            Place::Default => format!("{}: {message}", self.source.name),
        };
        InputError { rendered }
    }

    /// Refuses the way back, for what answers no targets.
    ///
    /// # Errors
    /// The file, or a flag, asks for it.
    pub fn refuse_adjoint(&self) -> Result<(), InputError> {
        match self.walk.adjoint.as_ref().filter(|adjoint| adjoint.value) {
            None => Ok(()),
            Some(adjoint) => Err(self.refuse(
                adjoint,
                "walks from the sources answer the targets of `solve`, and nothing else: leave `adjoint` out",
            )),
        }
    }

    /// Refuses what the tables of a device do not know: the way back, and a last step to the light that is not always made.
    ///
    /// # Errors
    /// The file, or a flag, asks for it.
    pub fn refuse_directions(&self, always_to_the_light: bool) -> Result<(), InputError> {
        self.refuse_adjoint()?;
        let last = self.walk.last_step.as_ref();
        match last.filter(|last| last.value && !always_to_the_light) {
            None => Ok(()),
            Some(last) => Err(self.refuse(
                last,
                "tables are of u itself, with no last step to the light: leave `last_step` out",
            )),
        }
    }

    /// An error about a value; one given by a flag is shown with the flag.
    pub fn refuse<T: Debug>(&self, placed: &Placed<T>, message: impl Display) -> InputError {
        match placed.place {
            // Debug, since Display writes 1e-300 with all its zeros; words of a flag are small.
            Place::Flag(flag) => {
                let value = format!("{:?}", placed.value);
                let is_word = value.len() > 3 && value.chars().all(char::is_alphabetic);
                let value = if is_word { value.to_lowercase() } else { value };
                InputError {
                    rendered: format!("`{flag} {value}`: {message}"),
                }
            }
            _ => self.error(&placed.place, message),
        }
    }

    /// An error about a value unless it is `good`.
    pub(crate) fn demand<T: Debug>(
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

    /// Checks `[galerkin]`, as far as problems do not.
    fn validate_galerkin(&self) -> Result<(), InputError> {
        let Galerkin {
            cells,
            degree,
            points,
            grading,
            shadow_cuts,
            ..
        } = &self.galerkin;
        let (most, of) = self.problem.most_degree();
        self.demand(
            degree,
            degree.value <= most,
            format_args!("`degree` must be from 0 to {most} {of}"),
        )?;
        if let Some(points) = points {
            self.demand(
                points,
                (1..=5).contains(&points.value),
                "`points` must be from 1 to 5",
            )?;
        }
        if let Some(grading) = grading {
            self.demand(
                grading,
                self.problem.has_walls(),
                "`grading` belongs to rooms",
            )?;
            self.demand(
                grading,
                (1.0..=10.0).contains(&grading.value),
                "`grading` must be from 1 (equal cells) to 10",
            )?;
        }
        if let Some(shadow_cuts) = shadow_cuts {
            self.demand(
                shadow_cuts,
                self.problem.has_walls(),
                "`shadow_cuts` belongs to rooms",
            )?;
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
        )
    }

    /// Checks the number of points of a grid.
    pub(crate) fn validate_grid(&self, points: &Placed<usize>) -> Result<(), InputError> {
        self.demand(
            points,
            (1..=MAX_GRID).contains(&points.value),
            format_args!("`grid` must be from 1 to {MAX_GRID} points"),
        )
    }

    /// Checks q0.
    fn validate_absorption(&self, absorption: &Placed<f64>) -> Result<(), InputError> {
        let value = absorption.value;
        self.demand(
            absorption,
            0.0 < value && value < 1.0,
            "`absorption` must be more than 0, or walks never end, \
             and less than 1, or they never start",
        )?;
        let single = value as f32;
        self.demand(
            absorption,
            self.walk.scalar.value != Scalar::F32 || (0.0 < single && single < 1.0),
            format_args!(
                "`absorption` is rounded to {single} in `scalar = \"f32\"`: use \"f64\", \
                 or a number further from 0 and 1"
            ),
        )
    }

    /// Checks `[walk]`.
    fn validate_walk(&self) -> Result<(), InputError> {
        let walk = &self.walk;
        if let Some(absorption) = &walk.absorption {
            self.validate_absorption(absorption)?;
        }
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
        self.demand(
            &walk.forced_steps,
            walk.forced_steps.value <= MAX_FORCED_STEPS,
            format_args!("`forced_steps` must be at most {MAX_FORCED_STEPS}"),
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
            self.demand(name, is_printable(&name.value), UNPRINTABLE)?;
            if let Some(first) = seen.insert(name.value.as_str(), &name.place) {
                let first = self.line(first);
                return Err(self.refuse(
                    name,
                    format_args!("a second target named {:?}{first}", name.value),
                ));
            }
            if let Some(component) = &target.component {
                self.demand(
                    component,
                    self.problem.has_components(),
                    "`component` belongs to systems: other problems have one unknown function",
                )?;
            }
            self.problem.validate_target(self, &target.what)?;
        }
        Ok(())
    }

    /// An error about a part of a text that stands in the file, such as a formula.
    pub fn error_within(
        &self,
        text: &Placed<String>,
        part: Range<usize>,
        message: impl Display,
    ) -> InputError {
        match &text.place {
            Place::File(span) => self.source.error_within(span, &text.value, part, message),
            _ => self.refuse(text, message),
        }
    }

    /// A remark for people on what stands at a place.
    pub(crate) fn remark(&self, place: &Place, message: impl Display) -> String {
        match place {
            Place::File(span) => {
                let line = self.source.locate(span.start).line;
                format!("{}:{line}: {message}", self.source.name)
            }
            _ => format!("{}: {message}", self.source.name),
        }
    }

    /// Says on which line a place is, if it is in the file.
    pub(crate) fn line(&self, place: &Place) -> String {
        match place {
            Place::File(span) => {
                let line = self.source.locate(span.start).line;
                format!("; the first is on line {line}")
            }
            _ => String::new(),
        }
    }
}
