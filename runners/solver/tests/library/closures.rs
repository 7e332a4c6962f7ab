//! Equations of closures, and what may be said of them besides kernel and source.

use core::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;

use fredholm::StopReason;
use fredholm::{
    CubeModel, Method, Observer, Region, Report, Scalar, SolveError, SolveObserver, Solver,
    SystemModel,
};

/// ½ x y, whose solution with F(x) = x is 6x/5.
fn product() -> CubeModel {
    CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]).with_solution(|x| 1.2 * x[0])
}

/// Every goal of a report is within so many standard errors of its exact value.
fn agrees(report: &Report, most: f64) {
    for goal in &report.goals {
        assert!(goal.z.unwrap().abs() < most, "{goal:?}");
    }
}

#[test]
fn weights_are_functions_of_the_coordinates() {
    let model = product();
    for scalar in [Scalar::F64, Scalar::F32] {
        let report = Solver::new(&model)
            .weight("first", |x| x[0])
            .weight("right half", |x| if x[0] < 0.5 { 0.0 } else { 1.0 })
            .mean()
            .scalar(scalar)
            .cells(8)
            .degree(0)
            .walks(20_000)
            .solve()
            .unwrap();
        agrees(&report, 4.5);
        // ∫ x u, and ∫ u over the right half, of which no rule on few cells is sure.
        let exact = [Some(0.4), Some(0.45), Some(0.6)];
        for (goal, exact) in report.goals.iter().zip(exact) {
            let error = goal.exact.unwrap() - exact.unwrap();
            assert!(error.abs() < 1e-12, "{goal:?}");
        }
        assert_eq!(report.goals[1].name, "right half");
    }
    let predicted = Solver::new(&model)
        .weight("first", |x| x[0])
        .cells(8)
        .degree(0)
        .diagnose_in(800)
        .unwrap();
    let measured = Solver::new(&model)
        .method(Method::Walks)
        .weight("first", |x| x[0])
        .cells(8)
        .degree(0)
        .walks(1 << 15)
        .solve()
        .unwrap();
    let ratio = predicted.targets[0].preconditioned.unwrap()
        / measured.goals[0].preconditioned.std_dev.unwrap();
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    let nan = Solver::new(&model).weight("root", |x| (x[0] - 0.5).sqrt());
    let error = nan.cells(8).walks(100).solve().unwrap_err();
    assert!(error.to_string().contains("`weight` is NaN"), "{error}");
}

#[test]
fn a_kernel_of_factors_is_the_kernel() {
    let factors = CubeModel::from_factors::<2>(
        |axis, x, y| (if axis == 0 { 0.5 } else { 1.0 }) * (-x * y).exp(),
        |x| 1.0 + x[0] * x[1],
    );
    let general = CubeModel::from_fn::<2>(
        |x, y| 0.5 * (-x[0] * y[0] - x[1] * y[1]).exp(),
        |x| 1.0 + x[0] * x[1],
    );
    let [factors, general] = [&factors, &general].map(|model| {
        let solver = Solver::new(model).mean().at([0.3, 0.9]).cells(6);
        solver.walks(20_000).solve().unwrap()
    });
    for (a, b) in factors.goals.iter().zip(&general.goals) {
        assert!((a.galerkin - b.galerkin).abs() < 1e-12);
        let [a, b] = [a, b].map(|goal| goal.preconditioned.estimate.unwrap());
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
}

#[test]
fn an_equation_may_live_on_other_intervals() {
    // u(x, y) = ∫∫ u/12 + x y on [−1, 2] × [0, 2], where ∫∫ x y = 3: u = x y + ½.
    let model = CubeModel::from_fn::<2>(|_, _| 1.0 / 12.0, |x| x[0] * x[1])
        .on([[-1.0, 2.0], [0.0, 2.0]])
        .with_solution(|x| x[0] * x[1] + 0.5);
    for scalar in [Scalar::F64, Scalar::F32] {
        let solver = Solver::new(&model)
            .at([-0.5, 1.5])
            .mean()
            .weight("x", |x| x[0]);
        let report = solver
            .scalar(scalar)
            .cells(5)
            .walks(20_000)
            .solve()
            .unwrap();
        agrees(&report, 4.5);
        assert_eq!(report.goals[0].exact, Some(-0.25));
    }
    let error = Solver::new(&model).at([-1.5, 1.0]).solve().unwrap_err();
    assert!(error.to_string().contains("from -1 to 2"), "{error}");
    for wrong in [vec![[0.0, 1.0]], vec![[0.0, 1.0], [1.0, 1.0]]] {
        let model = CubeModel::from_fn::<2>(|_, _| 0.1, |_| 1.0).on(wrong);
        let error = Solver::new(&model).mean().solve().unwrap_err();
        assert!(
            error.to_string().contains("one interval for each axis"),
            "{error}"
        );
    }
}

#[test]
fn a_value_that_is_not_finite_is_told_with_its_place() {
    // Only walks come there: no quadrature point of 8 cells lies so near to 1.
    let hole = |x: &[f64; 1], y: &[f64; 1]| {
        if y[0] > 0.999 { f64::NAN } else { 0.5 * x[0] }
    };
    let model = CubeModel::from_fn::<1>(hole, |_| 1.0);
    let solver = Solver::new(&model).at(0.25).cells(8).walks(100_000);
    for solver in [
        solver.clone(),
        solver.clone().degree(1),
        solver.scalar(Scalar::F32),
    ] {
        let error = solver.allow_infinite_variance().solve().unwrap_err();
        let text = error.to_string();
        assert!(
            text.contains("`kernel` is NaN at x = ") && text.contains("y = 0.999"),
            "{text}"
        );
    }
}

/// Sees how many walks there were, and how many values of the kernel before them; cancels after so many walks.
struct Sees {
    kernels: Arc<AtomicU64>,
    before: AtomicU64,
    walked: AtomicU64,
    begun: AtomicU64,
    most: u64,
}

impl Observer for Sees {
    fn walked(&self, walks: u64) {
        self.walked.fetch_add(walks, Ordering::Relaxed);
    }

    fn cancelled(&self) -> bool {
        self.walked.load(Ordering::Relaxed) >= self.most
    }
}

impl SolveObserver for Sees {
    fn walking(&self) {
        self.begun.fetch_add(1, Ordering::Relaxed);
        let kernels = self.kernels.load(Ordering::Relaxed);
        self.before.store(kernels, Ordering::Relaxed);
    }
}

#[test]
fn a_thousand_points_take_one_set_up_are_seen_and_cancelled() {
    let solved = |side: usize, most: u64| {
        let kernels = Arc::new(AtomicU64::new(0));
        let counter = kernels.clone();
        let model = CubeModel::from_fn::<2>(
            move |x, y| {
                counter.fetch_add(1, Ordering::Relaxed);
                0.5 * (-x[0] * y[1]).exp()
            },
            |x| 1.0 + x[0],
        );
        let sees = Sees {
            kernels,
            before: AtomicU64::new(0),
            walked: AtomicU64::new(0),
            begun: AtomicU64::new(0),
            most,
        };
        let solver = Solver::new(&model).grid(side).cells(6).walks(1024);
        let solver = solver.method(Method::Walks);
        let result = solver.observer(&sees).solve();
        let [before, walked, begun] =
            [sees.before, sees.walked, sees.begun].map(AtomicU64::into_inner);
        (result, before, walked, begun)
    };
    let (one, set_up, ..) = solved(1, u64::MAX);
    assert_eq!(one.unwrap().goals.len(), 1);
    // 32 × 32 points: about as many values of the kernel before the walks, which begin once. Pilots are of eight points.
    let (all, before, walked, begun) = solved(32, u64::MAX);
    let all = all.unwrap();
    assert!(before < 2 * set_up, "{before} {set_up}");
    assert_eq!((walked, begun), (1024 * 1024, 1));
    assert_eq!(all.goals.len(), 1024);
    let place = |number: usize| format!("{:?}", all.goals[number].at);
    assert!(place(33).contains("[0.0322") && place(1023).contains("[1.0, 1.0]"));
    let (cancelled, ..) = solved(32, 250_000);
    let error = cancelled.unwrap_err();
    assert!(matches!(error, SolveError::Cancelled(_)), "{error}");
    let so_far = error.report().unwrap();
    assert_eq!(
        (so_far.goals.len(), so_far.stop),
        (1024, StopReason::Cancelled)
    );
    let walks: u64 = so_far.goals.iter().map(|goal| goal.walks).sum();
    assert!((250_000..1024 * 1024).contains(&walks), "{walks}");
    let scored = |goal: &&fredholm::report::GoalReport| goal.preconditioned.std_error.is_some();
    assert!(so_far.goals.iter().filter(scored).count() > 200);
}

/// On a half line and in a system, by the walks of a chain and by one set of them for all.
#[test]
fn infinite_domains_and_systems_are_walked_together() {
    let half = CubeModel::on_interval(
        [0.0, f64::INFINITY],
        |x, y| 0.5 * (-x - y).exp(),
        |x| (-x).exp(),
    )
    .with_solution(|x| 4.0 / 3.0 * (-x[0]).exp());
    // u = 1 + ½ ∫ y v and v = x + ½ ∫ u: ∫ u = 1 + ½ ∫ y v, and ∫ y v = ⅓ + ¼ ∫ u.
    let of_u = 4.0 / 3.0;
    let system = SystemModel::new(
        [[0.0, 1.0]],
        2,
        |[i, j], _, y| {
            if i == j {
                0.0
            } else {
                0.5 * if i == 0 { y[0] } else { 1.0 }
            }
        },
        |i, x| if i == 0 { 1.0 } else { x[0] },
    )
    .with_solution(move |i, x| if i == 0 { of_u } else { x[0] + 0.5 * of_u })
    .weight("moment of v", 1, |x| x[0]);
    for together in [false, true] {
        let solver = |model| {
            Solver::new(model)
                .method(Method::Walks)
                .together(together)
                .cells(8)
                .degree(0)
                .walks(20_000)
        };
        agrees(&solver(&half).at(1.0).at(2.0).solve().unwrap(), 4.9);
        let report = solver(&system)
            .at([0.3, 2.0])
            .goal("mean of v", Region::Part(1))
            .weighted("moment of v")
            .solve()
            .unwrap();
        agrees(&report, 4.9);
    }
    let solver = Solver::new(&system).method(Method::Walks).cells(8);
    let solver = solver.goal("mean of v", Region::Part(1));
    let found = solver.weighted("moment of v").diagnose_in(200).unwrap();
    let exact = [0.5 + 0.5 * of_u, 1.0 / 3.0 + 0.25 * of_u];
    for (target, exact) in found.targets.iter().zip(exact) {
        // By a rule of 100 points in each copy, whose error is of their distance squared.
        assert!((target.solution - exact).abs() < 1e-4, "{target:?}");
    }
}

/// Without a kernel u is F in every point, and integrals are those of F, whatever the map from [0, 1].
#[test]
fn points_and_measures_are_those_of_the_domain() {
    const INF: f64 = f64::INFINITY;
    const RIGHT: f64 = core::f64::consts::FRAC_PI_2;
    let cases = [
        ([-1.0, 3.0], [-1.0, 0.7], 3.0_f64.atan() + 1.0_f64.atan()),
        ([2.0, INF], [2.000_001, 1e5], RIGHT - 2.0_f64.atan()),
        ([-INF, -1.5], [-1e5, -1.6], RIGHT - 1.5_f64.atan()),
        ([-INF, INF], [-1e12, 0.3], 2.0 * RIGHT),
    ];
    for (ends, points, integral) in cases {
        let far = |x: f64| (1.0 + x.abs()).ln();
        let u = CubeModel::on_interval(ends, |_, _| 0.0, far);
        let report = Solver::new(&u).at(points[0]).at(points[1]).solve().unwrap();
        for (goal, x) in report.goals.iter().zip(points) {
            assert!((goal.value() - far(x)).abs() < 1e-9, "{ends:?} {goal:?}");
        }
        let u = CubeModel::on_interval(ends, |_, _| 0.0, |x| 1.0 / (1.0 + x * x));
        let report = Solver::new(&u).weight("all", |_| 1.0).solve_to(1e-4);
        let all = report.unwrap()[0].value();
        assert!((all - integral).abs() < 5e-4, "{ends:?}: {all}");
    }
    let plane = CubeModel::from_fn::<2>(|_, _| 0.0, |x| (-x[1]).exp()).on([[1.0, 4.0], [0.0, INF]]);
    let report = Solver::new(&plane).weight("all", |_| 1.0).solve_to(1e-3);
    assert!((report.unwrap()[0].value() - 3.0).abs() < 5e-3);
}
