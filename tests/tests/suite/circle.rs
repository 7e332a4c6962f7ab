//! What is special to the circle: the edges of its cells, and p_j to eight rounding errors.

use core::f64::consts::TAU;

use fredholm_circle::{Circle, Tables};
use fredholm_core::galerkin::{AllPointwise, Partition, TransitionMoments};
use fredholm_core::{
    DefaultGenerator, Located, Neighbour, NoDraws, Real, RngUniforms, Sampler, WalkSeeds,
};
use fredholm_tests::check::SEEDS;
use fredholm_tests::circle::{LIGHT, RHO, described, with_piecewise, with_residual};
use fredholm_tests::examine;

#[test]
fn one_cell_is_a_partition_too() {
    for seed in SEEDS {
        described::<f64, _>(&[0.5], 1, LIGHT, |circle| {
            examine(circle, seed).assert_passed("one cell");
        });
    }
}

#[test]
fn the_closed_residual_is_the_generic_one() {
    with_piecewise::<f64, _, _, _>(&RHO, 100, LIGHT, AllPointwise, |circle, generic, _| {
        with_residual::<f64, _, _>(&RHO, 100, LIGHT, |_, closed, _| {
            for j in 0..100 {
                let x = closed.locate(circle.point(TAU * (f64::from(j) + 0.37) / 100.0));
                let [generic, closed] = [
                    generic.source(&x, &mut NoDraws),
                    closed.source(&x, &mut NoDraws),
                ];
                assert!((generic - closed).abs() < 1e-13);
            }
        });
    });
}

#[test]
fn cells_are_found_at_their_edges() {
    fn at<F: Real>(cells: usize, step: usize) {
        let tables = Tables::<F>::new(&[0.5], cells).unwrap();
        let circle = Circle::new(tables.cells(), LIGHT, 0.2).unwrap();
        // The pseudo-angles of an edge and of a point are each wrong by a few ε, and an angle is up
        // to 4π times as wide: beyond 64 ε a point is inside.
        let width = TAU / cells as f64;
        let inside = (64.0 * F::EPSILON.to_f64() / width).min(0.5);
        for j in (0..cells).step_by(step) {
            for t in [inside, 0.5, 1.0 - inside] {
                let point = circle.point(TAU * ((j as f64 + t) / cells as f64));
                assert_eq!(circle.locate(&point), j, "{t} of {j} of {cells}");
            }
        }
        // [left, right): an edge that is hit exactly belongs to the cell on its right.
        assert_eq!(circle.locate(&circle.point(0.0)), 0);
        if cells.is_multiple_of(2) {
            assert_eq!(
                circle.locate(&circle.point(core::f64::consts::PI)),
                cells / 2
            );
        }
    }
    for cells in [1, 2, 3, 10, 1000, 12_345] {
        at::<f64>(cells, 1);
        at::<f32>(cells, 1);
    }
    at::<f64>(1_000_000, 997);
}

#[test]
fn transition_masses_have_eight_rounding_errors_at_most() {
    // In f32 the reference is f64 on the same stored point.
    for cells in [10, 1000, 100_000] {
        let tables = Tables::<f32>::new(&[0.5], cells).unwrap();
        let circle = Circle::new(tables.cells(), LIGHT, 0.2).unwrap();
        let mut worst = 0.0_f64;
        let mut draws = RngUniforms(WalkSeeds::<DefaultGenerator>::new(5, 0).generator(0));
        let mut x = circle.point(1.0);
        for turn in 0..2000 {
            x = circle.step(&x, &mut draws).unwrap();
            let i = circle.locate(&x);
            let (c, s) = x.half_angle();
            let half = f64::from(s).atan2(f64::from(c));
            for j in [0, 1, cells - 1, cells / 2, turn % cells] {
                let j = (i + j) % cells;
                let middle = core::f64::consts::PI * ((j as f64 + 0.5) / cells as f64);
                let quarter = core::f64::consts::PI / (2.0 * cells as f64);
                let exact = (1.0 - f64::from(0.2_f32))
                    * if i == j {
                        // 1 − cos A cos B = sin²((A−B)/2) + sin²((A+B)/2)
                        let b = half - middle;
                        let square = |x: f64| (0.5 * x).sin().powi(2);
                        square(quarter - b) + square(quarter + b)
                    } else {
                        quarter.sin() * (middle - half).sin().abs()
                    };
                let [[mass]] = circle.moments(&Located { point: x, cell: i }, j);
                let error = (f64::from(mass) / exact - 1.0).abs() / f64::from(f32::EPSILON);
                worst = worst.max(error);
                assert!(error <= 8.0, "n = {cells}, from {i} to {j}: {error} eps");
            }
        }
        println!("n = {cells}: at most {worst:.2} eps");
    }
}

/// p_j(x) to 16 digits for the point at an angle, computed with 60 digits elsewhere from the stored
/// (cos, sin): (n, angle, j, p_j). Neighbouring cells, own cells, and far ones.
// Angles at an edge of a cell on purpose.
#[allow(clippy::approx_constant)]
const MASSES: [(usize, f64, usize, f64); 72] = [
    (10, 0.01, 0, 0.018969117330585067),
    (10, 0.01, 1, 0.0562575643791833),
    (10, 0.01, 2, 0.0880491290360144),
    (10, 0.01, 9, 0.02019518017864137),
    (10, 0.01, 0, 0.018969117330585067),
    (10, 0.01, 3, 0.11122183146844533),
    (10, 0.6283, 0, 0.019576248254083568),
    (10, 0.6283, 1, 0.01957853874245167),
    (10, 0.6283, 2, 0.05681684192083638),
    (10, 0.6283, 9, 0.05681477561045108),
    (10, 0.6283, 0, 0.019576248254083568),
    (10, 0.6283, 3, 0.0884935167457945),
    (10, 3.2, 5, 0.01630090386020708),
    (10, 3.2, 6, 0.053535622694447636),
    (10, 3.2, 7, 0.08587101934153506),
    (10, 3.2, 4, 0.023178305188394026),
    (10, 3.2, 5, 0.01630090386020708),
    (10, 3.2, 8, 0.10980076231690053),
    (10, 5.9, 9, 0.010319874252053373),
    (10, 5.9, 0, 0.042756703969556706),
    (10, 5.9, 1, 0.07700972050191617),
    (10, 5.9, 8, 0.0345426887636147),
    (10, 5.9, 9, 0.010319874252053373),
    (10, 5.9, 2, 0.10372448903327501),
    (1000, 0.0062, 0, 1.922344450565304e-06),
    (1000, 0.0062, 1, 2.0261860390199837e-06),
    (1000, 0.0062, 2, 5.9740045514341145e-06),
    (1000, 0.0062, 999, 5.869472015150592e-06),
    (1000, 0.0062, 50, 0.00019468304202526333),
    (1000, 0.0062, 333, 0.0010866567609169825),
    (1000, 1.0, 159, 1.4570065078600326e-06),
    (1000, 1.0, 160, 5.310053845659068e-06),
    (1000, 1.0, 161, 9.257826038679125e-06),
    (1000, 1.0, 158, 2.585608801209138e-06),
    (1000, 1.0, 209, 0.00019792660805368207),
    (1000, 1.0, 492, 0.001088302311664916),
    (1000, 3.1416, 500, 1.9693087756202345e-06),
    (1000, 3.1416, 501, 5.917122455857112e-06),
    (1000, 3.1416, 502, 9.864883133458482e-06),
    (1000, 3.1416, 499, 1.978535134794536e-06),
    (1000, 3.1416, 550, 0.00019852608221136372),
    (1000, 3.1416, 833, 0.0010886057026317844),
    (1000, 6.283, 999, 1.8609213802192882e-06),
    (1000, 6.283, 0, 2.0903509913805017e-06),
    (1000, 6.283, 1, 6.038168856981756e-06),
    (1000, 6.283, 998, 5.805307669010982e-06),
    (1000, 6.283, 49, 0.00019474643210724854),
    (1000, 6.283, 332, 0.0010866889850798624),
    (1000000, 0.00000627, 0, 1.9656536926146612e-12),
    (1000000, 0.00000627, 1, 1.9822054530503772e-12),
    (1000000, 0.00000627, 2, 5.93004721346331e-12),
    (1000000, 0.00000627, 999999, 5.913478067795216e-12),
    (1000000, 0.00000627, 50000, 1.965794050190715e-07),
    (1000000, 0.00000627, 333333, 1.088277977744592e-06),
    (1000000, 0.7853981, 124999, 1.9344890122772865e-12),
    (1000000, 0.7853981, 125000, 2.0137546718006535e-12),
    (1000000, 0.7853981, 125001, 5.961596432213273e-12),
    (1000000, 0.7853981, 124998, 5.881928849045247e-12),
    (1000000, 0.7853981, 174999, 1.9657943617987464e-07),
    (1000000, 0.7853981, 458332, 1.0882779935192724e-06),
    (1000000, 2.5, 397887, 1.0668680236028224e-12),
    (1000000, 2.5, 397888, 4.509502240691308e-12),
    (1000000, 2.5, 397889, 8.457344001071261e-12),
    (1000000, 2.5, 397886, 3.3861812801631555e-12),
    (1000000, 2.5, 447887, 1.965819012008627e-07),
    (1000000, 2.5, 731220, 1.0882792413965006e-06),
    (1000000, 6.28318, 999999, 1.4559371165989381e-12),
    (1000000, 6.28318, 0, 5.308520160378931e-12),
    (1000000, 6.28318, 1, 9.256361920745135e-12),
    (1000000, 6.28318, 999998, 2.587163360471693e-12),
    (1000000, 6.28318, 49999, 1.9658269038145032e-07),
    (1000000, 6.28318, 333332, 1.0882796409056557e-06),
];

#[test]
fn transition_masses_have_eight_rounding_errors_in_f64_too() {
    let mut worst = 0.0_f64;
    for (cells, angle, j, exact) in MASSES {
        let tables = Tables::<f64>::new(&[0.5], cells).unwrap();
        let circle = Circle::new(tables.cells(), LIGHT, 0.2).unwrap();
        let point = circle.point(angle);
        let cell = circle.locate(&point);
        let [[mass]] = circle.moments(&Located { point, cell }, j);
        let error = (mass / exact - 1.0).abs() / f64::EPSILON;
        worst = worst.max(error);
        assert!(
            error <= 8.0,
            "n = {cells}, {angle} to {j}: {mass} {exact} {error} eps"
        );
    }
    println!("at most {worst:.2} eps");
}
