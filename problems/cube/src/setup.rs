//! What is set up before walks, with the number of functions on a cell known at run time.

use alloc::vec::Vec;

use fredholm_core::Located;
use fredholm_core::galerkin::{GalerkinMatrix, Solution, buffer};

use crate::functions::CellFunctions;
use crate::mesh::Mesh;
use crate::solution::squares_radius;
use crate::table::Quadrature;
use crate::{Cube, CubeError, KernelFactors, KernelFn, ProductTables, Rule, ScalarField};

/// The set-up of an equation on [0, 1]^D: coefficients, moments and the Galerkin solution, with [`CellFunctions`] known at run
/// time. [`Cube`] has the same methods with a constant number of functions; here they are compiled once for all degrees.
///
/// ```
/// use fredholm_core::galerkin::Dense;
/// use fredholm_cube::{CellFunctions, Cube, CubeSetup, Rule, empty_table};
///
/// // K = x y/2 and F = x have the solution u = 6x/5.
/// let kernel = |x: &[f64; 1], y: &[f64; 1]| 0.5 * x[0] * y[0];
/// let cube = Cube::<f64, 1, _, _>::new(kernel, |x: &[f64; 1]| x[0], 4, 0.2)?;
/// let setup = CubeSetup::new(&cube, CellFunctions::new::<2>());
/// let mut table = empty_table(setup.unknowns())?;
/// for (i, rows) in table.chunks_exact_mut(2 * setup.unknowns()).enumerate() {
///     setup.fill_row(Rule::new(2)?, i, rows)?;
/// }
/// let matrix = Dense::new(&table, 4, 2).expect("four cells of two functions");
/// let solution = setup.solve(&matrix, Rule::new(2)?, 1e-14, 100)?;
/// assert!((setup.value(&solution.v, &[0.3]) - 0.36).abs() < 1e-13);
/// # Ok::<(), fredholm_cube::CubeError>(())
/// ```
#[derive(Clone, Copy)]
pub struct CubeSetup<'a, const D: usize> {
    kernel: &'a dyn KernelFn<f64, D>,
    pub(crate) source: &'a dyn ScalarField<f64, D>,
    pub(crate) mesh: Mesh<D>,
    pub(crate) functions: CellFunctions<D>,
    mass: f64,
}

impl<const D: usize> core::fmt::Debug for CubeSetup<'_, D> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("CubeSetup")
            .field("mesh", &self.mesh)
            .field("degree", &self.functions.degree())
            .finish_non_exhaustive()
    }
}

impl<'a, const D: usize> CubeSetup<'a, D> {
    /// The set-up of a cube's equation with these functions on its cells.
    pub fn new<K, S, const B: usize>(
        cube: &'a Cube<f64, D, K, S, B>,
        functions: CellFunctions<D>,
    ) -> Self
    where
        K: KernelFn<f64, D>,
        S: ScalarField<f64, D>,
    {
        Self {
            kernel: cube.integral_kernel(),
            source: cube.right_hand_side(),
            mesh: cube.mesh(),
            functions,
            mass: cube.mass(),
        }
    }

    /// The number n of cells.
    #[must_use]
    pub const fn cells(&self) -> usize {
        self.mesh.cells()
    }

    /// The number n·B of unknowns.
    #[must_use]
    pub const fn unknowns(&self) -> usize {
        self.mesh.cells().saturating_mul(self.functions.count())
    }

    const fn quadrature(&self, rule: Rule) -> Quadrature<D> {
        Quadrature {
            mesh: self.mesh,
            functions: self.functions,
            rule,
        }
    }

    /// The B rows of cell `i` of the table of coefficients: see [`Cube::fill_row`].
    ///
    /// # Errors
    /// As [`Cube::fill_row`], and [`CubeError::Memory`].
    pub fn fill_row(&self, rule: Rule, i: usize, rows: &mut [f64]) -> Result<(), CubeError> {
        let [mut inner, mut outer, mut psi] = [self.block()?, self.block()?, self.block()?];
        let scratch: [&mut [f64]; 3] = [&mut inner, &mut outer, &mut psi];
        self.quadrature(rule)
            .fill_row(self.kernel, i, rows, scratch)
    }

    /// The tables of a product kernel with these factors: see [`ProductTables::new`].
    ///
    /// # Errors
    /// As [`ProductTables::new`].
    pub fn product_tables(
        &self,
        factors: &dyn KernelFactors<f64>,
        rule: Rule,
    ) -> Result<ProductTables<f64, D>, CubeError> {
        ProductTables::of_factors(factors, self.mesh, self.functions, rule)
    }

    /// The tables of a product kernel from entries that were computed before: see [`ProductTables::from_entries`].
    ///
    /// # Errors
    /// As [`ProductTables::from_entries`].
    pub fn product_tables_of(&self, entries: Vec<f64>) -> Result<ProductTables<f64, D>, CubeError> {
        ProductTables::of_entries(self.mesh, self.functions, entries)
    }

    /// F'_ia, the mean of F ψ_ia over every cell, (40), by `rule`: n·B numbers.
    ///
    /// # Errors
    /// As [`means`](Self::means).
    pub fn source_means(&self, rule: Rule) -> Result<Vec<f64>, CubeError> {
        self.means(self.source, rule)
    }

    /// The means of a function times ψ_i0 … ψ_i(B−1) over every cell, by `rule`: n·B numbers.
    ///
    /// # Errors
    /// [`CubeError::Source`] where a value is not finite, [`CubeError::Memory`].
    pub fn means(
        &self,
        function: &dyn ScalarField<f64, D>,
        rule: Rule,
    ) -> Result<Vec<f64>, CubeError> {
        let mut means = buffer(self.unknowns())?;
        let mut psi = self.block()?;
        let quadrature = self.quadrature(rule);
        quadrature.means(function, &mut means, &mut psi)?;
        Ok(means)
    }

    /// The Galerkin solution: see [`Cube::solve`].
    ///
    /// # Errors
    /// As [`Cube::solve`].
    pub fn solve(
        &self,
        matrix: &dyn GalerkinMatrix<Scalar = f64>,
        rule: Rule,
        tolerance: f64,
        at_most: u32,
    ) -> Result<Solution, CubeError> {
        let source = self.source_means(rule)?;
        Ok(Solution::new(matrix, source, tolerance, at_most)?)
    }

    /// The value at x ∈ [0, 1]^D of a function on cells, from its n·B coefficients. NaN if they are fewer.
    #[must_use]
    pub fn value(&self, v: &[f64], x: &[f64; D]) -> f64 {
        let at = Located {
            point: *x,
            cell: self.mesh.locate(x, f64::from(self.mesh.per_axis())),
        };
        let functions = self.functions.count();
        let block = v.get(at.cell * functions..(at.cell + 1) * functions);
        block.map_or(f64::NAN, |v| self.functions.sum(&self.mesh, &at, v))
    }

    /// An estimate from above of the spectral radius of T_h²p with all pairs in S: see
    /// [`Cube::neighbour_second_moment_radius`].
    ///
    /// # Errors
    /// [`CubeError::Memory`].
    pub fn neighbour_second_moment_radius(
        &self,
        matrix: &dyn GalerkinMatrix<Scalar = f64>,
    ) -> Result<f64, CubeError> {
        squares_radius(matrix, self.mass)
    }

    /// Room for a number for each function of a cell.
    pub(crate) fn block(&self) -> Result<Vec<f64>, CubeError> {
        Ok(buffer(self.functions.count())?)
    }
}
