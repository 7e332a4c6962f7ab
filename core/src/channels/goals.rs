//! The walks of several channels.

use num_traits::{one, zero};

use super::{ChannelFunctional, ChannelNeighbours, Channels, MOST_CHANNELS};
use crate::rand_core::{Rng, SeedableRng};
use crate::uniforms::ControlDraws;
use crate::{
    Batch, DefaultGenerator, Estimator, Job, Length, Located, NotFinite, Real, RngUniforms,
    Termination, Uniforms, Walk, WalkOptions, WalkSeeds,
};

/// The most functionals that share walks: the channels, and a weighted sum of them.
const MOST_SHARED: usize = MOST_CHANNELS + 1;

/// A functional of the solutions of all channels.
#[derive(Clone, Copy, Debug)]
pub struct ChannelGoal<'a, T> {
    /// Where walks start, and what is estimated.
    pub functional: T,
    /// (v_c, Φ) of every channel, exact, without what is known; `None`: walk by walk.
    pub control_means: Option<&'a [f64]>,
    /// What is known of (u_c, Φ) besides what walks estimate: for every channel a number, the same for all walks. None: 0.
    pub known: &'a [f64],
}

/// The job of several channels: of every goal one functional for each channel and, if there are weights, one for the weighted
/// sum of all.
///
/// Goal g of C channels has the numbers g C + c, or g (C + 1) + c with a sum, which comes last. The functionals of a goal
/// share their walks, whose draws are those of [`WalkSeeds`] number g.
///
/// ```
/// use fredholm_core::channels::{ChannelGoal, ChannelGoals, Channels, NothingKnown};
/// use fredholm_core::{At, Batch, Job, Kernel, NoNeighbour, Sampler, StateSpace, Uniforms, WalkOptions};
///
/// /// u_c = r_c ∫ u_c dy + 1 on [0, 1], with r = (½, ¼): u = (2, 4/3).
/// struct Two;
///
/// impl StateSpace for Two {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl Sampler for Two {
///     fn absorption(&self, _: &f64) -> f64 {
///         0.5
///     }
///     fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
///         Some(uniforms.uniform())
///     }
/// }
/// impl Kernel for Two {
///     fn kernel(&self, _: &f64, _: &f64) -> f64 {
///         1.0 / 0.5
///     }
/// }
/// impl Channels for Two {
///     fn channels(&self) -> usize {
///         2
///     }
///     fn factors(&self, _: &f64, factors: &mut [f64]) {
///         factors.copy_from_slice(&[0.5, 0.25]);
///     }
///     fn sample_sources<U: Uniforms<f64>>(&self, _: &f64, _: &mut U, sources: &mut [f64]) {
///         sources.fill(1.0);
///     }
/// }
///
/// let goal = ChannelGoal { functional: NothingKnown(At(0.3)), control_means: Some(&[0.0, 0.0]), known: &[] };
/// let job = ChannelGoals {
///     equations: &Two,
///     neighbours: &NoNeighbour::<Two>::new(),
///     goals: &[goal],
///     weights: &[1.0, 1.0],
///     options: WalkOptions::default(),
/// };
/// // Both channels and their sum, from the same walks.
/// let mut batches = [Batch::new(0, 10_000, 10_000); 3];
/// job.run_shared(0, &mut batches, u64::MAX)?;
/// for (batch, exact) in batches.iter().zip([2.0, 4.0 / 3.0, 10.0 / 3.0]) {
///     let plain = batch.statistics().plain();
///     // The first one is 2 in every walk.
///     assert!((plain.estimate - exact).abs() <= 5.0 * plain.std_error.unwrap());
/// }
/// # Ok::<(), fredholm_core::NotFinite>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ChannelGoals<'a, E, N: ?Sized, T> {
    /// The equations and their chain.
    pub equations: &'a E,
    /// The neighbour equations.
    pub neighbours: &'a N,
    /// The goals.
    pub goals: &'a [ChannelGoal<'a, T>],
    /// The weights of the sum, one for every channel; none for no sum.
    pub weights: &'a [f64],
    /// Seed, estimator, survivals and step limit. The form makes no difference, as h = k.
    pub options: WalkOptions,
}

/// The channels that have small arrays of their own, red, green and blue among them: to fill those of the most takes longer than
/// some walks.
const FEW_CHANNELS: usize = 4;

/// One number for every channel, of which there are `M` at most.
type PerChannel<F, const M: usize> = [F; M];

/// The scores of a walk in every channel.
struct Scores<F, const M: usize> {
    plain: PerChannel<F, M>,
    control: PerChannel<F, M>,
    states: u32,
    termination: Termination,
}

/// The weights of a state, and room for what is scored there.
struct Weights<F, const M: usize> {
    k: PerChannel<F, M>,
    sources: PerChannel<F, M>,
    controls: PerChannel<F, M>,
    factors: PerChannel<F, M>,
}

/// The first numbers, one for every channel.
#[inline(always)]
fn own<F, const M: usize>(all: &mut PerChannel<F, M>, channels: usize) -> &mut [F] {
    all.get_mut(..channels).unwrap_or(&mut [])
}

impl<E, N, T> ChannelGoals<'_, E, N, T>
where
    E: Channels,
    N: ChannelNeighbours<Scalar = E::Scalar, Point = E::Point> + ?Sized,
    T: ChannelFunctional<E>,
{
    /// C, which slices are made for.
    fn channels(&self) -> usize {
        self.equations.channels().min(MOST_CHANNELS)
    }

    /// Scores a state in every channel, times `per`.
    #[inline(always)]
    fn score<U: Uniforms<E::Scalar>, const M: usize>(
        &self,
        x: &Located<E::Point>,
        (uniforms, draws): (&mut U, &mut dyn Uniforms<E::Scalar>),
        per: E::Scalar,
        (weights, scores): (&mut Weights<E::Scalar, M>, &mut Scores<E::Scalar, M>),
    ) {
        let channels = self.channels();
        let sources = own(&mut weights.sources, channels);
        self.equations.sample_sources(&x.point, uniforms, sources);
        let controls = own(&mut weights.controls, channels);
        self.neighbours.sources(x, draws, controls);
        let k = weights.k.iter().take(channels);
        let all = k.zip(sources.iter().zip(controls.iter()));
        let to = scores.plain.iter_mut().zip(&mut scores.control);
        for ((&k, (&f, &g)), (plain, control)) in all.zip(to) {
            *plain += k * f * per;
            *control += k * g * per;
        }
    }

    /// Follows one walk from x0 with weight φ(x0): [`walk`](crate::walk) in every channel.
    #[inline(always)]
    fn walk<U: Uniforms<E::Scalar>, const M: usize>(
        &self,
        (x0, phi): (Located<E::Point>, E::Scalar),
        estimator: Estimator,
        length: &Length,
        uniforms: &mut U,
        draws: &mut dyn Uniforms<E::Scalar>,
    ) -> Scores<E::Scalar, M> {
        let nothing = || [zero::<E::Scalar>(); M];
        let channels = self.channels();
        let mut scores = Scores {
            plain: nothing(),
            control: nothing(),
            states: 0,
            termination: Termination::StepLimit,
        };
        let mut weights = Weights {
            k: [phi; M],
            sources: nothing(),
            controls: nothing(),
            factors: nothing(),
        };
        let mut x = x0;
        while scores.states < length.step_limit {
            scores.states += 1;
            let survives = scores.states <= length.survivals;
            if estimator == Estimator::Collision || survives {
                let to = (&mut weights, &mut scores);
                self.score(&x, (&mut *uniforms, &mut *draws), one(), to);
            }
            let q = self.equations.absorption(&x.point);
            let mut kept = one::<E::Scalar>();
            if survives {
                kept = one::<E::Scalar>() - q;
                if !(kept > zero()) {
                    scores.termination = Termination::Absorbed;
                    break;
                }
            } else if uniforms.uniform() < q {
                if estimator == Estimator::Absorption {
                    let to = (&mut weights, &mut scores);
                    self.score(
                        &x,
                        (&mut *uniforms, &mut *draws),
                        one::<E::Scalar>() / q,
                        to,
                    );
                }
                scores.termination = Termination::Absorbed;
                break;
            }
            let Some(next) = self.equations.step(&x.point, uniforms) else {
                scores.termination = Termination::Left;
                break;
            };
            let y = self.neighbours.locate(next);
            let k = kept * self.equations.kernel(&x.point, &y.point);
            let factors = own(&mut weights.factors, channels);
            self.equations.factors(&x.point, factors);
            for (weight, &factor) in weights.k.iter_mut().zip(factors.iter()) {
                *weight *= factor * k;
            }
            x = y;
        }
        scores
    }
}

impl<E, N, T> ChannelGoals<'_, E, N, T>
where
    E: Channels,
    N: ChannelNeighbours<Scalar = E::Scalar, Point = E::Point> + ?Sized,
    T: ChannelFunctional<E>,
{
    /// Runs at most `at_most` further walks of a goal, with the draws of [`WalkSeeds`] number `number`. Each of them is a walk
    /// of every batch: one for each channel and, with weights, one for the sum. All have the same walks so far.
    ///
    /// # Errors
    /// [`NotFinite`].
    pub fn run_goal(
        &self,
        goal: &ChannelGoal<'_, T>,
        number: u64,
        batches: &mut [Batch],
        at_most: u64,
    ) -> Result<(), NotFinite> {
        let seeds = WalkSeeds::<DefaultGenerator>::new(self.options.seed, number);
        if self.channels() <= FEW_CHANNELS {
            self.run_by_estimator::<FEW_CHANNELS>(goal, &seeds, batches, at_most)
        } else {
            self.run_by_estimator::<MOST_CHANNELS>(goal, &seeds, batches, at_most)
        }
    }

    #[inline(always)]
    fn run_by_estimator<const M: usize>(
        &self,
        goal: &ChannelGoal<'_, T>,
        seeds: &WalkSeeds<DefaultGenerator>,
        batches: &mut [Batch],
        at_most: u64,
    ) -> Result<(), NotFinite> {
        // The estimator is a constant within each arm, so no walk asks for it.
        match self.options.estimator {
            Estimator::Absorption => {
                self.run_walks::<_, M>(goal, seeds, Estimator::Absorption, batches, at_most)
            }
            Estimator::Collision => {
                self.run_walks::<_, M>(goal, seeds, Estimator::Collision, batches, at_most)
            }
        }
    }

    #[inline(always)]
    fn run_walks<G: Rng + SeedableRng, const M: usize>(
        &self,
        goal: &ChannelGoal<'_, T>,
        seeds: &WalkSeeds<G>,
        estimator: Estimator,
        batches: &mut [Batch],
        at_most: u64,
    ) -> Result<(), NotFinite> {
        let length = self.options.length();
        let mut left = at_most;
        while left > 0
            && let Some(number) = batches.first().and_then(Batch::next_walk)
        {
            let mut uniforms = RngUniforms(seeds.generator(number));
            let mut draws = ControlDraws::<G>::new(seeds, number);
            let mut known = [zero::<E::Scalar>(); M];
            let of_start = own(&mut known, self.channels());
            let (start, phi) = goal
                .functional
                .start(self.equations, &mut uniforms, of_start);
            let x0 = self.neighbours.locate(start);
            let mut parts = self.parts::<M>(goal, &x0, phi, of_start);
            if goal.control_means.is_none() {
                self.look_around(goal, &mut draws, &mut parts[0]);
            }
            let scores =
                self.walk::<_, M>((x0, phi), estimator, &length, &mut uniforms, &mut draws);
            self.push(&scores, &parts, batches)?;
            left -= 1;
        }
        Ok(())
    }

    /// (v_c, Φ) or the start's own part of it, and what is known besides, of every channel.
    #[inline(always)]
    fn parts<const M: usize>(
        &self,
        goal: &ChannelGoal<'_, T>,
        x0: &Located<E::Point>,
        phi: E::Scalar,
        of_start: &[E::Scalar],
    ) -> [PerChannel<f64, M>; 2] {
        let channels = self.channels();
        let (mut values, mut known) = ([0.0; M], [0.0; M]);
        match goal.control_means {
            Some(means) => values.iter_mut().zip(means).for_each(|(to, &v)| *to = v),
            None => {
                let mut numbers = [zero::<E::Scalar>(); M];
                self.neighbours.values(x0, own(&mut numbers, channels));
                for (to, &v) in values.iter_mut().zip(&numbers).take(channels) {
                    *to = (phi * v).to_f64();
                }
            }
        }
        known
            .iter_mut()
            .zip(goal.known)
            .for_each(|(to, &part)| *to = part);
        for (to, &part) in known.iter_mut().zip(of_start) {
            *to += (phi * part).to_f64();
        }
        [values, known]
    }

    /// Makes φ v of a start the mean of as many looks as the functional takes.
    fn look_around<U: Uniforms<E::Scalar>, const M: usize>(
        &self,
        goal: &ChannelGoal<'_, T>,
        draws: &mut U,
        values: &mut PerChannel<f64, M>,
    ) {
        let (channels, looks) = (self.channels(), goal.functional.looks());
        let mut numbers = [zero::<E::Scalar>(); M];
        for _ in 1..looks {
            let (x, phi) = goal.functional.look(self.equations, draws);
            let x = self.neighbours.locate(x);
            self.neighbours.values(&x, own(&mut numbers, channels));
            for (value, &v) in values.iter_mut().zip(&numbers).take(channels) {
                *value += (phi * v).to_f64();
            }
        }
        let per_look = 1.0 / f64::from(looks.max(1));
        values.iter_mut().for_each(|value| *value *= per_look);
    }

    /// Adds a walk to the statistics of every channel, and of the sum.
    #[inline(always)]
    fn push<const M: usize>(
        &self,
        scores: &Scores<E::Scalar, M>,
        [values, known]: &[PerChannel<f64, M>; 2],
        batches: &mut [Batch],
    ) -> Result<(), NotFinite> {
        let channels = self.channels();
        let walk = |plain: f64, control: f64| Walk {
            plain,
            control,
            states: scores.states,
            // An infinity or NaN in either stays one in the difference.
            termination: if (plain - control).is_finite() {
                scores.termination
            } else {
                Termination::NotFinite
            },
        };
        let mut sum = [0.0; 4];
        let numbers = scores.plain.iter().zip(&scores.control);
        let parts = values.iter().zip(known);
        let (own, rest) = batches.split_at_mut(channels.min(batches.len()));
        // All are looked at before the first is added to, so that no batch is ahead of another.
        let is_finite = |(&p, &g): (&E::Scalar, &E::Scalar)| (p - g).is_finite();
        let is_well = numbers.clone().take(channels).all(is_finite)
            && parts.clone().all(|(v, k)| (v + k).is_finite());
        for (c, (batch, ((&plain, &control), (&value, &known)))) in
            own.iter_mut().zip(numbers.zip(parts)).enumerate()
        {
            if !is_well {
                return Err(batch.not_finite());
            }
            let (plain, control) = (plain.to_f64(), control.to_f64());
            batch.push(&walk(plain, control), value, known)?;
            let weight = self.weights.get(c).copied().unwrap_or(0.0);
            for (sum, term) in sum.iter_mut().zip([plain, control, value, known]) {
                *sum += weight * term;
            }
        }
        let [plain, control, value, known] = sum;
        rest.iter_mut()
            .try_for_each(|batch| batch.push(&walk(plain, control), value, known))
    }
}

impl<E, N, T> Job for ChannelGoals<'_, E, N, T>
where
    E: Channels + Sync,
    N: ChannelNeighbours<Scalar = E::Scalar, Point = E::Point> + Sync + ?Sized,
    T: ChannelFunctional<E> + Sync,
{
    fn goals(&self) -> usize {
        self.goals.len() * self.shared()
    }

    fn shared(&self) -> usize {
        self.channels() + usize::from(!self.weights.is_empty())
    }

    /// Runs the walks for the sake of one channel alone.
    fn run(&self, goal: usize, batch: &mut Batch, at_most: u64) -> Result<(), NotFinite> {
        let shared = self.shared();
        let mut all = [*batch; MOST_SHARED];
        let batches = all.get_mut(..shared).unwrap_or(&mut []);
        let outcome = self.run_shared(goal - goal % shared, batches, at_most);
        if let Some(own) = batches.get(goal % shared) {
            *batch = *own;
        }
        outcome
    }

    fn run_shared(
        &self,
        first: usize,
        batches: &mut [Batch],
        at_most: u64,
    ) -> Result<(), NotFinite> {
        let number = first / self.shared();
        match self.goals.get(number) {
            Some(goal) => self.run_goal(goal, number as u64, batches, at_most),
            None => Ok(()),
        }
    }
}
