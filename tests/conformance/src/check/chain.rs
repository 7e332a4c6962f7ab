//! Checks of the equation, its chain and its partition.

use fredholm_core::galerkin::{Basis, Cells, TransitionMoments};
use fredholm_core::{Chain, Density, Equation, Located, NoDraws, Real, Value};

use super::{
    KOLMOGOROV, ROUNDING, STANDARD_ERRORS, UNITS, corners, different_cells, draws, grid, samples,
};
use crate::description::{Description, PointOf, cell_nodes, epsilon};
use crate::outcome::{Outcome, Sum, Worst};

/// How many points a check looks at.
const POINTS: usize = 24;

/// **Points are found in their cells**: those inside in the cell that they were made in, those on
/// faces, edges and corners, and 10⁻⁶ of a cell beside them, in a cell that contains them.
#[must_use]
pub fn cells<D: Description<B>, const B: usize>(description: &D, seed: u64) -> Outcome {
    let equation = description.equation();
    let mut worst = Worst::new("wrong cells", 0.0);
    // Points and ends of cells are stored to a few ε of the size of X.
    let edge = (64.0 * epsilon::<D, B>() * noise(description)).max(1e-3);
    for cell in different_cells(description, seed, 64) {
        for t in grid::<D, B>(&[0.0, 1e-6, 1e-3, 0.4, 0.999, 1.0 - 1e-6, 1.0]) {
            let x = equation.point(cell, &t);
            let found = equation.locate(&x);
            let inside = t.iter().all(|t| (edge..=1.0 - edge).contains(t));
            let held = found < equation.cells() && description.contains(found, &x);
            let right = held && (found == cell || !inside);
            worst.add(
                cell as f64,
                found as f64,
                f64::from(u8::from(!right)),
                || format!("the cell of {x:?}, the point at {t:?} of cell {cell}"),
            );
        }
    }
    worst.outcome()
}

/// **Steps are found in cells that contain them**, and lead to no others.
#[must_use]
pub fn sampler_points<D: Description<B>, const B: usize>(description: &D, seed: u64) -> Outcome {
    let equation = description.equation();
    let mut uniforms = draws(seed, 3);
    let mut worst = Worst::new("wrong cells", 0.0);
    for x in samples(description, seed, POINTS) {
        for _ in 0..200 {
            let Some(y) = equation.step(&x.point, &mut uniforms) else {
                continue;
            };
            let found = equation.locate(&y);
            let right = found < equation.cells() && description.contains(found, &y);
            let holds = |cell: &usize| description.contains(*cell, &y);
            let expected = if right {
                found
            } else {
                // No cell at all: as many as there are.
                (0..equation.cells())
                    .find(holds)
                    .unwrap_or(equation.cells())
            };
            let distance = f64::from(u8::from(!right));
            worst.add(expected as f64, found as f64, distance, || {
                format!("the cell of {y:?}, where a step from {:?} led", x.point)
            });
        }
    }
    worst.outcome()
}

/// **The density is one**: ∫ p(x,y) dμ(y) = 1 − the probability of leaving, by quadrature at random x.
#[must_use]
pub fn density<D, const B: usize>(description: &D, seed: u64) -> Outcome
where
    D: Description<B, Equation: Density>,
{
    let equation = description.equation();
    let mut worst = Worst::new(UNITS, ROUNDING);
    for x in samples(description, seed, POINTS) {
        let (mut sum, mut size) = (Sum::default(), 1.0);
        for j in 0..equation.cells() {
            size += description.sensitivity(&x.point, j);
            for (y, weight) in description.nodes(&x.point, j) {
                sum.add(weight * equation.density(&x.point, &y).to_f64());
            }
        }
        let expected = 1.0 - description.leaving(&x.point);
        let unit = epsilon::<D, B>() * size;
        worst.compare(expected, sum.value(), unit, || {
            format!("the integral of p(x, .) at x = {:?}", x.point)
        });
    }
    worst.outcome()
}

/// **The basis is orthonormal** with respect to μ/μ(X_i), and ψ_i0 = 1.
#[must_use]
pub fn basis<D: Description<B>, const B: usize>(description: &D, seed: u64) -> Outcome {
    let equation = description.equation();
    let mut worst = Worst::new(UNITS, ROUNDING);
    for cell in different_cells(description, seed, POINTS) {
        let nodes = cell_nodes(description, cell);
        let measure: Sum = nodes.iter().map(|(_, weight)| *weight).collect();
        let values: Vec<([f64; B], f64)> = nodes
            .iter()
            .map(|&(point, weight)| {
                let psi = equation.basis(&Located { point, cell });
                (psi.map(Real::to_f64), weight / measure.value())
            })
            .collect();
        for (psi, _) in &values {
            worst.compare(1.0, psi[0], epsilon::<D, B>(), || {
                format!("function 0 of the basis on cell {cell}")
            });
        }
        for b in 0..B {
            for c in 0..B {
                let terms = values.iter().map(|(psi, w)| (*w, psi[b] * psi[c]));
                let [found, size] = integral(terms, noise(description));
                let expected = f64::from(u8::from(b == c));
                worst.compare(expected, found, size * epsilon::<D, B>(), || {
                    format!("the product of functions {b} and {c} of the basis on cell {cell}")
                });
            }
        }
    }
    worst.outcome()
}

/// **Transition moments are the moments of p**, by quadrature, accurate relative to their own size;
/// and the masses sum to 1 − the probability of leaving.
///
/// A node of the rule is stored to ε of the size of X, of which a cell is one of n^(1/d) parts:
/// that moves an integrand by n^(1/d) ε times its variation over the cell, which counts as size. So
/// does what the description says of its points: [`Description::sensitivity`].
#[must_use]
pub fn moments<D, const B: usize>(description: &D, seed: u64) -> Outcome
where
    D: Description<B, Equation: Density + TransitionMoments<B>>,
{
    let equation = description.equation();
    let mut worst = Worst::new(UNITS, ROUNDING);
    for x in samples(description, seed, POINTS) {
        let (mut total, mut total_size) = (Sum::default(), 1.0);
        for j in 0..equation.cells() {
            let sensitivity = description.sensitivity(&x.point, j);
            total_size += sensitivity;
            let nodes: Vec<(f64, f64, [f64; B])> = description
                .nodes(&x.point, j)
                .into_iter()
                .map(|(point, weight)| {
                    let p = equation.density(&x.point, &point).to_f64();
                    let psi = equation.basis(&Located { point, cell: j });
                    (weight, p, psi.map(Real::to_f64))
                })
                .collect();
            let found = equation.moments(&x, j).map(|row| row.map(Real::to_f64));
            total.add(found[0][0]);
            for b in 0..B {
                for c in 0..B {
                    let terms = nodes.iter().map(|(w, p, psi)| (*w, p * psi[b] * psi[c]));
                    let [expected, size] = integral(terms, noise(description));
                    let products = nodes.iter().map(|(_, _, psi)| (psi[b] * psi[c]).abs());
                    let moved = sensitivity * products.fold(0.0, f64::max);
                    let unit = (size + moved) * epsilon::<D, B>();
                    worst.compare(expected, found[b][c], unit, || {
                        format!("moment ({b}, {c}) from {:?} to cell {j}", x.point)
                    });
                }
            }
        }
        let expected = 1.0 - description.leaving(&x.point);
        let unit = epsilon::<D, B>() * total_size;
        worst.compare(expected, total.value(), unit, || {
            format!("the sum of the masses at x = {:?}", x.point)
        });
    }
    worst.outcome()
}

/// The number of cells along an axis.
pub(super) fn noise<D: Description<B>, const B: usize>(description: &D) -> f64 {
    (description.equation().cells() as f64).powf(1.0 / D::Equation::DIMENSION as f64)
}

/// An integral from weights and values, and its size: that of its terms, and `noise` times how much values vary.
pub(super) fn integral(terms: impl Iterator<Item = (f64, f64)> + Clone, noise: f64) -> [f64; 2] {
    let sum: Sum = terms
        .clone()
        .map(|(weight, value)| weight * value)
        .collect();
    let (mut low, mut high, mut measure) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
    for (weight, value) in terms {
        (low, high) = (value.min(low), value.max(high));
        measure += weight;
    }
    [sum.value(), sum.size() + noise * (high - low) * measure]
}

/// **Masses are accurate relative to their own size**, against the description's own formula: in
/// the same cell, its neighbours, and far away, inside cells and at their corners.
#[must_use]
pub fn masses<D, const B: usize>(description: &D, seed: u64) -> Option<Outcome>
where
    D: Description<B, Equation: TransitionMoments<B>>,
{
    let equation = description.equation();
    let mut worst = Worst::new(UNITS, ROUNDING);
    let n = equation.cells();
    let inside = samples(description, seed, 200);
    let at_corners = different_cells(description, seed, POINTS)
        .into_iter()
        .flat_map(|cell| {
            corners::<D, B>()
                .map(move |t| (cell, t))
                .collect::<Vec<_>>()
        });
    let at_corners = at_corners.map(|(cell, t)| {
        let point = equation.point(cell, &t);
        Located {
            point,
            cell: equation.locate(&point),
        }
    });
    for x in inside.into_iter().chain(at_corners) {
        // Its own cell, neighbours, far ones, and the first and the last, where maps may be singular.
        let near = [0, 1, 2, n - 1, n / 2, n / 3].map(|j| (x.cell + j) % n);
        for j in near.into_iter().chain([0, n - 1]) {
            let expected = description.mass(&x, j)?;
            let found = equation.moments(&x, j)[0][0].to_f64();
            let size = expected + description.sensitivity(&x.point, j);
            worst.compare(expected, found, epsilon::<D, B>() * size, || {
                format!("the mass from {:?} in cell {} to cell {j}", x.point, x.cell)
            });
        }
    }
    Some(worst.outcome())
}

/// **The sampler follows p**: χ² of where 200,000 steps from each of three points lead, against
/// p_j(x) and the probability of leaving; cells that expect fewer than 5 are pooled.
///
/// The statistic of k degrees of freedom is turned into a normal one by Wilson and Hilferty's cube
/// root (1931), which is within 0.02 of it for k ≥ 3. `None` where there is one cell and no way
/// out.
#[must_use]
pub fn sampler<D, const B: usize>(description: &D, seed: u64) -> Option<Outcome>
where
    D: Description<B, Equation: TransitionMoments<B>>,
{
    let equation = description.equation();
    follows(description, seed, &|x, j| {
        Some(equation.moments(x, j)[0][0].to_f64())
    })
}

/// p_j(x), if it is known.
type Mass<'a, P> = dyn Fn(&Located<P>, usize) -> Option<f64> + 'a;

/// χ² of steps against these masses. `None`: they are not known, or there is one cell and no way out.
pub(super) fn follows<D: Description<B>, const B: usize>(
    description: &D,
    seed: u64,
    mass: &Mass<'_, PointOf<D, B>>,
) -> Option<Outcome> {
    const STEPS: u32 = 200_000;
    let equation = description.equation();
    let mut worst = Worst::new("standard deviations", STANDARD_ERRORS);
    let mut compared = false;
    for (number, x) in samples(description, seed, 3).into_iter().enumerate() {
        let masses = (0..equation.cells()).map(|j| mass(&x, j));
        let masses: Vec<f64> = masses.collect::<Option<_>>()?;
        let mut uniforms = draws(seed, 10 + number as u64);
        let mut counts = vec![0_u64; equation.cells() + 1];
        for _ in 0..STEPS {
            let y = equation.step(&x.point, &mut uniforms);
            // A point in no cell counts as one that left.
            let cell = y.map_or(equation.cells(), |y| equation.locate(&y));
            counts[cell.min(equation.cells())] += 1;
        }
        let left = description.leaving(&x.point);
        let probabilities = masses.into_iter().chain([left]);
        let expected = probabilities.map(|probability| f64::from(STEPS) * probability);
        let Some(fit) = chi_squared(expected.zip(counts)) else {
            continue;
        };
        compared = true;
        worst.add(fit.degrees, fit.chi, fit.normal, || {
            format!(
                "chi^2 of {STEPS} steps from {:?}, {} degrees of freedom",
                x.point, fit.degrees
            )
        });
    }
    compared.then(|| worst.outcome())
}

/// How far what was counted is from what is expected.
pub(super) struct Fit {
    /// Degrees of freedom.
    pub(super) degrees: f64,
    /// χ².
    pub(super) chi: f64,
    /// The nearest normal number, 0 where it is negative.
    pub(super) normal: f64,
}

/// χ² of what was counted against what is expected; what expects fewer than 5 is pooled with its neighbours. `None`: fewer than two
/// classes are left.
pub(super) fn chi_squared(pairs: impl Iterator<Item = (f64, u64)>) -> Option<Fit> {
    let mut classes: Vec<(f64, f64)> = Vec::new();
    let mut pool = (0.0, 0.0);
    for (expected, count) in pairs {
        pool = (pool.0 + expected, pool.1 + count as f64);
        if pool.0 >= 5.0 {
            classes.push(pool);
            pool = (0.0, 0.0);
        }
    }
    match classes.last_mut() {
        // What is left over belongs to the last class.
        Some(last) => *last = (last.0 + pool.0, last.1 + pool.1),
        None => classes.push(pool),
    }
    if classes.len() < 2 {
        return None;
    }
    let degrees = classes.len() as f64 - 1.0;
    let chi: f64 = classes.iter().map(|(e, c)| (c - e) * (c - e) / e).sum();
    let spread = 2.0 / (9.0 * degrees);
    let normal = ((chi / degrees).cbrt() - (1.0 - spread)) / spread.sqrt();
    Some(Fit {
        degrees,
        chi,
        normal: normal.max(0.0),
    })
}

/// **The sampler follows p within cells, too**: Kolmogorov and Smirnov's √N sup|F_N − F| for
/// 100,000 steps from each of three points.
#[must_use]
pub fn distribution<D: Description<B>, const B: usize>(
    description: &D,
    seed: u64,
) -> Option<Outcome> {
    const STEPS: usize = 100_000;
    let equation = description.equation();
    let mut worst = Worst::new("/sqrt(steps)", KOLMOGOROV);
    for (number, x) in samples(description, seed, 3).into_iter().enumerate() {
        let mut uniforms = draws(seed, 20 + number as u64);
        let mut found = Vec::with_capacity(STEPS);
        for _ in 0..STEPS {
            if let Some(y) = equation.step(&x.point, &mut uniforms) {
                found.push(description.cumulative(&x.point, &y)?);
            }
        }
        found.sort_by(f64::total_cmp);
        let n = found.len() as f64;
        let (mut supremum, mut at) = (0.0, 0.0);
        for (rank, &value) in found.iter().enumerate() {
            let distance = (value - rank as f64 / n).max((rank + 1) as f64 / n - value);
            if !(distance <= supremum) {
                (supremum, at) = (distance, value);
            }
        }
        worst.add(at, at + supremum, supremum * n.sqrt(), || {
            format!("the distribution function of {n} steps from {:?}", x.point)
        });
    }
    Some(worst.outcome())
}

/// **The solution solves the equation**: u(x) = ∫ K(x,y) u(y) dμ(y) + F(x) by quadrature at random
/// x, in every channel.
#[must_use]
pub fn solution<D, const B: usize>(description: &D, seed: u64) -> Option<Outcome>
where
    D: Description<B, Equation: Density>,
{
    let equation = description.equation();
    let mut worst = Worst::new(UNITS, ROUNDING);
    for x in samples(description, seed, POINTS) {
        let expected = description.solution(&x.point)?;
        let source = equation.source(&x.point, &mut NoDraws);
        for channel in 0..equation.channels() {
            let (mut sum, mut moved) = (Sum::default(), 0.0);
            sum.add(source.get(channel).to_f64());
            for j in 0..equation.cells() {
                let mut largest = 0.0_f64;
                for (y, weight) in description.nodes(&x.point, j) {
                    let p = equation.density(&x.point, &y).to_f64();
                    let k = equation.kernel(&x.point, &y).get(channel).to_f64();
                    let ku = k * description.solution(&y)?.get(channel);
                    largest = largest.max(ku.abs());
                    sum.add(weight * p * ku);
                }
                moved += largest * description.sensitivity(&x.point, j);
            }
            let expected = expected.get(channel);
            let unit = epsilon::<D, B>() * (sum.size() + expected.abs() + moved);
            worst.compare(expected, sum.value(), unit, || {
                format!("(T_K u + F)(x) at x = {:?} in channel {channel}", x.point)
            });
        }
    }
    Some(worst.outcome())
}
