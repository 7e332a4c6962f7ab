//! Galerkin coefficients of any kernel, by quadrature.

use fredholm_core::galerkin::Partition;

use crate::{Cube, CubeError, Function, IntegralKernel, Rule};

/// The memory for the table of n = `cells` cells: 8 n² bytes. `None`: more than a machine of this
/// word size can address.
#[must_use]
pub const fn table_bytes(cells: usize) -> Option<usize> {
    match cells.checked_mul(cells) {
        Some(entries) => entries.checked_mul(size_of::<f64>()),
        None => None,
    }
}

impl<const D: usize, K, S> Cube<f64, D, K, S>
where
    K: IntegralKernel<f64, D>,
    S: Function<f64, D>,
{
    /// Row `i` of the table K'_ij = n ∫_Xi ∫_Xj K(x,y) dy dx, (39), by `rule` in x and in y: n g^2D
    /// kernel evaluations. Rows are independent, so that a runner may fill them in parallel.
    ///
    /// # Errors
    /// [`CubeError::Cell`], [`CubeError::Length`] where `row` has not n entries,
    /// [`CubeError::Kernel`] where a value is not finite.
    pub fn fill_row(&self, rule: Rule, i: usize, row: &mut [f64]) -> Result<(), CubeError> {
        let cells = self.cells();
        check_length(cells, row.len())?;
        if i >= cells {
            return Err(CubeError::Cell { cell: i });
        }
        let (mesh, m) = (self.mesh(), self.mesh().per_axis());
        let from = mesh.places(i);
        for (j, out) in row.iter_mut().enumerate() {
            let to = mesh.places(j);
            let mut sum = 0.0;
            for (x, weight) in rule.in_cell(from, m) {
                let inner: f64 = rule
                    .in_cell(to, m)
                    .map(|(y, weight)| weight * self.integral_kernel().kernel(&x, &y))
                    .sum();
                sum += weight * inner;
            }
            if !sum.is_finite() {
                return Err(CubeError::Kernel { row: i, column: j });
            }
            *out = sum / cells as f64;
        }
        Ok(())
    }

    /// The whole table of n² entries, row by row: for `fredholm_core::galerkin::Dense`.
    ///
    /// # Errors
    /// As [`fill_row`](Self::fill_row).
    pub fn fill_table(&self, rule: Rule, table: &mut [f64]) -> Result<(), CubeError> {
        let cells = self.cells();
        let Some(entries) = cells.checked_mul(cells) else {
            return Err(CubeError::Memory { bytes: None });
        };
        check_length(entries, table.len())?;
        for (i, row) in table.chunks_exact_mut(cells).enumerate() {
            self.fill_row(rule, i, row)?;
        }
        Ok(())
    }

    /// F'_i, the mean of F over every cell, (40), by `rule`.
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
    ) -> impl Iterator<Item = ([f64; D], f64)> + use<D, K, S> {
        let mesh = self.mesh();
        rule.in_cell(mesh.places(cell), mesh.per_axis())
    }

    /// The mean of a function over every cell, by `rule`.
    ///
    /// # Errors
    /// [`CubeError::Length`] where `out` has not n entries, [`CubeError::Source`] where a value is
    /// not finite.
    pub fn means<T>(&self, function: &T, rule: Rule, out: &mut [f64]) -> Result<(), CubeError>
    where
        T: Function<f64, D>,
    {
        check_length(self.cells(), out.len())?;
        let mesh = self.mesh();
        for (i, out) in out.iter_mut().enumerate() {
            *out = rule
                .in_cell(mesh.places(i), mesh.per_axis())
                .map(|(x, weight)| weight * function.value(&x))
                .sum();
            if !out.is_finite() {
                return Err(CubeError::Source { row: i });
            }
        }
        Ok(())
    }
}

fn check_length(expected: usize, found: usize) -> Result<(), CubeError> {
    if expected == found {
        Ok(())
    } else {
        Err(CubeError::Length { expected, found })
    }
}
