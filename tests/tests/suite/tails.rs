//! Error bars that are not believed, as large scores are rare: both runners go on, and stop after the same walk.

use fredholm_core::{
    Chain, Equation, Functional, Goal, Goals, NoNeighbour, Real, RunOptions, Space, Start, StartOf,
    Statistics, StopReason, Tail, Tolerance, Uniforms, WalkOptions,
};
use fredholm_embedded::Driver;
use fredholm_rayon::{Observer, run};

/// u = F on [0, 1], with F(x) = x^−a: F² has an integral if a < ½.
struct Power(f64);

impl Space for Power {
    type Scalar = f64;
    type Point = f64;
}
impl Chain for Power {
    fn step<U: Uniforms<f64>>(&self, _: &f64, _: &mut U) -> Option<f64> {
        None
    }
}
impl Equation for Power {
    type Value = f64;
    fn kernel(&self, _: &f64, _: &f64) -> f64 {
        0.0
    }
    fn source<U: Uniforms<f64>>(&self, x: &f64, _: &mut U) -> f64 {
        Real::pow(*x, -self.0)
    }
}

/// The mean of u.
struct Mean;

impl Functional<Power> for Mean {
    fn start<U: Uniforms<f64>>(&self, power: &Power, uniforms: &mut U) -> StartOf<Power> {
        let x: f64 = uniforms.uniform();
        // Half a unit of the generator: 0 is not drawn.
        Start::of(power, x + 2.0_f64.powi(-54), 1.0)
    }
}

/// Wants error bars that can be believed; scores are far above what rounding leaves.
struct Doubting;

impl Observer for Doubting {
    fn rounding_floor(&self, _: &Statistics) -> Option<f64> {
        Some(0.0)
    }
}

fn options() -> RunOptions {
    RunOptions {
        batch: 64,
        tolerance: Some(Tolerance::Relative(0.3)),
        ..RunOptions::new(1_000_000)
    }
}

/// The statistics and the end by rayon, and by the embedded runner in pieces of so many walks.
fn both(equation: &Power, doubting: bool, piece: u64) -> [(Statistics, StopReason); 2] {
    let none = NoNeighbour::new(equation);
    let goals = [Goal::new(Mean, Some(0.0))];
    let job: Goals<'_, _, _, _> = Goals::new(equation, &none, &goals, WalkOptions::default());
    let observer: &dyn Observer = if doubting { &Doubting } else { &() };
    let outcome = run(&job, &options(), None, observer).unwrap();
    let mut driver = Driver::<_, 1>::new(&job, 0, options()).unwrap();
    let mut tails = [Tail::default()];
    let stop = loop {
        let progress = if doubting {
            driver.poll_with_tails(&job, piece, &mut tails, 0.0)
        } else {
            driver.poll(&job, piece)
        };
        if let Some(stop) = progress.unwrap().stop {
            break stop;
        }
    };
    let [statistics] = driver.statistics();
    [(outcome.statistics[0], outcome.stop), (statistics, stop)]
}

#[test]
fn both_runners_go_on_until_an_error_bar_is_believed() {
    // Scores of infinite variance.
    let heavy = Power(0.9);
    let [rayon, embedded] = both(&heavy, false, 77);
    assert_eq!(rayon, embedded);
    let early = rayon.0.walks();
    for piece in [1, 77, 10_000] {
        let [rayon, embedded] = both(&heavy, true, piece);
        assert_eq!(rayon, embedded, "{piece}");
        let late = rayon.0.walks();
        assert!(late > early, "{early} {late}");
    }
}

#[test]
fn an_error_bar_that_is_believed_takes_no_walk_more() {
    let light = Power(0.1);
    let [once, _] = both(&light, false, 77);
    for runner in both(&light, true, 77) {
        assert_eq!(runner, once);
    }
}
