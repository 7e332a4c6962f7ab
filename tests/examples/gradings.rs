//! √Var of walks with rays in random rooms for some gradings of their cells: a line for every room, number of unknowns and degree,
//! and what each grading leaves in the geometric mean over all rooms, relative to the first, and in the worst of them, relative to the
//! least that any of the gradings leaves there.
//!
//! `cargo run --release -p fredholm-tests --example gradings -- FROM TO UNKNOWNS DEGREES GRADINGS`: seeds of rooms from FROM to
//! TO − 1, the rest one or more numbers with commas, as in `200 224 100,1000 0,1,2,4 3,2,1`. With a word more, `whole` or `largest`, it
//! compares standard errors of whole functions from pointwise pairs: their root mean square over some 250 points, or the largest.

use fredholm::room::Surfaces;
use fredholm::{Model, RoomModel, Scalar, Settings, Solver};
use fredholm_core::{Batch, Goal, Goals, Job, WalkOptions};
use fredholm_room::{
    CoarseSolution, Grading, MeanOver, Mesh, RaySetup, RoomError, Scene, Shadows, Tables,
    VisibilityTable,
};
use fredholm_tests::room::{Drawing, random};

/// Walks of which √Var is taken.
const WALKS: u64 = 30_000;
/// Walks of a whole function, and points.
const WALKS_OF_WHOLE: u64 = 1 << 13;
const POINTS: f64 = 250.0;
/// The most unknowns of the solution from which v follows.
const COARSE: usize = 1000;

/// √Var of the mean over all walls.
fn deviation<const B: usize>(
    scene: &Scene,
    coarse: &CoarseSolution,
    unknowns: usize,
    exponent: f64,
) -> Result<f64, RoomError> {
    let grading = Grading {
        exponent,
        ..Grading::of_degree(B - 1)
    };
    let mesh = Mesh::new::<f64>(scene, unknowns / B, grading)?;
    let tables = Tables::<f64>::new(scene, &mesh);
    let room = tables.room(VisibilityTable::none());
    let mut v = vec![0.0; mesh.len() * B];
    for (cell, own) in v.chunks_exact_mut(B).enumerate() {
        coarse.step::<_, B>(&room, cell, own);
    }
    let shadows = Shadows::new(scene);
    let setup = RaySetup::<_, B>::new(&room, &v)?.with_shadows(&shadows);
    let rays = setup.tables()?;
    let neighbour = rays.neighbour::<_, B>(&room, &v)?;
    let mean = MeanOver::everything(&room);
    let value = mean.of(&v);
    let goals = [Goal::new(mean, Some(value))];
    let job = Goals::new(&room, &neighbour, &goals, WalkOptions::default());
    let mut batch = Batch::new(0, WALKS, WALKS);
    let walked = job.run(0, core::slice::from_mut(&mut batch), u64::MAX);
    let std_dev = batch.statistics().preconditioned().std_dev;
    Ok(walked.ok().and(std_dev).unwrap_or(f64::NAN))
}

/// The standard error of the whole function: the root mean square over points, or the largest.
fn error_of_whole(
    drawing: &Drawing,
    [degree, unknowns]: [usize; 2],
    exponent: f64,
    is_largest: bool,
) -> f64 {
    let mut surfaces = Surfaces::default();
    for (points, materials) in &drawing.surfaces {
        surfaces = surfaces.with("", points, materials[0]);
    }
    let room = RoomModel::new(surfaces, Scalar::F64).expect("a room");
    let settings = Settings {
        cells: Some(unknowns / (degree + 1)),
        degree: Some(degree),
        grading: Some(exponent),
        walks: Some(WALKS_OF_WHOLE),
        ..Settings::default()
    };
    let whole = Solver::with(&room, settings, Vec::new()).whole();
    let whole = whole.expect("a whole function");
    if is_largest {
        return whole.summary().largest_std_error.unwrap_or(f64::NAN);
    }
    let values = whole.values(&room.spread(POINTS)).expect("values");
    let errors = values.iter().filter_map(|value| value.std_error);
    let (sum, count) = errors.fold((0.0, 0.0), |(sum, count), error| {
        (sum + error * error, count + 1.0)
    });
    f64::sqrt(sum / count)
}

fn numbers<T: core::str::FromStr>(text: &str) -> Vec<T> {
    let number = |text: &str| text.parse().ok().expect("numbers with commas");
    text.split(',').map(number).collect()
}

fn main() -> Result<(), RoomError> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [from, to, unknowns, degrees, gradings, of @ ..] = arguments.as_slice() else {
        panic!("give seeds from and to, numbers of unknowns, degrees and gradings");
    };
    let gradings: Vec<f64> = numbers(gradings);
    let seeds = numbers::<u64>(from)[0]..numbers::<u64>(to)[0];
    for degree in numbers::<usize>(degrees) {
        for unknowns in numbers::<usize>(unknowns) {
            let mut sums = vec![0.0; gradings.len()];
            let mut worst = vec![0.0_f64; gradings.len()];
            for seed in seeds.clone() {
                let scene = random(seed).scene::<f64>()?;
                let coarse = CoarseSolution::new(&scene, unknowns.min(COARSE))?;
                let of = |&exponent: &f64| match degree {
                    _ if !of.is_empty() => Ok(error_of_whole(
                        &random(seed),
                        [degree, unknowns],
                        exponent,
                        of[0] == "largest",
                    )),
                    0 => deviation::<1>(&scene, &coarse, unknowns, exponent),
                    1 => deviation::<2>(&scene, &coarse, unknowns, exponent),
                    2 => deviation::<3>(&scene, &coarse, unknowns, exponent),
                    3 => deviation::<4>(&scene, &coarse, unknowns, exponent),
                    _ => deviation::<5>(&scene, &coarse, unknowns, exponent),
                };
                let left: Vec<f64> = gradings.iter().map(of).collect::<Result<_, _>>()?;
                print!("room {seed}, degree {degree}, {unknowns} unknowns:");
                for (&left, sum) in left.iter().zip(&mut sums) {
                    print!(" {left:.2e}");
                    *sum += left.ln();
                }
                println!();
                let least = left.iter().copied().fold(f64::INFINITY, f64::min);
                for (&left, worst) in left.iter().zip(&mut worst) {
                    *worst = worst.max(left / least);
                }
            }
            let rooms = seeds.clone().count() as f64;
            print!("degree {degree}, {unknowns} unknowns, mean and worst:");
            for ((g, sum), worst) in gradings.iter().zip(&sums).zip(worst) {
                let mean = ((sum - sums[0]) / rooms).exp();
                print!(" g = {g}: {mean:.2}, {worst:.1};");
            }
            println!();
        }
    }
    Ok(())
}
