//! `fredholm export`: tables that give a device the program's own bits.

#[path = "../../embedded/firmware/src/circle_table.rs"]
mod circle_table;
mod common;
#[path = "../../embedded/firmware/src/room_table.rs"]
#[allow(dead_code, reason = "the mean over a surface is not asked for here")]
mod room_table;

use std::fs;
use std::path::Path;

use common::{Folder, circle_with, fredholm, list, number};
use fredholm_circle::{Moment, Residual};
use fredholm_core::galerkin::{OffDiagonal, PairKind, Piecewise};
use fredholm_core::{
    At, Estimator, Kernel, Neighbour, Real, STEP_LIMIT, Sampler, Source, Statistics, Stream, Task,
};
use fredholm_embedded::zerocopy::{FromBytes, Immutable, IntoBytes};
use fredholm_embedded::{Driver, Plan, Table};
use room_table::RoomTable;

const TABLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../embedded/firmware/tables");

/// The tables that the firmware was built with are those that the program writes now.
#[test]
fn the_firmwares_tables_are_up_to_date() {
    let tables = Path::new(TABLES);
    let folder = Folder::new();
    for name in [
        "circle_f32.bin",
        "circle_f64.rs",
        "cube_f32.rs",
        "cube_f64.bin",
        "product_f32.bin",
        "product_f64.rs",
        "room_f32.rs",
        "room_f64.bin",
    ] {
        let file = tables.join(name).with_extension("toml");
        let out = folder.at(name);
        let ran = fredholm(&["export", file.to_str().unwrap(), "-o", &out]);
        assert_eq!(ran.quietly(0).stdout, "");
        let written = fs::read(out).unwrap();
        assert!(written == fs::read(tables.join(name)).unwrap(), "{name}");
    }
}

/// What a device makes of a circle's table: u(0.3) by 20000 walks.
fn circle<F: Real + FromBytes + Immutable>(bytes: &[u8]) -> Statistics {
    let table = Table::read(bytes, "circle").unwrap();
    let circle = circle_table::circle::<F>(&table).unwrap();
    let start = circle.point(0.3);
    let v = table.slice("v").unwrap();
    let diagonal = match table.one::<u32>("pairs").unwrap() {
        1 => PairKind::Pointwise,
        2 => PairKind::None,
        3 => {
            let moments: &[Moment<F>] = table.slice("moments").unwrap();
            return walk(&circle, &Residual::new(&circle, v, moments).unwrap(), start);
        }
        other => panic!("pairs {other}"),
    };
    let pairs = OffDiagonal { diagonal };
    let g = table.slice("source").unwrap();
    let neighbour = Piecewise::with_pointwise(&circle, &circle, pairs, v, g).unwrap();
    walk(&circle, &neighbour, start)
}

/// The same of a room's: u in the middle of its first wall.
fn room<F: Real + FromBytes + Immutable>(bytes: &[u8]) -> Statistics {
    let table = Table::read(bytes, "room").unwrap();
    let table = RoomTable::<F>::read(&table).unwrap();
    let (room, pairs) = (table.room().unwrap(), table.pairs().unwrap());
    let dense = table.coefficients().unwrap();
    let neighbour = Piecewise::with_pointwise(&room, &dense, pairs, table.v, table.source).unwrap();
    let start = table.point(&room, 0, 0.5).unwrap();
    walk(&room, &neighbour, start)
}

fn walk<E, N>(equation: &E, neighbour: &N, start: E::Point) -> Statistics
where
    E: Sampler + Kernel + Source,
    N: Neighbour<Scalar = E::Scalar, Point = E::Point>,
{
    let task = Task {
        equation,
        neighbour,
        functional: &At(start),
        neighbour_value: Some(neighbour.value(&neighbour.locate(start)).to_f64()),
        estimator: Estimator::Absorption,
        stream: <Stream>::new(1, 0),
        step_limit: STEP_LIMIT,
    };
    let mut plan = Plan::new(20_000);
    plan.batch = 512;
    let mut driver = Driver::new(task, plan).unwrap();
    driver.poll(u64::MAX).unwrap();
    driver.statistics()
}

/// What a device makes of a table in f32 and in f64.
type Device = [fn(&[u8]) -> Statistics; 2];

/// The estimates of the program for the first target of `problem`, which says pairs = "default" and
/// scalar = "f64", and those of a device, for all pairs and both scalars.
fn compare(problem: &str, device: Device) {
    for pairs in ["default", "paper", "pointwise"] {
        for (scalar, device) in ["f32", "f64"].into_iter().zip(device) {
            let mut problem = problem.to_owned();
            for (key, default, value) in [("pairs", "default", pairs), ("scalar", "f64", scalar)] {
                let old = format!("{key} = \"{default}\"");
                assert!(problem.contains(&old));
                problem = problem.replace(&old, &format!("{key} = \"{value}\""));
            }
            let folder = Folder::new();
            let solved = folder.solve(&problem, &["--json"]);
            let solved = &list(&solved.quietly(0).json(), "targets")[0].clone();
            let out = folder.at("table.bin");
            fredholm(&["export", &folder.at("problem.toml"), "--out", &out]).quietly(0);
            let bytes = fs::read(out).unwrap();
            let words: Vec<u64> = bytes
                .chunks_exact(8)
                .map(|word| u64::from_ne_bytes(word.try_into().unwrap()))
                .collect();
            let statistics = device(words.as_bytes());
            for (name, estimate) in [
                ("plain", statistics.plain()),
                ("preconditioned", statistics.preconditioned()),
            ] {
                let what = format!("{pairs} {scalar} {name}");
                let solved = &solved[name];
                assert_eq!(estimate.estimate, number(solved, "estimate"), "{what}");
                assert_eq!(
                    estimate.std_error,
                    Some(number(solved, "std_error")),
                    "{what}"
                );
            }
        }
    }
}

#[test]
fn a_device_with_an_exported_circle_has_the_programs_bits() {
    compare(common::CIRCLE, [circle::<f32>, circle::<f64>]);
}

#[test]
fn a_device_with_an_exported_room_has_the_programs_bits() {
    let file = Path::new(TABLES).join("room_f64.toml");
    let problem = fs::read_to_string(file).unwrap();
    let target = "[[target]]\nname = \"mean\"\nover = \"all\"\n";
    assert!(problem.contains(target));
    let problem = problem.replace(
        target,
        "batch = 512\nwalks = 20000\n[[target]]\nname = \"point\"\n\
         at = { surface = \"floor\", t = 0.5 }\n",
    );
    compare(&problem, [room::<f32>, room::<f64>]);
}

#[test]
fn what_cannot_be_exported_is_refused_and_leaves_nothing() {
    let folder = Folder::new();
    let file = folder.file("a.toml", common::CIRCLE);
    for (out, words) in [
        ("a.txt", "must end in .rs"),
        ("a", "must end in .rs"),
        ("none/a.bin", "there is no folder"),
    ] {
        let ran = fredholm(&["export", &file, "-o", &folder.at(out)]);
        assert_eq!(ran.status, Some(2), "{ran:?}");
        assert!(ran.stderr.contains(words), "{ran:?}");
    }
    let bright = folder.file("b.toml", circle_with("[0.3, 0.7]", "[0.95, 0.95]"));
    let ran = fredholm(&["export", &bright, "-o", &folder.at("b.bin")]);
    assert_eq!(ran.status, Some(2), "{ran:?}");
    assert!(ran.stderr.contains("variance"), "{ran:?}");
    assert_eq!(folder.names(), ["a.toml", "b.toml"]);
}
