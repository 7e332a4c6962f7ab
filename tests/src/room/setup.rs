//! A room set up for walks: its scene, mesh, matrix and Galerkin solution.

use fredholm_core::Real;
use fredholm_core::galerkin::{Dense, Solution, WithPointwise, rounded};
use fredholm_room::{
    Choice, Grading, Matrix, Mesh, RayNeighbour, RaySetup, Room, RoomError, RoomPairs, Scene,
    Tables, min_mass_ratio,
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
    /// Views and coefficients.
    pub matrix: Matrix,
    /// The Galerkin solution.
    pub solution: Solution,
}

/// The neighbour equation of a room from pairs of cells.
pub type RoomNeighbour<'c, 'a, F, const B: usize = 1> =
    WithPointwise<'c, F, Room<'a, F>, Dense<'c, F>, RoomPairs<'c>, B>;

/// The three choices of pairs.
pub const CHOICES: [Choice; 3] = [Choice::Paper, Choice::Default, Choice::Pointwise];

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
        let matrix = Matrix::with_functions(&scene, &mesh, min_mass_ratio(B - 1), B)?;
        let solution = matrix.solve(&scene, &mesh, 1e-15, 1000)?;
        Ok(Self {
            scene,
            mesh,
            matrix,
            solution,
        })
    }

    /// The room with its neighbour equation for a choice of pairs, and v.
    ///
    /// # Panics
    /// If there is none.
    pub fn with<F: Real, R>(
        &self,
        choice: Choice,
        then: impl FnOnce(&Room<'_, F>, &RoomNeighbour<'_, '_, F, B>, &[F]) -> R,
    ) -> R {
        let tables = Tables::<F>::new(&self.scene, &self.mesh);
        let views = self.matrix.views();
        let room = tables.room(views);
        let (matrix, pairs) = (self.matrix.coefficients(), RoomPairs { views, choice });
        let vectors = self.solution.for_walks::<F, _>(&matrix, pairs).unwrap();
        let entries = rounded::<F>(self.matrix.entries()).unwrap();
        let dense = Dense::new(&entries, self.matrix.cells(), B).unwrap();
        let neighbour = vectors.with_pointwise::<_, _, B>(&room, &dense).unwrap();
        then(&room, &neighbour, vectors.v())
    }

    /// The room with its neighbour equation from rays alone.
    ///
    /// # Panics
    /// If there is none.
    pub fn with_rays<F: Real, R>(
        &self,
        then: impl FnOnce(&Room<'_, F>, &RayNeighbour<'_, Room<'_, F>, F, B>) -> R,
    ) -> R {
        let views = self.matrix.views();
        let wide = Tables::<f64>::new(&self.scene, &self.mesh);
        let room = wide.room(views);
        let setup = RaySetup::<_, B>::new(&room, &self.solution.v).unwrap();
        let rays = setup.tables().unwrap().rounded::<F>().unwrap();
        let tables = Tables::<F>::new(&self.scene, &self.mesh);
        let room = tables.room(views);
        let v = self.solution.rounded::<F>().unwrap();
        then(&room, &rays.neighbour::<_, B>(&room, &v).unwrap())
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
