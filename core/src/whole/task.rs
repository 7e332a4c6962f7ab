//! The walks of a whole function.

use super::suffixes::Trail;
use super::{Normalisation, Replicate, Scores, Starts};
use crate::{
    DefaultGenerator, Equation, Estimator, Form, Generators, Length, Located, NeighbourOf, NoDraws,
    NotFinite, Real, RngUniforms, StateSpace, Termination, Uniforms, WalkNumber, WalkOptions,
    WalkSeeds, uniforms::ControlDraws,
};

/// The number in place of a goal's that draws of a whole function have: those of no goal.
pub const WHOLE: u64 = u64::MAX;

/// States of a walk that are kept and scored, unless told otherwise. With s = 0.8 walks have 5 states on average, of
/// which the first 32 are all but 0.08 %; with s = 0.95 they have 20, of which they are 81 %.
pub const KEPT_STATES: usize = 32;

/// The walks of a whole function, without any type of the problem: the seam between runners and problems. It is object
/// safe.
pub trait WholeJob: Sync {
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

/// Equation, starts, neighbour equation, scored functions and seeds: everything that the walks of a whole function depend on.
///
/// N = `KEPT` states of a walk are kept, or one where the density of further states is not known or walks are not
/// absorbed in their [first states](crate::WalkOptions::survivals): see the [module](super) for why they are the first ones.
///
/// ```
/// use fredholm_core::galerkin::{Basis, Partition};
/// use fredholm_core::whole::*;
/// use fredholm_core::*;
///
/// /// u(x) = ½ ∫ u dy + ¾ on [0, 1), of which the solution is 3/2, in one cell.
/// struct Half;
/// impl StateSpace for Half {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl Sampler for Half {
///     fn absorption(&self, _: &f64) -> f64 {
///         0.5
///     }
///     fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
///         Some(uniforms.uniform())
///     }
/// }
/// impl Kernel for Half {
///     fn kernel(&self, _: &f64, _: &f64) -> f64 {
///         1.0
///     }
/// }
/// impl Source for Half {
///     fn source(&self, _: &f64) -> f64 {
///         0.75
///     }
/// }
/// impl Starts for Half {
///     fn start<U: Uniforms<f64>>(&self, uniforms: &mut U) -> f64 {
///         uniforms.uniform()
///     }
///     fn start_density(&self, _: &f64) -> f64 {
///         1.0
///     }
///     fn survival(&self) -> Option<f64> {
///         Some(0.5)
///     }
/// }
/// impl Partition for Half {
///     fn cells(&self) -> usize {
///         1
///     }
///     fn locate(&self, _: &f64) -> usize {
///         0
///     }
/// }
/// impl Basis for Half {
///     fn basis(&self, _: &Located<f64>) -> [f64; 1] {
///         [1.0]
///     }
/// }
///
/// // Without a neighbour equation e is u.
/// let (none, scores) = (NoNeighbour::<Half>::new(), BasisScores::<_, 1>(&Half));
/// let options = WalkOptions { estimator: Estimator::Collision, ..WalkOptions::default() };
/// let task = WholeTask::new(&Half, &Half, &none, &scores, options);
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
pub struct WholeTask<
    'a,
    E,
    T,
    M: ?Sized,
    S: ?Sized,
    G = DefaultGenerator,
    const KEPT: usize = KEPT_STATES,
> {
    /// The equation and its chain.
    pub equation: &'a E,
    /// The starts of walks: most often the equation itself.
    pub starts: &'a T,
    /// The neighbour equation.
    pub neighbour: &'a M,
    /// The functions whose coefficients are scored.
    pub scores: &'a S,
    /// The coefficients of a function w near F − G: walks score what is left of it. None at all: w = 0.
    pub known: &'a [f64],
    /// The estimator: what a walk scores.
    pub estimator: Estimator,
    /// The form of the control variate.
    pub form: Form,
    /// The seeds of the walks' generators.
    pub seeds: WalkSeeds<G>,
    /// How long walks are followed.
    pub length: Length,
}

impl<'a, E, T, M: ?Sized, S: ?Sized> WholeTask<'a, E, T, M, S> {
    /// The walks with these options, with draws of the [`DefaultGenerator`].
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
            estimator: options.estimator,
            form: options.form,
            seeds: WalkSeeds::new(options.seed, WHOLE),
            length: options.length(),
        }
    }
}

impl<'a, E, T, M: ?Sized, S: ?Sized, G, const KEPT: usize> WholeTask<'a, E, T, M, S, G, KEPT> {
    /// These walks, of which this much is [known](WholeJob::known): the coefficients of any function w, which cancel in the mean. The
    /// nearer w is to F − G, the less the scores vary.
    #[must_use]
    pub const fn with_known(&self, known: &'a [f64]) -> Self {
        Self {
            known,
            ..self.with_generator()
        }
    }

    /// These walks with draws of another generator, which is part of what bits depend on.
    #[must_use]
    pub const fn with_generator<H>(&self) -> WholeTask<'a, E, T, M, S, H, KEPT> {
        WholeTask {
            equation: self.equation,
            starts: self.starts,
            neighbour: self.neighbour,
            scores: self.scores,
            known: self.known,
            estimator: self.estimator,
            form: self.form,
            seeds: self.seeds.with_generator(),
            length: self.length,
        }
    }
}

impl<E, T, M, S, G, const KEPT: usize> WholeTask<'_, E, T, M, S, G, KEPT>
where
    E: StateSpace,
    T: Starts<E>,
    M: ?Sized,
    S: ?Sized,
{
    /// N, the number of states that are kept if the density of these states is known.
    fn most_kept(&self) -> usize {
        KEPT.min(usize::try_from(self.length.step_limit).unwrap_or(usize::MAX))
    }

    /// s, where all kept states have the density of the starts.
    pub(super) fn preserved(&self) -> Option<f64> {
        // Where absorption begins late, the chain keeps the density of a constant q alone, and states do not become fewer.
        let is_absorbed = self.length.survivals == 0;
        self.starts.survival().filter(|_| is_absorbed)
    }

    /// The number of states that are kept, of walks with such a start.
    fn kept(&self, start: &E::Point) -> usize {
        let most = self.most_kept();
        let is_known = || self.starts.density_of_states(start, most).is_some();
        let is_kept = self.preserved().is_some() || self.length.survivals == 0 && is_known();
        if is_kept { most } else { 1 }
    }

    /// S_N = 1 + s + … + s^(N−1), by which sums of a preserved density are divided.
    fn states_scored(&self) -> f64 {
        self.preserved().map_or(1.0, |s| {
            (0..self.most_kept()).fold(0.0, |sum, _| 1.0 + s * sum)
        })
    }
}

impl<E, T, M, S, G, const KEPT: usize> WholeTask<'_, E, T, M, S, G, KEPT>
where
    E: Equation,
    M: NeighbourOf<E> + ?Sized,
    S: ?Sized,
{
    /// A point with its cell, and F − G there: what [`with_known`](Self::with_known) is to be near to. NaN if either is drawn.
    pub fn first(&self, x: E::Point) -> (Located<E::Point>, f64) {
        let x = self.neighbour.locate(x);
        let source = self.equation.sample_source(&x.point, &mut NoDraws);
        let control = self.neighbour.source(&x, &mut NoDraws);
        (x, (source - control).to_f64())
    }
}

impl<E, T, M, S, G, const KEPT: usize> WholeTask<'_, E, T, M, S, G, KEPT>
where
    E: Equation,
    T: Starts<E>,
    M: NeighbourOf<E> + ?Sized,
    S: Scores<E::Point> + ?Sized,
    G: Generators,
{
    /// Runs at most `at_most` further walks, with the estimator as a constant.
    #[inline(always)]
    pub(super) fn run_walks(
        &self,
        estimator: Estimator,
        replicate: &mut Replicate<'_>,
        at_most: u64,
    ) -> Result<(), NotFinite> {
        const { assert!(KEPT > 0, "a walk of which no state is kept scores nothing") }
        let mut trail: Option<Trail<E::Point, E::Scalar, KEPT>> = None;
        let (mut kept, is_preserved) = (1, self.preserved().is_some());
        let mut memory = G::Memory::default();
        let end = replicate.counts.walks.saturating_add(at_most);
        while replicate.counts.walks < end {
            let number = replicate.next_walk();
            let place = WalkNumber {
                walk: number,
                replicate: replicate.number(),
                index: replicate.counts.walks,
            };
            let mut draws = RngUniforms(G::generator(&self.seeds, place, &mut memory));
            let x0 = self.neighbour.locate(self.starts.start(&mut draws));
            let trail = trail.get_or_insert_with(|| {
                kept = self.kept(&x0.point);
                Trail::new(x0, kept)
            });
            let (e, m) = (self.equation, self.neighbour);
            let mut control_draws = ControlDraws::<G::Random>::new(&self.seeds, number);
            let all_draws = (&mut draws, &mut control_draws as &mut dyn Uniforms<_>);
            let walk = trail.follow(e, m, x0, (estimator, self.form), &self.length, all_draws);
            if walk.termination == Termination::NotFinite {
                return Err(NotFinite { walk: number });
            }
            for (x, difference, share) in trail.iter() {
                let density = if is_preserved || kept == 1 {
                    self.starts.start_density(&x.point)
                } else {
                    let density = self.starts.density_of_states(&x.point, kept);
                    density.unwrap_or(f64::NAN)
                };
                let mut score = difference.to_f64();
                let share = share.to_f64();
                if share != 0.0 && !self.known.is_empty() {
                    score -= share * self.scores.value(x, self.known);
                }
                self.scores.add(x, score / density, replicate.sums);
            }
            let counts = &mut replicate.counts;
            counts.walks += 1;
            counts.states += u64::from(walk.states);
            match walk.termination {
                Termination::Absorbed | Termination::NotFinite => {}
                Termination::Left => counts.left += 1,
                Termination::StepLimit => counts.step_limit += 1,
            }
            counts.scored += u64::from(trail.has_scored());
        }
        Ok(())
    }
}

impl<E, T, M, S, G, const KEPT: usize> WholeJob for WholeTask<'_, E, T, M, S, G, KEPT>
where
    E: Equation + Sync,
    T: Starts<E> + Sync,
    M: NeighbourOf<E> + Sync + ?Sized,
    S: Scores<E::Point> + Sync + ?Sized,
    G: Generators,
{
    fn unknowns(&self) -> usize {
        self.scores.unknowns()
    }

    fn normalisation(&self) -> Normalisation {
        Normalisation {
            functions: self.scores.functions(),
            states_scored: self.states_scored(),
        }
    }

    fn known(&self) -> &[f64] {
        self.known
    }

    fn run(&self, replicate: &mut Replicate<'_>, at_most: u64) -> Result<(), NotFinite> {
        match self.estimator {
            Estimator::Absorption => self.run_walks(Estimator::Absorption, replicate, at_most),
            Estimator::Collision => self.run_walks(Estimator::Collision, replicate, at_most),
        }
    }
}
