//! Options of a call, in place of what the file says.

use core::time::Duration;

use fredholm::Choices;
use fredholm_file::{ProblemFile, SetByFlag as _};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::failure::exception;

/// An option that is given and not `None`.
fn given<'py, T: for<'a> FromPyObject<'a, 'py>>(
    options: &Bound<'py, PyDict>,
    name: &str,
) -> PyResult<Option<T>> {
    let py = options.py();
    match options.get_item(name)?.filter(|value| !value.is_none()) {
        None => Ok(None),
        Some(value) => value.extract().map(Some).map_err(|_| {
            let kind = core::any::type_name::<T>();
            let wanted = match kind {
                "f64" => "a number",
                "bool" => "True or False",
                "u32" | "u64" | "usize" => "a whole number, 0 or more",
                _ => "a word",
            };
            let text = value
                .repr()
                .map_or_else(|_| "?".to_owned(), |text| text.to_string());
            exception(
                py,
                "InputError",
                format!("{name} = {text}: it must be {wanted}"),
            )
        }),
    }
}

/// One of few words.
fn word<T: Choices>(options: &Bound<'_, PyDict>, name: &str) -> PyResult<Option<T>> {
    let Some(word) = given::<String>(options, name)? else {
        return Ok(None);
    };
    let Some(value) = T::of_word(&word) else {
        let all: Vec<&str> = T::ALL.iter().map(|choice| choice.word).collect();
        let message = format!("{name} = {word:?}: it must be one of {}", all.join(", "));
        return Err(exception(options.py(), "InputError", message));
    };
    Ok(Some(value))
}

/// Puts the options in the place of the file's values.
pub(crate) fn replace(file: &mut ProblemFile, options: &Bound<'_, PyDict>) -> PyResult<()> {
    let (galerkin, walk) = (&mut file.galerkin, &mut file.walk);
    galerkin.cells.set_by("cells", given(options, "cells")?);
    galerkin.lift.set_by("lift", given(options, "lift")?);
    galerkin.points.set_by("points", given(options, "points")?);
    galerkin
        .grading
        .set_by("grading", given(options, "grading")?);
    let shadow_cuts = given(options, "shadow_cuts")?;
    galerkin.shadow_cuts.set_by("shadow_cuts", shadow_cuts);
    galerkin.degree.set_by("degree", given(options, "degree")?);
    galerkin.pairs.set_by("pairs", word(options, "pairs")?);
    walk.method.set_by("method", word(options, "method")?);
    walk.walks.set_by("walks", given(options, "walks")?);
    let absorption = given(options, "absorption")?;
    walk.absorption.set_by("absorption", absorption);
    walk.estimator
        .set_by("estimator", word(options, "estimator")?);
    walk.form.set_by("form", word(options, "form")?);
    walk.sequence.set_by("sequence", word(options, "sequence")?);
    let forced_steps = given(options, "forced_steps")?;
    walk.forced_steps.set_by("forced_steps", forced_steps);
    // `global` is a word of Python.
    walk.global.set_by("global_", given(options, "global_")?);
    walk.last_step
        .set_by("last_step", given(options, "last_step")?);
    walk.adjoint.set_by("adjoint", given(options, "adjoint")?);
    walk.scalar.set_by("scalar", word(options, "scalar")?);
    walk.seed.set_by("seed", given(options, "seed")?);
    walk.batch.set_by("batch", given(options, "batch")?);
    walk.relative
        .set_by("relative", given(options, "relative")?);
    let target_error = given(options, "target_error")?;
    walk.target_error.set_by("target_error", target_error);
    if let Some(allow) = given(options, "allow_infinite_variance")? {
        walk.allow_infinite_variance = allow;
    }
    Ok(())
}

/// The degree of the polynomials on whose coefficients the walks of a global estimate score.
pub(crate) fn score_degree(options: &Bound<'_, PyDict>) -> PyResult<Option<usize>> {
    given(options, "score_degree")
}

/// The time after which walks end.
pub(crate) fn time_limit(options: &Bound<'_, PyDict>) -> PyResult<Option<Duration>> {
    let Some(seconds) = given::<f64>(options, "time_limit")? else {
        return Ok(None);
    };
    Duration::try_from_secs_f64(seconds).map(Some).map_err(|_| {
        let message = format!("time_limit = {seconds}: it must be a number of seconds, 0 or more");
        exception(options.py(), "InputError", message)
    })
}

/// The number of threads; `None`: all cores.
pub(crate) fn threads(options: &Bound<'_, PyDict>) -> PyResult<Option<usize>> {
    let threads = given::<usize>(options, "threads")?;
    match threads {
        Some(threads @ (0 | 1025..)) => {
            let message = format!("threads = {threads}: it must be from 1 to 1024");
            Err(exception(options.py(), "InputError", message))
        }
        threads => Ok(threads),
    }
}
