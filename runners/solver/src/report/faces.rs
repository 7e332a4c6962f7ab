//! The report of a quantity on every face of a scene.

use fredholm_model::numbers::{aligned, short, with_error};
use serde::Serialize;

use super::Columns;
use super::csv::harmless;
use super::text::with_unit;
use crate::scene::FaceValues;
use crate::{Choices as _, Error, GlobalQuantity, Model as _, SceneModel};

/// A file that cannot be written.
const FAILED: Error = Error::Internal("faces that are no CSV");

/// A quantity on every face of a scene. The serialised names are stable; fields may be added.
///
/// ```
/// use fredholm::report::FacesReport;
/// use fredholm::scene::{Enclosure, FacesRequest, Material, NamedSurface, shapes};
/// use fredholm::{GlobalQuantity, Scalar, SceneModel, Settings};
///
/// let polygons = shapes::room([0.0; 3], [1.0; 3]).surfaces.concat();
/// let material = Material { reflectance: 0.0, emission: 1.0 };
/// let walls = NamedSurface { name: "walls".to_owned(), polygons, material };
/// let cube = SceneModel::new(vec![walls], Enclosure::Closed, Scalar::F64)?;
/// let (settings, quantity) = (Settings::default(), GlobalQuantity::Irradiance);
/// let request = FacesRequest { quantity, walk: &settings.walk_options(), is_plain: true };
/// let found = cube.on_faces(&settings.discretisation(), &request, &())?;
/// let report = FacesReport::new(&cube, quantity, &found);
/// assert_eq!(report.surfaces[0].faces, 6);
/// assert!(report.csv()?.starts_with("surface,area,irradiance,std_error,band\nwalls,1.0,"));
/// # Ok::<(), fredholm::Error>(())
/// ```
#[derive(Clone, Debug, Serialize)]
pub struct FacesReport {
    /// The kind of the problem.
    pub problem: &'static str,
    /// The quantity: `u`, `irradiance` or `net_flux`.
    pub quantity: &'static str,
    /// The unit, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// The surfaces.
    pub surfaces: Vec<SurfaceFaces>,
    /// The number of the surface of every face.
    pub surface_of: Vec<usize>,
    /// The area of every face that others do not cover.
    pub areas: Vec<f64>,
    /// The mean over every face.
    pub values: Vec<f64>,
    /// The standard error of each.
    pub std_errors: Vec<f64>,
    /// Half the width of a band that holds all values at once with probability 95 %, at every face; NaN of fewer than 32 walks a
    /// face.
    pub bands: Vec<f64>,
    /// The largest standard error that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_error: Option<f64>,
    /// The number of all walks.
    pub walks: u64,
    /// Seconds that all took.
    pub seconds: f64,
    /// The corners of every face.
    #[serde(skip)]
    corners: Vec<Vec<[f64; 3]>>,
}

/// The faces of a surface together.
///
/// ```
/// use fredholm::report::SurfaceFaces;
///
/// let walls = SurfaceFaces { faces: 4, area: 10.0, ..SurfaceFaces::default() };
/// assert_eq!(walls.area, 10.0);
/// ```
#[derive(Clone, Debug, Default, Serialize)]
pub struct SurfaceFaces {
    /// The name.
    pub name: String,
    /// The number of faces.
    pub faces: usize,
    /// Their area.
    pub area: f64,
    /// The mean over all of them.
    pub mean: f64,
    /// The standard error of that.
    pub mean_std_error: f64,
    /// The smallest value of a face.
    pub smallest: f64,
    /// The largest.
    pub largest: f64,
    /// The largest standard error.
    pub largest_std_error: f64,
}

impl SurfaceFaces {
    fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            smallest: f64::INFINITY,
            largest: f64::NEG_INFINITY,
            ..Self::default()
        }
    }

    fn row(&self) -> Vec<String> {
        vec![
            self.name.clone(),
            self.faces.to_string(),
            with_error(self.mean, Some(self.mean_std_error)),
            short(self.smallest),
            short(self.largest),
            short(self.largest_std_error),
        ]
    }
}

impl FacesReport {
    /// The report of these values of a model.
    #[must_use]
    pub fn new(model: &SceneModel, quantity: GlobalQuantity, found: &FaceValues) -> Self {
        let scene = model.scene();
        let place = |face| scene.place(face).map_or(0, |place| place.surface);
        let surface_of: Vec<usize> = (0..found.values.len()).map(place).collect();
        let mut surfaces: Vec<_> =
            (model.names().iter().map(|name| SurfaceFaces::new(name))).collect();
        let areas: Vec<f64> = scene.faces().iter().map(|face| face.area).collect();
        for ((&surface, &area), face) in surface_of.iter().zip(&areas).zip(&found.values) {
            let Some(own) = surfaces.get_mut(surface) else {
                continue;
            };
            own.faces += 1;
            own.area += area;
            own.mean += area * face.value;
            own.mean_std_error += (area * face.error).powi(2);
            own.smallest = own.smallest.min(face.value);
            own.largest = own.largest.max(face.value);
            own.largest_std_error = own.largest_std_error.max(face.error);
        }
        for own in &mut surfaces {
            own.mean /= own.area;
            own.mean_std_error = own.mean_std_error.sqrt() / own.area;
        }
        let corners = scene.faces().iter().map(|face| face.polygon().to_vec());
        Self {
            problem: model.about().kind,
            quantity: quantity.word(),
            unit: match quantity {
                GlobalQuantity::Irradiance => model.about().irradiance_unit,
                _ => model.about().unit,
            },
            surfaces,
            surface_of,
            areas,
            values: found.values.iter().map(|own| own.value).collect(),
            std_errors: found.values.iter().map(|own| own.error).collect(),
            bands: found.bands.clone(),
            target_error: found.bound,
            walks: found.walks,
            seconds: found.seconds,
            corners: corners.collect(),
        }
    }

    /// The report as a table for people: what the faces of every surface have.
    #[must_use]
    pub fn table(&self) -> String {
        let value = with_unit(&self.quantity.replace('_', " "), self.unit);
        let head = [
            "surface",
            "faces",
            &value,
            "smallest",
            "largest",
            "largest error",
        ];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        // Others may cover all of one.
        let seen = self.surfaces.iter().filter(|own| own.faces > 0);
        rows.extend(seen.map(SurfaceFaces::row));
        let widest = self.bands.iter().copied().reduce(f64::max);
        let band = widest.filter(|_| !self.bands.iter().any(|band| band.is_nan()));
        let band = band.map_or(String::new(), |widest| {
            format!(
                "band: 95 % on all faces together, at most ± {}\n",
                short(widest)
            )
        });
        format!(
            "{} of {} faces\n\n{}\n{band}{} walks, {} s\n",
            self.problem,
            self.values.len(),
            aligned(&rows),
            self.walks,
            short(self.seconds)
        )
    }

    /// All faces as CSV: a row for each, with its surface, area, value and standard error.
    ///
    /// # Errors
    /// [`Error::Internal`].
    pub fn csv(&self) -> Result<String, Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let head = ["surface", "area", self.quantity, "std_error", "band"];
        writer.write_record(head).map_err(|_| FAILED)?;
        let names: Vec<String> = self.names().map(harmless).collect();
        for (number, name) in names.iter().enumerate() {
            let columns = [&self.areas, &self.values, &self.std_errors, &self.bands];
            writer
                .serialize((name, columns.map(|column| column[number])))
                .map_err(|_| FAILED)?;
        }
        let bytes = writer.into_inner().map_err(|_| FAILED)?;
        String::from_utf8(bytes).map_err(|_| FAILED)
    }

    /// The faces as arrays: their surfaces, middles, corners, areas, values and standard errors.
    #[must_use]
    pub fn columns(&self) -> Columns {
        let middle = |corners: &Vec<[f64; 3]>| {
            let sum = |axis: usize| corners.iter().map(|corner| corner[axis]).sum::<f64>();
            (0..3)
                .map(|axis| sum(axis) / corners.len() as f64)
                .collect()
        };
        Columns {
            names: self.names().map(str::to_owned).collect(),
            coordinates: self.corners.iter().map(middle).collect(),
            of_targets: vec![
                (self.quantity, self.values.clone()),
                ("std_error", self.std_errors.clone()),
                ("band", self.bands.clone()),
                ("area", self.areas.clone()),
            ],
            of_cells: Vec::new(),
            mesh: self.corners.clone(),
        }
    }

    /// The name of the surface of every face.
    fn names(&self) -> impl Iterator<Item = &str> {
        self.surface_of
            .iter()
            .map(|&own| self.surfaces.get(own).map_or("", |own| own.name.as_str()))
    }
}
