//! A room set up for walks: its scene, mesh, matrix and Galerkin solution.

use fredholm_core::Real;
use fredholm_core::galerkin::{Dense, Piecewise, PointwiseSource, Solution, rounded};
use fredholm_room::{
    Choice, Grading, MIN_MASS_RATIO, Matrix, Mesh, PolynomialRoom, RayNeighbour, RaySetup,
    RayTables, Room, RoomError, RoomPairs, Scene, Tables, min_mass_ratio,
};

use super::{ABSORPTION, Drawing};

/// Everything deterministic about a room, in f64.
#[derive(Clone, Debug)]
pub struct Setup<const B: usize = 1> {
    /// The scene.
    pub scene: Scene,
    /// Its partition.
    pub mesh: Mesh,
    /// Views and coefficients.
    pub matrix: Matrix<'static>,
    /// The Galerkin solution.
    pub solution: Solution,
}

/// A room with B functions on every cell.
pub type OfDegree<'c, 'a, F, const B: usize> = Piecewise<
    'c,
    F,
    PolynomialRoom<'c, 'a, F, B>,
    Dense<'c, F>,
    RoomPairs<'c>,
    PointwiseSource<'c, F, PolynomialRoom<'c, 'a, F, B>, RoomPairs<'c>, B>,
    B,
>;

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

    /// As [`with`](Setup::with).
    ///
    /// # Panics
    /// If there is no such neighbour equation.
    pub fn with_polynomials<F: Real, R>(
        &self,
        choice: Choice,
        then: impl FnOnce(&PolynomialRoom<'_, '_, F, B>, &OfDegree<'_, '_, F, B>, &[F], &[f64]) -> R,
    ) -> R {
        let tables = Tables::<F>::new(&self.scene, &self.mesh);
        let views = self.matrix.views();
        let room = Room::new(tables.geometry(), tables.cells(), views, ABSORPTION).unwrap();
        let polynomials = room.with_functions::<B>();
        let pairs = RoomPairs { views, choice };
        let v = self.solution.rounded::<F>().unwrap();
        let g = self
            .solution
            .source::<F>(&self.matrix.coefficients(), &pairs)
            .unwrap();
        let entries = rounded::<F>(self.matrix.entries()).unwrap();
        let dense = Dense::new(&entries, self.matrix.cells(), B).unwrap();
        let neighbour = Piecewise::with_pointwise(&polynomials, &dense, pairs, &v, &g).unwrap();
        then(&polynomials, &neighbour, &v, tables.lengths())
    }
}

impl<const B: usize> Setup<B> {
    /// The neighbour equation from rays alone.
    ///
    /// # Panics
    /// If there is no such neighbour equation.
    pub fn with_rays<F: Real, R>(
        &self,
        then: impl FnOnce(&RayNeighbour<'_, '_, '_, F, B>) -> R,
    ) -> R {
        let views = self.matrix.views();
        let wide = Tables::<f64>::new(&self.scene, &self.mesh);
        let room = Room::new(wide.geometry(), wide.cells(), views, ABSORPTION).unwrap();
        let polynomials = room.with_functions::<B>();
        let setup = RaySetup::new(&polynomials, &self.solution.v).unwrap();
        let cells = (0..self.mesh.len()).map(|cell| setup.cell(cell).unwrap());
        let rays = RayTables::new(cells.collect())
            .unwrap()
            .rounded::<F>()
            .unwrap();

        let tables = Tables::<F>::new(&self.scene, &self.mesh);
        let room = Room::new(tables.geometry(), tables.cells(), views, ABSORPTION).unwrap();
        let polynomials = room.with_functions::<B>();
        let v = self.solution.rounded::<F>().unwrap();
        then(&rays.neighbour(&polynomials, &v).unwrap())
    }
}

impl Setup {
    /// Of a drawing, for walks in F. `spoil` is a relative error of every coefficient.
    ///
    /// # Errors
    /// [`RoomError`].
    pub fn new<F: Real>(
        drawing: &Drawing,
        cells: usize,
        grading: Grading,
    ) -> Result<Self, RoomError> {
        let scene = drawing.scene::<F>()?;
        let mesh = Mesh::new::<F>(&scene, cells, grading)?;
        let matrix = Matrix::new(&scene, &mesh, MIN_MASS_RATIO)?;
        let solution = matrix.solve(&scene, &mesh, 1e-15, 1000)?;
        Ok(Self {
            scene,
            mesh,
            matrix,
            solution,
        })
    }

    /// The neighbour equation for a choice of pairs.
    ///
    /// # Panics
    /// If there is none.
    pub fn with<F: Real, R>(
        &self,
        choice: Choice,
        then: impl FnOnce(&Room<'_, F>, &RoomNeighbour<'_, F>, &[F], &[f64]) -> R,
    ) -> R {
        let tables = Tables::<F>::new(&self.scene, &self.mesh);
        let views = self.matrix.views();
        let room = Room::new(tables.geometry(), tables.cells(), views, ABSORPTION).unwrap();
        let pairs = RoomPairs { views, choice };
        let v = self.solution.rounded::<F>().unwrap();
        let g = self
            .solution
            .source::<F>(&self.matrix.coefficients(), &pairs)
            .unwrap();
        let entries = rounded::<F>(self.matrix.entries()).unwrap();
        let dense = Dense::new(&entries, v.len(), 1).unwrap();
        let neighbour = Piecewise::with_pointwise(&room, &dense, pairs, &v, &g).unwrap();
        then(&room, &neighbour, &v, tables.lengths())
    }
}

/// The neighbour equation of a room.
pub type RoomNeighbour<'a, F> = Piecewise<
    'a,
    F,
    Room<'a, F>,
    Dense<'a, F>,
    RoomPairs<'a>,
    PointwiseSource<'a, F, Room<'a, F>, RoomPairs<'a>>,
>;

/// The three choices of pairs.
pub const CHOICES: [Choice; 3] = [Choice::Paper, Choice::Default, Choice::Pointwise];
