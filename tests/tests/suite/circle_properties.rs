//! Whatever a circle's constructors accept, walks on it end with finite scores and no panic; what
//! they refuse, they refuse by an error.

use fredholm_circle::{Circle, CircleError, Harmonic, Residual, Tables, residual_moments};
use fredholm_core::galerkin::{DiagonalRule, PairKind, Piecewise};
use fredholm_core::{
    At, Batch, Estimator, Form, Length, Neighbour, Real, Statistics, Task, WalkSeeds,
};
use proptest::prelude::*;

/// A scene, valid or not.
#[derive(Clone, Debug)]
struct Scene {
    reflectance: Vec<f64>,
    cells: usize,
    absorption: f64,
    light: Harmonic,
    angle: f64,
}

fn scenes() -> impl Strategy<Value = Scene> {
    let reflectance = prop_oneof![
        20 => 0.0..1.0,
        1 => Just(0.0),
        1 => Just(1.0 - f64::EPSILON),
        1 => prop_oneof![Just(f64::NAN), Just(1.0), Just(-0.1), Just(f64::INFINITY)],
    ];
    let light = (-1e3..1e3_f64, -1e3..1e3_f64, 0..2000_u32);
    (
        prop::collection::vec(reflectance, 0..5),
        0..60_usize,
        prop_oneof![20 => 0.01..0.999, 1 => prop_oneof![Just(0.0), Just(1.0), Just(f64::NAN)]],
        light,
        0.0..core::f64::consts::TAU,
    )
        .prop_map(|(reflectance, cells, absorption, light, angle)| Scene {
            // Most are multiples of the arcs.
            cells: if cells > 50 {
                cells
            } else {
                cells * reflectance.len()
            },
            reflectance,
            absorption,
            light: Harmonic {
                constant: light.0,
                amplitude: light.1,
                frequency: light.2,
            },
            angle,
        })
}

fn solve<F: Real>(scene: &Scene, estimator: Estimator) -> Result<[Statistics; 2], CircleError> {
    let tables = Tables::<f64>::new(&scene.reflectance, scene.cells)?;
    let circle = Circle::new(tables.cells(), scene.light, scene.absorption)?;
    let pairs = DiagonalRule {
        diagonal: PairKind::Pointwise,
    };
    let solution = circle.solve(1e-14, 50).expect("reflectances are below 1");
    let (v, g) = (
        solution.rounded::<F>().expect("memory"),
        solution.source(&circle, &pairs).expect("its cells"),
    );
    let moments = residual_moments(&circle, &solution).expect("its cells");

    let tables = Tables::<F>::new(&scene.reflectance, scene.cells)?;
    let circle = Circle::new(tables.cells(), scene.light, scene.absorption)?;
    let piecewise = Piecewise::with_pointwise(&circle, &circle, pairs, &v, &g).expect("its cells");
    let residual = Residual::new(&circle, &v, &moments)?;
    Ok([
        walks(&circle, &piecewise, scene.angle, estimator),
        walks(&circle, &residual, scene.angle, estimator),
    ])
}

fn walks<F: Real, N>(
    circle: &Circle<'_, F, Harmonic>,
    neighbour: &N,
    angle: f64,
    estimator: Estimator,
) -> Statistics
where
    N: Neighbour<Scalar = F, Point = fredholm_circle::Point<F>>,
{
    let task = Task {
        equation: circle,
        neighbour,
        functional: &At(circle.point(angle)),
        control_mean: None,
        estimator,
        form: Form::Product,
        seeds: <WalkSeeds>::new(1, 0),
        length: Length::default(),
    };
    let mut batch = Batch::new(0, 50, 50);
    batch.run(&task, u64::MAX).expect("finite scores");
    *batch.statistics()
}

fn acceptable(scene: &Scene) -> bool {
    let arcs = scene.reflectance.len();
    arcs > 0
        && scene.reflectance.iter().all(|r| (0.0..1.0).contains(r))
        && scene.cells > 0
        && scene.cells.is_multiple_of(arcs)
        && scene.absorption > 0.0
        && scene.absorption < 1.0
        && scene.light.frequency > 0
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..Default::default() })]

    #[test]
    fn accepted_scenes_are_solved_and_others_refused(scene in scenes()) {
        for estimator in [Estimator::Absorption, Estimator::Collision] {
            for solved in [solve::<f64>(&scene, estimator), solve::<f32>(&scene, estimator)] {
                prop_assert_eq!(solved.is_ok(), acceptable(&scene));
                for statistics in solved.into_iter().flatten() {
                    prop_assert_eq!(statistics.terminations().absorbed, 50);
                }
            }
        }
    }
}
