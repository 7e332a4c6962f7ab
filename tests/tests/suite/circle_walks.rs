//! Walks on the circle against exact solutions: means, error bars, rates, bits.

use core::f64::consts::TAU;

use fredholm_circle::{Arcs, Circle, CircleError, Emission, Harmonic, LitArcs, MeanOver, Point};
use fredholm_core::galerkin::Cells;
use fredholm_core::{
    At, Batch, Equation, Estimator, Goal, Goals, Job, LastStep, Lights, Neighbour, NeighbourOf,
    NoDraws, NoNeighbour, NotFinite, Real, Statistics, Termination, WalkOptions, rounding_floor,
};
use fredholm_tests::check::means;
use fredholm_tests::circle::{
    DEFAULT, IN_S, LIGHT, Owned, PAPER, RHO, with_piecewise, with_residual,
};
use fredholm_tests::{all_ways, paper, run};

/// u at a point, u's mean over [1, 4] and over the circle, with both estimators and by roulette.
fn check_means<F: Real, E: Emission<F> + Copy + Sync, N>(
    circle: &Owned<F, E>,
    neighbour: &N,
    v: &[F],
    exact: [f64; 3],
    walks: u64,
    what: &str,
) where
    N: NeighbourOf<Owned<F, E>> + Sync,
{
    let largest = v.iter().fold(0.0, |m: f64, v| m.max(v.to_f64().abs()));
    let start = circle.point(0.3);
    let at = neighbour.value(&neighbour.locate(start)).to_f64();
    for options in all_ways(11) {
        let of = |seed| WalkOptions {
            seed: options.seed + seed,
            ..options
        };
        let mean = |from, to, seed| {
            let mean = MeanOver::new(from, to).unwrap();
            let goal = Goal::new(mean, Some(mean.of(circle.cells(), v)));
            run(circle, neighbour, &goal, of(seed), walks)
        };
        let cases: [Statistics; 3] = [
            run(
                circle,
                neighbour,
                &Goal::new(At(start), Some(at)),
                of(0),
                walks,
            ),
            mean(1.0, 4.0, 1),
            mean(0.0, TAU, 2),
        ];
        for (target, (statistics, exact)) in cases.iter().zip(exact).enumerate() {
            let floor = rounding_floor::<F>(largest, exact, 0.74);
            means(statistics, Some(exact), floor)
                .ok()
                .unwrap_or_else(|e| panic!("{what}, {options:?}, target {target}: {e}"));
            assert_eq!(statistics.terminations().absorbed, walks);
        }
    }
}

fn harmonic_exact(light: Harmonic) -> [f64; 3] {
    [
        light.solution(0.3),
        light.mean(1.0, 4.0),
        light.mean(0.0, TAU),
    ]
}

#[test]
fn means_are_the_solution_57_58_for_every_choice_of_pairs() {
    fn check<F: Real>(cells: usize, walks: u64) {
        for pairs in [PAPER, DEFAULT, IN_S] {
            with_piecewise::<F, _, _, _>(&RHO, cells, LIGHT, pairs, |circle, neighbour, v| {
                let what = format!("{pairs:?}, n = {cells}, eps {:e}", F::EPSILON);
                check_means(circle, neighbour, v, harmonic_exact(LIGHT), walks, &what);
            });
        }
        with_residual::<F, _, _, 1>(&RHO, cells, LIGHT, |circle, neighbour, v| {
            let what = format!("all pointwise, n = {cells}, eps {:e}", F::EPSILON);
            check_means(circle, neighbour, v, harmonic_exact(LIGHT), walks, &what);
        });
    }
    check::<f64>(10, 20_000);
    check::<f32>(1000, 20_000);
}

/// In f32 at many cells the standard error is far below the rounding floor.
#[test]
fn in_f32_the_error_stays_below_the_rounding_floor() {
    with_piecewise::<f32, _, _, _>(&RHO, 100_000, LIGHT, DEFAULT, |circle, neighbour, v| {
        check_means(
            circle,
            neighbour,
            v,
            harmonic_exact(LIGHT),
            100_000,
            "n = 100,000",
        );
    });
}

/// F = cos kθ, ρ = ½ on the whole circle: cos kθ is an eigenfunction with eigenvalue 1/(1 − 4k²).
#[derive(Clone, Copy)]
struct Cosine(u32);

impl<F: Real> Emission<F> for Cosine {
    fn emission(&self, x: &Point<F>, _: &F) -> F {
        F::from_f64((f64::from(self.0) * x.angle().to_f64()).cos())
    }
    fn validate(&self, _: usize, _: usize) -> Result<(), CircleError> {
        Ok(())
    }
}

#[test]
fn cosines_are_eigenfunctions() {
    for k in 1..=4 {
        let k_float = f64::from(k);
        let factor = 1.0 / (1.0 - 0.5 / (1.0 - 4.0 * k_float * k_float));
        if k == 1 {
            assert!((factor - 6.0 / 7.0).abs() < 1e-15);
        }
        let exact = [
            factor * (k_float * 0.3).cos(),
            factor * ((k_float * 4.0).sin() - k_float.sin()) / (3.0 * k_float),
            0.0,
        ];
        with_piecewise::<f64, _, _, _>(&[0.5], 200, Cosine(k), DEFAULT, |circle, neighbour, v| {
            check_means(
                circle,
                neighbour,
                v,
                exact,
                20_000,
                &format!("cos {k} theta"),
            );
        });
    }
}

/// Against u = F + T_K v on 10⁵ cells, whose error is that of v, 10⁻⁵, damped twice over.
#[test]
fn piecewise_constant_emission_agrees_with_a_fine_deterministic_solution() {
    const FINE: usize = 100_000;
    let values = [1.0, 0.0, 0.25, 3.0];
    let fine = Arcs::new(values, FINE).unwrap();
    let exact = with_residual::<f64, _, _, 1>(&RHO, FINE, fine, |circle, residual, v| {
        let u = |s: f64| {
            let x = residual.locate(circle.point(s));
            circle.source(&x.point, &mut NoDraws) + residual.reflected(&x)
        };
        let mean = |from, to| MeanOver::new(from, to).unwrap().of(FINE, v);
        [u(0.3), mean(1.0, 4.0), mean(0.0, TAU)]
    });
    // The iterated solution has converged: a fifth of the cells gives the same.
    let coarse = Arcs::new(values, FINE / 5).unwrap();
    with_residual::<f64, _, _, 1>(&RHO, FINE / 5, coarse, |circle, residual, _| {
        let x = residual.locate(circle.point(0.3));
        let u = circle.source(&x.point, &mut NoDraws) + residual.reflected(&x);
        assert!((u - exact[0]).abs() < 1e-9, "{u} {}", exact[0]);
    });
    for cells in [20, 1000] {
        let light = Arcs::new(values, cells).unwrap();
        with_piecewise::<f64, _, _, _>(&RHO, cells, light, DEFAULT, |circle, neighbour, v| {
            check_means(circle, neighbour, v, exact, 50_000, "piecewise constant");
            // Plain walks whose last step leads to the light.
            let lights = LitArcs::new(light, circle.tables()).unwrap();
            let lit = Circle::new(circle.tables(), lights).unwrap();
            let last = LastStep(&lit);
            let start = lit.point(0.3);
            let goal = Goal {
                known: lit.known(&start),
                ..Goal::new(At(start), Some(0.0))
            };
            for options in all_ways(3) {
                let statistics = run(&last, &NoNeighbour::new(&last), &goal, options, 50_000);
                means(&statistics, Some(exact[0]), 0.0).ok().unwrap();
            }
        });
    }
}

/// Results are a promise: whoever changes these numbers marks it value-breaking in the CHANGELOG.
#[test]
fn results_never_change_a_bit() {
    fn bits<F: Real>(options: WalkOptions) -> [u64; 2] {
        with_piecewise::<F, _, _, _>(&RHO, 100, LIGHT, DEFAULT, |circle, neighbour, v| {
            let arc = MeanOver::new(1.0, 4.0).unwrap();
            let goal = Goal::new(arc, Some(arc.of(100, v)));
            let statistics = run(circle, neighbour, &goal, options, 10_000);
            [statistics.plain(), statistics.preconditioned()].map(|e| e.estimate.to_bits())
        })
    }
    let found = [all_ways(1).map(bits::<f64>), all_ways(1).map(bits::<f32>)];
    assert_eq!(found, EXPECTED, "{found:#x?}");
}

/// Plain and preconditioned, of absorption, collision and roulette, in f64 and f32.
const EXPECTED: [[[u64; 2]; 3]; 2] = [
    [
        [0x4014_54f6_3b6e_996b, 0x4013_f8cb_9175_69b1],
        [0x4013_f0b8_4fc0_3203, 0x4013_f799_a2b7_5a5a],
        [0x4013_eb0b_d4db_94a1, 0x4013_f7b4_6212_1094],
    ],
    [
        [0x4014_54f6_36e6_a3b1, 0x4013_f8cb_8ff2_0cb5],
        [0x4013_f0b8_4c34_d6a9, 0x4013_f799_a19f_9a5b],
        [0x4013_eb0b_d267_d568, 0x4013_f7b4_6169_a366],
    ],
];

/// A light that is not a number in a small interval, between two nodes of the quadrature of its means.
#[derive(Clone, Copy)]
struct Hole;

impl<F: Real> Emission<F> for Hole {
    fn emission(&self, x: &Point<F>, _: &F) -> F {
        let s = x.angle().to_f64();
        if (1.977..1.981).contains(&s) {
            F::NAN
        } else {
            F::one()
        }
    }
    fn validate(&self, _: usize, _: usize) -> Result<(), CircleError> {
        Ok(())
    }
}

#[test]
fn a_score_that_is_no_number_names_its_walk() {
    with_piecewise::<f64, _, _, _>(&RHO, 100, Hole, DEFAULT, |circle, neighbour, _| {
        let goals = [Goal::new(At(circle.point(0.3)), Some(1.0))];
        let job = Goals::new(circle, neighbour, &goals, paper(Estimator::Absorption, 1));
        let mut batches = [Batch::new(0, 100_000, 100_000)];
        let NotFinite { walk } = job.run(0, &mut batches, u64::MAX).unwrap_err();
        let end = |walk| job.replay(0, walk).unwrap().termination;
        assert_eq!(end(walk), Termination::NotFinite);
        assert_eq!(batches[0].statistics().walks(), walk);
        assert_eq!(end(walk - 1), Termination::Absorbed);
    });
}

#[test]
fn walks_that_are_cut_off_are_counted() {
    with_piecewise::<f64, _, _, _>(&RHO, 100, LIGHT, DEFAULT, |circle, neighbour, _| {
        let goal = Goal::new(At(circle.point(0.3)), Some(1.0));
        let options = WalkOptions {
            step_limit: 3,
            ..paper(Estimator::Collision, 1)
        };
        let endings = run(circle, neighbour, &goal, options, 10_000).terminations();
        assert_eq!(endings.absorbed + endings.step_limit, 10_000);
        // 0.8³ = 0.512 go on after three states; four standard deviations are 200.
        assert!(endings.step_limit.abs_diff(5120) < 200, "{endings:?}");
    });
}
