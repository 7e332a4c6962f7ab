//! Generic checks. Each takes a problem and what it offers, and says what it expected, what came,
//! and how far apart they are.

use core::fmt;

use fredholm_core::galerkin::{Coefficients, PairKind, Pairs, TransitionMoments};
use fredholm_core::rand_core::{Rng, SeedableRng};
use fredholm_core::{
    Batch, DefaultGenerator, Draws, Functional, Kernel, Located, Neighbour, Real, Sampler, Source,
    Statistics, Stream, Task, TransitionDensity,
};

use crate::quadrature::Quadrature;

/// A failed check.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// What was checked, and where.
    pub what: String,
    /// The value that theory gives.
    pub expected: f64,
    /// The value that came.
    pub found: f64,
    /// Their distance in units of what was allowed.
    pub distance: f64,
    /// The unit: "standard errors", "rounding errors".
    pub unit: &'static str,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}: expected {:e}, found {:e}, {:.1} {} apart",
            self.what, self.expected, self.found, self.distance, self.unit
        )
    }
}

impl core::error::Error for Failure {}

/// **The neighbour equation holds pointwise**: v(x) = (T_hp v)(x) + G(x), (50) of Heinrich 1995, by
/// quadrature at the fractions `fractions` of every cell. This is what makes the estimate unbiased.
///
/// Allowed are `rounding` units of ε Σ|terms|.
///
/// # Errors
/// The first point at which it does not hold.
pub fn neighbour_equation<P, N>(
    problem: &P,
    neighbour: &N,
    fractions: &[f64],
    rounding: f64,
) -> Result<(), Failure>
where
    P: Quadrature + TransitionDensity + Kernel,
    N: Neighbour<Scalar = P::Scalar, Point = P::Point>,
{
    for i in 0..problem.cells() {
        for &t in fractions {
            let x = neighbour.locate(problem.inside(i, t));
            let source = neighbour.source(&x).to_f64();
            let (mut sum, mut size) = (source, source.abs());
            for j in 0..problem.cells() {
                for (y, weight) in problem.nodes(&x.point, j) {
                    let y = neighbour.locate(y);
                    let k = problem.kernel(&x.point, &y.point);
                    let h = neighbour.kernel(&x, &y, k).to_f64();
                    let p = problem.density(&x.point, &y.point).to_f64();
                    let term = weight * h * p * neighbour.value(&y).to_f64();
                    sum += term;
                    size += term.abs();
                }
            }
            let value = neighbour.value(&x).to_f64();
            let unit = P::Scalar::EPSILON.to_f64() * (size + value.abs());
            let distance = (sum - value).abs() / unit;
            if !(distance <= rounding) {
                return Err(Failure {
                    what: format!("the neighbour equation at fraction {t} of cell {i}"),
                    expected: value,
                    found: sum,
                    distance,
                    unit: "rounding errors",
                });
            }
        }
    }
    Ok(())
}

/// The points at the fractions `fractions` of every cell, with their cells as the partition has them.
fn points<'a, P: Quadrature>(
    problem: &'a P,
    fractions: &'a [f64],
) -> impl Iterator<Item = (usize, f64, Located<P::Point>)> + 'a {
    (0..problem.cells()).flat_map(move |i| {
        fractions.iter().map(move |&t| {
            let point = problem.inside(i, t);
            (i, t, Located { point, cell: i })
        })
    })
}

/// A failure unless two numbers agree to `allowed` rounding errors of the expected one's size.
fn agree<F: Real>(
    what: impl FnOnce() -> String,
    expected: f64,
    found: f64,
    size: f64,
    allowed: f64,
) -> Result<(), Failure> {
    let distance = (found - expected).abs() / (F::EPSILON.to_f64() * size);
    if distance <= allowed || found == expected {
        return Ok(());
    }
    Err(Failure {
        what: what(),
        expected,
        found,
        distance,
        unit: "rounding errors",
    })
}

/// **Points are found in their cells**: `locate` is i at the fractions `fractions` of cell i. Fractions
/// near 0 and 1 test the edges.
///
/// # Errors
/// The first point that is found in another cell.
pub fn cells_are_found<P: Quadrature>(problem: &P, fractions: &[f64]) -> Result<(), Failure> {
    for (i, t, x) in points(problem, fractions) {
        let found = problem.locate(&x.point);
        if found != i {
            return Err(Failure {
                what: format!("the cell of the point at fraction {t} of cell {i}"),
                expected: i as f64,
                found: found as f64,
                distance: found.abs_diff(i) as f64,
                unit: "cells",
            });
        }
    }
    Ok(())
}

/// **The density is one**: ∫ p(x,y) dμ(y) = 1 − q(x), (4), by quadrature.
///
/// # Errors
/// The first point at which it is not. A problem whose walks may leave the space does not pass.
pub fn density_integrates<P: Quadrature + TransitionDensity>(
    problem: &P,
    fractions: &[f64],
    allowed: f64,
) -> Result<(), Failure> {
    for (i, t, x) in points(problem, fractions) {
        let mut sum = 0.0;
        for j in 0..problem.cells() {
            for (y, weight) in problem.nodes(&x.point, j) {
                sum += weight * problem.density(&x.point, &y).to_f64();
            }
        }
        let expected = 1.0 - problem.absorption(&x.point).to_f64();
        let what = || format!("the integral of p(x, .) at fraction {t} of cell {i}");
        agree::<P::Scalar>(what, expected, sum, 1.0, allowed)?;
    }
    Ok(())
}

/// **Transition moments are the moments of p**, by quadrature, accurate relative to the size of the
/// mass p_j(x); and the masses sum to 1 − q(x).
///
/// # Errors
/// The first moment that is not.
pub fn moments_are_of_the_density<P, const B: usize>(
    problem: &P,
    fractions: &[f64],
    allowed: f64,
) -> Result<(), Failure>
where
    P: Quadrature + TransitionDensity + TransitionMoments<B>,
{
    for (i, t, x) in points(problem, fractions) {
        let mut total = 0.0;
        for j in 0..problem.cells() {
            let mut expected = [[0.0; B]; B];
            for (y, weight) in problem.nodes(&x.point, j) {
                let mass = weight * problem.density(&x.point, &y).to_f64();
                let psi = problem.basis(&Located { point: y, cell: j });
                for (row, b) in expected.iter_mut().zip(psi) {
                    for (m, c) in row.iter_mut().zip(psi) {
                        *m += mass * b.to_f64() * c.to_f64();
                    }
                }
            }
            let found: [[P::Scalar; B]; B] = problem.moments(&x, j);
            total += found[0][0].to_f64();
            for (b, (expected_row, row)) in expected.iter().zip(found).enumerate() {
                for (c, (&entry, m)) in expected_row.iter().zip(row).enumerate() {
                    let what =
                        || format!("moment ({b}, {c}) from fraction {t} of cell {i} to cell {j}");
                    let size = expected[0][0];
                    agree::<P::Scalar>(what, entry, m.to_f64(), size, allowed)?;
                }
            }
        }
        let expected = 1.0 - problem.absorption(&x.point).to_f64();
        let what = || format!("the sum of all masses at fraction {t} of cell {i}");
        agree::<P::Scalar>(what, expected, total, 1.0, allowed)?;
    }
    Ok(())
}

/// **The sampler follows p**: χ² of where `draws` steps from the middle of some cells lead, against
/// p_j(x); cells that expect fewer than 5 are pooled.
///
/// The statistic of k degrees of freedom is turned into a normal one by Wilson and Hilferty's cube
/// root (1931), which is within 0.02 of it for k ≥ 3.
///
/// # Errors
/// The first start from which the normal statistic is above `limit`.
pub fn sampler_follows<P: Quadrature + Sampler + TransitionMoments>(
    problem: &P,
    draws: u64,
    seed: u64,
    limit: f64,
) -> Result<(), Failure> {
    let cells = problem.cells();
    for i in [0, cells / 3, cells - 1] {
        let x = problem.inside(i, 0.4);
        let at = Located { point: x, cell: i };
        let mut uniforms = Draws(Stream::<DefaultGenerator>::new(seed, i as u64).generator(0));
        let mut counts = vec![0_u64; cells];
        for _ in 0..draws {
            if let Some(y) = problem.step(&x, &mut uniforms) {
                counts[problem.locate(&y)] += 1;
            }
        }
        let survival = 1.0 - problem.absorption(&x).to_f64();
        let (mut chi, mut degrees) = (0.0, -1.0);
        let mut pool = (0.0, 0.0);
        for (j, &count) in counts.iter().enumerate() {
            let [[mass]] = problem.moments(&at, j);
            pool.0 += draws as f64 * mass.to_f64() / survival;
            pool.1 += count as f64;
            if pool.0 >= 5.0 {
                chi += (pool.1 - pool.0) * (pool.1 - pool.0) / pool.0;
                degrees += 1.0;
                pool = (0.0, 0.0);
            }
        }
        let spread = 2.0 / (9.0 * degrees);
        let normal = ((chi / degrees).cbrt() - (1.0 - spread)) / spread.sqrt();
        if !(normal <= limit) {
            return Err(Failure {
                what: format!("chi² of {draws} steps from cell {i}, {degrees} degrees of freedom"),
                expected: degrees,
                found: chi,
                distance: normal,
                unit: "standard deviations",
            });
        }
    }
    Ok(())
}

/// **On S no mass collapses**: p_j(x)/p̄_ij ≥ `r_min` at both ends of cell i and inside, where p̄_ij is
/// the mean of p_j over the cell (section 4 of Heinrich 1995). Where it collapses the variance of ζ is
/// infinite, and no short run shows it.
///
/// # Errors
/// The first pair whose mass collapses.
pub fn masses_do_not_collapse<P, S>(problem: &P, pairs: &S, r_min: f64) -> Result<(), Failure>
where
    P: Quadrature + TransitionMoments,
    S: Pairs,
{
    let inside = [0.05, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95];
    let all = [1e-9, 0.05, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95, 1.0 - 1e-9];
    for i in 0..problem.cells() {
        for j in 0..problem.cells() {
            if pairs.kind(i, j) != PairKind::Galerkin {
                continue;
            }
            let mass = |t: f64| {
                let point = problem.inside(i, t);
                let [[mass]] = problem.moments(&Located { point, cell: i }, j);
                mass.to_f64()
            };
            let mean = inside.iter().map(|&t| mass(t)).sum::<f64>() / inside.len() as f64;
            for t in all {
                let ratio = mass(t) / mean;
                if !(ratio >= r_min) {
                    return Err(Failure {
                        what: format!("p_j(x)/mean at fraction {t} of cell {i} to cell {j}"),
                        expected: r_min,
                        found: ratio,
                        distance: r_min / ratio,
                        unit: "times too small",
                    });
                }
            }
        }
    }
    Ok(())
}

/// **Coefficients are near the integrals**: K'_ij against quadrature of the kernel over both cells,
/// within `relative` of ‖K‖'s row. For problems that claim so; approximate ones cost variance only.
///
/// # Errors
/// The first coefficient that is not.
pub fn coefficients_are_integrals<P, C>(
    problem: &P,
    coefficients: &C,
    relative: f64,
) -> Result<(), Failure>
where
    P: Quadrature + TransitionDensity + Kernel,
    C: Coefficients<Scalar = P::Scalar>,
{
    for i in 0..problem.cells() {
        let mut expected = vec![0.0; problem.cells()];
        let outer = problem.nodes(&problem.inside(i, 0.5), i);
        let measure: f64 = outer.iter().map(|(_, weight)| weight).sum();
        for (x, outer) in outer {
            for (j, expected) in expected.iter_mut().enumerate() {
                for (y, weight) in problem.nodes(&x, j) {
                    let k = problem.kernel(&x, &y) * problem.density(&x, &y);
                    *expected += outer / measure * weight * k.to_f64();
                }
            }
        }
        let size = expected.iter().map(|k| k.abs()).sum::<f64>();
        for (j, &expected) in expected.iter().enumerate() {
            let [[found]] = coefficients.block(i, j);
            let difference = (found.to_f64() - expected).abs();
            if !(difference <= relative * size) {
                return Err(Failure {
                    what: format!("K'_ij for i = {i}, j = {j}"),
                    expected,
                    found: found.to_f64(),
                    distance: difference / (relative * size),
                    unit: "times what was allowed",
                });
            }
        }
    }
    Ok(())
}

/// Runs the first `walks` walks of a task.
///
/// # Panics
/// If a walk scores a value that is not finite.
pub fn run<E, N, T, G>(task: &Task<'_, E, N, T, G>, walks: u64) -> Statistics
where
    E: Sampler + Kernel + Source,
    N: Neighbour<Scalar = E::Scalar, Point = E::Point> + ?Sized,
    T: Functional<E>,
    G: Rng + SeedableRng,
{
    let mut all = Statistics::default();
    let size = 4096;
    for index in 0..walks.div_ceil(size) {
        let mut batch = Batch::new(index, size, walks);
        batch.run(task, u64::MAX).expect("finite scores");
        all.merge(batch.statistics());
    }
    all
}

/// **The means**: plain and preconditioned estimates are `exact`, and E η(h,g) = (v,Φ), each
/// within `standard_errors` of its own plus `floor` for rounding.
///
/// # Errors
/// The first mean that is too far away, or that has no error bar.
pub fn means(
    statistics: &Statistics,
    exact: f64,
    standard_errors: f64,
    floor: f64,
) -> Result<(), Failure> {
    let cases = [
        ("the plain estimate", statistics.plain(), exact),
        (
            "the preconditioned estimate",
            statistics.preconditioned(),
            exact,
        ),
        ("the mean of η(h,g) − (v,Φ)", statistics.control(), 0.0),
    ];
    for (what, found, expected) in cases {
        let std_error = found.std_error.unwrap_or(f64::NAN);
        let difference = (found.estimate - expected).abs();
        if !(difference <= standard_errors * std_error + floor) {
            return Err(Failure {
                what: what.into(),
                expected,
                found: found.estimate,
                distance: difference / std_error,
                unit: "standard errors",
            });
        }
    }
    Ok(())
}
