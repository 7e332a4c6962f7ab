//! The firmware's cases on this machine, by either runner.

#[path = "../../runners/embedded/firmware/src/cases.rs"]
pub mod cases;
#[path = "../../runners/embedded/firmware/src/line.rs"]
pub mod line;

use cases::{Case, Runner, Start, drive};
use fredholm_core::rand_core::Rng;
use fredholm_core::{
    DefaultGenerator, Equation, Goal, Goals, Job, Neighbour, NeighbourOf, RunOptions, StateSpace,
    Statistics, Task, WalkOptions, WalkSeeds,
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

/// A case of an equation with any neighbour equation.
type OfEquation<'a, E, T> = Case<'a, E, AnyNeighbour<'a, E>, T>;
/// A neighbour equation of an equation.
type AnyNeighbour<'a, E> =
    dyn Neighbour<Scalar = <E as StateSpace>::Scalar, Point = <E as StateSpace>::Point> + Sync + 'a;

struct Workstation {
    with: With,
    lines: String,
}

impl Runner for Workstation {
    fn run<E: Equation + Sync, N: NeighbourOf<E> + Sync, T: Start<E>>(
        &mut self,
        name: &str,
        case: Case<'_, E, N, T>,
        goal: u64,
        run_options: RunOptions,
    ) {
        let estimator = case.estimator;
        // By its address: the compiler makes one walk of an equation, whatever its neighbours.
        let case: OfEquation<'_, E, T> = Task {
            neighbour: case.neighbour,
            equation: case.equation,
            functional: case.functional,
            control_mean: case.control_mean,
            estimator,
            form: case.form,
            seeds: case.seeds,
            length: case.length,
        };
        let statistics = match self.with {
            With::Embedded(walks) => drive(case, run_options, walks, || ()).expect("a run ends"),
            With::Resets(seed) => with_resets(seed, case, run_options),
            With::Rayon(threads) => on_threads(threads, &case, goal, run_options),
        };
        line::line::<E::Scalar>(&mut self.lines, name, estimator, &statistics)
            .expect("writing to a string does not fail");
    }
}

/// At each reset the bytes of the state survive, and nothing else.
fn with_resets<E: Equation + Sync, T: Start<E>>(
    seed: u64,
    case: OfEquation<'_, E, T>,
    run_options: RunOptions,
) -> Statistics {
    let again = || Task { ..case };
    let mut random = WalkSeeds::<DefaultGenerator>::new(seed, 0).generator(0);
    let mut driver = Driver::new(again(), run_options).unwrap();
    for _ in 0..100 {
        // 4000 walks in the mean.
        driver.poll(random.next_u64() % 81).unwrap();
        let before = (driver.statistics(), driver.stop());
        let bytes = driver.save().to_bytes();
        driver =
            Driver::restore(again(), run_options, &State::from_bytes(&bytes).unwrap()).unwrap();
        // Walks that were lost and run again would end with the same bits, too.
        assert_eq!((driver.statistics(), driver.stop()), before);
    }
    driver.poll(u64::MAX).unwrap();
    driver.statistics()
}

fn on_threads<E: Equation + Sync, T: Start<E>>(
    threads: usize,
    case: &OfEquation<'_, E, T>,
    goal: u64,
    run_options: RunOptions,
) -> Statistics {
    // Goals are numbered from 0: the last one is the case's.
    let one = Goal {
        functional: *case.functional,
        control_mean: case.control_mean,
    };
    let goals = vec![one; goal as usize + 1];
    let options = WalkOptions {
        seed: cases::SEED,
        estimator: case.estimator,
        form: case.form,
        survivals: case.length.survivals,
        step_limit: case.length.step_limit,
    };
    let job = Goals::new(case.equation, case.neighbour, &goals, options);
    run_on(threads, &job, run_options, goal as usize)
}

fn run_on(threads: usize, job: &dyn Job, run_options: RunOptions, goal: usize) -> Statistics {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    let pool = pool.build().unwrap();
    let run = || fredholm_rayon::run(job, &run_options, None, &());
    pool.install(run).unwrap().statistics[goal]
}
