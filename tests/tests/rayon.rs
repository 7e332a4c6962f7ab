//! The runner for all cores: the same bits for any number of threads, and every way to stop.

use core::sync::atomic::{AtomicU64, Ordering};
use core::time::Duration;

use fredholm_circle::{Circle, Harmonic, MeanOver};
use fredholm_core::{At, Estimator, Functional, Neighbour, Real, Statistics, Uniforms};
use fredholm_rayon::{
    ENOUGH_BATCHES, Observer, Outcome, Plan, RunError, Stop, Target, TargetError, run,
};
use fredholm_tests::check::means;
use fredholm_tests::circle::{DEFAULT, LIGHT, OnCircle, RHO, with_piecewise};

type OnScene<'a, F> = Circle<'a, F, Harmonic>;

/// A point or a mean, as one type.
enum Start<'a, 'b, F: Real> {
    Point(At<fredholm_circle::Point<F>>),
    Mean(MeanOver<'a, 'b, F, Harmonic>),
}

impl<'b, F: Real> Functional<OnScene<'b, F>> for Start<'_, 'b, F> {
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (fredholm_circle::Point<F>, F) {
        match self {
            Self::Point(at) => Functional::<OnScene<'b, F>>::start(at, uniforms),
            Self::Mean(mean) => mean.start(uniforms),
        }
    }
}

/// Runs the plan for a point and a mean on so many threads.
fn on_threads<F: Real>(threads: usize, plan: &Plan, observer: &impl Observer) -> Outcome {
    with_piecewise::<F, _, _, _>(&RHO, 100, LIGHT, DEFAULT, |circle, neighbour, v| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().unwrap();
        pool.install(|| outcome(circle, neighbour, v, plan, observer).unwrap())
    })
}

fn outcome<'a, F: Real>(
    circle: &OnScene<'a, F>,
    neighbour: &OnCircle<'_, F, Harmonic, fredholm_core::galerkin::OffDiagonal>,
    v: &[F],
    plan: &Plan,
    observer: &impl Observer,
) -> Result<Outcome, RunError> {
    let x0 = circle.point(0.3);
    let mean = MeanOver::new(circle, 1.0, 4.0).unwrap();
    let targets = [
        Target {
            neighbour_value: Some(neighbour.value(&neighbour.locate(x0)).to_f64()),
            functional: Start::Point(At(x0)),
        },
        Target {
            neighbour_value: Some(mean.of(v)),
            functional: Start::Mean(mean),
        },
    ];
    run(circle, neighbour, &targets, plan, observer)
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    fn check<F: Real>(estimator: Estimator, target_error: Option<TargetError>) {
        let mut plan = Plan::new(100_001);
        plan.batch = 1000;
        plan.estimator = estimator;
        plan.target_error = target_error;
        let one = on_threads::<F>(1, &plan, &());
        for threads in [1, 2, 3, 7] {
            let other = on_threads::<F>(threads, &plan, &());
            assert_eq!(one.statistics, other.statistics, "{threads} threads");
            assert_eq!(one.stop, other.stop);
        }
    }
    for estimator in [Estimator::Absorption, Estimator::Collision] {
        for error in [
            None,
            Some(TargetError::Absolute(8e-4)),
            Some(TargetError::Relative(1e-9)),
        ] {
            check::<f64>(estimator, error);
            check::<f32>(estimator, error);
        }
    }
}

#[test]
fn a_target_error_is_reached_for_every_target_or_said_not_to_be() {
    let mut plan = Plan::new(1_000_000);
    plan.batch = 1000;
    plan.target_error = Some(TargetError::Absolute(8e-4));
    let reached = on_threads::<f64>(2, &plan, &());
    assert_eq!(reached.stop, Stop::Done);
    for statistics in &reached.statistics {
        assert!(statistics.preconditioned().std_error.unwrap() <= 8e-4);
        assert!((ENOUGH_BATCHES * 1000..1_000_000).contains(&statistics.walks()));
    }
    // The mean varies more than the point, so it needs more walks.
    assert!(reached.statistics[0].walks() < reached.statistics[1].walks());

    plan.walks = 20_000;
    plan.target_error = Some(TargetError::Absolute(1e-5));
    let missed = on_threads::<f64>(2, &plan, &());
    assert_eq!(missed.stop, Stop::ErrorNotReached);
    assert!(missed.statistics.iter().all(|s| s.walks() == 20_000));

    // Even where the error bar is small enough at once, a few batches are not believed.
    plan.walks = 15_000;
    plan.target_error = Some(TargetError::Absolute(1.0));
    assert_eq!(on_threads::<f64>(2, &plan, &()).stop, Stop::ErrorNotReached);
    plan.walks = 16_000;
    assert_eq!(on_threads::<f64>(2, &plan, &()).stop, Stop::Done);
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
        let mut plan = Plan::new(50_000_000);
        plan.batch = batch;
        let observer = CancelAfter {
            limit: 200_000,
            walked: AtomicU64::new(0),
            merged: AtomicU64::new(0),
        };
        let cut = on_threads::<f64>(threads, &plan, &observer);
        assert_eq!(cut.stop, Stop::Cancelled);
        assert!(observer.merged.load(Ordering::Relaxed) > 0);
        let walks: u64 = cut.statistics.iter().map(Statistics::walks).sum();
        let walked = observer.walked.load(Ordering::Relaxed);
        assert!(walks > 0 && walks <= walked, "{walks} of {walked}");
        // Only what was begun behind a gap is lost: less than a batch of each thread.
        assert!(walks + 200_000.min(batch) * threads as u64 >= walked);
        for (target, statistics) in cut.statistics.iter().enumerate() {
            if statistics.walks() > 0 {
                let mut again = Plan::new(statistics.walks());
                again.batch = batch;
                let whole = on_threads::<f64>(2, &again, &());
                assert_eq!(&whole.statistics[target], statistics);
            }
        }
    }
}

#[test]
fn a_time_limit_ends_a_run_of_any_batch_size() {
    for batch in [4096, 1_000_000_000] {
        let mut plan = Plan::new(1_000_000_000_000);
        plan.batch = batch;
        plan.time_limit = Some(Duration::from_millis(50));
        let cut = on_threads::<f64>(2, &plan, &());
        assert_eq!(cut.stop, Stop::TimeLimit);
        assert!(cut.statistics.iter().any(|s| s.walks() > 0));
    }
}

#[test]
fn a_time_limit_ends_a_run_of_long_walks() {
    let tables = fredholm_circle::Tables::<f64>::new(&RHO, 10).unwrap();
    let circle = Circle::new(tables.cells(), LIGHT, 1e-12).unwrap();
    let targets = [Target {
        functional: At(circle.point(0.3)),
        neighbour_value: Some(0.0),
    }];
    let mut plan: Plan = Plan::new(1_000_000);
    plan.time_limit = Some(Duration::from_millis(50));
    let start = std::time::Instant::now();
    let none = fredholm_core::NoNeighbour::<OnScene<'_, f64>>::new();
    let cut = run(&circle, &none, &targets, &plan, &()).unwrap();
    assert_eq!(cut.stop, Stop::TimeLimit);
    // A walk of a million states takes some 10 ms; a batch of them would take a minute.
    assert!(start.elapsed() < Duration::from_secs(10));
    assert!(cut.statistics[0].walks() > 0);
    assert_eq!(
        cut.statistics[0].endings().step_limit,
        cut.statistics[0].walks()
    );
}

/// Any generator of `rand_core` serves; it is part of what the bits depend on.
#[test]
fn another_generator_gives_other_bits_and_the_same_mean() {
    with_piecewise::<f64, _, _, _>(&RHO, 100, LIGHT, DEFAULT, |circle, neighbour, _| {
        let x0 = circle.point(0.3);
        let targets = [Target {
            neighbour_value: Some(neighbour.value(&neighbour.locate(x0))),
            functional: At(x0),
        }];
        let default: Plan = Plan::new(100_000);
        let chacha: Plan<rand::rngs::ChaCha8Rng> = Plan::new(100_000);
        let default = run(circle, neighbour, &targets, &default, &()).unwrap();
        let chacha = run(circle, neighbour, &targets, &chacha, &()).unwrap();
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
    with_piecewise::<f64, _, _, _>(&RHO, 100, LIGHT, DEFAULT, |circle, neighbour, v| {
        let refused = |plan: &Plan| outcome(circle, neighbour, v, plan, &()).unwrap_err();
        assert_eq!(refused(&Plan::new(0)), RunError::NoWalks);
        let mut plan = Plan::new(10);
        plan.batch = 0;
        assert_eq!(refused(&plan), RunError::NoWalks);
        for error in [0.0, -1.0, f64::NAN] {
            let mut plan = Plan::new(10);
            plan.target_error = Some(TargetError::Absolute(error));
            assert_eq!(refused(&plan), RunError::TargetError);
        }
        let none: [Target<At<_>>; 0] = [];
        let error = run(
            circle,
            neighbour,
            &none,
            &Plan::<fredholm_core::DefaultGenerator>::new(1),
            &(),
        );
        assert_eq!(error.unwrap_err(), RunError::NoTarget);
    });
}
