//! The deterministic part in one call, with buffers of its own.

use alloc::vec::Vec;

use super::{
    Coefficients, Convergence, GalerkinError, GalerkinMatrix, PairKind, Pairs, StoppingRule,
    TransitionMoments, collatz_wielandt_bounds, gauss_seidel, neighbour_source, second_moment,
    spectral_radius_bound,
};
use crate::{Located, Real};

/// The most powers of a matrix that are looked at for its spectral radius.
const POWERS: u32 = 100;

/// A vector of `length` default values, or an error in place of an abort.
///
/// # Errors
/// [`GalerkinError::Memory`].
pub fn buffer<T: Clone + Default>(length: usize) -> Result<Vec<T>, GalerkinError> {
    let mut buffer = reserve(length)?;
    buffer.resize(length, T::default());
    Ok(buffer)
}

/// An empty vector with room for `length` values, or an error in place of an abort.
///
/// # Errors
/// [`GalerkinError::Memory`].
pub fn reserve<T>(length: usize) -> Result<Vec<T>, GalerkinError> {
    let mut empty = Vec::new();
    empty
        .try_reserve_exact(length)
        .map_err(|_| GalerkinError::Memory {
            bytes: length.checked_mul(size_of::<T>()),
        })?;
    Ok(empty)
}

/// Rounds numbers to the walk's scalar.
///
/// # Errors
/// [`GalerkinError::Memory`].
pub fn rounded<F: Real>(values: &[f64]) -> Result<Vec<F>, GalerkinError> {
    let mut out = buffer(values.len())?;
    for (out, &value) in out.iter_mut().zip(values) {
        *out = F::from_f64(value);
    }
    Ok(out)
}

/// The spectral radius of the operator with the kernel h²p, on which the error bars of preconditioned
/// walks depend (Heinrich 1995, Proposition 2), estimated by powers of the matrix of
/// sup_x ∫_Xj h(x,y)² p(x,y) dμ(y), the supremum over `points(i)` of X_i. Below 1, E η(h,g) = (v,Φ) too, of
/// any degree.
///
/// `pointwise(x, j)` is ∫_Xj k² p dμ(y), for the pointwise pairs, on which h = k. O(n²) for the matrix and for
/// each of at most 100 powers.
///
/// # Errors
/// [`GalerkinError::Memory`]; [`GalerkinError::Length`]: coefficients of another number of cells;
/// [`GalerkinError::Functions`].
pub fn second_moment_radius<Q, C, I, const B: usize>(
    problem: &Q,
    coefficients: &C,
    pairs: &dyn Pairs,
    points: impl Fn(usize) -> I,
    pointwise: impl Fn(&Located<Q::Point>, usize) -> f64,
) -> Result<f64, GalerkinError>
where
    Q: TransitionMoments<B>,
    C: Coefficients<B, Scalar = Q::Scalar>,
    I: IntoIterator<Item = Q::Point>,
{
    let n = problem.cells();
    let found = coefficients.functions();
    if found != B {
        return Err(GalerkinError::Functions { expected: B, found });
    }
    if coefficients.cells() != n {
        return Err(GalerkinError::Length {
            expected: n * B,
            found: coefficients.cells() * B,
        });
    }
    radius_of_suprema(n, &mut |i, row| {
        for point in points(i) {
            let x = Located { point, cell: i };
            for (j, largest) in row.iter_mut().enumerate() {
                let moment = match pairs.kind(i, j) {
                    PairKind::Galerkin => second_moment(problem, coefficients, &x, j).to_f64(),
                    PairKind::Pointwise => pointwise(&x, j),
                    PairKind::Dropped => 0.0,
                };
                // A moment that is NaN is no moment below 1.
                let moment = if moment.is_nan() {
                    f64::INFINITY
                } else {
                    moment
                };
                *largest = moment.max(*largest);
            }
        }
    })
}

/// The spectral radius of a matrix of n rows without negative entries, which `fill` raises from zero.
fn radius_of_suprema(
    n: usize,
    fill: &mut dyn FnMut(usize, &mut [f64]),
) -> Result<f64, GalerkinError> {
    let entries = n.checked_mul(n);
    let mut matrix: Vec<f64> = buffer(entries.ok_or(GalerkinError::Memory { bytes: None })?)?;
    for (i, row) in matrix.chunks_exact_mut(n.max(1)).enumerate() {
        fill(i, row);
    }
    if matrix.iter().any(|moment| moment.is_infinite()) {
        return Ok(f64::INFINITY);
    }
    let (mut w, mut next) = (buffer(n)?, buffer(n)?);
    w.fill(1.0);
    let mut apply = |w: &[f64], out: &mut [f64]| {
        for (out, row) in out.iter_mut().zip(matrix.chunks_exact(n.max(1))) {
            *out = row.iter().zip(w).map(|(m, w)| m * w).sum();
        }
    };
    let [_, upper] = collatz_wielandt_bounds(&mut apply, &mut w, &mut next, POWERS);
    Ok(upper)
}

/// A Galerkin solution, computed in f64. Problems have a `solve` that makes one.
///
/// ```
/// use fredholm_core::galerkin::{Dense, DiagonalRule, PairKind, Solution};
///
/// // Two cells: (I − K') v = F'.
/// let table = [0.1, 0.2, 0.3, 0.4];
/// let coefficients = Dense::new(&table, 2, 1).unwrap();
/// let solution = Solution::new(&coefficients, vec![1.0, 2.0], 1e-15, 100)?;
/// assert!((solution.v[0] - 1.0 / 0.48).abs() < 1e-14);
/// // With all pairs in S, G is F' up to what is left of the residual.
/// let pairs = DiagonalRule { diagonal: PairKind::Galerkin };
/// let g: Vec<f64> = solution.source(&coefficients, &pairs)?;
/// assert!((g[0] - 1.0).abs() < 1e-14 && (g[1] - 2.0).abs() < 1e-14);
/// # Ok::<(), fredholm_core::galerkin::GalerkinError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Solution {
    /// v_ia, n·B entries.
    pub v: Vec<f64>,
    /// How the iteration went.
    pub convergence: Convergence<f64>,
    /// The largest Σ_j |K'_(i0)(j0)| or, where that is not below 1, a bound of the spectral radius of these
    /// absolute values.
    pub radius_bound: f64,
}

impl Solution {
    /// Solves (41) with the right-hand side F' = `source` until no residual is above `tolerance` times
    /// the largest |F'_ia|, at most `at_most` sweeps.
    ///
    /// # Errors
    /// What [`spectral_radius_bound`] and [`gauss_seidel`] say, and [`GalerkinError::Memory`].
    pub fn new(
        matrix: &dyn GalerkinMatrix<Scalar = f64>,
        source: Vec<f64>,
        tolerance: f64,
        at_most: u32,
    ) -> Result<Self, GalerkinError> {
        let cells = matrix.cells();
        let radius_bound = {
            let (mut w, mut next) = (buffer(cells)?, buffer(cells)?);
            spectral_radius_bound(matrix, &mut w, &mut next, POWERS)?
        };
        let largest = source.iter().fold(0.0, |m: f64, f| Real::max(m, f.abs()));
        // F' is a good start: what the kernel adds is missing.
        let mut v = buffer(source.len())?;
        v.copy_from_slice(&source);
        let sweeps = StoppingRule::UntilResidual {
            residual: tolerance * largest,
            at_most,
        };
        let mut scratch = buffer(matrix.scratch())?;
        let convergence = gauss_seidel(matrix, &source, &mut v, &mut scratch, sweeps)?;
        Ok(Self {
            v,
            convergence,
            radius_bound,
        })
    }

    /// v in the walk's scalar.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn rounded<F: Real>(&self) -> Result<Vec<F>, GalerkinError> {
        rounded(&self.v)
    }

    /// v as the walk's scalar has it, in f64: what everything exact must be computed from.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn rounded_through<F: Real>(&self) -> Result<Vec<f64>, GalerkinError> {
        let mut seen = buffer(self.v.len())?;
        for (seen, &v) in seen.iter_mut().zip(&self.v) {
            *seen = F::from_f64(v).to_f64();
        }
        Ok(seen)
    }

    /// G over S for these coefficients and pairs in the walk's scalar, from v as rounded to it.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`]; [`GalerkinError::Length`]: the coefficients have another number of
    /// cells.
    pub fn source<F: Real>(
        &self,
        matrix: &dyn GalerkinMatrix<Scalar = f64>,
        pairs: &dyn Pairs,
    ) -> Result<Vec<F>, GalerkinError> {
        let mut g = buffer(self.v.len())?;
        neighbour_source(matrix, pairs, &self.rounded_through::<F>()?, &mut g)?;
        rounded(&g)
    }
}
