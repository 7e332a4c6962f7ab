//! A room set up for walks: its scene, mesh and v.

use fredholm_core::Real;
use fredholm_core::galerkin::{Dense, PairTable, rounded};
use fredholm_core::{Neighbour, galerkin::Solution};
use fredholm_room::{
    CoarseSolution, ExactNeighbour, Grading, Grey, Matrix, Mesh, Point, RayNeighbour, RaySetup,
    Room, RoomError, Scene, Tables, paper_pairs,
};

use super::Drawing;
use crate::outcome::Outcome;

/// Everything deterministic about a room with B functions on every cell, in f64.
#[derive(Clone, Debug)]
pub struct Setup<const B: usize = 1> {
    /// The scene.
    pub scene: Scene,
    /// Its partition.
    pub mesh: Mesh,
    /// K' and the Galerkin solution on these cells.
    pub matrix: Matrix,
    /// The Galerkin solution.
    pub solution: Solution,
    /// v near u.
    pub v: Vec<f64>,
}

/// What walks follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// The paper's pairs of cells, of piecewise constants.
    Paper,
    /// h = k, with a G that takes a ray.
    Rays,
    /// h = k, with an exact G.
    Exact,
}

/// All of them.
pub const WAYS: [Way; 3] = [Way::Paper, Way::Rays, Way::Exact];

/// A neighbour equation of a room.
pub type AnyNeighbour<'a, F> = dyn Neighbour<Scalar = F, Point = Point<F>, Value = F> + Sync + 'a;

impl Setup {
    /// Of a drawing with about so many cells of constants, for walks in F.
    ///
    /// # Errors
    /// [`RoomError`].
    pub fn new<F: Real>(
        drawing: &Drawing,
        cells: usize,
        grading: Grading,
    ) -> Result<Self, RoomError> {
        Self::of_degree::<F>(drawing, cells, grading)
    }
}

impl<const B: usize> Setup<B> {
    /// As [`new`](Setup::new), with B functions on every cell.
    ///
    /// # Errors
    /// [`RoomError`].
    pub fn of_degree<F: Real>(
        drawing: &Drawing,
        cells: usize,
        grading: Grading,
    ) -> Result<Self, RoomError> {
        let scene = drawing.scene::<F>()?;
        let mesh = Mesh::new::<F>(&scene, cells, grading)?;
        let tables = Tables::<f64>::new(&scene, &mesh);
        let room = tables.room();
        let matrix = Matrix::new::<B>(&room)?;
        let solution = matrix.solve(&room)?;
        let coarse = CoarseSolution::new(&scene, (cells * B).clamp(100, 1000), &Grey)?;
        let mut v = vec![0.0; mesh.len() * B];
        for (cell, own) in v.chunks_exact_mut(B).enumerate() {
            coarse.step::<_, B>(&room, cell, own);
        }
        Ok(Self {
            matrix,
            solution,
            v,
            scene,
            mesh,
        })
    }

    /// The room with a neighbour equation, and v.
    ///
    /// # Panics
    /// If there is none.
    pub fn with<F: Real, R>(
        &self,
        way: Way,
        then: impl FnOnce(&Room<'_, F>, &AnyNeighbour<'_, F>, &[F]) -> R,
    ) -> R {
        let tables = Tables::<F>::new(&self.scene, &self.mesh);
        let room = tables.room();
        let wide = Tables::<f64>::new(&self.scene, &self.mesh);
        let wide = wide.room();
        let v = rounded::<F>(&self.v).unwrap();
        match way {
            Way::Paper => {
                assert_eq!(B, 1, "the paper has constants");
                let kinds = paper_pairs(&self.scene, &wide).unwrap();
                let pairs = PairTable::new(&kinds, self.mesh.len()).unwrap();
                let coefficients = self.matrix.coefficients();
                let vectors = self.solution.for_walks::<F, _>(&coefficients, pairs);
                let vectors = vectors.unwrap();
                let entries = rounded::<F>(self.matrix.entries()).unwrap();
                let dense = Dense::new(&entries, self.mesh.len(), 1).unwrap();
                let neighbour = vectors.piecewise::<_, _, 1>(&room, &dense).unwrap();
                then(&room, &neighbour, vectors.v())
            }
            Way::Rays => {
                let setup = RaySetup::<_, B>::new(&wide, &self.v).unwrap();
                let rays = setup.tables().unwrap().rounded::<F>().unwrap();
                let rays = RayNeighbour::<_, F, B>::new(&room, &v, rays.control());
                then(&room, &rays.unwrap(), &v)
            }
            Way::Exact => {
                let exact = ExactNeighbour::<_, F, B>::new(&room, &v).unwrap();
                then(&room, &exact, &v)
            }
        }
    }
}

/// Panics unless a check of a drawing has passed.
///
/// # Panics
/// If the check has failed.
pub fn assert_ok(drawing: &Drawing, what: &str, outcome: Outcome) {
    if let Err(e) = outcome.ok() {
        panic!("{}, {what}: {e}", drawing.name);
    }
}
