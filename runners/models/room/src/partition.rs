//! The walls of a room, cut into cells, and what they cost.

use std::sync::Arc;

use fredholm_core::Real;
use fredholm_core::galerkin::collatz_wielandt_bounds;
use fredholm_model::cost::{Cost, PointwisePairs, WalkCost};
use fredholm_model::{
    Discretisation, Error, Goal, Pairs, Partitioned, Prepared, Request, SavedSystem, System, Then,
    WalkOptions, in_scalar,
};
use fredholm_room::{Matrix, Mesh, Tables, VisibilityTable, min_mass_ratio};

use crate::colours::WallTables;
use crate::system::plain;
use crate::{Colours, DEFAULT_CELLS, RoomModel, with_equation};

/// The relative residual at which the Gauss–Seidel iteration stops.
pub(crate) const TOLERANCE: f64 = 1e-14;
/// The most sweeps.
pub(crate) const SWEEPS: u32 = 10_000;
/// The most unknowns of degrees 0 and 1 of which all coefficients are computed for v: 130 MB, and a second of a processor at
/// degree 0. Of more unknowns v comes from as many of degree 3 as `FEW`: in furnished rooms it is as good with 10,000 cells. Of
/// higher degrees it always comes from few, at most as many as there are: coefficients of cells that see a part of each other
/// hold to some six digits, which is what v of degree 4 would have, and a step by exact irradiances leaves up to 180 times less.
const MOST_IN_PAIRS: usize = 4000;
pub(crate) const FEW: usize = 1000;
/// The functions on a cell of that solution.
const FEW_FUNCTIONS: usize = 4;
/// Cells enough to estimate a spectral radius: on 50 it is within 0.4 % of what it is on 400 in the rooms of `examples/`.
const COARSE: usize = 100;
/// Powers of the matrix.
const POWERS: u32 = 200;

/// Seconds, on the machine that all this was measured on: of a pair of the set-up, of every degree of it, and of a row's
/// cells close by.
const PAIR: f64 = 80e-9;
const MOMENTS: f64 = 340e-9;
const CLOSE: f64 = 15e-6;
/// Seconds of walks: a start, a ray for every level of the hierarchy over the walls, and a score without pairs.
const START: f64 = 25e-9;
const RAY: f64 = 38e-9;
const SCORE: f64 = 5e-9;
/// Seconds of a pointwise pair in a score, of constants, and of polynomials and every degree of them.
const PAIR_OF_CONSTANTS: f64 = 20e-9;
const PAIR_OF_POLYNOMIALS: f64 = 36e-9;
const PAIR_DEGREE: f64 = 10e-9;
/// Seconds of a score by a ray besides the ray; and of a cell's boxes in the set-up, as many rays.
const RAYS_SCORE: f64 = 130e-9;
const RAYS_OF_CELL: f64 = 3000.0;
/// Seconds of the form factor of a light, for every level of the hierarchy.
const LIGHT: f64 = 25e-9;
/// Seconds of an unknown of v from a solution on few cells.
const STEP_FROM_FEW: f64 = 25e-6;
/// Bytes of a cell's boxes, of which it seldom has more.
const RAYS_BYTES: usize = 24 << 10;

/// The tables of walks in a scalar.
#[derive(Debug)]
pub(crate) struct WalkTables<F> {
    pub(crate) tables: Tables<F>,
    pub(crate) colours: Option<WallTables<F>>,
}

impl RoomModel {
    /// Cuts the walls into cells.
    pub(crate) fn cut(&self, discretisation: &Discretisation) -> Result<RoomPartition<'_>, Error> {
        let cells = discretisation.cells.unwrap_or(DEFAULT_CELLS);
        Ok(RoomPartition {
            model: self,
            cut: *discretisation,
            cells,
            mesh: Arc::new(self.mesh(discretisation, cells)?),
        })
    }

    /// The colours of all walls, if there are several channels.
    pub(crate) fn wall_colours(&self) -> Option<WallTables<f64>> {
        let colours = self.colours.as_ref()?;
        Some(colours.of_walls(&self.scene))
    }
}

/// The walls of a room, cut into cells.
#[derive(Clone, Debug)]
pub(crate) struct RoomPartition<'m> {
    pub(crate) model: &'m RoomModel,
    pub(crate) cut: Discretisation,
    /// The number that was asked for.
    cells: usize,
    pub(crate) mesh: Arc<Mesh>,
}

impl RoomPartition<'_> {
    /// The functions on a cell.
    pub(crate) const fn functions(&self) -> usize {
        self.cut.degree + 1
    }

    /// The number of channels.
    pub(crate) fn channels(&self) -> usize {
        let names = self.model.colours().map(Colours::names);
        names.map_or(1, |names| names.channels())
    }

    /// The unknowns of one channel.
    pub(crate) fn unknowns_of_channel(&self) -> usize {
        self.mesh.len().saturating_mul(self.functions())
    }

    /// The tables of walks in a scalar.
    pub(crate) fn tables<F: Real>(&self) -> WalkTables<F> {
        let walls = self.model.wall_colours();
        WalkTables {
            tables: Tables::new(&self.model.scene, &self.mesh),
            colours: walls.map(|walls| walls.rounded()),
        }
    }

    /// The coefficients of all pairs of cells.
    pub(crate) fn matrix(&self) -> Result<Matrix, Error> {
        let (scene, mesh, degree) = (&self.model.scene, &*self.mesh, self.cut.degree);
        let ratio = min_mass_ratio(degree);
        Ok(Matrix::with_functions(scene, mesh, ratio, degree + 1)?)
    }

    /// Refuses walks of infinite variance: with constant absorption. By roulette weights are never above 1, and something of every room
    /// absorbs.
    pub(crate) fn refuse_infinite(&self, walk: &WalkOptions) -> Result<(), Error> {
        let Some(q) = walk.absorption.probability() else {
            return Ok(());
        };
        let materials = self.model.surfaces.materials.iter().flatten();
        let largest = materials.fold(0.0, |m: f64, material| m.max(material.reflectance));
        if largest * largest < 1.0 - q {
            return Ok(());
        }
        fredholm_model::finite::check_plain(
            "reflectance²/(1 − absorption)",
            walk.absorption,
            || self.plain_radius(),
        )
    }
}

impl<'m> Partitioned<'m> for RoomPartition<'m> {
    fn cells(&self) -> usize {
        self.cells
    }

    fn unknowns(&self) -> usize {
        self.unknowns_of_channel()
    }

    fn cells_text(&self) -> String {
        format!("{} ({} requested)", self.mesh.len(), self.cells)
    }

    fn memory(&self, _: &[Goal], _: Pairs) -> usize {
        let walls = self.model.scene.geometry().walls().len();
        let further = RAYS_BYTES.saturating_mul(self.channels() - 1);
        memory([self.mesh.len(), walls], self.cut.degree)
            .saturating_add(self.mesh.len().saturating_mul(further))
    }

    fn cost(&self, pairs: Pairs) -> Cost {
        let n = self.mesh.len() as f64;
        let degree = self.cut.degree as f64;
        let walls = self.model.scene.geometry().walls().len();
        let depth = (walls.max(4) as f64).log2();
        let ray = RAY * depth;
        let plain = WalkCost {
            start: START,
            step: ray,
            score: SCORE,
            pair: 0.0,
            hidden_pair: 0.0,
        };
        let pair = match self.cut.degree {
            0 => PAIR_OF_CONSTANTS,
            _ => PAIR_OF_POLYNOMIALS + degree * PAIR_DEGREE,
        };
        let walk = match pairs {
            Pairs::Pointwise => WalkCost { pair, ..plain },
            _ => WalkCost {
                score: SCORE + ray + RAYS_SCORE,
                ..plain
            },
        };
        let boxes = match pairs {
            Pairs::Pointwise => 0.0,
            _ => RAYS_OF_CELL * n * ray,
        };
        let matrix = |n: f64, degree: f64| n * n * (PAIR + degree * MOMENTS) + n * degree * CLOSE;
        let unknowns = self.unknowns();
        let setup = if is_from_few(unknowns, self.cut.degree) {
            let few = few_cells(unknowns, walls) as f64;
            matrix(few, (FEW_FUNCTIONS - 1) as f64) + unknowns as f64 * STEP_FROM_FEW
        } else {
            matrix(n, degree)
        };
        let cost = Cost {
            setup: setup + boxes,
            source: 0.0,
            kept: boxes,
            walk,
            plain,
            light: LIGHT * depth * self.model.lights(true).len() as f64,
        };
        match self.model.colours().map(Colours::names) {
            Some(names) => cost.shared(names.shared().len(), names.channels()),
            None => cost,
        }
    }

    fn pointwise_pairs(&self, pairs: Pairs) -> Result<PointwisePairs, Error> {
        Ok(self.all_pairs(pairs))
    }

    /// Every pair costs about one evaluation.
    fn evaluations(&self, _: u32) -> f64 {
        (self.mesh.len() as f64).powi(2)
    }

    /// On few cells: the rows of ρ F_ij, once more by ρ.
    fn plain_radius(&self) -> Result<f64, Error> {
        let scene = &self.model.scene;
        let mesh = self.model.mesh(&self.cut, self.cells.min(COARSE))?;
        let matrix = Matrix::new(scene, &mesh, min_mass_ratio(0))?;
        let tables = Tables::<f64>::new(scene, &mesh);
        let walls = scene.geometry();
        let reflectance = |cell| {
            let wall = tables.partition().wall(cell);
            let wall = wall.and_then(|wall| walls.walls().get(wall));
            wall.map_or(f64::NAN, |wall| wall.reflectance)
        };
        let n = mesh.len();
        let mut apply = |w: &[f64], out: &mut [f64]| {
            let rows = matrix.entries().chunks_exact(n);
            for (cell, (out, row)) in out.iter_mut().zip(rows).enumerate() {
                *out = reflectance(cell) * fredholm_model::numbers::dot(row, w);
            }
        };
        let (mut w, mut next) = (vec![1.0; n], vec![0.0; n]);
        let [_, high] = collatz_wielandt_bounds(&mut apply, &mut w, &mut next, POWERS);
        Ok(high)
    }

    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        self.refuse_infinite(walk)
    }

    fn solve(&self) -> Result<Box<dyn System + 'm>, Error> {
        Ok(Box::new(self.system()?))
    }

    fn restore(&self, saved: SavedSystem<'m>) -> Result<Box<dyn System + 'm>, Error> {
        let unknowns = self.unknowns().saturating_mul(self.channels());
        let views = match is_from_few(self.unknowns(), self.cut.degree) {
            true => Some(0),
            false => self.mesh.len().checked_mul(self.mesh.len()),
        };
        let solution = saved.fitting(unknowns, Some(0), views)?;
        let system = self.with_solution(solution, saved.views);
        system.views()?;
        Ok(Box::new(system))
    }

    fn plain_job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let lights = self.model.lights(request.walk.last_step);
        in_scalar!(self.cut.scalar, F => {
            let tables = self.tables::<F>();
            with_equation!(tables, VisibilityTable::none(), lights, equation => {
                plain(equation, &mut |follow| {
                    self.model.with_job(equation, follow, request, &mut |job, galerkin| {
                        then(&Prepared::plain(job, galerkin))
                    })
                })
            })
        })
    }
}

/// Bytes of the tables of n cells.
pub(crate) fn memory([n, walls]: [usize; 2], degree: usize) -> usize {
    let functions = degree + 1;
    let matrix = |cells: usize, functions: usize| {
        let pair = 1 + 8 * functions * functions;
        cells.saturating_mul(cells).saturating_mul(pair)
    };
    let bytes = n.saturating_mul(200 + 8 * 8 * functions + RAYS_BYTES);
    let unknowns = n.saturating_mul(functions);
    bytes.saturating_add(if is_from_few(unknowns, degree) {
        matrix(few_cells(unknowns, walls), FEW_FUNCTIONS)
    } else {
        matrix(n, functions)
    })
}

/// Whether v comes from a solution on few cells, without coefficients of all pairs.
pub(crate) const fn is_from_few(unknowns: usize, degree: usize) -> bool {
    degree > 1 || unknowns > MOST_IN_PAIRS
}

/// The cells of the solution from which so many unknowns come: every wall is one at least.
fn few_cells(unknowns: usize, walls: usize) -> usize {
    walls.max(unknowns.min(FEW).div_ceil(FEW_FUNCTIONS))
}
