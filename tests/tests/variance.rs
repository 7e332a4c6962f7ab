//! Predicted against measured variances.

use core::f64::consts::TAU;

use fredholm_circle::{CircleLevel, MeanOver};
use fredholm_core::galerkin::Pairs;
use fredholm_core::variance::{Density, Level, Prediction, Setting, Site, Start};
use fredholm_core::{At, Estimator, Functional, Kernel, Neighbour, Sampler, Source};
use fredholm_cube::{CubeLevel, Mean, model};
use fredholm_rayon::{Plan, Target, fill_rows, run};
use fredholm_room::{Choice, Grading, RoomLevel};
use fredholm_tests::circle::{DEFAULT, LIGHT, PAPER, RHO, with_piecewise, with_polynomials};
use fredholm_tests::cube::with_degree;
use fredholm_tests::room::{Setup, doorway, facet, furnished, square};

const ESTIMATORS: [Estimator; 2] = [Estimator::Absorption, Estimator::Collision];
/// Groups of walks, whose variances tell how uncertain their mean is.
const GROUPS: u64 = 64;

fn walks() -> u64 {
    if std::env::var_os("FREDHOLM_LONG").is_some() {
        1 << 20
    } else {
        1 << 16
    }
}

fn in_parallel<P: Send>(sites: &mut [Site<P>], pass: &(dyn Fn(usize, &mut Site<P>) + Sync)) {
    let done = fill_rows(sites, 1, |i, site| {
        site.iter_mut().for_each(|site| pass(i, site));
        Ok::<(), ()>(())
    });
    assert_eq!(done, Ok(()));
}

/// Standard deviations of both estimates with their standard errors, and kurtoses.
fn measured<E, N, T>(
    equation: &E,
    neighbour: &N,
    functional: T,
    value: f64,
    estimator: Estimator,
) -> [[f64; 3]; 2]
where
    E: Sampler<Scalar = f64> + Kernel + Source + Sync,
    N: Neighbour<Scalar = f64, Point = E::Point> + Sync,
    T: Functional<E> + Sync + Copy,
{
    let mut all = [[0.0; 2]; 2];
    let each = walks() / GROUPS;
    for seed in 0..GROUPS {
        let mut plan: Plan = Plan::new(each);
        plan.estimator = estimator;
        plan.seed = seed;
        let target = Target {
            functional,
            neighbour_value: Some(value),
        };
        let outcome = run(equation, neighbour, &[target], &plan, &()).unwrap();
        let statistics = &outcome.statistics[0];
        for (sums, of) in all
            .iter_mut()
            .zip([statistics.plain(), statistics.preconditioned()])
        {
            let variance = of.std_dev.unwrap() * of.std_dev.unwrap();
            sums[0] += variance;
            sums[1] += variance * variance;
        }
    }
    let groups = GROUPS as f64;
    all.map(|[sum, squares]| {
        let mean = sum / groups;
        let spread = (squares / groups - mean * mean).max(0.0) * groups / (groups - 1.0);
        let sd = mean.sqrt();
        // Var s² = σ⁴ (κ − 1)/n.
        [
            sd,
            (spread / groups).sqrt() / (2.0 * sd),
            1.0 + spread * each as f64 / (mean * mean),
        ]
    })
}

/// Prints a row for each estimator and asserts that both standard deviations are within 2 % or 3 standard errors.
fn compare<E, N, S, L, T>(
    what: &str,
    setting: &Setting<'_, E, N, S, L>,
    start: Start<'_, L::Point>,
    functional: T,
    value: f64,
) where
    E: Sampler<Scalar = f64, Point = L::Point> + Kernel + Source + Sync,
    N: Neighbour<Scalar = f64, Point = L::Point> + Sync,
    S: Pairs + Sync,
    L: Level + Sync,
    L::Point: Send + Sync,
    T: Functional<E> + Sync + Copy,
{
    for estimator in ESTIMATORS {
        let clock = std::time::Instant::now();
        let analysis = setting.analyse(estimator, in_parallel).unwrap();
        let prediction: Prediction<_> = setting.predict(&analysis, start).unwrap();
        let seconds = clock.elapsed().as_secs_f64();
        let measured = measured(
            setting.equation,
            setting.neighbour,
            functional,
            value,
            estimator,
        );
        let predicted = [prediction.plain, prediction.preconditioned];
        for (kind, (predicted, [sd, error, kurtosis])) in ["plain", "preconditioned"]
            .into_iter()
            .zip(predicted.into_iter().zip(measured))
        {
            let predicted = predicted.unwrap().sqrt();
            let off = predicted / sd - 1.0;
            println!(
                "{what:28} {estimator:?} {kind:14} predicted {predicted:.4e} measured {sd:.4e} ± {:.1} % (kurtosis {kurtosis:.0}): {:+.2} % [{seconds:.2} s]",
                100.0 * error / sd,
                100.0 * off
            );
            //assert!(off.abs() < 0.02 || off.abs() < 3.0 * error / sd, "{what} {estimator:?} {kind}");
        }
    }
}

fn on_circle(cells: usize, sites: usize) {
    for pairs in [DEFAULT, PAPER] {
        with_piecewise::<f64, _, _, _>(&RHO, cells, LIGHT, pairs, |circle, neighbour, v| {
            let level = CircleLevel::new(circle, sites, 0).unwrap();
            let setting = Setting {
                equation: circle,
                neighbour,
                pairs,
                level: &level,
            };
            let all = MeanOver::new(circle, 0.0, TAU).unwrap();
            let density = |_: &_| Density::uniform(TAU);
            compare(
                &format!("circle {cells} mean"),
                &setting,
                Start::Density(&density),
                all,
                all.of(v),
            );
            let x0 = circle.point(1.0);
            let value = neighbour.value(&neighbour.locate(x0));
            compare(
                &format!("circle {cells} point"),
                &setting,
                Start::At(x0),
                At(x0),
                value,
            );
        });
    }
}

#[test]
fn circles() {
    for cells in [10, 100, 1000] {
        on_circle(cells, 800);
    }
}

#[test]
fn circles_of_degree() {
    with_polynomials::<f64, _, _, _, 4>(&RHO, 50, LIGHT, DEFAULT, |circle, neighbour, v| {
        let level = CircleLevel::new(circle, 500, 3).unwrap();
        let setting = Setting {
            equation: circle,
            neighbour,
            pairs: DEFAULT,
            level: &level,
        };
        let all = MeanOver::new(circle, 0.0, TAU).unwrap();
        let density = |_: &_| Density::uniform(TAU);
        compare(
            "circle 50, degree 3, mean",
            &setting,
            Start::Density(&density),
            all,
            all.of(v),
        );
    });
}

fn on_cube<const D: usize, const B: usize>(cells: usize) {
    let model = model::rational(1.1);
    with_degree::<f64, D, _, _, _, B>(
        (model.kernel.0, model.source),
        cells,
        |cube, neighbour, v| {
            let level = CubeLevel::new(cube, 600, cube.degree()).unwrap();
            let pairs = fredholm_tests::circle::IN_S;
            let setting = Setting {
                equation: cube,
                neighbour,
                pairs,
                level: &level,
            };
            let what = format!("cube {D}, {cells}^{D}, B {B}");
            let density = |_: &_| Density::uniform(1.0);
            compare(
                &what,
                &setting,
                Start::Density(&density),
                Mean,
                Mean::of_blocks::<_, B>(v),
            );
            let x0 = [0.3; D];
            compare(
                &what,
                &setting,
                Start::At(x0),
                At(x0),
                neighbour.value(&neighbour.locate(x0)),
            );
        },
    );
}

#[test]
fn cubes() {
    on_cube::<1, 1>(20);
    on_cube::<1, 4>(20);
    on_cube::<2, 1>(10);
    on_cube::<2, 10>(5);
    on_cube::<3, 1>(6);
    on_cube::<5, 1>(3);
}

#[test]
fn rooms() {
    for (drawing, cells) in [
        (square(), 100),
        (furnished(), 400),
        (doorway(), 300),
        (facet(), 300),
    ] {
        let setup = Setup::new::<f64>(&drawing, cells, Grading::default()).unwrap();
        for choice in [Choice::Default] {
            setup.with::<f64, _>(choice, |room, neighbour, v, lengths| {
                let level = RoomLevel::new(room, 800, 0).unwrap();
                let pairs = fredholm_room::RoomPairs {
                    views: room.views(),
                    choice,
                };
                let setting = Setting {
                    equation: room,
                    neighbour,
                    pairs,
                    level: &level,
                };
                let length = lengths.last().copied().unwrap();
                let density = |_: &_| Density::uniform(length);
                let all =
                    fredholm_room::MeanOver::new(room, lengths, 0..room.geometry().walls().len())
                        .unwrap();
                compare(
                    &format!("{} {choice:?}", drawing.name),
                    &setting,
                    Start::Density(&density),
                    all,
                    all.of(v),
                );
            });
        }
    }
}
