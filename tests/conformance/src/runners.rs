//! One run by every runner: the same bits.

use std::sync::OnceLock;
use std::thread;

use fredholm_core::{
    Chain, Equation, Functional, Generators, Goals, Independent, Job, NeighbourOf, RunOptions,
    Space, Statistics, Uniforms, Value,
};
use fredholm_embedded::{Driver, State};
use rand::rngs::Xoshiro256PlusPlus;
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

/// A generator of the matrix: the default one, and another that users of `rand` would take, of another family and with seeds of 32 bytes
/// in place of 16.
pub trait Generator: Generators {
    /// What it is called in tables.
    const NAME: &'static str;
}

impl Generator for Independent {
    const NAME: &'static str = fredholm_core::DEFAULT_GENERATOR;
}
/// Blackman and Vigna 2018.
impl Generator for Independent<Xoshiro256PlusPlus> {
    const NAME: &'static str = "xoshiro256++";
}

/// An equation and its chain as an object: the problems of the matrix are many, and walks are compiled once for every
/// type of point in place of once for every problem.
pub trait Walkable: Space {
    /// [`Equation::Value`].
    type Value: Value<Self::Scalar>;
    /// [`Chain::step`].
    fn step(
        &self,
        x: &Self::Point,
        uniforms: &mut dyn Uniforms<Self::Scalar>,
    ) -> Option<Self::Point>;
    /// [`Equation::kernel`].
    fn kernel(&self, x: &Self::Point, y: &Self::Point) -> Self::Value;
    /// [`Equation::source`].
    fn source(&self, x: &Self::Point, uniforms: &mut dyn Uniforms<Self::Scalar>) -> Self::Value;
    /// [`Equation::channels`].
    fn channels(&self) -> usize;
    /// [`Equation::size`].
    fn size(&self, x: &Self::Point) -> Self::Scalar;
}

/// Uniform numbers of any kind.
struct AnyUniforms<'a, F>(&'a mut dyn Uniforms<F>);

impl<F> Uniforms<F> for AnyUniforms<'_, F> {
    fn uniform(&mut self) -> F {
        self.0.uniform()
    }
}

impl<E: Equation> Walkable for E {
    type Value = E::Value;

    fn step(&self, x: &E::Point, uniforms: &mut dyn Uniforms<E::Scalar>) -> Option<E::Point> {
        Chain::step(self, x, &mut AnyUniforms(uniforms))
    }
    fn kernel(&self, x: &E::Point, y: &E::Point) -> E::Value {
        Equation::kernel(self, x, y)
    }
    fn source(&self, x: &E::Point, uniforms: &mut dyn Uniforms<E::Scalar>) -> E::Value {
        Equation::source(self, x, &mut AnyUniforms(uniforms))
    }
    fn channels(&self) -> usize {
        Equation::channels(self)
    }
    fn size(&self, x: &E::Point) -> E::Scalar {
        Equation::size(self, x)
    }
}

/// The object as an equation.
#[allow(
    missing_debug_implementations,
    reason = "an object of a trait has none"
)]
pub struct Any<'a, W: ?Sized>(pub &'a W);

impl<W: Walkable + ?Sized> Space for Any<'_, W> {
    type Scalar = W::Scalar;
    type Point = W::Point;
}
impl<W: Walkable + ?Sized> Chain for Any<'_, W> {
    fn step<U: Uniforms<W::Scalar>>(&self, x: &W::Point, uniforms: &mut U) -> Option<W::Point> {
        self.0.step(x, uniforms)
    }
}
impl<W: Walkable + ?Sized> Equation for Any<'_, W> {
    type Value = W::Value;

    fn kernel(&self, x: &W::Point, y: &W::Point) -> W::Value {
        self.0.kernel(x, y)
    }
    fn source<U: Uniforms<W::Scalar>>(&self, x: &W::Point, uniforms: &mut U) -> W::Value {
        self.0.source(x, uniforms)
    }
    fn channels(&self) -> usize {
        self.0.channels()
    }
    fn size(&self, x: &W::Point) -> W::Scalar {
        self.0.size(x)
    }
}

/// Statistics of the walks that every runner runs, in batches one after the other.
///
/// # Panics
/// If a walk scores a value that is not finite.
pub fn in_batches(job: &dyn Job) -> Vec<Statistics> {
    run_in_batches(job, WALKS, BATCH)
}

/// **Every runner gives the same bits**: those of 600 walks in batches one after the other, of the first goals of a job that share
/// them. The runner for devices knows the number of such goals when it is compiled: it is asked where
/// there are four or fewer.
///
/// # Panics
/// If a walk scores a value that is not finite.
pub fn runners<'g, E, N, T, G>(job: &Goals<'g, E, N, T, G>) -> Outcome
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Generator,
    Goals<'g, E, N, T, G>: Job,
{
    let expected = in_batches(job);
    let mut worst = Worst::new("runners with other bits", 0.0);
    let mut compare = |name: &dyn Fn() -> String, all: Option<&[Statistics]>| {
        for (number, expected) in expected.iter().enumerate() {
            let found = all.and_then(|all| all.get(number));
            let other = found.is_none_or(|found| found.to_bytes() != expected.to_bytes());
            let estimate = |s: &Statistics| s.preconditioned().estimate;
            let (expected, found) = (estimate(expected), found.map_or(f64::NAN, estimate));
            worst.add(expected, found, f64::from(u8::from(other)), || {
                format!("the estimate of {} with {}", name(), G::NAME)
            });
        }
    };
    for (pool, threads) in pools().iter().zip(THREADS) {
        let found = on_threads(pool, job);
        compare(
            &|| format!("{threads} threads of fredholm-rayon"),
            Some(&found[..expected.len()]),
        );
    }
    let in_pieces = match job.shared() {
        1 => in_pieces::<_, _, _, _, 1>(job),
        2 => in_pieces::<_, _, _, _, 2>(job),
        3 => in_pieces::<_, _, _, _, 3>(job),
        4 => in_pieces::<_, _, _, _, 4>(job),
        _ => Some(expected.clone()),
    };
    compare(&|| "fredholm-embedded".into(), in_pieces.as_deref());
    worst.outcome()
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

fn on_threads(pool: &ThreadPool, job: &dyn Job) -> Vec<Statistics> {
    let run = || fredholm_rayon::run(job, &run_options(), None, &());
    // Not from a worker of another pool: it would begin a further problem while it waits for this one, and
    // another within that.
    let outcome = thread::scope(|scope| scope.spawn(|| pool.install(run)).join());
    outcome
        .expect("no panic")
        .expect("finite scores")
        .statistics
}

/// 47 walks at a time; half-way through only the bytes of the state survive. `None`: with them the run does not go on,
/// as the first walks are no longer what they were.
fn in_pieces<'g, E, N, T, G, const S: usize>(job: &Goals<'g, E, N, T, G>) -> Option<Vec<Statistics>>
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Generator,
    Goals<'g, E, N, T, G>: Job,
{
    let mut driver = Driver::<_, S>::new(job, 0, run_options()).expect("options with walks");
    loop {
        let progress = driver.poll(job, 47).expect("finite scores");
        if progress.stop.is_some() {
            return Some(driver.statistics().to_vec());
        }
        if progress.walks == 329 {
            let mut bytes = vec![0; State::<S>::BYTES];
            driver
                .save(job)
                .write(&mut bytes)
                .expect("room for a state");
            let state = State::read(&bytes).expect("whole bytes");
            driver = Driver::restore(job, 0, run_options(), &state).ok()?;
        }
    }
}
