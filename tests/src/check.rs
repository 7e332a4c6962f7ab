//! Generic checks. Each takes a problem and what it offers, and says what it expected, what came,
//! and how far apart they are.

use core::fmt;

use fredholm_core::rand_core::{Rng, SeedableRng};
use fredholm_core::{
    Batch, Functional, Kernel, Neighbour, Real, Sampler, Source, Statistics, Task,
    TransitionDensity,
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
