//! The walks that tell on what their functionals depend.

use super::{GlobalJob, Normalisation, Replicate};
use crate::uniforms::ControlDraws;
use crate::walk::{Course, Followed, Visitor};
use crate::{
    Absorption, Both, DefaultGenerator, Equation, Estimator, Functional, Generators, Goals,
    Located, NeighbourOf, NotFinite, RngUniforms, Start, Termination, Value, WalkNumber, WalkSeeds,
    WideOf,
};

/// The states of a walk that are kept at a time; a longer walk is followed once more for every further so many of them.
const KEPT: usize = 64;

/// What a point x has to do with a quantity λ of the equation: the derivative u' = ∂u/∂λ solves u' = T u' + `source` + `of_u` u there.
///
/// ```
/// use fredholm_core::global::Dependence;
///
/// // The reflectance ρ = ½ of a wall that emits E = 3: u = ρ H + E with the irradiance H = (u − E)/ρ, by which u grows.
/// let reflectance = Dependence { quantity: 0, source: -6.0, of_u: 2.0 };
/// let u = 5.0;
/// assert_eq!(reflectance.source + reflectance.of_u * u, (u - 3.0) / 0.5);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dependence {
    /// The number of the quantity.
    pub quantity: usize,
    /// The part of ∂F/∂λ + (∂T/∂λ) u at the point that does not depend on u.
    pub source: f64,
    /// The number that u at the point itself is multiplied by in the rest of it.
    pub of_u: f64,
}

/// Hands on the dependences of a point in a channel.
pub type Dependences<'a, P> = dyn Fn(&P, usize, &mut dyn FnMut(Dependence)) + Sync + 'a;

/// The derivatives of functionals with respect to quantities λ that F(x) and k(x, ·) depend on at some points x, and k(x, ·) as a whole.
///
/// The derivative of u solves u' = T u' + s + c u, where s(x) + c(x) u(x) = ∂F/∂λ + (∂T/∂λ) u. So
///
/// ```text
/// ∂(u, Φ)/∂λ = (s + c u, u*) = E φ Σ_l W_l (s(x_l) + c(x_l) u(x_l)),
/// ```
///
/// where u* solves the adjoint equation and W_l is the weight of a walk from Φ in its l-th state: a walk passes all that could change its
/// functional. Given that state, the rest of the walk estimates u there, with v as control variate: û = v(x_l) + D_l, where
/// D_l is the difference of what both equations score on the suffix. So every state of every walk scores on the quantities that its point has to do
/// with, and on no others: derivatives with respect to a thousand take hardly longer than those with respect to one.
///
/// One walk of a replicate is one of each goal. They are the walks of [`Goals`] with the same seed: by roulette, or with constant absorption, by the
/// collision estimator.
///
/// ```
/// use fredholm_core::global::*;
/// use fredholm_core::*;
///
/// /// u = ρ ∫ u dy + f on [0, 1) with ρ = ½ and f = ¾: u = f/(1 − ρ).
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
///
/// let (none, goals) = (NoNeighbour::new(&Half), [Goal::new(At(0.5), Some(0.0))]);
/// let walks = Goals::new(&Half, &none, &goals, WalkOptions::default());
/// let both = |_: &f64, _: usize, each: &mut dyn FnMut(Dependence)| {
///     each(Dependence { quantity: 0, source: -1.5, of_u: 2.0 });
///     each(Dependence { quantity: 1, source: 1.0, of_u: 0.0 });
/// };
/// let job = Sensitivities::new(&walks, 2, &both);
/// let mut means = [[0.0; 16]; 2];
/// for r in 0..16 {
///     let mut sums = [0.0; 2];
///     job.run(&mut Replicate::new(r as u64, 16, ReplicateCounts::default(), &mut sums), 1000)?;
///     (means[0][r], means[1][r]) = (sums[0] / 1000.0, sums[1] / 1000.0);
/// }
/// // ∂u/∂ρ = f/(1 − ρ)² = 3 and ∂u/∂f = 1/(1 − ρ) = 2.
/// for (means, exact) in means.iter().zip([3.0, 2.0]) {
///     let found = over_replicates(means);
///     assert!((found.mean - exact).abs() < 4.0 * found.std_error && found.std_error < 0.1);
/// }
/// # Ok::<(), NotFinite>(())
/// ```
pub struct Sensitivities<'a, E: Equation, N: ?Sized, T, G = DefaultGenerator> {
    goals: &'a Goals<'a, E, N, T, G>,
    quantities: usize,
    dependences: &'a Dependences<'a, E::Point>,
}

impl<E: Equation, N: ?Sized, T, G> core::fmt::Debug for Sensitivities<'_, E, N, T, G> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Sensitivities")
            .field("quantities", &self.quantities)
            .finish_non_exhaustive()
    }
}

impl<'a, E: Equation, N: ?Sized, T, G> Sensitivities<'a, E, N, T, G> {
    /// The derivatives of these goals with respect to so many quantities.
    #[must_use]
    pub const fn new(
        goals: &'a Goals<'a, E, N, T, G>,
        quantities: usize,
        dependences: &'a Dependences<'a, E::Point>,
    ) -> Self {
        Self {
            goals,
            quantities,
            dependences,
        }
    }
}

/// A state that is kept.
struct Passed<E: Equation> {
    x: Located<E::Point>,
    weight: E::Value,
    /// W v in the state, less all that scored before it.
    own: WideOf<E>,
}

/// The states of a walk from the first one that is kept on. It serves one walk after the other.
struct Passages<'n, E: Equation, N: ?Sized> {
    neighbour: &'n N,
    states: [Passed<E>; KEPT],
    kept: usize,
    /// The number of states before those that are kept, and of all so far.
    before: u32,
    entered: u32,
    x: Located<E::Point>,
    /// Σ W (F − G) and steps so far.
    score: WideOf<E>,
}

impl<'n, E: Equation, N: ?Sized> Passages<'n, E, N> {
    /// Room for states. `any` is any point: a place needs a value.
    fn new(neighbour: &'n N, any: Located<E::Point>, nothing: E::Value) -> Self {
        let none = || Passed {
            x: any,
            weight: nothing,
            own: nothing.wide(),
        };
        Self {
            neighbour,
            states: [(); KEPT].map(|()| none()),
            kept: 0,
            before: 0,
            entered: 0,
            x: any,
            score: nothing.wide(),
        }
    }

    /// Forgets the last walk, and keeps the states behind so many of the next one.
    fn begin(&mut self, before: u32, nothing: E::Value) {
        (self.kept, self.before, self.entered) = (0, before, 0);
        self.score = nothing.wide();
    }
}

impl<E: Equation, N: NeighbourOf<E> + ?Sized> Visitor<E::Point, E::Scalar, E::Value>
    for Passages<'_, E, N>
{
    #[inline(always)]
    fn enter(&mut self, x: &Located<E::Point>) {
        self.x = *x;
        self.entered += 1;
    }

    #[inline(always)]
    fn score(&mut self, weights: &Both<E::Value>, scores: &Both<E::Value>, _: E::Scalar) {
        let weight = weights.equation.wide();
        let source = weight.times(&scores.equation.wide());
        if self.entered > self.before
            && let Some(state) = self.states.get_mut(self.kept)
        {
            let v = self.neighbour.value(&self.x).wide();
            *state = Passed {
                x: self.x,
                weight: weights.equation,
                own: weight.times(&v).minus(&self.score),
            };
            self.kept += 1;
        }
        let control = weights.neighbour.wide().times(&scores.neighbour.wide());
        self.score = self.score.plus(&source.minus(&control));
    }

    #[inline(always)]
    fn score_step(&mut self, weights: &Both<E::Value>, difference: &E::Value) {
        let control = weights.neighbour.times(difference).wide();
        self.score = self.score.minus(&control);
    }
}

impl<'a, E, N, T, G> Sensitivities<'a, E, N, T, G>
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Generators,
{
    /// A walk of a goal, and what it scores on all quantities: those of one channel stand next to each other.
    fn walk(
        &self,
        goal: usize,
        place: WalkNumber,
        passages: &mut Option<Passages<'a, E, N>>,
        sums: &mut [f64],
    ) -> Result<(u32, Termination), NotFinite> {
        let Goals {
            equation,
            neighbour,
            goals,
            options,
            ..
        } = self.goals;
        let Some(own) = goals.get(goal) else {
            return Ok((0, Termination::Absorbed));
        };
        let course = match options.absorption.probability() {
            None => Course::of(Absorption::Roulette),
            Some(probability) => Course::of(Absorption::Constant {
                probability,
                estimator: Estimator::Collision,
            }),
        };
        let followed = Followed {
            equation: *equation,
            neighbour: *neighbour,
            form: options.form,
            length: options.length(),
        };
        let seeds = WalkSeeds::<G>::new(options.seed, goal as u64);
        let channels = equation.channels();
        let nothing = E::Value::splat(channels, num_traits::zero());
        let mut before = 0;
        loop {
            let mut memory = G::Memory::default();
            let mut draws = RngUniforms(G::generator(&seeds, place, &mut memory));
            let mut control_draws = ControlDraws::<G::Random>::new(&seeds, place.walk);
            let Start { point, phi, .. } = own.functional.start(*equation, &mut draws);
            let x0 = neighbour.locate(point);
            let passages = passages.get_or_insert_with(|| Passages::new(*neighbour, x0, nothing));
            passages.begin(before, nothing);
            let (states, end) = followed.walk(x0, course, &mut draws, &mut control_draws, passages);
            if !passages.score.is_finite() {
                return Err(NotFinite { walk: place.walk });
            }
            let phi = crate::Real::to_f64(phi);
            for state in passages.states.iter().take(passages.kept) {
                let rest = state.own.plus(&passages.score);
                for channel in 0..channels {
                    let from = channel * self.quantities;
                    let weight = crate::Real::to_f64(state.weight.get(channel));
                    let mut add = |on: Dependence| {
                        if let Some(sum) = sums.get_mut(from + on.quantity) {
                            *sum += phi * (on.source * weight + on.of_u * rest.get(channel));
                        }
                    };
                    (self.dependences)(&state.x.point, channel, &mut add);
                }
            }
            before = before.saturating_add(KEPT as u32);
            if states <= before {
                return Ok((states, end));
            }
        }
    }
}

impl<E, N, T, G> GlobalJob for Sensitivities<'_, E, N, T, G>
where
    E: Equation + Sync,
    N: NeighbourOf<E> + Sync + ?Sized,
    T: Functional<E> + Sync,
    WideOf<E>: Sync,
    G: Generators,
{
    /// Goal by goal, channel by channel, a number for every quantity.
    fn unknowns(&self) -> usize {
        self.goals.goals.len() * self.goals.equation.channels() * self.quantities
    }

    fn normalisation(&self) -> Normalisation {
        Normalisation {
            functions: 1,
            cells: self.unknowns(),
            states_scored: 1.0,
        }
    }

    fn known(&self) -> &[f64] {
        &[]
    }

    fn run(&self, replicate: &mut Replicate<'_>, at_most: u64) -> Result<(), NotFinite> {
        let width = self.goals.equation.channels() * self.quantities;
        let mut passages = None;
        let end = replicate.counts.walks.saturating_add(at_most);
        while replicate.counts.walks < end {
            let walk = replicate.next_walk();
            let place = WalkNumber {
                walk,
                replicate: replicate.number(),
                index: replicate.counts.walks,
            };
            let rows = replicate.sums.chunks_exact_mut(width.max(1));
            for (goal, sums) in rows.enumerate() {
                let (states, termination) = self.walk(goal, place, &mut passages, sums)?;
                let counts = &mut replicate.counts;
                counts.states += u64::from(states);
                match termination {
                    Termination::Absorbed | Termination::NotFinite => {}
                    Termination::Left => counts.left += 1,
                    Termination::StepLimit => counts.step_limit += 1,
                }
            }
            replicate.counts.scored += 1;
            replicate.counts.walks += 1;
        }
        Ok(())
    }
}
