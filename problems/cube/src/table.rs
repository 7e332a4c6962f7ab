//! Galerkin coefficients of any kernel, by quadrature.

use fredholm_core::galerkin::Partition;

use crate::functions::Functions;
use crate::{Cube, CubeError, Function, IntegralKernel, Rule};

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
    K: IntegralKernel<f64, D>,
    S: Function<f64, D>,
{
    /// The rows of cell `i` of the table K'_(ia)(jb) = n ∫_Xi ∫_Xj K(x,y) ψ_ia(x) ψ_jb(y) dy dx, (39): B
    /// rows of n·B entries, one after the other, by `rule` in x and in y. That takes n g^2D kernel
    /// evaluations. Cells are independent, so that a runner may fill their rows in parallel.
    ///
    /// # Errors
    /// [`CubeError::Cell`], [`CubeError::Length`] where `rows` has not B·n·B entries,
    /// [`CubeError::Kernel`] where a value is not finite.
    pub fn fill_row(&self, rule: Rule, i: usize, rows: &mut [f64]) -> Result<(), CubeError> {
        let cells = self.cells();
        let width = cells.saturating_mul(B);
        check_length(width.saturating_mul(B), rows.len())?;
        if i >= cells {
            return Err(CubeError::Cell { cell: i });
        }
        for j in 0..cells {
            let block = self.block(rule, i, j);
            if !block.iter().flatten().all(|k| k.is_finite()) {
                return Err(CubeError::Kernel { row: i, column: j });
            }
            for (row, entries) in rows.chunks_exact_mut(width).zip(block) {
                for (out, entry) in row.iter_mut().skip(j * B).zip(entries) {
                    *out = entry;
                }
            }
        }
        Ok(())
    }

    /// K'_(i·)(j·): over y for every x first, so that it takes g^2D B + g^D B² operations.
    fn block(&self, rule: Rule, i: usize, j: usize) -> [[f64; B]; B] {
        let (mesh, m) = (self.mesh(), self.mesh().per_axis());
        let (from, to) = (mesh.places(i), mesh.places(j));
        let mut block = [[0.0; B]; B];
        for x in rule.in_cell(from, m) {
            let mut inner = [0.0; B];
            for y in rule.in_cell(to, m) {
                let k = y.weight * self.integral_kernel().kernel(&x.point, &y.point);
                add(&mut inner, k, &Functions::<D, B>::at(y.local));
            }
            for (row, psi) in block.iter_mut().zip(Functions::<D, B>::at(x.local)) {
                add(row, x.weight * psi, &inner);
            }
        }
        let n = self.cells() as f64;
        for k in block.iter_mut().flatten() {
            *k /= n;
        }
        block
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
        T: Function<f64, D>,
    {
        check_length(self.cells().saturating_mul(B), out.len())?;
        let mesh = self.mesh();
        for (i, out) in out.chunks_exact_mut(B).enumerate() {
            let mut sums = [0.0; B];
            for x in rule.in_cell(mesh.places(i), mesh.per_axis()) {
                let value = x.weight * function.value(&x.point);
                add(&mut sums, value, &Functions::<D, B>::at(x.local));
            }
            if !sums.iter().all(|sum| sum.is_finite()) {
                return Err(CubeError::Source { row: i });
            }
            out.copy_from_slice(&sums);
        }
        Ok(())
    }
}

/// sums += factor · values.
#[inline]
pub(crate) fn add<const B: usize>(sums: &mut [f64; B], factor: f64, values: &[f64; B]) {
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
