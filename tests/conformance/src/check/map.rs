//! Checks of the map from the cube to a cell, by which integrals over cells are taken and walks for means start.

use fredholm_core::{Kernel, Located, Real, Source, TransitionDensity};

use super::{ROUNDING, STANDARD_ERRORS, UNITS, different_cells, draws, parameters, samples};
use crate::description::{Description, PointOf, StepDescription, epsilon};
use crate::outcome::{Outcome, Sum, Worst};

/// How many cells a check looks at.
const CELLS: usize = 8;

/// **Measures are those of the cells**: μ(X_j) against the sum of a rule's weights. `None` where there are none.
#[must_use]
pub fn measures<D: StepDescription<B>, const B: usize>(
    description: &D,
    seed: u64,
) -> Option<Outcome> {
    let mut worst = Worst::new(UNITS, ROUNDING);
    for cell in different_cells(description, seed, 64) {
        let nodes = description.cell_nodes(cell).into_iter();
        let weights = nodes.map(|(_, weight)| weight);
        let expected = weights.collect::<Sum>().value();
        // Both are of f64, whatever the scalar of walks is.
        worst.compare(
            expected,
            description.measure(cell)?,
            f64::EPSILON * expected,
            || format!("the measure of cell {cell}"),
        );
    }
    Some(worst.outcome())
}

/// **Parameters are those of points**: of random points of cells, in rounding of the walk's scalar. `None` where there are none.
#[must_use]
pub fn inverse<D: StepDescription<B>, const B: usize>(
    description: &D,
    seed: u64,
) -> Option<Outcome> {
    let mut worst = Worst::new(UNITS, ROUNDING);
    let mut uniforms = draws(seed, 29);
    for cell in different_cells(description, seed, 64) {
        for _ in 0..CELLS {
            let expected = parameters::<D, B>(&mut uniforms);
            let point = description.point(cell, &expected);
            let found = description.parameters(&Located { point, cell })?;
            for (expected, found) in expected.iter().zip(found) {
                // A parameter is what is left of a coordinate that may be as large as the number of cells.
                let unit = epsilon::<D, B>() * (1.0 + cell as f64);
                worst.compare(*expected, found, unit, || {
                    format!("a parameter of {point:?} in cell {cell}")
                });
            }
        }
    }
    Some(worst.outcome())
}

/// **Uniform parameters give uniform points**: the mean over a cell of p(x, ·), of K(x, ·), of F and, if there is one, of the
/// distribution function from x, by 20,000 random points of the cell and by quadrature. `None` where no measure is given.
#[must_use]
pub fn uniform_points<D: Description<B>, const B: usize>(
    description: &D,
    seed: u64,
) -> Option<Outcome> {
    const DRAWS: u64 = 20_000;
    let equation = description.equation();
    let mut worst = Worst::new("standard errors", STANDARD_ERRORS);
    let starts = samples(description, seed, CELLS);
    let cells = different_cells(description, seed, CELLS);
    for (number, (x, cell)) in starts.into_iter().zip(cells).enumerate() {
        description.measure(cell)?;
        let x = x.point;
        let functions = |y: &PointOf<D, B>| {
            let density = equation.density(&x, y).to_f64();
            [
                density,
                Kernel::kernel(equation, &x, y).to_f64() * density,
                equation.source(y).to_f64(),
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
            let y = description.point(cell, &parameters::<D, B>(&mut uniforms));
            for (f, value) in functions(&y).into_iter().enumerate() {
                sums[f] += value - expected[f];
                squares[f] += (value - expected[f]).powi(2);
            }
        }
        for (f, name) in ["p(x, .)", "K(x, .)", "F", "the distribution function"]
            .into_iter()
            .enumerate()
        {
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
    Some(worst.outcome())
}
