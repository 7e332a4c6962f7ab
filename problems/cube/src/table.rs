//! Galerkin coefficients of any kernel, by quadrature.

use core::ops::Range;
use fredholm_core::array::Each;

use fredholm_core::galerkin::Partition;

use crate::functions::{CellFunctions, Functions, values_at};
use crate::mesh::Mesh;
use crate::{Cube, CubeError, KernelFn, Rule, ScalarField};

/// The memory for the table of `unknowns` = n·B unknowns: 8 (n·B)² bytes. `None`: more than a machine of
/// this word size can address.
#[must_use]
pub const fn table_bytes(unknowns: usize) -> Option<usize> {
    match unknowns.checked_mul(unknowns) {
        Some(entries) => entries.checked_mul(size_of::<f64>()),
        None => None,
    }
}

impl<const D: usize, K, S, const B: usize> Cube<f64, D, K, S, B>
where
    K: KernelFn<f64, D>,
    S: ScalarField<f64, D>,
{
    /// The rows of cell `i` of the table K'_(ia)(jb) = n ∫_Xi ∫_Xj K(x,y) ψ_ia(x) ψ_jb(y) dy dx, (39): B
    /// rows of n·B entries, one after the other, by `rule` in x and in y. That takes n g^2D kernel
    /// evaluations. Cells are independent, so that a runner may fill their rows in parallel.
    ///
    /// # Errors
    /// [`CubeError::Cell`], [`CubeError::Length`] where `rows` has not B·n·B entries,
    /// [`CubeError::Kernel`] where a value is not finite.
    pub fn fill_row(&self, rule: Rule, i: usize, rows: &mut [f64]) -> Result<(), CubeError> {
        let [inner, outer, psi] = &mut [[0.0; B]; 3];
        let quadrature = self.quadrature(rule);
        quadrature.fill_row(self.integral_kernel(), i, rows, [inner, outer, psi])
    }

    const fn quadrature(&self, rule: Rule) -> Quadrature<D> {
        Quadrature {
            mesh: self.mesh(),
            functions: Functions::<D, B>::ALL,
            rule,
        }
    }

    /// The whole table of (n·B)² entries, row by row: for `fredholm_core::galerkin::Dense`.
    ///
    /// # Errors
    /// As [`fill_row`](Self::fill_row).
    pub fn fill_table(&self, rule: Rule, table: &mut [f64]) -> Result<(), CubeError> {
        let unknowns = self.cells().checked_mul(B);
        let entries = unknowns.and_then(|unknowns| unknowns.checked_mul(unknowns));
        let Some(entries) = entries else {
            return Err(CubeError::Memory { bytes: None });
        };
        check_length(entries, table.len())?;
        let rows = entries / self.cells();
        for (i, rows) in table.chunks_exact_mut(rows).enumerate() {
            self.fill_row(rule, i, rows)?;
        }
        Ok(())
    }

    /// F'_ia, the mean of F ψ_ia over every cell, (40), by `rule`.
    ///
    /// # Errors
    /// As [`means`](Self::means).
    pub fn source_means(&self, rule: Rule, out: &mut [f64]) -> Result<(), CubeError> {
        self.means(self.right_hand_side(), rule, out)
    }

    /// The points of `rule` in cell `cell` and their weights, which sum to 1.
    pub fn points(
        &self,
        rule: Rule,
        cell: usize,
    ) -> impl Iterator<Item = ([f64; D], f64)> + use<D, K, S, B> {
        let mesh = self.mesh();
        let nodes = rule.in_cell(mesh.places(cell), mesh.per_axis());
        nodes.map(|node| (node.point, node.weight))
    }

    /// The means of a function times ψ_i0 … ψ_i(B−1) over every cell, by `rule`: those of the function
    /// itself where B = 1, and the coefficients of its piecewise polynomial approximation.
    ///
    /// # Errors
    /// [`CubeError::Length`] where `out` has not n·B entries, [`CubeError::Source`] where a value is
    /// not finite.
    pub fn means<T>(&self, function: &T, rule: Rule, out: &mut [f64]) -> Result<(), CubeError>
    where
        T: ScalarField<f64, D>,
    {
        let quadrature = self.quadrature(rule);
        quadrature.means(function, out, &mut [0.0; B])
    }
}

/// A rule on all cells. Of everything that is set up the dimension alone is a constant, so that it is compiled once for
/// all degrees, kernels and functions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quadrature<const D: usize> {
    pub(crate) mesh: Mesh<D>,
    pub(crate) functions: CellFunctions<D>,
    pub(crate) rule: Rule,
}

/// The block of a cell in its rows of the table.
struct Block<'a> {
    rows: &'a mut [f64],
    /// n·B.
    width: usize,
    columns: Range<usize>,
}

impl Block<'_> {
    fn rows(&mut self) -> impl Iterator<Item = &mut [f64]> {
        let rows = self.rows.chunks_exact_mut(self.width);
        rows.filter_map(|row| row.get_mut(self.columns.clone()))
    }
}

impl<const D: usize> Quadrature<D> {
    /// Fills a row as [`Cube::fill_row`] does; the scratch is B numbers each.
    pub(crate) fn fill_row(
        &self,
        kernel: &dyn KernelFn<f64, D>,
        i: usize,
        rows: &mut [f64],
        mut scratch: [&mut [f64]; 3],
    ) -> Result<(), CubeError> {
        let (cells, functions) = (self.mesh.cells(), self.functions.count());
        let width = cells.saturating_mul(functions);
        check_length(width.saturating_mul(functions), rows.len())?;
        if i >= cells {
            return Err(CubeError::Cell { cell: i });
        }
        rows.fill(0.0);
        for j in 0..cells {
            let mut block = Block {
                rows,
                width,
                columns: j * functions..(j + 1) * functions,
            };
            self.add_block(kernel, [i, j], &mut block, &mut scratch);
            let mut finite = true;
            for k in block.rows().flatten() {
                *k /= cells as f64;
                finite &= k.is_finite();
            }
            if !finite {
                return Err(CubeError::Kernel { row: i, column: j });
            }
        }
        Ok(())
    }

    /// Adds n K'_(i·)(j·): over y for every x first, so that it takes g^2D B + g^D B² operations.
    fn add_block(
        &self,
        kernel: &dyn KernelFn<f64, D>,
        cells: [usize; 2],
        block: &mut Block<'_>,
        [inner, outer, psi]: &mut [&mut [f64]; 3],
    ) {
        let (per_axis, degree) = (self.mesh.per_axis(), self.functions.degree);
        let [from, to] = cells.each(|cell| self.mesh.places(cell));
        for x in self.rule.in_cell(from, per_axis) {
            inner.fill(0.0);
            for y in self.rule.in_cell(to, per_axis) {
                let k = y.weight * kernel.kernel(&x.point, &y.point);
                values_at(y.local, degree, psi);
                add(inner, k, psi);
            }
            values_at(x.local, degree, outer);
            for (row, psi) in block.rows().zip(&**outer) {
                add(row, x.weight * psi, inner);
            }
        }
    }

    /// Takes means as [`Cube::means`] does. `psi` has room for B numbers.
    pub(crate) fn means(
        &self,
        function: &dyn ScalarField<f64, D>,
        out: &mut [f64],
        psi: &mut [f64],
    ) -> Result<(), CubeError> {
        let (mesh, functions) = (self.mesh, self.functions.count());
        let degree = self.functions.degree;
        check_length(mesh.cells().saturating_mul(functions), out.len())?;
        for (i, out) in out.chunks_exact_mut(functions).enumerate() {
            out.fill(0.0);
            for x in self.rule.in_cell(mesh.places(i), mesh.per_axis()) {
                let value = x.weight * function.value(&x.point);
                values_at(x.local, degree, psi);
                add(out, value, psi);
            }
            if !out.iter().all(|mean| mean.is_finite()) {
                return Err(CubeError::Source { row: i });
            }
        }
        Ok(())
    }
}

/// sums += factor · values.
#[inline]
pub(crate) fn add(sums: &mut [f64], factor: f64, values: &[f64]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

fn check_length(expected: usize, found: usize) -> Result<(), CubeError> {
    if expected == found {
        Ok(())
    } else {
        Err(CubeError::Length { expected, found })
    }
}
