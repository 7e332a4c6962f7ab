//! Scenes of arrays: what goes in, and what comes out for every face.

use std::collections::BTreeMap;

use fredholm::room::Material;
use fredholm::scene::{FaceValues, Scene};
use fredholm_factors::{Factors, FactorsError, Sights};
use fredholm_file::scene::{ArraySurface, Known, SceneArrays, SceneFile, less_specular};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::failure::exception;

/// Faces of surfaces, in arrays.
#[pyclass(frozen, module = "fredholm._fredholm")]
#[derive(Debug)]
pub(crate) struct Mesh {
    arrays: SceneArrays,
}

/// Name, whether it is seen from both sides, and reflectance, emission, emissivity, temperature, net flux, specular
/// reflectance and absorptance of sunlight, NaN where one is not given.
type GivenSurface = (String, bool, [f64; 7]);

/// The numbers of an array that count or number something.
fn counts(array: &PyReadonlyArray1<'_, i64>) -> Vec<usize> {
    let all = array.as_array();
    // What is below 0 numbers nothing.
    all.iter()
        .map(|&number| usize::try_from(number).unwrap_or(usize::MAX))
        .collect()
}

#[pymethods]
impl Mesh {
    /// Vertices, the numbers of those of all faces, how many each face has, and the surface of each.
    #[new]
    fn new(
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f64>,
        corners: PyReadonlyArray1<'_, i64>,
        number_of_corners: PyReadonlyArray1<'_, i64>,
        surface_of: PyReadonlyArray1<'_, i64>,
        surfaces: Vec<GivenSurface>,
    ) -> PyResult<Self> {
        let vertices = vertices.as_array();
        let vertices = vertices.rows().into_iter().map(|row| {
            let at = |k: usize| row.get(k).copied().unwrap_or(f64::NAN);
            [at(0), at(1), at(2)]
        });
        let is_heat = |own: &GivenSurface| own.2[2..5].iter().any(|number| !number.is_nan());
        let arrays = SceneArrays {
            vertices: vertices.collect(),
            corners: counts(&corners),
            counts: counts(&number_of_corners),
            surface_of: counts(&surface_of),
            is_heat: surfaces.iter().any(is_heat),
            surfaces: surfaces.into_iter().map(surface).collect(),
        };
        let known = arrays.surfaces.len();
        if arrays.surface_of.iter().any(|&surface| surface >= known) {
            let message = format!("a face of a surface that is none of {known}");
            return Err(exception(py, "InputError", message));
        }
        Ok(Self { arrays })
    }
}

impl Mesh {
    pub(crate) const fn arrays(&self) -> &SceneArrays {
        &self.arrays
    }
}

fn surface((name, two_sided, numbers): GivenSurface) -> ArraySurface {
    let [
        reflectance,
        emission,
        emissivity,
        temperature,
        net_flux,
        specular,
        absorptance,
    ] = numbers.map(|number| Some(number).filter(|number| !number.is_nan()));
    let specular = specular.unwrap_or(0.0);
    let material = match (net_flux, emissivity.or(temperature)) {
        (Some(net_flux), _) => less_specular(Material::flux(net_flux), specular),
        (None, Some(_)) => {
            let emissivity = emissivity.unwrap_or(1.0 - specular);
            less_specular(
                Material::grey(emissivity, temperature.unwrap_or(0.0)),
                specular,
            )
        }
        (None, None) => Material {
            reflectance: reflectance.unwrap_or(0.0),
            emission: emission.unwrap_or(0.0),
        },
    };
    let known = match emissivity.is_some() && temperature.or(net_flux).is_none() {
        true => Known::Emissivity,
        false => Known::Material,
    };
    ArraySurface {
        name,
        material,
        emissivity: emissivity.filter(|_| net_flux.is_some()),
        specular,
        absorptance,
        known,
        two_sided,
    }
}

/// A quantity on every face, and on the backs of those that are seen from both sides.
#[pyclass(frozen, get_all, module = "fredholm._fredholm")]
#[derive(Debug)]
pub(crate) struct FaceArrays {
    values: Py<PyArray1<f64>>,
    std_errors: Py<PyArray1<f64>>,
    back_values: Py<PyArray1<f64>>,
    back_std_errors: Py<PyArray1<f64>>,
    /// The area of every face that others do not cover.
    areas: Py<PyArray1<f64>>,
    unit: Option<&'static str>,
    bands: Py<PyArray1<f64>>,
    bound: Option<f64>,
    walks: u64,
    seconds: f64,
}

/// The means over the faces of arrays, which may be several of the scene's, or none where others cover them: NaN.
pub(crate) fn face_arrays(
    py: Python<'_>,
    (scene, file): (&Scene, Option<&SceneFile>),
    arrays: &SceneArrays,
    found: &FaceValues,
    unit: Option<&'static str>,
) -> FaceArrays {
    let count = arrays.counts.len();
    // The sums of areas, of these times values, of squares of these times errors, and of these times bands, of fronts and of backs.
    let mut sums = [vec![[0.0; 4]; count], vec![[0.0; 4]; count]];
    for (face, own) in found.values.iter().enumerate() {
        let place = scene.place(face);
        let number = place.and_then(|at| file?.number_of_face(at.surface, at.polygon));
        let (Some(place), Some(number)) = (place, number) else {
            continue;
        };
        let side = usize::from(place.surface >= arrays.surfaces.len());
        let area = scene.faces()[face].area;
        if let Some([sum, value, error, band]) = sums[side].get_mut(number as usize) {
            *sum += area;
            *value += area * own.value;
            *error += (area * own.error).powi(2);
            *band += area * found.bands[face];
        }
    }
    let array = |side: usize, of: fn(&[f64; 4]) -> f64| {
        let all: Vec<f64> = sums[side].iter().map(of).collect();
        all.into_pyarray(py).unbind()
    };
    let value = |own: &[f64; 4]| own[1] / own[0];
    let error = |own: &[f64; 4]| own[2].sqrt() / own[0];
    FaceArrays {
        values: array(0, value),
        std_errors: array(0, error),
        back_values: array(1, value),
        back_std_errors: array(1, error),
        areas: array(0, |own| own[0]),
        unit,
        bands: array(0, |own| own[3] / own[0]),
        bound: found.bound,
        walks: found.walks,
        seconds: found.seconds,
    }
}

/// Form factors between surfaces that are not 0, row by row.
#[pyclass(frozen, get_all, module = "fredholm._fredholm")]
#[derive(Debug)]
pub(crate) struct SparseArrays {
    names: Vec<String>,
    areas: Py<PyArray1<f64>>,
    rows: Py<PyArray1<i64>>,
    columns: Py<PyArray1<i64>>,
    factors: Py<PyArray1<f64>>,
    error: f64,
}

/// The same without Python.
#[derive(Debug)]
pub(crate) struct Sparse {
    areas: Vec<f64>,
    /// A_I F_IJ of every pair.
    exchange: BTreeMap<(usize, usize), f64>,
    error: f64,
}

/// Form factors between surfaces, by rows of faces on all threads.
pub(crate) fn sparse_factors(scene: &Scene, error: f64) -> Result<Sparse, FactorsError> {
    let sights = Sights::new(scene, error)?;
    let faces = (0..scene.faces().len()).into_par_iter();
    let all = Factors::new(scene, faces.map(|face| sights.row(face)).collect())?;
    let surface = |face: usize| scene.place(face).map_or(usize::MAX, |place| place.surface);
    let mut areas = vec![0.0; scene.surfaces()];
    let mut exchange = BTreeMap::new();
    for (face, area) in all.areas().iter().enumerate() {
        let own = surface(face);
        if let Some(sum) = areas.get_mut(own) {
            *sum += area;
        }
        for &(other, amount) in all.row(face) {
            let other = surface(other as usize);
            *exchange.entry((own, other)).or_insert(0.0) += amount;
            *exchange.entry((other, own)).or_insert(0.0) += amount;
        }
    }
    Ok(Sparse {
        areas,
        exchange,
        error: all.error(),
    })
}

impl Sparse {
    pub(crate) fn to_python(&self, py: Python<'_>, names: &[String]) -> SparseArrays {
        let pairs = || self.exchange.iter();
        let rows: Vec<i64> = pairs().map(|((i, _), _)| *i as i64).collect();
        let columns: Vec<i64> = pairs().map(|((_, j), _)| *j as i64).collect();
        let factors: Vec<f64> = pairs().map(|((i, _), own)| own / self.areas[*i]).collect();
        SparseArrays {
            names: names.to_vec(),
            areas: self.areas.clone().into_pyarray(py).unbind(),
            rows: rows.into_pyarray(py).unbind(),
            columns: columns.into_pyarray(py).unbind(),
            factors: factors.into_pyarray(py).unbind(),
            error: self.error,
        }
    }
}
