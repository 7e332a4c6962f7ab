//! The global estimate of a scene: means of u over cells, and over what consists of them.
//!
//! T_K of a polynomial on a cell that others hide in part has no closed form, so that there are no values at points. Means over cells need
//! none: the estimates of e's coefficients of degree 0 are those of its means, and no projection loses anything.

use std::sync::Arc;

use fredholm_core::global::{BasisScores, GlobalTask};
use fredholm_core::{LastStep, Lights as _, Real};
use fredholm_model::heat::RadiativeExchange as _;
use fredholm_model::numbers::largest;
use fredholm_model::{
    Error, GlobalField, GlobalQuantity, GlobalRequest, GlobalSystem, IMAGE_HEAD, MeshCell, Region,
    WithGlobalJob, in_scalar,
};
use fredholm_scene::{Mean, Point, areas};

use crate::partition::Cut;
use crate::places::Place;
use crate::system::SceneSystem;

impl<'m> GlobalSystem<'m> for SceneSystem<'m> {
    fn degree(&self) -> usize {
        self.cut.degree
    }

    fn most_degree(&self) -> usize {
        0
    }

    fn degrees(&self, _: usize) -> Vec<usize> {
        vec![0]
    }

    fn cells(&self) -> usize {
        self.cut.cells()
    }

    /// The area of a cell; of those of the sky, in which no walk starts, 1.
    fn measure(&self, cell: usize) -> f64 {
        self.cut.faces.get(cell).map_or(1.0, |own| own.area)
    }

    fn sizes(&self) -> [f64; 2] {
        [largest(self.solution.v()), self.radius_bound]
    }

    fn walks(
        &self,
        request: &GlobalRequest<'_>,
        then: &mut WithGlobalJob<'_>,
    ) -> Result<(), Error> {
        in_scalar!(self.cut.scalar, F => {
            let tables = self.cut.tables::<F>()?;
            let radiosity = tables.radiosity()?;
            let equation = LastStep(&radiosity);
            let vectors = self.solution.for_walks::<F>()?;
            let neighbour = self.cut.neighbour(Some(&vectors), &equation)?;
            let geometry = radiosity.geometry();
            let faces: Vec<u32> = (0..geometry.faces().len() as u32).collect();
            let ends = areas(geometry, &faces)?;
            let starts = Mean::new(geometry, &faces, &ends)?;
            let scores = BasisScores::<_, 1>(&radiosity);
            let options = request.walk.for_core();
            then(&GlobalTask::new(&equation, &starts, &*neighbour, &scores, options))
        })
    }

    fn field(
        &self,
        _: &GlobalRequest<'_>,
        rows: Vec<f64>,
    ) -> Result<Box<dyn GlobalField + 'm>, Error> {
        let cut = &self.cut;
        let radiosity = cut.wide.radiosity()?;
        let (mut means, mut mesh) = (Vec::new(), Vec::new());
        for (number, v) in self
            .solution
            .v()
            .iter()
            .step_by(cut.functions())
            .enumerate()
        {
            let Some((face, corners)) = radiosity.corners(number) else {
                continue;
            };
            let place = cut.model.scene.place(face as usize);
            let part = place.map_or(usize::MAX, |place| place.surface);
            let position = corners[0];
            let known = radiosity.known(&Point { face, position });
            // As walks have it.
            means.push(known + in_scalar!(cut.scalar, F => F::from_f64(*v).to_f64()));
            let corners = corners.into_iter();
            let corners = corners.map(|corner| cut.model.scene.moved_out(corner));
            mesh.push(MeshCell {
                part,
                corners: corners.collect(),
            });
        }
        Ok(Box::new(SceneField {
            cut: Arc::clone(cut),
            means,
            mesh,
            rows,
        }))
    }
}

/// Means over cells.
struct SceneField<'m> {
    cut: Arc<Cut<'m>>,
    /// The mean of v over each cell, with the emission that no walk scores.
    means: Vec<f64>,
    mesh: Vec<MeshCell>,
    /// Estimates of the mean of what is left: rows of a number for every cell, with those of the sky.
    rows: Vec<f64>,
}

impl SceneField<'_> {
    /// Adds `share` times a quantity's mean over a cell.
    fn add(&self, quantity: GlobalQuantity, cell: usize, share: f64, out: &mut [f64]) {
        let faces = self.cut.model.scene.faces();
        let number = self.cut.faces[cell].face as usize;
        let face = &faces[number];
        let (reflectance, emission) = (face.reflectance, face.emission);
        // What leaves a mirror diffusely.
        let part = 1.0 - self.cut.model.scene.specular(number);
        // a u + b: H = (u − F)/ρ, and the net flux F − (1 − ρ) H.
        let [a, b] = match quantity {
            GlobalQuantity::U => [part, 0.0],
            GlobalQuantity::Temperature => [1.0, 0.0],
            GlobalQuantity::Irradiance | GlobalQuantity::Transmission => {
                [1.0 / reflectance, -emission / reflectance]
            }
            GlobalQuantity::NetFlux => {
                let absorbed = (1.0 - reflectance) / reflectance;
                [-part * absorbed, part * (emission + absorbed * emission)]
            }
        };
        out[0] += share * (a * self.means[cell] + b);
        let rows = self.rows.iter().skip(cell).step_by(self.cut.cells());
        for (out, row) in out[IMAGE_HEAD..].iter_mut().zip(rows) {
            *out += share * a * row;
        }
    }

    fn width(&self) -> usize {
        IMAGE_HEAD + self.rows()
    }
}

impl GlobalField for SceneField<'_> {
    fn rows(&self) -> usize {
        self.rows.len() / self.cut.cells()
    }

    fn images(&self, quantity: GlobalQuantity, regions: &[Region]) -> Result<Vec<f64>, Error> {
        let mut out = vec![0.0; regions.len() * self.width()];
        for (region, out) in regions.iter().zip(out.chunks_exact_mut(self.width())) {
            let Place::Faces(faces) = Place::new(&self.cut.model.scene, region)? else {
                return Err(Error::Region {
                    message: "the global estimate of a scene has means over cells and surfaces, and no values at points"
                        .to_owned(),
                });
            };
            let own = || {
                let cells = self.cut.faces.iter().enumerate();
                cells.filter(|(_, cell)| faces.binary_search(&cell.face).is_ok())
            };
            let (asked, place) = region.asked();
            let is_black =
                |face: &u32| self.cut.model.scene.faces()[*face as usize].reflectance <= 0.0;
            if asked != GlobalQuantity::U && faces.iter().any(is_black) {
                return Err(Error::Region {
                    message: "the global estimate of a scene is one of u, which tells no irradiance of a black surface: leave `global` out, or ask for all faces (`fredholm faces`)"
                        .to_owned(),
                });
            }
            // A flux is that out of all of the area, unless it is a target.
            let area: f64 = match quantity {
                GlobalQuantity::NetFlux => 1.0,
                _ => own().map(|(_, cell)| cell.area).sum(),
            };
            let quantity = match asked {
                GlobalQuantity::U => quantity,
                asked => asked,
            };
            for (number, cell) in own() {
                self.add(quantity, number, cell.area / area, out);
            }
            if asked == GlobalQuantity::Temperature {
                out[0] += self.cut.model.hidden(place).unwrap_or(0.0);
            }
        }
        Ok(out)
    }

    fn mesh(&self) -> &[MeshCell] {
        &self.mesh
    }

    fn mesh_images(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.mesh.len() * self.width()];
        for (cell, out) in out.chunks_exact_mut(self.width()).enumerate() {
            self.add(GlobalQuantity::U, cell, 1.0, out);
        }
        out
    }
}
