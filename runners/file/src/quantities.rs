//! The quantities of an equation by their names: how well they are known, which are looked for, and other values of theirs.

use core::ops::Range;
use core::time::Duration;

use fredholm::report::Report;
use fredholm::{
    Error, Fit, Fitting, Measured, Measurement, Model, Quantity, Settings, SolveError,
    SolveObserver, Solver, Subject, Uncertainty, Unknown,
};
use toml::de::{DeTable, DeValue};

use crate::place::{InputError, Placed};
use crate::section::{Field, Section, listed, nearest};
use crate::{ProblemFile, read};

/// How well a quantity is known: `[uncertainties]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Precision {
    /// The standard error, in the unit of the quantity.
    Absolute(f64),
    /// The standard error as a share of the quantity.
    Relative(f64),
}

/// A quantity that is uncertain: a line of `[uncertainties]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Uncertain {
    /// The name of the quantity.
    pub quantity: Placed<String>,
    /// How well it is known.
    pub precision: Placed<Precision>,
}

/// What a target was measured as: `measured`.
#[derive(Clone, Debug, PartialEq)]
pub struct Given {
    /// What of the target was measured.
    pub what: Measured,
    /// The number.
    pub value: Placed<f64>,
    /// The standard error of the number.
    pub error: Placed<f64>,
}

/// Reads `[uncertainties]`.
pub(crate) fn read_uncertainties(field: &Field<'_, '_>) -> Result<Vec<Uncertain>, InputError> {
    let DeValue::Table(table) = &field.value else {
        let wanted =
            "a table of standard errors, such as `\"floor emissivity\" = 0.02` or `k = \"5 %\"`";
        return Err(field.mistyped(wanted));
    };
    let mut all = Vec::new();
    for (key, value) in table {
        let quantity = Placed::file(key.span(), key.get_ref().to_string());
        let own = Field {
            source: field.source,
            name: quantity.value.clone(),
            key: key.span(),
            span: value.span(),
            value: value.get_ref().clone(),
        };
        let precision = match &own.value {
            DeValue::String(text) => {
                let number = text.trim().strip_suffix('%').map(str::trim_end);
                let share = number.and_then(|number| number.parse::<f64>().ok());
                share.map(|share| Precision::Relative(share / 100.0))
            }
            _ => Some(Precision::Absolute(own.number()?.value)),
        };
        let is_good = |precision: &Precision| match precision {
            Precision::Absolute(error) | Precision::Relative(error) => {
                *error > 0.0 && error.is_finite()
            }
        };
        let precision = precision.filter(is_good).ok_or_else(|| {
            own.error("a standard error is a number above 0, or a share such as \"5 %\"")
        })?;
        all.push(Uncertain {
            quantity,
            precision: Placed::file(own.span, precision),
        });
    }
    // The tree is sorted by key.
    all.sort_by_key(|own| match &own.precision.place {
        crate::Place::File(span) => span.start,
        _ => 0,
    });
    Ok(all)
}

/// Reads `[fit]`.
pub(crate) fn read_fit(mut section: Section<'_, '_>) -> Result<Vec<Placed<String>>, InputError> {
    let quantities = section.read("quantities", Field::strings)?;
    section.finish()?;
    Ok(quantities.map_or(Vec::new(), |quantities| quantities.value))
}

/// Reads `measured` of a target.
pub(crate) fn read_measured(field: Field<'_, '_>) -> Result<Given, InputError> {
    let mut section = field.section("in `measured`")?;
    let value = section.read("value", Field::number)?;
    let temperature = section.read("temperature", Field::number)?;
    let error = section.required("error")?.number()?;
    section.finish()?;
    let (what, value) = match (value, temperature) {
        (Some(value), None) => (Measured::Value, value),
        (None, Some(temperature)) => (Measured::Temperature, temperature),
        _ => {
            return Err(section.error(
                "give what was measured: `value`, in the unit of u, or `temperature`, in kelvin, and its standard `error`",
            ));
        }
    };
    Ok(Given { what, value, error })
}

impl ProblemFile {
    /// The quantity of this name.
    fn quantity<'q>(
        &self,
        all: &'q [Quantity],
        name: &Placed<String>,
    ) -> Result<&'q Quantity, InputError> {
        if let Some(own) = all.iter().find(|own| own.name == name.value) {
            return Ok(own);
        }
        let names: Vec<&str> = all.iter().map(|own| own.name.as_str()).collect();
        let message = match nearest(&name.value, &names) {
            Some(known) => format!("there is no quantity {:?}; did you mean {known:?}?", name.value),
            None if names.is_empty() => {
                "this problem has no quantities: a formula's are the numbers of `[problem.parameters]`".to_owned()
            }
            None => format!(
                "there is no quantity {:?}: there are {}",
                name.value,
                listed(&names, '"', "and")
            ),
        };
        Err(self.error(&name.place, message))
    }

    /// The standard errors of quantities, as `[uncertainties]` has them.
    ///
    /// # Errors
    /// A quantity is none of the model, or a share is of one without a value.
    pub fn uncertainties(&self, model: &dyn Model) -> Result<Vec<Uncertainty>, InputError> {
        if self.uncertainties.is_empty() {
            return Ok(Vec::new());
        }
        let all = model.quantities();
        let one = |own: &Uncertain| {
            let quantity = self.quantity(&all, &own.quantity)?;
            let std_error = match own.precision.value {
                Precision::Absolute(error) => error,
                Precision::Relative(share) => {
                    let value = quantity.value.filter(|value| *value != 0.0);
                    share * value.map(f64::abs).ok_or_else(|| {
                        let message = "a share is of one value other than 0: give a number in the unit of the quantity";
                        self.error(&own.precision.place, message)
                    })?
                }
            };
            Ok(Uncertainty {
                quantity: own.quantity.value.clone(),
                std_error,
            })
        };
        self.uncertainties.iter().map(one).collect()
    }

    /// Says what a target was measured as, in place of what the file says of it.
    ///
    /// # Errors
    /// There is no target of this name, or the error is none.
    pub fn measure(
        &mut self,
        target: &str,
        what: Measured,
        (value, error): (f64, f64),
    ) -> Result<(), InputError> {
        const MEASURED: &str = "measured";
        let names: Vec<String> = self
            .targets
            .iter()
            .map(|own| own.name.value.clone())
            .collect();
        let Some(own) = self.targets.iter_mut().find(|own| own.name.value == target) else {
            return Err(InputError::new(format_args!(
                "{MEASURED}: there is no target {target:?}: there are {}",
                listed(&names, '"', "and")
            )));
        };
        own.measured = Some(Given {
            what,
            value: Placed::flag(MEASURED, value),
            error: Placed::flag(MEASURED, error),
        });
        Ok(())
    }

    /// The quantities that `[fit]` looks for, the measurements of targets, and what is uncertain besides.
    ///
    /// # Errors
    /// What is missing, or is none of the model.
    pub fn fitting(&self, model: &dyn Model) -> Result<Fitting, InputError> {
        let all = model.quantities();
        let mut uncertainties = self.uncertainties(model)?;
        if self.fit.is_empty() {
            let names: Vec<&str> = all.iter().map(|own| own.name.as_str()).collect();
            let there = listed(&names, '"', "and");
            return Err(InputError::new(format_args!(
                "{}: name what is looked for, `quantities = [\"…\"]` in `[fit]`: there are {there}",
                self.source.name,
            )));
        }
        let mut unknowns = Vec::new();
        for name in &self.fit {
            let quantity = self.quantity(&all, name)?.clone();
            if self.number_of(&name.value)?.is_none() {
                let message = format_args!(
                    "the value of {:?} does not stand in the file as one number: write it there, in its `[[problem.surface]]`",
                    name.value
                );
                return Err(self.error(&name.place, message));
            }
            let known = uncertainties
                .iter()
                .position(|own| own.quantity == name.value);
            let known_to = known.map(|number| uncertainties.remove(number).std_error);
            unknowns.push(Unknown { quantity, known_to });
        }
        let mut measurements = Vec::new();
        for target in &self.targets {
            let Some(given) = &target.measured else {
                continue;
            };
            self.demand(
                &given.error,
                given.error.value > 0.0,
                "a standard error is above 0",
            )?;
            measurements.push(Measurement {
                target: target.name.value.clone(),
                what: given.what,
                value: given.value.value,
                std_error: given.error.value,
            });
        }
        if measurements.is_empty() {
            let message = "no target is measured: give `measured = { value = 0.31, error = 0.01 }`, or `temperature` in place of \
                           `value`, in `[[target]]`";
            return Err(self.error(&self.targets_place, message));
        }
        Ok(Fitting {
            unknowns,
            measurements,
            uncertainties,
        })
    }

    /// The bytes of the number that a quantity stands as, if it does.
    fn number_of(&self, quantity: &str) -> Result<Option<Range<usize>>, InputError> {
        let tree = DeTable::parse(&self.source.text);
        let tree = tree.map_err(|error| InputError::new(error.message()))?;
        Ok(place_of(tree.get_ref(), quantity))
    }

    /// This file with other values of quantities, and its text.
    ///
    /// # Errors
    /// A value does not stand in the file as one number, or is none that it may be.
    pub fn with_values(&self, values: &[(&str, f64)]) -> Result<(Self, String), InputError> {
        let mut edits = Vec::new();
        for (name, value) in values {
            let span = self.number_of(name)?;
            let missing = || InputError::new(format_args!("no number {name:?} in the file"));
            edits.push((span.ok_or_else(missing)?, format!("{value:?}")));
        }
        edits.sort_by_key(|(span, _)| core::cmp::Reverse(span.start));
        let mut text = self.source.text.clone();
        for (span, number) in edits {
            text.replace_range(span, &number);
        }
        let mut file = read(&self.source.name, &text)?;
        file.galerkin = self.galerkin.clone();
        file.walk = self.walk.clone();
        file.validate()?;
        Ok((file, text))
    }

    /// Looks for quantities of this file, as [`fitting`](Self::fitting) has them, in solutions that take so long each; also the text of the file
    /// with the values that were found.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn find(
        &self,
        fitting: &Fitting,
        time_limit: Option<Duration>,
        watch: &dyn SolveObserver,
    ) -> Result<(Fit, String), SolveError> {
        let names: Vec<&str> = fitting
            .unknowns
            .iter()
            .map(|own| own.quantity.name.as_str())
            .collect();
        let with = |values: &[f64]| {
            let values: Vec<(&str, f64)> =
                names.iter().copied().zip(values.iter().copied()).collect();
            self.with_values(&values).map_err(failed)
        };
        // Those of the first values: other cells would have other draws, and misfits would jump.
        let mut settings: Option<Settings> = None;
        let mut solve = |values: &[f64]| -> Result<Report, SolveError> {
            let (file, _) = with(values)?;
            let own = file.resolve().map_err(failed)?;
            let (model, open) = (own.model.model(), own.settings);
            let solver = |settings: &Settings| {
                let settings = Settings {
                    time_limit,
                    ..settings.clone()
                };
                let solver = Solver::with(model, settings, own.targets.clone());
                solver.observer(watch).with_sensitivities(true)
            };
            let settings = match &settings {
                Some(first) => first,
                None => {
                    let is_chain = solver(&open).predict_resolvent()?.is_none();
                    settings.insert(match is_chain {
                        true => solver(&open).choose()?,
                        false => open,
                    })
                }
            };
            match solver(settings).solve() {
                Err(SolveError::NotReached(report)) => Ok(*report),
                other => other,
            }
        };
        let fit = fitting.fit(&mut solve)?;
        let found: Vec<f64> = fit.quantities.iter().map(|own| own.value).collect();
        let text = with(&found)?.1;
        Ok((fit, text))
    }
}

fn failed(error: InputError) -> SolveError {
    let (subject, message) = (Subject::Problem, error.to_string());
    Error::Option { subject, message }.into()
}

/// The bytes of the number that a quantity stands as: in `[problem]` or a table there, as a key or as one number of its array, or of a surface, in
/// `[[problem.surface]]`.
fn place_of(root: &DeTable<'_>, quantity: &str) -> Option<Range<usize>> {
    let problem = root.get("problem")?.get_ref().as_table()?;
    let (key, number) = match quantity.rsplit_once(' ') {
        Some((key, number)) => (key, number.parse().unwrap_or(0)),
        None => (quantity, 1_usize),
    };
    let within = |table: &DeTable<'_>| {
        let value = table.get(key)?;
        let one = match value.get_ref().as_array() {
            Some(all) => all.get(number.checked_sub(1)?)?,
            None => Some(value).filter(|_| number == 1)?,
        };
        is_number(one.get_ref()).then(|| one.span())
    };
    let tables = problem.values().filter_map(|own| own.get_ref().as_table());
    if let Some(found) = tables.chain([problem]).find_map(within) {
        return Some(found);
    }
    let surfaces = problem.get("surface")?.get_ref().as_array()?;
    surfaces.iter().find_map(|own| {
        let own = own.get_ref().as_table()?;
        let name = own.get("name")?.get_ref().as_str()?;
        let key = quantity
            .strip_prefix(name)?
            .strip_prefix(' ')?
            .replace(' ', "_");
        let value = own.get(key.as_str())?;
        let is_text = key == "temperature" && value.get_ref().is_str();
        (is_text || is_number(value.get_ref())).then(|| value.span())
    })
}

fn is_number(value: &DeValue<'_>) -> bool {
    matches!(value, DeValue::Integer(_) | DeValue::Float(_))
}
