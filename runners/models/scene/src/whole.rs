//! The whole function of a scene: means of u over cells, and over what consists of them.
//!
//! T_K of a polynomial on a cell that others hide in part has no closed form, so that there are no values at points. Means over cells need
//! none: the estimates of e's coefficients of degree 0 are those of its means, and no projection loses anything.

use std::sync::Arc;

use fredholm_core::galerkin::{CellMap, Partition};
use fredholm_core::whole::{BasisScores, WholeTask};
use fredholm_core::{LastStep, Real};
use fredholm_model::numbers::largest;
use fredholm_model::{
    Error, IMAGE_HEAD, MeshCell, Region, WholeField, WholeQuantity, WholeRequest, WholeSystem,
    WithWholeJob, in_scalar,
};
use fredholm_scene::{FaceStarts, areas};

use crate::partition::WalkTables;
use crate::regions::Place;
use crate::system::{SceneSystem, with_sampled};

/// A solved scene whose walks score in every state.
pub(crate) struct SceneWhole<'m> {
    system: Arc<SceneSystem<'m>>,
    /// The area of every cell; of those of the sky, in which no walk starts, 1.
    measures: Vec<f64>,
}

impl<'m> SceneWhole<'m> {
    pub(crate) fn new(system: SceneSystem<'m>) -> Result<Self, Error> {
        let radiosity = system.cut.radiosity(0.5)?;
        let measure = |cell| match radiosity.measure(cell) {
            0.0 => 1.0,
            area => area,
        };
        let measures = (0..radiosity.cells()).map(measure).collect();
        Ok(Self {
            system: Arc::new(system),
            measures,
        })
    }

    fn walks_in<F: Real>(
        &self,
        request: &WholeRequest<'_>,
        then: &mut WithWholeJob<'_>,
    ) -> Result<(), Error> {
        let (system, walk) = (&*self.system, request.walk);
        let scene = system.model.scene();
        let tables = WalkTables::<F>::new(scene, &system.cut)?;
        let radiosity = tables.radiosity(&system.cut, walk.absorption)?;
        let last = LastStep(&radiosity);
        let vectors = system.solution.for_walks::<F>()?;
        let faces: Vec<u32> = (0..scene.faces().len() as u32).collect();
        let ends = areas(radiosity.geometry(), &faces)?;
        let starts = FaceStarts::new(&radiosity, &faces, &ends, scene.enclosure())?;
        let scores = BasisScores::<_, 1>(&radiosity);
        with_sampled(system.cut.degree, &vectors, &last, &mut |neighbour| {
            then(&WholeTask::new(
                &last,
                &starts,
                neighbour,
                &scores,
                walk.for_core(),
            ))
        })
    }
}

impl<'m> WholeSystem<'m> for SceneWhole<'m> {
    fn degree(&self) -> usize {
        self.system.cut.degree
    }

    fn most_degree(&self) -> usize {
        0
    }

    fn default_degree(&self) -> usize {
        0
    }

    fn degrees(&self, _: usize) -> Vec<usize> {
        vec![0]
    }

    fn cells(&self) -> usize {
        self.measures.len()
    }

    fn measure(&self, cell: usize) -> f64 {
        self.measures.get(cell).copied().unwrap_or(f64::NAN)
    }

    fn sizes(&self) -> [f64; 2] {
        let system = &self.system;
        [largest(system.solution.v()), system.radius_bound]
    }

    fn walks(&self, request: &WholeRequest<'_>, then: &mut WithWholeJob<'_>) -> Result<(), Error> {
        in_scalar!(self.system.cut.scalar, F => self.walks_in::<F>(request, then))
    }

    fn field(
        &self,
        _: &WholeRequest<'_>,
        rows: Vec<f64>,
    ) -> Result<Box<dyn WholeField + 'm>, Error> {
        let system = &self.system;
        let radiosity = system.cut.radiosity(0.5)?;
        let v = in_scalar!(system.cut.scalar, F => {
            let vectors = system.solution.for_walks::<F>()?;
            let all: Vec<f64> = vectors.v().iter().map(|v| v.to_f64()).collect();
            all
        });
        let functions = v.len() / self.measures.len().max(1);
        let mut field = SceneField {
            system: Arc::clone(system),
            cells: Vec::new(),
            mesh: Vec::new(),
            rows: rows.len() / self.measures.len().max(1),
        };
        for (number, &area) in self.measures.iter().enumerate() {
            let Some((face, corners)) = radiosity.corners(number) else {
                continue;
            };
            let place = system.model.scene().place(face as usize);
            let part = place.map_or(usize::MAX, |place| place.surface);
            field.mesh.push(MeshCell { part, corners });
            let known = radiosity.emission_of_light(face);
            let scored = rows.iter().skip(number).step_by(self.measures.len());
            let v = v.get(number * functions).copied().unwrap_or(f64::NAN);
            field.cells.push(Told {
                face,
                area,
                mean: known + v,
                rows: scored.copied().collect(),
            });
        }
        Ok(Box::new(field))
    }
}

/// What is told of a cell.
struct Told {
    face: u32,
    area: f64,
    /// The mean of v, with the emission that no walk scores.
    mean: f64,
    /// Estimates of the mean of what is left.
    rows: Vec<f64>,
}

/// Means over cells.
struct SceneField<'m> {
    system: Arc<SceneSystem<'m>>,
    cells: Vec<Told>,
    mesh: Vec<MeshCell>,
    rows: usize,
}

impl SceneField<'_> {
    /// Adds `share` times a quantity's mean over a cell.
    fn add(&self, quantity: WholeQuantity, cell: &Told, share: f64, out: &mut [f64]) {
        let face = self.system.model.scene().faces().get(cell.face as usize);
        let (reflectance, emission) = face.map_or((f64::NAN, f64::NAN), |face| {
            (face.reflectance, face.emission)
        });
        // a u + b: H = (u − F)/ρ, and the net flux F − (1 − ρ) H.
        let [a, b] = match quantity {
            WholeQuantity::U => [1.0, 0.0],
            WholeQuantity::Irradiance => [1.0 / reflectance, -emission / reflectance],
            WholeQuantity::NetFlux => {
                let absorbed = (1.0 - reflectance) / reflectance;
                [-absorbed, emission + absorbed * emission]
            }
        };
        out[0] += share * (a * cell.mean + b);
        for (out, row) in out[IMAGE_HEAD..].iter_mut().zip(&cell.rows) {
            *out += share * a * row;
        }
    }
}

impl WholeField for SceneField<'_> {
    fn rows(&self) -> usize {
        self.rows
    }

    fn images(&self, quantity: WholeQuantity, regions: &[Region]) -> Result<Vec<f64>, Error> {
        let width = IMAGE_HEAD + self.rows;
        let mut out = vec![0.0; regions.len() * width];
        for (region, out) in regions.iter().zip(out.chunks_exact_mut(width)) {
            let Place::Faces(faces) = Place::new(self.system.model.scene(), region)? else {
                return Err(Error::Region {
                    message: "the whole function of a scene has means over cells and surfaces, and no values at points"
                        .to_owned(),
                });
            };
            let mut is_in = vec![false; self.system.model.scene().faces().len()];
            for face in faces {
                if let Some(is_in) = is_in.get_mut(face as usize) {
                    *is_in = true;
                }
            }
            let own = || {
                let is_in = |cell: &&Told| is_in.get(cell.face as usize) == Some(&true);
                self.cells.iter().filter(is_in)
            };
            // A flux is that out of all of the area.
            let area: f64 = match quantity {
                WholeQuantity::NetFlux => 1.0,
                _ => own().map(|cell| cell.area).sum(),
            };
            for cell in own() {
                self.add(quantity, cell, cell.area / area, out);
            }
        }
        Ok(out)
    }

    fn mesh(&self) -> &[MeshCell] {
        &self.mesh
    }

    fn mesh_images(&self) -> Vec<f64> {
        let width = IMAGE_HEAD + self.rows;
        let mut out = vec![0.0; self.cells.len() * width];
        for (cell, out) in self.cells.iter().zip(out.chunks_exact_mut(width)) {
            self.add(WholeQuantity::U, cell, 1.0, out);
        }
        out
    }
}
