//! What is set up before walks, by Gauss rules on cells.

use alloc::vec::Vec;

use fredholm_core::array::{Each, from_fn};
use fredholm_core::galerkin::{buffer, functions, legendre, reserve};
use fredholm_core::{Real, Space};
use fredholm_variance::{Quadrature, Step, gauss};

use crate::functions::{Axis, PER_AXIS, add_products};
use crate::mesh::Mesh;
use crate::{Cube, CubeError, CubeScores, KernelFactors, KernelFn, ProductTables, ScalarField};

/// The Gauss–Legendre rule of g points per axis on all cells, exact for polynomials of degree 2g − 1 in each
/// variable, and what it makes of kernels and functions: coefficients K', means F'. The total degree p of the functions on a cell is
/// known at run time, so that a rule is compiled once for all degrees, kernels and functions.
///
/// K' and F' by quadrature are approximations, which cost variance and no correctness. With functions of
/// degree p the variance is that of a main part of order p + 1: for smooth kernels p + 1 points give away
/// little; for piecewise constants that is one point, the middle of a cell. With fewer than p + 1 points
/// some function vanishes at all of them and does nothing.
///
/// It is the quadrature of a predicted variance, too: see [`sites`](Self::sites).
///
/// ```
/// use fredholm_core::galerkin::{Cells, Dense, Solution};
/// use fredholm_core::Located;
/// use fredholm_cube::{Cube, CubeRule, CubeScores};
///
/// // K = x y/2 and F = x have the solution u = 6x/5.
/// let kernel = |x: &[f64; 1], y: &[f64; 1]| 0.5 * x[0] * y[0];
/// let cube = Cube::new(kernel, |x: &[f64; 1]| x[0], 4)?;
/// let rule = CubeRule::new(&cube, 1, 2)?;
/// let table = rule.table(&kernel)?;
/// let matrix = Dense::new(&table, 4, 2).expect("four cells of two functions");
/// let solution = Solution::new(&matrix, rule.means(cube.right_hand_side())?, 1e-14, 100)?;
/// let x = Located { point: [0.3], cell: cube.locate(&[0.3]) };
/// let v = CubeScores::new(&cube, 1)?.value(&x, &solution.v);
/// assert!((v - 0.36).abs() < 1e-13);
/// # Ok::<(), fredholm_cube::CubeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct CubeRule<const D: usize> {
    mesh: Mesh<D>,
    degree: usize,
    /// B.
    functions: usize,
    /// g.
    per_axis: usize,
    /// Places in a cell [0, 1]^D, and weights that sum to 1.
    nodes: Vec<([f64; D], f64)>,
    /// The B functions at the first node, then those at the next.
    psi: Vec<f64>,
}

impl<const D: usize> CubeRule<D> {
    /// The rule of g = `points` points per axis on the cells of a cube, with functions of this total degree or less.
    ///
    /// # Errors
    /// [`CubeError::Points`], [`CubeError::Galerkin`]: memory.
    pub fn new<F, K, S, const B: usize>(
        cube: &Cube<F, D, K, S, B>,
        degree: usize,
        points: usize,
    ) -> Result<Self, CubeError>
    where
        F: Real,
    {
        Self::on_mesh(cube.mesh(), degree, points)
    }

    /// The rule of p + 2 points per axis by which variances of a neighbour equation of degree p are predicted: its sites
    /// are the cells, or equal parts of them as long as there are at most `nodes` nodes.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn sites<K, S, const B: usize>(
        cube: &Cube<f64, D, K, S, B>,
        degree: usize,
        nodes: usize,
    ) -> Result<Self, CubeError> {
        let cells = cube.per_axis();
        let fits = |per_axis: usize| {
            let axis = per_axis.saturating_mul(degree + 2);
            axis.saturating_pow(D as u32) <= nodes
        };
        let mut per_axis = cells;
        while fits(per_axis + cells) {
            per_axis += cells;
        }
        Self::on_mesh(Mesh::new(per_axis)?, 0, degree + 2)
    }

    fn on_mesh(mesh: Mesh<D>, degree: usize, points: usize) -> Result<Self, CubeError> {
        if points == 0 || degree > CubeScores::<D>::MOST_DEGREE {
            return Err(CubeError::Points);
        }
        let (axis, functions) = (gauss(points)?, functions(D, degree));
        let values: Vec<Axis> = axis.iter().map(|&(t, _)| legendre(t)).collect();
        let count = points.saturating_pow(D as u32);
        let mut nodes = reserve(count)?;
        let mut psi = buffer(count.saturating_mul(functions))?;
        for (mut number, psi) in psi.chunks_exact_mut(functions).enumerate() {
            let (mut share, mut at): (_, [Axis; D]) = (1.0, [[0.0; PER_AXIS]; D]);
            let place = from_fn(|a| {
                let (t, weight) = axis[number % points];
                at[a] = values[number % points];
                number /= points;
                share *= 0.5 * weight;
                0.5 * (1.0 + t)
            });
            add_products(&at, degree, 1.0, &mut psi.iter_mut());
            nodes.push((place, share));
        }
        Ok(Self {
            mesh,
            degree,
            functions,
            per_axis: points,
            nodes,
            psi,
        })
    }

    /// The number n of cells.
    #[must_use]
    pub const fn cells(&self) -> usize {
        self.mesh.cells()
    }

    /// The number B of functions on a cell.
    #[must_use]
    pub const fn functions(&self) -> usize {
        self.functions
    }

    /// The number n·B of unknowns.
    #[must_use]
    pub const fn unknowns(&self) -> usize {
        self.mesh.cells().saturating_mul(self.functions)
    }

    /// The points in a cell, and their weights, which sum to 1.
    pub fn points(&self, cell: usize) -> impl Iterator<Item = ([f64; D], f64)> {
        let corner = self.mesh.places(cell).each(f64::from);
        let width = 1.0 / f64::from(self.mesh.per_axis());
        let nodes = self.nodes.iter();
        nodes.map(move |(t, weight)| (from_fn(|a| (corner[a] + t[a]) * width), *weight))
    }

    /// The points in a cell, their weights, and the functions there.
    fn at(&self, cell: usize) -> impl Iterator<Item = ([f64; D], f64, &[f64])> {
        let values = self.psi.chunks_exact(self.functions);
        self.points(cell)
            .zip(values)
            .map(|((x, weight), psi)| (x, weight, psi))
    }

    /// The rows of cell `i` of the table K'_(ia)(jb) = n ∫_Xi ∫_Xj K(x,y) ψ_ia(x) ψ_jb(y) dy dx, (39): B
    /// rows of n·B entries, one after the other. That takes n g^2D kernel
    /// evaluations. Cells are independent, so that a runner may fill their rows in parallel.
    ///
    /// # Errors
    /// [`CubeError::Cell`], [`CubeError::Length`] where `rows` has not B·n·B entries,
    /// [`CubeError::Kernel`] where a value is not finite, [`CubeError::Galerkin`]: memory.
    pub fn fill_row(
        &self,
        kernel: &dyn KernelFn<f64, D>,
        i: usize,
        rows: &mut [f64],
    ) -> Result<(), CubeError> {
        let (cells, width) = (self.cells(), self.unknowns());
        CubeError::check_length(width.saturating_mul(self.functions), rows.len())?;
        if i >= cells {
            return Err(CubeError::Cell { cell: i });
        }
        let mut inner = buffer(self.functions)?;
        rows.fill(0.0);
        for j in 0..cells {
            let columns = j * self.functions..(j + 1) * self.functions;
            // Over y for every x first, so that it takes g^2D B + g^D B² operations.
            for (x, x_weight, outer) in self.at(i) {
                inner.fill(0.0);
                for (y, weight, psi) in self.at(j) {
                    add(&mut inner, weight * kernel.kernel(&x, &y), psi);
                }
                for (row, psi) in rows.chunks_exact_mut(width).zip(outer) {
                    add(&mut row[columns.clone()], x_weight * psi, &inner);
                }
            }
            let mut is_finite = true;
            let block = rows.chunks_exact_mut(width);
            for k in block.flat_map(|row| &mut row[columns.clone()]) {
                *k /= cells as f64;
                is_finite &= k.is_finite();
            }
            if !is_finite {
                return Err(CubeError::Kernel { row: i, column: j });
            }
        }
        Ok(())
    }

    /// The whole table of (n·B)² entries, for [`Dense`](fredholm_core::galerkin::Dense).
    ///
    /// # Errors
    /// As [`fill_row`](Self::fill_row).
    pub fn table(&self, kernel: &dyn KernelFn<f64, D>) -> Result<Vec<f64>, CubeError> {
        let unknowns = self.unknowns();
        let mut table = buffer(unknowns.saturating_mul(unknowns))?;
        let rows = table.chunks_exact_mut(unknowns * self.functions);
        for (i, rows) in rows.enumerate() {
            self.fill_row(kernel, i, rows)?;
        }
        Ok(table)
    }

    /// The tables of the kernel with these factors: those of its factors, each on an axis. They give what
    /// [`table`](Self::table) does, up to rounding.
    ///
    /// # Errors
    /// [`CubeError::Kernel`] where a factor is not finite, [`CubeError::Galerkin`]: memory.
    pub fn product_tables(
        &self,
        factors: &dyn KernelFactors<f64>,
    ) -> Result<ProductTables<Vec<f64>, D>, CubeError> {
        let mesh = Mesh::new(self.mesh.per_axis() as usize)?;
        let axis = CubeRule::<1>::on_mesh(mesh, self.degree, self.per_axis)?;
        let mut entries: Vec<f64> = Vec::new();
        for number in 0..D {
            let kernel = |x: &[f64; 1], y: &[f64; 1]| factors.factor(number, x[0], y[0]);
            entries.extend(axis.table(&kernel)?);
        }
        ProductTables::on_mesh(self.mesh, self.degree, entries)
    }

    /// The means of a function times ψ_i0 … ψ_i(B−1) over every cell, n·B numbers: those of the function
    /// itself where B = 1, and the coefficients of its piecewise polynomial approximation. Of the source they are F', (40).
    ///
    /// # Errors
    /// [`CubeError::Source`] where a value is not finite, [`CubeError::Galerkin`]: memory.
    pub fn means(&self, function: &dyn ScalarField<f64, D>) -> Result<Vec<f64>, CubeError> {
        let mut means = buffer(self.unknowns())?;
        for (i, out) in means.chunks_exact_mut(self.functions).enumerate() {
            self.add_means(function, i, out);
            if !out.iter().all(|mean| mean.is_finite()) {
                return Err(CubeError::Source { row: i });
            }
        }
        Ok(means)
    }

    /// Adds the means of a function over a cell to B numbers.
    pub fn add_means(&self, function: &dyn ScalarField<f64, D>, cell: usize, out: &mut [f64]) {
        for (x, weight, psi) in self.at(cell) {
            add(out, weight * function.value(&x), psi);
        }
    }
}

/// sums += factor · values.
#[inline]
pub(crate) fn add(sums: &mut [f64], factor: f64, values: &[f64]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

impl<const D: usize> Space for CubeRule<D> {
    type Scalar = f64;
    type Point = [f64; D];
}

/// Sites are the rule's own cells.
impl<const D: usize> Quadrature for CubeRule<D> {
    fn sites(&self) -> usize {
        self.cells()
    }

    fn locate(&self, x: &[f64; D]) -> usize {
        self.mesh.locate(x, f64::from(self.mesh.per_axis()))
    }

    fn nodes(&self, site: usize, mut visit: impl FnMut([f64; D], f64)) {
        let volume = 1.0 / self.cells() as f64;
        self.points(site)
            .for_each(|(x, weight)| visit(x, volume * weight));
    }

    fn steps(&self, _: &[f64; D], site: usize, mut visit: impl FnMut(Step<[f64; D]>)) {
        let volume = 1.0 / self.cells() as f64;
        for (node, (point, weight)) in self.points(site).enumerate() {
            visit(Step {
                point,
                weight: volume * weight,
                node: Some(node),
            });
        }
    }
}
