//! The runner for all cores: the same bits for any number of threads, and every way to stop.

use core::slice::from_mut;
use core::sync::atomic::{AtomicU64, Ordering};
use core::time::Duration;

use fredholm_circle::{Harmonic, MeanOver};
use fredholm_core::galerkin::DiagonalRule;
use fredholm_core::{
    Absorption, At, Batch, Estimator, Functional, Goal, Goals, Job, MIN_BATCHES, Neighbour,
    NoNeighbour, NotFinite, Real, RunOptions, RunOptionsError, Schedule, StartOf, Statistics,
    StopReason, Tolerance, Uniforms, WalkOptions,
};
use fredholm_embedded::Driver;
use fredholm_rayon::{Observer, Outcome, RunError, run};
use fredholm_tests::check::means;
use fredholm_tests::circle::{DEFAULT, LIGHT, OnCircle, Owned, RHO, circle, with_piecewise};
use fredholm_tests::paper;

type OnScene<F> = Owned<F, Harmonic>;
type Lights<'a, F> = OnCircle<'a, F, Harmonic, DiagonalRule>;

/// A point or a mean, as one type.
enum Start<F: Real> {
    Point(At<fredholm_circle::Point<F>>),
    Mean(MeanOver),
}

impl<F: Real> Functional<OnScene<F>> for Start<F> {
    fn start<U: Uniforms<F>>(&self, circle: &OnScene<F>, uniforms: &mut U) -> StartOf<OnScene<F>> {
        match self {
            Self::Point(at) => at.start(circle, uniforms),
            Self::Mean(mean) => mean.start(circle, uniforms),
        }
    }
}

/// What is run: run options, what walks have in common, and a time limit.
#[derive(Clone, Copy)]
struct Asked {
    run_options: RunOptions,
    walks: WalkOptions,
    time_limit: Option<Duration>,
}

impl Asked {
    fn new(walks: u64, batch: u64) -> Self {
        Self {
            run_options: RunOptions {
                batch,
                ..RunOptions::new(walks)
            },
            walks: WalkOptions::default(),
            time_limit: None,
        }
    }
}

/// Calls back with the job of a point and a mean.
fn with_job<F: Real, R>(
    options: WalkOptions,
    then: impl FnOnce(&Goals<'_, OnScene<F>, Lights<'_, F>, Start<F>>) -> R,
) -> R {
    with_piecewise::<F, _, _, _>(&RHO, 100, LIGHT, DEFAULT, |circle, neighbour, v| {
        let x0 = circle.point(0.3);
        let mean = MeanOver::new(1.0, 4.0).unwrap();
        let value = neighbour.value(&neighbour.locate(x0)).to_f64();
        let goals = [
            Goal::new(Start::Point(At(x0)), Some(value)),
            Goal::new(Start::Mean(mean), Some(mean.of(100, v))),
        ];
        then(&Goals::new(circle, neighbour, &goals, options))
    })
}

/// Runs a point and a mean on so many threads.
fn on_threads<F: Real>(threads: usize, asked: &Asked, observer: &dyn Observer) -> Outcome {
    with_job::<F, _>(asked.walks, |job| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let run = || run(job, &asked.run_options, asked.time_limit, observer);
        pool.build().unwrap().install(run).unwrap()
    })
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    fn check<F: Real>(walks: WalkOptions, tolerance: Option<Tolerance>) {
        let mut asked = Asked::new(40_001, 400);
        asked.walks = walks;
        asked.run_options.tolerance = tolerance;
        let one = on_threads::<F>(1, &asked, &());
        let threads: &[usize] = if cfg!(feature = "long") {
            &[1, 2, 3, 7]
        } else {
            &[2, 7]
        };
        for &threads in threads {
            let other = on_threads::<F>(threads, &asked, &());
            assert_eq!(one.statistics, other.statistics, "{threads} threads");
            assert_eq!(one.stop, other.stop);
        }
    }
    for walks in [WalkOptions::default(), paper(Estimator::Absorption, 1)] {
        for tolerance in [
            None,
            Some(Tolerance::Absolute(8e-4)),
            Some(Tolerance::Relative(1e-9)),
        ] {
            check::<f64>(walks, tolerance);
            check::<f32>(walks, tolerance);
        }
    }
}

#[test]
fn a_tolerance_is_reached_for_every_goal_or_said_not_to_be() {
    let mut asked = Asked::new(1_000_000, 1000);
    asked.run_options.tolerance = Some(Tolerance::Absolute(8e-4));
    let reached = on_threads::<f64>(2, &asked, &());
    assert_eq!(reached.stop, StopReason::Done);
    for statistics in &reached.statistics {
        assert!(statistics.preconditioned().std_error.unwrap() <= 8e-4);
        assert!((MIN_BATCHES * 1000..1_000_000).contains(&statistics.walks()));
    }
    // The mean varies more than the point, so it needs more walks.
    assert!(reached.statistics[0].walks() < reached.statistics[1].walks());

    asked.run_options.walks = 20_000;
    asked.run_options.tolerance = Some(Tolerance::Absolute(1e-5));
    let missed = on_threads::<f64>(2, &asked, &());
    assert_eq!(missed.stop, StopReason::ToleranceNotReached);
    assert!(missed.statistics.iter().all(|s| s.walks() == 20_000));

    // Even where the error bar is small enough at once, a few batches are not believed.
    asked.run_options.walks = 15_000;
    asked.run_options.tolerance = Some(Tolerance::Absolute(1.0));
    let stop = on_threads::<f64>(2, &asked, &()).stop;
    assert_eq!(stop, StopReason::ToleranceNotReached);
    asked.run_options.walks = 16_000;
    let stop = on_threads::<f64>(2, &asked, &()).stop;
    assert_eq!(stop, StopReason::Done);
}

/// Cancels after so many walks, and counts.
struct CancelAfter {
    limit: u64,
    walked: AtomicU64,
    merged: AtomicU64,
}

impl Observer for CancelAfter {
    fn walked(&self, walks: u64) {
        self.walked.fetch_add(walks, Ordering::Relaxed);
    }
    fn merged(&self, _: &[Statistics]) {
        self.merged.fetch_add(1, Ordering::Relaxed);
    }
    fn cancelled(&self) -> bool {
        self.walked.load(Ordering::Relaxed) >= self.limit
    }
}

#[test]
fn a_cancelled_run_keeps_the_walks_from_the_front() {
    for (batch, threads) in [(1000, 3), (50_000_000, 2), (100_000, 1)] {
        let asked = Asked::new(50_000_000, batch);
        let observer = CancelAfter {
            limit: 200_000,
            walked: AtomicU64::new(0),
            merged: AtomicU64::new(0),
        };
        let cut = on_threads::<f64>(threads, &asked, &observer);
        assert_eq!(cut.stop, StopReason::Cancelled);
        assert!(observer.merged.load(Ordering::Relaxed) > 0);
        let walks: u64 = cut.statistics.iter().map(Statistics::walks).sum();
        let walked = observer.walked.load(Ordering::Relaxed);
        assert!(walks > 0 && walks <= walked, "{walks} of {walked}");
        // Only what was begun behind a gap is lost: less than a batch of each thread.
        assert!(walks + 200_000.min(batch) * threads as u64 >= walked);
        for (goal, statistics) in cut.statistics.iter().enumerate() {
            if statistics.walks() > 0 {
                let again = Asked::new(statistics.walks(), batch);
                let whole = on_threads::<f64>(2, &again, &());
                assert_eq!(&whole.statistics[goal], statistics);
            }
        }
    }
}

#[test]
fn a_time_limit_ends_a_run_of_any_batch_size() {
    for batch in [4096, 1_000_000_000] {
        let mut asked = Asked::new(1_000_000_000_000, batch);
        asked.time_limit = Some(Duration::from_millis(50));
        let cut = on_threads::<f64>(2, &asked, &());
        assert_eq!(cut.stop, StopReason::TimeLimit);
        assert!(cut.statistics.iter().any(|s| s.walks() > 0));
    }
}

#[test]
fn a_time_limit_ends_a_run_of_long_walks() {
    let circle = circle::<f64, f64, _>(&RHO, 10, LIGHT);
    let goals = [Goal::new(At(circle.point(0.3)), Some(0.0))];
    let options = WalkOptions {
        absorption: Absorption::Constant {
            probability: 1e-12,
            estimator: Estimator::Absorption,
        },
        ..WalkOptions::default()
    };
    let limit = Some(Duration::from_millis(50));
    let start = std::time::Instant::now();
    let none = NoNeighbour::new(&circle);
    let job = Goals::new(&circle, &none, &goals, options);
    let cut = run(&job, &RunOptions::new(1_000_000), limit, &()).unwrap();
    assert_eq!(cut.stop, StopReason::TimeLimit);
    // A walk of a million states takes some 10 ms; a batch of them would take a minute.
    assert!(start.elapsed() < Duration::from_secs(10));
    assert!(cut.statistics[0].walks() > 0);
    assert_eq!(
        cut.statistics[0].terminations().step_limit,
        cut.statistics[0].walks()
    );
}

/// Any generator of `rand_core` serves; it is part of what the bits depend on.
#[test]
fn another_generator_gives_other_bits_and_the_same_mean() {
    with_piecewise::<f64, _, _, _>(&RHO, 100, LIGHT, DEFAULT, |circle, neighbour, _| {
        let x0 = circle.point(0.3);
        let value = neighbour.value(&neighbour.locate(x0));
        let goals = [Goal::new(At(x0), Some(value))];
        let run_options = RunOptions::new(100_000);
        let default = Goals::new(circle, neighbour, &goals, WalkOptions::default());
        let chacha = default.with_generator::<rand::rngs::ChaCha8Rng>();
        let default = run(&default, &run_options, None, &()).unwrap();
        let chacha = run(&chacha, &run_options, None, &()).unwrap();
        assert_ne!(default.statistics, chacha.statistics);
        for outcome in [default, chacha] {
            means(&outcome.statistics[0], Some(LIGHT.solution(0.3)), 1e-13)
                .ok()
                .unwrap();
        }
    });
}

#[test]
fn impossible_plans_are_refused() {
    let refused = |run_options| {
        with_job::<f64, _>(WalkOptions::default(), |job| {
            run(job, &run_options, None, &())
        })
        .unwrap_err()
    };
    let no_walks = RunError::Options(RunOptionsError::NoWalks);
    assert_eq!(refused(RunOptions::new(0)), no_walks);
    assert_eq!(refused(Asked::new(10, 0).run_options), no_walks);
    for bound in [0.0, -1.0, f64::NAN] {
        let mut run_options = RunOptions::new(10);
        run_options.tolerance = Some(Tolerance::Absolute(bound));
        assert_eq!(
            refused(run_options),
            RunError::Options(RunOptionsError::Tolerance)
        );
    }
    with_job::<f64, _>(WalkOptions::default(), |job| {
        let mut none = *job;
        none.goals = &[];
        let error = run(&none, &RunOptions::new(1), None, &()).unwrap_err();
        assert_eq!(error, RunError::NoGoal);
    });
}

/// One batch after the other, each in pieces: the schedule and nothing else.
fn one_by_one(
    job: &dyn Job,
    run_options: RunOptions,
) -> Result<(Vec<Statistics>, StopReason), NotFinite> {
    let mut schedule = Schedule::new(run_options).unwrap();
    let mut statistics = vec![Statistics::default(); job.goals()];
    let mut stops = vec![None; job.goals()];
    while stops.contains(&None) {
        for index in schedule.stage() {
            for goal in (0..job.goals()).filter(|&goal| stops[goal].is_none()) {
                let mut batch = Batch::new(index, run_options.batch, run_options.walks);
                while !batch.is_done() {
                    job.run(goal, from_mut(&mut batch), 37)?;
                }
                statistics[goal].merge(&batch.statistics());
            }
        }
        schedule.end_stage();
        for (stop, merged) in stops.iter_mut().zip(&statistics) {
            *stop = stop.or_else(|| schedule.stop(merged));
        }
        schedule.begin_stage();
    }
    Ok((statistics, stops.into_iter().flatten().max().unwrap()))
}

/// A goal by the runner for devices, 77 walks at a time.
fn alone(job: &dyn Job, goal: usize, run_options: RunOptions) -> (Statistics, StopReason) {
    let mut driver = Driver::<_, 1>::new(job, goal, run_options).unwrap();
    loop {
        if let Some(stop) = driver.poll(job, 77).unwrap().stop {
            return (driver.statistics()[0], stop);
        }
    }
}

#[test]
fn every_runner_stops_every_goal_after_the_same_walk() {
    use StopReason::{Done, ToleranceNotReached};
    let cases = [
        (40_001, None, Done, [40_001; 2]),
        (
            60_001,
            Some(Tolerance::Absolute(1.5e-3)),
            Done,
            [4000, 6400],
        ),
        (60_001, Some(Tolerance::Relative(3e-4)), Done, [2400, 6400]),
        // The mean needs more walks, the point does not.
        (
            4001,
            Some(Tolerance::Absolute(1.5e-3)),
            ToleranceNotReached,
            [4000, 4001],
        ),
        // Too few batches for an error bar.
        (
            701,
            Some(Tolerance::Absolute(1.0)),
            ToleranceNotReached,
            [701; 2],
        ),
    ];
    for (walks, tolerance, expected, ends) in cases {
        let run_options = RunOptions {
            walks,
            batch: 50,
            tolerance,
        };
        with_job::<f64, _>(WalkOptions::default(), |job| {
            let (statistics, stop) = one_by_one(job, run_options).unwrap();
            let walks: Vec<_> = statistics.iter().map(Statistics::walks).collect();
            assert_eq!((stop, &walks[..]), (expected, &ends[..]), "{run_options:?}");
            for threads in [1, 3] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
                let pool = pool.build().unwrap();
                let outcome = pool.install(|| run(job, &run_options, None, &())).unwrap();
                assert_eq!((&outcome.statistics, outcome.stop), (&statistics, stop));
            }
            let alone = [0, 1].map(|goal| alone(job, goal, run_options));
            assert_eq!(alone.map(|(statistics, _)| statistics), statistics[..]);
            assert_eq!(alone.map(|(_, stop)| stop).into_iter().max(), Some(stop));
        });
    }
}

/// A goal that does not exist has no walks, and asking for it is no panic.
#[test]
fn a_goal_out_of_range_runs_nothing() {
    with_job::<f64, _>(WalkOptions::default(), |job| {
        let mut batch = Batch::new(0, 10, 10);
        assert_eq!(job.run(2, from_mut(&mut batch), 10), Ok(()));
        assert_eq!(batch, Batch::new(0, 10, 10));
        assert!(job.replay(2, 0).is_none());
        assert_eq!(job.run(1, from_mut(&mut batch), 10), Ok(()));
        assert!(batch.is_done());
    });
}
