//! The walks of a global estimate.

use super::suffixes::Trail;
use super::{Normalisation, Replicate, Scores, Stationary};
use crate::uniforms::ControlDraws;
use crate::walk::{Course, Followed};
use crate::{
    Equation, Generators, Independent, Located, NeighbourOf, NoDraws, NotFinite, Real, RngUniforms,
    Termination, Value, WalkNumber, WalkOptions, WalkSeeds,
};

/// The number in place of a goal's that draws of a global estimate have: those of no goal.
pub const GLOBAL: u64 = u64::MAX;

/// The default of the number of states that are kept of a walk: with an absorption of a tenth, 3 % of walks have more.
pub const KEPT_STATES: usize = 32;

/// The walks of a global estimate, without any type of the problem: the seam between runners and problems. It is object
/// safe.
pub trait GlobalJob: Sync {
    /// The number of sums of a replicate.
    fn unknowns(&self) -> usize;

    /// What makes coefficients of sums.
    fn normalisation(&self) -> Normalisation;

    /// The coefficients that are known beforehand, to which those of walks are added: as many as there are sums, or none.
    fn known(&self) -> &[f64];

    /// Runs at most `at_most` further walks of a replicate.
    ///
    /// # Errors
    /// [`NotFinite`]: a walk scored an infinity or NaN. It is not in the sums; the replicate stands before it.
    fn run(&self, replicate: &mut Replicate<'_>, at_most: u64) -> Result<(), NotFinite>;
}

/// Equation, starts, neighbour equation, scored functions and seeds: everything that the walks of a global estimate depend on.
///
/// N = `KEPT` states of a walk are kept, or one where the density of further states is not known, as with roulette, or where forced
/// steps serve a [Sobol'](crate::Sequence) sequence: see the [module](super) for why they are the first ones. The sums of several channels stand one after the other.
///
/// ```
/// use fredholm_core::galerkin::{Basis, Cells};
/// use fredholm_core::global::*;
/// use fredholm_core::*;
///
/// /// u(x) = ½ ∫ u dy + ¾ on [0, 1), of which the solution is 3/2, in one cell.
/// struct Half;
/// impl Space for Half {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl Chain for Half {
///     fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
///         Some(uniforms.uniform())
///     }
/// }
/// impl Equation for Half {
///     type Value = f64;
///     fn kernel(&self, _: &f64, _: &f64) -> f64 {
///         0.5
///     }
///     fn source<U: Uniforms<f64>>(&self, _: &f64, _: &mut U) -> f64 {
///         0.75
///     }
/// }
/// impl Stationary for Half {
///     fn start<U: Uniforms<f64>>(&self, uniforms: &mut U) -> f64 {
///         uniforms.uniform()
///     }
///     fn start_density(&self, _: &f64) -> f64 {
///         1.0
///     }
///     fn is_preserved(&self) -> bool {
///         true
///     }
/// }
/// # impl Cells for Half {
/// #     const DIMENSION: usize = 1;
/// #     fn cells(&self) -> usize { 1 }
/// #     fn locate(&self, _: &f64) -> usize { 0 }
/// #     fn measure(&self, _: usize) -> f64 { 1.0 }
/// #     fn point(&self, _: usize, t: &[f64]) -> f64 { t[0] }
/// #     fn parameters(&self, x: &Located<f64>, t: &mut [f64]) { t[0] = x.point }
/// #     fn at(&self, x: &[f64]) -> Option<f64> { x.first().copied() }
/// # }
/// # impl Basis for Half {}
///
/// // Without a neighbour equation e is u.
/// let (none, scores) = (NoNeighbour::new(&Half), BasisScores::<_, 1>(&Half));
/// let absorption = Absorption::Constant { probability: 0.5, estimator: Estimator::Collision };
/// let options = WalkOptions { absorption, ..WalkOptions::default() };
/// let task = GlobalTask::new(&Half, &Half, &none, &scores, options);
/// let mut means = [0.0; 16];
/// for (r, mean) in means.iter_mut().enumerate() {
///     let mut sums = [0.0];
///     let mut replicate = Replicate::new(r as u64, 16, ReplicateCounts::default(), &mut sums);
///     task.run(&mut replicate, 1000)?;
///     task.normalisation().fill(&sums, 1000, |_| 1.0, core::slice::from_mut(mean));
/// }
/// let u = over_replicates(&means);
/// assert!((u.mean - 1.5).abs() < 4.0 * u.std_error && u.std_error < 0.03);
/// # Ok::<(), NotFinite>(())
/// ```
#[derive(Debug)]
pub struct GlobalTask<
    'a,
    E,
    T,
    M: ?Sized,
    S: ?Sized,
    G = Independent,
    const KEPT: usize = KEPT_STATES,
> {
    /// The equation and its chain.
    pub equation: &'a E,
    /// Starts of walks.
    pub starts: &'a T,
    /// The neighbour equation.
    pub neighbour: &'a M,
    /// The functions on whose coefficients walks score.
    pub scores: &'a S,
    /// The coefficients of F − G, or none: see [`with_known`](Self::with_known).
    pub known: &'a [f64],
    /// Absorption, form, forced steps and step limit.
    pub options: WalkOptions,
    /// The generators of walks' numbers.
    pub generators: G,
}

impl<'a, E, T, M: ?Sized, S: ?Sized> GlobalTask<'a, E, T, M, S> {
    /// The task of walks with these options.
    #[must_use]
    pub const fn new(
        equation: &'a E,
        starts: &'a T,
        neighbour: &'a M,
        scores: &'a S,
        options: WalkOptions,
    ) -> Self {
        Self {
            equation,
            starts,
            neighbour,
            scores,
            known: &[],
            options,
            generators: Independent::NEW,
        }
    }
}

impl<'a, E, T, M: ?Sized, S: ?Sized, G: Copy, const KEPT: usize>
    GlobalTask<'a, E, T, M, S, G, KEPT>
{
    /// The task that leaves out of its scores what is known: the coefficients of F − G, by quadrature. Walks score F − G less its piecewise
    /// polynomial, which is added to the result: an approximation of it costs variance alone.
    #[must_use]
    pub const fn with_known(&self, known: &'a [f64]) -> Self {
        Self {
            known,
            ..self.with_generators(self.generators)
        }
    }

    /// The task with numbers of other generators, such as those of a [`Sequence`](crate::Sequence).
    #[must_use]
    pub const fn with_generators<H>(&self, generators: H) -> GlobalTask<'a, E, T, M, S, H, KEPT> {
        GlobalTask {
            equation: self.equation,
            starts: self.starts,
            neighbour: self.neighbour,
            scores: self.scores,
            known: self.known,
            options: self.options,
            generators,
        }
    }
}

impl<E, T, M, S, G, const KEPT: usize> GlobalTask<'_, E, T, M, S, G, KEPT>
where
    E: Equation,
    T: Stationary<E>,
    M: ?Sized,
    S: ?Sized,
    G: Generators,
{
    /// The probability that a walk goes on, if its states are scored, as they have the density of its starts times a power of that.
    ///
    /// Of a sequence that forced steps serve, starts alone are scored: further states draw from further coordinates, and have fewer
    /// forced steps left, which costs more than they bring.
    fn survival(&self) -> Option<f64> {
        let is_smooth = self.generators.is_sequence() && self.options.forced_steps > 0;
        let is_scored = self.starts.is_preserved() && !is_smooth;
        let q = self.options.absorption.probability();
        q.filter(|_| is_scored).map(|q| 1.0 - q)
    }

    /// The number of states that are kept.
    fn kept(&self) -> usize {
        let most = usize::try_from(self.options.step_limit).unwrap_or(usize::MAX);
        self.survival().map_or(1, |_| KEPT.min(most))
    }

    /// S_N: the expected number of kept states of a walk. Forced steps absorb nothing.
    fn states_scored(&self) -> f64 {
        let Some(survival) = self.survival() else {
            return 1.0;
        };
        let forced = self.options.forced_steps as usize;
        let (mut sum, mut alive) = (0.0, 1.0);
        for state in 0..self.kept() {
            sum += alive;
            if state >= forced {
                alive *= survival;
            }
        }
        sum
    }
}

impl<E, T, M, S, G, const KEPT: usize> GlobalTask<'_, E, T, M, S, G, KEPT>
where
    E: Equation,
    M: NeighbourOf<E> + ?Sized,
    S: ?Sized,
{
    /// A point with its cell, and F − G there; NaN where either is drawn.
    pub fn first(&self, x: E::Point) -> (Located<E::Point>, E::Value) {
        let x = self.neighbour.locate(x);
        let source = self.equation.source(&x.point, &mut NoDraws);
        let control = self.neighbour.source(&x, &mut NoDraws);
        (x, source.minus(&control))
    }
}

impl<E, T, M, S, G, const KEPT: usize> GlobalTask<'_, E, T, M, S, G, KEPT>
where
    E: Equation,
    T: Stationary<E>,
    M: NeighbourOf<E> + ?Sized,
    S: Scores<E::Point> + ?Sized,
    G: Generators,
{
    #[inline(always)]
    fn run_walks(
        &self,
        course: Course<E::Scalar>,
        replicate: &mut Replicate<'_>,
        at_most: u64,
    ) -> Result<(), NotFinite> {
        const { assert!(KEPT > 0, "a walk of which no state is kept scores nothing") }
        let mut trail: Option<Trail<E::Point, E::Scalar, E::Value, KEPT>> = None;
        let (kept, channels) = (self.kept(), self.equation.channels());
        let followed = Followed {
            equation: self.equation,
            neighbour: self.neighbour,
            form: self.options.form,
            length: self.options.length(),
        };
        let seeds = WalkSeeds::new(self.options.seed, GLOBAL);
        let mut memory = G::Memory::default();
        let end = replicate.counts.walks.saturating_add(at_most);
        while replicate.counts.walks < end {
            let number = replicate.next_walk();
            let place = WalkNumber {
                walk: number,
                replicate: replicate.number(),
                index: replicate.counts.walks,
            };
            let mut draws = RngUniforms(self.generators.generator(&seeds, place, &mut memory));
            let mut control_draws = ControlDraws::<G::Random>::new(&seeds, number);
            let x0 = self.neighbour.locate(self.starts.start(&mut draws));
            let trail = trail.get_or_insert_with(|| Trail::new(x0, channels, kept));
            trail.begin();
            let (states, termination) =
                followed.walk(x0, course, &mut draws, &mut control_draws, trail);
            if !trail.finish() {
                return Err(NotFinite { walk: number });
            }
            for scored in trail.iter() {
                self.add(&scored, replicate.sums);
            }
            let counts = &mut replicate.counts;
            counts.walks += 1;
            counts.states += u64::from(states);
            match termination {
                Termination::Absorbed | Termination::NotFinite => {}
                Termination::Left => counts.left += 1,
                Termination::StepLimit => counts.step_limit += 1,
            }
            counts.scored += u64::from(trail.has_scored());
        }
        Ok(())
    }

    /// Adds what a state scores to the sums of every channel.
    #[inline(always)]
    fn add(
        &self,
        scored: &super::suffixes::Scored<'_, E::Point, E::Scalar, E::Value>,
        sums: &mut [f64],
    ) {
        let per_density = 1.0 / self.starts.start_density(&scored.x.point);
        let share = scored.share.to_f64();
        let unknowns = self.scores.unknowns();
        for channel in 0..scored.difference.channels() {
            let mut score = scored.difference.get(channel).to_f64();
            let from = channel * unknowns;
            if share != 0.0 && !self.known.is_empty() {
                let known = self.known.get(from..).unwrap_or(&[]);
                score -= share * self.scores.value(scored.x, known);
            }
            let sums = sums.get_mut(from..from + unknowns).unwrap_or(&mut []);
            self.scores.add(scored.x, score * per_density, sums);
        }
    }
}

impl<E, T, M, S, G, const KEPT: usize> GlobalJob for GlobalTask<'_, E, T, M, S, G, KEPT>
where
    E: Equation + Sync,
    T: Stationary<E> + Sync,
    M: NeighbourOf<E> + Sync + ?Sized,
    S: Scores<E::Point> + Sync + ?Sized,
    G: Generators,
{
    fn unknowns(&self) -> usize {
        self.equation.channels() * self.scores.unknowns()
    }

    fn normalisation(&self) -> Normalisation {
        Normalisation {
            functions: self.scores.functions(),
            cells: self.scores.unknowns() / self.scores.functions().max(1),
            states_scored: self.states_scored(),
        }
    }

    fn known(&self) -> &[f64] {
        self.known
    }

    fn run(&self, replicate: &mut Replicate<'_>, at_most: u64) -> Result<(), NotFinite> {
        match Course::of(self.options.absorption) {
            course if !G::ONE_LOOP_PER_END => self.run_walks(course, replicate, at_most),
            // A constant in its loop over walks.
            Course::Roulette => self.run_walks(Course::Roulette, replicate, at_most),
            course => self.run_walks(course, replicate, at_most),
        }
    }
}
