//! What is left when a solution is put into its equation.

use fredholm_file::formula::Formula;
use fredholm_variance::gauss;
use wasm_bindgen::prelude::*;

use crate::wrong;

/// Gauss nodes between two points of a grid, and the degree of polynomials through the points around them: a rule, and a coarser one.
const RULES: [(usize, usize); 2] = [(8, 7), (6, 5)];

/// A node of a rule on an interval.
struct Node {
    y: f64,
    weight: f64,
    /// The first point that the polynomial at y goes through.
    first: usize,
    /// What the values at this point and the following ones mean for the polynomial's value at y.
    basis: Vec<f64>,
}

/// The nodes between the points of a grid.
fn nodes(grid: &[f64], (count, degree): (usize, usize)) -> Result<Vec<Node>, JsError> {
    let rule = gauss(count).map_err(wrong)?;
    let through = (degree + 1).min(grid.len());
    let intervals = grid.windows(2).enumerate();
    let all = intervals.flat_map(|(left, ends)| {
        let first = (left + 1).saturating_sub(through / 2);
        let first = first.min(grid.len() - through);
        let near = &grid[first..first + through];
        let half = (ends[1] - ends[0]) / 2.0;
        rule.iter().map(move |(t, weight)| {
            let y = ends[0] + half * (1.0 + t);
            let basis = near.iter().enumerate().map(|(k, own)| {
                let others = near.iter().enumerate().filter(|(j, _)| *j != k);
                let factors = others.map(|(_, other)| (y - other) / (own - other));
                factors.product()
            });
            let basis = basis.collect();
            let weight = weight * half;
            Node {
                y,
                weight,
                first,
                basis,
            }
        })
    });
    Ok(all.collect())
}

/// u − ∫ K u dy − F at the points of a grid, of the function that goes through these values u there, and at each the square root of the sum of
/// its variance, if these are the standard errors of u, and of the square of what a coarser rule says otherwise: one after the other.
///
/// # Errors
/// A formula is none.
#[wasm_bindgen]
pub fn residual(
    kernel: &str,
    source: &str,
    grid: &[f64],
    u: &[f64],
    std_error: &[f64],
) -> Result<Vec<f64>, JsError> {
    let formula = |text| Formula::<f64>::new(text, &[]).map_err(|error| wrong(error.message));
    let (kernel, source) = (formula(kernel)?, formula(source)?);
    let mut found = Vec::with_capacity(2 * grid.len());
    let [fine, coarse] = RULES.map(|rule| nodes(grid, rule));
    let rules = [fine?, coarse?];
    for (i, x) in grid.iter().enumerate() {
        // By each rule: the weights of all u in the residual, less F.
        let [fine, coarse] = rules.each_ref().map(|nodes| {
            let mut weights = vec![0.0; grid.len()];
            weights[i] = 1.0;
            for node in nodes {
                let moved = node.weight * kernel.value(&[*x], &[node.y]);
                for (own, basis) in weights[node.first..].iter_mut().zip(&node.basis) {
                    *own -= moved * basis;
                }
            }
            weights
        });
        let applied = |weights: &[f64]| weights.iter().zip(u).map(|(w, u)| w * u).sum::<f64>();
        let noise = fine.iter().zip(std_error).map(|(w, e)| (w * e).powi(2));
        let by_rule = applied(&fine) - applied(&coarse);
        found.push(applied(&fine) - source.value(&[*x], &[]));
        found.push((noise.sum::<f64>() + by_rule * by_rule).sqrt());
    }
    Ok(found)
}
