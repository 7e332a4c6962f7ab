//! Rooms against theory: density, masses, sampler, neighbour equation, known solutions.

use fredholm_core::{
    At, DefaultGenerator, Estimator, Functional, Neighbour, Real, STEP_LIMIT, Statistics, Stream,
    Task, rounding_floor,
};
use fredholm_room::{
    Choice, Grading, Irradiance, Material, MeanOver, R_MIN, Room, RoomPairs, View,
};
use fredholm_tests::check::{
    Failure, cells_are_found, density_integrates, masses_do_not_collapse, means,
    moments_are_of_the_density, neighbour_equation, run, sampler_follows,
};
use fredholm_tests::room::{
    Drawing, RoomNeighbour, Setup, block, doorway, polygon, scenes, square,
};

const CHOICES: [Choice; 3] = [Choice::Paper, Choice::Default, Choice::Pointwise];

/// The most standard errors that a mean of this file may be off: it makes about 1,000 comparisons, and
/// if all is well one of them is beyond 4.9 with probability 0.001.
const STANDARD_ERRORS: f64 = 4.9;

/// Units of ε that the checks allow. Near a corner a distance of 10⁻³ and less is known to ε only, and
/// masses are measured by their own size: there up to 5,000 are found. A wrong equation is off by 10⁶ and more.
const ROUNDING: f64 = 16_384.0;

fn assert_ok(drawing: &Drawing, what: &str, result: Result<(), Failure>) {
    if let Err(e) = result {
        panic!("{}, {what}: {e}", drawing.name);
    }
}

fn has_shadows<F: Real>(room: &Room<'_, F>) -> bool {
    let cells = room.table().len();
    let mut pairs = (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j)));
    pairs.any(|(i, j)| room.views().view(i, j) == View::Partly)
}

#[test]
fn the_kit_finds_nothing() {
    fn at<F: Real>(cells: usize) {
        for drawing in scenes() {
            let setup = Setup::new::<F>(&drawing, cells, Grading::default()).unwrap();
            setup.with::<F, _>(Choice::Default, |room, _, _, _| {
                let fractions = [0.03, 0.4, 0.97];
                let check = |what, result| assert_ok(&drawing, what, result);
                check("cells", cells_are_found(room, &[1e-3, 0.4, 0.999]));
                check("density", density_integrates(room, &fractions, ROUNDING));
                // In f32 the nodes of a rule fall on either side of a shadow's edge by chance, and
                // a mass behind it is as small as that.
                if F::EPSILON.to_f64() < 1e-10 || !has_shadows(room) {
                    let moments = moments_are_of_the_density::<_, 1>(room, &fractions, ROUNDING);
                    check("moments", moments);
                }
                check("sampler", sampler_follows(room, 100_000, 1, 4.5));
                let pairs = RoomPairs {
                    views: room.views(),
                    choice: Choice::Default,
                };
                // Its mean is one over seven points.
                check(
                    "collapse",
                    masses_do_not_collapse(room, &pairs, 0.9 * R_MIN),
                );
            });
        }
    }
    at::<f64>(24);
    at::<f64>(60);
    at::<f32>(24);
}

#[test]
fn the_neighbour_equation_holds_pointwise() {
    fn at<F: Real>(cells: usize) {
        for drawing in scenes() {
            let setup = Setup::new::<F>(&drawing, cells, Grading::default()).unwrap();
            for choice in CHOICES {
                setup.with::<F, _>(choice, |room, neighbour, _, _| {
                    let result = neighbour_equation(room, neighbour, &[0.03, 0.4, 0.97], ROUNDING);
                    assert_ok(&drawing, &format!("{choice:?}"), result);
                });
            }
        }
    }
    at::<f64>(24);
    at::<f64>(60);
    at::<f32>(24);
}

fn task<'a, F: Real, T>(
    (room, neighbour): (&'a Room<'a, F>, &'a RoomNeighbour<'a, F>),
    functional: &'a T,
    neighbour_value: Option<f64>,
    estimator: Estimator,
    stream: Stream,
) -> Task<'a, Room<'a, F>, RoomNeighbour<'a, F>, T, DefaultGenerator> {
    Task {
        equation: room,
        neighbour,
        functional,
        neighbour_value,
        estimator,
        stream,
        step_limit: STEP_LIMIT,
    }
}

/// The mean over all walls, and the value at a point: plain, preconditioned and control.
fn run_means<F: Real>(
    setup: &Setup,
    choice: Choice,
    estimator: Estimator,
    seed: u64,
    walks: u64,
) -> [Statistics; 2] {
    setup.with::<F, _>(choice, |room, neighbour, v, lengths| {
        let equation = (room, neighbour);
        let mean = MeanOver::new(room, lengths, 0..lengths.len() - 1).unwrap();
        let value = Some(mean.of(v));
        let all = run(
            &task(equation, &mean, value, estimator, Stream::new(seed, 0)),
            walks,
        );
        let start = At(room.point(0, 0.37).unwrap());
        let value = Some(neighbour.value(&neighbour.locate(start.0)).to_f64());
        let point = run(
            &task(equation, &start, value, estimator, Stream::new(seed, 1)),
            walks,
        );
        [all, point]
    })
}

/// F = 1 − ρ with another ρ on every surface: u = 1, whatever is in the way.
fn glowing(drawing: &Drawing) -> Drawing {
    drawing.clone().with(|s| {
        let reflectance = 0.15 + 0.7 * ((s as f64 * 0.618).fract());
        Material {
            reflectance,
            emission: 1.0 - reflectance,
        }
    })
}

#[test]
fn in_a_furnace_all_is_one() {
    fn at<F: Real>(walks: u64) {
        for drawing in scenes() {
            let drawing = glowing(&drawing);
            let setup = Setup::new::<F>(&drawing, 100, Grading::default()).unwrap();
            let floor = rounding_floor::<F>(1.0, 1.0, 0.85);
            for choice in CHOICES {
                for estimator in [Estimator::Absorption, Estimator::Collision] {
                    for statistics in run_means::<F>(&setup, choice, estimator, 1, walks) {
                        let what = format!("{choice:?}, {estimator:?}, eps {:e}", F::EPSILON);
                        let result = means(&statistics, 1.0, STANDARD_ERRORS, floor);
                        assert_ok(&drawing, &what, result);
                        assert_eq!(statistics.endings().left, 0);
                    }
                }
            }
        }
    }
    at::<f64>(10_000);
    at::<f32>(10_000);
}
