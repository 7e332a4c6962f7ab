//! What the neighbour equation from rays gains in scenes: √Var, and the error at equal time, beside plain walks without a last
//! step to the light, the paper's, and the best plain walks with one.
//!
//! `cargo run --profile dist -p fredholm-file --features measure --example scene_gain -- CASES CELLS DEGREES FACES RAYS`, from the folder of the repository,
//! CASES of `cube,box,cornell,living,furnace`, CELLS as `100,1000`, DEGREES of `0,1,2`, the number of FACES in the control of a cell,
//! 8 if it is left out, and the set-up's RAYS of a cell, 256 to 4096 and four million in all if they are left out.
//!
//! Numbers are of the mean over all surfaces, and behind the bar of fifty points (root mean square). The best plain walks are
//! those with the least variance × time: by roulette, and of both estimators with five absorption probabilities.

mod common;

use core::num::NonZeroU32;

use common::{Failed, processor_seconds};
use fredholm_core::galerkin::Cells as _;
use fredholm_core::sampled::{SampledSetup, ScoreVariance, SetupOptions};
use fredholm_core::{
    Absorption, At, Batch, DefaultGenerator, Equation, Estimate, Estimator, Functional, Goal,
    Goals, Job, LastStep, NeighbourOf, NoNeighbour, RngUniforms, Statistics, WalkOptions,
    WalkSeeds,
};
use fredholm_file::Resolution;
use fredholm_scene::{
    Cells, Enclosure, Material, Mean, Point, Radiosity, Scene, Surface, Tables, areas, shapes,
};

type Equations<'a> = Radiosity<'a, f64>;

/// What the rest of a walk takes, in rays of its scores.
const REST: f64 = 3.0;
/// Absorption probabilities of plain walks, beside roulette.
const ABSORPTIONS: [f64; 5] = [0.1, 0.2, 0.3, 0.4, 0.5];
/// Points, walks from each, and walks of a mean.
const POINTS: u64 = 50;
const POINT_WALKS: u64 = 2000;
const MEAN_WALKS: u64 = 100_000;
/// Rays of a set-up, and of a cell at least and at most.
const RAYS: usize = 1 << 22;
const RAYS_OF_CELL: [usize; 2] = [256, 4096];
/// Seconds that a run takes with its set-up, for the last column.
const IN_ALL: f64 = 60.0;

/// A unit cube whose ceiling emits, or one with two hovering blocks and a small lamp that looks down.
fn unit(is_empty: bool) -> Result<Scene, Failed> {
    let room = shapes::room([0.0; 3], [1.0; 3]);
    let (shape, lamp) = if is_empty {
        (room, 1)
    } else {
        let blocks = shapes::block([0.15, 0.15, 0.02], [0.45, 0.45, 0.6])
            .and(shapes::block([0.55, 0.5, 0.02], [0.85, 0.8, 0.3]));
        let lamp = shapes::block([0.4, 0.4, 0.97], [0.6, 0.6, 0.99]);
        (room.and(lamp).and(blocks), 6)
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

/// The living room of the examples without its lamp at a point: the window gives the light.
fn living_room() -> Result<String, Failed> {
    let text = std::fs::read_to_string("examples/living-room.toml")?;
    let text = text.replace("living-room.obj", "examples/living-room.obj");
    let light = text.find("[[problem.light]]").ok_or("no light")?;
    let surfaces = text[light..].find("[[problem.surface]]");
    let rest = light + surfaces.ok_or("no surface")?;
    Ok(text[..light].to_owned() + &text[rest..])
}

/// What is done with the scene of a file.
fn with_scene(text: &str, then: impl FnOnce(&Scene) -> Result<(), Failed>) -> Result<(), Failed> {
    let resolved = fredholm_file::read("case.toml", text)?.resolve()?;
    match &resolved.model {
        Resolution::Scene(model) => then(model.scene()),
        _ => Err("this is no scene".into()),
    }
}

/// Statistics of so many walks, and seconds a walk.
fn walk<E, N, T>(
    (equation, neighbour): (&E, &N),
    functional: T,
    absorption: Absorption,
    (walks, control_mean): (u64, Option<f64>),
) -> Result<(Statistics, f64), Failed>
where
    E: Equation<Scalar = f64, Value = f64> + Sync,
    N: NeighbourOf<E> + Sync,
    T: Functional<E> + Sync,
{
    let goals = [Goal::new(functional, control_mean)];
    let options = WalkOptions {
        absorption,
        ..WalkOptions::default()
    };
    let job = Goals::new(equation, neighbour, &goals, options);
    let mut batches = [Batch::new(0, walks, walks)];
    let start = processor_seconds();
    job.run(0, &mut batches, u64::MAX)?;
    let seconds = (processor_seconds() - start) / walks as f64;
    Ok((batches[0].statistics(), seconds))
}

/// √Var, and seconds a walk.
type Measured = [f64; 2];

/// The root mean square of the standard deviations at all points, and seconds a walk.
fn at_points<E, N>(
    of: (&E, &N),
    points: &[Point<f64>],
    absorption: Absorption,
    choose: fn(&Statistics) -> Estimate,
) -> Result<Measured, Failed>
where
    E: Equation<Scalar = f64, Point = Point<f64>, Value = f64> + Sync,
    N: NeighbourOf<E> + Sync,
{
    let (mut square, mut seconds) = (0.0, 0.0);
    for &x in points {
        let (statistics, time) = walk(of, At(x), absorption, (POINT_WALKS, None))?;
        square += choose(&statistics).std_dev.unwrap_or(0.0).powi(2) / points.len() as f64;
        seconds += time / points.len() as f64;
    }
    Ok([square.sqrt(), seconds])
}

/// Plain walks: of the mean, and of points.
fn plain<E>(
    equation: &E,
    mean: &Mean<'_, f64>,
    points: &[Point<f64>],
    absorption: Absorption,
) -> Result<[Measured; 2], Failed>
where
    E: Equation<Scalar = f64, Point = Point<f64>, Value = f64> + Sync,
    for<'a> Mean<'a, f64>: Functional<E>,
{
    let none = NoNeighbour::new(equation);
    let of = (equation, &none);
    let (statistics, seconds) = walk(of, *mean, absorption, (MEAN_WALKS, Some(0.0)))?;
    let deviation = statistics.plain().std_dev.unwrap_or(f64::NAN);
    let points = at_points(of, points, absorption, Statistics::plain)?;
    Ok([[deviation, seconds], points])
}

/// √(variance × time).
fn error([deviation, seconds]: Measured) -> f64 {
    deviation * seconds.sqrt()
}

/// The one with less error at equal time.
fn better(one: Measured, other: Measured) -> Measured {
    if error(other) < error(one) {
        other
    } else {
        one
    }
}

/// Prints plain walks; the paper's, and the best.
fn yardsticks(
    scene: &Scene,
    tables: &Tables<f64>,
    mean: &Mean<'_, f64>,
    points: &[Point<f64>],
) -> Result<[[Measured; 2]; 2], Failed> {
    let cells = Cells::new(scene, 1)?;
    let mut paper = [[f64::INFINITY, 1.0]; 2];
    let mut best = paper;
    let room = Radiosity::new(tables.geometry(), &cells)?;
    let shares = room.visible_shares(64);
    let room = room.with_visible_shares(&shares)?;
    let mut ways = vec![Absorption::Roulette];
    for probability in ABSORPTIONS {
        for estimator in [Estimator::Absorption, Estimator::Collision] {
            ways.push(Absorption::Constant {
                probability,
                estimator,
            });
        }
    }
    for way in ways {
        let stepped = plain(&LastStep(&room), mean, points, way)?;
        best = [0, 1].map(|k| better(best[k], stepped[k]));
        if way.estimator() == Estimator::Absorption {
            let own = plain(&room, mean, points, way)?;
            paper = [0, 1].map(|k| better(paper[k], own[k]));
        }
    }
    for (name, [of_mean, of_points]) in [("paper's plain walk", paper), ("best plain walk", best)] {
        println!(
            "  {name:20} √Var {:9.3e} | {:9.3e}  {:6.2} | {:6.2} µs",
            of_mean[0],
            of_points[0],
            1e6 * of_mean[1],
            1e6 * of_points[1]
        );
    }
    Ok([paper, best])
}

/// A line for the neighbour equation of B functions on a cell.
fn row<const B: usize>(
    room: &Equations<'_>,
    mean: &Mean<'_, f64>,
    points: &[Point<f64>],
    [paper, best]: [[Measured; 2]; 2],
    (events, samples): (usize, Option<usize>),
) -> Result<(), Failed> {
    let last = LastStep(room);
    let cells = room.cells();
    let start = processor_seconds();
    let options = SetupOptions {
        samples: samples.unwrap_or((RAYS / cells).clamp(RAYS_OF_CELL[0], RAYS_OF_CELL[1])),
        events,
        ..SetupOptions::default()
    };
    let setup = SampledSetup::<_, 2, B, _> {
        equation: &last,
        events: &last,
        options,
    };
    let solution = setup.solve_all()?;
    let (mut sum, mut area) = (0.0, 0.0);
    for (cell, v) in solution.v().iter().step_by(B).enumerate() {
        sum += room.measure(cell) * v;
        area += room.measure(cell);
    }
    let tables = solution.for_walks::<f64>()?;
    let four = NonZeroU32::MIN.saturating_add(3);
    let trial = tables.neighbour::<_, _, 2, B>(&last, &last, four)?;
    let setup = processor_seconds() - start;
    let rays = ScoreVariance::estimate(&last, &trial, four).best_steps(REST);
    let neighbour = tables.neighbour::<_, _, 2, B>(&last, &last, rays)?;
    let of = (&last, &neighbour);
    let start = (MEAN_WALKS / u64::from(rays.get()), Some(sum / area));
    let (statistics, seconds) = walk(of, *mean, Absorption::Roulette, start)?;
    let deviation = statistics.preconditioned().std_dev.unwrap_or(f64::NAN);
    let own = [
        [deviation, seconds],
        at_points(of, points, Absorption::Roulette, Statistics::preconditioned)?,
    ];
    let times = |of: fn(Measured) -> f64, other: [Measured; 2]| {
        let [of_mean, of_points] = [0, 1].map(|k| of(other[k]) / of(own[k]));
        format!("{of_mean:6.1} | {of_points:6.1}")
    };
    let deviation = |[deviation, _]: Measured| deviation;
    let walked = ((IN_ALL - setup).max(0.0) / IN_ALL).sqrt();
    println!(
        "  {cells:6} cells, {B} functions, {rays:2} rays  √Var {:9.3e} | {:9.3e}  {:6.2} | {:6.2} µs;  √Var below paper {}, below best {};  error {}, of {IN_ALL} s with set-up of {setup:.1} s {:.2} of it",
        own[0][0],
        own[1][0],
        1e6 * own[0][1],
        1e6 * own[1][1],
        times(deviation, paper),
        times(deviation, best),
        times(error, best),
        walked,
    );
    Ok(())
}

fn rows(
    scene: &Scene,
    (cells, degrees): (&str, &str),
    setup: (usize, Option<usize>),
) -> Result<(), Failed> {
    let tables = Tables::new(scene);
    let faces: Vec<u32> = (0..scene.faces().len() as u32).collect();
    let ends = areas(tables.geometry(), &faces)?;
    let mean = Mean::new(tables.geometry(), &faces, &ends)?;
    let mut draws = RngUniforms(WalkSeeds::<DefaultGenerator>::new(2, 0).generator(0));
    let coarse = Cells::new(scene, 1)?;
    let room = Radiosity::new(tables.geometry(), &coarse)?;
    let points: Vec<Point<f64>> = (0..POINTS)
        .map(|_| mean.start(&room, &mut draws).point)
        .collect();
    let others = yardsticks(scene, &tables, &mean, &points)?;
    for degree in degrees.split(',') {
        for wanted in cells.split(',') {
            let cells = Cells::new(scene, wanted.parse()?)?;
            let room = Radiosity::new(tables.geometry(), &cells)?;
            let shares = room.visible_shares(64);
            let room = room.with_visible_shares(&shares)?;
            match degree {
                "0" => row::<1>(&room, &mean, &points, others, setup)?,
                "1" => row::<3>(&room, &mean, &points, others, setup)?,
                "2" => row::<6>(&room, &mean, &points, others, setup)?,
                _ => return Err("degrees are 0, 1 and 2".into()),
            }
        }
    }
    Ok(())
}

fn main() -> Result<(), Failed> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [cases, cells, degrees, setup @ ..] = arguments.as_slice() else {
        return Err("give cases, numbers of cells, degrees, and perhaps faces and rays".into());
    };
    let events = setup.first().map_or(Ok(8), |faces| faces.parse())?;
    let samples = setup.get(1).map(|rays| rays.parse()).transpose()?;
    for case in cases.split(',') {
        println!("{case}");
        let file = |name: &str| std::fs::read_to_string(format!("examples/{name}.toml"));
        let of = |scene: &Scene| rows(scene, (cells, degrees), (events, samples));
        match case {
            "cube" | "box" => of(&unit(case == "cube")?)?,
            "cornell" => with_scene(&file("cornell")?, of)?,
            "living" => with_scene(&living_room()?, of)?,
            "furnace" => with_scene(&file("reheating")?, of)?,
            _ => return Err("cases are cube, box, cornell, living and furnace".into()),
        }
    }
    Ok(())
}
