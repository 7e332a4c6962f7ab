//! Several equations on one chain: colours, or bands of wavelengths.
//!
//! The equations of C channels differ in the sizes of kernel and source alone,
//!
//! ```text
//! u_c(x) = r_c(x) ∫ K(x, y) u_c(y) dμ(y) + F_c(x),    c = 0, …, C − 1,
//! ```
//!
//! so that one walk serves all of them: its steps have the density p whatever the channel, and its weights are
//! W_c = φ(x0) r_c(x0) k(x0, x1) … r_c(x_{l−1}) k(x_{l−1}, x_l). The neighbour equations are such that h_c = k_c,
//! v_c = T_kc v_c + G_c, and share the draws of G. A step is made once, and what a further channel takes are some products.
//!
//! Heinrich 1995, section 5, treats colours "by superposition": as many runs. Scores of a walk in several channels depend on
//! each other, so that errors of a sum of channels do not follow from those of the channels. A weighted sum is a
//! functional more, with statistics of its own: luminance, or the flux of all bands.

use num_traits::{one, zero};

use crate::rand_core::{Rng, SeedableRng};
use crate::uniforms::ControlDraws;
use crate::{
    Batch, DefaultGenerator, Estimator, Functional, Job, Kernel, Length, Located, NoNeighbour,
    NotFinite, Real, RngUniforms, Sampler, StateSpace, Termination, Uniforms, Walk, WalkOptions,
    WalkSeeds,
};

/// The most channels of a walk.
pub const MOST_CHANNELS: usize = 128;

/// The most functionals that share walks: the channels, and a weighted sum of them.
const MOST_SHARED: usize = MOST_CHANNELS + 1;

/// Equations on one chain: the chain and the kernel that all share, and what of each channel is its own.
///
/// What is written goes into slices of as many numbers as there are channels.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no channels",
    label = "`Channels` is missing",
    note = "implement `Channels`: the factors r_c(x) of the kernel, and the sources F_c(x)"
)]
pub trait Channels: Sampler + Kernel {
    /// C, from 1 to [`MOST_CHANNELS`].
    fn channels(&self) -> usize;

    /// r_c(x) of every channel: K_c(x, y) = r_c(x) K(x, y).
    fn factors(&self, x: &Self::Point, factors: &mut [Self::Scalar]);

    /// Random numbers whose means are F_c(x), or what of it walks score where they meet it.
    fn sample_sources<U: Uniforms<Self::Scalar>>(
        &self,
        x: &Self::Point,
        uniforms: &mut U,
        sources: &mut [Self::Scalar],
    );
}

/// A functional of the solutions of all channels: where walks start, and what each start knows besides.
pub trait ChannelFunctional<E: Channels> {
    /// A point x0 with density p0, and φ(x0), as [`Functional::start`] has them. Writes, for every channel, a random number: what
    /// the start adds to what the walk scores, over φ(x0). It is the part of the functional that no state scores, as where a
    /// last step leads to it.
    fn start<U: Uniforms<E::Scalar>>(
        &self,
        equations: &E,
        uniforms: &mut U,
        known: &mut [E::Scalar],
    ) -> (E::Point, E::Scalar);

    /// A further point with density p0, and φ there, for [`looks`](Self::looks): a start without what it knows.
    fn look<U: Uniforms<E::Scalar>>(
        &self,
        equations: &E,
        uniforms: &mut U,
    ) -> (E::Point, E::Scalar) {
        let mut known = [zero(); MOST_CHANNELS];
        let known = own(&mut known, equations.channels().min(MOST_CHANNELS));
        self.start(equations, uniforms, known)
    }

    /// The number of points by which a walk estimates (v, Φ) where that is not known: its start, and further ones. The more,
    /// the less of φ v's own variance is left in that of ζ.
    fn looks(&self) -> u32 {
        1
    }
}

impl<E: Channels, T: ChannelFunctional<E>> ChannelFunctional<E> for &T {
    #[inline]
    fn start<U: Uniforms<E::Scalar>>(
        &self,
        equations: &E,
        uniforms: &mut U,
        known: &mut [E::Scalar],
    ) -> (E::Point, E::Scalar) {
        (**self).start(equations, uniforms, known)
    }

    #[inline]
    fn look<U: Uniforms<E::Scalar>>(
        &self,
        equations: &E,
        uniforms: &mut U,
    ) -> (E::Point, E::Scalar) {
        (**self).look(equations, uniforms)
    }

    #[inline]
    fn looks(&self) -> u32 {
        (**self).looks()
    }
}

/// A functional whose starts know nothing besides.
#[derive(Clone, Copy, Debug)]
pub struct NothingKnown<T>(pub T);

impl<E: Channels, T: Functional<E>> ChannelFunctional<E> for NothingKnown<T> {
    #[inline]
    fn start<U: Uniforms<E::Scalar>>(
        &self,
        _: &E,
        uniforms: &mut U,
        known: &mut [E::Scalar],
    ) -> (E::Point, E::Scalar) {
        known.fill(zero());
        self.0.start(uniforms)
    }
}

/// Neighbour equations v_c = T_kc v_c + G_c of every channel, which hold exactly, on one partition.
///
/// What is written goes into slices of as many numbers as there are channels.
pub trait ChannelNeighbours: StateSpace {
    /// Finds the cell of `x`.
    fn locate(&self, x: Self::Point) -> Located<Self::Point>;

    /// G_c(x), or random numbers with these means, which all may depend on the same `draws`.
    fn sources(
        &self,
        x: &Located<Self::Point>,
        draws: &mut dyn Uniforms<Self::Scalar>,
        sources: &mut [Self::Scalar],
    );

    /// v_c(x).
    fn values(&self, x: &Located<Self::Point>, values: &mut [Self::Scalar]);
}

/// v = 0 in every channel: the walks are plain.
impl<E: StateSpace> ChannelNeighbours for NoNeighbour<E> {
    #[inline]
    fn locate(&self, x: E::Point) -> Located<E::Point> {
        Located { point: x, cell: 0 }
    }

    #[inline]
    fn sources(
        &self,
        _: &Located<E::Point>,
        _: &mut dyn Uniforms<E::Scalar>,
        sources: &mut [E::Scalar],
    ) {
        sources.fill(zero());
    }

    #[inline]
    fn values(&self, _: &Located<E::Point>, values: &mut [E::Scalar]) {
        values.fill(zero());
    }
}

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

/// One number for every channel.
type PerChannel<F> = [F; MOST_CHANNELS];

/// The scores of a walk in every channel.
struct Scores<F> {
    plain: PerChannel<F>,
    control: PerChannel<F>,
    states: u32,
    termination: Termination,
}

/// The weights of a state, and room for what is scored there.
struct Weights<F> {
    k: PerChannel<F>,
    sources: PerChannel<F>,
    controls: PerChannel<F>,
    factors: PerChannel<F>,
}

/// The first numbers, one for every channel.
#[inline(always)]
fn own<F>(all: &mut PerChannel<F>, channels: usize) -> &mut [F] {
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
    fn score<U: Uniforms<E::Scalar>>(
        &self,
        x: &Located<E::Point>,
        (uniforms, draws): (&mut U, &mut dyn Uniforms<E::Scalar>),
        per: E::Scalar,
        (weights, scores): (&mut Weights<E::Scalar>, &mut Scores<E::Scalar>),
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
    fn walk<U: Uniforms<E::Scalar>>(
        &self,
        (x0, phi): (Located<E::Point>, E::Scalar),
        estimator: Estimator,
        length: &Length,
        uniforms: &mut U,
        draws: &mut dyn Uniforms<E::Scalar>,
    ) -> Scores<E::Scalar> {
        let nothing = || [zero::<E::Scalar>(); MOST_CHANNELS];
        let channels = self.channels();
        let mut scores = Scores {
            plain: nothing(),
            control: nothing(),
            states: 0,
            termination: Termination::StepLimit,
        };
        let mut weights = Weights {
            k: [phi; MOST_CHANNELS],
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
        // The estimator is a constant within each arm, so no walk asks for it.
        match self.options.estimator {
            Estimator::Absorption => {
                self.run_walks(goal, &seeds, Estimator::Absorption, batches, at_most)
            }
            Estimator::Collision => {
                self.run_walks(goal, &seeds, Estimator::Collision, batches, at_most)
            }
        }
    }

    #[inline(always)]
    fn run_walks<G: Rng + SeedableRng>(
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
            let mut known = [zero::<E::Scalar>(); MOST_CHANNELS];
            let of_start = own(&mut known, self.channels());
            let (start, phi) = goal
                .functional
                .start(self.equations, &mut uniforms, of_start);
            let x0 = self.neighbours.locate(start);
            let mut parts = self.parts(goal, &x0, phi, of_start);
            if goal.control_means.is_none() {
                self.look_around(goal, &mut draws, &mut parts[0]);
            }
            let scores = self.walk((x0, phi), estimator, &length, &mut uniforms, &mut draws);
            self.push(&scores, &parts, batches)?;
            left -= 1;
        }
        Ok(())
    }

    /// (v_c, Φ) or the start's own part of it, and what is known besides, of every channel.
    #[inline(always)]
    fn parts(
        &self,
        goal: &ChannelGoal<'_, T>,
        x0: &Located<E::Point>,
        phi: E::Scalar,
        of_start: &[E::Scalar],
    ) -> [PerChannel<f64>; 2] {
        let channels = self.channels();
        let (mut values, mut known) = ([0.0; MOST_CHANNELS], [0.0; MOST_CHANNELS]);
        match goal.control_means {
            Some(means) => values.iter_mut().zip(means).for_each(|(to, &v)| *to = v),
            None => {
                let mut numbers = [zero::<E::Scalar>(); MOST_CHANNELS];
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
    fn look_around<U: Uniforms<E::Scalar>>(
        &self,
        goal: &ChannelGoal<'_, T>,
        draws: &mut U,
        values: &mut PerChannel<f64>,
    ) {
        let (channels, looks) = (self.channels(), goal.functional.looks());
        let mut numbers = [zero::<E::Scalar>(); MOST_CHANNELS];
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
    fn push(
        &self,
        scores: &Scores<E::Scalar>,
        [values, known]: &[PerChannel<f64>; 2],
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

#[cfg(test)]
mod tests;
