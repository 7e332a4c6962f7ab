//! Checks of the map from the cube to a cell, by which integrals over cells are taken and walks for means start.

use fredholm_core::galerkin::Cells;
use fredholm_core::{Density, Equation, Located, NoDraws, Real, Value};

use super::{ROUNDING, STANDARD_ERRORS, UNITS, different_cells, draws, parameters, samples};
use crate::description::{Description, PointOf, ScalarOf, cell_nodes, epsilon};
use crate::outcome::{Outcome, Sum, Worst};

/// How many cells a check looks at.
const CELLS: usize = 8;

/// **Measures are those of the cells**: μ(X_j) against the sum of a rule's weights.
#[must_use]
pub fn measures<D: Description<B>, const B: usize>(description: &D, seed: u64) -> Outcome {
    let mut worst = Worst::new(UNITS, ROUNDING);
    for cell in different_cells(description, seed, 64) {
        let weights = cell_nodes(description, cell).into_iter();
        let expected = weights.map(|(_, weight)| weight).collect::<Sum>().value();
        let found = description.equation().measure(cell);
        // Both are of f64, whatever the scalar of walks is.
        worst.compare(expected, found, f64::EPSILON * expected, || {
            format!("the measure of cell {cell}")
        });
    }
    worst.outcome()
}

/// **Parameters are those of points**: of random points of cells, in rounding of the walk's scalar.
#[must_use]
pub fn inverse<D: Description<B>, const B: usize>(description: &D, seed: u64) -> Outcome {
    let equation = description.equation();
    let mut worst = Worst::new(UNITS, ROUNDING);
    let mut uniforms = draws(seed, 29);
    let all: f64 = (0..equation.cells())
        .map(|cell| equation.measure(cell))
        .sum();
    for cell in different_cells(description, seed, 64) {
        for _ in 0..CELLS {
            let expected = parameters::<D, B>(&mut uniforms);
            let point = equation.point(cell, &expected);
            let mut found = vec![ScalarOf::<D, B>::from_u32(0); expected.len()];
            equation.parameters(&Located { point, cell }, &mut found);
            for (expected, found) in expected.iter().zip(found) {
                // A parameter is what is left of a coordinate, which is to a cell as all of X at most.
                let unit = epsilon::<D, B>() * (1.0 + all / equation.measure(cell));
                worst.compare(*expected, found.to_f64(), unit, || {
                    format!("a parameter of {point:?} in cell {cell}")
                });
            }
        }
    }
    worst.outcome()
}

/// **Uniform parameters give uniform points**: the mean over a cell of p(x, ·), of K(x, ·), of F and, if there is one, of the
/// distribution function from x, by 20,000 random points of the cell and by quadrature.
#[must_use]
pub fn uniform_points<D, const B: usize>(description: &D, seed: u64) -> Outcome
where
    D: Description<B, Equation: Density>,
{
    const DRAWS: u64 = 20_000;
    const NAMES: [&str; 4] = ["p(x, .)", "K(x, .)", "F", "the distribution function"];
    let equation = description.equation();
    let mut worst = Worst::new("standard errors", STANDARD_ERRORS);
    let starts = samples(description, seed, CELLS);
    let cells = different_cells(description, seed, CELLS);
    for (number, (x, cell)) in starts.into_iter().zip(cells).enumerate() {
        let x = x.point;
        let functions = |y: &PointOf<D, B>| {
            let density = equation.density(&x, y).to_f64();
            [
                density,
                equation.kernel(&x, y).get(0).to_f64() * density,
                equation.source(y, &mut NoDraws).get(0).to_f64(),
                description.cumulative(&x, y).unwrap_or(0.0),
            ]
        };
        let nodes = description.nodes(&x, cell);
        let measure: f64 = nodes.iter().map(|(_, weight)| weight).sum();
        let mut expected = [0.0; 4];
        for (y, weight) in &nodes {
            let values = functions(y);
            expected = core::array::from_fn(|f| expected[f] + weight / measure * values[f]);
        }
        let mut uniforms = draws(seed, 30 + number as u64);
        // About the expected mean, so that little cancels.
        let (mut sums, mut squares) = ([0.0; 4], [0.0; 4]);
        for _ in 0..DRAWS {
            let y = equation.point(cell, &parameters::<D, B>(&mut uniforms));
            for (f, value) in functions(&y).into_iter().enumerate() {
                sums[f] += value - expected[f];
                squares[f] += (value - expected[f]).powi(2);
            }
        }
        for (f, name) in NAMES.into_iter().enumerate() {
            let n = DRAWS as f64;
            let mean = sums[f] / n;
            let error = ((squares[f] / n - mean * mean).max(0.0) / n).sqrt();
            // A function that is constant on the cell differs by rounding.
            let rounding = ROUNDING * epsilon::<D, B>() * expected[f].abs();
            worst.compare(expected[f], expected[f] + mean, error + rounding, || {
                format!("the mean of {name} over cell {cell}, x = {x:?}")
            });
        }
    }
    worst.outcome()
}
