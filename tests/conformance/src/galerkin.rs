//! The kit's own Galerkin system of any described problem, by quadrature: it needs nothing of the
//! problem's own coefficients, so that a neighbour equation can be checked before there are any.

use fredholm_core::galerkin::{
    Basis, Dense, GalerkinError, Pairs, Partition, StoppingRule, collatz_wielandt_bounds,
    gauss_seidel, neighbour_source,
};
use fredholm_core::{Kernel, Located, Real, Source, StateSpace, TransitionDensity};

use crate::description::Description;
use crate::outcome::Sum;

/// The points of cell `i` with weights that sum to 1.
pub(crate) fn normalised<D: Description<B>, const B: usize>(
    description: &D,
    i: usize,
) -> impl Iterator<Item = (Located<crate::description::PointOf<D, B>>, f64)> {
    let middle = description.point(i, &vec![0.5; D::DIMENSION]);
    let nodes = description.nodes(&middle, i);
    let measure: Sum = nodes.iter().map(|(_, weight)| *weight).collect();
    let measure = measure.value();
    nodes
        .into_iter()
        .map(move |(point, weight)| (Located { point, cell: i }, weight / measure))
}

/// K'_(ia)(jb), (39), row by row.
#[must_use]
pub fn matrix<D: Description<B>, const B: usize>(description: &D) -> Vec<f64> {
    let equation = description.equation();
    let unknowns = equation.cells() * B;
    let mut matrix = vec![Sum::default(); unknowns * unknowns];
    for i in 0..equation.cells() {
        for (x, outer) in normalised(description, i) {
            let left = equation.basis(&x).map(|psi| outer * psi.to_f64());
            for j in 0..equation.cells() {
                let mut inner = [Sum::default(); B];
                for (point, weight) in description.nodes(&x.point, j) {
                    let k = weight
                        * equation.density(&x.point, &point).to_f64()
                        * equation.kernel(&x.point, &point).to_f64();
                    let psi = equation.basis(&Located { point, cell: j });
                    for (sum, psi) in inner.iter_mut().zip(psi) {
                        sum.add(k * psi.to_f64());
                    }
                }
                for (a, left) in left.iter().enumerate() {
                    for (b, inner) in inner.iter().enumerate() {
                        matrix[(i * B + a) * unknowns + j * B + b].add(left * inner.value());
                    }
                }
            }
        }
    }
    matrix.iter().map(Sum::value).collect()
}

/// F'_ia, (40).
#[must_use]
pub fn right_hand_side<D: Description<B>, const B: usize>(description: &D) -> Vec<f64> {
    let equation = description.equation();
    let mut right = vec![Sum::default(); equation.cells() * B];
    for (i, right) in right.chunks_exact_mut(B).enumerate() {
        for (x, weight) in normalised(description, i) {
            let source = weight * equation.source(&x.point).to_f64();
            for (sum, psi) in right.iter_mut().zip(equation.basis(&x)) {
                sum.add(source * psi.to_f64());
            }
        }
    }
    right.iter().map(Sum::value).collect()
}

/// v with v = K'v + F'.
///
/// # Errors
/// [`GalerkinError::Diverges`]: Gauss–Seidel sweeps do not converge, ‖K'‖ is not below 1.
///
/// # Panics
/// If the matrix is not square.
pub fn solve<const B: usize>(matrix: &[f64], right: &[f64]) -> Result<Vec<f64>, GalerkinError> {
    let coefficients = Dense::new(matrix, right.len() / B, B).expect("a square matrix");
    let mut v = right.to_vec();
    let largest = right.iter().fold(0.0, |m: f64, f| m.max(f.abs()));
    let sweeps = StoppingRule::UntilResidual {
        residual: 1e-15 * largest,
        at_most: 1000,
    };
    let mut scratch = vec![0.0; B * (B + 1)];
    gauss_seidel(&coefficients, right, &mut v, &mut scratch, sweeps)?;
    Ok(v)
}

/// The tables of a neighbour equation in the walk's scalar, set up as a user does: everything in
/// f64, v rounded before G is computed from it.
#[derive(Clone, Debug)]
pub struct Tables<F> {
    /// K'.
    pub matrix: Vec<F>,
    /// v.
    pub v: Vec<F>,
    wide: [Vec<f64>; 2],
    functions: usize,
}

impl<F: Real> Tables<F> {
    /// For coefficients K' and right-hand sides F' with B unknowns per cell.
    ///
    /// # Errors
    /// As [`solve`].
    pub fn new<const B: usize>(matrix: &[f64], right: &[f64]) -> Result<Self, GalerkinError> {
        let round = |values: &[f64]| -> Vec<F> { values.iter().map(|&x| F::from_f64(x)).collect() };
        let widen = |values: &[F]| -> Vec<f64> { values.iter().map(|x| x.to_f64()).collect() };
        let matrix = round(matrix);
        let wide_matrix = widen(&matrix);
        let v = round(&solve::<B>(&wide_matrix, right)?);
        let wide = [wide_matrix, widen(&v)];
        Ok(Self {
            matrix,
            v,
            wide,
            functions: B,
        })
    }

    /// K' as coefficients.
    #[must_use]
    pub fn coefficients(&self) -> Dense<'_, F> {
        Dense::new(&self.matrix, self.v.len() / self.functions, self.functions)
            .expect("a square matrix")
    }

    /// G over S for these pairs.
    #[must_use]
    pub fn source<S: Pairs, const B: usize>(&self, pairs: &S) -> Vec<F> {
        let [matrix, v] = &self.wide;
        let coefficients = Dense::new(matrix, v.len() / B, B).expect("a square matrix");
        let mut g = vec![0.0; v.len()];
        neighbour_source(&coefficients, pairs, v, &mut g).expect("equal lengths");
        g.into_iter().map(F::from_f64).collect()
    }
}

/// The kit's neighbour equation of a described problem. Its coefficients are 5 % wrong, with
/// alternating signs: the neighbour equation is exact for any, and so must the estimate be.
#[derive(Clone, Debug)]
pub struct System<F> {
    /// K' by quadrature.
    pub matrix: Vec<f64>,
    /// v for exact coefficients.
    pub exact: Vec<f64>,
    /// The largest Σ_j |K'_ij| of exact coefficients or, where that is not below 1, the spectral
    /// radius of |K'|.
    pub radius_bound: f64,
    /// The tables for wrong ones.
    pub tables: Tables<F>,
}

impl<F: Real> System<F> {
    /// Solves the system of this problem.
    ///
    /// # Errors
    /// As [`solve`].
    pub fn new<D, const B: usize>(description: &D) -> Result<Self, GalerkinError>
    where
        D: Description<B, Equation: StateSpace<Scalar = F>>,
    {
        let (mut matrix, mut right) = (matrix(description), right_hand_side(description));
        let exact = solve::<B>(&matrix, &right)?;
        // Of the functions ψ_i0 alone: the mean of ∫|K(x,y)|dμ(y) over the cell or less.
        let radius_bound = matrix
            .chunks_exact(right.len())
            .step_by(B)
            .map(|row| row.iter().step_by(B).map(|k| k.abs()).sum())
            .fold(0.0, f64::max);
        let radius_bound = if radius_bound < 1.0 {
            radius_bound
        } else {
            radius(&matrix, right.len())
        };
        let by_quadrature = matrix.clone();
        for (e, entry) in matrix.iter_mut().chain(&mut right).enumerate() {
            *entry *= if e % 2 == 0 { 1.05 } else { 0.95 };
        }
        Ok(Self {
            matrix: by_quadrature,
            exact,
            radius_bound,
            tables: Tables::new::<B>(&matrix, &right)?,
        })
    }
}

/// The spectral radius of the absolute values of a matrix, from above.
fn radius(matrix: &[f64], size: usize) -> f64 {
    let mut apply = |w: &[f64], out: &mut [f64]| {
        for (out, row) in out.iter_mut().zip(matrix.chunks_exact(size)) {
            *out = row.iter().zip(w).map(|(k, w)| k.abs() * w).sum();
        }
    };
    let [_, upper] =
        collatz_wielandt_bounds(&mut apply, &mut vec![1.0; size], &mut vec![0.0; size], 100);
    upper
}
