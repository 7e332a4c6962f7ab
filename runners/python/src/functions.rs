//! Kernels and sources that are no formulas: constants, addresses of compiled functions, Python's functions.

use std::sync::{Arc, Mutex, PoisonError};

use fredholm::CubeModel;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::blocks::{self, Tape};
use crate::failure::exception;
use crate::run::Watch;
use fredholm::Observer as _;

/// A compiled function of a point: `double source(const double *x)`.
type OfPoint = unsafe extern "C" fn(*const f64) -> f64;
/// A compiled function of two points: `double kernel(const double *x, const double *y)`.
type OfPoints = unsafe extern "C" fn(*const f64, *const f64) -> f64;

/// A function of one point or of two.
#[derive(Debug)]
enum Function<C> {
    Constant(f64),
    Compiled(C),
    /// It is called with one point at a time.
    Scalar(Py<PyAny>),
    /// It is called with arrays of points, whose last axis has the coordinates; in one dimension there is no such axis.
    Blocks(Py<PyAny>),
}

/// The kernel and the source of an equation on [0, 1]^d.
#[pyclass(frozen, module = "fredholm._fredholm")]
#[derive(Debug)]
pub(crate) struct Functions {
    dimension: usize,
    kernel: Function<OfPoints>,
    source: Function<OfPoint>,
}

/// What a function is, as Python's side found it out.
fn function<C>(
    kind: &str,
    value: &Bound<'_, PyAny>,
    compiled: impl FnOnce(usize) -> Option<C>,
) -> PyResult<Function<C>> {
    let refused = || {
        exception(
            value.py(),
            "InputError",
            format!("{kind} functions are not known"),
        )
    };
    Ok(match kind {
        "constant" => Function::Constant(value.extract()?),
        "compiled" => Function::Compiled(compiled(value.extract()?).ok_or_else(refused)?),
        "scalar" => Function::Scalar(value.clone().unbind()),
        "blocks" => Function::Blocks(value.clone().unbind()),
        _ => return Err(refused()),
    })
}

#[pymethods]
impl Functions {
    /// Functions of so many coordinates, each with its kind: "constant", "compiled" (an address), "scalar" or "blocks".
    #[new]
    #[allow(unsafe_code)]
    fn new(
        dimension: usize,
        kernel: (String, Bound<'_, PyAny>),
        source: (String, Bound<'_, PyAny>),
    ) -> PyResult<Self> {
        if !(1..=6).contains(&dimension) {
            let message = format!("dimension = {dimension}: it must be from 1 to 6");
            return Err(exception(kernel.1.py(), "InputError", message));
        }
        // SAFETY: an address that is not 0 is taken for a function of this signature; nothing can check that, and the
        // documentation of `fredholm.Cube` says so. `Option` makes 0 `None`.
        let of_points =
            |address| unsafe { core::mem::transmute::<usize, Option<OfPoints>>(address) };
        // SAFETY: the same.
        let of_point = |address| unsafe { core::mem::transmute::<usize, Option<OfPoint>>(address) };
        Ok(Self {
            dimension,
            kernel: function(&kernel.0, &kernel.1, of_points)?,
            source: function(&source.0, &source.1, of_point)?,
        })
    }
}

impl Functions {
    /// Whether a function is called with one point at a time, so that further threads would wait for the interpreter.
    pub(crate) const fn is_scalar(&self) -> bool {
        matches!(self.kernel, Function::Scalar(_)) || matches!(self.source, Function::Scalar(_))
    }

    pub(crate) const fn is_in_blocks(&self) -> bool {
        matches!(self.kernel, Function::Blocks(_)) || matches!(self.source, Function::Blocks(_))
    }
}

/// Functions that are called, and the first exception that they raised.
#[derive(Debug)]
pub(crate) struct Caller {
    functions: Py<Functions>,
    watch: Arc<Watch>,
    raised: Mutex<Option<PyErr>>,
}

/// Refuses values that are complex, of which a conversion would keep the real part.
fn check_real(value: &Bound<'_, PyAny>, name: &str) -> PyResult<()> {
    let py = value.py();
    let is_complex: bool = py
        .import("numpy")?
        .call_method1("iscomplexobj", (value,))?
        .extract()?;
    if !is_complex {
        return Ok(());
    }
    py.import("fredholm.errors")?
        .call_method1("complex_error", (name,))
        .and_then(|error| Err(PyErr::from_value(error)))
}

/// The number that a function returned at one point.
pub(crate) fn number(value: &Bound<'_, PyAny>, name: &str) -> PyResult<f64> {
    if let Ok(number) = value.cast::<pyo3::types::PyFloat>() {
        return Ok(number.value());
    }
    check_real(value, name)?;
    let py = value.py();
    let wrong = |found: &str| {
        let message = format!("{name} returned {found} at one point: it must be a number");
        exception(py, "InputError", message)
    };
    let array = py.import("numpy")?.call_method1("asarray", (value,))?;
    if array.getattr("size")?.extract::<usize>()? != 1 {
        return Err(wrong(&format!(
            "an array of shape {}",
            array.getattr("shape")?
        )));
    }
    let item = array.call_method0("item")?;
    item.extract().map_err(|_| {
        let text = item
            .repr()
            .map_or_else(|_| "?".to_owned(), |text| text.to_string());
        wrong(&text)
    })
}

/// The values of a function at points in order, `count` of them in all.
fn values<'py>(
    py: Python<'py>,
    call: impl FnOnce() -> PyResult<Bound<'py, PyAny>>,
    name: &str,
    count: usize,
) -> PyResult<Vec<f64>> {
    let value = call()?;
    check_real(&value, name)?;
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("asarray", (value, "float64"))?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    if shape != [count] {
        let message = format!(
            "{name} returned an array of shape {shape:?} for a block of {count} points: it must be [{count}], one value \
             for each"
        );
        return Err(exception(py, "InputError", message));
    }
    let array: PyReadonlyArray1<'_, f64> = array.extract()?;
    Ok(array.as_array().to_vec())
}

/// Points as a function takes them: in one dimension numbers in a row, in more an array of their coordinates.
fn block<'py>(py: Python<'py>, points: &[f64], dimension: usize) -> PyResult<Bound<'py, PyAny>> {
    let flat = PyArray1::from_slice(py, points);
    if dimension == 1 {
        return Ok(flat.into_any());
    }
    let table: Bound<'py, PyArray2<f64>> = flat.reshape([points.len() / dimension, dimension])?;
    Ok(table.into_any())
}

/// One point as a function takes it.
pub(crate) fn point<'py>(py: Python<'py>, x: &[f64]) -> PyResult<Bound<'py, PyAny>> {
    match x {
        [x] => Ok(pyo3::types::PyFloat::new(py, *x).into_any()),
        x => Ok(PyArray1::from_slice(py, x).into_any()),
    }
}

impl Caller {
    pub(crate) fn new(functions: Py<Functions>, watch: Arc<Watch>) -> Self {
        Self {
            functions,
            watch,
            raised: Mutex::new(None),
        }
    }

    /// The first exception that a function raised.
    pub(crate) fn raised(&self) -> Option<PyErr> {
        self.raised
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take()
    }

    fn functions(&self) -> &Functions {
        self.functions.get()
    }

    /// The values, or not-a-numbers in place of an exception, which ends the work.
    fn or_raised(&self, values: PyResult<Vec<f64>>, count: usize) -> Vec<f64> {
        values.unwrap_or_else(|error| {
            self.watch.cancel();
            let mut raised = self.raised.lock().unwrap_or_else(PoisonError::into_inner);
            raised.get_or_insert(error);
            vec![f64::NAN; count]
        })
    }

    /// Whether nothing is called any more: after an exception, or an interrupt before there are walks that have a result.
    fn is_over(&self) -> bool {
        self.watch.cancelled()
            && (self.watch.is_in_set_up()
                || self
                    .raised
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .is_some())
    }

    /// A value of a function that is called with one point at a time.
    fn one(&self, call: impl FnOnce(Python<'_>) -> PyResult<f64>) -> f64 {
        if self.is_over() {
            return f64::NAN;
        }
        let values = Python::attach(|py| self.or_raised(call(py).map(|value| vec![value]), 1));
        values[0]
    }

    /// The kernel at (x, y).
    #[allow(unsafe_code)]
    fn kernel(&self, x: &[f64], y: &[f64]) -> f64 {
        match &self.functions().kernel {
            Function::Constant(value) => *value,
            // SAFETY: the function takes two pointers to as many numbers as there are dimensions, as its user says.
            Function::Compiled(kernel) => unsafe { kernel(x.as_ptr(), y.as_ptr()) },
            Function::Scalar(kernel) => self.one(|py| {
                let value = kernel.bind(py).call1((point(py, x)?, point(py, y)?))?;
                number(&value, "kernel")
            }),
            Function::Blocks(_) => blocks::kernel(x, y).unwrap_or_else(|| self.kernels(x, y)[0]),
        }
    }

    /// The source at x.
    #[allow(unsafe_code)]
    fn source(&self, x: &[f64]) -> f64 {
        match &self.functions().source {
            Function::Constant(value) => *value,
            // SAFETY: the function takes a pointer to as many numbers as there are dimensions, as its user says.
            Function::Compiled(source) => unsafe { source(x.as_ptr()) },
            Function::Scalar(source) => self.one(|py| {
                let value = source.bind(py).call1((point(py, x)?,))?;
                number(&value, "source")
            }),
            Function::Blocks(_) => blocks::source(x).unwrap_or_else(|| self.sources(x)[0]),
        }
    }

    /// The kernel at pairs of points, by one call.
    fn kernels(&self, x: &[f64], y: &[f64]) -> Vec<f64> {
        let dimension = self.functions().dimension;
        let count = x.len() / dimension;
        let Function::Blocks(kernel) = &self.functions().kernel else {
            return vec![f64::NAN; count];
        };
        if self.is_over() {
            return vec![f64::NAN; count];
        }
        Python::attach(|py| {
            let call = || {
                kernel
                    .bind(py)
                    .call1((block(py, x, dimension)?, block(py, y, dimension)?))
            };
            self.or_raised(values(py, call, "kernel", count), count)
        })
    }

    /// The source at points, by one call.
    fn sources(&self, x: &[f64]) -> Vec<f64> {
        let dimension = self.functions().dimension;
        let count = x.len() / dimension;
        let Function::Blocks(source) = &self.functions().source else {
            return vec![f64::NAN; count];
        };
        if self.is_over() {
            return vec![f64::NAN; count];
        }
        Python::attach(|py| {
            let call = || source.bind(py).call1((block(py, x, dimension)?,));
            self.or_raised(values(py, call, "source", count), count)
        })
    }

    /// Fills a tape's open places, by one call of each function.
    pub(crate) fn fill(&self, tape: &mut Tape) {
        if let Some([x, y]) = tape.kernel.asked() {
            let found = self.kernels(x, y);
            tape.kernel.fill(&found);
        }
        if let Some([x, _]) = tape.source.asked() {
            let found = self.sources(x);
            tape.source.fill(&found);
        }
    }

    /// The equation of the functions on these intervals, or on [0, 1] on every axis, with these edges of cells.
    pub(crate) fn model(self: &Arc<Self>, domain: &[[f64; 2]], edges: &[Vec<f64>]) -> CubeModel {
        fn of<const D: usize>(caller: &Arc<Caller>) -> CubeModel {
            let (kernel, source) = (Arc::clone(caller), Arc::clone(caller));
            CubeModel::from_fn::<D>(move |x, y| kernel.kernel(x, y), move |x| source.source(x))
        }
        let model = match self.functions().dimension {
            1 => of::<1>(self),
            2 => of::<2>(self),
            3 => of::<3>(self),
            4 => of::<4>(self),
            5 => of::<5>(self),
            _ => of::<6>(self),
        };
        let model = model.with_edges(edges.to_vec());
        match domain {
            [] => model,
            domain => model.on(domain.to_vec()),
        }
    }

    pub(crate) fn dimension(&self) -> usize {
        self.functions().dimension
    }
}
