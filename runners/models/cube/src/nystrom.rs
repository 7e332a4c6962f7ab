//! Composite Gauss–Nyström, to compare with.

use fredholm_core::galerkin::{Convergence, Dense, StoppingRule, buffer, gauss_seidel};
use fredholm_cube::{CubeRule, KernelFn as _, ScalarField as _};

use super::functions::{CubeFunctions, Which, with_values};
use super::table::fill;
use super::{SWEEPS, TOLERANCE};
use fredholm_model::Deterministic;
use fredholm_model::Error;

/// The most nodes.
const MOST: usize = 1300;

/// u_i = Σ_j w_j K(x_i, x_j) u_j + F(x_i) on the points of a Gauss rule in every cell, and the mean Σ w_i u_i, on finer
/// and finer cells.
pub(super) fn solutions<const D: usize>(
    functions: &dyn CubeFunctions,
) -> Result<Vec<Deterministic>, Error> {
    // Cells and points an axis.
    let rules = (1..=5).map(|points| (1_usize, points));
    let rules = rules
        .chain([2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 100, 150, 200, 260].map(|cells| (cells, 5)));
    with_values::<f64, _>(functions, |values| {
        let mut solutions = Vec::new();
        for (cells, points) in rules {
            let nodes = (cells * points).saturating_pow(D as u32);
            if nodes > MOST {
                break;
            }
            let rule = CubeRule::new(&values.cube::<D>(cells)?, 0, points)?;
            let at: Vec<([f64; D], f64)> = (0..rule.cells())
                .flat_map(|cell| rule.points(cell))
                .map(|(x, weight)| (x, weight / rule.cells() as f64))
                .collect();
            let (kernel, source) = (values.kernel(), values.function(Which::Source));
            let mut entries = buffer(nodes * nodes)?;
            fill(&mut entries, nodes, &|i, row| {
                for (out, (y, weight)) in row.iter_mut().zip(&at) {
                    *out = weight * kernel.kernel(&at[i].0, y);
                }
                Ok(())
            })?;
            let source: Vec<f64> = at.iter().map(|(x, _)| source.value(x)).collect();
            values.check()?;
            let dense = Dense::new(&entries, nodes, 1);
            let dense = dense.ok_or(Error::Internal("a table has a wrong size"))?;
            let mut u = source.clone();
            let sweeps = StoppingRule::UntilResidual {
                residual: TOLERANCE * source.iter().fold(0.0, |m: f64, f| m.max(f.abs())),
                at_most: SWEEPS,
            };
            let _: Convergence<f64> = gauss_seidel(&dense, &source, &mut u, &mut [0.0; 2], sweeps)?;
            let across = if functions.is_product() {
                cells * points
            } else {
                nodes
            };
            solutions.push(Deterministic {
                nodes,
                evaluations: (across as f64).powi(2),
                mean: at.iter().zip(&u).map(|((_, weight), u)| weight * u).sum(),
                error: None,
            });
        }
        Ok(solutions)
    })
}
