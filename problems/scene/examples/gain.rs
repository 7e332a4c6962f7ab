//! What the neighbour equation from rays gains on scenes, beside the best plain walks: standard deviations, microseconds a
//! walk, and √(variance × time), of the mean over all surfaces and of twenty points.
//!
//! `cargo run --release -p fredholm-scene --features alloc --example gain -- cube|box CELLS RAYS`

use core::num::NonZeroU32;
use std::time::Instant;

use fredholm_core::galerkin::CellMap;
use fredholm_core::sampled::{SampledSolution, ScoreVariance, SetupOptions};
use fredholm_core::{
    At, Batch, DefaultGenerator, Equation, Estimate, Estimator, Form, Functional, LastStep, Length,
    NeighbourOf, NoNeighbour, RngUniforms, Statistics, Task, WalkSeeds,
};
use fredholm_scene::{
    Cells, Enclosure, Material, Mean, Point, Radiosity, Scene, Surface, Tables, areas, shapes,
};

type Failed = Box<dyn core::error::Error>;
type Equations<'a> = Radiosity<'a, f64>;

/// What the rest of a walk takes, in rays of its scores.
const REST: f64 = 3.0;
/// The absorption probability.
const ABSORPTION: f64 = 0.25;
/// Points at which standard deviations are taken; walks from each, and walks of a mean.
const POINTS: u64 = 20;
const POINT_WALKS: u64 = 4000;
const MEAN_WALKS: u64 = 200_000;

/// A unit cube whose ceiling emits, or one with two hovering blocks and a small lamp that looks down.
fn scene(name: &str) -> Result<Scene, Failed> {
    let room = shapes::room([0.0; 3], [1.0; 3]);
    let (shape, lamp) = match name {
        "cube" => (room, 1),
        "box" => {
            let blocks = shapes::block([0.15, 0.15, 0.02], [0.45, 0.45, 0.6])
                .and(shapes::block([0.55, 0.5, 0.02], [0.85, 0.8, 0.3]));
            let lamp = shapes::block([0.4, 0.4, 0.97], [0.6, 0.6, 0.99]);
            (room.and(lamp).and(blocks), 6)
        }
        _ => return Err("the scenes are cube and box".into()),
    };
    let material = |surface| {
        let (reflectance, emission) = if surface == lamp {
            (0.5, 20.0)
        } else {
            (0.6, 0.0)
        };
        [Material {
            reflectance,
            emission,
        }]
    };
    let materials: Vec<[Material; 1]> = (0..shape.surfaces.len()).map(material).collect();
    let surfaces: Vec<Surface<'_>> = shape
        .surfaces
        .iter()
        .zip(&materials)
        .map(|(polygons, materials)| Surface {
            polygons,
            materials,
        })
        .collect();
    Ok(Scene::new::<f64>(&surfaces, Enclosure::Closed)?)
}

/// Seconds that this thread has computed, where Linux tells it, so that other programs do not count.
fn processor_seconds() -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|told| told.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(
        || {
            static START: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);
            START.elapsed().as_secs_f64()
        },
        |nanoseconds| 1e-9 * nanoseconds,
    )
}

/// Statistics of walks, and seconds a walk.
fn walk<E, N, T>(
    (equation, neighbour): (&E, &N),
    functional: &T,
    estimator: Estimator,
    (walks, control_mean): (u64, Option<f64>),
) -> Result<(Statistics, f64), Failed>
where
    E: Equation<Scalar = f64>,
    N: NeighbourOf<E>,
    T: Functional<E>,
{
    let task = Task {
        equation,
        neighbour,
        functional,
        control_mean,
        estimator,
        form: Form::Product,
        seeds: WalkSeeds::<DefaultGenerator>::new(1, 0),
        length: Length::default(),
    };
    let mut batch = Batch::new(0, walks, walks);
    let start = processor_seconds();
    batch.run(&task, u64::MAX)?;
    let seconds = (processor_seconds() - start) / walks as f64;
    Ok((*batch.statistics(), seconds))
}

/// The root mean square of the standard deviations at all points, and seconds a walk.
fn at_points<E, N>(
    of: (&E, &N),
    points: &[Point<f64>],
    choose: fn(&Statistics) -> Estimate,
) -> Result<[f64; 2], Failed>
where
    E: Equation<Scalar = f64, Point = Point<f64>>,
    N: NeighbourOf<E>,
{
    let (mut square, mut seconds) = (0.0, 0.0);
    for &x in points {
        let scores = (POINT_WALKS, None);
        let (statistics, time) = walk(of, &At(x), Estimator::Collision, scores)?;
        square += choose(&statistics).std_dev.unwrap_or(0.0).powi(2) / points.len() as f64;
        seconds += time / points.len() as f64;
    }
    Ok([square.sqrt(), seconds])
}

fn line(name: &str, [deviation, seconds]: [f64; 2], [best, best_seconds]: [f64; 2]) {
    let time = |seconds: f64| (1e6 * seconds).sqrt();
    println!(
        "{name:32} {deviation:.5} {:8.2} µs  {:6.1} less deviation, {:5.1} less error at equal time",
        1e6 * seconds,
        best / deviation,
        best * time(best_seconds) / (deviation * time(seconds)),
    );
}

/// Lines for the neighbour equations of B functions on a cell.
fn degree<const B: usize>(
    room: &Equations<'_>,
    [samples, events]: [usize; 2],
    mean: &Mean<'_, f64>,
    points: &[Point<f64>],
    [best_mean, best_points]: [[f64; 2]; 2],
) -> Result<(), Failed> {
    let last = LastStep(room);
    let options = SetupOptions {
        samples,
        events,
        ..SetupOptions::default()
    };
    let start = Instant::now();
    let solution = SampledSolution::with_events::<_, _, _, 2, B>((room, room), &last, &options)?;
    println!(
        "{B} functions on a cell, {events} events, set-up {:.2} s",
        start.elapsed().as_secs_f64()
    );
    let (mut sum, mut area) = (0.0, 0.0);
    for (cell, v) in solution.v().iter().step_by(B).enumerate() {
        sum += room.measure(cell) * v;
        area += room.measure(cell);
    }
    let tables = solution.for_walks::<f64>()?;
    let four = NonZeroU32::MIN.saturating_add(3);
    let neighbour = tables.neighbour_with_events::<_, _, 2, B>((room, room), four)?;
    let score = ScoreVariance::estimate(room, &last, (&neighbour, four));
    println!("{score:?}, best {} rays", score.best_steps(REST));
    for steps in [1, 4, 16].map(|steps| NonZeroU32::MIN.saturating_add(steps - 1)) {
        let neighbour = tables.neighbour_with_events::<_, _, 2, B>((room, room), steps)?;
        let of = (&last, &neighbour);
        let scores = (MEAN_WALKS / u64::from(steps.get()), Some(sum / area));
        let (statistics, seconds) = walk(of, mean, Estimator::Collision, scores)?;
        let deviation = statistics.preconditioned().std_dev.unwrap_or(0.0);
        line(
            &format!("{steps} rays, mean"),
            [deviation, seconds],
            best_mean,
        );
        let own = at_points(of, points, Statistics::preconditioned)?;
        line(&format!("{steps} rays, points"), own, best_points);
    }
    Ok(())
}

fn main() -> Result<(), Failed> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, cells, samples] = arguments.as_slice() else {
        return Err("give a scene, about so many cells, and rays of a cell".into());
    };
    let scene = scene(name)?;
    let (tables, cells) = (Tables::new(&scene), Cells::new(&scene, cells.parse()?)?);
    let room = Radiosity::new(tables.geometry(), &cells, ABSORPTION)?;
    let shares = room.visible_shares(64);
    let room = room.with_visible_shares(&shares)?;
    let faces: Vec<u32> = (0..scene.faces().len() as u32).collect();
    let ends = areas(tables.geometry(), &faces)?;
    let mean = Mean::new(tables.geometry(), &faces, &ends)?;
    let mut draws = RngUniforms(WalkSeeds::<DefaultGenerator>::new(2, 0).generator(0));
    let points: Vec<Point<f64>> = (0..POINTS).map(|_| mean.draw(&mut draws).0).collect();
    println!("{name}, {} cells", cells.number());

    let last = LastStep(&room);
    let none = NoNeighbour::<Equations<'_>>::new();
    let none_last = NoNeighbour::<LastStep<'_, Equations<'_>>>::new();
    let scores = (MEAN_WALKS, Some(0.0));
    let mut best = [f64::INFINITY, 1.0];
    let mut all = Vec::new();
    for estimator in [Estimator::Absorption, Estimator::Collision] {
        let (paper, seconds) = walk((&room, &none), &mean, estimator, scores)?;
        let own = [paper.plain().std_dev.unwrap_or(0.0), seconds];
        all.push((format!("plain, {estimator:?}"), own));
        let (stepped, seconds) = walk((&last, &none_last), &mean, estimator, scores)?;
        let own = [stepped.plain().std_dev.unwrap_or(0.0), seconds];
        all.push((format!("to the light, {estimator:?}"), own));
        if own[0] * own[1].sqrt() < best[0] * best[1].sqrt() {
            best = own;
        }
    }
    for (name, own) in all {
        line(&name, own, best);
    }
    let best_points = at_points((&last, &none_last), &points, Statistics::plain)?;
    line("to the light, points", best_points, best_points);
    for events in [0, 8] {
        let options = [samples.parse()?, events];
        degree::<1>(&room, options, &mean, &points, [best, best_points])?;
        degree::<3>(&room, options, &mean, &points, [best, best_points])?;
    }
    Ok(())
}
