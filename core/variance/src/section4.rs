//! Section 4 of Heinrich 1995: the quantities of pairs of cells, for piecewise constants.

use alloc::vec::Vec;
use core::fmt;

use fredholm_core::Real;
use fredholm_core::galerkin::{PairKind, buffer};

use crate::{Position, VarianceError, VarianceModel, Wanted};

/// The quantities of (51)–(53) and of the lines below them for a pair of cells. Suprema are taken
/// over the nodes of the quadrature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairQuantities {
    /// i and j.
    pub cells: [usize; 2],
    /// Whether the pair is in S.
    pub in_s: bool,
    /// p̄_ij, the mean of p_j(x) over X_i: (51).
    pub mean_mass: f64,
    /// π_ij = μ(X_i) p̄_ij.
    pub total_mass: f64,
    /// k̄_ij, the mean of k with respect to p: (52).
    pub mean_kernel: f64,
    /// k̄'_ij = K'_ij/p̄_ij: (53).
    pub coefficient: f64,
    /// κ_ij = sup |k − k̄_ij|.
    pub kappa: f64,
    /// r_ij = inf p_j(x)/p̄_ij.
    pub r: f64,
    /// λ_ij = sup |p_j(x) − p̄_ij|/p̄_ij.
    pub lambda: f64,
}

impl PairQuantities {
    /// The pair's term of Proposition 6: 3 (κ² + α² λ²/r + (k̄ − k̄')²/r) π in S, α² π outside.
    #[must_use]
    pub fn proposition_6(&self, alpha: f64) -> f64 {
        if !self.in_s {
            return alpha * alpha * self.total_mass;
        }
        let square = |x: f64| x * x;
        let kernel = square(self.kappa) + square(alpha * self.lambda) / self.r;
        let coefficient = square(self.mean_kernel - self.coefficient) / self.r;
        3.0 * (kernel + coefficient) * self.total_mass
    }

    /// sup |k − h| ≤ κ + k̄ λ/r + |k̄ − k̄'|/r on the pair, if it is in S (end of section 4).
    #[must_use]
    pub fn supremum(&self) -> f64 {
        let coefficient = (self.mean_kernel - self.coefficient).abs();
        self.kappa + (self.mean_kernel.abs() * self.lambda + coefficient) / self.r
    }
}

/// Σ over the nodes of a cell, and extremes, of the steps into a cell.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// ∫∫ p and ∫∫ k p.
    mass: f64,
    kernel: f64,
    /// inf and sup of p_j(x), and of k.
    masses: Option<[f64; 2]>,
    kernels: Option<[f64; 2]>,
    /// p_j(x) of one node, while it is summed.
    node: f64,
}

fn widen(range: &mut Option<[f64; 2]>, x: f64) {
    let [low, high] = range.unwrap_or([x; 2]);
    *range = Some([if x < low { x } else { low }, Real::max(high, x)]);
}

/// K' of piecewise constants, for [`pair_quantities`].
#[derive(Clone, Copy)]
pub struct MeanCoefficients<'a> {
    /// n.
    pub cells: usize,
    /// K'_ij.
    pub mean: &'a dyn Fn(usize, usize) -> f64,
}

impl fmt::Debug for MeanCoefficients<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MeanCoefficients")
            .field("cells", &self.cells)
            .finish_non_exhaustive()
    }
}

/// Calls `visit` for every pair of cells into which a step may lead, row by row. Sites must be cells or parts of cells, in
/// the order of the cells or not.
///
/// O(n²) evaluations of k for n nodes.
///
/// # Errors
/// [`VarianceError`].
pub fn pair_quantities(
    model: &dyn VarianceModel,
    coefficients: MeanCoefficients<'_>,
    visit: &mut dyn FnMut(PairQuantities),
) -> Result<(), VarianceError> {
    let sites = model.sites();
    let mut cell_of: Vec<usize> = buffer(sites)?;
    for (site, cell) in cell_of.iter_mut().enumerate() {
        for point in model.nodes(site) {
            *cell = model.position(point).cell;
        }
    }
    let mut order: Vec<usize> = buffer(sites)?;
    order
        .iter_mut()
        .enumerate()
        .for_each(|(i, place)| *place = i);
    order.sort_by_key(|&site| cell_of[site]);
    let mut row: Vec<Sums> = buffer(coefficients.cells)?;
    for own in order.chunk_by(|&a, &b| cell_of[a] == cell_of[b]) {
        let Some(&i) = own.first().and_then(|&site| cell_of.get(site)) else {
            continue;
        };
        row.fill(Sums::default());
        let mut measure = 0.0;
        for point in own.iter().flat_map(|&site| model.nodes(site)) {
            let Position { weight, .. } = model.position(point);
            measure += weight;
            sum(model, point, weight, &mut row);
        }
        for (j, sums) in row.iter().enumerate() {
            let (Some([least, most]), Some([low, high])) = (sums.masses, sums.kernels) else {
                continue;
            };
            let mean_mass = sums.mass / measure;
            let mean_kernel = sums.kernel / sums.mass;
            visit(PairQuantities {
                cells: [i, j],
                in_s: model.kind(i, j) == PairKind::Galerkin,
                mean_mass,
                total_mass: sums.mass,
                mean_kernel,
                coefficient: (coefficients.mean)(i, j) / mean_mass,
                kappa: Real::max(high - mean_kernel, mean_kernel - low),
                r: least / mean_mass,
                lambda: Real::max(most - mean_mass, mean_mass - least) / mean_mass,
            });
        }
    }
    Ok(())
}

/// Adds the steps from a node.
fn sum(model: &dyn VarianceModel, point: usize, weight: f64, row: &mut [Sums]) {
    for site in 0..model.sites() {
        model.steps(point, site, Wanted::Cell, &mut |step| {
            let k = step.kernel;
            if let Some(sums) = row.get_mut(step.cell).filter(|_| step.weight > 0.0) {
                sums.node += step.weight;
                sums.mass += weight * step.weight;
                sums.kernel += weight * step.weight * k;
                widen(&mut sums.kernels, k);
            }
        });
    }
    for sums in row {
        let mass = core::mem::take(&mut sums.node);
        widen(&mut sums.masses, mass);
    }
}
