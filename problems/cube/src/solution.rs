//! Owned tables, and the whole deterministic part in one call.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::galerkin::{
    Coefficients, Pairs, Partition, Solve, Sweeps, contraction_of_powers, gauss_seidel,
    neighbour_source, radius_bounds,
};

use crate::{Cube, CubeError, Function, IntegralKernel, Rule, table_bytes};

/// The most powers of a matrix that are looked at for its spectral radius.
const POWERS: u32 = 100;

/// A vector of `length` zeros, or an error in place of an abort.
pub(crate) fn buffer<F: Real>(length: usize) -> Result<Vec<F>, CubeError> {
    let mut buffer = Vec::new();
    buffer
        .try_reserve_exact(length)
        .map_err(|_| CubeError::Memory {
            bytes: length.checked_mul(size_of::<F>()),
        })?;
    buffer.resize(length, F::zero());
    Ok(buffer)
}

/// The same numbers in the walk's scalar.
///
/// # Errors
/// [`CubeError::Memory`].
pub fn rounded<F: Real>(values: &[f64]) -> Result<Vec<F>, CubeError> {
    let mut out = buffer(values.len())?;
    for (out, &value) in out.iter_mut().zip(values) {
        *out = F::from_f64(value);
    }
    Ok(out)
}

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
    buffer(bytes / size_of::<f64>())
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

/// The Galerkin solution of an equation on the cube, computed in f64.
#[derive(Clone, Debug)]
pub struct Solution {
    /// v_i.
    pub v: Vec<f64>,
    /// How the iteration went.
    pub solve: Solve<f64>,
    /// The largest Σ_j |K'_ij| or, where that is not below 1, a bound of the spectral radius of |K'|.
    pub contraction: f64,
}

impl Solution {
    /// Solves (41) until no residual is above `tolerance` times the largest F'_i, at most `at_most`
    /// sweeps. F' comes from `rule`.
    ///
    /// # Errors
    /// [`CubeError::Source`], [`CubeError::Memory`], and as [`CubeError::Galerkin`] what
    /// [`contraction_of_powers`] and [`gauss_seidel`] say.
    pub fn new<C, const D: usize, K, S>(
        cube: &Cube<f64, D, K, S>,
        coefficients: &C,
        rule: Rule,
        tolerance: f64,
        at_most: u32,
    ) -> Result<Self, CubeError>
    where
        C: Coefficients<Scalar = f64>,
        K: IntegralKernel<f64, D>,
        S: Function<f64, D>,
    {
        let (mut source, mut v) = (buffer(cube.cells())?, buffer(cube.cells())?);
        let contraction = contraction_of_powers(coefficients, &mut source, &mut v, POWERS)?;
        cube.source_means(rule, &mut source)?;
        let largest = source.iter().fold(0.0, |m: f64, f| Real::max(m, f.abs()));
        v.copy_from_slice(&source);
        let sweeps = Sweeps::UntilResidual {
            residual: tolerance * largest,
            at_most,
        };
        let solve = gauss_seidel(coefficients, &source, &mut v, sweeps)?;
        Ok(Self {
            v,
            solve,
            contraction,
        })
    }

    /// v in the walk's scalar.
    ///
    /// # Errors
    /// [`CubeError::Memory`].
    pub fn rounded<F: Real>(&self) -> Result<Vec<F>, CubeError> {
        rounded(&self.v)
    }

    /// G for these coefficients and pairs in the walk's scalar, from v as rounded to it.
    ///
    /// # Errors
    /// [`CubeError::Memory`], [`CubeError::Galerkin`]: the coefficients have another number of cells.
    pub fn source<F: Real, C: Coefficients<Scalar = f64>, P: Pairs>(
        &self,
        coefficients: &C,
        pairs: &P,
    ) -> Result<Vec<F>, CubeError> {
        let mut wide = buffer(self.v.len())?;
        for (wide, &v) in wide.iter_mut().zip(&self.v) {
            *wide = F::from_f64(v).to_f64();
        }
        let mut g = buffer(self.v.len())?;
        neighbour_source(coefficients, pairs, &wide, &mut g)?;
        rounded(&g)
    }
}
