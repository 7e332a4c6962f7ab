//! Tasks: a problem, what is asked of it, and how.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use fredholm::choice::Chosen;
use fredholm::model::Model;
use fredholm::report::TimesReport;
use fredholm::resolvent::ResolventAnswer;
use fredholm::scene::{FacesRequest, TimesRequest};
use fredholm::{
    Ask, Choices as _, Field as Function, GlobalQuantity, Measured, Method, Region, SolveError,
    Solver, Target, WeightFn,
};
use fredholm_factors::{Factors, FactorsError, Sights};
use fredholm_file::kinds::{Cube, Room, Scene};
use fredholm_file::scene::Times;
use fredholm_file::{Placed, ProblemFile, Resolution, Resolved, Source, What};
use fredholm_rayon::with_gather;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::blocks::{BlockModel, Blocks, InBlocks};
use crate::failure::{exception, of, of_input, of_solve};
use crate::functions::{Caller, Functions, number, point};
use crate::options;
use crate::run::{Done, Watch, on_threads};
use crate::scene::{FaceArrays, Mesh, SparseArrays, face_arrays, sparse_factors};

/// A problem: the text of a file, and functions in the place of its formulas if there are some.
#[pyclass(frozen, module = "fredholm._fredholm")]
#[derive(Debug)]
pub(crate) struct Task {
    /// The name of the text in errors.
    name: String,
    text: String,
    functions: Option<Py<Functions>>,
    /// Weights that are functions: names and values at a point.
    weights: Vec<(String, Py<PyAny>)>,
    /// The surfaces of a scene that are arrays.
    mesh: Option<Py<Mesh>>,
}

/// Values of u at points, from one set of walks.
#[pyclass(frozen, get_all, module = "fredholm._fredholm")]
#[derive(Debug)]
pub(crate) struct Field {
    /// The points' coordinates, one after the other.
    points: Vec<Vec<f64>>,
    estimates: Vec<f64>,
    std_errors: Vec<Option<f64>>,
    bands: Vec<Option<f64>>,
    iterates: Vec<f64>,
    /// The summary as JSON.
    summary: String,
}

/// A resolved task.
struct Opened {
    file: ProblemFile,
    resolved: Resolved,
    caller: Option<Arc<Caller>>,
    /// The first exception that a weight raised.
    raised: Arc<OnceLock<PyErr>>,
    /// The model of the functions.
    functions: Option<Box<dyn Model>>,
}

impl Opened {
    fn model(&self) -> &dyn Model {
        match &self.functions {
            Some(model) => &**model,
            None => self.resolved.model.model(),
        }
    }

    /// The exception that a function raised, or that the interpreter did meanwhile.
    fn raised<T>(&self, done: Done<T>) -> PyResult<(T, Option<PyErr>)> {
        if let Some(raised) = self.caller.as_ref().and_then(|caller| caller.raised()) {
            return Err(raised);
        }
        match self.raised.get() {
            Some(raised) => Err(Python::attach(|py| raised.clone_ref(py))),
            None => Ok((done.value, done.interrupt)),
        }
    }

    /// Does work of which nothing is left if it is interrupted.
    fn done<T: Send>(
        &self,
        py: Python<'_>,
        threads: Option<usize>,
        watch: &Watch,
        work: impl FnOnce() -> T + Send,
    ) -> PyResult<T> {
        let done = on_threads(py, threads, watch, None, work)?;
        let (value, interrupt) = self.raised(done)?;
        interrupt.map_or(Ok(value), Err)
    }
}

/// JSON in which objects are tables, as TOML: the text of a problem file.
fn toml_of(py: Python<'_>, json: &str) -> PyResult<String> {
    let wrong = |error: &dyn core::fmt::Display| exception(py, "InputError", error.to_string());
    let value: Value = serde_json::from_str(json).map_err(|error| wrong(&error))?;
    toml::to_string(&value).map_err(|error| wrong(&error))
}

/// The text with these targets in place of its own.
fn with_targets(py: Python<'_>, text: &str, targets: &str) -> PyResult<String> {
    let mut lines = text.lines().map(str::trim_start);
    let own = lines.any(|line| line.starts_with("target") || line.starts_with("[[target]]"));
    let head = match text.parse::<toml::Table>() {
        Ok(mut table) if own => {
            table.remove("target");
            toml::to_string(&table)
                .map_err(|error| exception(py, "InputError", error.to_string()))?
        }
        // What is no TOML is refused with its place, later.
        _ => text.to_owned(),
    };
    Ok(format!("{head}\n{}", toml_of(py, targets)?))
}

#[pymethods]
impl Task {
    /// A problem of a text: the content of a problem file.
    #[new]
    #[pyo3(signature = (name, text, targets=None, functions=None, weights=vec![], mesh=None))]
    fn new(
        py: Python<'_>,
        name: String,
        text: &str,
        targets: Option<&str>,
        functions: Option<Py<Functions>>,
        weights: Vec<(String, Py<PyAny>)>,
        mesh: Option<Py<Mesh>>,
    ) -> PyResult<Self> {
        let text = match targets {
            Some(targets) => with_targets(py, text, targets)?,
            None => text.to_owned(),
        };
        Ok(Self {
            name,
            text,
            functions,
            weights,
            mesh,
        })
    }

    /// The text of a problem file, of JSON in which objects are tables.
    #[staticmethod]
    fn text_of(py: Python<'_>, json: &str) -> PyResult<String> {
        toml_of(py, json)
    }

    /// The content of a problem file.
    #[staticmethod]
    fn read(py: Python<'_>, path: &str) -> PyResult<String> {
        let bytes = fredholm_file::load(Path::new(path), fredholm_file::MAX_BYTES)
            .map_err(|error| of_input(py, &error))?;
        fredholm_file::utf8(path, bytes).map_err(|error| of_input(py, &error))
    }

    /// Reads and checks everything; the kind of the problem, the dimension of a cube, and remarks.
    fn check(
        &self,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<(&'static str, Option<usize>, Vec<String>)> {
        let opened = self.open(options, &Arc::default())?;
        let mut remarks = opened.file.remarks();
        remarks.extend(opened.model().notes());
        let about = opened.model().about();
        Ok((about.kind, about.dimension, remarks))
    }

    /// Solves; how it ended, the report as JSON and as a table, remarks, and the interrupt if there was one.
    #[pyo3(signature = (options, progress=None))]
    #[allow(clippy::type_complexity)]
    fn solve(
        &self,
        options: &Bound<'_, PyDict>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<(&'static str, String, String, Vec<String>, Option<PyErr>)> {
        let py = options.py();
        let watch = Arc::new(Watch::default());
        let opened = self.open(options, &watch)?;
        let solver = self.solver(&opened, &watch);
        let Resolved {
            settings, targets, ..
        } = &opened.resolved;
        if settings.tolerance.is_none() {
            let walks = settings.walk_options().walks;
            watch.expect(walks.saturating_mul(targets.len() as u64));
        }
        let threads = self.threads(options)?;
        let done = on_threads(py, threads, &watch, progress, || solver.solve())?;
        let (solved, interrupt) = opened.raised(done)?;
        let (outcome, report) = match solved {
            Ok(report) => ("done", report),
            Err(SolveError::NotReached(report)) => ("not reached", *report),
            Err(SolveError::Cancelled(Some(report))) => ("cancelled", *report),
            // What is interrupted in a set-up may end with an error of values that nobody computed.
            Err(error) if interrupt.is_some() || matches!(error, SolveError::Cancelled(None)) => {
                return Ok((
                    "cancelled",
                    String::new(),
                    String::new(),
                    Vec::new(),
                    interrupt,
                ));
            }
            Err(error) => return Err(of_solve(py, &error, &opened.file)),
        };
        let json = json_of(py, &report)?;
        Ok((outcome, json, report.table(), report.remarks(), interrupt))
    }

    /// The settings that would be chosen, with their walks and time, as JSON; null if nothing is open.
    fn predict(&self, options: &Bound<'_, PyDict>) -> PyResult<String> {
        let py = options.py();
        let watch = Arc::new(Watch::default());
        let opened = self.open(options, &watch)?;
        let Resolved {
            targets, settings, ..
        } = &opened.resolved;
        let solver = self.solver(&opened, &watch);
        let work = || match solver.predict_resolvent()? {
            Some(answer) => Ok(by_resolvent(&answer)),
            None => {
                let chosen = fredholm::choice::choose(opened.model(), targets, settings, &*watch)?;
                Ok(chosen.map_or(Value::Null, |chosen| by_chain(&chosen)))
            }
        };
        let chosen = opened.done(py, self.threads(options)?, &watch, work)?;
        let chosen = chosen.map_err(|error: SolveError| of_solve(py, &error, &opened.file))?;
        json_of(py, &chosen)
    }

    /// The diagnosis as JSON and as text.
    fn diagnose(&self, options: &Bound<'_, PyDict>) -> PyResult<(String, String)> {
        let py = options.py();
        let watch = Arc::new(Watch::default());
        let mut opened = self.open(options, &watch)?;
        opened.resolved.settings.allow_infinite_variance = true;
        let solver = self.solver(&opened, &watch);
        let work = || solver.diagnose();
        let diagnosis = opened.done(py, self.threads(options)?, &watch, work)?;
        let diagnosis = diagnosis.map_err(|error| of_solve(py, &error, &opened.file))?;
        let text = diagnosis
            .targets
            .iter()
            .map(fredholm::diagnosis::GoalDiagnosis::text);
        Ok((
            json_of(py, &diagnosis)?,
            text.collect::<Vec<_>>().join("\n"),
        ))
    }

    /// The sweep as JSON and as a table.
    fn sweep(
        &self,
        cells: Vec<usize>,
        walks: u64,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<(String, String)> {
        let py = options.py();
        let watch = Arc::new(Watch::default());
        let opened = self.open(options, &watch)?;
        let solver = self.solver(&opened, &watch);
        let work = || solver.sweep(&cells, walks);
        let rates = opened.done(py, self.threads(options)?, &watch, work)?;
        let rates = rates.map_err(|error| of_solve(py, &error, &opened.file))?;
        Ok((json_of(py, &rates)?, rates.text()))
    }

    /// u at these points, or at so many equally spaced ones of every axis, from one set of walks.
    fn field(
        &self,
        grid: Option<usize>,
        points: Vec<Vec<f64>>,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<Field> {
        let py = options.py();
        let watch = Arc::new(Watch::default());
        let opened = self.open(options, &watch)?;
        let solver = self.solver(&opened, &watch);
        let model = opened.model();
        let work = || {
            let whole = solver.whole()?;
            let regions: Vec<Region> = match grid {
                Some(points) => model.grid(points, None),
                None => points.iter().cloned().map(Region::Point).collect(),
            };
            // Those of walks of a chain are sums that cannot be taken twice.
            let gather = opened.caller.clone();
            let gather = gather.filter(|_| whole.summary().resolvent.is_some());
            let values = match gather {
                Some(caller) => with_gather(Arc::new(InBlocks(caller)), || whole.values(&regions))?,
                None => whole.values(&regions)?,
            };
            Ok((regions, values, serde_json::to_string(whole.summary())))
        };
        let field = opened.done(py, self.threads(options)?, &watch, work)?;
        let (regions, values, summary) =
            field.map_err(|error| of_solve(py, &error, &opened.file))?;
        let coordinates = |region: &Region| match region {
            Region::Point(x) => x.clone(),
            other => model.position(other).unwrap_or_default(),
        };
        Ok(Field {
            points: regions.iter().map(coordinates).collect(),
            estimates: values.iter().map(|value| value.estimate).collect(),
            std_errors: values.iter().map(|value| value.std_error).collect(),
            bands: values.iter().map(|value| value.band).collect(),
            iterates: values.iter().map(|value| value.iterate).collect(),
            summary: summary.map_err(|error| exception(py, "FredholmError", error.to_string()))?,
        })
    }

    /// Compares a solution with u: formulas, a function of a point, or values of the targets. The certificate as JSON and as a table.
    #[pyo3(signature = (formulas, function, values, options))]
    fn certify(
        &self,
        formulas: Vec<String>,
        function: Option<Py<PyAny>>,
        values: Vec<f64>,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<(String, String)> {
        let py = options.py();
        let watch = Arc::new(Watch::default());
        let opened = self.open(options, &watch)?;
        let solver = self.solver(&opened, &watch);
        let given = opened.file.given_formulas(opened.model(), &formulas);
        let mut functions = given.map_err(|error| of_input(py, &error))?;
        if let Some(function) = function {
            let raised = Arc::clone(&opened.raised);
            functions.push(Box::new(move |x: &[f64]| {
                Python::attach(|py| value_at(py, &function, x, ("solution", &raised)))
            }));
        }
        let functions: Vec<&Function> = functions.iter().map(|own| &**own).collect();
        let work = || match values.is_empty() {
            true => solver.certify_all(&functions),
            false => solver.certify_values(&values, 0.0),
        };
        let certificate = opened.done(py, self.threads(options)?, &watch, work)?;
        let certificate = certificate.map_err(|error| of_solve(py, &error, &opened.file))?;
        Ok((json_of(py, &certificate)?, certificate.table()))
    }

    /// The derivatives of all targets, as JSON and as a table.
    fn sensitivities(&self, options: &Bound<'_, PyDict>) -> PyResult<(String, String)> {
        let py = options.py();
        let watch = Arc::new(Watch::default());
        let opened = self.open(options, &watch)?;
        let solver = self.solver(&opened, &watch);
        let work = || solver.sensitivities();
        let found = opened.done(py, self.threads(options)?, &watch, work)?;
        let found = found.map_err(|error| of_solve(py, &error, &opened.file))?;
        Ok((json_of(py, &found)?, found.table()))
    }

    /// Quantities from measured targets, as JSON and as a table. A measurement is the name of a target, its value and error, and whether that is a
    /// temperature.
    fn fit(
        &self,
        quantities: Vec<String>,
        measured: Vec<(String, f64, f64, bool)>,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<(String, String)> {
        let py = options.py();
        let watch = Arc::new(Watch::default());
        let mut opened = self.open(options, &watch)?;
        let file = &mut opened.file;
        let wrong = |error| of_input(py, &error);
        if !quantities.is_empty() {
            let named = quantities.into_iter();
            file.fit = named.map(|name| Placed::flag("quantities", name)).collect();
        }
        for (name, value, error, is_temperature) in measured {
            let what = match is_temperature {
                true => Measured::Temperature,
                false => Measured::Value,
            };
            file.measure(&name, what, (value, error)).map_err(wrong)?;
        }
        let fitting = opened.file.fitting(opened.model()).map_err(wrong)?;
        let limit = opened.resolved.settings.time_limit;
        let work = || opened.file.find(&fitting, limit, &*watch);
        let found = opened.done(py, self.threads(options)?, &watch, work)?;
        let (fit, _) = found.map_err(|error| of_solve(py, &error, &opened.file))?;
        Ok((json_of(py, &fit)?, fit.table()))
    }

    /// A quantity on every face of a scene of arrays.
    fn faces(&self, quantity: &str, options: &Bound<'_, PyDict>) -> PyResult<FaceArrays> {
        let py = options.py();
        let watch = Arc::new(Watch::default());
        let opened = self.open(options, &watch)?;
        let Some(quantity) = GlobalQuantity::of_word(quantity) else {
            let message =
                format!("{quantity:?} is no quantity: give \"u\", \"irradiance\" or \"net_flux\"");
            return Err(exception(py, "InputError", message));
        };
        let (Some(mesh), Resolution::Scene(model)) = (&self.mesh, &opened.resolved.model) else {
            let message = "values of all faces are those of a Scene".to_owned();
            return Err(exception(py, "InputError", message));
        };
        let settings = &opened.resolved.settings;
        let (cut, walk) = (settings.discretisation(), settings.walk_options());
        let request = FacesRequest {
            quantity,
            walk: &walk,
            is_plain: settings.cells.is_none(),
        };
        let work = || model.on_faces(&cut, &request, &*watch);
        let found = opened.done(py, self.threads(options)?, &watch, work)?;
        let found = found.map_err(|error| of(py, &error, &opened.file))?;
        let file = &opened.file.problem.of::<Scene>().map(|scene| &scene.file);
        let unit = match quantity {
            GlobalQuantity::Irradiance => opened.model().about().irradiance_unit,
            _ => opened.model().about().unit,
        };
        Ok(face_arrays(
            py,
            (model.scene(), *file),
            mesh.get().arrays(),
            &found,
            unit,
        ))
    }

    /// Targets of a scene under suns and skies over time, a CSV text of this name, as JSON and as a table.
    fn times(
        &self,
        name: String,
        text: String,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<(String, String)> {
        let py = options.py();
        let watch = Arc::new(Watch::default());
        let opened = self.open(options, &watch)?;
        let wrong = |message: &str| Err(exception(py, "InputError", message.to_owned()));
        let (Some(scene), Resolution::Scene(model)) =
            (opened.file.problem.of::<Scene>(), &opened.resolved.model)
        else {
            return wrong("suns and skies over time shine on scenes");
        };
        let times = Times::parse(&Source { name, text }, scene.file.sky.as_ref());
        let times = times.map_err(|error| of_input(py, &error))?;
        let settings = &opened.resolved.settings;
        let (cut, walk) = (settings.discretisation(), settings.walk_options());
        let goals = fredholm::goals(opened.model(), &opened.resolved.targets);
        let goals = goals.map_err(|error| of(py, &error, &opened.file))?;
        let request = TimesRequest {
            goals: &goals,
            times: &times.lights,
            walk: &walk,
        };
        let work = || model.at_times(&cut, &request, &*watch);
        let found = opened.done(py, self.threads(options)?, &watch, work)?;
        let found = found.map_err(|error| of(py, &error, &opened.file))?;
        let report = TimesReport::new(opened.model(), &goals, times.names, &found);
        Ok((json_of(py, &report)?, report.table()))
    }

    /// Form factors between the surfaces of a scene of arrays that are not 0.
    fn sparse_factors(&self, error: f64, options: &Bound<'_, PyDict>) -> PyResult<SparseArrays> {
        let py = options.py();
        let watch = Arc::new(Watch::default());
        let opened = self.open(options, &watch)?;
        let Resolution::Scene(model) = &opened.resolved.model else {
            let message = "sparse form factors are those of a Scene".to_owned();
            return Err(exception(py, "InputError", message));
        };
        let work = || sparse_factors(model.scene(), error);
        let found = opened.done(py, self.threads(options)?, &watch, work)?;
        let found = found.map_err(|error| exception(py, "InputError", error.to_string()))?;
        Ok(found.to_python(py, model.names()))
    }

    /// Form factors between the surfaces of a room: their names, and all rows one after the other.
    fn factors(&self, options: &Bound<'_, PyDict>) -> PyResult<(Vec<String>, Vec<f64>)> {
        let py = options.py();
        let opened = self.open(options, &Arc::default())?;
        let Some(room) = opened.file.problem.of::<Room>() else {
            let message = "form factors are those of rooms and scenes".to_owned();
            return Err(exception(py, "InputError", message));
        };
        let surfaces = room
            .all_surfaces(&opened.file)
            .map_err(|error| of_input(py, &error))?;
        let rows = py.detach(|| {
            let scene = surfaces.scene::<f64>()?;
            Ok(fredholm_factors::room_factors(&scene))
        });
        let rows = rows
            .map_err(|error| of(py, &error, &opened.file))?
            .map_err(|error| exception(py, "FredholmError", error.to_string()))?;
        Ok((surfaces.names, rows))
    }
}

/// What resolvent walks would take.
fn by_resolvent(answer: &ResolventAnswer) -> Value {
    json!({
        "method": Method::Resolvent.word(),
        "cells": answer.cells,
        "degree": answer.degree,
        "pairs": null,
        "absorption": null,
        "estimator": null,
        "predicted_setup_seconds": answer.setup_seconds,
        "predicted_walk_seconds": answer.walk_seconds,
        "predicted_walks": answer.points,
        "radius": answer.figures.radius,
        "condition": answer.figures.condition,
    })
}

/// What walks of a chain would take.
fn by_chain(chosen: &Chosen<'_>) -> Value {
    let settings = &chosen.settings;
    let (cut, walk) = (settings.discretisation(), settings.walk_options());
    let mut value = serde_json::to_value(&chosen.report).unwrap_or_default();
    value["method"] = json!(settings.method.unwrap_or(Method::Walks).word());
    value["cells"] = json!(if chosen.plain { Some(0) } else { cut.cells });
    value["degree"] = json!(cut.degree);
    value["pairs"] = json!(walk.pairs.word());
    value["absorption"] = json!(walk.absorption.probability());
    value["estimator"] = json!(walk.absorption.estimator().word());
    value
}

/// Names, areas, rows of form factors, and an error.
type SceneFactors = (Vec<String>, Vec<f64>, Vec<f64>, f64);

/// The names of a scene's surfaces, their areas, the form factors between them row after row, and the largest error that
/// one between polygons is estimated to have.
#[pyfunction]
pub(crate) fn scene_factors(
    py: Python<'_>,
    path: &str,
    error: f64,
    open: bool,
) -> PyResult<SceneFactors> {
    let wrong = |error: fredholm_file::InputError| of_input(py, &error);
    let at = Path::new(path);
    let mut file = if fredholm_file::scene::is_mesh(at) {
        fredholm_file::scene::read(at).map_err(wrong)?
    } else {
        let text = Task::read(py, path)?;
        fredholm_file::scene::parse_description(path, &text).map_err(wrong)?
    };
    file.open |= open;
    let scene = file.scene::<f64>().map_err(wrong)?;
    let found = py.detach(|| {
        let sights = Sights::new(&scene, error)?;
        let faces = (0..scene.faces().len()).into_par_iter();
        let all = Factors::new(&scene, faces.map(|face| sights.row(face)).collect())?;
        let groups = all.of_surfaces(&scene)?;
        Ok((all.error(), groups))
    });
    let (largest, groups) =
        found.map_err(|error: FactorsError| exception(py, "InputError", error.to_string()))?;
    let n = groups.len();
    let rows = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let rows = rows.map(|(i, j)| groups.factor(i, j)).collect();
    let names = file.surfaces.iter().map(|surface| surface.name.clone());
    Ok((names.collect(), groups.areas().to_vec(), rows, largest))
}

/// Whether a file is a scene in space.
#[pyfunction]
pub(crate) fn is_scene(py: Python<'_>, path: &str) -> PyResult<bool> {
    if fredholm_file::scene::is_mesh(Path::new(path)) {
        return Ok(true);
    }
    Ok(fredholm_file::scene::is_description(&Task::read(py, path)?))
}

impl Task {
    /// Reads the text, puts the options in place and checks everything.
    fn open(&self, options: &Bound<'_, PyDict>, watch: &Arc<Watch>) -> PyResult<Opened> {
        let py = options.py();
        let wrong = |error| of_input(py, &error);
        let mut file = fredholm_file::read(&self.name, &self.text).map_err(wrong)?;
        if let (Some(mesh), Some(scene)) = (&self.mesh, file.problem.of::<Scene>()) {
            let mut scene = scene.clone();
            scene.file.add_arrays(mesh.get().arrays()).map_err(wrong)?;
            file.problem = Arc::new(scene);
        }
        options::replace(&mut file, options)?;
        // A file asks for something; a target of its own stands for weights that are functions, until these are there.
        let stands_for_weights = file.targets.is_empty() && !self.weights.is_empty();
        if stands_for_weights {
            file.targets.push(nothing(&file));
        }
        file.validate().map_err(wrong)?;
        let mut resolved = file.resolve().map_err(wrong)?;
        if stands_for_weights {
            resolved.targets.clear();
        }
        resolved.settings.time_limit = options::time_limit(options)?;
        resolved.settings.score_degree = options::score_degree(options)?;
        let raised = Arc::default();
        for (name, weight) in &self.weights {
            let (weight, raised) = (weight.clone_ref(py), Arc::clone(&raised));
            let value =
                move |x: &[f64]| Python::attach(|py| value_at(py, &weight, x, ("weight", &raised)));
            resolved.targets.push(Target {
                name: name.clone(),
                ask: Ask::One(Region::Function(WeightFn::new(value))),
            });
        }
        let mut opened = Opened {
            file,
            resolved,
            caller: None,
            raised,
            functions: None,
        };
        if let Some(functions) = &self.functions {
            let caller = Arc::new(Caller::new(functions.clone_ref(py), Arc::clone(watch)));
            let in_blocks = functions.get().is_in_blocks();
            opened.functions = Some(model_of(py, in_blocks, &caller, &opened.file)?);
            opened.caller = Some(caller);
        }
        Ok(opened)
    }

    fn solver<'m>(&self, opened: &'m Opened, watch: &'m Watch) -> Solver<'m> {
        let Resolved {
            settings, targets, ..
        } = &opened.resolved;
        Solver::with(opened.model(), settings.clone(), targets.clone()).observer(watch)
    }

    /// The number of threads that help.
    fn threads(&self, options: &Bound<'_, PyDict>) -> PyResult<Option<usize>> {
        let alone = self
            .functions
            .as_ref()
            .is_some_and(|functions| functions.get().is_scalar());
        Ok(if alone {
            Some(1)
        } else {
            options::threads(options)?
        })
    }
}

/// A target of a file that any equation has: the mean of a cube may be that of an infinite domain.
fn nothing(file: &ProblemFile) -> fredholm_file::Target {
    let what = match file.problem.of::<Cube>() {
        Some(_) => What::Weight(Placed::flag("weight", "0".to_owned())),
        None => What::OverAll,
    };
    fredholm_file::Target {
        name: Placed::flag("weight", "nothing".to_owned()),
        component: None,
        ask: None,
        from: None,
        what,
        measured: None,
    }
}

/// The value of a function of this name at a point; not a number if it raises, which ends the set-up.
fn value_at(
    py: Python<'_>,
    function: &Py<PyAny>,
    x: &[f64],
    (name, raised): (&str, &OnceLock<PyErr>),
) -> f64 {
    let value = point(py, x).and_then(|x| number(&function.bind(py).call1((x,))?, name));
    value.unwrap_or_else(|error| {
        let _ = raised.set(error);
        f64::NAN
    })
}

/// The equation of functions, on the domain that the file says.
fn model_of(
    py: Python<'_>,
    in_blocks: bool,
    caller: &Arc<Caller>,
    file: &ProblemFile,
) -> PyResult<Box<dyn Model>> {
    let space = file.problem.of::<Cube>().map(|cube| &cube.space);
    let (domain, edges) =
        space.map_or_else(Default::default, |space| (space.ends(), space.edges()));
    if !in_blocks {
        return Ok(Box::new(caller.model(&domain, &edges)));
    }
    let blocks = Blocks::new(Arc::clone(caller), domain, edges).map_err(|error| {
        let message = format!("cannot start threads: {error}");
        exception(py, "FredholmError", message)
    })?;
    Ok(Box::new(BlockModel::new(blocks)))
}

fn json_of(py: Python<'_>, value: &impl serde::Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|error| exception(py, "FredholmError", error.to_string()))
}
