//! Models from draws, against closed forms.

use fredholm_core::{
    Estimator, Form, Kernel, Located, Neighbour, RandomSource, RngUniforms, Sampler, StateSpace,
    Uniforms, WalkSeeds,
};
use fredholm_variance::{
    Analysis, Density, DrawCounts, DrawnModel, DrawnSite, DrawnStart, Draws, serially,
};

/// u(x) = ½ ∫ u dy + 1 on [0, 1] with q = ½, where F is 1 and what is uniform between −½ and ½. u = 2.
struct Half;

impl StateSpace for Half {
    type Scalar = f64;
    type Point = f64;
}
impl Sampler for Half {
    fn absorption(&self, _: &f64) -> f64 {
        0.5
    }
    fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
        Some(uniforms.uniform())
    }
}
impl Kernel for Half {
    fn kernel(&self, _: &f64, _: &f64) -> f64 {
        1.0
    }
}
impl RandomSource for Half {
    fn sample_source<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> f64 {
        0.5 + uniforms.uniform()
    }
}

/// v = 1.9 and h = k, where G is v − T_k v and a fifth of such a number.
struct Near;

impl StateSpace for Near {
    type Scalar = f64;
    type Point = f64;
}
impl Neighbour for Near {
    fn locate(&self, point: f64) -> Located<f64> {
        Located { point, cell: 0 }
    }
    fn kernel(&self, _: &Located<f64>, _: &Located<f64>, k: f64) -> f64 {
        k
    }
    fn source(&self, _: &Located<f64>, draws: &mut dyn Uniforms<f64>) -> f64 {
        0.95 + 0.2 * (draws.uniform() - 0.5)
    }
    fn value(&self, _: &Located<f64>) -> f64 {
        1.9
    }
}

const COUNTS: DrawCounts = DrawCounts {
    scores: 40_000,
    steps: 10_000,
};
const SITES: usize = 4;

fn drawn(number: u64, point: impl Fn(&mut Draws) -> f64) -> DrawnSite {
    let mut draws = RngUniforms(WalkSeeds::new(1, 0).generator(number));
    let site_of = |y: &f64| (y * SITES as f64) as usize;
    let mut point = |draws: &mut Draws| point(draws);
    DrawnSite::new((&Half, &Near), COUNTS, &mut draws, &mut point, &site_of).unwrap()
}

/// Var η and Var ζ, of starts in a point and even ones, without and with a known part of the score, by both estimators. The mean
/// squares of uniform numbers are known to 0.5 % by 40,000 draws from each of four sites; 2 % are allowed.
#[test]
fn variances_are_those_of_closed_forms() {
    const KNOWN: f64 = 3.0;
    let width = 1.0 / SITES as f64;
    let site = |i: usize| {
        let uniform = |draws: &mut Draws| -> f64 { draws.uniform() };
        let point = move |draws: &mut Draws| width * (i as f64 + uniform(draws));
        drawn(i as u64, point).with_measure(width)
    };
    let even = |known| {
        let density = Density {
            known,
            ..Density::uniform(1.0)
        };
        DrawnStart::Density(Box::new(move |_| density))
    };
    let at = || drawn(9, |_| 0.3);
    let model = DrawnModel {
        sites: (0..SITES).map(site).collect(),
        starts: vec![
            DrawnStart::At(1, at()),
            even(0.0),
            DrawnStart::At(1, at().with_known(KNOWN)),
            even(KNOWN),
        ],
    };
    // Of F̂, and of F̂ − Ĝ.
    let [noise, both] = [1.0 / 12.0, 1.04 / 12.0];
    let error = 0.1;
    for estimator in [Estimator::Absorption, Estimator::Collision] {
        let analysis = Analysis::new(&model, estimator, Form::Product, &serially).unwrap();
        for start in 0..4 {
            let known = if start < 2 { 0.0 } else { KNOWN };
            let [plain, best]: [f64; 2] = match estimator {
                // η = 2 F̂, and 2 (what is known) where a walk ends at once, half of the time.
                Estimator::Absorption => [4.0 * noise + known * known, 4.0 * both],
                // E η² = E F̂² + E F u + ½ E η².
                Estimator::Collision => [
                    2.0 * (1.0 + noise + 2.0) - 4.0,
                    2.0 * (0.05 * 0.05 + both + 0.05 * error) - error * error,
                ],
            };
            let found = analysis.predict(start).unwrap();
            let [of_plain, of_best] = [found.plain, found.preconditioned].map(Option::unwrap);
            assert!(
                (of_plain / plain - 1.0).abs() < 0.02,
                "{estimator:?} {start}: {of_plain} {plain}"
            );
            assert!(
                (of_best / best - 1.0).abs() < 0.02,
                "{estimator:?} {start}: {of_best} {best}"
            );
            assert!((found.solution - 2.0 - known).abs() < 0.02, "{found:?}");
            assert!((found.error - error).abs() < 0.02, "{found:?}");
        }
    }
}
