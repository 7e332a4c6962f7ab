//! Walks side by side have the bits of walks one by one.
#![cfg(all(feature = "alloc", feature = "lanes"))]

use fredholm_circle::{
    Arcs, Circle, Emission, Harmonic, LaneNeighbour, MeanOver, Point, Residual, SideBySide, Tables,
    residual_moments,
};
use fredholm_core::galerkin::{DiagonalRule, PairKind, Piecewise};
use fredholm_core::{
    At, Batch, Estimator, Form, Functional, Goal, Goals, Job, Neighbour, NoNeighbour, Statistics,
    WalkOptions,
};

const WALKS: u64 = 1200;

/// Statistics of one batch, run in pieces of which some are smaller than a block.
fn statistics(job: &dyn Job) -> Statistics {
    statistics_of(WALKS, job)
}

fn statistics_of(walks: u64, job: &dyn Job) -> Statistics {
    let mut batch = Batch::new(2, walks, 3 * walks);
    for piece in [1, 9, 600, u64::MAX] {
        job.run(0, &mut batch, piece).unwrap();
    }
    assert!(batch.is_done());
    *batch.statistics()
}

/// What one setting gives: (one by one, side by side).
fn both<E, N, T>(
    circle: &Circle<'_, f64, E>,
    neighbour: &N,
    functional: T,
    options: WalkOptions,
    is_same: bool,
) -> [Statistics; 2]
where
    E: Emission<f64> + Sync,
    N: LaneNeighbour<f64, E> + Sync,
    T: for<'x> Functional<Circle<'x, f64, E>> + Sync,
{
    let goals = [Goal {
        functional,
        control_mean: None,
    }];
    let goals = Goals::new(circle, neighbour, &goals, options);
    let alone = statistics(&goals);
    let lanes = SideBySide::new(goals);
    let beside = statistics(&lanes);
    if is_same {
        let promised = SideBySide::with_same_kernel(goals);
        assert_eq!(statistics(&promised), alone);
    }
    [alone, beside]
}

fn compare<E: Emission<f64> + Copy + Sync>(tables: &Tables<f64>, emission: E, absorption: f64) {
    let circle = Circle::new(tables.cells(), emission, absorption).unwrap();
    let solution = circle.solve(1e-12, 1000).unwrap();
    let v = &solution.v;
    let settings = [Form::Product, Form::Residual]
        .into_iter()
        .flat_map(|form| {
            let estimators = [Estimator::Absorption, Estimator::Collision];
            estimators.map(|estimator| (form, estimator))
        });
    for (form, estimator) in settings {
        for step_limit in [3, 1_000_000] {
            let options = WalkOptions {
                seed: 7,
                form,
                estimator,
                step_limit,
                ..WalkOptions::default()
            };
            for diagonal in [PairKind::Dropped, PairKind::Pointwise, PairKind::Galerkin] {
                let pairs = DiagonalRule { diagonal };
                let g = solution.source(&circle, &pairs).unwrap();
                let neighbour = Piecewise::with_pointwise(&circle, &circle, pairs, v, &g).unwrap();
                let at = At(circle.point(0.3));
                let [alone, beside] = both(&circle, &neighbour, at, options, false);
                assert_eq!(alone, beside, "{diagonal:?} {options:?}");
                let mean = MeanOver::new(&circle, 0.5, 4.0).unwrap();
                let [alone, beside] = both(&circle, &neighbour, mean, options, false);
                assert_eq!(alone, beside, "{diagonal:?} {options:?}");
                assert!(alone.walks() == WALKS);
            }
            let moments = residual_moments(&circle, &solution).unwrap();
            let neighbour: Residual<'_, _, _> = Residual::new(&circle, v, &moments).unwrap();
            let at = At(circle.point(6.0));
            let [alone, beside] = both(&circle, &neighbour, at, options, true);
            assert_eq!(alone, beside, "all pairs pointwise");
            plain(&circle, options);
        }
    }
}

/// Plain walks.
fn plain<E: Emission<f64> + Sync>(circle: &Circle<'_, f64, E>, options: WalkOptions) {
    let none: NoNeighbour<Circle<'_, f64, E>> = NoNeighbour::new();
    let none: &(dyn Neighbour<Scalar = f64, Point = Point<f64>> + Sync) = &none;
    let goals = [Goal {
        functional: At(circle.point(0.3)),
        control_mean: Some(0.0),
    }];
    let goals = Goals::new(circle, none, &goals, options);
    let beside = SideBySide::with_same_kernel(goals);
    assert_eq!(statistics(&goals), statistics(&beside), "plain");
}

#[test]
fn bits_do_not_depend_on_lanes() {
    let light = Harmonic {
        constant: 5.0,
        amplitude: 1.0,
        frequency: 5,
    };
    // Cells of which walks hit the own one seldom and often; walks that end at once, and that fill a block alone.
    for (reflectance, cells) in [
        (&[0.7][..], 1),
        (&[0.3, 0.0], 2),
        (&[0.5, 0.2, 0.7], 9),
        (&[0.11, 0.52, 0.7, 0.03, 0.33], 1000),
    ] {
        let tables = Tables::new(reflectance, cells).unwrap();
        for absorption in [0.9, 0.2, 0.03] {
            compare(&tables, light, absorption);
            let arcs = [1.0, 0.0][..cells.min(2)].to_vec();
            if cells % arcs.len() == 0 {
                compare(&tables, Arcs::new(&arcs, cells).unwrap(), absorption);
            }
        }
    }
}

/// A third of these walks has more states than a block has numbers.
#[test]
fn a_walk_may_be_longer_than_a_block() {
    let tables = Tables::new(&[0.6, 0.99], 10).unwrap();
    let emission = Arcs::new(&[1.0], 10).unwrap();
    let circle = Circle::new(tables.cells(), emission, 3e-4).unwrap();
    let solution = circle.solve(1e-12, 1000).unwrap();
    let moments = residual_moments(&circle, &solution).unwrap();
    let neighbour: Residual<'_, _, _> = Residual::new(&circle, &solution.v, &moments).unwrap();
    let goals = [Goal {
        functional: At(circle.point(1.0)),
        control_mean: None,
    }];
    let goals = Goals::new(&circle, &neighbour, &goals, WalkOptions::default());
    let alone = statistics_of(100, &goals);
    assert_eq!(statistics_of(100, &SideBySide::new(goals)), alone);
    assert!(alone.states() > 200_000);
}
