//! The firmware's cases on this machine, by either runner, and the tables that they read.

#[path = "../../runners/embedded/firmware/src/cases.rs"]
pub mod cases;
#[path = "../../runners/embedded/firmware/src/line.rs"]
pub mod line;

use cases::{Case, Runner, drive};
use fredholm_core::rand_core::Rng;
use fredholm_core::{
    DefaultGenerator, Equation, Functional, Goals, Job, Neighbour, NeighbourOf, RunOptions, Space,
    Statistics, WalkSeeds,
};
use fredholm_embedded::{Driver, State};

/// Which runner walks.
#[derive(Clone, Copy, Debug)]
pub enum With {
    /// `fredholm-embedded`, so many walks at a time.
    Embedded(u64),
    /// The same, power failing at 100 random points; the number is a seed.
    Resets(u64),
    /// `fredholm-rayon` with so many threads.
    Rayon(usize),
}

/// Lines of bits of all cases.
///
/// # Panics
/// If a case cannot be run.
#[must_use]
pub fn lines(with: With) -> String {
    let mut workstation = Workstation {
        with,
        lines: String::new(),
    };
    cases::all(&mut workstation).expect("no table and no problem is refused");
    workstation.lines
}

/// A case of an equation with any neighbour equation: the compiler makes one walk of an equation, whatever its neighbours.
type OfEquation<'a, E, T> = Case<'a, E, AnyNeighbour<'a, E>, T>;
/// A neighbour equation of an equation.
type AnyNeighbour<'a, E> = dyn Neighbour<
        Scalar = <E as Space>::Scalar,
        Point = <E as Space>::Point,
        Value = <E as Equation>::Value,
    > + Sync
    + 'a;

struct Workstation {
    with: With,
    lines: String,
}

impl Runner for Workstation {
    fn run<E, N, T>(&mut self, name: &str, case: &Case<'_, E, N, T>, options: RunOptions)
    where
        E: Equation<Value = <E as Space>::Scalar> + Sync,
        N: NeighbourOf<E> + Sync,
        T: Functional<E> + Sync,
    {
        let neighbour: &AnyNeighbour<'_, E> = case.neighbour;
        let case: OfEquation<'_, E, T> =
            Goals::new(case.equation, neighbour, case.goals, case.options);
        let statistics = match self.with {
            With::Embedded(walks) => drive(&case, options, walks, || ()).expect("a run ends"),
            With::Resets(seed) => with_resets(seed, &case, options),
            With::Rayon(threads) => on_threads(threads, &case, options),
        };
        let ends = case.options.absorption;
        line::line::<E::Scalar>(&mut self.lines, name, ends, &statistics)
            .expect("writing to a string does not fail");
    }
}

/// At each reset the bytes of the state survive, and nothing else.
fn with_resets<E, T>(seed: u64, case: &OfEquation<'_, E, T>, options: RunOptions) -> Statistics
where
    E: Equation<Value = <E as Space>::Scalar> + Sync,
    T: Functional<E> + Sync,
{
    let mut random = WalkSeeds::<DefaultGenerator>::new(seed, 0).generator(0);
    let mut driver = Driver::<_, 1>::new(case, 0, options).unwrap();
    for _ in 0..100 {
        // 4000 walks in the mean.
        driver.poll(case, random.next_u64() % 81).unwrap();
        let before = (driver.statistics(), driver.stop());
        let mut bytes = [0; State::<1>::BYTES];
        driver.save(case).write(&mut bytes).unwrap();
        driver = Driver::restore(case, 0, options, &State::read(&bytes).unwrap()).unwrap();
        // Walks that were lost and run again would end with the same bits, too.
        assert_eq!((driver.statistics(), driver.stop()), before);
    }
    driver.poll(case, u64::MAX).unwrap();
    driver.statistics()[0]
}

fn on_threads(threads: usize, job: &dyn Job, options: RunOptions) -> Statistics {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    let pool = pool.build().unwrap();
    let run = || fredholm_rayon::run(job, &options, None, &());
    pool.install(run).unwrap().statistics[0]
}
