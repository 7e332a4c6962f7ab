//! Resolvent walks: equations of any norm, their error bars, and what is refused.

use core::f64::consts::{FRAC_PI_2, PI};

use fredholm::resolvent::{AnyRegular, Grid, cut_of};
use fredholm::{
    CubeModel, Error, Goal, Method, Pairs, Region, Report, Scalar, Sequence, Settings, SolveError,
    Solver, Tolerance,
};

use fredholm_core::galerkin::Cells;
use fredholm_core::{Chain, Density, Equation, Located, Space, Uniforms};

use crate::common::{Line, is_long};

/// An equation on an interval with what is known of its solution.
struct Case {
    name: &'static str,
    interval: [f64; 2],
    kernel: fn(f64, f64) -> f64,
    source: fn(f64) -> f64,
    at: f64,
    /// u there, and its mean.
    value: f64,
    mean: Option<f64>,
    error: f64,
}

impl Case {
    fn model(&self) -> CubeModel {
        let (kernel, source) = (self.kernel, self.source);
        CubeModel::from_fn::<1>(move |x, y| kernel(x[0], y[0]), move |x| source(x[0]))
            .on([self.interval])
    }
}

/// Equations of people, most of them with a norm above 1: closed forms, or values of which two resolutions of a Nyström scheme agree.
const CASES: [Case; 14] = [
    Case {
        name: "a slit of length 10, seen from its end",
        interval: [0.0, 10.0],
        kernel: |x, y| 0.5 * (1.0 + (x - y).powi(2)).powf(-1.5),
        source: |x| 0.5 * (1.0 - (10.0 - x) / ((10.0 - x).powi(2) + 1.0).sqrt()),
        at: 5.0,
        value: 0.5,
        mean: Some(0.5),
        error: 1e-6,
    },
    Case {
        name: "0.55 cos(x - y)",
        interval: [0.0, PI],
        kernel: |x, y| 0.55 * (x - y).cos(),
        source: |_| 3.0,
        at: FRAC_PI_2,
        value: 27.253_645_459_813,
        mean: Some(18.440_350_251_710),
        error: 1e-5,
    },
    Case {
        name: "0.7 cos(x - y), beyond the eigenvalue",
        interval: [0.0, PI],
        kernel: |x, y| 0.7 * (x - y).cos(),
        source: |_| 3.0,
        at: FRAC_PI_2,
        value: -39.186_706_230_386,
        mean: None,
        error: 1e-5,
    },
    Case {
        name: "0.1 exp(-sin(x - y))",
        interval: [0.0, 2.0 * PI],
        kernel: |x, y| 0.1 * (-(x - y).sin()).exp(),
        source: f64::cos,
        at: 0.7,
        value: 0.476_052_257_395_334,
        mean: Some(0.0),
        error: 1e-6,
    },
    Case {
        name: "Volterra, exp(-(x - y))",
        interval: [0.0, 2.0],
        kernel: |x, y| if y < x { (y - x).exp() } else { 0.0 },
        source: |_| 1.0,
        at: 1.5,
        value: 2.5,
        mean: Some(2.0),
        error: 1e-4,
    },
    Case {
        name: "Volterra, 3 exp(-(x - y))",
        interval: [0.0, 1.0],
        kernel: |x, y| if y < x { 3.0 * (y - x).exp() } else { 0.0 },
        source: |_| 1.0,
        at: 0.41,
        value: 2.905_749_756_298_61,
        mean: None,
        error: 1e-4,
    },
    Case {
        name: "Lieb and Liniger",
        interval: [-1.0, 1.0],
        kernel: |x, y| 0.5 / PI / (0.25 + (x - y).powi(2)),
        source: |_| 0.5 / PI,
        at: 0.0,
        value: 0.472_800_767_947,
        mean: Some(0.5 * 0.852_935_151_221),
        error: 1e-7,
    },
    Case {
        name: "two waves",
        interval: [0.0, 1.0],
        kernel: |x, y| 0.3 * ((25.0 * (x - y)).cos() + (7.0 * (x - y)).cos()),
        source: |x| (25.0 * x).sin() + (7.0 * x).sin(),
        at: 0.3,
        value: 2.076_362_115_336_01,
        mean: Some(0.042_522_071_266_563_2),
        error: 1e-6,
    },
    Case {
        name: "0.4 exp(-|x - y|) on an interval of length 20",
        interval: [0.0, 20.0],
        kernel: |x, y| 0.4 * (-(x - y).abs()).exp(),
        source: |_| 1.0,
        at: 3.0,
        value: 4.276_119_372_938_8,
        mean: Some(4.382_077_451_003_4),
        error: 1e-4,
    },
    Case {
        name: "2 exp(-(x - y)^2)",
        interval: [0.0, 1.0],
        kernel: |x, y| 2.0 * (-(x - y).powi(2)).exp(),
        source: |x| 1.0 + x,
        at: 0.3,
        value: -2.443_115_819_070_29,
        mean: Some(-2.041_824_202_519_37),
        error: 1e-7,
    },
    Case {
        name: "-2 exp(-(x - y)^2)",
        interval: [0.0, 1.0],
        kernel: |x, y| -2.0 * (-(x - y).powi(2)).exp(),
        source: |x| 1.0 + x,
        at: 0.3,
        value: 0.364_520_332_522_69,
        mean: Some(0.553_095_206_550_14),
        error: 1e-7,
    },
    Case {
        name: "Green's kernel times 50",
        interval: [0.0, 1.0],
        kernel: |x, y| 50.0 * x.min(y) * (1.0 - x.max(y)),
        source: |_| 1.0,
        at: 0.3,
        value: -0.168_879_261_586_75,
        mean: Some(0.117_569_118_776_32),
        error: 1e-5,
    },
    Case {
        name: "renewal of a gamma distribution",
        interval: [0.0, 10.0],
        kernel: |x, y| if y < x { (x - y) * (y - x).exp() } else { 0.0 },
        source: |x| 1.0 - (1.0 + x) * (-x).exp(),
        at: 10.0,
        value: 4.75,
        mean: None,
        error: 1e-4,
    },
    Case {
        name: "0.1 |x - y|^-0.45",
        interval: [0.0, 1.0],
        kernel: |x, y| 0.1 * (x - y).abs().powf(-0.45),
        source: |x| 1.0 - 0.1 * (x.powf(0.55) + (1.0 - x).powf(0.55)) / 0.55,
        at: 0.3,
        value: 1.0,
        mean: Some(1.0),
        error: 1e-4,
    },
];

fn solved(case: &Case, seed: u64) -> Report {
    let model = case.model();
    let solver = Solver::new(&model).at(case.at).mean().seed(seed);
    let report = solver.method(Method::Resolvent).solve_to(case.error);
    report.unwrap_or_else(|error| panic!("{}: {error}", case.name))
}

/// How many standard errors an estimate is off.
fn off(report: &Report, goal: usize, exact: f64) -> f64 {
    let found = &report.goals[goal];
    let bar = found
        .preconditioned
        .std_error
        .unwrap()
        .max(found.rounding_floor);
    (found.preconditioned.estimate.unwrap() - exact) / bar
}

/// No option of walks of a chain is taken and not heeded.
#[test]
fn options_of_the_chain_are_refused() {
    let model = CASES[0].model();
    let solver = Solver::new(&model).mean().method(Method::Resolvent);
    let cases = [
        (solver.clone().pairs(Pairs::Paper), "`pairs`"),
        (solver.clone().lift(4), "`lift`"),
        (solver.clone().scalar(Scalar::F32), "`scalar`"),
        (solver.clone().sequence(Sequence::Sobol), "`sequence`"),
        (solver.clone().absorption(0.2), "`absorption`"),
    ];
    for (solver, name) in cases {
        let error = solver.solve().unwrap_err().to_string();
        assert!(
            error.contains(name) && error.contains("resolvent"),
            "{error}"
        );
    }
}

/// However little is asked for, walks begin with a first round.
#[test]
fn a_prediction_has_the_points_of_a_first_round() {
    let model = CASES[0].model();
    let settings = Settings {
        tolerance: Some(Tolerance::Absolute(1.0)),
        ..Settings::default()
    };
    let solver = Solver::with(&model, settings, Vec::new()).mean();
    let predicted = solver.predict_resolvent().unwrap().unwrap();
    let found = solver.solve().unwrap().resolvent.unwrap();
    assert!(found.rounds == 1 && found.points > 0);
    assert!(
        predicted.points >= found.points,
        "{} {}",
        predicted.points,
        found.points
    );
}

/// 25 estimates: none beyond 4.9, which one of a million normal numbers is, with at least 6 degrees of freedom.
#[test]
fn equations_of_any_norm_are_solved() {
    for case in &CASES {
        let report = solved(case, 1);

        let both = [Some(case.value), case.mean];
        for (goal, exact) in both.into_iter().enumerate() {
            let found = &report.goals[goal].preconditioned;
            assert!(found.std_error.unwrap() <= case.error, "{}", case.name);
            if let Some(exact) = exact {
                let z = off(&report, goal, exact);
                assert!(z.abs() < 4.9, "{}, {goal}: {z}", case.name);
            }
        }
    }
}

/// Of 200 intervals of two standard errors 95.4 % hold with normal numbers: below 178 or in all of 200 would be in 1 of 10⁴ runs, if
/// degrees of freedom were many. The mean of z is 0, with a standard deviation of 200^-½.
#[test]
fn error_bars_hold() {
    let kinds = [
        "Volterra, 3 exp(-(x - y))",
        "0.4 exp(-|x - y|) on an interval of length 20",
    ];
    let kinds = CASES.iter().filter(|case| kinds.contains(&case.name));
    let (seeds, least) = if is_long() { (60_u32, 50) } else { (20, 15) };
    for case in kinds {
        let model = case.model();
        let solver = Solver::new(&model).at(case.at).method(Method::Resolvent);
        let solver = solver.cells(32).degree(1).walks(5000);
        // In rounds, and in 39 samples.
        for solver in [solver.clone(), solver.batch(128)] {
            let (mut inside, mut sum) = (0, 0.0);
            for seed in 1..=seeds {
                let solved = solver.clone().seed(seed.into()).solve().unwrap();
                let z = off(&solved, 0, case.value);
                inside += u32::from(z.abs() < 2.0);
                sum += z;
            }
            // The binomial distribution with 95.4 % leaves less than a thousandth below.
            assert!(inside >= least, "{}: {inside}", case.name);
            let z = sum / f64::from(seeds).sqrt();
            assert!(z.abs() < 4.0, "{}: {z}", case.name);
        }
    }
}

/// No variance is worth less than what rounding leaves: where little is asked for, little is set up.
#[test]
fn cells_are_no_more_than_rounding_is_worth() {
    let case = CASES.iter().find(|case| case.name == "2 exp(-(x - y)^2)");
    let model = case.unwrap().model();
    let report = Solver::new(&model).mean().solve().unwrap();
    assert!(report.unknowns < 600, "{}", report.unknowns);
}

/// Where u is 0, or nearly, terms cancel that are not: what is left is rounding, and no error.
#[test]
fn a_zero_is_as_exact_as_its_terms() {
    // u = 1.2 x.
    let line = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    // u = (x - ½) / (1 - 1 / 60): odd about the middle.
    let odd = CubeModel::from_fn::<1>(|x, y| 0.2 * (x[0] - 0.5) * (y[0] - 0.5), |x| x[0] - 0.5);
    for (model, zero) in [(line, 0.0), (odd, 0.5)] {
        let solver = Solver::new(&model).at(zero).method(Method::Resolvent);
        for solver in [solver.clone(), solver.batch(128)] {
            let report = solver.walks(5000).solve().unwrap();
            let own = &report.goals[0];
            assert!((1e-17..1e-12).contains(&own.rounding_floor), "{own:?}");
            assert!(off(&report, 0, 0.0).abs() < 4.0, "{own:?}");
        }
    }
}

/// A point between two cells sees one side of its own: K has no value at x = y.
#[test]
fn points_are_ends_of_cells() {
    let case = CASES.iter().find(|case| case.name == "0.1 |x - y|^-0.45");
    let model = case.unwrap().model();
    let solver = Solver::new(&model)
        .at(0.5)
        .at(0.0)
        .at(1.0)
        .cells(10)
        .degree(0);
    let report = solver
        .method(Method::Resolvent)
        .walks(20_000)
        .solve()
        .unwrap();
    for goal in 0..3 {
        let z = off(&report, goal, 1.0);
        assert!(z.abs() < 4.9, "{goal}: {z}");
    }
}

/// A weight that is no polynomial.
#[test]
fn weights_have_kinks() {
    // u = 6x/5, of which ∫ |x − ⅓| u dx is 6/5 (1/3 − 1/6 + 2/162).
    let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    let exact = 1.2 * (1.0 / 3.0 - 1.0 / 6.0 + 1.0 / 81.0);
    let solver = Solver::new(&u).weight("edge", |x| (x[0] - 1.0 / 3.0).abs());
    let report = solver.method(Method::Resolvent).solve_to(1e-8).unwrap();
    let z = off(&report, 0, exact);
    assert!(z.abs() < 4.9, "{z}");
}

#[test]
fn the_same_bits_on_any_number_of_threads() {
    let values = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let report = pool.install(|| solved(&CASES[4], 3));
        let goals = report.goals.into_iter();
        goals
            .map(|goal| goal.preconditioned.estimate.unwrap().to_bits())
            .collect::<Vec<_>>()
    };
    let one = values(1);
    for threads in [2, 3, 7] {
        assert_eq!(values(threads), one);
    }
}

#[test]
fn what_has_no_solution_is_refused() {
    // The constant is an eigenfunction of the eigenvalue 1.
    let none = CubeModel::from_fn::<1>(|_, _| 1.0, |_| 1.0);
    let solver = Solver::new(&none).mean().method(Method::Resolvent);
    let Err(SolveError::Failed(Error::Regular { message })) = solver.solve_to(1e-3) else {
        panic!("an equation without a solution was solved");
    };
    assert!(message.contains("1 is an eigenvalue"), "{message}");
    let not_finite = CubeModel::from_fn::<1>(|x, _| 1.0 / (x[0] - x[0]), |_| 1.0);
    let solver = Solver::new(&not_finite).mean().method(Method::Resolvent);
    assert!(matches!(
        solver.solve_to(1e-3),
        Err(SolveError::Failed(Error::NotFinite { .. }))
    ));
}

/// An equation on [0, 1] whose points have nine coordinates, all alike.
struct Crowded(Line);

impl Space for Crowded {
    type Scalar = f64;
    type Point = f64;
}

impl Chain for Crowded {
    fn step<U: Uniforms<f64>>(&self, x: &f64, uniforms: &mut U) -> Option<f64> {
        self.0.step(x, uniforms)
    }
}

impl Density for Crowded {
    fn density(&self, x: &f64, y: &f64) -> f64 {
        self.0.density(x, y)
    }
}

impl Equation for Crowded {
    type Value = f64;

    fn kernel(&self, x: &f64, y: &f64) -> f64 {
        self.0.kernel(x, y)
    }

    fn source<U: Uniforms<f64>>(&self, x: &f64, uniforms: &mut U) -> f64 {
        self.0.source(x, uniforms)
    }
}

impl Cells for Crowded {
    const DIMENSION: usize = 1;

    fn cells(&self) -> usize {
        self.0.cells()
    }

    fn locate(&self, x: &f64) -> usize {
        self.0.locate(x)
    }

    fn measure(&self, cell: usize) -> f64 {
        self.0.measure(cell)
    }

    fn point(&self, cell: usize, t: &[f64]) -> f64 {
        self.0.point(cell, t)
    }

    fn parameters(&self, x: &Located<f64>, t: &mut [f64]) {
        self.0.parameters(x, t);
    }

    fn at(&self, coordinates: &[f64]) -> Option<f64> {
        let x = *coordinates.first()?;
        (coordinates == [x; 9]).then_some(x)
    }
}

/// Of points with more coordinates than are kept the parameters are.
#[test]
fn points_have_any_number_of_coordinates() {
    let line = || Line::new(|x, y| 1.5 * x * y, |x| x, 1);
    let value = |equation: AnyRegular<'_>, point: Vec<f64>| {
        let cut = cut_of(Grid::new(equation, &[], 4), 2, None, &()).unwrap();
        let goal = Goal::new("point", Region::Point(point));
        let mut walks = cut.walks(&[goal], None).unwrap();
        walks.round(0, 10_000.0, 1, &()).unwrap();
        walks.estimates()[0].value
    };
    let none = |_: &Region| unreachable!("no weight is asked for");
    let one = value(AnyRegular::new(line(), none), vec![0.7]);
    let nine = value(AnyRegular::new(Crowded(line()), none), vec![0.7; 9]);
    assert!((one - 1.4).abs() < 1e-9, "u = 2x: {one}");
    assert!((nine - one).abs() < 1e-12, "{nine} {one}");
}

/// Estimates of u(0.95) and the mean on few cells of degree 0, by a resolvent on still fewer, which is about as bad as one may be.
fn by_coarse([cells, coarse]: [usize; 2], seed: u64) -> [f64; 2] {
    // u(x) = ³⁄₂ x ∫ y u(y) dy + F(x), where F is 1 beyond 0.4 and 0 before: u(x) = 1.26 x + F(x).
    let step = Line::new(
        |x: f64, y: f64| 1.5 * x * y,
        |x: f64| f64::from(u8::from(x > 0.4)),
        1,
    );
    let equation = AnyRegular::new(step, |_| unreachable!("no weight is asked for"));
    let grid = |cells| Grid::new(equation.clone(), &[], cells);
    let cut = cut_of(grid(cells), 0, Some((grid(coarse), 0)), &()).unwrap();
    let goals = [
        Goal::new("point", Region::Point(vec![0.95])),
        Goal::new("mean", Region::Whole),
    ];
    let mut walks = cut.walks(&goals, None).unwrap();
    // Nearly all walks go on.
    walks.set_gain(1e-3);
    walks.round(0, 10_000.0, seed, &()).unwrap();
    let found = walks.estimates();
    [found[0].value, found[1].value]
}

/// Without T_Kn r₀ means of the first pair are off by 15 and of the second one by 30 standard errors; without T_D g, or without T_D0 e, or with D
/// for D_0, by 6 or more of one of them. Over 100 seeds a mean is off by 4.9 in less than 1 of 10⁵ cases.
#[test]
fn a_coarse_resolvent_has_no_bias() {
    for pair in [[2, 1], [3, 2]] {
        let all: Vec<[f64; 2]> = (1..=100).map(|seed| by_coarse(pair, seed)).collect();
        for (goal, exact) in [2.197, 1.23].into_iter().enumerate() {
            let values = all.iter().map(|own| own[goal]);
            let mean = values.clone().sum::<f64>() / 100.0;
            let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
            let z = (mean - exact) / (squares / 99.0 / 100.0).sqrt();
            assert!(z.abs() < 4.9, "{pair:?} {goal}: {mean} {exact} {z}");
        }
    }
}

#[test]
fn a_coarse_resolvent_has_the_same_bits_on_any_number_of_threads() {
    let values = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let found = pool.build().unwrap().install(|| by_coarse([3, 2], 1));
        found.map(f64::to_bits)
    };
    let one = values(1);
    for threads in [2, 3, 7] {
        assert_eq!(values(threads), one);
    }
}

/// A ridge of Lorentz in the plane: only 2,160 unknowns bring the radius below 0.3. u = 1.
#[test]
fn narrow_kernels_have_thousands_of_unknowns() {
    const WIDTH: f64 = 0.033;
    let ridge = |x: f64, y: f64| WIDTH / PI / (WIDTH * WIDTH + (x - y).powi(2));
    let all = |x: f64| (((1.0 - x) / WIDTH).atan() + (x / WIDTH).atan()) / PI;
    let u = CubeModel::from_fn::<2>(
        move |x, y| 0.9 * ridge(x[0], y[0]) * ridge(x[1], y[1]),
        move |x| 1.0 - 0.9 * all(x[0]) * all(x[1]),
    );
    // Of this degree the fewest serve.
    let solver = Solver::new(&u).at([0.3, 0.4]).mean().degree(4);
    let report = solver.method(Method::Resolvent).solve_to(2e-3).unwrap();
    assert!(report.unknowns > 2000, "{}", report.unknowns);
    for goal in 0..2 {
        let z = off(&report, goal, 1.0);
        assert!(z.abs() < 4.9, "{goal}: {z}");
    }
}

/// A smooth kernel on a cube: of 945 unknowns, and of 2,240 in the long form, only factors are made, and walks go on by a resolvent of fewer. The mean is that of the Neumann
/// series, whose terms are products of those of one axis.
#[test]
fn smooth_kernels_have_a_coarse_resolvent() {
    let gauss = |x: &[f64; 3], y: &[f64; 3]| {
        let square: f64 = x.iter().zip(y).map(|(x, y)| (x - y).powi(2)).sum();
        0.5 * (-square).exp()
    };
    let u = CubeModel::from_fn::<3>(gauss, |_| 1.0);
    let (error, least) = if is_long() { (1e-9, 2000) } else { (1e-7, 900) };
    let report = Solver::new(&u)
        .mean()
        .method(Method::Resolvent)
        .solve_to(error)
        .unwrap();
    assert!(report.unknowns > least, "{}", report.unknowns);
    let z = off(&report, 0, 1.472_551_033_554_21);
    assert!(z.abs() < 4.9, "{z}");
}

/// A thousand values of 6x/5 that are known to the last digit take as many points together as one alone, unless more are asked for.
#[test]
fn walks_end_where_rounding_is_all_that_is_left() {
    let u = CubeModel::on_interval([0.0, 1.0], |x, y| 0.5 * x * y, |x| x);
    let solver = Solver::new(&u).grid(1001);
    let points = |solver: &Solver<'_>| {
        let report = solver.solve().unwrap();
        for (number, goal) in report.goals.iter().enumerate() {
            let exact = 1.2 * number as f64 / 1000.0;
            assert!((goal.value() - exact).abs() < 1e-14, "{goal:?}");
        }
        report.resolvent.unwrap().points
    };
    let open = points(&solver);
    assert!((60_000..600_000).contains(&open), "{open}");
    let asked = points(&solver.walks(200));
    assert!(asked >= 200_200, "{asked}");
    // What is exact where it is looked at need not be so elsewhere.
    let function = Solver::new(&u)
        .at(0.5)
        .method(Method::Resolvent)
        .whole()
        .unwrap();
    let walked = function.summary().resolvent.unwrap().points;
    assert!(walked > 60_000, "{walked}");
}

/// Nets gain less on a kernel with a kink in the end than they begin to: more cells, and not thousands of points for each that is needed. u is a sum
/// of three exponentials, as u'' = 0.1 u - 0.75 F.
#[test]
fn kinks_take_cells_and_no_millions_of_points() {
    let kernel = |x: f64, y: f64| 0.45 * (-(x - y).abs()).exp();
    let u = CubeModel::on_interval([0.0, 5.0], kernel, |x| (-0.5 * x).exp());
    let k = 0.1_f64.sqrt();
    let (up, down, end) = ((5.0 * k).exp(), (-5.0 * k).exp(), (-2.5_f64).exp());
    // (1 - k) a + (1 + k) b = 9 and (1 + k) up a + (1 - k) down b = 3 end, since u - F is its own derivative at 0, and less that at 5.
    let determinant = (1.0 - k).powi(2) * down - (1.0 + k).powi(2) * up;
    let a = (9.0 * (1.0 - k) * down - 3.0 * (1.0 + k) * end) / determinant;
    let b = (3.0 * (1.0 - k) * end - 9.0 * (1.0 + k) * up) / determinant;
    let mean = (a * (up - 1.0) / k + b * (1.0 - down) / k - 10.0 * (1.0 - end)) / 5.0;
    let report = Solver::new(&u).at(0.0).mean().solve_to(1e-8).unwrap();
    let points = report.resolvent.unwrap().points;
    assert!(points < 4_000_000, "{points}");
    for (goal, exact) in [a + b - 5.0, mean].into_iter().enumerate() {
        let z = off(&report, goal, exact);
        assert!(z.abs() < 4.9, "{goal}: {z}");
    }
}
