//! Solutions in a few lines.

use core::f64::consts::PI;
use core::sync::atomic::{AtomicU64, Ordering};

use fredholm::StopReason;
use fredholm::choice::ChoiceReport;
use fredholm::circle::{Emission, Harmonic};
use fredholm::room::Material;
use fredholm::room::{RoomModel, Surfaces};
use fredholm::scene::{Enclosure, NamedSurface, SceneModel, shapes};
use fredholm::sphere::Parameters;
use fredholm::{
    CircleModel, CubeModel, CustomModel, Error, Estimator, Method, Model, Observer, Pairs, Region,
    Report, Scalar, Sequence, Settings, SolveError, SolveObserver, Solver, SphereModel,
};

use crate::common::{Line, is_long};

/// u(x) = ½ ∫ exp(−(x − y)²) u(y) dy + x on [0, 1].
fn gauss() -> CubeModel {
    CubeModel::from_fn::<1>(|x, y| 0.5 * (-(x[0] - y[0]).powi(2)).exp(), |x| x[0])
}

const PARAMETERS: Parameters = Parameters {
    albedo: 0.6,
    asymmetry: 0.3,
    emission: [1.0, 0.2, 0.1, 0.5],
    forward: 0.2,
};

/// A unit square of reflectance ½ whose floor shines.
fn square() -> RoomModel {
    let material = |emission| {
        vec![Material {
            reflectance: 0.5,
            emission,
        }]
    };
    let surfaces = Surfaces {
        names: vec!["floor".to_owned(), "walls".to_owned()],
        points: vec![
            vec![[0.0, 0.0], [1.0, 0.0]],
            vec![[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]],
        ],
        materials: vec![material(1.0), material(0.0)],
        ..Surfaces::default()
    };
    RoomModel::new(surfaces, Scalar::F64).unwrap()
}

/// Light on the circle whose solution is known, 5 + sin 5x.
fn wave() -> CircleModel {
    let light = Harmonic {
        constant: 5.0,
        amplitude: 1.0,
        frequency: 5,
    };
    CircleModel::new(vec![0.3, 0.7], Emission::Harmonic(light))
}

/// Without an error the choice is for the walks that are made, and leaves less variance than what was the default.
#[test]
fn given_walks_have_their_choice() {
    let u = wave();
    let solver = Solver::new(&u).mean().at(0.3).walks(20_000);
    let report = solver.clone().solve().unwrap();
    let choice = report.choice.as_ref().unwrap();
    assert_eq!((choice.walks, choice.predicted_walks), (Some(20_000), 4e4));
    let fixed = solver.cells(520).degree(0).pairs(Pairs::Default);
    let fixed = fixed.solve().unwrap();
    assert!(fixed.choice.is_none(), "nothing is open");
    for (chosen, fixed) in report.goals.iter().zip(&fixed.goals) {
        let [chosen, fixed] = [chosen, fixed].map(|goal| goal.preconditioned.std_error.unwrap());
        assert!(1e3 * chosen < fixed, "{chosen} {fixed}");
    }
}

/// One of many targets at which u is nearly 0 takes most walks to a part of u: the choice knows it before any walk of the answer, although pilots have
/// eight targets.
#[test]
fn the_hardest_target_is_among_those_of_pilots() {
    // ∫ e^−y cos 7y dy on [0, 1].
    let of_cosine = ((-1.0_f64).exp() * (7.0 * 7.0_f64.sin() - 7.0_f64.cos()) + 1.0) / 50.0;
    let model = CubeModel::from_fn::<1>(
        |[x], [y]| 0.6 * (3.0 * x).cos() * (-y).exp(),
        move |[x]| (7.0 * x).cos() - 0.6 * (3.0 * x).cos() * of_cosine,
    )
    .with_solution(|x| (7.0 * x[0]).cos());
    let mut solver = Solver::new(&model).method(Method::Walks).together(false);
    for number in 0..36 {
        // Number 5 is none of the eight that are evenly chosen.
        let x = match number {
            5 => PI / 14.0 + 1e-3,
            _ => f64::from(number) / 36.0,
        };
        solver = solver.at(x);
    }
    for error in [1e-6, 1e-7] {
        let report = solver.clone().solve_to_relative(error).unwrap();
        let walks: u64 = report.goals.iter().map(|goal| goal.walks).sum();
        let choice = report.choice.unwrap();
        // None were given up, and no more were made.
        let answer = choice.predicted_setup_seconds + choice.predicted_walk_seconds;
        assert!(choice.predicted_pilot_seconds < 0.25 * answer, "{choice:?}");
        assert!(
            walks as f64 <= 2.0 * choice.predicted_walks,
            "{walks}, {choice:?}"
        );
    }
}

#[test]
fn a_room_and_its_surfaces() {
    let report = Solver::new(&square())
        .over("floor")
        .on("walls", 0.5)
        .mean()
        .solve_to(1e-4);
    let report = report.unwrap();
    let u: Vec<f64> = report
        .goals
        .iter()
        .map(|g| g.preconditioned.estimate.unwrap())
        .collect();
    // What the floor emits is what all absorb: 1 = ½ · 4 · the mean of u.
    assert!((u[2] - 0.5).abs() < 5e-4, "{u:?}");
    assert!(u[0] > 1.0 && u[1] < u[2], "{u:?}");
    let names: Vec<&str> = report.goals.iter().map(|goal| goal.name.as_str()).collect();
    assert_eq!(names, ["floor", "u(walls, 0.5)", "mean"]);
}

/// Sobol' points: means and points of known solution, with errors below those of pseudo-random numbers, and the bits on
/// threads.
#[test]
fn sequences_keep_the_mean_and_gain() {
    // K = 0.4 + ½ cos πx₁ cos πy₂ with u = 2 + x₁ + cos πx₂: ∫ K u = 0.4 · 5/2 + ¼ cos πx₁.
    let u = |x: &[f64]| 2.0 + x[0] + (PI * x[1]).cos();
    let cube = CubeModel::from_fn::<2>(
        |x, y| 0.4 + 0.5 * (PI * x[0]).cos() * (PI * y[1]).cos(),
        move |x| u(x) - 1.0 - 0.25 * (PI * x[0]).cos(),
    )
    .with_solution(u);
    let circle = wave();
    let cases: [(&dyn Model, &[f64], usize, f64); 2] =
        [(&cube, &[0.3, 0.6], 3, 10.0), (&circle, &[1.0], 10, 1.5)];
    let mut worst = 0.0_f64;
    for (model, point, cells, gain) in cases {
        for (degree, scalar) in [(0, Scalar::F64), (1, Scalar::F32)] {
            let solver = Solver::new(model).at(point).mean().cells(cells);
            let solver = solver.degree(degree).scalar(scalar).walks(1 << 14);
            // Of both the same walks: roulette, too, varies less than absorption scored at the end.
            let solver = solver.absorption(0.2).estimator(Estimator::Absorption);
            let random = solver.clone().solve().unwrap();
            for forced_steps in [0, 6] {
                let solver = solver.clone().forced_steps(forced_steps);
                let sobol = solver.sequence(Sequence::Sobol).solve().unwrap();
                let sequence = sobol.chain.unwrap().sequence;
                assert_eq!((sequence, sobol.batch), (Some("sobol"), 512));
                for (goal, random) in sobol.goals.iter().zip(&random.goals) {
                    assert_eq!(goal.replicates, Some(32));
                    worst = worst.max(goal.z.unwrap().abs());
                    let [error, before] =
                        [goal, random].map(|g| g.preconditioned.std_error.unwrap());
                    // A sequence loses nothing but what the error bars do not know, and gains where absorption is late.
                    let at_least = if forced_steps == 0 { 0.5 } else { gain };
                    let found = (before / error).powi(2);
                    assert!(found > at_least, "{degree} {forced_steps} {error} {before}");
                }
            }
        }
    }
    // Of 16 values of Student's t of 31 degrees of freedom none is larger but with probability 16 · 3·10⁻⁴ = 0.5 %.
    assert!(worst < 4.1, "{worst}");
    let bits = |threads| {
        let solver = Solver::new(&circle).at(1.0).walks(5000);
        let solver = solver.sequence(Sequence::Sobol).forced_steps(2);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let report = pool.unwrap().install(|| solver.solve().unwrap());
        let found = report.goals[0].preconditioned;
        (found.estimate, found.std_error)
    };
    assert_eq!(bits(1), bits(3));
    match Solver::new(&square())
        .mean()
        .sequence(Sequence::Sobol)
        .solve()
    {
        Err(SolveError::Failed(error)) => {
            assert!(
                error.to_string().contains("for circles and cubes"),
                "{error}"
            );
        }
        other => panic!("{other:?}"),
    }
}

/// K = 0.4 + ½ cos mπx cos πy with u = 2 + x: ∫ K u = 1 − cos mπx/π², as ∫ y cos πy = −2/π².
macro_rules! waves {
    ($m:expr) => {
        CustomModel::from_kernel(Line::new(
            |x: f64, y: f64| 0.4 + 0.5 * ($m * PI * x).cos() * (PI * y).cos(),
            |x: f64| 1.0 + x + ($m * PI * x).cos() / (PI * PI),
            1,
        ))
        .with_solution(|x| 2.0 + x)
    };
}

/// A lift lowers the variance of a matrix of low degree by as much as a high degree does, and moves no mean: where a
/// polynomial is near T_K v', where it is far from it, and for a source that jumps within cells.
#[test]
fn lifts_gain_and_keep_the_mean() {
    let circle = wave();
    let smooth = waves!(1.0).weight("moment", |x| *x);
    let rough = waves!(9.0);
    // u = 1, and 2 from 3/8 on: ∫ u = 13/8.
    let jump = |x: f64| if x < 0.375 { 1.0 } else { 2.0 };
    let jump = CustomModel::from_kernel(Line::new(|_, _| 0.5, move |x| jump(x) - 0.8125, 1))
        .with_solution(move |x| jump(*x));
    // K is cut at y = x: ∫ ½ exp(−|x − y|) (1 + y) dy = 1 + x − 3/2 exp(x − 1).
    let kink = CustomModel::from_kernel(Line::new(
        |x: f64, y: f64| 0.5 * (-(x - y).abs()).exp(),
        |x: f64| 1.5 * (x - 1.0).exp(),
        1,
    ))
    .with_solution(|x| 1.0 + x);
    let cases: [(&dyn Model, usize, f64); 5] = [
        (&circle, 50, 300.0),
        (&smooth, 4, 30.0),
        (&kink, 4, 10.0),
        // One cell: T_K v' is no polynomial of degree 7.
        (&rough, 1, 0.0),
        (&jump, 2, 0.0),
    ];
    let mut worst = 0.0_f64;
    for (model, cells, gain) in cases {
        let solver = Solver::new(model)
            .method(Method::Walks)
            .at(0.3)
            .at(0.8)
            .mean()
            .cells(cells)
            .degree(0)
            .walks(1 << 15);
        let before = solver.clone().solve().unwrap();
        let is_circle = model.about().kind == "circle";
        let scalars = [Scalar::F64, Scalar::F32].into_iter();
        for scalar in scalars.take(if is_circle { 2 } else { 1 }) {
            let after = solver.clone().lift(4).scalar(scalar).solve().unwrap();
            let chain = after.chain.unwrap();
            assert_eq!((chain.lift, chain.pairs), (Some(4), "pointwise"));
            for (after, before) in after.goals.iter().zip(&before.goals) {
                worst = worst.max(after.z.unwrap().abs());
                let [after, before] = [after, before].map(|g| g.preconditioned.std_error.unwrap());
                let at_least = if scalar == Scalar::F64 { gain } else { 0.0 };
                assert!(at_least * after < before, "{cells} {after} {before}");
            }
        }
    }
    // Of 18 normal values none is larger but with probability 18 · 6.3·10⁻⁵ = 0.11 %.
    assert!(worst < 4.0, "{worst}");
    // ∫ x (2 + x) dx = 4/3, of which (v', Φ) is known.
    let moment = Solver::new(&smooth).weighted("moment").cells(64);
    let report = moment.lift(4).walks(1 << 14).solve().unwrap();
    let (off, error) = (report[0].value() - 4.0 / 3.0, report[0].std_error());
    assert!(off.abs() < 4.0 * error && error < 1e-4, "{off} {error}");
    // A cube: the lift of six constants has less than a tenth of the error, and so much of u = 6x/5 is left to see it.
    let cube = CubeModel::on_interval([0.0, 1.0], |x, y| 0.5 * x * y, |x| x);
    let at = Solver::new(&cube).at(0.4).cells(6).walks(1 << 14);
    let of_v = at.clone().method(Method::Walks).degree(0).solve();
    let lifted = at.lift(2).solve();
    let (of_v, lifted) = (of_v.unwrap()[0].std_error(), lifted.unwrap());
    let (off, error) = (lifted[0].value() - 0.48, lifted[0].std_error());
    assert!(off.abs() < 4.0 * error.max(1e-12), "{off} {error}");
    assert!(10.0 * error < of_v, "{error} {of_v}");
    // The global estimate.
    let whole = Solver::new(&rough)
        .cells(2)
        .lift(3)
        .walks(1 << 14)
        .whole()
        .unwrap();
    assert_eq!(
        (
            whole.summary().chain.unwrap().lift,
            whole.summary().score_degree
        ),
        (Some(3), 5)
    );
    for x in [0.0, 0.21, 0.5, 0.93] {
        let value = whole.at(x).unwrap();
        assert!(
            (value.estimate - 2.0 - x).abs() < 1.5 * value.band.unwrap(),
            "{x} {value:?}"
        );
    }
    let refused = |solver: Solver<'_>, text: &str| match solver.mean().solve() {
        Err(SolveError::Failed(error)) => assert!(error.to_string().contains(text), "{error}"),
        other => panic!("{text}: {other:?}"),
    };
    refused(Solver::new(&square()).lift(2), "not for rooms");
    refused(
        Solver::new(&circle).degree(3).lift(3),
        "of a higher degree than v",
    );
    refused(Solver::new(&smooth).lift(7), "6 is the highest");
    refused(
        Solver::new(&smooth).lift(2).pairs(Pairs::Paper),
        "leave `pairs` out",
    );
}

#[test]
fn a_circle_and_a_sphere() {
    let lamp = CircleModel::new(vec![0.5], Emission::Arcs(vec![1.0, 0.0]));
    let report = Solver::new(&lamp)
        .mean()
        .at(3.0)
        .cells(64)
        .walks(20_000)
        .solve()
        .unwrap();
    // ū = F̄/(1 − ρ).
    let mean = report.goals[0].preconditioned;
    assert!((mean.estimate.unwrap() - 1.0).abs() < 5.0 * mean.std_error.unwrap() + 1e-12);

    let sphere = SphereModel::new(PARAMETERS);
    let report = Solver::new(&sphere)
        .at([1.0, 0.5])
        .mean()
        .solve_to(1e-3)
        .unwrap();
    for goal in &report.goals {
        let (u, bar) = (
            goal.preconditioned.estimate.unwrap(),
            goal.preconditioned.std_error.unwrap(),
        );
        assert!((u - goal.exact.unwrap()).abs() < 5.0 * bar, "{goal:?}");
    }
}

#[test]
fn a_thousand_points_have_one_set_up() {
    let model = gauss();
    let solver = Solver::new(&model)
        .method(Method::Walks)
        .grid(1000)
        .cells(20)
        .degree(2)
        .walks(2000);
    let report = solver.solve().unwrap();
    assert_eq!(report.goals.len(), 1000);
    let one = Solver::new(&model)
        .method(Method::Walks)
        .at(0.0)
        .cells(20)
        .degree(2)
        .walks(2000)
        .solve()
        .unwrap();
    // The same Galerkin solution, and the same walks for the first point.
    assert_eq!(report.sweeps, one.sweeps);
    let first = |report: &Report| report.goals[0].preconditioned;
    assert_eq!(first(&report), first(&one));
}

/// Cancels after so many walks.
struct Cancels {
    walked: AtomicU64,
    after: u64,
}

impl Observer for Cancels {
    fn walked(&self, walks: u64) {
        self.walked.fetch_add(walks, Ordering::Relaxed);
    }
    fn cancelled(&self) -> bool {
        self.walked.load(Ordering::Relaxed) >= self.after
    }
}

impl SolveObserver for Cancels {}

#[test]
fn a_cancelled_run_keeps_its_results() {
    let watch = Cancels {
        walked: AtomicU64::new(0),
        after: 100_000,
    };
    let model = gauss();
    let solver = Solver::new(&model)
        .at(0.3)
        .cells(5)
        .walks(1 << 40)
        .observer(&watch);
    let Err(error @ SolveError::Cancelled(_)) = solver.solve() else {
        panic!("it was cancelled");
    };
    let report = error.report().unwrap();
    assert_eq!(report.stop, StopReason::Cancelled);
    assert!(report.goals[0].walks >= 4096 && report.goals[0].preconditioned.std_error.is_some());
    assert!(error.to_string().contains("partial results"));
}

#[test]
fn an_error_that_is_not_reached_is_no_success() {
    let model = gauss();
    let solver = Solver::new(&model).at(0.3).cells(5).degree(0).walks(8192);
    let solver = solver.method(Method::Walks);
    let error = solver.solve_to(1e-12).unwrap_err();
    assert!(matches!(error, SolveError::NotReached(_)), "{error}");
    assert_eq!(error.report().unwrap().goals[0].walks, 8192);
}

#[test]
fn what_an_equation_does_not_have_is_refused() {
    let (cube, room) = (gauss(), square());
    let lamp = CircleModel::new(vec![0.5], Emission::Arcs(vec![1.0, 0.0]));
    let sphere = SphereModel::new(PARAMETERS);
    let cases = [
        (Solver::new(&cube), "nothing is asked for"),
        (Solver::new(&cube).at(1.5), "a coordinate is 1.5"),
        (Solver::new(&cube).at(f64::NAN), "a coordinate is NaN"),
        (
            Solver::new(&cube).at([0.1, 0.2]),
            "a point has 1 coordinate",
        ),
        (
            Solver::new(&cube).weighted("w"),
            "this equation has no weights",
        ),
        (
            Solver::new(&cube).over("floor"),
            "this equation has no parts",
        ),
        (
            Solver::new(&lamp).at(7.0),
            "no point with the coordinates [7.0]",
        ),
        (
            Solver::new(&lamp).at([1.0, 2.0]),
            "no point with the coordinates",
        ),
        (
            Solver::new(&lamp).goal("arc", Region::Arc(2.0, 1.0)),
            "from a coordinate to a larger one",
        ),
        (
            Solver::new(&sphere).at([4.0, 0.0]),
            "no point with the coordinates",
        ),
        (
            Solver::new(&sphere).at(1.0),
            "no point with the coordinates",
        ),
        (
            Solver::new(&room).over("roof"),
            "the parts are floor, walls",
        ),
        (Solver::new(&room).on("floor", 1.5), "from 0 to 1"),
        (Solver::new(&room).at([2.0, 0.5]), "not between the walls"),
        (Solver::new(&room).at(0.5), "two coordinates"),
        (Solver::new(&cube).at(0.1).at(0.1), "two targets are named"),
        (Solver::new(&cube).mean().absorption(1.0), "between 0 and 1"),
    ];
    for (solver, words) in cases {
        let error = solver.walks(1000).solve().unwrap_err();
        assert!(error.to_string().contains(words), "{words}: {error}");
        assert!(matches!(error, SolveError::Failed(_)));
    }
    let error = Solver::new(&cube).mean().solve_to(-1.0).unwrap_err();
    assert!(error.to_string().contains("above 0"), "{error}");
    let error = Solver::new(&cube).at(2.0).predict_to(1e-3).unwrap_err();
    assert!(
        matches!(error, SolveError::Failed(Error::Region { .. })),
        "{error}"
    );
}

#[test]
fn what_is_predicted_is_what_is_done() {
    let model = gauss();
    let solver = Solver::new(&model).mean().at(0.3);
    let answer = solver.predict_resolvent().unwrap().unwrap();
    let report = solver.solve().unwrap();
    assert_eq!((answer.cells, answer.degree), (report.cells, report.degree));
    let solver = solver.method(Method::Walks);
    let (settings, predicted) = solver.clone().predict_to(1e-5).unwrap().unwrap();
    let report = solver.clone().solve_to(1e-5).unwrap();
    assert_eq!(settings.cells, Some(report.cells));
    assert_eq!(
        report.choice.unwrap().predicted_walks,
        predicted.predicted_walks
    );
    let solver = solver.cells(5).degree(1);
    assert!(solver.diagnose_in(100).unwrap().targets.len() == 2);
}

/// What is chosen for one value of the equation is walked with for others, and nothing is chosen again.
#[test]
fn many_values_have_one_choice() {
    let model = |a: f64| {
        let kernel = move |x: &[f64; 1], y: &[f64; 1]| a * (x[0] * y[0]).exp();
        CubeModel::from_fn::<1>(kernel, |_| 1.0)
    };
    let first = model(0.5);
    let solver = Solver::new(&first).at(0.3).walks(20_000);
    let solver = solver.method(Method::Walks);
    let (chosen, _) = solver.predict().unwrap().unwrap();
    let settings = solver.choose().unwrap();
    assert_eq!(
        (settings.cells, settings.walks),
        (chosen.cells, Some(20_000))
    );
    let known = |a: f64| {
        let model = model(a);
        let solver = Solver::with(&model, settings.clone(), Vec::new()).at(0.3);
        let report = solver.solve().unwrap();
        assert!(report.choice.is_none() && settings.cells == Some(report.cells));
        report[0].value()
    };
    assert!(known(0.5) < known(0.500_01));
}

/// What refuses a choice is what a diagnosis tells.
#[test]
fn an_infinite_variance_is_diagnosed() {
    // K has the radius 5/6, and K² 5/4.
    let u = CubeModel::from_fn::<1>(|x, y| 2.5 * x[0] * y[0], |_| 1.0);
    let solver = Solver::new(&u).mean().method(Method::Walks);
    let refused = solver.predict().unwrap_err();
    assert!(refused.to_string().contains("variance"), "{refused}");
    let diagnosis = solver.diagnose_in(400).unwrap();
    assert_eq!(diagnosis.targets[0].plain, None);
    assert!(diagnosis.kernel_power.is_none(), "{diagnosis:?}");
}

#[test]
fn a_sweep_falls_as_theory_says() {
    let model = gauss();
    let rates = Solver::new(&model)
        .degree(1)
        .sweep(&[5, 10, 20, 40], 20_000)
        .unwrap();
    // √Var ~ n^−(p + 1): 20,000 walks know it to a percent, and coarse cells are not yet in the limit.
    let fitted = rates.fits.std_dev.unwrap();
    assert_eq!(rates.fits.std_dev_theory, -2.0);
    assert!((fitted + 2.0).abs() < 0.2, "{fitted}");
    assert_eq!(rates.rows.len(), 4);
}

/// √Var of walks with a lift within 10 % of what 2¹⁵ walks measure, or 2¹⁷ in the long form, which know it to some per cent.
#[test]
fn lifts_are_predicted() {
    let circle = wave();
    let smooth = waves!(1.0);
    let cases: [(&dyn Model, usize, usize); 2] = [(&circle, 50, 3), (&smooth, 4, 3)];
    let walks = if is_long() { 1 << 17 } else { 1 << 15 };
    for (model, cells, lift) in cases {
        let solver = Solver::new(model).at(0.3).mean().cells(cells).lift(lift);
        let nodes = if is_long() { 2400 } else { 600 };
        let predicted = solver.diagnose_in(nodes).unwrap();
        assert_eq!(predicted.lift, Some(lift));
        assert!(predicted.other_pairs.is_empty());
        let report = solver.walks(walks).solve().unwrap();
        for (goal, target) in report.goals.iter().zip(&predicted.targets) {
            for (measured, predicted) in [
                (goal.plain.std_dev, target.plain),
                (goal.preconditioned.std_dev, target.preconditioned),
            ] {
                let ratio = predicted.unwrap() / measured.unwrap();
                assert!((ratio - 1.0).abs() < 0.1, "{cells} {lift} {ratio}");
            }
        }
    }
    // v' of degree 1, and F + T_K v of piecewise constants: both have order 2, where v has 1.
    let rates = Solver::new(&smooth)
        .lift(1)
        .sweep(&[5, 10, 20, 40], 20_000)
        .unwrap();
    let fitted = rates.fits.std_dev.unwrap();
    assert_eq!((rates.fits.std_dev_theory, rates.lift), (-2.0, Some(1)));
    assert!((fitted + 2.0).abs() < 0.2, "{fitted}");
    assert!(rates.fits.error_in_seconds.is_some());
}

/// A gain is a quotient of two errors: there is none if one of them is 0.
#[test]
fn no_gain_is_told_without_an_error() {
    let gain = |model: &CubeModel, degree: usize| {
        let solver = Solver::new(model).mean().cells(4).degree(degree);
        let solver = solver.method(Method::Walks);
        let text = solver.walks(1000).solve().unwrap().to_string();
        let row = text.lines().find(|line| line.starts_with("mean")).unwrap();
        row.split_whitespace().last().unwrap().to_owned()
    };
    let product = |source: f64| {
        CubeModel::from_fn::<1>(move |x, y| 0.5 * x[0] * y[0], move |x| source * x[0])
    };
    // All is a polynomial on cells.
    assert_eq!(gain(&product(1.0), 1), "-");
    // Nothing emits.
    assert_eq!(gain(&product(0.0), 0), "-");
    assert!(gain(&product(1.0), 0).parse::<f64>().unwrap() > 2.0);
}

#[test]
fn what_was_given_up_is_told() {
    let mut report = ChoiceReport {
        method: "preconditioned",
        predicted_setup_seconds: 0.0,
        predicted_walk_seconds: 1.0,
        walks: None,
        predicted_walks: 1e6,
        predicted_states: 3e6,
        predicted_plain_seconds: None,
        predicted_separate_seconds: None,
        predicted_whole_seconds: Some(3.0),
        whole_given_up: true,
        pilots: 1,
        pilot_walks: 1000,
        predicted_pilot_seconds: 0.1,
        pilot_seconds: 0.1,
    };
    let text = |report: &ChoiceReport| report.text(&Settings::default(), "20");
    let told = "(global estimate), predicted to take about 3.00 s, took longer";
    assert!(text(&report).contains(told), "{}", text(&report));
    report.whole_given_up = false;
    let told = "(global estimate) would take about 3.00 s\n";
    assert!(text(&report).contains(told), "{}", text(&report));
    report.method = "global estimate";
    report.predicted_separate_seconds = Some(5.0);
    let told = "separate walks would take about 5.00 s\n";
    assert!(text(&report).contains(told), "{}", text(&report));
}

/// u of a black wall is what it emits, and 0 is as certain as anything else: it keeps no other target from its error.
#[test]
fn black_walls_are_certain() {
    let material = |reflectance, emission| Material {
        reflectance,
        emission,
    };
    let room = Surfaces::default()
        .with("floor", &[[0.0, 0.0], [2.0, 0.0]], material(0.5, 0.0))
        .with("right", &[[2.0, 0.0], [2.0, 1.0]], material(0.2, 1.0))
        .with("ceiling", &[[2.0, 1.0], [0.0, 1.0]], material(0.7, 0.0))
        .with("black", &[[0.0, 1.0], [0.0, 0.0]], material(0.0, 0.0));
    let room = RoomModel::new(room, Scalar::F64).unwrap();
    let names = ["floor", "ceiling", "front", "back", "left", "black"];
    let surfaces = shapes::room([0.0; 3], [2.0, 1.0, 1.0]).surfaces;
    let surfaces = surfaces.into_iter().zip(names);
    let surfaces = surfaces.map(|(polygons, name)| NamedSurface {
        name: name.to_owned(),
        polygons,
        material: match name {
            "black" => material(0.0, 0.0),
            "ceiling" => material(0.5, 1.0),
            _ => material(0.5, 0.0),
        },
    });
    let scene = SceneModel::new(surfaces.collect(), Enclosure::Closed, Scalar::F64).unwrap();
    let models: [(&dyn Model, f64); 2] = [(&room, 1e-3), (&scene, 1e-2)];
    for (model, error) in models {
        for adjoint in [None, Some(false), Some(true)] {
            let settings = Settings {
                adjoint,
                global: adjoint.is_some_and(|back| !back).then_some(false),
                ..Settings::default()
            };
            let solver = Solver::with(model, settings, Vec::new());
            let report = solver.over("floor").over("black").solve_to(error).unwrap();
            let black = [report[1].value(), report[1].std_error()];
            assert!(black.iter().all(|x| x.abs() < 1e-12), "{black:?}");
            assert!(report[0].std_error() <= error && report[0].value() > 0.1);
        }
    }
}

/// Where the way back is a global estimate, that is so for whatever is asked of it.
#[test]
fn the_way_back_of_a_circle_is_a_global_estimate() {
    let circle = CircleModel::new(vec![0.5], Emission::Arcs(vec![1.0, 0.0]));
    let solver = || Solver::new(&circle).mean().at(3.0);
    let back = solver().adjoint(true).solve_to(1e-4).unwrap();
    assert!(back.whole.is_some() && back[0].std_error() <= 1e-4);
    let (settings, _) = solver().adjoint(true).predict_to(1e-4).unwrap().unwrap();
    assert_eq!(settings.global, Some(true));
    let few = || solver().cells(20).degree(1).walks(1024);
    let [there, again] =
        [few().adjoint(true), few()].map(|own| own.whole().unwrap().at(1.0).unwrap());
    assert_eq!(there.estimate, again.estimate);
    let settings = Settings {
        adjoint: Some(true),
        global: Some(false),
        ..Settings::default()
    };
    let refused = Solver::with(&circle, settings, Vec::new()).mean().solve();
    assert!(
        refused
            .unwrap_err()
            .to_string()
            .contains("leave `adjoint` out")
    );
}
