//! The walks that tell on what their functionals depend.

use crate::space::Arriving;
use crate::walk::{Course, Visitor};
use crate::{
    Batch, Both, Equation, Functional, Generators, Goal, Goals, Independent, Job, Located,
    NeighbourOf, NotFinite, Real, Value, WalkNumber, WalkSeeds, WideOf,
};

/// The states of a walk that are kept at a time; a longer walk is followed once more for every further so many of them.
const KEPT: usize = 64;

/// What a point x has to do with a quantity λ of the equation: the derivative u' = ∂u/∂λ solves u' = T u' + `source` + `of_u` u + `of_arriving` H
/// there, with H(x) = ∫ p(x, y) u(y) dμ(y), the mean of u over steps from x.
///
/// Where λ changes the kernel in another way than as a factor of k(x, ·), a step has to do with it: from y to x it scores (∂k/∂λ)/k (y, x) times what
/// is estimated of u at x, so that `of_u` is this ratio.
///
/// ```
/// use fredholm_core::Dependence;
///
/// // The reflectance ρ = ½ of a wall that emits E = 3: u = ρ H + E with the irradiance H = (u − E)/ρ, by which u grows.
/// let reflectance = Dependence::on_factor(0, 3.0, 0.5);
/// let u = 5.0;
/// assert_eq!(reflectance.source + reflectance.of_u * u, (u - 3.0) / 0.5);
/// // That of a black wall, ρ = 0: there u = E tells nothing of H.
/// let black = Dependence::on_factor(0, 3.0, 0.0);
/// assert_eq!((black.source, black.of_u, black.of_arriving), (0.0, 0.0, 1.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dependence {
    /// The number of the quantity.
    pub quantity: usize,
    /// The part of ∂F/∂λ + (∂T/∂λ) u at the point that does not depend on u.
    pub source: f64,
    /// The number that u at the point itself is multiplied by in it.
    pub of_u: f64,
    /// The number that the mean of u over steps from the point is multiplied by in it. Unless it is 0, a walk of its own tells that mean, so that
    /// it is for points where u does not: where K(x, ·) = 0.
    pub of_arriving: f64,
}

impl Dependence {
    /// No dependence yet on the quantity of this number.
    #[must_use]
    pub const fn on(quantity: usize) -> Self {
        Self {
            quantity,
            source: 0.0,
            of_u: 0.0,
            of_arriving: 0.0,
        }
    }

    /// The dependence on the factor ρ of k(x, ·) = ρ, from F and ρ at the point: ∂(T u)/∂ρ = H, which u = F + ρ H tells unless ρ = 0.
    #[must_use]
    pub fn on_factor(quantity: usize, source: f64, factor: f64) -> Self {
        if factor == 0.0 {
            return Self {
                of_arriving: 1.0,
                ..Self::on(quantity)
            };
        }
        Self {
            source: -source / factor,
            of_u: 1.0 / factor,
            ..Self::on(quantity)
        }
    }

    /// This of walks that estimate u less what is known of it at the point: see [`LastStep`](crate::LastStep).
    #[must_use]
    pub fn knowing(&self, known: f64) -> Self {
        Self {
            source: self.source + self.of_u * known,
            ..*self
        }
    }
}

/// What a goal itself has to do with a quantity λ, besides what the states of its walks score: the derivative of a λ-dependent number a + b (u, Φ)
/// has `known` = ∂a/∂λ and `share` = (∂b/∂λ)/b of its estimate b (u, Φ), the same in all channels.
///
/// ```
/// use fredholm_core::Direct;
///
/// // The net flux q = ε (σT⁴ − H) of a surface grows with its emissivity ε by q/ε, besides by what H does.
/// let of_emissivity = Direct { known: 0.0, share: 1.0 / 0.8 };
/// assert_eq!(of_emissivity.share, 1.25);
/// assert_eq!(Direct::NONE, Direct { known: 0.0, share: 0.0 });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direct {
    /// The part of the derivative that is known, in the unit of the goal over that of the quantity.
    pub known: f64,
    /// The number that the estimate is multiplied by in the derivative, over the unit of the quantity.
    pub share: f64,
}

impl Direct {
    /// Nothing: the goal depends on the quantity by u alone.
    pub const NONE: Self = Self {
        known: 0.0,
        share: 0.0,
    };
}

/// Hands on the dependences of a point, and of the step from the point before it, if there is one, each with the number of its channel.
pub type Dependences<'a, P> = dyn Fn(Option<&P>, &P, &mut dyn FnMut(usize, Dependence)) + Sync + 'a;

/// The derivatives of functionals with respect to quantities λ that F(x) and k(x, ·) depend on at some points x.
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
/// with, and on no others: derivatives with respect to a thousand take hardly longer than those with respect to one. Where k(x, ·) as a whole grows
/// with λ the point says so, since (∂T/∂λ) u is then a multiple of u − F; where it does not, the step from x says by how much k grows along it.
/// Where k(x, ·) = 0, on black walls, the walk ends, and ∂T/∂λ is a multiple of what arrives there: a walk of its own from the point tells it.
///
/// They are the walks of [`Goals`], whose statistics stay as they are to the bit. Behind those of a goal come, statistic by statistic, the derivatives
/// with respect to all quantities. A walk that misses a quantity costs nothing there: it is counted with all that did. When walks end, these derivatives
/// are not asked.
///
/// ```
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
/// let both = |_: Option<&f64>, _: &f64, each: &mut dyn FnMut(usize, Dependence)| {
///     each(0, Dependence { source: -1.5, of_u: 2.0, ..Dependence::on(0) });
///     each(0, Dependence { source: 1.0, ..Dependence::on(1) });
/// };
/// let job = Sensitivities::new(&walks, 2, &both);
/// let mut batches = [Batch::new(0, 20_000, 20_000); 3];
/// job.run(0, &mut batches, u64::MAX)?;
/// // u = f/(1 − ρ) = 3/2, ∂u/∂ρ = f/(1 − ρ)² = 3 and ∂u/∂f = 1/(1 − ρ) = 2.
/// for (batch, exact) in batches.iter().zip([1.5, 3.0, 2.0]) {
///     let found = batch.statistics().preconditioned();
///     let error = found.std_error.unwrap();
///     assert!((found.estimate - exact).abs() < 4.0 * error && error < 0.1);
/// }
/// # Ok::<(), NotFinite>(())
/// ```
pub struct Sensitivities<'a, E: Equation, N: ?Sized, T, G = Independent> {
    goals: &'a Goals<'a, E, N, T, G>,
    quantities: usize,
    dependences: &'a Dependences<'a, E::Point>,
    direct: &'a [Direct],
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
            direct: &[],
        }
    }

    /// These of goals that depend on quantities themselves: of every goal one for each quantity, or none at all.
    #[must_use]
    pub const fn with_direct(self, direct: &'a [Direct]) -> Self {
        Self { direct, ..self }
    }

    /// What a goal itself has to do with the quantities.
    fn direct_of(&self, goal: u64) -> &'a [Direct] {
        let first = (goal as usize).saturating_mul(self.quantities);
        let own = self.direct.get(first..).unwrap_or_default();
        let own = own.get(..self.quantities).unwrap_or_default();
        // What is 0 throughout costs the walks nothing.
        match own.iter().all(|own| *own == Direct::NONE) {
            true => &[],
            false => own,
        }
    }
}

/// A walk of a goal, by their numbers, and φ in its start.
#[derive(Clone, Copy)]
struct Own {
    goal: u64,
    walk: u64,
    phi: f64,
}

/// A state that is kept.
struct Passed<E: Equation> {
    before: Option<E::Point>,
    x: Located<E::Point>,
    weight: E::Value,
    /// H v in the state, less all that scored before it.
    own: WideOf<E>,
}

/// The states of a walk from the first one that is kept on. It serves one walk after the other.
struct Passages<'n, E: Equation, N: ?Sized> {
    neighbour: &'n N,
    states: [Option<Passed<E>>; KEPT],
    kept: usize,
    /// The number of states before those that are kept, and of all so far.
    before: u32,
    entered: u32,
    /// The last state.
    last: Option<E::Point>,
    /// What the walk has scored so far: Σ (W F − H G), less the scores of its steps.
    score: WideOf<E>,
}

impl<'n, E: Equation, N: ?Sized> Passages<'n, E, N> {
    /// Room for states.
    fn new(neighbour: &'n N, nothing: &E::Value) -> Self {
        Self {
            neighbour,
            states: [(); KEPT].map(|()| None),
            kept: 0,
            before: 0,
            entered: 0,
            last: None,
            score: nothing.wide(),
        }
    }

    /// Forgets the last walk, and keeps the states behind so many of the next one.
    #[inline(always)]
    fn begin(&mut self, before: u32, nothing: &E::Value) {
        (self.kept, self.before, self.entered) = (0, before, 0);
        self.last = None;
        self.score = nothing.wide();
    }
}

impl<E: Equation, N: NeighbourOf<E> + ?Sized> Visitor<E::Point, E::Scalar, E::Value>
    for Passages<'_, E, N>
{
    #[inline(always)]
    fn enter(&mut self, x: &Located<E::Point>, weights: &Both<E::Value>) {
        self.entered += 1;
        let before = self.last.replace(x.point);
        if self.entered > self.before
            && let Some(state) = self.states.get_mut(self.kept)
        {
            let v = self.neighbour.value(x).wide();
            *state = Some(Passed {
                before,
                x: *x,
                weight: weights.equation,
                own: weights.neighbour.wide().times(&v).minus(&self.score),
            });
            self.kept += 1;
        }
    }

    #[inline(always)]
    fn score(&mut self, weights: &Both<E::Value>, scores: &Both<E::Value>, share: E::Scalar) {
        let source = weights.equation.wide().times(&scores.equation.wide());
        let control = weights.neighbour.wide().times(&scores.neighbour.wide());
        let own = source.minus(&control).scaled(share.to_f64());
        self.score = self.score.plus(&own);
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
    /// Runs walks of a goal as [`Goals::run_goal`] does, and scores the derivatives in the batches behind its own.
    #[inline(always)]
    fn run_walks(
        &self,
        (goal, number): (&Goal<T, WideOf<E>>, u64),
        course: Course<E::Scalar>,
        (batches, derivatives): (&mut [Batch], &mut [Batch]),
        at_most: u64,
    ) -> Result<(), NotFinite> {
        let goals = self.goals;
        let channels = goals.equation.channels();
        let nothing = E::Value::splat(channels, num_traits::zero());
        let seeds = WalkSeeds::<G::Random>::new(goals.options.seed, number);
        let mut memory = G::Memory::default();
        let mut passages = Passages::<E, N>::new(goals.neighbour, &nothing);
        let direct = self.direct_of(number);
        let mut left = at_most;
        while left > 0
            && let Some(place) = batches.first().and_then(Batch::next_number)
        {
            let mut before = 0;
            loop {
                passages.begin(before, &nothing);
                let mut again = G::Memory::default();
                let memory = if before == 0 { &mut memory } else { &mut again };
                let score = goals.follow(goal, &seeds, course, (place, memory), &mut passages);
                let own = Own {
                    goal: number,
                    walk: place.walk,
                    phi: score.phi.to_f64(),
                };
                if before == 0 {
                    goals.push(&score, batches)?;
                    if !direct.is_empty() {
                        self.add_direct(direct, place.walk, &score.estimate(), derivatives);
                    }
                }
                self.accrue(own, &passages, derivatives);
                before += KEPT as u32;
                if before >= score.walk.states {
                    break;
                }
            }
            left -= 1;
        }
        Ok(())
    }

    /// Adds what the kept states of a walk score on their quantities.
    #[inline(always)]
    fn accrue(&self, of: Own, passages: &Passages<'_, E, N>, to: &mut [Batch]) {
        let states = passages.states.iter().take(passages.kept).flatten();
        for (number, state) in (u64::from(passages.before)..).zip(states) {
            let rest = state.own.plus(&passages.score);
            let mut arriving = None;
            let mut add = |channel: usize, on: Dependence| {
                let weight = state.weight.get(channel).to_f64();
                let mut source = on.source;
                if on.of_arriving != 0.0 {
                    let arriving =
                        arriving.get_or_insert_with(|| self.arriving(&state.x.point, of, number));
                    source += on.of_arriving * arriving.get(channel);
                }
                let score = of.phi * (source * weight + on.of_u * rest.get(channel));
                self.add((channel, on.quantity), (of.walk, score), to);
            };
            (self.dependences)(state.before.as_ref(), &state.x.point, &mut add);
        }
    }

    /// A number with the mean of u over steps from a point, which a walk has come to in the state of this number: from a walk with draws of its
    /// own, which goes on by roulette.
    #[inline(never)]
    fn arriving(&self, x: &E::Point, of: Own, state: u64) -> WideOf<E> {
        let goals = self.goals;
        let nothing = E::Value::splat(goals.equation.channels(), num_traits::zero()).wide();
        let goal = Goal {
            functional: Arriving(*x),
            control_mean: None,
            known: nothing,
        };
        let walks = Goals::<E, N, Arriving<E::Point>>::new(
            goals.equation,
            goals.neighbour,
            &[],
            goals.options,
        );
        // No goal has such a number.
        let seeds = WalkSeeds::new(goals.options.seed, !(state << 32 | of.goal));
        let number = WalkNumber {
            walk: of.walk,
            replicate: of.walk,
            index: 0,
        };
        let score = walks.follow(&goal, &seeds, Course::Roulette, (number, &mut ()), &mut ());
        score.estimate()
    }

    /// Adds what a goal itself has to do with the quantities, given what a walk estimates.
    fn add_direct(&self, direct: &[Direct], walk: u64, estimate: &WideOf<E>, to: &mut [Batch]) {
        for (quantity, own) in direct.iter().enumerate() {
            for channel in 0..self.goals.equation.channels() {
                let score = own.known + own.share * estimate.get(channel);
                if score != 0.0 {
                    self.add((channel, quantity), (walk, score), to);
                }
            }
        }
    }

    /// Adds what a walk scores on a quantity in a channel.
    #[inline(always)]
    fn add(
        &self,
        (channel, quantity): (usize, usize),
        (walk, score): (u64, f64),
        to: &mut [Batch],
    ) {
        if quantity >= self.quantities {
            return;
        }
        let mut accrue = |statistic: usize, score: f64| {
            if let Some(batch) = to.get_mut(statistic * self.quantities + quantity) {
                batch.accrue(walk, score);
            }
        };
        accrue(channel, score);
        if let Some(share) = self.goals.weights.get(channel) {
            accrue(self.goals.equation.channels(), share * score);
        }
    }
}

impl<E, N, T, G> Job for Sensitivities<'_, E, N, T, G>
where
    E: Equation + Sync,
    N: NeighbourOf<E> + Sync + ?Sized,
    T: Functional<E> + Sync,
    WideOf<E>: Sync,
    G: Generators,
{
    fn goals(&self) -> usize {
        self.goals.goals.len() * self.shared()
    }

    /// The statistics of a goal, and of each the derivatives.
    fn shared(&self) -> usize {
        self.goals.statistics() * (1 + self.quantities)
    }

    fn decisive(&self) -> usize {
        self.goals.statistics()
    }

    fn run(&self, first: usize, batches: &mut [Batch], at_most: u64) -> Result<(), NotFinite> {
        let goal = first / self.shared();
        let statistics = self.goals.statistics();
        let (Some(own), Some((batches, derivatives))) = (
            self.goals.goals.get(goal),
            batches.split_at_mut_checked(statistics),
        ) else {
            return Ok(());
        };
        let course = Course::of(self.goals.options.absorption);
        let both = (&mut *batches, &mut *derivatives);
        let outcome = self.run_walks((own, goal as u64), course, both, at_most);
        if let Some(leader) = batches.first() {
            derivatives
                .iter_mut()
                .for_each(|own| own.keep_up_with(leader));
        }
        self.goals.end(batches);
        self.goals.end(derivatives);
        self.goals.mark_certain(goal * statistics, batches);
        outcome
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{At, Chain, Channels, NoNeighbour, Space, Uniforms, WalkOptions};

    /// u_c = r_c ∫ u_c dy + 1 on [0, 1): long walks, of which one in a thousand has more states than are kept at a time.
    struct Two;

    impl Space for Two {
        type Scalar = f64;
        type Point = f64;
    }
    impl Chain for Two {
        fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
            Some(uniforms.uniform())
        }
    }
    impl Equation for Two {
        type Value = Channels<f64, 2>;
        fn kernel(&self, _: &f64, _: &f64) -> Self::Value {
            Channels::from_fn(2, |c| RHO[c])
        }
        fn source<U: Uniforms<f64>>(&self, _: &f64, _: &mut U) -> Self::Value {
            Channels::splat(2, 1.0)
        }
        fn channels(&self) -> usize {
            2
        }
    }

    const RHO: [f64; 2] = [0.9, 0.5];
    const WEIGHTS: [f64; 2] = [2.0, 1.0];
    const WALKS: u64 = 20_000;

    /// Does something with walks of both channels and their sum from 0.3.
    fn with_walks<R>(then: impl FnOnce(&Goals<'_, Two, NoNeighbour<Two>, At<f64>>) -> R) -> R {
        let nothing = Channels::splat(2, 0.0);
        let goals = [Goal {
            functional: At(0.3),
            control_mean: Some(nothing),
            known: nothing,
        }];
        let none = NoNeighbour::new(&Two);
        then(&Goals::new(&Two, &none, &goals, WalkOptions::default()).with_sum(&WEIGHTS))
    }

    /// Channels and their sum, of each u; and of each ∂u/∂r by points and by steps, and ∂u/∂F on the left half; after walks in pieces of so many.
    fn run(piece: u64) -> [Batch; 12] {
        let both = |before: Option<&f64>, x: &f64, each: &mut dyn FnMut(usize, Dependence)| {
            for (channel, rho) in RHO.into_iter().enumerate() {
                let by_rho = Dependence {
                    source: -1.0 / rho,
                    of_u: 1.0 / rho,
                    ..Dependence::on(0)
                };
                each(channel, by_rho);
                if before.is_some() {
                    let by_step = Dependence {
                        of_u: 1.0 / rho,
                        ..Dependence::on(1)
                    };
                    each(channel, by_step);
                }
                if *x < 0.5 {
                    let by_source = Dependence {
                        source: 1.0,
                        ..Dependence::on(2)
                    };
                    each(channel, by_source);
                }
            }
        };
        let mut batches = [Batch::new(0, WALKS, WALKS); 12];
        with_walks(|walks| {
            let job = Sensitivities::new(walks, 3, &both);
            while !batches[0].is_done() {
                job.run(0, &mut batches, piece).unwrap();
                let walks = batches.map(|batch| batch.statistics().walks());
                assert_eq!(walks, [walks[0]; 12]);
            }
        });
        batches
    }

    #[test]
    fn channels_and_their_sum_have_derivatives() {
        let batches = run(u64::MAX);
        let found = batches.map(|batch| batch.statistics().preconditioned());
        for (channel, rho) in RHO.into_iter().enumerate() {
            let u = 1.0 / (1.0 - rho);
            // The start is on the left, and half of all other states.
            let exact = [u, u * u, u * u, 1.0 + 0.5 * rho * u];
            let first = 3 + 3 * channel;
            for (number, exact) in [channel, first, first + 1, first + 2]
                .into_iter()
                .zip(exact)
            {
                let z = (found[number].estimate - exact) / found[number].std_error.unwrap();
                assert!(z.abs() < 4.9, "{channel} {number}: {z}");
            }
        }
        for number in [0, 1, 2] {
            let sum =
                WEIGHTS[0] * found[3 + number].estimate + WEIGHTS[1] * found[6 + number].estimate;
            assert!((found[9 + number].estimate - sum).abs() < 1e-12 * sum.abs());
        }
    }

    /// u_c = ρ_c(x) ∫ u_c dy + 1, whose left half is black in the first channel.
    struct HalfBlack;

    const LEFT: [f64; 2] = [0.0, 0.5];

    fn reflectance(x: f64, channel: usize) -> f64 {
        if x < 0.5 { LEFT[channel] } else { 0.6 }
    }

    impl Space for HalfBlack {
        type Scalar = f64;
        type Point = f64;
    }
    impl Chain for HalfBlack {
        fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
            Some(uniforms.uniform())
        }
    }
    impl Equation for HalfBlack {
        type Value = Channels<f64, 2>;
        fn kernel(&self, x: &f64, _: &f64) -> Self::Value {
            Channels::from_fn(2, |c| reflectance(*x, c))
        }
        fn source<U: Uniforms<f64>>(&self, _: &f64, _: &mut U) -> Self::Value {
            Channels::splat(2, 1.0)
        }
        fn channels(&self) -> usize {
            2
        }
        fn size(&self, x: &f64) -> f64 {
            reflectance(*x, 1)
        }
    }

    /// With the mean m = 1/(1 − ½ρ − 0.3) of u = 1 + ρ m on the left, ∂u/∂ρ = m + ½ ρ m² there, whether ρ is 0 or not.
    #[test]
    fn what_is_black_has_derivatives_by_its_reflectance() {
        let nothing = Channels::splat(2, 0.0);
        let goals = [0.3, 0.7].map(|x| Goal {
            functional: At(x),
            control_mean: Some(nothing),
            known: nothing,
        });
        let none = NoNeighbour::new(&HalfBlack);
        let walks = Goals::new(&HalfBlack, &none, &goals, WalkOptions::default());
        let by = |_: Option<&f64>, x: &f64, each: &mut dyn FnMut(usize, Dependence)| {
            for (channel, rho) in LEFT.into_iter().enumerate().filter(|_| *x < 0.5) {
                each(channel, Dependence::on_factor(0, 1.0, rho));
            }
        };
        let job = Sensitivities::new(&walks, 1, &by);
        for (goal, own) in [LEFT, [0.6; 2]].into_iter().enumerate() {
            let mut batches = [Batch::new(0, WALKS, WALKS); 4];
            job.run(4 * goal, &mut batches, u64::MAX).unwrap();
            for (channel, rho) in own.into_iter().enumerate() {
                let mean = 1.0 / (0.7 - 0.5 * LEFT[channel]);
                let direct = if goal == 0 { mean } else { 0.0 };
                let exact = direct + rho * 0.5 * mean * mean;
                let found = batches[2 + channel].statistics().preconditioned();
                let error = found.std_error.unwrap();
                let z = (found.estimate - exact) / error;
                assert!(
                    z.abs() < 4.9 && error < 0.1,
                    "{goal} {channel}: {z} {error}"
                );
            }
        }
    }

    #[test]
    fn pieces_have_the_bits_of_a_whole_and_u_those_without_derivatives() {
        let whole = run(u64::MAX);
        for piece in [1, 7, 1000] {
            assert_eq!(
                run(piece).map(|batch| batch.statistics()),
                whole.map(|batch| batch.statistics())
            );
        }
        let mut alone = [Batch::new(0, WALKS, WALKS); 3];
        with_walks(|walks| walks.run(0, &mut alone, u64::MAX).unwrap());
        assert_eq!(alone[..], whole[..3]);
    }
}
