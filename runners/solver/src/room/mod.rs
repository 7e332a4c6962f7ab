//! Light and heat in polygonal rooms, with sizes chosen at run time.

mod corners;
mod export;
mod field;
mod heat;
mod leaks;
mod means;
mod surfaces;
mod system;

use std::sync::Arc;

use fredholm_core::{NoNeighbour, Real, Statistics};
use fredholm_room::{
    Cells, Choice, Grading, Matrix, Mesh, R_MIN, Room, RoomPairs, Scene, Seen, Tables, View, Views,
    r_min, second_moment_radius,
};

pub use field::{Field, FieldRequest, Spot, Stretch};
pub use surfaces::Surfaces;

use crate::cost::{Cost, PointwisePairs, WalkCost};
use crate::memory::refuse_beyond_memory;
use crate::model::{About, Derived, Prepared, Request, Then};
use crate::{Discretisation, Error, Goal, Model, Pairs, Partitioned, Region, Scalar, System};
use system::{Boxed, RoomSystem, Solutions, with_job};

/// The relative residual at which the Gauss–Seidel iteration stops.
const TOLERANCE: f64 = 1e-14;
/// The most sweeps.
const SWEEPS: u32 = 10_000;
/// About so many cells where nothing is said of them.
const DEFAULT_CELLS: usize = 500;
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

/// An expression in which the number of functions per cell of a degree is a constant of this name.
macro_rules! of_degree {
    ($degree:expr, $name:ident => $then:expr) => {
        match $degree {
            0 => crate::room::of_degree!(1 as $name => $then),
            1 => crate::room::of_degree!(2 as $name => $then),
            2 => crate::room::of_degree!(3 as $name => $then),
            3 => crate::room::of_degree!(4 as $name => $then),
            // The model lets nothing above 4 pass.
            _ => crate::room::of_degree!(5 as $name => $then),
        }
    };
    ($value:literal as $name:ident => $then:expr) => {{
        const $name: usize = $value;
        $then
    }};
}
pub(crate) use of_degree;

/// The equation of light or heat in a room.
#[derive(Clone, Debug)]
pub struct RoomModel {
    surfaces: Surfaces,
    scene: Scene,
}

impl RoomModel {
    /// A room for walks in this scalar.
    ///
    /// # Errors
    /// [`Error::Scene`].
    pub fn new(surfaces: Surfaces, scalar: Scalar) -> Result<Self, Error> {
        let scene = match scalar {
            Scalar::F32 => surfaces.scene::<f32>()?,
            Scalar::F64 => surfaces.scene::<f64>()?,
        };
        Ok(Self { surfaces, scene })
    }

    /// Refuses the tables of so many cells, or of as many as there are segments, that do not fit into memory: asked
    /// before a scene is made of them, which may take long.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn refuse_beyond_memory(
        surfaces: &Surfaces,
        discretisation: &Discretisation,
    ) -> Result<(), Error> {
        // Every segment is one cell at least.
        let segments = surfaces.points.iter().map(|p| p.len().saturating_sub(1));
        let cells = discretisation.cells.unwrap_or(DEFAULT_CELLS);
        let least = cells.max(segments.sum());
        let what = || format!("{least} unknowns");
        refuse_beyond_memory(what, memory(least, discretisation.degree), ADVICE)
    }

    /// The surfaces.
    #[must_use]
    pub const fn surfaces(&self) -> &Surfaces {
        &self.surfaces
    }

    /// The scene.
    #[must_use]
    pub const fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Whether points are between the walls: not behind them nor within an obstacle.
    ///
    /// # Errors
    /// [`Error::Room`].
    pub fn are_inside(&self, positions: &[[f64; 2]]) -> Result<Vec<bool>, Error> {
        if positions.is_empty() {
            return Ok(Vec::new());
        }
        let mesh = Mesh::new::<f64>(&self.scene, 1, Grading::default())?;
        let tables = Tables::<f64>::new(&self.scene, &mesh);
        let room = &Room::new(tables.geometry(), tables.cells(), Views::none(), 0.5)?;
        let (ones, closed) = (vec![1.0; mesh.len()], !self.surfaces.open);
        let sees = |&position: &[f64; 2]| {
            let [_, share] = Seen { room, position }.of(&ones);
            field::is_inside(share, closed, f64::EPSILON)
        };
        Ok(positions.iter().map(sees).collect())
    }

    /// Refuses a region that it does not have, but for points in the air.
    fn check_region(&self, region: &Region) -> Result<(), Error> {
        let is_part = |part: &usize| *part < self.surfaces.names.len();
        let message = match region {
            Region::Whole => return Ok(()),
            Region::Part(part) if is_part(part) => return Ok(()),
            Region::Parts(parts) if !parts.is_empty() && parts.iter().all(is_part) => return Ok(()),
            Region::On(part, t) if is_part(part) && (0.0..=1.0).contains(t) => return Ok(()),
            Region::On(..) => "a place on a surface is a share of its length, from 0 to 1",
            Region::Point(_) => "a point in the air has two coordinates",
            _ => "a room has points in the air, places on surfaces, and means over surfaces",
        };
        Err(Error::Region {
            message: message.to_owned(),
        })
    }

    fn mesh(&self, cut: &Discretisation, cells: usize) -> Result<Mesh, Error> {
        let grading = grading(cut);
        Ok(match cut.scalar {
            Scalar::F32 => Mesh::new::<f32>(&self.scene, cells, grading)?,
            Scalar::F64 => Mesh::new::<f64>(&self.scene, cells, grading)?,
        })
    }

    /// ∫ F².
    fn square_of_source(&self) -> f64 {
        let walls = self.scene.geometry().walls().iter();
        walls.map(|wall| wall.length * wall.emission.powi(2)).sum()
    }

    /// The walls of a mean, of every surface a range.
    fn walls(&self, region: &Region) -> Result<Vec<core::ops::Range<usize>>, Error> {
        let of = |surface: &usize| Ok::<_, Error>(self.scene.walls_of(*surface)?);
        match region {
            Region::Part(surface) => Ok(vec![of(surface)?]),
            Region::Parts(surfaces) => surfaces.iter().map(of).collect(),
            _ => {
                let all = 0..of(&(self.scene.surfaces() - 1))?.end;
                Ok(vec![all])
            }
        }
    }
}

/// What needs less memory.
const ADVICE: &str = ": use fewer cells";

/// How walls are cut.
fn grading(cut: &Discretisation) -> Grading {
    let default = Grading::of_degree(cut.degree);
    Grading {
        exponent: cut.grading.unwrap_or(default.exponent),
        shadows: cut.shadow_cuts.unwrap_or(default.shadows),
    }
}

/// Bytes of the tables of n cells.
const fn memory(n: usize, degree: usize) -> usize {
    let functions = degree + 1;
    let pair = 1 + 8 * functions * functions;
    let table = n.saturating_mul(n).saturating_mul(pair);
    table.saturating_add(n.saturating_mul(200 + 8 * 8 * functions))
}

/// What pairs do with views; from the theory they start as the default.
const fn choice(pairs: Pairs) -> Choice {
    match pairs {
        Pairs::Paper => Choice::Paper,
        Pairs::Default | Pairs::Theory => Choice::Default,
        Pairs::Pointwise => Choice::Pointwise,
    }
}

/// Pointwise pairs of a row, in the mean over the walls' length: walks seldom meet the small cells in corners.
fn pointwise_pairs<F: Real>(
    cells: &Cells<'_, F>,
    views: Views<'_>,
    pairs: &impl fredholm_core::galerkin::Pairs,
) -> PointwisePairs {
    let (mut seen, mut hidden, mut all) = (0.0, 0.0, 0.0);
    for i in 0..cells.len() {
        let length = cells.length(i).to_f64();
        all += length;
        for j in pairs.pointwise(i, cells.len()) {
            let sum = match views.view(i, j) {
                View::Partly => &mut hidden,
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

impl Model for RoomModel {
    fn about(&self) -> About {
        About {
            kind: "room",
            dimension: None,
            most_degree: 4,
            less_memory: ADVICE,
            is_singular: false,
            has_rare_scores: true,
            takes_any_cells: true,
            counts_evaluations: false,
        }
    }

    fn part(&self, number: usize) -> Option<&str> {
        self.surfaces.names.get(number).map(String::as_str)
    }

    fn unit(&self) -> Option<&'static str> {
        self.surfaces.heat.then_some("W/m2")
    }

    fn position(&self, region: &Region) -> Option<Vec<f64>> {
        let Region::On(surface, t) = *region else {
            return None;
        };
        let (wall, fraction) = self.scene.along(surface, t).ok()?;
        let [a, b] = self.scene.geometry().walls().get(wall)?.ends;
        let between = |k: usize| (1.0 - fraction) * a[k] + fraction * b[k];
        Some(vec![between(0), between(1)])
    }

    fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
        let mut in_air = Vec::new();
        for goal in goals {
            if let Region::Point(x) = &goal.region
                && let [x, y] = *x.as_slice()
            {
                in_air.push([x, y]);
            } else {
                self.check_region(&goal.region)?;
            }
        }
        // All at once, as every look takes a mesh.
        let inside = self.are_inside(&in_air)?;
        match in_air.iter().zip(inside).find(|(_, inside)| !inside) {
            None => Ok(()),
            Some(([x, y], _)) => Err(Error::Region {
                message: format!("the point [{x}, {y}] is not between the walls"),
            }),
        }
    }

    fn grid(&self, points: usize, part: Option<usize>) -> Vec<Region> {
        // The middles of equal parts: in a corner two surfaces meet.
        let at = |i| (i as f64 + 0.5) / points as f64;
        let part = part.unwrap_or(0);
        (0..points).map(|i| Region::On(part, at(i))).collect()
    }

    fn check(&self, _: &Discretisation, _: Pairs) -> Result<(), Error> {
        Ok(())
    }

    fn partition<'m>(
        &'m self,
        discretisation: &Discretisation,
    ) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
        Ok(Box::new(self.cut(discretisation)?))
    }

    fn levels(&self, discretisation: &Discretisation) -> Vec<usize> {
        let walls = self.scene.walls_of(self.scene.surfaces() - 1);
        let least = walls.map_or(1, |walls| walls.end);
        let levels = [100, 200, 400, 800, 1600];
        // As many unknowns as take seconds.
        let most = 3200 / (discretisation.degree + 1);
        levels
            .into_iter()
            .filter(|&cells| cells > 2 * least && cells <= most)
            .collect()
    }

    fn coarse_levels(&self, discretisation: &Discretisation) -> Vec<usize> {
        // With more walls than a sweep goes to, every wall is a cell.
        let first = self.levels(discretisation).first().copied();
        let first = first.unwrap_or(4 * self.scene.geometry().walls().len());
        vec![first / 4, first / 2]
    }

    /// Pairs next to a corner, which look alike at every size, hold cells of grading g at g/2.
    fn order(&self, discretisation: &Discretisation, pairs: Pairs) -> f64 {
        let own = self.smooth_order(discretisation.degree);
        match choice(pairs) {
            Choice::Default => own.min(0.5 * grading(discretisation).exponent),
            _ => own,
        }
    }

    fn mean_square_of_source(&self) -> f64 {
        let walls = self.scene.geometry().walls().iter();
        let length: f64 = walls.map(|wall| wall.length).sum();
        self.square_of_source() / length
    }

    fn derive(&self, goals: &[Goal], statistics: &[Statistics]) -> Derived {
        self.derived(goals, statistics)
    }

    fn besides(&self, goals: &[Goal]) -> usize {
        let regions = self.regions(goals, false);
        let own = regions
            .iter()
            .filter(|region| self.takes_walks(region, false));
        regions.len() - goals.len() + own.count()
    }
}

impl RoomModel {
    /// Cuts the walls into cells.
    fn cut(&self, discretisation: &Discretisation) -> Result<RoomPartition<'_>, Error> {
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
struct RoomPartition<'m> {
    model: &'m RoomModel,
    cut: Discretisation,
    /// The number that was asked for.
    cells: usize,
    mesh: Arc<Mesh>,
}

impl<'m> RoomPartition<'m> {
    /// Few cells, on which estimates take milliseconds.
    fn coarse_mesh(&self) -> Result<Mesh, Error> {
        let cells = self.cells.clamp(COARSEST, COARSE);
        self.model.mesh(&self.cut, cells)
    }

    /// The coefficients, and the solution.
    fn system(&self) -> Result<RoomSystem<'m>, Error> {
        let (scene, mesh, degree) = (&self.model.scene, &*self.mesh, self.cut.degree);
        let matrix = Matrix::with_functions(scene, mesh, r_min(degree), degree + 1)?;
        let solution = matrix.solve(scene, mesh, TOLERANCE, SWEEPS)?;
        Ok(RoomSystem {
            cut: self.clone(),
            matrix,
            solution,
        })
    }

    /// The estimated spectral radius of T_h²p, on few cells: more only bring h nearer to k.
    fn neighbour_radius(
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
            return self.radius_of(&self.mesh, &solved.matrix, choice, absorption);
        }
        let mesh = self.model.mesh(&self.cut, self.cells.min(COARSE))?;
        let degree = self.cut.degree;
        let matrix = Matrix::with_functions(&self.model.scene, &mesh, r_min(degree), degree + 1)?;
        self.radius_of(&mesh, &matrix, choice, absorption)
    }

    fn radius_of(
        &self,
        mesh: &Mesh,
        matrix: &Matrix,
        choice: Choice,
        absorption: f64,
    ) -> Result<f64, Error> {
        let tables = Tables::new(&self.model.scene, mesh);
        let (geometry, cells, views) = (tables.geometry(), tables.cells(), matrix.views());
        let room = Room::new(geometry, cells, views, absorption)?;
        let pairs = RoomPairs { views, choice };
        of_degree!(self.cut.degree, B => {
            let polynomials = fredholm_room::Polynomials::<_, B>::new(&room);
            Ok(fredholm_room::neighbour_second_moment_radius(&polynomials, matrix, pairs)?)
        })
    }

    /// Refuses walks whose error bars would mean nothing, with the solved system if there is one.
    fn refuse_infinite(
        &self,
        pairs: Pairs,
        absorption: f64,
        solved: Option<&RoomSystem<'_>>,
    ) -> Result<(), Error> {
        let materials = self.model.surfaces.materials.iter().flatten();
        let largest = materials.fold(0.0, |m: f64, material| m.max(material.reflectance));
        if !(largest * largest / (1.0 - absorption) < 1.0) {
            crate::finite::check_plain("reflectance²/(1 − absorption)", absorption, || {
                self.plain_radius(absorption)
            })?;
        }
        crate::finite::check_neighbour(self.cut.degree, self.cells, absorption, || {
            self.neighbour_radius(pairs, absorption, solved)
        })
    }

    fn rare(&self, pairs: Pairs, matrix: Option<&Matrix>) -> Result<f64, Error> {
        let squares = self.model.square_of_source();
        let choice = choice(pairs);
        if choice == Choice::Pointwise || squares == 0.0 {
            return Ok(0.0);
        }
        let rare = of_degree!(self.cut.degree, B => {
            corners::rare::<B>(&self.model.scene, &self.mesh, choice, matrix)
        })?;
        Ok(rare / squares)
    }

    fn plain_in<F: Real>(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let tables = Tables::<F>::new(&self.model.scene, &self.mesh);
        let (geometry, cells) = (tables.geometry(), tables.cells());
        let room = Room::new(geometry, cells, Views::none(), request.walk.absorption)?;
        let none: &Boxed<'_, F> = &NoNeighbour::<Room<'_, F>>::new();
        let dark = Solutions {
            mean: &|_| 0.0,
            air: &|_| 0.0,
            irradiance: &|_| 0.0,
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
        let theory = crate::pairs::memory(pairs, self.mesh.len(), self.cut.degree + 2);
        memory(self.mesh.len(), self.cut.degree).saturating_add(theory)
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
        let walk = match (choice(pairs), self.cut.degree) {
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
        Cost {
            setup: n * n * (PAIR + degree * MOMENTS) + n * degree * CLOSE,
            source: SOURCE * (n * (degree + 1.0)).powi(2),
            walk,
            plain,
        }
    }

    fn pointwise_pairs(&self, pairs: Pairs) -> Result<PointwisePairs, Error> {
        let coarse = self.coarse_mesh()?;
        let matrix = Matrix::new(&self.model.scene, &coarse, r_min(self.cut.degree))?;
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
        let matrix = Matrix::new(scene, &coarse, R_MIN)?;
        Ok(second_moment_radius(scene, &coarse, &matrix, absorption)?)
    }

    fn check_variance(&self, pairs: Pairs, absorption: f64) -> Result<(), Error> {
        self.refuse_infinite(pairs, absorption, None)
    }

    fn rare_variance(&self, pairs: Pairs) -> Result<f64, Error> {
        self.rare(pairs, None)
    }

    fn solve(&self, _: f64) -> Result<Box<dyn System + 'm>, Error> {
        Ok(Box::new(self.system()?))
    }

    fn plain_job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        match self.cut.scalar {
            Scalar::F32 => self.plain_in::<f32>(request, then),
            Scalar::F64 => self.plain_in::<f64>(request, then),
        }
    }
}
