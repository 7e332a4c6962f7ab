//! The firmware's cases on this machine, by either runner.

#[path = "../../runners/embedded/firmware/src/cases.rs"]
pub mod cases;
#[path = "../../runners/embedded/firmware/src/line.rs"]
pub mod line;

use fredholm_core::{
    DefaultGenerator, Functional, Kernel, Neighbour, Real, Sampler, Source, Statistics, Task,
};
use fredholm_embedded::{Driver, Plan};
use fredholm_rayon::Target;

/// Which runner walks.
#[derive(Clone, Copy, Debug)]
pub enum With {
    /// `fredholm-embedded`, so many walks at a time.
    Embedded(u64),
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

struct Workstation {
    with: With,
    lines: String,
}

impl cases::Runner for Workstation {
    fn run<E, N, T>(
        &mut self,
        name: &str,
        task: Task<'_, E, N, T, DefaultGenerator>,
        target: u64,
        plan: Plan,
    ) where
        E: Sampler + Kernel + Source + Sync,
        N: Neighbour<Scalar = E::Scalar, Point = E::Point> + Sync,
        T: Functional<E> + Copy + Sync,
    {
        let estimator = task.estimator;
        let statistics = match self.with {
            With::Embedded(walks) => embedded(task, plan, walks),
            With::Rayon(threads) => on_threads(threads, &task, target, plan),
        };
        line::line::<E::Scalar>(&mut self.lines, name, estimator, &statistics)
            .expect("writing to a string does not fail");
    }
}

fn embedded<E, N, T>(
    task: Task<'_, E, N, T, DefaultGenerator>,
    plan: Plan,
    walks: u64,
) -> Statistics
where
    E: Sampler + Kernel + Source,
    N: Neighbour<Scalar = E::Scalar, Point = E::Point>,
    T: Functional<E>,
{
    let mut driver = Driver::new(task, plan).unwrap();
    while driver.poll(walks).unwrap().stop.is_none() {}
    driver.statistics()
}

fn on_threads<E, N, T>(
    threads: usize,
    task: &Task<'_, E, N, T, DefaultGenerator>,
    target: u64,
    plan: Plan,
) -> Statistics
where
    E: Sampler + Kernel + Source + Sync,
    E::Scalar: Real,
    N: Neighbour<Scalar = E::Scalar, Point = E::Point> + Sync,
    T: Functional<E> + Copy + Sync,
{
    let mut same: fredholm_rayon::Plan = fredholm_rayon::Plan::new(plan.walks);
    same.seed = cases::SEED;
    same.batch = plan.batch;
    same.estimator = task.estimator;
    same.step_limit = task.step_limit;
    same.target_error = plan.target_error;
    // Its targets are numbered from 0: the last one is the case's.
    let one = Target {
        functional: *task.functional,
        neighbour_value: task.neighbour_value,
    };
    let targets = vec![one; target as usize + 1];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    let pool = pool.build().unwrap();
    let run = || fredholm_rayon::run(task.equation, task.neighbour, &targets, &same, &());
    pool.install(run).unwrap().statistics[target as usize]
}
