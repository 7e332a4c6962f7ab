//! Jobs: the seam between runners and problems. A runner knows no type of the problem.

use crate::rand_core::{Rng, SeedableRng};
use crate::uniforms::ControlDraws;
use crate::walk::{Course, Followed, Visitor};
use crate::{
    Absorption, Batch, Equation, Form, Functional, Generators, Independent, Length, NeighbourOf,
    NotFinite, RngUniforms, STEP_LIMIT, Start, Uniforms, Value, Walk, WalkNumber, WalkSeeds,
    WideOf,
};

/// A run's walks, without any type of the problem: equation, neighbour equation, goals, absorption, seed,
/// step limit and generator.
///
/// The statistics of a batch follow from the job, the goal's number and the batch, and from nothing
/// else, so that a runner may run batches in any order and place. The trait is object safe.
pub trait Job: Sync {
    /// The number of goals. They are numbered from 0.
    fn goals(&self) -> usize;

    /// The number of goals that share their walks: the first so many, the next so many, and so on. It divides the number of
    /// goals.
    fn shared(&self) -> usize {
        1
    }

    /// The number of those that share their walks whose errors tell when these end: the first so many.
    fn decisive(&self) -> usize {
        self.shared()
    }

    /// Runs at most `at_most` further walks of a batch of each of the goals that share walks, of which `first` is the first
    /// one. All these batches have the same walks so far. Where there is no such goal, nothing is run.
    ///
    /// # Errors
    /// [`NotFinite`]: a walk scored an infinity or NaN. It is in no batch's statistics; the
    /// batches stand before it.
    fn run(&self, first: usize, batches: &mut [Batch], at_most: u64) -> Result<(), NotFinite>;
}

/// A quantity that a run estimates: a functional of the solution and, if it is known, (v, Φ).
#[derive(Clone, Copy, Debug)]
pub struct Goal<T, W> {
    /// The functional: where walks start, and what is estimated.
    pub functional: T,
    /// (v, Φ), exact. `None`: [`Functional::control_estimate`] walk by walk, which is unbiased too; but
    /// for a spread-out start its own variance stays in that of ζ.
    pub control_mean: Option<W>,
    /// The part of (u, Φ) that is known besides what walks estimate, the same for all of them: (F_s, Φ), if they are for u − F_s, as with a
    /// [`LastStep`](crate::LastStep). It is added to their scores.
    pub known: W,
}

impl<T> Goal<T, f64> {
    /// A goal of one channel of which nothing is known by itself.
    pub const fn new(functional: T, control_mean: Option<f64>) -> Self {
        Self {
            functional,
            control_mean,
            known: 0.0,
        }
    }
}

/// Options that walks of all goals share: seed, absorption and step limit.
///
/// ```
/// use fredholm_core::{Absorption, WalkOptions};
///
/// let options = WalkOptions { seed: 7, ..WalkOptions::default() };
/// assert_eq!(options.absorption, Absorption::Roulette);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WalkOptions {
    /// The seed of all draws.
    pub seed: u64,
    /// How walks end, and what they score.
    pub absorption: Absorption,
    /// The form of the control variate.
    pub form: Form,
    /// The number of first states in which a walk is not absorbed. There it scores F, whatever the estimator. A walk is as many states
    /// longer, and depends on its draws without the jumps of absorption, so that a [Sobol'](crate::Sequence) sequence gains
    /// more. Survival biasing in the words of neutron transport.
    pub forced_steps: u32,
    /// Most states of a walk; a walk that is cut off there is counted.
    pub step_limit: u32,
}

impl WalkOptions {
    /// How long walks are followed.
    #[must_use]
    pub const fn length(&self) -> Length {
        Length {
            forced_steps: self.forced_steps,
            step_limit: self.step_limit,
        }
    }
}

impl Default for WalkOptions {
    /// Seed 1, roulette from the first state on, the residual form, [`STEP_LIMIT`].
    fn default() -> Self {
        Self {
            seed: 1,
            absorption: Absorption::Roulette,
            form: Form::default(),
            forced_steps: 0,
            step_limit: STEP_LIMIT,
        }
    }
}

/// The job of one equation with one neighbour equation: goals of one type of functional.
///
/// Goal g of an equation with C channels has the statistics numbers g C + c or, with weights of a sum, g (C + 1) + c, where the sum
/// comes last. They share the walks of the goal, whose draws are those of [`WalkSeeds`] number g. Scores of a walk in several
/// channels depend on each other, so that the error of a sum does not follow from those of the channels: it is a functional
/// more, with statistics of its own.
///
/// ```
/// use fredholm_core::{
///     At, Batch, Chain, Channels, Equation, Goal, Goals, Job, NoNeighbour, Space, Uniforms, Value,
/// };
///
/// /// u_c = r_c ∫ u_c dy + 1 on [0, 1], with r = (½, ¼): u = (2, 4/3).
/// struct Two;
///
/// impl Space for Two {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl Chain for Two {
///     fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
///         Some(uniforms.uniform())
///     }
/// }
/// impl Equation for Two {
///     type Value = Channels<f64, 2>;
///     fn kernel(&self, _: &f64, _: &f64) -> Self::Value {
///         Channels::from_fn(2, |c| [0.5, 0.25][c])
///     }
///     fn source<U: Uniforms<f64>>(&self, _: &f64, _: &mut U) -> Self::Value {
///         Channels::splat(2, 1.0)
///     }
///     fn channels(&self) -> usize {
///         2
///     }
/// }
///
/// let nothing = Channels::splat(2, 0.0);
/// let goals = [Goal { functional: At(0.3), control_mean: Some(nothing), known: nothing }];
/// let none = NoNeighbour::new(&Two);
/// let job = Goals::new(&Two, &none, &goals, Default::default()).with_sum(&[1.0, 1.0]);
/// // Both channels and their sum, from the same walks.
/// let mut batches = [Batch::new(0, 10_000, 10_000); 3];
/// job.run(0, &mut batches, u64::MAX)?;
/// for (batch, exact) in batches.iter().zip([2.0, 4.0 / 3.0, 10.0 / 3.0]) {
///     let plain = batch.statistics().plain();
///     assert!((plain.estimate - exact).abs() <= 5.0 * plain.std_error.unwrap());
/// }
/// # Ok::<(), fredholm_core::NotFinite>(())
/// ```
#[derive(Debug)]
pub struct Goals<'a, E: Equation, N: ?Sized, T, G = Independent> {
    /// The equation and its chain.
    pub equation: &'a E,
    /// The neighbour equation.
    pub neighbour: &'a N,
    /// The goals: what is estimated.
    pub goals: &'a [Goal<T, WideOf<E>>],
    /// The weights of the sum, one for every channel; none for no sum.
    pub weights: &'a [f64],
    /// Whether each functional is certain: see [`Goals::with_certain`].
    pub certain: &'a [bool],
    /// Seed, absorption and step limit.
    pub options: WalkOptions,
    /// The generators of walks' numbers.
    pub generators: G,
}

// By hand: a derive would ask equation and generator to be `Clone` and `Copy`.
impl<E: Equation, N: ?Sized, T, G: Copy> Clone for Goals<'_, E, N, T, G> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<E: Equation, N: ?Sized, T, G: Copy> Copy for Goals<'_, E, N, T, G> {}

impl<'a, E: Equation, N: ?Sized, T> Goals<'a, E, N, T> {
    /// The job of these goals, with draws of the [`DefaultGenerator`](crate::DefaultGenerator).
    #[must_use]
    pub const fn new(
        equation: &'a E,
        neighbour: &'a N,
        goals: &'a [Goal<T, WideOf<E>>],
        options: WalkOptions,
    ) -> Self {
        Self {
            equation,
            neighbour,
            goals,
            weights: &[],
            certain: &[],
            options,
            generators: Independent::NEW,
        }
    }
}

/// A walk, φ in its start, (v, Φ) or its own part of it, and what it knows by itself.
pub(crate) struct Score<E: Equation> {
    pub(crate) walk: Walk<E::Value>,
    pub(crate) phi: E::Scalar,
    value: WideOf<E>,
    known: WideOf<E>,
}

impl<E: Equation> Score<E> {
    /// The preconditioned estimate of (u, Φ).
    pub(crate) fn estimate(&self) -> WideOf<E> {
        let difference = self.walk.plain.wide().minus(&self.walk.control.wide());
        difference.plus(&self.value).plus(&self.known)
    }

    /// The walk as one channel sees it.
    #[inline(always)]
    fn walk_of(&self, channel: usize) -> Walk<E::Scalar> {
        Walk {
            plain: self.walk.plain.get(channel),
            control: self.walk.control.get(channel),
            states: self.walk.states,
            termination: self.walk.termination,
        }
    }
}

impl<'a, E: Equation, N: ?Sized, T, G: Copy> Goals<'a, E, N, T, G> {
    /// This job with a weighted sum of the channels beside them.
    #[must_use]
    pub const fn with_sum(self, weights: &'a [f64]) -> Self {
        Self { weights, ..self }
    }

    /// This job with the knowledge which of its functionals are certain, by the numbers of their statistics: every start scores F, which is
    /// known there, and no step leads on, as on a black wall. Walks that score 0 are then no sign of what is rare.
    #[must_use]
    pub const fn with_certain(self, certain: &'a [bool]) -> Self {
        Self { certain, ..self }
    }

    /// This job with draws of another generator, which is part of what bits depend on.
    #[must_use]
    pub const fn with_generator<H>(self) -> Goals<'a, E, N, T, Independent<H>> {
        self.with_generators(Independent::NEW)
    }

    /// This job with numbers of other generators, such as those of a [`Sequence`](crate::Sequence).
    #[must_use]
    pub const fn with_generators<H>(self, generators: H) -> Goals<'a, E, N, T, H> {
        Goals {
            equation: self.equation,
            neighbour: self.neighbour,
            goals: self.goals,
            weights: self.weights,
            certain: self.certain,
            options: self.options,
            generators,
        }
    }

    /// The statistics of a goal: one for each channel, and one for the sum.
    pub(crate) fn statistics(&self) -> usize {
        self.equation.channels() + usize::from(!self.weights.is_empty())
    }
}

impl<E, N, T, G> Goals<'_, E, N, T, G>
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Generators,
{
    /// A walk of a goal, whose states are shown to a visitor with weight 1 in the first.
    #[inline(always)]
    pub(crate) fn follow<B: Visitor<E::Point, E::Scalar, E::Value>>(
        &self,
        goal: &Goal<T, WideOf<E>>,
        seeds: &WalkSeeds<G::Random>,
        course: Course<E::Scalar>,
        (number, memory): (WalkNumber, &mut G::Memory),
        beside: &mut B,
    ) -> Score<E> {
        let mut draws = RngUniforms(self.generators.generator(seeds, number, memory));
        let mut control_draws = ControlDraws::<G::Random>::new(seeds, number.walk);
        let Start { point, phi, known } = goal.functional.start(self.equation, &mut draws);
        let x0 = self.neighbour.locate(point);
        let value = match goal.control_mean {
            Some(value) => value,
            None => self.look(goal, (&x0, phi), &mut control_draws),
        };
        let followed = Followed {
            equation: self.equation,
            neighbour: self.neighbour,
            form: self.options.form,
            length: self.options.length(),
        };
        let draws = (&mut draws, &mut control_draws as &mut dyn Uniforms<_>);
        Score {
            walk: followed.scored((x0, phi), course, draws, beside),
            phi,
            value,
            known: known.wide().plus(&goal.known),
        }
    }

    /// A number with the mean (v, Φ): of the walk's start, and of as many further ones as the functional takes.
    fn look<R: Rng + SeedableRng>(
        &self,
        goal: &Goal<T, WideOf<E>>,
        start: (&crate::Located<E::Point>, E::Scalar),
        draws: &mut ControlDraws<R>,
    ) -> WideOf<E> {
        let of = |x0: &crate::Located<E::Point>, phi| {
            let v = self.neighbour.value(x0);
            goal.functional.control_estimate(x0, phi, &v)
        };
        let mut sum = of(start.0, start.1);
        let looks = goal.functional.looks();
        for _ in 1..looks {
            let further = goal.functional.start(self.equation, draws);
            let x0 = self.neighbour.locate(further.point);
            sum = sum.plus(&of(&x0, further.phi));
        }
        if looks > 1 {
            sum = sum.scaled(1.0 / f64::from(looks));
        }
        sum
    }

    /// Runs walk number `walk` of a goal alone: the same scores as within its batch, if walks are independent. `None`: there is no such
    /// goal.
    #[must_use]
    pub fn replay(&self, goal: usize, walk: u64) -> Option<Walk<E::Value>> {
        let number = WalkNumber {
            walk,
            replicate: walk,
            index: 0,
        };
        let own = self.goals.get(goal)?;
        let seeds = WalkSeeds::new(self.options.seed, goal as u64);
        let course = Course::of(self.options.absorption);
        let number = (number, &mut G::Memory::default());
        let score = self.follow(own, &seeds, course, number, &mut ());
        Some(score.walk)
    }

    /// Runs at most `at_most` further walks of a goal that need be none of the job's own, as the goal of this number: for many goals of
    /// which none has to be kept, such as the pixels of a picture.
    ///
    /// # Errors
    /// As [`Job::run`].
    pub fn run_goal(
        &self,
        goal: &Goal<T, WideOf<E>>,
        number: u64,
        batches: &mut [Batch],
        at_most: u64,
    ) -> Result<(), NotFinite> {
        let own = (goal, number);
        let outcome = match Course::of(self.options.absorption) {
            course if !G::ONE_LOOP_PER_END => self.run_walks(own, course, batches, at_most),
            // A loop over walks for each course, which is a constant there.
            Course::Roulette => self.run_walks(own, Course::Roulette, batches, at_most),
            Course::Absorbed(q) => self.run_walks(own, Course::Absorbed(q), batches, at_most),
            Course::Collided(q) => self.run_walks(own, Course::Collided(q), batches, at_most),
        };
        self.end(batches);
        outcome
    }

    /// Says which of these batches are certain, of which the first has this number.
    pub(crate) fn mark_certain(&self, first: usize, batches: &mut [Batch]) {
        let certain = self.certain.get(first..).unwrap_or_default();
        for (batch, _) in batches.iter_mut().zip(certain).filter(|own| *own.1) {
            batch.become_certain();
        }
    }

    /// Says what batches are whose walks have been run: one sample, if the walks are those of a sequence.
    pub(crate) fn end(&self, batches: &mut [Batch]) {
        if self.generators.is_sequence() {
            batches.iter_mut().for_each(Batch::become_replicate);
        }
    }

    #[inline(always)]
    fn run_walks(
        &self,
        (own, number): (&Goal<T, WideOf<E>>, u64),
        course: Course<E::Scalar>,
        batches: &mut [Batch],
        at_most: u64,
    ) -> Result<(), NotFinite> {
        let seeds = WalkSeeds::new(self.options.seed, number);
        let mut memory = G::Memory::default();
        let mut left = at_most;
        while left > 0
            && let Some(number) = batches.first().and_then(Batch::next_number)
        {
            let number = (number, &mut memory);
            let score = self.follow(own, &seeds, course, number, &mut ());
            self.push(&score, batches)?;
            left -= 1;
        }
        Ok(())
    }

    /// Adds a walk to the statistics of every channel, and of the sum.
    #[inline(always)]
    pub(crate) fn push(&self, score: &Score<E>, batches: &mut [Batch]) -> Result<(), NotFinite> {
        match batches {
            [only] => only.push(&score.walk_of(0), score.value.get(0), score.known.get(0)),
            _ => self.push_channels(score, batches),
        }
    }

    /// Never inlined: it would be compiled for every end of walks, and equations of one channel have no use for it.
    #[inline(never)]
    fn push_channels(&self, score: &Score<E>, batches: &mut [Batch]) -> Result<(), NotFinite> {
        let channels = self.equation.channels();
        // All are looked at before the first is added to, so that no batch is ahead of another.
        if !score.value.plus(&score.known).is_finite()
            && let Some(batch) = batches.first()
        {
            return Err(batch.not_finite());
        }
        let mut sum = [0.0; 4];
        for (channel, batch) in batches.iter_mut().enumerate() {
            let (scores, value, known);
            if channel < channels {
                let own = score.walk_of(channel);
                (value, known) = (score.value.get(channel), score.known.get(channel));
                scores = Walk {
                    plain: crate::Real::to_f64(own.plain),
                    control: crate::Real::to_f64(own.control),
                    states: own.states,
                    termination: own.termination,
                };
                let weight = self.weights.get(channel).copied().unwrap_or(0.0);
                for (sum, term) in sum
                    .iter_mut()
                    .zip([scores.plain, scores.control, value, known])
                {
                    *sum += weight * term;
                }
            } else {
                let [plain, control, of_v, of_known] = sum;
                (value, known) = (of_v, of_known);
                scores = Walk {
                    plain,
                    control,
                    states: score.walk.states,
                    termination: score.walk.termination,
                };
            }
            batch.push(&scores, value, known)?;
        }
        Ok(())
    }
}

impl<E, N, T, G> Job for Goals<'_, E, N, T, G>
where
    E: Equation + Sync,
    N: NeighbourOf<E> + Sync + ?Sized,
    T: Functional<E> + Sync,
    WideOf<E>: Sync,
    G: Generators,
{
    fn goals(&self) -> usize {
        self.goals.len() * self.statistics()
    }

    fn shared(&self) -> usize {
        self.statistics()
    }

    fn run(&self, first: usize, batches: &mut [Batch], at_most: u64) -> Result<(), NotFinite> {
        let goal = first / self.statistics();
        let Some(own) = self.goals.get(goal) else {
            return Ok(());
        };
        self.run_goal(own, goal as u64, batches, at_most)?;
        self.mark_certain(first, batches);
        Ok(())
    }
}
