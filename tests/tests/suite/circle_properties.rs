//! Whatever a circle's constructors accept, walks on it end with finite scores and no panic; what
//! they refuse, they refuse by an error.

use fredholm_circle::{Circle, CircleError, Harmonic, OwnedTables, Residual};
use fredholm_core::galerkin::{GalerkinError, Piecewise};
use fredholm_core::{Absorption, At, Goal, NeighbourOf, Real, Statistics, WalkOptions};
use fredholm_tests::circle::{DEFAULT, Owned};
use fredholm_tests::{all_ways, run};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// The masses of cells have eight rounding errors at most: nearer to 1, the system of one cell may be singular.
const NEAREST_TO_ONE: f64 = 1.0 - 16.0 * f64::EPSILON;

/// A scene, valid or not.
#[derive(Clone, Debug)]
struct Scene {
    reflectance: Vec<f64>,
    cells: usize,
    light: Harmonic,
    angle: f64,
}

fn scenes() -> impl Strategy<Value = Scene> {
    let reflectance = prop_oneof![
        20 => 0.0..1.0,
        1 => Just(0.0),
        1 => Just(NEAREST_TO_ONE),
        1 => prop_oneof![Just(f64::NAN), Just(1.0), Just(-0.1), Just(f64::INFINITY)],
    ];
    let light = (-1e3..1e3_f64, -1e3..1e3_f64, 0..2000_u32);
    (
        prop::collection::vec(reflectance, 0..5),
        0..60_usize,
        light,
        0.0..core::f64::consts::TAU,
    )
        .prop_map(|(reflectance, cells, light, angle)| Scene {
            // Most are multiples of the arcs.
            cells: if cells > 50 {
                cells
            } else {
                cells * reflectance.len()
            },
            reflectance,
            light: Harmonic {
                constant: light.0,
                amplitude: light.1,
                frequency: light.2,
            },
            angle,
        })
}

fn solve<F: Real>(scene: &Scene, options: WalkOptions) -> Result<[Statistics; 2], CircleError> {
    let tables = OwnedTables::<f64>::new(&scene.reflectance, scene.cells)?;
    let circle = Circle::new(tables, scene.light)?;
    let system = circle.system::<1>();
    let solution = system.solve(1e-14, 50).expect("reflectances are below 1");
    let (v, g) = (
        solution.rounded::<F>().expect("memory"),
        solution.source(&system, &DEFAULT).expect("its cells"),
    );
    let moments = system.residual_moments(&solution).expect("its cells");

    let tables = OwnedTables::<F>::new(&scene.reflectance, scene.cells)?;
    let circle = Circle::new(tables, scene.light)?;
    let system = circle.system::<1>();
    let piecewise: Piecewise<'_, _, _, _, _, _, 1> =
        Piecewise::with_pointwise(&circle, &system, DEFAULT, &v, &g).expect("its cells");
    let residual = Residual::<_, 1>::new(circle.tables(), &v, &moments).expect("its cells");
    Ok([
        walks(&circle, &piecewise, scene.angle, options),
        walks(&circle, &residual, scene.angle, options),
    ])
}

fn walks<F: Real, N: NeighbourOf<Owned<F, Harmonic>> + Sync>(
    circle: &Owned<F, Harmonic>,
    neighbour: &N,
    angle: f64,
    options: WalkOptions,
) -> Statistics {
    let goal = Goal::new(At(circle.point(angle)), None);
    run(circle, neighbour, &goal, options, 50)
}

fn acceptable(scene: &Scene) -> bool {
    let arcs = scene.reflectance.len();
    arcs > 0
        && scene.reflectance.iter().all(|r| (0.0..1.0).contains(r))
        && scene.cells > 0
        && scene.cells.is_multiple_of(arcs)
        && scene.light.frequency > 0
}

/// One cell that sends itself all but a rounding error: its pivot is 0.
#[test]
fn a_system_that_rounding_makes_singular_is_refused() {
    for constant in [0.0, 1.0] {
        let tables = OwnedTables::<f64>::new(&[1.0 - f64::EPSILON], 1).expect("a cell");
        let light = Harmonic {
            constant,
            amplitude: constant,
            frequency: 1,
        };
        let circle = Circle::new(tables, light).expect("a circle");
        let solved = circle.system::<1>().solve(1e-14, 50);
        assert!(
            matches!(solved, Err(GalerkinError::Diverges { .. })),
            "{solved:?}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 300,
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..Default::default()
    })]

    #[test]
    fn accepted_scenes_are_solved_and_others_refused(scene in scenes()) {
        for options in all_ways(1) {
            // Where a wall reflects nearly all, a walk by roulette hardly ends.
            let is_roulette = options.absorption == Absorption::Roulette;
            let step_limit = if is_roulette { 1000 } else { options.step_limit };
            let options = WalkOptions { step_limit, ..options };
            for solved in [solve::<f64>(&scene, options), solve::<f32>(&scene, options)] {
                prop_assert_eq!(solved.is_ok(), acceptable(&scene));
                for statistics in solved.into_iter().flatten() {
                    let ends = statistics.terminations();
                    let cut_off = if is_roulette { ends.step_limit } else { 0 };
                    prop_assert_eq!(ends.absorbed + cut_off, 50);
                }
            }
        }
    }
}
