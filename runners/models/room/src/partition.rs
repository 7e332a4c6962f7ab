//! The walls of a room, cut into cells, and what they cost.

use std::sync::Arc;

use fredholm_core::Real;
use fredholm_model::cost::{Cost, PointwisePairs, WalkCost};
use fredholm_model::finite::{check_plain, radius_by_steps};
use fredholm_model::{
    Discretisation, Error, Goal, Pairs, Partitioned, Prepared, Request, SavedSystem, System, Then,
    WalkOptions, in_channels, in_scalar,
};
use fredholm_room::{ColourTables, Mesh, Tables};

use crate::system::plain;
use crate::{DEFAULT_CELLS, RoomModel};

/// The unknowns of the solution on few cells of degree 3 from which v comes, as many as there are between these: in furnished rooms v is as good
/// with 10,000 cells.
const FEW: [usize; 2] = [100, 1000];
/// The functions on a cell of that solution.
const FEW_FUNCTIONS: usize = 4;
/// Cells enough to estimate a spectral radius: on 50 it is within 0.4 % of what it is on 400 in the rooms of `examples/`.
const COARSE: usize = 100;

/// Seconds, on the machine that all this was measured on: of a pair of the set-up.
const PAIR: f64 = 1.1e-6;
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
    pub(crate) colours: Option<ColourTables<F>>,
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
    pub(crate) fn wall_colours(&self) -> Option<ColourTables<f64>> {
        let colours = self.colours.as_ref()?;
        let walls = 0..self.scene.geometry().walls().len();
        let places = walls.filter_map(|wall| self.scene.place(wall));
        Some(colours.tables(places.map(|place| (place.surface, place.vertex))))
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
        let colours = self.model.colours();
        colours.map_or(1, |colours| colours.names.channels())
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
        check_plain("reflectance²/(1 − absorption)", walk.absorption, || {
            self.plain_radius()
        })
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
            Pairs::Paper => WalkCost {
                score: SCORE + PAIR_OF_CONSTANTS,
                ..plain
            },
            _ => WalkCost {
                score: SCORE + ray + RAYS_SCORE,
                ..plain
            },
        };
        let boxes = match pairs {
            Pairs::Pointwise => 0.0,
            Pairs::Paper => n * n * PAIR,
            _ => RAYS_OF_CELL * n * ray,
        };
        let unknowns = self.unknowns();
        let few = few_cells(unknowns, walls) as f64;
        let setup = few * few * PAIR + unknowns as f64 * STEP_FROM_FEW;
        let cost = Cost {
            setup: setup + boxes,
            source: 0.0,
            kept: boxes,
            walk,
            plain,
            light: LIGHT * depth * self.model.lights(true).len() as f64,
        };
        match self.model.colours().map(|colours| &colours.names) {
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

    /// On few cells.
    fn plain_radius(&self) -> Result<f64, Error> {
        let mesh = self.model.mesh(&self.cut, self.cells.min(COARSE))?;
        let tables = Tables::<f64>::new(&self.model.scene, &mesh);
        Ok(radius_by_steps(&tables.room(), 2))
    }

    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        self.refuse_infinite(walk)
    }

    fn solve(&self) -> Result<Box<dyn System + 'm>, Error> {
        Ok(Box::new(self.system()?))
    }

    fn restore(&self, saved: SavedSystem<'m>) -> Result<Box<dyn System + 'm>, Error> {
        let unknowns = self.unknowns().saturating_mul(self.channels());
        let solution = saved.fitting(unknowns, Some(0))?;
        let system = self.with_solution(solution);
        Ok(Box::new(system))
    }

    fn plain_job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let lights = self.model.lights(request.walk.last_step);
        in_scalar!(self.cut.scalar, F => {
            let tables = self.tables::<F>();
            in_channels!(tables.tables.room().with_lights(lights)?, &tables.colours, equation => {
                self.model.with_job(equation, &plain(equation), request, &mut |job, galerkin| then(&Prepared::plain(job, galerkin)))
            })
        })
    }
}

/// Bytes of the tables of n cells.
pub(crate) fn memory([n, walls]: [usize; 2], degree: usize) -> usize {
    let functions = degree + 1;
    let few = few_cells(n.saturating_mul(functions), walls).saturating_mul(FEW_FUNCTIONS);
    n.saturating_mul(200 + 8 * 8 * functions + RAYS_BYTES)
        .saturating_add(few.saturating_mul(few).saturating_mul(8))
}

/// The unknowns of the solution from which so many come.
pub(crate) fn few(unknowns: usize) -> usize {
    let [least, most] = FEW;
    unknowns.clamp(least, most)
}

/// The cells of the solution from which so many unknowns come: every wall is one at least.
fn few_cells(unknowns: usize, walls: usize) -> usize {
    walls.max(few(unknowns).div_ceil(FEW_FUNCTIONS))
}
