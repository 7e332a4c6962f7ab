//! Owned tables, and the whole deterministic part in one call.

use alloc::vec::Vec;

use fredholm_core::galerkin::{Coefficients, Partition, Solution, buffer, radius_bounds};

use crate::{Cube, CubeError, Function, IntegralKernel, Rule, table_bytes};

/// The most powers of a matrix that are looked at for its spectral radius.
const POWERS: u32 = 100;

/// The table of K'_ij in [`table_bytes`] bytes, for `fredholm_core::galerkin::Dense`; see
/// [`Cube::fill_row`].
///
/// # Errors
/// [`CubeError::Memory`], [`CubeError::Kernel`].
pub fn table<const D: usize, K, S>(
    cube: &Cube<f64, D, K, S>,
    rule: Rule,
) -> Result<Vec<f64>, CubeError>
where
    K: IntegralKernel<f64, D>,
    S: Function<f64, D>,
{
    let mut table = empty_table(cube.cells())?;
    cube.fill_table(rule, &mut table)?;
    Ok(table)
}

/// Room for the table of n = `cells` cells, all zero: for whoever fills rows in parallel by
/// [`Cube::fill_row`].
///
/// # Errors
/// [`CubeError::Memory`].
pub fn empty_table(cells: usize) -> Result<Vec<f64>, CubeError> {
    let bytes = table_bytes(cells).ok_or(CubeError::Memory { bytes: None })?;
    Ok(buffer(bytes / size_of::<f64>())?)
}

/// The spectral radius of |K'|, bounded from above by powers of it. O(n²) for each power.
///
/// Of the coefficients of K² in place of K, divided by 1 − q0, it is an estimate of that of T_k²p: below 1
/// the walks have a finite variance. That of T_h²p is smaller where all pairs are in S, since its matrix
/// has the squares of means in place of the means of squares.
///
/// # Errors
/// [`CubeError::Memory`].
pub fn absolute_radius<C: Coefficients<Scalar = f64>>(coefficients: &C) -> Result<f64, CubeError> {
    let n = coefficients.cells();
    let (mut w, mut next) = (buffer(n)?, buffer(n)?);
    w.fill(1.0);
    let apply = |w: &[f64], out: &mut [f64]| coefficients.apply_absolute(w, out);
    let [_, upper] = radius_bounds(apply, &mut w, &mut next, POWERS);
    Ok(upper)
}

impl<const D: usize, K, S> Cube<f64, D, K, S>
where
    K: IntegralKernel<f64, D>,
    S: Function<f64, D>,
{
    /// The Galerkin solution: solves (41) until no residual is above `tolerance` times the largest
    /// |F'_i|, at most `at_most` sweeps. F' comes from `rule`.
    ///
    /// # Errors
    /// [`CubeError::Source`], and as [`CubeError::Galerkin`] what [`Solution::new`] says.
    pub fn solve<C: Coefficients<Scalar = f64>>(
        &self,
        coefficients: &C,
        rule: Rule,
        tolerance: f64,
        at_most: u32,
    ) -> Result<Solution, CubeError> {
        let mut source = buffer(self.cells())?;
        self.source_means(rule, &mut source)?;
        Ok(Solution::new(coefficients, source, tolerance, at_most)?)
    }
}
