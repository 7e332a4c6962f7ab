//! Jobs: the seam between runners and problems. Whoever runs a job knows no type of the problem.

use core::fmt;
use core::marker::PhantomData;

use crate::{
    Batch, DefaultGenerator, Equation, Estimator, Form, Functional, Generators, Length,
    NeighbourOf, NotFinite, STEP_LIMIT, Task, WalkSeeds,
};

/// A run's walks, without any type of the problem: equation, neighbour equation, goals, estimator, seed,
/// step limit and generator.
///
/// The statistics of a batch follow from the job, the goal's number and the batch, and from nothing
/// else, so that a runner may run batches in any order and place. The trait is object safe.
pub trait Job: Sync {
    /// The number of goals. They are numbered from 0.
    fn goals(&self) -> usize;

    /// Runs at most `at_most` further walks of a batch of goal number `goal`. Where there is no such
    /// goal, nothing is run.
    ///
    /// # Errors
    /// [`NotFinite`]: a walk scored an infinity or NaN. It is not in the batch's statistics; the
    /// batch stands before it.
    fn run(&self, goal: usize, batch: &mut Batch, at_most: u64) -> Result<(), NotFinite>;

    /// The number of goals that share their walks: the first so many, the next so many, and so on. It divides the number of
    /// goals.
    fn shared(&self) -> usize {
        1
    }

    /// Runs at most `at_most` further walks of a batch of each of the goals that share walks, of which `first` is the first
    /// one. All these batches have the same walks so far.
    ///
    /// # Errors
    /// [`NotFinite`], as [`run`](Self::run); the walk is in no batch's statistics.
    fn run_shared(
        &self,
        first: usize,
        batches: &mut [Batch],
        at_most: u64,
    ) -> Result<(), NotFinite> {
        let mut goals = (first..).zip(batches);
        goals.try_for_each(|(goal, batch)| self.run(goal, batch, at_most))
    }
}

/// A job whose (v, Φ) are estimates of their own, with standard errors: they are part of all error bars of ζ, and more walks
/// do not lower them.
#[derive(Clone, Copy)]
pub struct UncertainControl<'a> {
    /// The job.
    pub job: &'a dyn Job,
    /// The standard error of (v, Φ) of every goal; that of goals beyond is 0.
    pub errors: &'a [f64],
}

impl fmt::Debug for UncertainControl<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("UncertainControl")
            .field("errors", &self.errors)
            .finish_non_exhaustive()
    }
}

impl Job for UncertainControl<'_> {
    fn goals(&self) -> usize {
        self.job.goals()
    }

    fn run(&self, goal: usize, batch: &mut Batch, at_most: u64) -> Result<(), NotFinite> {
        if let Some(&error) = self.errors.get(goal) {
            batch.set_control_error(error);
        }
        self.job.run(goal, batch, at_most)
    }

    fn shared(&self) -> usize {
        self.job.shared()
    }

    fn run_shared(
        &self,
        first: usize,
        batches: &mut [Batch],
        at_most: u64,
    ) -> Result<(), NotFinite> {
        for (batch, &error) in batches
            .iter_mut()
            .zip(self.errors.get(first..).unwrap_or(&[]))
        {
            batch.set_control_error(error);
        }
        self.job.run_shared(first, batches, at_most)
    }
}

/// A quantity that a run estimates: a functional of the solution and, if it is known, (v, Φ).
#[derive(Clone, Copy, Debug)]
pub struct Goal<T> {
    /// The functional: where walks start, and what is estimated.
    pub functional: T,
    /// (v, Φ), exact; `None`: walk by walk (see [`Task::control_mean`]).
    pub control_mean: Option<f64>,
}

/// Options that walks of all goals share: seed, estimator and step limit.
///
/// ```
/// use fredholm_core::{Estimator, WalkOptions};
///
/// let options = WalkOptions { seed: 7, ..WalkOptions::default() };
/// assert_eq!(options.estimator, Estimator::Absorption);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WalkOptions {
    /// The seed of all draws.
    pub seed: u64,
    /// The estimator: what a walk scores.
    pub estimator: Estimator,
    /// The form of the control variate.
    pub form: Form,
    /// The number of first states in which a walk is not absorbed. There it scores F, whatever the estimator, and what it
    /// scores after them has the weight 1 − q of each: the mean over what absorption would do. A walk is as many states
    /// longer, and depends on its draws without the jumps of absorption, so that a [`Sobol`](crate::Sobol) sequence gains
    /// more. Survival biasing in the words of neutron transport.
    pub survivals: u32,
    /// Most states of a walk; a walk that is cut off there is counted.
    pub step_limit: u32,
}

impl WalkOptions {
    /// How long walks are followed.
    #[must_use]
    pub const fn length(&self) -> Length {
        Length {
            survivals: self.survivals,
            step_limit: self.step_limit,
        }
    }
}

impl Default for WalkOptions {
    /// Seed 1, the absorption estimator, the product form, absorption from the first state on, [`STEP_LIMIT`].
    fn default() -> Self {
        Self {
            seed: 1,
            estimator: Estimator::Absorption,
            form: Form::Product,
            survivals: 0,
            step_limit: STEP_LIMIT,
        }
    }
}

/// The job of one equation with one neighbour equation: goals of one type of functional.
///
/// The number of a goal is also the number of its [`WalkSeeds`] of draws.
#[derive(Debug)]
pub struct Goals<'a, E, N: ?Sized, T, G = DefaultGenerator> {
    /// The equation and its chain.
    pub equation: &'a E,
    /// The neighbour equation.
    pub neighbour: &'a N,
    /// The goals: what is estimated.
    pub goals: &'a [Goal<T>],
    /// Seed, estimator and step limit.
    pub options: WalkOptions,
    generator: PhantomData<fn() -> G>,
}

// By hand: a derive would ask equation and generator to be `Clone` and `Copy`.
impl<E, N: ?Sized, T, G> Clone for Goals<'_, E, N, T, G> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<E, N: ?Sized, T, G> Copy for Goals<'_, E, N, T, G> {}

impl<'a, E, N: ?Sized, T> Goals<'a, E, N, T> {
    /// The job of these goals, with draws of the [`DefaultGenerator`].
    #[must_use]
    pub const fn new(
        equation: &'a E,
        neighbour: &'a N,
        goals: &'a [Goal<T>],
        options: WalkOptions,
    ) -> Self {
        Self {
            equation,
            neighbour,
            goals,
            options,
            generator: PhantomData,
        }
    }
}

impl<'a, E, N: ?Sized, T, G> Goals<'a, E, N, T, G> {
    /// This job with draws of another generator, which is part of what bits depend on.
    #[must_use]
    pub const fn with_generator<H>(self) -> Goals<'a, E, N, T, H> {
        Goals {
            equation: self.equation,
            neighbour: self.neighbour,
            goals: self.goals,
            options: self.options,
            generator: PhantomData,
        }
    }

    /// The [`Task`] of one goal, for instance to replay one. `None`: there is no such
    /// goal.
    #[must_use]
    pub fn task(&self, goal: usize) -> Option<Task<'a, E, N, T, G>> {
        let Goal {
            functional,
            control_mean,
        } = self.goals.get(goal)?;
        Some(Task {
            equation: self.equation,
            neighbour: self.neighbour,
            functional,
            control_mean: *control_mean,
            estimator: self.options.estimator,
            form: self.options.form,
            seeds: WalkSeeds::new(self.options.seed, goal as u64),
            length: self.options.length(),
        })
    }
}

impl<E, N, T, G> Job for Goals<'_, E, N, T, G>
where
    E: Equation + Sync,
    N: NeighbourOf<E> + Sync + ?Sized,
    T: Functional<E> + Sync,
    G: Generators,
{
    fn goals(&self) -> usize {
        self.goals.len()
    }

    fn run(&self, goal: usize, batch: &mut Batch, at_most: u64) -> Result<(), NotFinite> {
        self.task(goal)
            .map_or(Ok(()), |task| batch.run(&task, at_most))
    }
}
