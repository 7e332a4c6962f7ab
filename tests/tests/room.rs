//! Rooms against theory: density, masses, sampler, neighbour equation, known solutions.

use fredholm_core::{
    At, DefaultGenerator, Draws, Estimator, Functional, Neighbour, Real, STEP_LIMIT, Sampler,
    Stream, Task, rounding_floor,
};
use fredholm_room::{Choice, Grading, MeanOver, Tables};
use fredholm_tests::check::{
    Failure, cells_are_found, density_integrates, masses_do_not_collapse, means,
    moments_are_of_the_density, neighbour_equation, run, sampler_follows,
};
use fredholm_tests::room::{Drawing, Setup, scenes, square};

const CHOICES: [Choice; 3] = [Choice::Paper, Choice::Default, Choice::Pointwise];

fn graded() -> Grading {
    Grading::default()
}

#[test]
fn the_kit_finds_nothing() {
    for drawing in scenes() {
        let setup = Setup::new::<f64>(&drawing, 24, graded()).unwrap();
        let name = drawing.name;
        let check = |result: Result<(), Failure>, what: &str| {
            if let Err(e) = result {
                println!("{name}, {what}: {e}")
            };
        };
        setup.with::<f64, _>(Choice::Default, |room, neighbour, _, _| {
            let fractions = [0.03, 0.4, 0.97];
            check(cells_are_found(room, &[1e-9, 0.4, 1.0 - 1e-9]), "cells");
            check(density_integrates(room, &fractions, 1e4), "density");
            check(
                moments_are_of_the_density::<_, 1>(room, &fractions, 1e4),
                "moments",
            );
            check(sampler_follows(room, 100_000, 1, 4.0), "sampler");
            check(
                neighbour_equation(room, neighbour, &fractions, 1e4),
                "neighbour",
            );
        });
    }
}
