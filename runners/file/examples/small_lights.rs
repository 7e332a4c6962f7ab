//! What a last step to the light gains where the light is small: standard deviations and √(variance × processor time) of plain
//! and of preconditioned walks, without and with it, on the circle, in two rooms and in two scenes, by lights of 10, 1 and
//! 0.1 % of all walls.
//!
//! `RAYON_NUM_THREADS=1 cargo run --profile dist -p fredholm-file --features measure --example small_lights -- CASES SHARES`, from the folder of the
//! repository, CASES of `circle,furnished,doorway,cornell,living` and SHARES of `0.1,0.01,0.001`; behind them the number of cells of
//! scenes, 600 if it is left out.
//!
//! Walks end by roulette. Numbers are of the mean over all walls, and behind the bar of a point. The
//! last column is how many times less error a row has in the same time than the better one of plain walks with a last step
//! and preconditioned ones without it.

mod common;

use core::fmt::Write as _;
use core::num::NonZeroU32;

use common::{Failed, living_room, processor_seconds, walk, with_scene};
use fredholm::{Pairs, Settings, Solver};
use fredholm_core::galerkin::{Basis, Cells as _};
use fredholm_core::sampled::{SampledSetup, ScoreVariance, SetupOptions, StepEvents};
use fredholm_core::{
    Absorption, At, DefaultGenerator, Equation, Functional, LastStep, NeighbourOf, NoNeighbour,
    RngUniforms, Statistics, WalkSeeds,
};
use fredholm_scene::{Cells, Mean, Point, Radiosity, Scene, Tables, areas};

/// Walks of each row; of the rows of scenes.
const WALKS: u64 = 100_000;
const SCENE_WALKS: u64 = 40_000;
/// Cells; of scenes.
const CELLS: usize = 500;
const SCENE_CELLS: usize = 600;

/// What a row is: standard deviations of a mean and of a point, and seconds a walk of each.
#[derive(Clone, Copy)]
struct Row {
    deviations: [f64; 2],
    seconds: [f64; 2],
}

impl Row {
    /// √(variance × time).
    fn errors(&self) -> [f64; 2] {
        [0, 1].map(|k| self.deviations[k] * self.seconds[k].sqrt())
    }
}

/// The rectangle of the lamp in a ceiling, as two surfaces.
fn ceiling([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64, area: f64, rho: f64) -> String {
    let (x, y) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
    // As long and as wide as the ceiling is.
    let scale = (area / ((x1 - x0) * (y1 - y0))).sqrt();
    let (dx, dy) = (0.5 * scale * (x1 - x0), 0.5 * scale * (y1 - y0));
    let (a0, a1, b0, b1) = (x - dx, x + dx, y - dy, y + dy);
    format!(
        "[[problem.surface]]\nname = \"ceiling\"\nreflectance = {rho}\npolygons = [\n\
         [[{x0},{y0},{z}],[{a0},{b0},{z}],[{a1},{b0},{z}],[{x1},{y0},{z}]],\n\
         [[{x1},{y0},{z}],[{a1},{b0},{z}],[{a1},{b1},{z}],[{x1},{y1},{z}]],\n\
         [[{x1},{y1},{z}],[{a1},{b1},{z}],[{a0},{b1},{z}],[{x0},{y1},{z}]],\n\
         [[{x0},{y1},{z}],[{a0},{b1},{z}],[{a0},{b0},{z}],[{x0},{y0},{z}]]]\n\
         [[problem.surface]]\nname = \"lamp\"\nreflectance = {rho}\nemission = {}\n\
         polygon = [[{a0},{b0},{z}],[{a0},{b1},{z}],[{a1},{b1},{z}],[{a1},{b0},{z}]]\n",
        1.0 / area
    )
}

/// The file without the tables of some surfaces.
fn without(text: &str, names: &[&str]) -> String {
    let mut parts = text.split("[[problem.surface]]");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        if !names
            .iter()
            .any(|name| part.contains(&format!("name = \"{name}\"")))
        {
            out.push_str("[[problem.surface]]");
            out.push_str(part);
        }
    }
    out
}

/// The problem of a case with a light of this share of all walls, as a file.
fn problem(case: &str, share: f64) -> Result<String, Failed> {
    let example = |name: &str| std::fs::read_to_string(format!("examples/{name}.toml"));
    // A light between two places on a line of length l, which is all of the ceiling or a wall.
    let between = |whole: f64, perimeter: f64| {
        let half = 0.5 * (share * perimeter).min(whole);
        [0.5 * whole - half, 0.5 * whole + half]
    };
    Ok(match case {
        "circle" => {
            let arcs = (1.0 / share).round() as usize;
            let mut emission = vec!["0"; arcs];
            emission[arcs / 3] = "1";
            format!(
                "[problem]\nkind = \"circle\"\nreflectance = [0.5]\nemission = [{}]\n[[target]]\nname = \"mean\"\nover = \"all\"\n\
                 [[target]]\nname = \"point\"\nat = 5.0\n",
                emission.join(", ")
            )
        }
        "furnished" => {
            let text = without(
                &example("furnished")?,
                &["lamp", "ceiling, left", "ceiling, right"],
            );
            let [a, b] = between(4.0, 22.3);
            let head = text.find("[galerkin]").ok_or("no [galerkin]")?;
            let mut out = text[..head].to_owned();
            for (name, from, to, rho, emission) in [
                ("right", 4.0, b, 0.7, 0.0),
                ("lamp", b, a, 0.1, 1.0 / (b - a)),
                ("left", a, 0.0, 0.7, 0.0),
            ] {
                write!(
                    out,
                    "[[problem.surface]]\nname = \"{name}\"\npoints = [[{from}, 2.5], [{to}, 2.5]]\nreflectance = {rho}\n\
                     emission = {emission}\n"
                )?;
            }
            out + "[[target]]\nname = \"mean\"\nover = \"all\"\n[[target]]\nname = \"point\"\nat = { surface = \"floor\", t = 0.5 }\n"
        }
        "doorway" => {
            let text = without(&example("doorway")?, &["lamp"]);
            let [a, b] = between(2.0, 15.2);
            let head = text.find("[galerkin]").ok_or("no [galerkin]")?;
            let mut out = text[..head].to_owned();
            for (name, from, to, emission) in [
                ("upper", 2.0, b, 0.0),
                ("lamp", b, a, 1.0 / (b - a)),
                ("lower", a, 0.0, 0.0),
            ] {
                write!(
                    out,
                    "[[problem.surface]]\nname = \"{name}\"\npoints = [[0, {from}], [0, {to}]]\nreflectance = 0.4\n\
                     emission = {emission}\n"
                )?;
            }
            out + "[[target]]\nname = \"mean\"\nover = \"all\"\n[[target]]\nname = \"point\"\n\
                   at = { surface = \"right room\", t = 0.02 }\n"
        }
        "cornell" => {
            let text = without(&example("cornell")?, &["ceiling", "lamp"]);
            let head = text.find("[galerkin]").ok_or("no [galerkin]")?;
            text[..head].to_owned()
                + &ceiling(
                    [0.0, 556.0],
                    [0.0, 559.2],
                    548.8,
                    share * 556.0 * 559.2 * 5.9,
                    0.7,
                )
        }
        "living" => {
            let text = without(&living_room()?, &["ceiling"]);
            let text = text.replace("emission = 300", "");
            let head = text.find("[galerkin]").ok_or("no [galerkin]")?;
            text[..head].to_owned() + &ceiling([0.0, 6.0], [0.0, 4.5], 2.5, share * 160.0, 0.8)
        }
        _ => return Err("cases are circle, furnished, doorway, cornell and living".into()),
    })
}

/// Prints the rows, and what each gains.
fn print(case: &str, share: f64, rows: &[(&str, Row)]) {
    let single = |row: &&(&str, Row)| ["plain, last step", "preconditioned"].contains(&row.0);
    let best = |k: usize| {
        let singles = rows.iter().filter(single);
        singles
            .map(|(_, row)| row.errors()[k])
            .fold(f64::INFINITY, f64::min)
    };
    println!("{case}, light of {} %", 100.0 * share);
    for (name, row) in rows {
        let [mean, point] = row.deviations;
        let errors = row.errors();
        println!(
            "  {name:30} √Var {mean:.2e} | {point:.2e}  {:6.2} | {:6.2} µs  {:7.2} | {:7.2} times less error",
            1e6 * row.seconds[0],
            1e6 * row.seconds[1],
            best(0) / errors[0],
            best(1) / errors[1],
        );
    }
}

/// The rows of a circle or a room.
fn by_solver(case: &str, share: f64) -> Result<(), Failed> {
    let text = problem(case, share)?;
    let resolved = fredholm_file::read("case.toml", &text)?.resolve()?;
    let model = resolved.model.model();
    let row = |settings: &Settings, plain: bool| {
        let of = |walks| {
            let settings = Settings {
                walks: Some(walks),
                ..settings.clone()
            };
            let before = processor_seconds();
            let report = Solver::with(model, settings, resolved.targets.clone()).solve()?;
            Ok::<_, Failed>((report, processor_seconds() - before))
        };
        let (_, short) = of(1000)?;
        let (report, long) = of(WALKS)?;
        let seconds = (long - short) / (WALKS - 1000) as f64;
        let deviation = |k: usize| {
            let goal = &report.goals[k];
            let found = if plain {
                &goal.plain
            } else {
                &goal.preconditioned
            };
            found.std_dev.unwrap_or(f64::NAN)
        };
        // Both targets have walks of the same kind.
        Ok::<_, Failed>(Row {
            deviations: [deviation(0), deviation(1)],
            seconds: [0.5 * seconds; 2],
        })
    };
    let base = Settings {
        cells: Some(if case == "circle" { 1000 } else { CELLS }),
        ..Settings::default()
    };
    let with = |last, pairs| Settings {
        last_step: Some(last),
        pairs: Some(pairs),
        ..base.clone()
    };
    // Plain walks that follow no neighbour equation: on cells of which nothing is asked they take as long as they may.
    let plain = |last| -> Result<Row, Failed> {
        let settings = Settings {
            cells: Some(if case == "circle" { 1000 } else { 20 }),
            ..with(last, Pairs::Default)
        };
        row(&settings, true)
    };
    let mut rows = vec![
        ("plain", plain(false)?),
        ("plain, last step", plain(true)?),
        ("preconditioned", row(&with(false, Pairs::Default), false)?),
        (
            "preconditioned, last step",
            row(&with(true, Pairs::Default), false)?,
        ),
    ];
    if case != "circle" {
        for (name, last) in [("pointwise", false), ("pointwise, last step", true)] {
            rows.push((name, row(&with(last, Pairs::Pointwise), false)?));
        }
    }
    print(case, share, &rows);
    Ok(())
}

/// The row of a mean and a point.
fn scene_row<E, N>(
    of: (&E, &N),
    mean: &Mean<'_, f64>,
    (point, value): (Point<f64>, Option<f64>),
    plain: bool,
) -> Result<Row, Failed>
where
    E: Equation<Scalar = f64, Point = Point<f64>, Value = f64> + Sync,
    N: NeighbourOf<E> + Sync,
    for<'a> Mean<'a, f64>: Functional<E>,
{
    let by = Absorption::Roulette;
    let (of_mean, mean_seconds) = walk(of, *mean, by, (SCENE_WALKS, value))?;
    let (of_point, point_seconds) = walk(of, At(point), by, (SCENE_WALKS, None))?;
    let which = if plain {
        Statistics::plain
    } else {
        Statistics::preconditioned
    };
    Ok(Row {
        deviations: [of_mean, of_point]
            .map(|statistics| which(&statistics).std_dev.unwrap_or(f64::NAN)),
        seconds: [mean_seconds, point_seconds],
    })
}

/// The row of the neighbour equation from rays for an equation, with as many rays a score as are best.
fn from_rays<S>(
    room: &Radiosity<'_, f64>,
    source: &S,
    mean: &Mean<'_, f64>,
    point: Point<f64>,
) -> Result<Row, Failed>
where
    S: Equation<Scalar = f64, Point = Point<f64>, Value = f64>
        + Basis<3>
        + StepEvents<2, Scalar = f64, Point = Point<f64>>
        + Sync,
    for<'a> Mean<'a, f64>: Functional<S>,
{
    let options = SetupOptions {
        samples: 4096,
        events: 8,
        ..SetupOptions::default()
    };
    let setup = SampledSetup::<_, 2, 3, _> {
        equation: source,
        events: source,
        options,
    };
    let solution = setup.solve_all()?;
    let (mut sum, mut area) = (0.0, 0.0);
    for (cell, v) in solution.v().iter().step_by(3).enumerate() {
        sum += room.measure(cell) * v;
        area += room.measure(cell);
    }
    let tables = solution.for_walks::<f64>()?;
    let four = NonZeroU32::MIN.saturating_add(3);
    let trial = tables.neighbour::<_, _, 2, 3>(source, source, four)?;
    let best = ScoreVariance::estimate(source, &trial, four).best_steps(3.0);
    let neighbour = tables.neighbour::<_, _, 2, 3>(source, source, best)?;
    scene_row((source, &neighbour), mean, (point, Some(sum / area)), false)
}

/// The rows of a scene of about so many cells.
fn by_rays(case: &str, share: f64, wanted: usize) -> Result<(), Failed> {
    let rows = |scene: &Scene| rows_of(scene, (case, share), wanted);
    with_scene(&problem(case, share)?, rows)
}

fn rows_of(scene: &Scene, (case, share): (&str, f64), wanted: usize) -> Result<(), Failed> {
    let (tables, cells) = (Tables::new(scene), Cells::new(scene, wanted)?);
    let room = Radiosity::new(tables.geometry(), &cells)?;
    let shares = room.visible_shares(64);
    let room = room.with_visible_shares(&shares)?;
    let faces: Vec<u32> = (0..scene.faces().len() as u32).collect();
    let ends = areas(tables.geometry(), &faces)?;
    let mean = Mean::new(tables.geometry(), &faces, &ends)?;
    let mut draws = RngUniforms(WalkSeeds::<DefaultGenerator>::new(5, 0).generator(0));
    let point = mean.start(&room, &mut draws).point;
    let last = LastStep(&room);
    let (none, none_last) = (NoNeighbour::new(&room), NoNeighbour::new(&last));
    let start = (point, Some(0.0));
    let rows = [
        ("plain", scene_row((&room, &none), &mean, start, true)?),
        (
            "plain, last step",
            scene_row((&last, &none_last), &mean, start, true)?,
        ),
        ("preconditioned", from_rays(&room, &room, &mean, point)?),
        (
            "preconditioned, last step",
            from_rays(&room, &last, &mean, point)?,
        ),
    ];
    print(case, share, &rows);
    Ok(())
}

fn main() -> Result<(), Failed> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (cases, shares, cells) = match arguments.as_slice() {
        [cases, shares] => (cases, shares, SCENE_CELLS),
        [cases, shares, cells] => (cases, shares, cells.parse()?),
        _ => {
            return Err(
                "give cases, shares and, if you like, the number of cells of scenes".into(),
            );
        }
    };
    for case in cases.split(',') {
        for share in shares.split(',') {
            let share = share.parse()?;
            match case {
                "cornell" | "living" => by_rays(case, share, cells)?,
                _ => by_solver(case, share)?,
            }
        }
    }
    Ok(())
}
