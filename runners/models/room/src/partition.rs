//! The walls of a room, cut into cells, and what they cost.

use std::sync::{Arc, OnceLock};

use fredholm_core::galerkin::Solution;
use fredholm_core::{Form, NoNeighbour, Real};
use fredholm_model::cost::{Cost, PointwisePairs, WalkCost};
use fredholm_model::{
    Discretisation, Error, Goal, Pairs, Partitioned, Prepared, Request, SavedSystem, System, Then,
    WalkOptions, in_scalar,
};
use fredholm_rayon::fill_rows;
use fredholm_room::{
    Cells, Choice, CoarseSolution, MIN_MASS_RATIO, Matrix, Mesh, Room, RoomPairs, Tables,
    Visibility, VisibilityTable, min_mass_ratio, second_moment_radius,
};

use crate::starts::{Solutions, with_job};
use crate::system::{Boxed, RoomSystem};
use crate::{Colours, DEFAULT_CELLS, RoomModel, corners, of_degree};

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
/// Cells enough to estimate a spectral radius.
const COARSE: usize = 100;
/// The fewest cells that it takes to estimate a spectral radius: on 50 it is within 0.4 % of what it is on 400 in the
/// rooms of `examples/`.
const COARSEST: usize = 50;

/// Seconds, on the machine that all this was measured on: of a pair of the set-up, of every degree of it, of a row's
/// cells close by, and of a coefficient in G.
const PAIR: f64 = 80e-9;
const MOMENTS: f64 = 340e-9;
const CLOSE: f64 = 15e-6;
const SOURCE: f64 = 3e-9;
/// Seconds of walks: a start, a ray for every level of the hierarchy over the walls, and a score without pairs.
const START: f64 = 25e-9;
const RAY: f64 = 38e-9;
const SCORE: f64 = 5e-9;
/// Seconds where pairs are in S: h on a ray, what a degree adds, and a score.
const IN_S: f64 = 10e-9;
const IN_S_DEGREE: f64 = 140e-9;
const IN_S_SCORE: f64 = 100e-9;
/// Seconds of a pointwise pair in a score, and of one that is partly hidden, of any degree, for every level of the
/// hierarchy.
const PAIR_OF_CONSTANTS: f64 = 20e-9;
const PAIR_OF_POLYNOMIALS: f64 = 36e-9;
const PAIR_DEGREE: f64 = 10e-9;
const HIDDEN_PAIR: f64 = 60e-9;
/// Seconds that cells close by take besides in a score if all pairs are pointwise.
const NEAR: f64 = 460e-9;
const NEAR_DEGREE: f64 = 180e-9;
/// Seconds of a score by a ray besides the ray; and of a cell's boxes in the set-up, as many rays.
const RAYS_SCORE: f64 = 130e-9;
const RAYS_OF_CELL: f64 = 3000.0;
/// Seconds of the form factor of a light, for every level of the hierarchy.
const LIGHT: f64 = 25e-9;
/// Seconds of an unknown of v from a solution on few cells.
const STEP_FROM_FEW: f64 = 25e-6;
/// Bytes of a cell's boxes, of which it seldom has more.
const RAYS_BYTES: usize = 24 << 10;

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

impl<'m> RoomPartition<'m> {
    /// Few cells, on which estimates take milliseconds.
    fn coarse_mesh(&self) -> Result<Mesh, Error> {
        let cells = self.cells.clamp(COARSEST, COARSE);
        self.model.mesh(&self.cut, cells)
    }

    /// The coefficients of all pairs of cells.
    pub(crate) fn matrix(&self) -> Result<Matrix<'static>, Error> {
        let (scene, mesh, degree) = (&self.model.scene, &*self.mesh, self.cut.degree);
        let ratio = min_mass_ratio(degree);
        Ok(Matrix::with_functions(scene, mesh, ratio, degree + 1)?)
    }

    /// The solution, and the coefficients if it is theirs.
    pub(crate) fn system(&self) -> Result<RoomSystem<'m>, Error> {
        let (matrix, solution) = if is_from_few(self.unknowns(), self.cut.degree) {
            (None, self.step_from_few()?)
        } else {
            let matrix = self.matrix()?;
            let solution = matrix.solve(&self.model.scene, &self.mesh, TOLERANCE, SWEEPS)?;
            (Some(matrix), solution)
        };
        Ok(RoomSystem {
            cut: self.clone(),
            given: matrix,
            made: OnceLock::new(),
            solution,
            rays: OnceLock::new(),
            lit: OnceLock::new(),
        })
    }

    /// v by one step from a solution on few cells.
    fn step_from_few(&self) -> Result<Solution, Error> {
        let few = CoarseSolution::new(&self.model.scene, self.unknowns().min(FEW))?;
        let (on_few, tables) = (
            few.room()?,
            Tables::<f64>::new(&self.model.scene, &self.mesh),
        );
        let step = few.step(&on_few);
        // q0 makes no difference to v.
        let (geometry, cells) = (tables.geometry(), tables.cells());
        let room = Room::new(geometry, cells, VisibilityTable::none(), 0.5)?;
        let mut v = vec![0.0; self.unknowns()];
        of_degree!(self.cut.degree, B => {
            let polynomials = room.with_functions::<B>();
            fill_rows(&mut v, B, |cell, row| {
                row.copy_from_slice(&step.on(&polynomials, cell));
                Ok::<(), Error>(())
            })?;
        });
        Ok(Solution {
            v,
            ..few.solution().clone()
        })
    }

    /// The estimated spectral radius of T_h²p, on few cells: more only bring h nearer to k.
    fn neighbour_second_moment_radius(
        &self,
        pairs: Pairs,
        absorption: f64,
        solved: Option<&RoomSystem<'_>>,
    ) -> Result<f64, Error> {
        // From the theory fewer are in S than by default.
        let choice = choice(pairs);
        if choice == Choice::Pointwise {
            // h = k.
            return Ok(0.0);
        }
        if let Some(solved) = solved.filter(|_| self.cells <= COARSE) {
            return self.radius_of(&self.mesh, solved.matrix()?, choice, absorption);
        }
        let mesh = self.model.mesh(&self.cut, self.cells.min(COARSE))?;
        let degree = self.cut.degree;
        let matrix =
            Matrix::with_functions(&self.model.scene, &mesh, min_mass_ratio(degree), degree + 1)?;
        self.radius_of(&mesh, &matrix, choice, absorption)
    }

    fn radius_of(
        &self,
        mesh: &Mesh,
        matrix: &Matrix<'_>,
        choice: Choice,
        absorption: f64,
    ) -> Result<f64, Error> {
        let tables = Tables::new(&self.model.scene, mesh);
        let (geometry, cells, views) = (tables.geometry(), tables.cells(), matrix.views());
        let room = Room::new(geometry, cells, views, absorption)?;
        let pairs = RoomPairs { views, choice };
        of_degree!(self.cut.degree, B => {
            let polynomials = room.with_functions::<B>();
            Ok(fredholm_room::neighbour_second_moment_radius(&polynomials, matrix, pairs)?)
        })
    }

    /// Refuses walks whose error bars would mean nothing, with the solved system if there is one.
    pub(crate) fn refuse_infinite(
        &self,
        walk: &WalkOptions,
        solved: Option<&RoomSystem<'_>>,
    ) -> Result<(), Error> {
        let (pairs, absorption) = (walk.pairs, walk.absorption);
        let materials = self.model.surfaces.materials.iter().flatten();
        let largest = materials.fold(0.0, |m: f64, material| m.max(material.reflectance));
        if !(largest * largest / (1.0 - absorption) < 1.0) {
            fredholm_model::finite::check_plain(
                "reflectance²/(1 − absorption)",
                absorption,
                || self.plain_radius(absorption),
            )?;
        }
        if walk.form == Form::Residual {
            return Ok(());
        }
        fredholm_model::finite::check_neighbour(self.cut.degree, self.cells, absorption, || {
            self.neighbour_second_moment_radius(pairs, absorption, solved)
        })
    }

    pub(crate) fn rare(&self, pairs: Pairs, solved: &RoomSystem<'_>) -> Result<f64, Error> {
        let squares = self.model.square_of_source();
        let choice = choice(pairs);
        if choice == Choice::Pointwise || squares == 0.0 {
            return Ok(0.0);
        }
        let matrix = solved.matrix()?;
        let rare = of_degree!(self.cut.degree, B => {
            corners::rare::<B>(&self.model.scene, &self.mesh, choice, matrix)
        })?;
        Ok(rare / squares)
    }

    fn plain_in<F: Real>(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let tables = Tables::<F>::new(&self.model.scene, &self.mesh);
        let (geometry, cells) = (tables.geometry(), tables.cells());
        let room = Room::new(
            geometry,
            cells,
            VisibilityTable::none(),
            request.walk.absorption,
        )?
        .with_lights(self.model.lights(request.walk.last_step))?;
        let none: &Boxed<'_, F> = &NoNeighbour::<Room<'_, F>>::new();
        let dark = Solutions {
            mean: &|_| 0.0,
            air: &|_| 0.0,
            irradiance: &|_| 0.0,
            have_light: false,
        };
        with_job(
            self.model,
            &room,
            tables.lengths(),
            none,
            &dark,
            request,
            &mut |job, galerkin| then(&Prepared::plain(job, galerkin)),
        )
    }
}

impl<'m> Partitioned<'m> for RoomPartition<'m> {
    fn cells(&self) -> usize {
        self.cells
    }

    fn unknowns(&self) -> usize {
        self.mesh.len().saturating_mul(self.cut.degree + 1)
    }

    fn cells_text(&self) -> String {
        format!("{} ({} requested)", self.mesh.len(), self.cells)
    }

    fn memory(&self, _: &[Goal], pairs: Pairs) -> usize {
        let theory = fredholm_model::pairs::memory(pairs, self.mesh.len(), self.cut.degree + 2);
        let walls = self.model.scene.geometry().walls().len();
        let channels = self.model.colours().map_or(0, |own| own.names().channels());
        let of_channels = RAYS_BYTES.saturating_mul(channels);
        memory([self.mesh.len(), walls], self.cut.degree, pairs)
            .saturating_add(theory)
            .saturating_add(self.mesh.len().saturating_mul(of_channels))
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
        let pointwise = WalkCost {
            pair,
            hidden_pair: HIDDEN_PAIR * depth,
            ..plain
        };
        let rays = WalkCost {
            score: SCORE + ray + RAYS_SCORE,
            ..plain
        };
        let walk = match (choice(pairs), self.cut.degree) {
            _ if pairs == Pairs::Rays => rays,
            (Choice::Pointwise, 0) => pointwise,
            (Choice::Pointwise, _) => WalkCost {
                score: SCORE + NEAR + degree * NEAR_DEGREE,
                ..pointwise
            },
            _ => WalkCost {
                step: ray + IN_S + degree * IN_S_DEGREE,
                score: SCORE + IN_S_SCORE,
                ..pointwise
            },
        };
        let boxes = match pairs {
            Pairs::Rays => RAYS_OF_CELL * n * ray,
            _ => 0.0,
        };
        let matrix = |n: f64, degree: f64| n * n * (PAIR + degree * MOMENTS) + n * degree * CLOSE;
        let (unknowns, all) = (self.unknowns(), matrix(n, degree));
        let setup = if is_from_few(unknowns, self.cut.degree) {
            let few = few_cells(unknowns, walls) as f64;
            let of_pairs = if pairs == Pairs::Rays { 0.0 } else { all };
            matrix(few, (FEW_FUNCTIONS - 1) as f64) + unknowns as f64 * STEP_FROM_FEW + of_pairs
        } else {
            all
        };
        let source = match pairs {
            Pairs::Rays => 0.0,
            _ => SOURCE * (n * (degree + 1.0)).powi(2),
        };
        let cost = Cost {
            setup: setup + boxes,
            source,
            kept: boxes,
            moments: 0.0,
            moments_power: 0.0,
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
        if pairs == Pairs::Rays {
            return Ok(PointwisePairs::default());
        }
        let coarse = self.coarse_mesh()?;
        let matrix = Matrix::new(&self.model.scene, &coarse, min_mass_ratio(self.cut.degree))?;
        let (views, choice) = (matrix.views(), choice(pairs));
        let found = pointwise_pairs(&coarse.cells(), views, &RoomPairs { views, choice });
        Ok(found.on(pairs, self.mesh.len() as f64 / coarse.len() as f64))
    }

    /// Every pair costs about one evaluation.
    fn evaluations(&self, _: u32) -> f64 {
        (self.mesh.len() as f64).powi(2)
    }

    fn plain_radius(&self, absorption: f64) -> Result<f64, Error> {
        let coarse = self.coarse_mesh()?;
        let scene = &self.model.scene;
        let matrix = Matrix::new(scene, &coarse, MIN_MASS_RATIO)?;
        Ok(second_moment_radius(scene, &coarse, &matrix, absorption)?)
    }

    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        self.refuse_infinite(walk, None)
    }

    fn solve(&self, _: f64) -> Result<Box<dyn System + 'm>, Error> {
        if let Some(colours) = self.model.colours() {
            return Ok(Box::new(self.coloured_system(colours)?));
        }
        Ok(Box::new(self.system()?))
    }

    fn restore(&self, saved: SavedSystem<'m>) -> Result<Box<dyn System + 'm>, Error> {
        let (cells, functions) = (self.mesh.len(), self.cut.degree + 1);
        let [pairs, products] = [cells, self.unknowns()].map(|n| n.checked_mul(n));
        let solution = saved.fitting(self.unknowns(), products, pairs)?;
        let matrix = Matrix::from_tables(saved.views, saved.coefficients, cells, functions)?;
        Ok(Box::new(RoomSystem {
            cut: self.clone(),
            given: Some(matrix),
            made: OnceLock::new(),
            solution,
            rays: OnceLock::new(),
            lit: OnceLock::new(),
        }))
    }

    fn plain_job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        match self.model.colours() {
            Some(colours) => {
                in_scalar!(self.cut.scalar, F => self.plain_colours::<F>(colours, request, then))
            }
            None => in_scalar!(self.cut.scalar, F => self.plain_in::<F>(request, then)),
        }
    }
}

/// What pairs do with views; from the theory they start as the default.
pub(crate) const fn choice(pairs: Pairs) -> Choice {
    match pairs {
        Pairs::Paper => Choice::Paper,
        Pairs::Default | Pairs::Theory => Choice::Default,
        // h = k.
        Pairs::Pointwise | Pairs::Rays => Choice::Pointwise,
    }
}

/// Pointwise pairs of a row, in the mean over the walls' length: walks seldom meet the small cells in corners.
pub(crate) fn pointwise_pairs<F: Real>(
    cells: &Cells<'_, F>,
    views: VisibilityTable<'_>,
    pairs: &impl fredholm_core::galerkin::Pairs,
) -> PointwisePairs {
    let (mut seen, mut hidden, mut all) = (0.0, 0.0, 0.0);
    for i in 0..cells.len() {
        let length = cells.length(i).to_f64();
        all += length;
        for j in pairs.pointwise(i, cells.len()) {
            let sum = match views.visibility(i, j) {
                Visibility::Partial => &mut hidden,
                _ => &mut seen,
            };
            *sum += length;
        }
    }
    PointwisePairs {
        seen: seen / all,
        hidden: hidden / all,
    }
}

/// Bytes of the tables of n cells.
pub(crate) fn memory([n, walls]: [usize; 2], degree: usize, pairs: Pairs) -> usize {
    let functions = degree + 1;
    let matrix = |cells: usize, functions: usize| {
        let pair = 1 + 8 * functions * functions;
        cells.saturating_mul(cells).saturating_mul(pair)
    };
    let of_cell = match pairs {
        Pairs::Rays => RAYS_BYTES,
        _ => 0,
    };
    let mut bytes = n.saturating_mul(200 + 8 * 8 * functions + of_cell);
    let unknowns = n.saturating_mul(functions);
    let is_from_few = is_from_few(unknowns, degree);
    if is_from_few {
        bytes = bytes.saturating_add(matrix(few_cells(unknowns, walls), FEW_FUNCTIONS));
    }
    if pairs == Pairs::Rays && is_from_few {
        return bytes;
    }
    bytes.saturating_add(matrix(n, functions))
}

/// Whether v comes from a solution on few cells, without coefficients of all pairs.
pub(crate) const fn is_from_few(unknowns: usize, degree: usize) -> bool {
    degree > 1 || unknowns > MOST_IN_PAIRS
}

/// The cells of the solution from which so many unknowns come: every wall is one at least.
fn few_cells(unknowns: usize, walls: usize) -> usize {
    walls.max(unknowns.min(FEW).div_ceil(FEW_FUNCTIONS))
}
