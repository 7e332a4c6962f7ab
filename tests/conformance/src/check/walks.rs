//! Checks of walks and of what is kept of them.

use fredholm_core::rand_core::{Rng, SeedableRng};
use fredholm_core::{
    Batch, Equation, Estimate, Functional, NeighbourOf, Real, StateSpace, Statistics, Task,
    Termination, Uniforms,
};

use super::{ROUNDING_OF_STATISTICS, STANDARD_ERRORS, UNITS};
use crate::outcome::{Outcome, Sum, Worst};

/// (u, Φ) = the mean of u over given points: walks start in one of them, φ = 1. It serves for every
/// problem, and (v, Φ) is exact.
#[derive(Clone, Debug)]
pub struct Among<P>(pub Vec<P>);

impl<E: StateSpace> Functional<E> for Among<E::Point> {
    fn start<U: Uniforms<E::Scalar>>(&self, uniforms: &mut U) -> (E::Point, E::Scalar) {
        let count = E::Scalar::from_u32(self.0.len() as u32);
        let number = (uniforms.uniform() * count).to_u32() as usize;
        let one = E::Scalar::from_u32(1);
        (self.0[number.min(self.0.len() - 1)], one)
    }
}

/// Walks of a batch, as every runner has them unless told otherwise.
const BATCH: u64 = 4096;

/// Runs the first `walks` walks of a task, in batches.
///
/// # Panics
/// If a walk scores a value that is not finite.
pub fn run<E, N, T, G>(task: &Task<'_, E, N, T, G>, walks: u64) -> Statistics
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Rng + SeedableRng,
{
    run_in_batches(task, walks, BATCH)
}

/// Statistics as of [`run`], with batches of this size.
///
/// # Panics
/// If a walk scores a value that is not finite.
pub fn run_in_batches<E, N, T, G>(task: &Task<'_, E, N, T, G>, walks: u64, size: u64) -> Statistics
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Rng + SeedableRng,
{
    let mut all = Statistics::default();
    for index in 0..walks.div_ceil(size) {
        let mut batch = Batch::new(index, size, walks);
        batch.run(task, u64::MAX).expect("finite scores");
        all.merge(batch.statistics());
    }
    all
}

/// Statistics as of [`run`], unless a walk has no end or no finite score, which would end the checks, or keep them busy for hours:
/// then the failure.
///
/// # Errors
/// What is wrong with which walk.
pub fn walk_all<E, N, T, G>(task: &Task<'_, E, N, T, G>, walks: u64) -> Result<Statistics, Outcome>
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Rng + SeedableRng,
{
    let refused = |walk: u64, ending| Outcome::refused(format!("walk {walk} ended as {ending:?}"));
    let mut all = Statistics::default();
    // One after the other only at first: endless walks are rarely few.
    for walk in 0..walks.min(64) {
        let ending = task.replay(walk).termination;
        if matches!(ending, Termination::NotFinite | Termination::StepLimit) {
            return Err(refused(walk, ending));
        }
    }
    for index in 0..walks.div_ceil(BATCH) {
        let mut batch = Batch::new(index, BATCH, walks);
        if let Err(error) = batch.run(task, u64::MAX) {
            return Err(refused(error.walk, Termination::NotFinite));
        }
        if batch.statistics().terminations().step_limit > 0 {
            return Err(refused(index * BATCH, Termination::StepLimit));
        }
        all.merge(batch.statistics());
    }
    Ok(all)
}

/// **The means**: the mean of ζ equals that of η within the standard error of their difference,
/// which is E η(h,g) = (v,Φ); and where the solution is known both equal it. Each may be off by
/// [`STANDARD_ERRORS`] of its own and by `floor` for rounding.
#[must_use]
pub fn means(statistics: &Statistics, exact: Option<f64>, floor: f64) -> Outcome {
    let mut worst = Worst::new("standard errors", STANDARD_ERRORS);
    let mut compare = |what: &str, found: Estimate, expected: f64| {
        let beyond = ((found.estimate - expected).abs() - floor).max(0.0);
        let distance = match found.std_error {
            _ if beyond == 0.0 => 0.0,
            Some(std_error) => beyond / std_error,
            // Nothing scored: no error bar, and not what was expected either.
            None => f64::INFINITY,
        };
        worst.add(expected, found.estimate, distance, || what.into());
    };
    compare(
        "the mean of eta(h,g) - (v,Phi), zeta's from eta's",
        statistics.control(),
        0.0,
    );
    if let Some(exact) = exact {
        compare("the plain estimate", statistics.plain(), exact);
        compare(
            "the preconditioned estimate",
            statistics.preconditioned(),
            exact,
        );
    }
    worst.outcome()
}

/// **An error bar is std_dev/√walks**, to [`ROUNDING_OF_STATISTICS`].
#[must_use]
pub fn error_bar(estimate: &Estimate, walks: u64) -> Outcome {
    let mut worst = Worst::new(UNITS, ROUNDING_OF_STATISTICS);
    if let (Some(std_dev), Some(std_error)) = (estimate.std_dev, estimate.std_error) {
        let expected = std_dev / (walks as f64).sqrt();
        worst.compare(expected, std_error, f64::EPSILON * expected, || {
            format!("the standard error of {walks} walks with standard deviation {std_dev:e}")
        });
    } else {
        worst.add(f64::NAN, f64::NAN, f64::NAN, || "nothing was scored".into());
    }
    worst.outcome()
}

/// **Statistics are those of the walks**: `run` makes the statistics of the first `walks` walks of
/// a task, in batches of its own, and they must be those of the same walks replayed one by one, as
/// two passes over their scores give them. A merge that loses a batch is seen here, and a walk that
/// depends on more than its number, and one that is cut off.
#[must_use]
pub fn statistics<E, N, T, G>(
    task: &Task<'_, E, N, T, G>,
    walks: u64,
    run: impl FnOnce(&Task<'_, E, N, T, G>, u64) -> Statistics,
) -> Outcome
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Rng + SeedableRng,
{
    let found = run(task, walks);
    let value = task.control_mean.expect("a task with (v, Phi)");
    let replayed: Vec<_> = (0..walks).map(|walk| task.replay(walk)).collect();
    let mut worst = Worst::new("rounding units a walk", ROUNDING_OF_STATISTICS);
    let mut count = |what: &str, expected: u64, found: u64| {
        let (expected, found) = (expected as f64, found as f64);
        worst.compare(expected, found, 0.0, || what.into());
    };
    let ended = |ending| replayed.iter().filter(|w| w.termination == ending).count() as u64;
    let states = replayed.iter().map(|w| u64::from(w.states)).sum();
    count("the number of walks", walks, found.walks());
    count("the number of states", states, found.states());
    count(
        "walks that left",
        ended(Termination::Left),
        found.terminations().left,
    );
    count(
        "walks that were absorbed",
        ended(Termination::Absorbed),
        found.terminations().absorbed,
    );
    count(
        "walks that were cut off",
        0,
        found.terminations().step_limit,
    );
    let n = walks as f64;
    let scores: [Vec<f64>; 3] = [
        replayed.iter().map(|w| w.plain.to_f64()).collect(),
        replayed
            .iter()
            .map(|w| w.control.to_f64() - value)
            .collect(),
        replayed
            .iter()
            .map(|w| w.plain.to_f64() - (w.control.to_f64() - value))
            .collect(),
    ];
    let estimates = [found.plain(), found.control(), found.preconditioned()];
    let names = ["eta(k,f)", "eta(h,g) - (v,Phi)", "zeta"];
    for ((name, scores), estimate) in names.iter().zip(&scores).zip(estimates) {
        let sum: Sum = scores.iter().copied().collect();
        let mean = sum.value() / n;
        let squares: Sum = scores.iter().map(|x| (x - mean) * (x - mean)).collect();
        let deviation = (squares.value() / (n - 1.0)).sqrt();
        let unit = f64::EPSILON * n * (sum.size() / n + deviation);
        worst.compare(mean, estimate.estimate, unit, || {
            format!("the mean of {name}")
        });
        let found = estimate.std_dev.unwrap_or(f64::NAN);
        worst.compare(deviation, found, unit, || {
            format!("the standard deviation of {name}")
        });
    }
    worst.outcome()
}

/// How many estimates [`coverage`] asks for.
pub const COVERAGE_SEEDS: u64 = 1000;

/// **Error bars cover**: of 1,000 estimates (value and standard error, one for each seed) the
/// intervals of 1.96 standard errors contain `exact` 950 times. That is binomial with standard
/// deviation 6.9, of which [`STANDARD_ERRORS`] pass.
#[must_use]
pub fn coverage(exact: f64, estimate: impl Fn(u64) -> (f64, f64)) -> Outcome {
    let mut worst = Worst::new("standard errors", STANDARD_ERRORS);
    let covered = (0..COVERAGE_SEEDS).filter(|&seed| {
        let (estimate, std_error) = estimate(seed);
        (estimate - exact).abs() <= 1.96 * std_error
    });
    let seeds = COVERAGE_SEEDS as f64;
    let deviation = (seeds * 0.95 * 0.05).sqrt();
    worst.compare(0.95 * seeds, covered.count() as f64, deviation, || {
        format!("how many of {COVERAGE_SEEDS} 95 % intervals contain {exact:e}")
    });
    worst.outcome()
}

/// The scores of the first walks of a task, to compare scalars walk by walk.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Which neighbour equation, and which estimator.
    pub name: String,
    /// η(k,f).
    pub plain: Vec<f64>,
    /// ζ.
    pub zeta: Vec<f64>,
    /// What rounding leaves: `fredholm_core::rounding_floor`.
    pub floor: f64,
}

/// The scores of the first `walks` walks of a task.
///
/// # Panics
/// If the task has no (v, Φ).
pub fn trace<E, N, T, G>(name: String, task: &Task<'_, E, N, T, G>, walks: u64, floor: f64) -> Trace
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Rng + SeedableRng,
{
    let value = task.control_mean.expect("a task with (v, Phi)");
    let walks: Vec<_> = (0..walks).map(|walk| task.replay(walk)).collect();
    Trace {
        name,
        plain: walks.iter().map(|w| w.plain.to_f64()).collect(),
        zeta: walks
            .iter()
            .map(|w| w.plain.to_f64() - (w.control.to_f64() - value))
            .collect(),
        floor,
    }
}

/// **f32 agrees with f64 within the rounding floor**: the same walks draw the same words, so that
/// the mean of the differences of their scores has a small standard error, of which
/// [`STANDARD_ERRORS`] pass besides the floor. What a rare walk does that rounds to another cell or
/// ending is in that error.
#[must_use]
pub fn scalars(narrow: &Trace, wide: &Trace) -> Outcome {
    let mut worst = Worst::new("standard errors beyond the rounding floor", STANDARD_ERRORS);
    for (what, narrow_scores, wide_scores) in [
        ("plain", &narrow.plain, &wide.plain),
        ("preconditioned", &narrow.zeta, &wide.zeta),
    ] {
        let n = wide_scores.len() as f64;
        let pairs = || narrow_scores.iter().zip(wide_scores);
        let mean = pairs().map(|(a, b)| a - b).collect::<Sum>().value() / n;
        let squares: Sum = pairs()
            .map(|(a, b)| (a - b - mean) * (a - b - mean))
            .collect();
        let std_error = (squares.value() / (n - 1.0) / n).sqrt();
        let beyond = (mean.abs() - narrow.floor).max(0.0);
        let distance = if beyond == 0.0 {
            0.0
        } else {
            beyond / std_error
        };
        let expected = wide_scores.iter().copied().collect::<Sum>().value() / n;
        worst.add(expected, expected + mean, distance, || {
            format!(
                "the f32 mean of {n} {what} scores against that of f64, {}, rounding floor {:e}",
                narrow.name, narrow.floor
            )
        });
    }
    worst.outcome()
}
