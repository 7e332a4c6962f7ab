//! What the file says of a run, and the run of one equation by it.

use core::time::Duration;

use fredholm_core::{
    Equation, Estimator, Functional, Goal, Goals, NeighbourOf, Tolerance, WalkOptions,
};
use fredholm_rayon::{Observer, Outcome, RunError};

/// What is run for every target.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) seed: u64,
    pub(crate) walks: u64,
    pub(crate) batch: u64,
    pub(crate) estimator: Estimator,
    pub(crate) target_error: Option<Tolerance>,
    pub(crate) time_limit: Option<Duration>,
}

impl Plan {
    pub(crate) fn new(walks: u64) -> Self {
        let plan = fredholm_core::Plan::new(walks);
        let WalkOptions {
            seed, estimator, ..
        } = WalkOptions::default();
        Self {
            seed,
            walks,
            batch: plan.batch,
            estimator,
            target_error: plan.tolerance,
            time_limit: None,
        }
    }
}

/// Runs the plan for every goal.
pub(crate) fn run<E, N, T>(
    equation: &E,
    neighbour: &N,
    goals: &[Goal<T>],
    plan: &Plan,
    observer: &dyn Observer,
) -> Result<Outcome, RunError>
where
    E: Equation + Sync,
    N: NeighbourOf<E> + Sync + ?Sized,
    T: Functional<E> + Sync,
{
    let options = WalkOptions {
        seed: plan.seed,
        estimator: plan.estimator,
        ..WalkOptions::default()
    };
    let job = Goals::new(equation, neighbour, goals, options);
    let all = fredholm_core::Plan {
        walks: plan.walks,
        batch: plan.batch,
        tolerance: plan.target_error,
    };
    fredholm_rayon::run(&job, &all, plan.time_limit, observer)
}
