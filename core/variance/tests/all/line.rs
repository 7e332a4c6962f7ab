//! Equations on [0, 1] with p = 1: against closed forms, from draws too, and against walks.

use fredholm_core::galerkin::{DiagonalRule, PairKind};
use fredholm_core::{
    Absorption, Chain, Equation, Estimator, Form, Located, Neighbour, NoNeighbour, RngUniforms,
    Space, Uniforms, WalkOptions, WalkSeeds, walk,
};
use fredholm_variance::{
    Analysis, Density, DrawCounts, DrawnModel, DrawnSite, DrawnStart, Draws, Origin, Quadrature,
    Start, Step, VarianceModel, VarianceSetup, Walked, Wanted, serially,
};

const SITES: usize = 16;
const WIDTH: f64 = 1.0 / SITES as f64;

type Kernel = fn(f64, f64) -> f64;
type Size = fn(f64) -> f64;

/// F is x, or 1 and what is uniform between −½ and ½.
struct Line {
    kernel: Kernel,
    size: Size,
    is_drawn: bool,
}

/// h, where it is not k, and v and G, to which a number between −½ and ½ times `noise` is added.
struct Near {
    h: Option<f64>,
    v: f64,
    noise: f64,
}

impl Space for Line {
    type Scalar = f64;
    type Point = f64;
}

impl Chain for Line {
    fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
        Some(uniforms.uniform())
    }
}

impl Equation for Line {
    type Value = f64;
    fn kernel(&self, x: &f64, y: &f64) -> f64 {
        (self.kernel)(*x, *y)
    }
    fn source<U: Uniforms<f64>>(&self, x: &f64, uniforms: &mut U) -> f64 {
        if self.is_drawn {
            0.5 + uniforms.uniform()
        } else {
            *x
        }
    }
    fn size(&self, x: &f64) -> f64 {
        (self.size)(*x)
    }
}

impl Quadrature for Line {
    fn sites(&self) -> usize {
        SITES
    }
    fn locate(&self, x: &f64) -> usize {
        (x / WIDTH) as usize
    }
    fn nodes(&self, site: usize, mut visit: impl FnMut(f64, f64)) {
        for place in [-1.0, 1.0] {
            let t = 0.5 + place * 0.75_f64.sqrt() / 3.0;
            visit(WIDTH * (site as f64 + t), 0.5 * WIDTH);
        }
    }
    fn steps(&self, _: &f64, site: usize, mut visit: impl FnMut(Step<f64>)) {
        let mut node = Some(0);
        self.nodes(site, |point, weight| {
            visit(Step {
                point,
                weight,
                node,
            });
            node = Some(1);
        });
    }
}

impl Space for Near {
    type Scalar = f64;
    type Point = f64;
}

impl Neighbour for Near {
    type Value = f64;
    fn locate(&self, point: f64) -> Located<f64> {
        Located { point, cell: 0 }
    }
    fn kernel(&self, _: &Located<f64>, _: &Located<f64>, k: &f64) -> f64 {
        self.h.unwrap_or(*k)
    }
    fn source(&self, _: &Located<f64>, draws: &mut dyn Uniforms<f64>) -> f64 {
        let noise = if self.noise > 0.0 {
            self.noise * (draws.uniform() - 0.5)
        } else {
            0.0
        };
        self.v * (1.0 - self.h.unwrap_or(0.5)) + noise
    }
    fn value(&self, _: &Located<f64>) -> f64 {
        self.v
    }
}

fn setup<'a, N>(
    line: &'a Line,
    neighbour: &'a N,
) -> VarianceSetup<'a, Line, N, DiagonalRule, Line> {
    VarianceSetup {
        equation: line,
        neighbour,
        pairs: DiagonalRule {
            diagonal: PairKind::Dropped,
        },
        quadrature: line,
        absorption: Absorption::Roulette,
    }
}

fn draws(number: u64) -> Draws {
    RngUniforms(WalkSeeds::new(1, 0).generator(number))
}

/// 100,000 walks from 0.9 beside h = 0.3: √Var of plain and of preconditioned ones, each with its standard error, and the
/// predicted ones.
fn measured(line: &Line, form: Form) -> [[f64; 3]; 2] {
    let near = Near {
        h: Some(0.3),
        v: 0.6,
        noise: 0.0,
    };
    let options = WalkOptions {
        form,
        ..WalkOptions::default()
    };
    let walks: Vec<_> = (0..100_000)
        .map(|number| {
            let start = (near.locate(0.9), 1.0);
            walk(
                line,
                &near,
                start,
                &options,
                &mut draws(number),
                &mut draws(0),
            )
        })
        .collect();
    let starts = [Start::At(0.9)];
    let model = setup(line, &near).with_starts(&starts).unwrap();
    let analysis = Analysis::new(&model, Estimator::Collision, form, &serially).unwrap();
    let found = analysis.predict(0).unwrap();
    // What is attributed is the mean square of the difference.
    let attribution = found.attribute(&analysis).unwrap().unwrap();
    let all: f64 = attribution.contributions.iter().map(|c| c.variance).sum();
    let square = found.preconditioned.unwrap() + found.error * found.error;
    assert!((all / square - 1.0).abs() < 1e-9, "{all} {square}");
    let of = |score: &dyn Fn(usize) -> f64, predicted: Option<f64>, mean: f64| {
        let count = walks.len() as f64;
        let moment = |power: i32| {
            let powers = (0..walks.len()).map(|i| (score(i) - mean).powi(power));
            powers.sum::<f64>() / count
        };
        let (variance, fourth) = (moment(2), moment(4));
        assert!(moment(1).abs() < 5.0 * (variance / count).sqrt(), "mean");
        let error = ((fourth / variance - variance) / (4.0 * count)).sqrt();
        [variance.sqrt(), error, predicted.unwrap().sqrt()]
    };
    [
        of(&|i| walks[i].plain, found.plain, found.solution),
        of(
            &|i| walks[i].plain - walks[i].control,
            found.preconditioned,
            found.error,
        ),
    ]
}

const fn unit(_: f64) -> f64 {
    1.0
}

/// Where k = 0.5 is the size, weights stay 1; where it is not, they become ½ and stay so. On a black half a walk takes a step for its
/// neighbour alone. All is predicted exactly.
#[test]
fn roulette_with_a_constant_kernel_has_the_predicted_variance() {
    let half = |_| 0.5;
    let white = |x: f64| if x < 0.5 { 0.0 } else { 0.5 };
    let cases: [(Kernel, Size); 3] = [
        (|_, _| 0.5, half),
        (|_, _| 0.5, unit),
        (|x, _| if x < 0.5 { 0.0 } else { 0.5 }, white),
    ];
    for (kernel, size) in cases {
        let line = Line {
            kernel,
            size,
            is_drawn: false,
        };
        for [sd, error, predicted] in measured(&line, Form::Residual) {
            assert!(
                (predicted - sd).abs() < 4.0 * error,
                "{predicted} {sd} {error}"
            );
        }
    }
}

/// Where |k| varies below the size, 1, the prediction is an upper estimate, by a part that is derived here. λ − ν ≤ 1/32, so that a step
/// has at most 1/32 of Y too much. T_λ1 ≤ κ = sup ∫ |k| dy, so that Y ≤ κ/(1 − κ) sup X, and what steps have too much
/// sums up to 1/(1 − κ) times as much. X ≤ ∫ (k u − h v)² dy, since D v + k e = k u − h v.
#[test]
fn roulette_has_at_most_the_predicted_variance_and_hardly_less() {
    let between: Kernel = |x, y| (0.02 + 0.78 * x * y) * if y < 0.5 { -1.0 } else { 1.0 };
    for kernel in [between, |_, _| 0.05] {
        let points = || (0..200).map(|i| (f64::from(i) + 0.5) / 200.0);
        let integral = |of: &dyn Fn(usize, f64) -> f64| {
            points().enumerate().map(|(j, y)| of(j, y)).sum::<f64>() / 200.0
        };
        let supremum = |of: &dyn Fn(f64) -> f64| points().map(of).fold(0.0, f64::max);
        let mut u = vec![0.0; 200];
        for _ in 0..40 {
            let of = |x: f64| x + integral(&|j, y| kernel(x, y) * u[j]);
            u = points().map(of).collect();
        }
        let kappa = supremum(&|x| integral(&|_, y| kernel(x, y).abs()));
        let line = Line {
            kernel,
            size: unit,
            is_drawn: false,
        };
        let both = measured(&line, Form::Residual);
        for ([sd, error, predicted], score) in both.into_iter().zip([0.0, 0.3 * 0.6]) {
            let next = supremum(&|x| integral(&|j, y| (kernel(x, y) * u[j] - score).powi(2)));
            let excess = next * kappa / (32.0 * (1.0 - kappa).powi(2));
            assert!(predicted > sd - 4.0 * error, "{predicted} {sd} {error}");
            let most = ((sd + 4.0 * error).powi(2) + excess).sqrt();
            assert!(
                predicted < most && most < 1.08 * sd,
                "{predicted} {sd} {most}"
            );
        }
    }
}

/// Var η and Var ζ of draws, of starts in a point and even ones, without and with a known part of the score, by both estimators.
/// The mean squares of uniform numbers are known to 0.5 % by 20,000 draws from each of 16 sites; 2 % are allowed.
#[test]
fn variances_from_draws_are_those_of_closed_forms() {
    // u = ½ ∫ u dy + 1 = 2, v = 1.9, h = k, and q = ½, over which k is 1.
    let line = Line {
        kernel: |_, _| 0.5,
        size: unit,
        is_drawn: true,
    };
    let near = Near {
        h: None,
        v: 1.9,
        noise: 0.2,
    };
    let counts = DrawCounts {
        scores: 20_000,
        steps: 4000,
    };
    let known = 3.0;
    // Of F̂, of F̂ − Ĝ, and e.
    let [noise, both, error] = [1.0 / 12.0, 1.04 / 12.0, 0.1];
    for estimator in [Estimator::Absorption, Estimator::Collision] {
        let walked = Walked {
            equation: &line,
            neighbour: &near,
            absorption: Absorption::Constant {
                probability: 0.5,
                estimator,
            },
        };
        let drawn = |number: usize, point: &dyn Fn(&mut Draws) -> f64| {
            let mut draws = draws(number as u64);
            let site_of = |y: &f64| line.locate(y);
            DrawnSite::new(&walked, counts, &mut draws, &mut |d| point(d), &site_of).unwrap()
        };
        let site = |i: usize| {
            let uniform = |draws: &mut Draws| -> f64 { draws.uniform() };
            drawn(i, &move |d| WIDTH * (i as f64 + uniform(d))).with_measure(WIDTH)
        };
        let even = |known| {
            let density = Density {
                known,
                ..Density::uniform(1.0)
            };
            DrawnStart::Density(Box::new(move |_| density))
        };
        let model = DrawnModel {
            sites: (0..SITES).map(site).collect(),
            starts: vec![
                DrawnStart::At(4, drawn(99, &|_| 0.3)),
                even(0.0),
                even(known),
            ],
        };
        let analysis = Analysis::new(&model, estimator, Form::Product, &serially).unwrap();
        for start in 0..3 {
            let known = if start < 2 { 0.0 } else { known };
            let [plain, best]: [f64; 2] = match estimator {
                // η = 2 F̂, where a walk ends.
                Estimator::Absorption => [4.0 * noise, 4.0 * both],
                // E η² = E F̂² + E F u + ½ E η².
                Estimator::Collision => [
                    2.0 * (1.0 + noise + 2.0) - 4.0,
                    2.0 * (0.05 * 0.05 + both + 0.05 * error) - error * error,
                ],
            };
            let found = analysis.predict(start).unwrap();
            let close = |found: Option<f64>, expected: f64| {
                let found = found.unwrap();
                assert!((found / expected - 1.0).abs() < 0.02, "{found} {expected}");
            };
            close(found.plain, plain);
            close(found.preconditioned, best);
            close(Some(found.solution), 2.0 + known);
            assert!((found.error - error).abs() < 0.02, "{found:?}");
        }
    }
}

#[test]
fn points_are_numbered_site_by_site_and_then_by_starts() {
    let line = Line {
        kernel: |_, _| 0.5,
        size: unit,
        is_drawn: false,
    };
    let density = |x: &f64| Density {
        functional: *x,
        ..Density::uniform(1.0)
    };
    let starts = [
        Start::At(0.1),
        Start::Density(&density),
        Start::At(0.9),
        Start::Density(&density),
    ];
    let neighbour = NoNeighbour::new(&line);
    let model = setup(&line, &neighbour).with_starts(&starts).unwrap();
    assert_eq!(
        [0, 1, 15, 16].map(|site| model.nodes(site)),
        [0..2, 2..4, 30..32, 0..0]
    );
    let start = |number| model.start(number);
    assert_eq!(start(0), Some(Origin::Point { point: 32, site: 1 }));
    assert_eq!(
        start(2),
        Some(Origin::Point {
            point: 33,
            site: 14
        })
    );
    assert_eq!((start(3), start(4)), (Some(Origin::Density), None));
    // F(x) = x tells which point it is.
    let mut last = 0.0;
    line.nodes(15, |x, _| last = x);
    let sources = [31, 32, 33].map(|point| model.values(point).source);
    assert_eq!(sources, [last, 0.1, 0.9]);
    assert_eq!(model.density(1, 31).functional, last);
    assert_eq!(model.position(32).weight, 1.0);
    // There is no point 34.
    assert!(model.values(34).source.is_nan() && model.position(34).weight.is_nan());
    assert_eq!(model.density(1, 34), Density::nothing());
    model.steps(34, 0, Wanted::Kernel, &mut |step| panic!("{step:?}"));
}
