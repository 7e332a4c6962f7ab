//! What is special to the circle: the edges of its cells, and p_j to eight rounding errors.

use core::f64::consts::TAU;

use fredholm_circle::{Arcs, LitArcs};
use fredholm_core::galerkin::{AllPointwise, Cells, TransitionMoments};
use fredholm_core::{Equation, LastStep, Located, Neighbour, NoDraws, Real};
use fredholm_tests::check::seeds;
use fredholm_tests::circle::{Described, LIGHT, RHO, circle, with_polynomials, with_residual};
use fredholm_tests::examine;

#[test]
fn one_cell_is_a_partition_too() {
    for &seed in seeds() {
        let described = Described::<f64>::new(&[0.5], 1, LIGHT);
        examine::<_, 1>(&described, seed).assert_passed("one cell");
        examine::<_, 5>(&described, seed).assert_passed("one cell of degree 4");
    }
}

#[test]
fn the_closed_residual_is_the_generic_one() {
    fn check<const B: usize>() {
        with_polynomials::<f64, _, _, _, B>(
            &RHO,
            100,
            LIGHT,
            AllPointwise,
            |circle, generic, _| {
                with_residual::<f64, _, _, B>(&RHO, 100, LIGHT, |_, closed, _| {
                    for j in 0..100 {
                        let x = closed.locate(circle.point(TAU * (f64::from(j) + 0.37) / 100.0));
                        let [generic, closed] = [
                            generic.source(&x, &mut NoDraws),
                            closed.source(&x, &mut NoDraws),
                        ];
                        assert!((generic - closed).abs() < 1e-13);
                    }
                });
            },
        );
    }
    check::<1>();
    check::<4>();
    check::<7>();
}

/// T_K F in closed form is the sum of the exact integrals over all cells.
#[test]
fn last_steps_lead_to_bright_arcs() {
    let values = [2.0, 0.0, 0.5, 0.0, 0.0];
    let arcs = Arcs::new(values, 20).unwrap();
    let plain = circle::<f64, f64, _>(&RHO, 20, arcs);
    let lights = LitArcs::new(arcs, plain.tables()).unwrap();
    let lit = circle::<f64, f64, _>(&RHO, 20, lights);
    for s in [0.1, 1.3, 3.0, 6.2] {
        let point = lit.point(s);
        let x = Located {
            point,
            cell: point.cell(),
        };
        let masses = (0..20).map(|j| TransitionMoments::<1>::moments(&plain, &x, j)[0][0]);
        let light: f64 = masses.enumerate().map(|(j, p)| p * values[j / 4]).sum();
        let expected = RHO[x.cell / 4] * light;
        let found = LastStep(&lit).source(&point, &mut NoDraws);
        assert!((found - expected).abs() < 1e-15, "{s}: {found} {expected}");
    }
}

#[test]
fn cells_are_found_at_their_edges() {
    fn at<F: Real>(cells: usize, step: usize) {
        let circle = circle::<F, F, _>(&[0.5], cells, LIGHT);
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

/// p_j(x) to 16 digits for the point at an angle, computed with 60 digits elsewhere from the stored
/// (cos, sin): (n, angle, j, p_j). Neighbouring cells, own cells, and far ones.
// Angles at an edge of a cell on purpose.
#[allow(clippy::approx_constant)]
const MASSES: [(usize, f64, usize, f64); 68] = [
    (10, 0.01, 0, 0.023711396663231334),
    (10, 0.01, 1, 0.07032195547397913),
    (10, 0.01, 2, 0.110061411295018),
    (10, 0.01, 9, 0.025243975223301712),
    (10, 0.01, 3, 0.13902728933555666),
    (10, 0.6283, 0, 0.02447031031760446),
    (10, 0.6283, 1, 0.024473173428064588),
    (10, 0.6283, 2, 0.07102105240104548),
    (10, 0.6283, 9, 0.07101846951306386),
    (10, 0.6283, 3, 0.11061689593224312),
    (10, 3.2, 5, 0.02037612982525885),
    (10, 3.2, 6, 0.06691952836805955),
    (10, 3.2, 7, 0.10733877417691882),
    (10, 3.2, 4, 0.028972881485492534),
    (10, 3.2, 8, 0.13725095289612566),
    (10, 5.9, 9, 0.012899842815066715),
    (10, 5.9, 0, 0.053445879961945886),
    (10, 5.9, 1, 0.09626215062739521),
    (10, 5.9, 8, 0.04317836095451837),
    (10, 5.9, 2, 0.12965561129159375),
    (1000, 0.0062, 0, 2.40293056320663e-06),
    (1000, 0.0062, 1, 2.5327325487749795e-06),
    (1000, 0.0062, 2, 7.467505689292643e-06),
    (1000, 0.0062, 999, 7.33684001893824e-06),
    (1000, 0.0062, 50, 0.00024335380253157917),
    (1000, 0.0062, 333, 0.001358320951146228),
    (1000, 1.0, 159, 1.8212581348250408e-06),
    (1000, 1.0, 160, 6.637567307073835e-06),
    (1000, 1.0, 161, 1.1572282548348906e-05),
    (1000, 1.0, 158, 3.2320110015114225e-06),
    (1000, 1.0, 209, 0.0002474082600671026),
    (1000, 1.0, 492, 0.001360377889581145),
    (1000, 3.1416, 500, 2.461635969525293e-06),
    (1000, 3.1416, 501, 7.39640306982139e-06),
    (1000, 3.1416, 502, 1.2331103916823103e-05),
    (1000, 3.1416, 499, 2.47316891849317e-06),
    (1000, 3.1416, 550, 0.00024815760276420464),
    (1000, 3.1416, 833, 0.0013607571282897306),
    (1000, 6.283, 999, 2.3261517252741104e-06),
    (1000, 6.283, 0, 2.612938739225627e-06),
    (1000, 6.283, 1, 7.547711071227195e-06),
    (1000, 6.283, 998, 7.256634586263727e-06),
    (1000, 6.283, 49, 0.00024343304013406066),
    (1000, 6.283, 332, 0.001358361231349828),
    (1000000, 0.00000627, 0, 2.4570671157683264e-12),
    (1000000, 0.00000627, 1, 2.4777568163129713e-12),
    (1000000, 0.00000627, 2, 7.412559016829137e-12),
    (1000000, 0.00000627, 999999, 7.39184758474402e-12),
    (1000000, 0.00000627, 50000, 2.457242562738394e-07),
    (1000000, 0.00000627, 333333, 1.36034747218074e-06),
    (1000000, 0.7853981, 124999, 2.418111265346608e-12),
    (1000000, 0.7853981, 125000, 2.517193339750817e-12),
    (1000000, 0.7853981, 125001, 7.45199554026659e-12),
    (1000000, 0.7853981, 124998, 7.352411061306559e-12),
    (1000000, 0.7853981, 174999, 2.457242952248433e-07),
    (1000000, 0.7853981, 458332, 1.3603474918990905e-06),
    (1000000, 2.5, 397887, 1.333585029503528e-12),
    (1000000, 2.5, 397888, 5.636877800864135e-12),
    (1000000, 2.5, 397889, 1.0571680001339077e-11),
    (1000000, 2.5, 397886, 4.232726600203944e-12),
    (1000000, 2.5, 447887, 2.4572737650107836e-07),
    (1000000, 2.5, 731220, 1.3603490517456258e-06),
    (1000000, 6.28318, 999999, 1.8199213957486727e-12),
    (1000000, 6.28318, 0, 6.635650200473664e-12),
    (1000000, 6.28318, 1, 1.157045240093142e-11),
    (1000000, 6.28318, 999998, 3.233954200589616e-12),
    (1000000, 6.28318, 49999, 2.457283629768129e-07),
    (1000000, 6.28318, 333332, 1.3603495511320696e-06),
];

#[test]
fn transition_masses_have_eight_rounding_errors_at_most() {
    let mut worst = 0.0_f64;
    let of_cells = |cells| circle::<f64, f64, _>(&[0.5], cells, LIGHT);
    let circles = [10, 1000, 1_000_000].map(|cells| (cells, of_cells(cells)));
    for (cells, angle, j, exact) in MASSES {
        let (_, circle) = circles.iter().find(|(own, _)| *own == cells).unwrap();
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
