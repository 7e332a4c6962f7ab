//! Options of a call, in place of what the file says.

use core::time::Duration;

use fredholm::Choices;
use fredholm_file::{Placed, ProblemFile};
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

fn set<T>(to: &mut Placed<T>, name: &'static str, value: Option<T>) {
    if let Some(value) = value {
        *to = Placed::flag(name, value);
    }
}

fn set_open<T>(to: &mut Option<Placed<T>>, name: &'static str, value: Option<T>) {
    if let Some(value) = value {
        *to = Some(Placed::flag(name, value));
    }
}

/// Puts the options in the place of the file's values.
pub(crate) fn replace(file: &mut ProblemFile, options: &Bound<'_, PyDict>) -> PyResult<()> {
    let galerkin = &mut file.galerkin;
    set_open(&mut galerkin.cells, "cells", given(options, "cells")?);
    set_open(&mut galerkin.lift, "lift", given(options, "lift")?);
    set_open(&mut galerkin.points, "points", given(options, "points")?);
    set_open(&mut galerkin.grading, "grading", given(options, "grading")?);
    set_open(
        &mut galerkin.shadow_cuts,
        "shadow_cuts",
        given(options, "shadow_cuts")?,
    );
    set(&mut galerkin.degree, "degree", given(options, "degree")?);
    set(&mut galerkin.pairs, "pairs", word(options, "pairs")?);
    let walk = &mut file.walk;
    set_open(&mut walk.method, "method", word(options, "method")?);
    set(&mut walk.walks, "walks", given(options, "walks")?);
    set_open(
        &mut walk.absorption,
        "absorption",
        given(options, "absorption")?,
    );
    set(
        &mut walk.estimator,
        "estimator",
        word(options, "estimator")?,
    );
    set(&mut walk.form, "form", word(options, "form")?);
    set(&mut walk.sequence, "sequence", word(options, "sequence")?);
    set(
        &mut walk.forced_steps,
        "forced_steps",
        given(options, "forced_steps")?,
    );
    // `global` is a word of Python.
    set_open(&mut walk.global, "global_", given(options, "global_")?);
    set_open(
        &mut walk.last_step,
        "last_step",
        given(options, "last_step")?,
    );
    set_open(&mut walk.adjoint, "adjoint", given(options, "adjoint")?);
    set(&mut walk.scalar, "scalar", word(options, "scalar")?);
    set(&mut walk.seed, "seed", given(options, "seed")?);
    set(&mut walk.batch, "batch", given(options, "batch")?);
    set(&mut walk.relative, "relative", given(options, "relative")?);
    set_open(
        &mut walk.target_error,
        "target_error",
        given(options, "target_error")?,
    );
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
