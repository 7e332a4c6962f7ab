//! The global estimate of a room.

mod means;
mod picture;

use std::sync::OnceLock;

use fredholm_core::Real;
use fredholm_core::galerkin::legendre;
use fredholm_core::global::{BasisScores, GlobalTask, Scores};
use fredholm_model::heat::RadiativeExchange as _;
use fredholm_model::numbers::{dot, largest};
use fredholm_model::{
    CellNodes, Error, GlobalField, GlobalQuantity, GlobalRequest, GlobalSystem, IMAGE_HEAD, Region,
    WalkOptions, WithGlobalJob, in_scalar, known_first, v_of_walks,
};
use fredholm_rayon::fill_rows;
use fredholm_room::{Point, Room, Seen, Tables};
use fredholm_variance::gauss;

use crate::of_degree;
use crate::partition::RoomPartition;
use crate::system::RoomSystem;

/// The largest degree of scores: that up to which moments are exact to rounding.
const MOST_DEGREE: usize = 4;

/// Gauss points of a cell beyond the degree, where F + T_K v is made a polynomial.
const MORE_POINTS: usize = 1;

/// Seconds of a mean over all walls: of a wall and a cell, and of two walls, at whose shadows cells are halved. Measured with 4, 10 and 28 walls and
/// 40 to 1,000 cells of degree 0 and 2, within a factor of 2.
const MEAN_OF_CELL: f64 = 0.45e-6;
const MEAN_OF_WALLS: f64 = 6.5e-6;

impl<'m> RoomSystem<'m> {
    fn walks_in<F: Real>(
        &self,
        request: &GlobalRequest<'_>,
        then: &mut WithGlobalJob<'_>,
    ) -> Result<(), Error> {
        // Walks score what surfaces emit, too.
        let walk = WalkOptions {
            last_step: false,
            ..*request.walk
        };
        let tables = Tables::<F>::new(&self.cut.model.scene, &self.cut.mesh);
        let room = tables.room();
        self.with_any_neighbour(&room, &walk, |follow| {
            of_degree!(request.degree, B => {
                let scores: &(dyn Scores<Point<F>> + Sync) = &BasisScores::<_, B>(&room);
                let options = walk.for_core();
                let job: GlobalTask<'_, _, _, _, _> =
                    GlobalTask::new(&room, &room, &*follow.neighbour, scores, options);
                let nodes = CellNodes {
                    cells: self.cells(),
                    dimension: 1,
                    points: B,
                    share: 1.0,
                };
                let known = known_first(request, scores, nodes, &|cell, t| {
                    let x = room.inside(cell, F::from_f64(*t.first()?))?;
                    let (x, first) = job.first(x);
                    Some((x, first.to_f64()))
                })?;
                then(&job.with_known(&known))
            })
        })
    }
}

/// Walks score in every state, or in their starts if the room is open.
impl<'m> GlobalSystem<'m> for RoomSystem<'m> {
    fn degree(&self) -> usize {
        self.cut.cut.degree
    }

    fn most_degree(&self) -> usize {
        MOST_DEGREE
    }

    fn degrees(&self, degree: usize) -> Vec<usize> {
        (0..=degree).collect()
    }

    fn cells(&self) -> usize {
        self.cut.mesh.len()
    }

    /// Integrals over cells, and not over points.
    fn mean_points(&self, degree: usize) -> f64 {
        let walls = self.cut.model.scene.geometry().walls().len() as f64;
        let seconds = walls * (MEAN_OF_CELL * self.cells() as f64 + MEAN_OF_WALLS * walls);
        seconds / self.point_seconds(degree)
    }

    fn measure(&self, cell: usize) -> f64 {
        self.cut.mesh.cells().length(cell)
    }

    fn sizes(&self) -> [f64; 2] {
        let solution = &self.solution;
        [largest(&solution.v), solution.radius_bound]
    }

    fn walks(
        &self,
        request: &GlobalRequest<'_>,
        then: &mut WithGlobalJob<'_>,
    ) -> Result<(), Error> {
        in_scalar!(self.cut.cut.scalar, F => self.walks_in::<F>(request, then))
    }

    fn field(
        &self,
        request: &GlobalRequest<'_>,
        rows: Vec<f64>,
    ) -> Result<Box<dyn GlobalField + 'm>, Error> {
        Ok(Box::new(self.room_field(request, rows)?))
    }
}

impl<'m> RoomSystem<'m> {
    fn room_field(
        &self,
        request: &GlobalRequest<'_>,
        rows: Vec<f64>,
    ) -> Result<RoomField<'m>, Error> {
        let v = v_of_walks(&self.solution, self.cut.cut.scalar)?;
        let (own, functions) = (self.degree() + 1, request.degree + 1);
        let mut all = Vec::with_capacity(self.cells() * functions + rows.len());
        for v in v.chunks_exact(own) {
            // A polynomial of a lower degree is one of a higher.
            all.extend(v);
            all.resize(all.len() + functions - own, 0.0);
        }
        all.extend(rows);
        let cut = &self.cut;
        Ok(RoomField {
            tables: Tables::new(&cut.model.scene, &cut.mesh),
            cut: cut.clone(),
            functions,
            rows: all,
            lifted: OnceLock::new(),
        })
    }
}

/// v and other piecewise polynomials of one degree, and what makes T_K of them.
struct RoomField<'m> {
    cut: RoomPartition<'m>,
    tables: Tables<f64>,
    /// Functions on a cell.
    functions: usize,
    /// v first.
    rows: Vec<f64>,
    /// F + T_K v and the images of all other rows as such polynomials: what points between the walls see.
    lifted: OnceLock<Vec<f64>>,
}

impl RoomField<'_> {
    fn unknowns(&self) -> usize {
        self.cut.mesh.len() * self.functions
    }

    /// The irradiance at a point in terms of all functions.
    fn irradiance(&self, room: &Room<'_, f64>, x: &Point<f64>, out: &mut [f64]) {
        of_degree!(self.functions - 1, B => room.all_form_factors::<B>(x, out));
    }

    /// A quantity at a point of a wall: a constant, with what comes from outside, and a multiple of the irradiance from walls.
    fn terms_at(
        &self,
        quantity: GlobalQuantity,
        room: &Room<'_, f64>,
        x: &Point<f64>,
    ) -> Result<[f64; 2], Error> {
        let [own, factor] = self.terms(quantity, x.wall())?;
        Ok([own + factor * room.from_outside(x), factor])
    }

    /// A quantity on a wall: a constant, and a multiple of the irradiance.
    fn terms(&self, quantity: GlobalQuantity, wall: usize) -> Result<[f64; 2], Error> {
        let walls = self.cut.model.scene.geometry();
        let wall = walls.walls().get(wall);
        let wall = wall.ok_or(Error::Internal("a wall that is none"))?;
        Ok(match quantity {
            GlobalQuantity::U | GlobalQuantity::Temperature => [wall.emission, wall.reflectance],
            GlobalQuantity::Irradiance | GlobalQuantity::Transmission => [0.0, 1.0],
            GlobalQuantity::NetFlux => [wall.emission, wall.reflectance - 1.0],
        })
    }

    /// A constant, and a multiple of the moments times every row.
    fn contract(
        &self,
        [constant, factor]: [f64; 2],
        moments: &[f64],
        rows: &[f64],
        out: &mut [f64],
    ) {
        let Some(([head, moved], images)) = out.split_first_chunk_mut::<IMAGE_HEAD>() else {
            return;
        };
        let mut rows = rows.chunks_exact(self.unknowns());
        *head = constant + factor * rows.next().map_or(f64::NAN, |v| dot(moments, v));
        *moved = 0.0;
        for (image, row) in images.iter_mut().zip(rows) {
            *image = factor * dot(moments, row);
        }
    }

    fn image(
        &self,
        room: &Room<'_, f64>,
        quantity: GlobalQuantity,
        region: &Region,
        out: &mut [f64],
    ) -> Result<(), Error> {
        let mut moments = vec![0.0; self.unknowns()];
        match region {
            Region::Irradiance(of) | Region::Transmission(of) => {
                return self.image(room, GlobalQuantity::Irradiance, of, out);
            }
            Region::NetFlux(of) => {
                self.image(room, GlobalQuantity::NetFlux, of, out)?;
                // Of a part it is that out of all of its length.
                if let Region::Part(_) | Region::Parts(_) | Region::Whole = **of {
                    let elements = self.cut.model.elements(of);
                    let length: f64 = elements.iter().map(|own| own.size).sum();
                    out.iter_mut().for_each(|out| *out /= length);
                }
            }
            Region::Temperature(of) => {
                self.image(room, quantity, of, out)?;
                out[0] += self.cut.model.hidden(of).unwrap_or(0.0);
            }
            Region::On(surface, t) => {
                let (wall, fraction) = self.cut.model.scene.along(*surface, *t)?;
                let x = room.on_wall(wall, fraction)?;
                let terms = self.terms_at(quantity, room, &x)?;
                // Nothing of the irradiance arrives in u of a black wall.
                if terms[1] != 0.0 {
                    self.irradiance(room, &x, &mut moments);
                }
                self.contract(terms, &moments, &self.rows, out);
            }
            Region::Point(x) => {
                if quantity != GlobalQuantity::U {
                    return Err(Error::Internal("no light falls on a point in the air"));
                }
                let position = [0, 1].map(|k| x.get(k).copied().unwrap_or(f64::NAN));
                let position = self.cut.model.folded(position);
                let seen = Seen { room, position };
                seen.moments(self.functions, &mut moments);
                let rows = self.lifted(room)?;
                self.contract([seen.sky(), 1.0], &moments, rows, out);
                // What the highest degree is worth.
                let highest = (rows.iter().zip(&moments)).skip(self.functions - 1);
                let parts = highest.step_by(self.functions).map(|(v, m)| v * m);
                out[1] = parts.sum::<f64>().abs();
            }
            region => {
                let walls = self.cut.model.walls(region)?;
                let own = walls.into_iter().flatten();
                let own = own.map(|wall| Ok((wall, self.terms(quantity, wall)?)));
                let own = own.collect::<Result<Vec<_>, Error>>()?;
                let is_mean = quantity != GlobalQuantity::NetFlux;
                let means::Means { constant, error } =
                    means::moments(room, &own, is_mean, &self.rows, &mut moments);
                self.contract([constant, 1.0], &moments, &self.rows, out);
                out[1] = error;
            }
        }
        Ok(())
    }

    /// F + T_K v and all images as piecewise polynomials.
    fn lifted(&self, room: &Room<'_, f64>) -> Result<&[f64], Error> {
        if let Some(lifted) = self.lifted.get() {
            return Ok(lifted);
        }
        let (cells, rows) = (self.cut.mesh.len(), self.rows.len() / self.unknowns());
        let functions = self.functions;
        let rule = gauss(functions + MORE_POINTS)?;
        // By cell, then by row.
        let mut by_cell = vec![0.0; self.rows.len()];
        fill_rows(&mut by_cell, rows * functions, |cell, out| {
            let mut moments = vec![0.0; self.unknowns()];
            let mut image = vec![0.0; rows + 1];
            for (t, weight) in &rule {
                let x = room.inside(cell, 0.5 + 0.5 * t);
                let x = x.ok_or(Error::Internal("a cell that is none"))?;
                let terms = self.terms_at(GlobalQuantity::U, room, &x)?;
                self.irradiance(room, &x, &mut moments);
                self.contract(terms, &moments, &self.rows, &mut image);
                let psi: [f64; MOST_DEGREE + 1] = legendre(*t);
                let values = [image[0]]
                    .into_iter()
                    .chain(image[IMAGE_HEAD..].iter().copied());
                for (out, value) in out.chunks_exact_mut(functions).zip(values) {
                    for (out, psi) in out.iter_mut().zip(psi) {
                        *out += 0.5 * weight * value * psi;
                    }
                }
            }
            Ok::<(), Error>(())
        })?;
        let mut all = vec![0.0; self.rows.len()];
        for (cell, own) in by_cell.chunks_exact(rows * functions).enumerate() {
            for (row, own) in own.chunks_exact(functions).enumerate() {
                let from = (row * cells + cell) * functions;
                all[from..from + functions].copy_from_slice(own);
            }
        }
        Ok(self.lifted.get_or_init(|| all))
    }
}

impl GlobalField for RoomField<'_> {
    fn rows(&self) -> usize {
        (self.rows.len() / self.unknowns()).saturating_sub(1)
    }

    fn images(&self, quantity: GlobalQuantity, regions: &[Region]) -> Result<Vec<f64>, Error> {
        let width = IMAGE_HEAD + self.rows();
        let mut out = vec![0.0; regions.len() * width];
        let room = self.tables.room();
        fill_rows(&mut out, width, |region, out| {
            self.image(&room, quantity, &regions[region], out)
        })?;
        Ok(out)
    }
}
