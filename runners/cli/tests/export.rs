//! `fredholm export`: tables that give a device the program's own bits.

mod common;

use std::fs;
use std::path::Path;

use common::{Folder, circle_with, fredholm, list, number};
use fredholm_circle::{Cells, Circle, Harmonic, Moment, Point, Residual};
use fredholm_core::galerkin::{OffDiagonal, PairKind, Piecewise};
use fredholm_core::{At, Estimator, Neighbour, Real, STEP_LIMIT, Statistics, Stream, Task};
use fredholm_embedded::zerocopy::{FromBytes, Immutable, IntoBytes};
use fredholm_embedded::{Driver, Plan, Table};

/// The tables that the firmware was built with are those that the program writes now.
#[test]
fn the_firmwares_tables_are_up_to_date() {
    let tables = Path::new(env!("CARGO_MANIFEST_DIR")).join("../embedded/firmware/tables");
    let folder = Folder::new();
    for name in [
        "circle_f32.bin",
        "circle_f64.rs",
        "cube_f32.rs",
        "cube_f64.bin",
        "product_f32.bin",
        "product_f64.rs",
    ] {
        let file = tables.join(name).with_extension("toml");
        let out = folder.at(name);
        let ran = fredholm(&["export", file.to_str().unwrap(), "-o", &out]);
        assert_eq!(ran.quietly(0).stdout, "");
        let written = fs::read(out).unwrap();
        assert!(written == fs::read(tables.join(name)).unwrap(), "{name}");
    }
}

/// What a device makes of a table: u(0.3) by 20000 walks.
fn on_device<F: Real + FromBytes + Immutable>(bytes: &[u8]) -> Statistics {
    let table = Table::read(bytes, "circle").unwrap();
    let [constant, amplitude, frequency] = *table.slice::<f64>("harmonic").unwrap() else {
        panic!("three numbers");
    };
    let frequency = frequency as u32;
    let light = Harmonic {
        constant,
        amplitude,
        frequency,
    };
    let slots = table.slice("slots").unwrap();
    let cells = Cells::<F>::new(table.slice("cells").unwrap(), slots).unwrap();
    let circle = Circle::with_constants(cells, light, table.one("circle").unwrap()).unwrap();
    let v = table.slice("v").unwrap();
    let diagonal = match table.one::<u32>("pairs").unwrap() {
        1 => PairKind::Pointwise,
        2 => PairKind::None,
        3 => {
            let moments: &[Moment<F>] = table.slice("moments").unwrap();
            return walk(&circle, &Residual::new(&circle, v, moments).unwrap());
        }
        other => panic!("pairs {other}"),
    };
    let pairs = OffDiagonal { diagonal };
    let g = table.slice("source").unwrap();
    let neighbour = Piecewise::with_pointwise(&circle, &circle, pairs, v, g).unwrap();
    walk(&circle, &neighbour)
}

fn walk<F: Real>(
    circle: &Circle<'_, F, Harmonic>,
    neighbour: &impl Neighbour<Scalar = F, Point = Point<F>>,
) -> Statistics {
    let start = circle.point(0.3);
    let task = Task {
        equation: circle,
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

#[test]
fn a_device_with_an_exported_circle_has_the_programs_bits() {
    for pairs in ["default", "paper", "pointwise"] {
        for scalar in ["f32", "f64"] {
            let problem = circle_with("pairs = \"default\"", &format!("pairs = \"{pairs}\""))
                .replace("scalar = \"f64\"", &format!("scalar = \"{scalar}\""));
            let folder = Folder::new();
            let solved = folder.solve(&problem, &["--json"]);
            let solved = &list(&solved.quietly(0).json(), "targets")[0].clone();
            let out = folder.at("circle.bin");
            fredholm(&["export", &folder.at("problem.toml"), "--out", &out]).quietly(0);
            let bytes = fs::read(out).unwrap();
            let words: Vec<u64> = bytes
                .chunks_exact(8)
                .map(|word| u64::from_ne_bytes(word.try_into().unwrap()))
                .collect();
            let bytes = words.as_bytes();
            let statistics = match scalar {
                "f32" => on_device::<f32>(bytes),
                _ => on_device::<f64>(bytes),
            };
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
