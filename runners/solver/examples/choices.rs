//! Prints what the automatic choice takes for an error, and what it takes without a lift, a Sobol' sequence and one set of
//! walks for all targets: seconds of one thread.
//!
//! ```text
//! RAYON_NUM_THREADS=1 cargo run --profile dist -p fredholm --features measure --example choices
//! RAYON_NUM_THREADS=1 cargo run --profile dist -p fredholm --features measure --example choices -- room
//! ```
//!
//! With a word: of equations whose names have it.

mod common;

use std::time::Instant;

use common::{arcs, boxed, doorway, gauss, kinks, square};
use fredholm::{Model, Region, Report, RoomModel, Scalar, Sequence, Solver};

/// Seconds of rounds that a row takes at least.
const ENOUGH: f64 = 2.0;
/// Rounds of a row at least.
const ROUNDS: usize = 3;

/// The seconds that some work takes.
fn time<R>(work: impl FnOnce() -> R) -> (f64, R) {
    let start = Instant::now();
    let result = work();
    (start.elapsed().as_secs_f64(), result)
}

/// What a run used of a lift, a sequence and one set of walks.
fn used(report: &Report) -> String {
    let mut words = Vec::new();
    if report.chain.is_some_and(|chain| chain.lift.is_some()) {
        words.push("lift");
    }
    if report.chain.is_some_and(|chain| chain.sequence.is_some()) {
        words.push("sequence");
    }
    if report.whole.is_some() {
        words.push("whole");
    }
    match words.as_slice() {
        [] => "-".to_owned(),
        words => words.join(", "),
    }
}

/// A word for the targets, and the targets.
type Targets = (&'static str, Vec<Region>);

fn rows(name: &str, model: &dyn Model, errors: [f64; 3]) {
    let wanted = std::env::args().nth(1);
    if wanted.is_some_and(|word| !name.contains(&word)) {
        return;
    }
    let spread = model.spread(100.0);
    let all: [Targets; 3] = [
        ("point", vec![spread[spread.len() / 3].clone()]),
        ("mean", vec![model.whole()]),
        ("100 points", spread),
    ];
    for (what, regions) in &all {
        let named = regions.iter().enumerate();
        let solver = named.fold(Solver::new(model), |solver, (i, region)| {
            solver.goal(&format!("u{i}"), region.clone())
        });
        for error in errors {
            let without = solver.clone().together(false).sequence(Sequence::Random);
            let without = match model.about().most_lift {
                0 => without,
                _ => without.lift(0),
            };
            let [mut took, mut plainly] = [f64::INFINITY; 2];
            let mut used = String::new();
            // Both by turns, and of each the least time: other programs only make it longer.
            let (mut spent, mut rounds) = (0.0, 0);
            while spent < ENOUGH || rounds < ROUNDS {
                rounds += 1;
                let (one, chosen) = time(|| solver.clone().solve_to(error));
                let (other, result) = time(|| without.clone().solve_to(error));
                took = took.min(one);
                plainly = plainly.min(other);
                spent += one + other;
                used = chosen.as_ref().map_or_else(ToString::to_string, self::used);
                if let Err(refusal) = result {
                    used += &format!(" | {refusal}");
                }
            }
            let ratio = took / plainly;
            println!(
                "{name:<18} {what:<10} {error:>6.0e} | {took:>8.4} {plainly:>8.4} {ratio:>6.2} | {used}"
            );
        }
    }
}

fn main() {
    println!(
        "seconds as chosen, and without a lift, a sequence and one set of walks; their ratio; what was chosen"
    );
    let smooth = [1e-4, 1e-6, 1e-8];
    rows("d = 1", &gauss::<1>(), smooth);
    rows("d = 2", &gauss::<2>(), smooth);
    rows("d = 3", &gauss::<3>(), [1e-3, 1e-4, 1e-5]);
    rows("d = 1, kink", &kinks::<1>(), smooth);
    rows("d = 2, kink", &kinks::<2>(), [1e-3, 1e-4, 1e-5]);
    rows("d = 3, kink", &kinks::<3>(), [1e-2, 1e-3, 1e-4]);
    rows("circle", &arcs(), [1e-3, 1e-5, 1e-7]);
    for (name, surfaces) in [
        ("square room", square()),
        ("doorway room", doorway()),
        ("room with a box", boxed()),
    ] {
        let room = RoomModel::new(surfaces, Scalar::F64).expect("a room");
        rows(name, &room, [1e-3, 1e-4, 1e-5]);
    }
}
