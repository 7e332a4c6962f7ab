//! Prints standard errors and processor seconds of one thread with and without a Sobol' sequence and a lift, on Linux.
//!
//! ```text
//! RAYON_NUM_THREADS=1 cargo run --profile dist -p fredholm --features measure --example draws
//! ```

mod common;

use common::{gauss, kinks, root_mean_square, seconds};
use fredholm::circle::{Emission, Harmonic};
use fredholm::{CircleModel, CubeModel, Model, Region, Sequence, Solver};

/// Walks of each target, and of a global estimate.
const WALKS: u64 = 1 << 16;
/// States in which walks go on in any case, with a sequence.
const FORCED_STEPS: u32 = 4;

/// Standard error and seconds, those of the set-up counted.
fn timed(work: impl FnOnce() -> Option<f64>) -> [f64; 2] {
    let start = seconds();
    let error = work().unwrap_or(f64::NAN);
    [error, seconds() - start]
}

/// These walks with a sequence.
fn drawn<'m>(solver: &Solver<'m>) -> Solver<'m> {
    let solver = solver.clone().sequence(Sequence::Sobol);
    solver.forced_steps(FORCED_STEPS)
}

fn rows(name: &str, model: &dyn Model, point: Region, cells: usize, degree: usize) {
    let plain = Solver::new(model).cells(cells).degree(degree).walks(WALKS);
    let lifted = plain.clone().lift(model.about().most_lift);
    let all = [
        ("as it is", plain.clone()),
        ("sequence", drawn(&plain)),
        ("lift", lifted.clone()),
        ("both", drawn(&lifted)),
    ];
    for (what, solver) in all {
        let of = |region: Region| {
            let solver = solver.clone().goal("u", region);
            timed(|| solver.solve().ok()?.goals[0].preconditioned.std_error)
        };
        let [at, mean] = [point.clone(), model.whole()].map(of);
        let whole = timed(|| {
            let whole = solver.whole().ok()?;
            let values = whole.values(&model.spread(100.0)).ok()?;
            let errors = values.iter().filter_map(|value| value.std_error);
            Some(root_mean_square(errors))
        });
        print!("{name:<28} {what:<9}");
        for [error, took] in [at, mean, whole] {
            print!(" | {error:>8.1e} {took:>6.2}");
        }
        println!();
    }
}

fn main() {
    println!(
        "{WALKS} walks; standard error and seconds of a point, the mean, and the global estimate (root mean square)"
    );
    let at = |x: f64, d: usize| Region::Point(vec![x; d]);
    let cube = |name: &str, model: &CubeModel, d: usize, cells: usize| {
        rows(name, model, at(0.3, d), cells, 2);
    };
    cube("d = 1, 6 cells", &gauss::<1>(), 1, 6);
    cube("d = 1, kink, 12 cells", &kinks::<1>(), 1, 12);
    cube("d = 2, 6 x 6 cells", &gauss::<2>(), 2, 6);
    cube("d = 2, kink, 6 x 6 cells", &kinks::<2>(), 2, 6);
    cube("d = 3, 2 x 2 x 2 cells", &gauss::<3>(), 3, 2);
    let light = Harmonic {
        constant: 5.0,
        amplitude: 1.0,
        frequency: 5,
    };
    let circle = CircleModel::new(vec![0.3, 0.7], Emission::Harmonic(light));
    rows(
        "circle, 100 cells",
        &circle,
        Region::Point(vec![1.0]),
        100,
        2,
    );
}
