//! Owned tables, and the whole deterministic part in one call.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::galerkin::{
    GalerkinMatrix, Partition, Solution, buffer, collatz_wielandt_bounds,
};

use crate::{CellFunctions, Cube, CubeError, CubeSetup, KernelFn, Rule, ScalarField, table_bytes};

/// The most powers of a matrix that are looked at for its spectral radius.
const POWERS: u32 = 100;

/// The table of K'_ij in [`table_bytes`] bytes, for `fredholm_core::galerkin::Dense`; see
/// [`Cube::fill_row`].
///
/// # Errors
/// [`CubeError::Memory`], [`CubeError::Kernel`].
pub fn table<const D: usize, K, S, const B: usize>(
    cube: &Cube<f64, D, K, S, B>,
    rule: Rule,
) -> Result<Vec<f64>, CubeError>
where
    K: KernelFn<f64, D>,
    S: ScalarField<f64, D>,
{
    let mut table = empty_table(cube.cells().saturating_mul(B))?;
    cube.fill_table(rule, &mut table)?;
    Ok(table)
}

/// Room for the table of `unknowns` = n·B unknowns, all zero: for whoever fills rows in parallel by
/// [`Cube::fill_row`].
///
/// # Errors
/// [`CubeError::Memory`].
pub fn empty_table(unknowns: usize) -> Result<Vec<f64>, CubeError> {
    let bytes = table_bytes(unknowns).ok_or(CubeError::Memory { bytes: None })?;
    Ok(buffer(bytes / size_of::<f64>())?)
}

/// The spectral radius of |K'|, bounded from above by powers of it. O(n²) for each power.
///
/// Of the coefficients of K² in place of K, divided by 1 − q0, it is an estimate of that of T_k²p: below 1
/// the walks have a finite variance. That of T_h²p, [`Cube::neighbour_second_moment_radius`], is smaller if K' is exact,
/// since it has the squares of means in place of the means of squares, and may be larger if it is not.
///
/// # Errors
/// [`CubeError::Memory`].
pub fn absolute_radius(matrix: &dyn GalerkinMatrix<Scalar = f64>) -> Result<f64, CubeError> {
    radius_of(matrix.cells(), &mut |w, out| matrix.apply_absolute(w, out))
}

/// The spectral radius of the matrix w ↦ Aw of n rows without negative entries, from above.
pub(crate) fn radius_of(
    n: usize,
    apply: &mut dyn FnMut(&[f64], &mut [f64]),
) -> Result<f64, CubeError> {
    let (mut w, mut next) = (filled(n, 1.0)?, buffer(n)?);
    let [_, upper] = collatz_wielandt_bounds(apply, &mut w, &mut next, POWERS);
    Ok(upper)
}

fn filled(n: usize, value: f64) -> Result<Vec<f64>, CubeError> {
    let mut filled = buffer(n)?;
    filled.fill(value);
    Ok(filled)
}

impl<const D: usize, K, S, const B: usize> Cube<f64, D, K, S, B>
where
    K: KernelFn<f64, D>,
    S: ScalarField<f64, D>,
{
    /// The Galerkin solution: solves (41) until no residual is above `tolerance` times the largest
    /// |F'_ia|, at most `at_most` sweeps. F' comes from `rule`.
    ///
    /// # Errors
    /// [`CubeError::Source`], and as [`CubeError::Galerkin`] what [`Solution::new`] says.
    pub fn solve(
        &self,
        matrix: &dyn GalerkinMatrix<Scalar = f64>,
        rule: Rule,
        tolerance: f64,
        at_most: u32,
    ) -> Result<Solution, CubeError> {
        CubeSetup::new(self, CellFunctions::new::<B>()).solve(matrix, rule, tolerance, at_most)
    }

    /// An estimate from above of the spectral radius of T_h²p, with all pairs in S: that of the matrix
    ///
    /// ```text
    /// R_ij = n/(1 − q0) Σ_ab K'_(ia)(jb)²
    /// ```
    ///
    /// of the means over X_i of ∫_Xj h(x,y)² p(x,y) dy. Where it is below 1, E η(h,g) = (v,Φ) and the error
    /// bars exist (Heinrich 1995, Proposition 2). It depends on K' and not on K: a rule of few points in
    /// large cells may make K' larger than K is. Where the largest row sum of R is below 1 it is that. O(n² B²)
    /// for each power.
    ///
    /// # Errors
    /// [`CubeError::Memory`].
    pub fn neighbour_second_moment_radius(
        &self,
        matrix: &dyn GalerkinMatrix<Scalar = f64>,
    ) -> Result<f64, CubeError> {
        squares_radius(matrix, self.mass())
    }
}

/// The spectral radius, from above, of the matrix of Σ_ab K'_(ia)(jb)²/`mass`.
pub(crate) fn squares_radius(
    matrix: &dyn GalerkinMatrix<Scalar = f64>,
    mass: f64,
) -> Result<f64, CubeError> {
    let (n, functions) = (matrix.cells(), matrix.functions());
    let mut block: Vec<f64> = buffer(functions.saturating_mul(functions))?;
    let mut apply = |w: &[f64], out: &mut [f64]| {
        for (i, out) in out.iter_mut().enumerate() {
            *out = 0.0;
            for (j, w) in w.iter().enumerate() {
                matrix.block(i, j, &mut block);
                let squares: f64 = block.iter().map(|k| k * k).sum();
                *out += squares * w / mass;
            }
        }
    };
    let (ones, mut sums) = (filled(n, 1.0)?, buffer(n)?);
    apply(&ones, &mut sums);
    let largest = sums.into_iter().fold(0.0, Real::max);
    if largest < 1.0 {
        return Ok(largest);
    }
    radius_of(n, &mut apply)
}
