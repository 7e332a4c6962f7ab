//! The kit's own Galerkin system of any described problem, by quadrature: it needs nothing of the
//! problem's own coefficients, so that a neighbour equation can be checked before there are any.

use fredholm_core::galerkin::{
    Basis, Cells, Dense, GalerkinError, Pairs, StoppingRule, collatz_wielandt_bounds, gauss_seidel,
    neighbour_source,
};
use fredholm_core::{Density, Equation, Located, NoDraws, Real, Space, Value};

use crate::description::{Description, PointOf, cell_nodes};
use crate::outcome::Sum;

/// The points of cell `i` with weights that sum to 1.
pub(crate) fn normalised<D: Description<B>, const B: usize>(
    description: &D,
    i: usize,
) -> impl Iterator<Item = (Located<PointOf<D, B>>, f64)> {
    let nodes = cell_nodes(description, i);
    let measure: Sum = nodes.iter().map(|(_, weight)| *weight).collect();
    let measure = measure.value();
    nodes
        .into_iter()
        .map(move |(point, weight)| (Located { point, cell: i }, weight / measure))
}

/// K'_(ia)(jb) of a channel, (39), row by row.
#[must_use]
pub fn matrix<D, const B: usize>(description: &D, channel: usize) -> Vec<f64>
where
    D: Description<B, Equation: Density>,
{
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
                        * equation.kernel(&x.point, &point).get(channel).to_f64();
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

/// F'_ia of a channel, (40).
#[must_use]
pub fn right_hand_side<D: Description<B>, const B: usize>(
    description: &D,
    channel: usize,
) -> Vec<f64> {
    let equation = description.equation();
    let mut right = vec![Sum::default(); equation.cells() * B];
    for (i, right) in right.chunks_exact_mut(B).enumerate() {
        for (x, weight) in normalised(description, i) {
            let source = equation.source(&x.point, &mut NoDraws);
            let source = weight * source.get(channel).to_f64();
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
    wide_matrix: Vec<f64>,
    wide_v: Vec<f64>,
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
        let wide_v = widen(&v);
        Ok(Self {
            matrix,
            v,
            wide_matrix,
            wide_v,
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
    pub fn source<S: Pairs>(&self, pairs: &S) -> Vec<F> {
        let cells = self.wide_v.len() / self.functions;
        let coefficients = Dense::new(&self.wide_matrix, cells, self.functions);
        let mut g = vec![0.0; self.wide_v.len()];
        let coefficients = coefficients.expect("a square matrix");
        neighbour_source(&coefficients, pairs, &self.wide_v, &mut g).expect("equal lengths");
        g.into_iter().map(F::from_f64).collect()
    }
}

/// The system of a channel with exact coefficients.
#[derive(Clone, Debug)]
pub struct ExactSystem {
    /// K' by quadrature.
    pub matrix: Vec<f64>,
    /// v.
    pub v: Vec<f64>,
    /// The largest Σ_j |K'_ij| or, where that is not below 1, the spectral radius of |K'|.
    pub radius_bound: f64,
}

/// The kit's Galerkin systems of a described problem, and the tables of a neighbour equation of its first channel. Their coefficients
/// are 5 % wrong, with alternating signs: the neighbour equation is exact for any, and so must the estimate be.
#[derive(Clone, Debug)]
pub struct System<F> {
    /// The systems of all channels.
    pub exact: Vec<ExactSystem>,
    /// The tables for wrong coefficients.
    pub tables: Tables<F>,
}

impl<F: Real> System<F> {
    /// Solves the systems of this problem.
    ///
    /// # Errors
    /// As [`solve`].
    pub fn new<D, const B: usize>(description: &D) -> Result<Self, GalerkinError>
    where
        D: Description<B, Equation: Density + Space<Scalar = F>>,
    {
        let mut exact = Vec::new();
        let mut tables = None;
        for channel in 0..description.equation().channels() {
            let mut matrix = matrix(description, channel);
            let mut right = right_hand_side(description, channel);
            exact.push(ExactSystem {
                v: solve::<B>(&matrix, &right)?,
                radius_bound: radius_bound::<B>(&matrix, right.len()),
                matrix: matrix.clone(),
            });
            if channel == 0 {
                for (e, entry) in matrix.iter_mut().chain(&mut right).enumerate() {
                    *entry *= if e % 2 == 0 { 1.05 } else { 0.95 };
                }
                tables = Some(Tables::new::<B>(&matrix, &right)?);
            }
        }
        let tables = tables.expect("an equation of one channel or more");
        Ok(Self { exact, tables })
    }
}

/// A bound below 1 of the spectral radius of |K'|, where there is one.
fn radius_bound<const B: usize>(matrix: &[f64], size: usize) -> f64 {
    // Of the functions ψ_i0 alone: the mean of ∫|K(x,y)|dμ(y) over the cell or less.
    let rows = matrix.chunks_exact(size).step_by(B);
    let sums = rows.map(|row| row.iter().step_by(B).map(|k| k.abs()).sum());
    let largest = sums.fold(0.0, f64::max);
    if largest < 1.0 {
        return largest;
    }
    let mut apply = |w: &[f64], out: &mut [f64]| {
        for (out, row) in out.iter_mut().zip(matrix.chunks_exact(size)) {
            *out = row.iter().zip(w).map(|(k, w)| k.abs() * w).sum();
        }
    };
    let [_, upper] =
        collatz_wielandt_bounds(&mut apply, &mut vec![1.0; size], &mut vec![0.0; size], 100);
    upper
}
