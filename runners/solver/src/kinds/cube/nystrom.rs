//! Composite Gauss–Nyström, to compare with.

use std::sync::Arc;

use fredholm_core::galerkin::{Convergence, Dense, StoppingRule, buffer, gauss_seidel};
use fredholm_cube::{Cube, CubeRule, KernelFn as _, ScalarField as _};
use fredholm_model::Deterministic;
use fredholm_rayon::fill_rows;

use super::values::{Kernel, Source, Values};
use crate::Error;

/// The relative residual at which the iteration stops, and the most sweeps.
const TOLERANCE: f64 = 1e-14;
const SWEEPS: u32 = 1000;

/// The most nodes.
const MOST: usize = 1300;

/// u_i = Σ_j w_j K(x_i, x_j) u_j + F(x_i) on the points of a Gauss rule in every cell, and the mean Σ w_i u_i, on finer
/// and finer cells.
pub(super) fn solutions<const D: usize>(
    values: &Arc<Values<f64>>,
) -> Result<Vec<Deterministic>, Error> {
    // Cells and points an axis.
    let rules = (1..=5).map(|points| (1_usize, points));
    let rules = rules
        .chain([2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 100, 150, 200, 260].map(|cells| (cells, 5)));
    let (kernel, source) = (Kernel(values.clone()), Source(values.clone()));
    let mut solutions = Vec::new();
    for (cells, points) in rules {
        let nodes = (cells * points).saturating_pow(D as u32);
        if nodes > MOST {
            break;
        }
        let cube = Cube::<f64, D, _, _>::new(kernel.clone(), source.clone(), cells)?;
        let rule = CubeRule::new(&cube, 0, points)?;
        let at: Vec<([f64; D], f64)> = (0..rule.cells())
            .flat_map(|cell| rule.points(cell))
            .map(|(x, weight)| (x, weight / rule.cells() as f64))
            .collect();
        let mut entries = buffer(nodes * nodes)?;
        fill_rows(&mut entries, nodes, |i, row| {
            for (out, (y, weight)) in row.iter_mut().zip(&at) {
                *out = weight * kernel.kernel(&at[i].0, y);
            }
            Ok::<(), Error>(())
        })?;
        let source: Vec<f64> = at.iter().map(|(x, _)| source.value(x)).collect();
        values.watch.check()?;
        let dense = Dense::new(&entries, nodes, 1);
        let dense = dense.ok_or(Error::Internal("a table has a wrong size"))?;
        let mut u = source.clone();
        let sweeps = StoppingRule::UntilResidual {
            residual: TOLERANCE * source.iter().fold(0.0, |m: f64, f| m.max(f.abs())),
            at_most: SWEEPS,
        };
        let _: Convergence<f64> = gauss_seidel(&dense, &source, &mut u, &mut [0.0; 2], sweeps)?;
        let across = if values.is_product {
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
}
