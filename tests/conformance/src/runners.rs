//! One run by every runner: the same bits.

use std::sync::OnceLock;
use std::thread;

use fredholm_core::rand_core::{Rng, SeedableRng};
use fredholm_core::{
    DefaultGenerator, Equation, Estimator, Form, Functional, Goal, Goals, Job, Kernel, Length,
    NeighbourOf, RandomSource, RunOptions, Sampler, StateSpace, Statistics, Task, Uniforms,
    WalkOptions, WalkSeeds,
};
use fredholm_embedded::{Driver, State};
use rand::rngs::{ChaCha8Rng, Xoshiro256PlusPlus};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::check::run_in_batches;
use crate::outcome::{Outcome, Worst};

/// Numbers of threads of `fredholm-rayon`.
const THREADS: [usize; 3] = [1, 2, 3];

/// Who walks: batches one after the other, `fredholm-rayon` on 1, 2 and 3 threads, and
/// `fredholm-embedded` in pieces, with a power cut in the middle.
pub const RUNNERS: usize = 1 + THREADS.len() + 1;

/// Walks that every runner runs …
const WALKS: u64 = 600;
/// … in 27 batches, the last of which is not whole: stages of 16 and of 11.
const BATCH: u64 = 23;

/// A generator of the matrix: the default one, and two more that users of `rand` would take, of other families
/// and with seeds of 32 bytes in place of 16.
pub trait Generator: Rng + SeedableRng {
    /// What it is called in tables.
    const NAME: &'static str;
}

impl Generator for DefaultGenerator {
    const NAME: &'static str = fredholm_core::DEFAULT_GENERATOR;
}
/// Blackman and Vigna 2018.
impl Generator for Xoshiro256PlusPlus {
    const NAME: &'static str = "xoshiro256++";
}
/// Bernstein 2008, with eight rounds.
impl Generator for ChaCha8Rng {
    const NAME: &'static str = "chacha8";
}

/// An equation and its chain as an object: the problems of the matrix are many, and walks are compiled once for every
/// type of point in place of once for every problem.
pub trait Walkable: StateSpace {
    /// [`Sampler::absorption`].
    fn absorption(&self, x: &Self::Point) -> Self::Scalar;
    /// [`Sampler::step`].
    fn step(
        &self,
        x: &Self::Point,
        uniforms: &mut dyn Uniforms<Self::Scalar>,
    ) -> Option<Self::Point>;
    /// [`Kernel::kernel`].
    fn kernel(&self, x: &Self::Point, y: &Self::Point) -> Self::Scalar;
    /// [`RandomSource::sample_source`].
    fn sample_source(
        &self,
        x: &Self::Point,
        uniforms: &mut dyn Uniforms<Self::Scalar>,
    ) -> Self::Scalar;
}

/// Uniform numbers of any kind.
struct AnyUniforms<'a, F>(&'a mut dyn Uniforms<F>);

impl<F> Uniforms<F> for AnyUniforms<'_, F> {
    fn uniform(&mut self) -> F {
        self.0.uniform()
    }
}

impl<E: Equation> Walkable for E {
    fn absorption(&self, x: &E::Point) -> E::Scalar {
        Sampler::absorption(self, x)
    }
    fn step(&self, x: &E::Point, uniforms: &mut dyn Uniforms<E::Scalar>) -> Option<E::Point> {
        Sampler::step(self, x, &mut AnyUniforms(uniforms))
    }
    fn kernel(&self, x: &E::Point, y: &E::Point) -> E::Scalar {
        Kernel::kernel(self, x, y)
    }
    fn sample_source(&self, x: &E::Point, uniforms: &mut dyn Uniforms<E::Scalar>) -> E::Scalar {
        RandomSource::sample_source(self, x, &mut AnyUniforms(uniforms))
    }
}

/// The object as an equation.
#[allow(
    missing_debug_implementations,
    reason = "an object of a trait has none"
)]
pub struct Any<'a, W: ?Sized>(pub &'a W);

impl<W: Walkable + ?Sized> StateSpace for Any<'_, W> {
    type Scalar = W::Scalar;
    type Point = W::Point;
}
impl<W: Walkable + ?Sized> Sampler for Any<'_, W> {
    fn absorption(&self, x: &W::Point) -> W::Scalar {
        self.0.absorption(x)
    }
    fn step<U: Uniforms<W::Scalar>>(&self, x: &W::Point, uniforms: &mut U) -> Option<W::Point> {
        self.0.step(x, uniforms)
    }
}
impl<W: Walkable + ?Sized> Kernel for Any<'_, W> {
    fn kernel(&self, x: &W::Point, y: &W::Point) -> W::Scalar {
        self.0.kernel(x, y)
    }
}
impl<W: Walkable + ?Sized> RandomSource for Any<'_, W> {
    fn sample_source<U: Uniforms<W::Scalar>>(&self, x: &W::Point, uniforms: &mut U) -> W::Scalar {
        self.0.sample_source(x, uniforms)
    }
}

/// What a walk of any generator depends on: a [`Task`] without its seeds.
#[derive(Debug)]
pub struct Case<'a, E, N: ?Sized, T> {
    /// The equation and its chain.
    pub equation: &'a E,
    /// The neighbour equation.
    pub neighbour: &'a N,
    /// Where walks start.
    pub functional: &'a T,
    /// (v, Φ).
    pub control_mean: f64,
    /// What a walk scores.
    pub estimator: Estimator,
    /// The form of the control variate.
    pub form: Form,
    /// How long walks are followed.
    pub length: Length,
}

impl<E, N: ?Sized, T> Clone for Case<'_, E, N, T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<E, N: ?Sized, T> Copy for Case<'_, E, N, T> {}

impl<'a, E, N: ?Sized, T> Case<'a, E, N, T> {
    /// Goal 0 of a run with this seed.
    #[must_use]
    pub const fn task<G>(&self, seed: u64) -> Task<'a, E, N, T, G> {
        Task {
            equation: self.equation,
            neighbour: self.neighbour,
            functional: self.functional,
            control_mean: Some(self.control_mean),
            estimator: self.estimator,
            form: self.form,
            seeds: WalkSeeds::new(seed, 0),
            length: self.length,
        }
    }
}

/// **Every runner gives the same bits**: those of 600 walks in batches one after the other. Also returns what
/// these are.
///
/// # Panics
/// If a walk scores a value that is not finite.
pub fn runners<E, N, T, G>(case: Case<'_, E, N, T>, seed: u64) -> (Outcome, Statistics)
where
    E: Equation + Sync,
    N: NeighbourOf<E> + Sync + ?Sized,
    T: Functional<E> + Clone + Sync,
    G: Generator,
{
    let expected = run_in_batches(&case.task::<G>(seed), WALKS, BATCH);
    let mut worst = Worst::new("runners with other bits", 0.0);
    let mut compare = |name: &dyn Fn() -> String, found: Option<&Statistics>| {
        let other = found.is_none_or(|found| found.to_bytes() != expected.to_bytes());
        let estimate = |s: &Statistics| s.preconditioned().estimate;
        let (expected, found) = (estimate(&expected), found.map_or(f64::NAN, estimate));
        worst.add(expected, found, f64::from(u8::from(other)), || {
            format!("the estimate of {} with {}", name(), G::NAME)
        });
    };
    for (pool, threads) in pools().iter().zip(THREADS) {
        let found = on_threads::<_, _, _, G>(pool, case, seed);
        compare(
            &|| format!("{threads} threads of fredholm-rayon"),
            Some(&found),
        );
    }
    compare(
        &|| "fredholm-embedded".into(),
        in_pieces::<_, _, _, G>(case, seed).as_ref(),
    );
    (worst.outcome(), expected)
}

fn pools() -> &'static [ThreadPool; 3] {
    static POOLS: OnceLock<[ThreadPool; 3]> = OnceLock::new();
    POOLS.get_or_init(|| {
        THREADS.map(|threads| {
            let builder = ThreadPoolBuilder::new().num_threads(threads);
            builder.build().expect("threads")
        })
    })
}

fn run_options() -> RunOptions {
    RunOptions {
        batch: BATCH,
        ..RunOptions::new(WALKS)
    }
}

fn on_threads<E, N, T, G>(pool: &ThreadPool, case: Case<'_, E, N, T>, seed: u64) -> Statistics
where
    E: Equation + Sync,
    N: NeighbourOf<E> + Sync + ?Sized,
    T: Functional<E> + Clone + Sync,
    G: Generator,
{
    let goals = [Goal {
        functional: case.functional.clone(),
        control_mean: Some(case.control_mean),
    }];
    let options = WalkOptions {
        seed,
        estimator: case.estimator,
        form: case.form,
        survivals: case.length.survivals,
        step_limit: case.length.step_limit,
    };
    run_on(
        pool,
        &Goals::new(case.equation, case.neighbour, &goals, options).with_generator::<G>(),
    )
}

fn run_on(pool: &ThreadPool, job: &dyn Job) -> Statistics {
    let run = || fredholm_rayon::run(job, &run_options(), None, &());
    // Not from a worker of another pool: it would begin a further problem while it waits for this one, and
    // another within that.
    let outcome = thread::scope(|scope| scope.spawn(|| pool.install(run)).join());
    let outcome = outcome.expect("no panic").expect("finite scores");
    outcome.statistics[0]
}

/// 47 walks at a time; half-way through only the bytes of the state survive. `None`: with them the run does not go on,
/// as the first walks are no longer what they were.
fn in_pieces<E, N, T, G>(case: Case<'_, E, N, T>, seed: u64) -> Option<Statistics>
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Generator,
{
    let mut driver =
        Driver::new(case.task::<G>(seed), run_options()).expect("a run_options with walks");
    loop {
        let progress = driver.poll(47).expect("finite scores");
        if progress.stop.is_some() {
            return Some(driver.statistics());
        }
        if progress.walks == 329 {
            let state = State::from_bytes(&driver.save().to_bytes()).expect("whole bytes");
            driver = Driver::restore(case.task(seed), run_options(), &state).ok()?;
        }
    }
}
