//! The last step to the light, in rooms and on circles: exact answers, the same answers as without it, what it gains, what is
//! predicted of it, and who chooses it.

use core::f64::consts::PI;

use fredholm::circle::Emission;
use fredholm::room::{Material, Surfaces};
use fredholm::{
    CircleModel, CubeModel, Estimator, Form, Model, Pairs, Region, Report, RoomModel, Scalar,
    Solver,
};

use crate::common::is_long;

/// Standard errors that an estimate of a thousand is off once in a thousand runs of all.
const MOST: f64 = 4.9;

/// A room with a screen that hides a part of it from a small lamp, in the floor or black in the ceiling.
fn room(scalar: Scalar, of: impl Fn(&str) -> Material) -> RoomModel {
    let surfaces = [
        ("floor", vec![[0.0, 0.0], [3.0, 0.0]]),
        ("side", vec![[3.0, 0.0], [3.0, 2.0]]),
        ("ceiling", vec![[3.0, 2.0], [1.1, 2.0]]),
        ("lamp", vec![[1.1, 2.0], [1.0, 2.0]]),
        ("rest", vec![[1.0, 2.0], [0.0, 2.0], [0.0, 0.0]]),
        ("left of the screen", vec![[2.0, 0.6], [1.7, 1.5]]),
        ("right of the screen", vec![[1.7, 1.5], [2.0, 0.6]]),
    ];
    let all = surfaces
        .into_iter()
        .fold(Surfaces::default(), |all, (name, points)| {
            all.with(name, &points, of(name))
        });
    RoomModel::new(all, scalar).unwrap()
}

/// A lamp that alone emits.
fn lit(name: &str) -> Material {
    match name {
        "lamp" => Material {
            reflectance: 0.2,
            emission: 10.0,
        },
        "side" => Material {
            reflectance: 0.3,
            emission: 0.0,
        },
        _ => Material {
            reflectance: 0.6,
            emission: 0.0,
        },
    }
}

/// How walks end: by roulette, or with a constant absorption and what they score.
const WAYS: [Option<Estimator>; 3] = [
    None,
    Some(Estimator::Absorption),
    Some(Estimator::Collision),
];

/// Walks that end so.
fn ended(solver: Solver<'_>, way: Option<Estimator>) -> Solver<'_> {
    match way {
        None => solver,
        Some(estimator) => solver.absorption(0.2).estimator(estimator),
    }
}

/// Whatever may be asked of a room: means, points in light, in shadow and on the lamp, one in the air.
fn asked(model: &RoomModel) -> Solver<'_> {
    Solver::new(model)
        .mean()
        .over("floor")
        .on("floor", 0.3)
        .on("side", 0.2)
        .on("lamp", 0.5)
        .goal("air", Region::Point(vec![2.5, 1.0]))
        .last_step(true)
}

/// The largest number of standard errors by which plain and preconditioned estimates and irradiances are off.
fn worst(report: &Report, solution: impl Fn(usize) -> [f64; 2], slack: f64) -> f64 {
    let mut worst = 0.0_f64;
    for (number, goal) in report.goals.iter().enumerate() {
        let [value, error] = solution(number);
        let irradiance = goal.irradiance.as_ref().map(|found| (found, 0.0));
        let own = [&goal.plain, &goal.preconditioned].map(|found| (found, value));
        for (found, value) in own.into_iter().chain(irradiance) {
            // Irradiances are looked at where they are known.
            let value = if value == 0.0 { 1.0 } else { value };
            let (Some(estimate), Some(own)) = (found.estimate, found.std_error) else {
                continue;
            };
            if found.estimate == goal.irradiance.as_ref().and_then(|h| h.estimate) && error > 0.0 {
                continue;
            }
            let off = ((estimate - value).abs() - slack).max(0.0);
            worst = worst.max(off / own.hypot(error).max(1e-13));
        }
    }
    worst
}

/// F = 1 − ρ: u = 1 and every irradiance is 1, whatever hides what.
#[test]
fn furnaces() {
    let cells = if is_long() { 40 } else { 14 };
    for scalar in [Scalar::F64, Scalar::F32] {
        let model = room(scalar, |name| {
            let reflectance = match name {
                "lamp" => 0.0,
                "side" => 0.6,
                _ => 0.8,
            };
            Material {
                reflectance,
                emission: 1.0 - reflectance,
            }
        });
        for pairs in [Pairs::Pointwise, Pairs::Rays] {
            for degree in [0, 2] {
                for (way, estimator) in WAYS.into_iter().enumerate() {
                    for (own, form) in [Form::Product, Form::Residual].into_iter().enumerate() {
                        // By day each way has one of both forms, and the other one with another degree.
                        if !is_long() && (way + own + degree / 2) % 2 == 1 {
                            continue;
                        }
                        // In one of both scalars, but for those that are fast.
                        let is_slow = pairs != Pairs::Rays || degree > 0;
                        if is_slow && scalar == Scalar::F32 {
                            continue;
                        }
                        let solver = asked(&model).cells(cells).degree(degree).pairs(pairs);
                        let solver = solver.form(form).scalar(scalar);
                        let solver = ended(solver, estimator);
                        let report = solver.walks(500).solve().unwrap();
                        assert!(report.chain.unwrap().last_step);
                        let slack = match scalar {
                            Scalar::F64 => 1e-11,
                            Scalar::F32 => 1e-4,
                        };
                        let off = worst(&report, |_| [1.0, 0.0], slack);
                        assert!(
                            off < MOST,
                            "{pairs:?} {degree} {estimator:?} {form:?}: {off}
{}",
                            report.table()
                        );
                    }
                }
            }
        }
    }
}

/// One arc of 50 emits: u by the eigenfunctions of T_K on the circle, λ_k = 1/(1 − 4k²).
#[test]
fn circle_in_closed_form() {
    let (arcs, rho) = (50, 0.7);
    let mut emission = vec![0.0; arcs];
    emission[7] = 3.0;
    let model = CircleModel::new(vec![rho], Emission::Arcs(emission));
    let (half, middle) = (PI / 50.0, 2.0 * PI * 7.5 / 50.0);
    let u = |s: f64| {
        let inside = (s - middle).abs() < half;
        let mut sum = if inside { 3.0 } else { 0.0 } + 3.0 * half / PI * rho / (1.0 - rho);
        for k in 1..200_000 {
            let k = f64::from(k);
            let eigenvalue = 1.0 / (1.0 - 4.0 * k * k);
            let reflected = rho * eigenvalue / (1.0 - rho * eigenvalue);
            let coefficient = 3.0 * 2.0 * (k * half).sin() / (k * PI);
            sum += coefficient * reflected * (k * (s - middle)).cos();
        }
        sum
    };
    let angles = [0.2, middle, middle + 0.9 * half, 4.0];
    let exact = angles.map(u);
    for (degree, pairs) in [
        (0, Pairs::Paper),
        (0, Pairs::Default),
        (0, Pairs::Pointwise),
        (2, Pairs::Default),
        (2, Pairs::Pointwise),
    ] {
        for estimator in WAYS {
            let solver = Solver::new(&model).mean().last_step(true).cells(100);
            let solver = angles.iter().fold(solver, |solver, &s| solver.at(s));
            let solver = ended(solver.degree(degree).pairs(pairs), estimator);
            let report = solver.walks(20_000).solve().unwrap();
            let value = |number: usize| {
                let mean = 3.0 / 50.0 / (1.0 - rho);
                [number.checked_sub(1).map_or(mean, |k| exact[k]), 0.0]
            };
            let off = worst(&report, value, 1e-11);
            assert!(off < MOST, "{degree} {pairs:?} {estimator:?}: {off}");
        }
    }
}

/// The answers are those of walks for u, which know nothing of last steps.
#[test]
fn the_same_answers_as_without() {
    let model = room(Scalar::F64, lit);
    let (cells, walks) = if is_long() { (50, 8000) } else { (30, 2000) };
    let without = asked(&model).last_step(false).cells(cells).degree(2);
    let without = without.pairs(Pairs::Pointwise).seed(17);
    let without = without.walks(2 * walks).solve().unwrap();
    assert!(!without.chain.unwrap().last_step);
    let found = |number: usize| {
        let found = &without.goals[number].preconditioned;
        [found.estimate.unwrap(), found.std_error.unwrap()]
    };
    let irradiance = |report: &Report, number: usize| {
        let found = report.goals[number].irradiance.as_ref().unwrap();
        [found.estimate.unwrap(), found.std_error.unwrap()]
    };
    for (degree, pairs) in [(0, Pairs::Pointwise), (0, Pairs::Rays), (2, Pairs::Rays)] {
        for estimator in WAYS {
            let solver = asked(&model).cells(cells).degree(degree).pairs(pairs);
            let report = ended(solver, estimator).walks(walks).solve().unwrap();
            let off = worst(&report, found, 0.0);
            assert!(off < MOST, "{degree} {pairs:?} {estimator:?}: {off}");
            for number in 0..5 {
                let [[a, x], [b, y]] = [&without, &report].map(|of| irradiance(of, number));
                let off = (a - b).abs() / x.hypot(y);
                assert!(off < MOST, "irradiance {number} {pairs:?}: {off}");
            }
        }
    }
}

/// With a light of 0.9 % of all walls plain walks have a tenth of their standard deviation, and preconditioned ones whose
/// neighbour equation has what the light gives to walls half of it.
#[test]
fn what_it_gains() {
    let model = room(Scalar::F64, lit);
    let deviations = |last, pairs| {
        let solver = Solver::new(&model).mean().on("floor", 0.3).cells(100);
        let report = solver
            .degree(0)
            .pairs(pairs)
            .last_step(last)
            .walks(20_000)
            .solve()
            .unwrap();
        let goal = &report.goals[0];
        [&goal.plain, &goal.preconditioned].map(|of| of.std_dev.unwrap())
    };
    let [[plain, rays], [lit_plain, lit_rays]] =
        [false, true].map(|last| deviations(last, Pairs::Rays));
    assert!(lit_plain < plain / 10.0, "{lit_plain} {plain}");
    assert!(lit_rays < rays / 2.0, "{lit_rays} {rays}");
    // Where h = k and the last step is exact, what is left is the same.
    let [[_, same], [_, lit_same]] = [false, true].map(|last| deviations(last, Pairs::Pointwise));
    assert!((lit_same / same - 1.0).abs() < 1e-6, "{lit_same} {same}");
}

/// What is predicted of variances is what walks have.
#[test]
fn predictions() {
    let model = room(Scalar::F64, lit);
    let arcs = CircleModel::new(
        vec![0.4, 0.7],
        Emission::Arcs((0..20).map(|arc| f64::from(u8::from(arc == 3))).collect()),
    );
    let of_room = || Solver::new(&model).mean().on("floor", 0.3).cells(60);
    let of_circle = || Solver::new(&arcs).mean().at(4.0).cells(60);
    for (solver, pairs) in [
        (of_room(), Pairs::Pointwise),
        (of_room(), Pairs::Rays),
        (of_circle(), Pairs::Default),
        (of_circle(), Pairs::Paper),
    ] {
        let solver = solver.pairs(pairs).last_step(true).absorption(0.3);
        let solver = solver.estimator(Estimator::Collision).degree(0);
        let diagnosis = solver.diagnose_in(400).unwrap();
        let report = solver.walks(30_000).solve().unwrap();
        for (predicted, found) in diagnosis.targets.iter().zip(&report.goals) {
            let [plain, best] = [&found.plain, &found.preconditioned].map(|of| of.std_dev.unwrap());
            let ratios = [
                predicted.plain.unwrap() / plain,
                predicted.preconditioned.unwrap() / best,
            ];
            // Jumps within boxes of rays are known to a sixteenth.
            let slack = if pairs == Pairs::Rays { 0.25 } else { 0.06 };
            assert!((ratios[0] - 1.0).abs() < 0.03, "{pairs:?} {ratios:?}");
            assert!((ratios[1] - 1.0).abs() < slack, "{pairs:?} {ratios:?}");
            let estimate = found.preconditioned.estimate.unwrap();
            assert!((predicted.solution - estimate).abs() < 0.01 * estimate);
        }
    }
}

/// What was chosen once leaves nothing open, a last step neither.
#[test]
fn what_was_chosen_is_not_chosen_again() {
    let model = room(Scalar::F64, lit);
    let open = Solver::new(&model).mean().on("floor", 0.3).walks(2000);
    let settings = open.choose().unwrap();
    assert!(settings.last_step.is_some() && settings.cells.is_some());
    let again = Solver::with(&model, settings, Vec::new());
    let report = again.mean().on("floor", 0.3).solve().unwrap();
    assert!(report.choice.is_none(), "{report}");
}

/// With an error to reach it is chosen where the light is small, and not offered where nothing is bright.
#[test]
fn choice() {
    let model = room(Scalar::F64, lit);
    let report = Solver::new(&model).mean().on("floor", 0.3).on("side", 0.2);
    let report = report.degree(0).together(false).solve_to(2e-5).unwrap();
    assert!(report.chain.unwrap().last_step, "{}", report.table());
    let even = room(Scalar::F64, |_| Material {
        reflectance: 0.5,
        emission: 1.0,
    });
    let report = Solver::new(&even).mean().on("floor", 0.3);
    let report = report.together(false).solve_to(1e-3).unwrap();
    assert!(!report.chain.unwrap().last_step);
    let off = (report.goals[0].preconditioned.estimate.unwrap() - 2.0).abs();
    assert!(off < 5e-3, "{off}");
}

#[test]
fn refusals() {
    let cube = CubeModel::from_fn::<1>(|_, _| 0.5, |_| 1.0);
    let error = Solver::new(&cube).mean().last_step(true).solve();
    let text = error.unwrap_err().to_string();
    assert!(text.contains("leave `last_step` out"), "{text}");
    let model = room(Scalar::F64, lit);
    assert!(model.notes().is_empty());
    let whole = Solver::new(&model).mean().last_step(true).together(true);
    let text = whole.solve().unwrap_err().to_string();
    assert!(text.contains("`last_step`"), "{text}");
}
