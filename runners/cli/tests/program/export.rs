//! `fredholm export`: tables that give a device the program's own bits.

use crate::common;
#[path = "../../../embedded/firmware/src/scene.rs"]
#[allow(dead_code, reason = "the mean over a surface is not asked for here")]
mod scene;

use std::fs;

use common::{Folder, fredholm, is_long, list, number};
use fredholm_core::{
    At, Goal, Goals, LastStep, Neighbour, Real, RunOptions, Statistics, WalkOptions,
};
use fredholm_embedded::zerocopy::{FromBytes, Immutable, IntoBytes};
use fredholm_embedded::{Driver, Tables};

/// A cube whose ceiling is a lamp.
const SCENE: &str = r#"
[problem]
kind = "scene"

[[problem.surface]]
name = "floor"
polygon = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
reflectance = 0.6

[[problem.surface]]
name = "lamp"
polygon = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]
reflectance = 0.2
emission = 1.0

[[problem.surface]]
name = "walls"
polygons = [
    [[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]],
    [[1, 0, 0], [1, 0, 1], [1, 1, 1], [1, 1, 0]],
    [[1, 1, 0], [1, 1, 1], [0, 1, 1], [0, 1, 0]],
    [[0, 1, 0], [0, 1, 1], [0, 0, 1], [0, 0, 0]],
]
reflectance = 0.5

[galerkin]
cells = 6
degree = 1

[walk]
last_step = true
scalar = "f64"
batch = 512
walks = WALKS

[[target]]
name = "point"
at = [0.3, 0.6, 0]
"#;

/// The walks of a comparison, two stages at least. Devices walk slowly here, where nothing is optimised.
fn walks() -> u64 {
    if is_long() { 20_000 } else { 5000 }
}

fn problem(degree: usize, scalar: &str) -> String {
    SCENE
        .replace("WALKS", &walks().to_string())
        .replace("degree = 1", &format!("degree = {degree}"))
        .replace("f64", scalar)
}

/// What a device makes of a scene's tables with B functions on a cell: u on the floor, with its last step to the light.
fn device<F: Real + FromBytes + Immutable, const B: usize>(bytes: &[u8]) -> Statistics {
    let tables = Tables::read(bytes, "scene").unwrap();
    let radiosity = scene::radiosity::<F>(&tables).unwrap();
    let neighbour = scene::neighbour::<F, B>(&tables, &radiosity).unwrap();
    let last = LastStep(&radiosity);
    let point = radiosity.at(0, [0.3, 0.6, 0.0]).unwrap();
    let v0 = neighbour.value(&neighbour.locate(point)).to_f64();
    let goals = [Goal::new(At(point), Some(v0))];
    let job: Goals<'_, _, _, _> = Goals::new(&last, &neighbour, &goals, WalkOptions::default());
    let mut options = RunOptions::new(walks());
    options.batch = 512;
    let mut driver = Driver::<_, 1>::new(&job, 0, options).unwrap();
    driver.poll(&job, u64::MAX).unwrap();
    driver.statistics()[0]
}

/// What a device makes of tables.
type Device = fn(&[u8]) -> Statistics;

#[test]
fn a_device_with_an_exported_scene_has_the_programs_bits() {
    let cases: [(usize, &str, Device); 4] = [
        (0, "f32", device::<f32, 1>),
        (0, "f64", device::<f64, 1>),
        (1, "f32", device::<f32, 3>),
        (2, "f64", device::<f64, 6>),
    ];
    for (degree, scalar, device) in cases {
        let folder = Folder::new();
        let solved = folder.solve(&problem(degree, scalar), &["--json"]);
        let report = solved.warning(0, &[]).json();
        let solved = &list(&report, "targets")[0];
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
            let (what, solved) = (format!("{degree} {scalar} {name}"), &solved[name]);
            assert_eq!(estimate.estimate, number(solved, "estimate"), "{what}");
            let error = Some(number(solved, "std_error"));
            assert_eq!(estimate.std_error, error, "{what}");
        }
    }
}

#[test]
fn what_cannot_be_exported_is_refused_and_leaves_nothing() {
    let folder = Folder::new();
    let lamp = "[[problem.light]]\nat = [0.5, 0.5, 0.5]\nintensity = 1\n\n[galerkin]";
    let scene = problem(0, "f64");
    let lit = folder.file("a.toml", scene.replace("[galerkin]", lamp));
    let scene = folder.file("b.toml", scene);
    for (file, out, words) in [
        (
            &lit,
            "lamp.bin",
            "leave `sky`, `light`, `specular` and `period` out",
        ),
        (&scene, "a.txt", "must end in .bin"),
        (&scene, "a", "must end in .bin"),
        (&scene, "none/a.bin", "there is no folder"),
    ] {
        common::refused(
            &fredholm(&["export", file, "-o", &folder.at(out)]),
            &[words],
        );
    }
    assert_eq!(folder.names(), ["a.toml", "b.toml"]);
}
