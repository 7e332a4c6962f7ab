//! How much to run, and when to stop.

use core::marker::PhantomData;
use core::time::Duration;

use fredholm_core::{DefaultGenerator, Estimator, STEP_LIMIT, TargetError};

/// A functional of the solution and, where it is known, (v, Φ).
#[derive(Clone, Copy, Debug)]
pub struct Target<T> {
    /// Where walks start, and what is estimated.
    pub functional: T,
    /// (v, Φ), exact; `None`: walk by walk (see [`Task`](fredholm_core::Task)).
    pub neighbour_value: Option<f64>,
}

/// What to run for every target. Seed, walks, batch size, estimator, step limit and generator are
/// what results depend on, and they depend on nothing else.
///
/// ```
/// use fredholm_core::Estimator;
/// use fredholm_rayon::{Plan, TargetError};
///
/// let mut plan: Plan = Plan::new(100_000);
/// plan.seed = 7;
/// plan.estimator = Estimator::Collision;
/// plan.target_error = Some(TargetError::Relative(1e-4));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Plan<G = DefaultGenerator> {
    /// The seed of all draws.
    pub seed: u64,
    /// Walks for each target; with a target error the most.
    pub walks: u64,
    /// Walks of a batch.
    pub batch: u64,
    /// What a walk scores.
    pub estimator: Estimator,
    /// Most states of a walk.
    pub step_limit: u32,
    /// Stop a target when the standard error of its preconditioned estimate is this small. Looked
    /// at after whole rounds of batches only, so that where it stops does not depend on threads.
    pub target_error: Option<TargetError>,
    /// Stop after this time with what has been done by then.
    pub time_limit: Option<Duration>,
    generator: PhantomData<fn() -> G>,
}

impl<G> Plan<G> {
    /// `walks` walks for each target, and defaults: seed 1, batches of 4096, absorption estimator.
    #[must_use]
    pub const fn new(walks: u64) -> Self {
        Self {
            seed: 1,
            walks,
            batch: 4096,
            estimator: Estimator::Absorption,
            step_limit: STEP_LIMIT,
            target_error: None,
            time_limit: None,
            generator: PhantomData,
        }
    }

    pub(crate) const fn batches(&self) -> u64 {
        self.walks.div_ceil(self.batch)
    }
}
