//! Checks of walks and of what is kept of them.

use fredholm_core::{
    Batch, Equation, Estimate, Functional, Job, NotFinite, Real, Start, StartOf, Statistics,
    Termination, Terminations, Uniforms,
};

use super::{ROUNDING_OF_STATISTICS, STANDARD_ERRORS, UNITS};
use crate::outcome::{Outcome, Sum, Worst};

/// (u, Φ) = the mean of u over given points: walks start in one of them, φ = 1. It serves for every
/// problem, and (v, Φ) is exact.
#[derive(Clone, Copy, Debug)]
pub struct Among<'p, P>(pub &'p [P]);

impl<E: Equation> Functional<E> for Among<'_, E::Point> {
    fn start<U: Uniforms<E::Scalar>>(&self, equation: &E, uniforms: &mut U) -> StartOf<E> {
        let count = E::Scalar::from_u32(self.0.len() as u32);
        let number = (uniforms.uniform() * count).to_u32() as usize;
        let one = E::Scalar::from_u32(1);
        Start::of(equation, self.0[number.min(self.0.len() - 1)], one)
    }
}

/// Walks of a batch, as every runner has them unless told otherwise.
const BATCH: u64 = 4096;

/// Runs the first `walks` walks of the first goals of a job that share them, in batches.
///
/// # Panics
/// If a walk scores a value that is not finite.
#[must_use]
pub fn run(job: &dyn Job, walks: u64) -> Vec<Statistics> {
    run_in_batches(job, walks, BATCH)
}

/// Statistics as of [`run`], with batches of this size.
///
/// # Panics
/// If a walk scores a value that is not finite.
#[must_use]
pub fn run_in_batches(job: &dyn Job, walks: u64, size: u64) -> Vec<Statistics> {
    let mut all = vec![Statistics::default(); job.shared()];
    for index in 0..walks.div_ceil(size) {
        let batches = run_batch(job, Batch::new(index, size, walks)).expect("finite scores");
        merge(&mut all, &batches);
    }
    all
}

/// All walks of a batch, of the first goals that share them.
fn run_batch(job: &dyn Job, batch: Batch) -> Result<Vec<Batch>, NotFinite> {
    let mut batches = vec![batch; job.shared()];
    job.run(0, &mut batches, u64::MAX)?;
    Ok(batches)
}

fn merge(all: &mut [Statistics], batches: &[Batch]) {
    for (all, batch) in all.iter_mut().zip(batches) {
        all.merge(&batch.statistics());
    }
}

/// Statistics as of [`run`], unless a walk has no end or no finite score, which would end the checks, or keep them busy for hours:
/// then the failure.
///
/// # Errors
/// What is wrong with which walk.
pub fn walk_all(job: &dyn Job, walks: u64) -> Result<Vec<Statistics>, Outcome> {
    let refused = |walk: u64, ending| Outcome::refused(format!("walk {walk} ended as {ending:?}"));
    let mut all = vec![Statistics::default(); job.shared()];
    // One after the other only at first: endless walks are rarely few.
    let alone = (0..walks.min(64)).map(|walk| (walk, Batch::new(walk, 1, walks)));
    let together = (0..walks.div_ceil(BATCH)).map(|i| (i * BATCH, Batch::new(i, BATCH, walks)));
    for (number, (walk, batch)) in alone.chain(together).enumerate() {
        let batches =
            run_batch(job, batch).map_err(|error| refused(error.walk, Termination::NotFinite))?;
        let is_cut = |batch: &Batch| batch.statistics().terminations().step_limit > 0;
        if batches.iter().any(is_cut) {
            return Err(refused(walk, Termination::StepLimit));
        }
        if number as u64 >= walks.min(64) {
            merge(&mut all, &batches);
        }
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

/// A walk that is run alone, of one of the goals that share it.
struct Alone {
    /// η(k,f), η(h,g) − (v,Φ) and ζ.
    scores: [f64; 3],
    states: u64,
    terminations: Terminations,
}

/// The first walks of a job, each alone, of the goal with this number among those that share them.
///
/// # Panics
/// If a walk scores a value that is not finite.
fn alone(job: &dyn Job, goal: usize, walks: u64) -> Vec<Alone> {
    let one = |walk| {
        let batches = run_batch(job, Batch::new(walk, 1, walks)).expect("finite scores");
        let of = batches[goal].statistics();
        Alone {
            scores: [of.plain(), of.control(), of.preconditioned()].map(|of| of.estimate),
            states: of.states(),
            terminations: of.terminations(),
        }
    };
    (0..walks).map(one).collect()
}

/// **Statistics are those of the walks**: `run` makes the statistics of the first `walks` walks of
/// a job, in batches of its own, and they must be those of the same walks run one by one, as
/// two passes over their scores give them. A merge that loses a batch is seen here, and a walk that
/// depends on more than its number, and one that is cut off.
#[must_use]
pub fn statistics(
    job: &dyn Job,
    walks: u64,
    run: impl FnOnce(&dyn Job, u64) -> Vec<Statistics>,
) -> Outcome {
    let mut worst = Worst::new("rounding units a walk", ROUNDING_OF_STATISTICS);
    for (goal, found) in run(job, walks).into_iter().enumerate() {
        let replayed = alone(job, goal, walks);
        let mut count = |what: &str, expected: u64, found: u64| {
            let (expected, found) = (expected as f64, found as f64);
            worst.compare(expected, found, 0.0, || what.into());
        };
        let sum = |of: fn(&Alone) -> u64| replayed.iter().map(of).sum();
        let ends = found.terminations();
        count("the number of walks", walks, found.walks());
        count("the number of states", sum(|w| w.states), found.states());
        count("walks that left", sum(|w| w.terminations.left), ends.left);
        let absorbed = sum(|w| w.terminations.absorbed);
        count("walks that were absorbed", absorbed, ends.absorbed);
        count("walks that were cut off", 0, ends.step_limit);
        let n = walks as f64;
        let estimates = [found.plain(), found.control(), found.preconditioned()];
        let names = ["eta(k,f)", "eta(h,g) - (v,Phi)", "zeta"];
        for (i, (name, estimate)) in names.iter().zip(estimates).enumerate() {
            let scores = || replayed.iter().map(|walk| walk.scores[i]);
            let sum: Sum = scores().collect();
            let mean = sum.value() / n;
            let squares: Sum = scores().map(|x| (x - mean) * (x - mean)).collect();
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

/// The scores of the first walks of a job, to compare scalars walk by walk.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Which neighbour equation, and how walks end.
    pub name: String,
    /// η(k,f).
    pub plain: Vec<f64>,
    /// ζ.
    pub zeta: Vec<f64>,
    /// What rounding leaves: `fredholm_core::rounding_floor`.
    pub floor: f64,
}

/// The scores of the first `walks` walks of a job, of its first goal.
///
/// # Panics
/// If a walk scores a value that is not finite.
#[must_use]
pub fn trace(name: String, job: &dyn Job, walks: u64, floor: f64) -> Trace {
    let walks = alone(job, 0, walks);
    let scores = |i: usize| walks.iter().map(|walk| walk.scores[i]).collect();
    Trace {
        name,
        plain: scores(0),
        zeta: scores(2),
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
