//! What a last step to the light gains where the light is small: standard deviations and √(variance × processor time) of plain
//! and of preconditioned walks, without and with it, in two rooms, by lights of 10, 1 and 0.1 % of all walls.
//!
//! `RAYON_NUM_THREADS=1 cargo run --profile dist -p fredholm-file --features measure --example small_lights -- CASES SHARES`, from the folder of the
//! repository, CASES of `furnished,doorway` and SHARES of `0.1,0.01,0.001`.
//!
//! Walks end by roulette. Numbers are of the mean over all walls, and behind the bar of a point. The
//! last column is how many times less error a row has in the same time than the better one of plain walks with a last step
//! and preconditioned ones without it.

mod common;

use core::fmt::Write as _;

use common::{Failed, processor_seconds};
use fredholm::{Pairs, Settings, Solver};

/// Walks of each row.
const WALKS: u64 = 100_000;
const CELLS: usize = 500;

/// What a row is: standard deviations of a mean and of a point, and seconds a walk.
#[derive(Clone, Copy)]
struct Row {
    deviations: [f64; 2],
    seconds: f64,
}

impl Row {
    /// √(variance × time).
    fn errors(&self) -> [f64; 2] {
        self.deviations
            .map(|deviation| deviation * self.seconds.sqrt())
    }
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
        _ => return Err("cases are furnished and doorway".into()),
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
            "  {name:30} √Var {mean:.2e} | {point:.2e}  {:6.2} µs  {:7.2} | {:7.2} times less error",
            1e6 * row.seconds,
            best(0) / errors[0],
            best(1) / errors[1],
        );
    }
}

/// The rows of a room.
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
            seconds: 0.5 * seconds,
        })
    };
    let base = Settings {
        cells: Some(CELLS),
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
            cells: Some(20),
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
    for (name, last) in [("pointwise", false), ("pointwise, last step", true)] {
        rows.push((name, row(&with(last, Pairs::Pointwise), false)?));
    }
    print(case, share, &rows);
    Ok(())
}

fn main() -> Result<(), Failed> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [cases, shares] = arguments.as_slice() else {
        return Err("give cases and shares".into());
    };
    for case in cases.split(',') {
        for share in shares.split(',') {
            by_solver(case, share.parse()?)?;
        }
    }
    Ok(())
}
