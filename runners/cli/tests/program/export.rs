//! `fredholm export`: tables that give a device the program's own bits.

#[path = "../../../embedded/firmware/src/circle_table.rs"]
mod circle_table;
use crate::common;
#[path = "../../../embedded/firmware/src/room_table.rs"]
#[allow(dead_code, reason = "the mean over a surface is not asked for here")]
mod room_table;
#[path = "../../../embedded/firmware/src/scene_table.rs"]
#[allow(dead_code, reason = "the mean over a surface is not asked for here")]
mod scene_table;

use std::fs;
use std::path::Path;

use common::{Folder, circle_with, fredholm, is_long, list, number};
use fredholm_circle::{Moment, Residual};
use fredholm_core::galerkin::{Dense, DiagonalRule, PairKind, Piecewise, Rounded};
use fredholm_core::{
    At, DefaultGenerator, Equation, Estimator, Form, Functional, KnownPart, LastStep, Length,
    Neighbour, NeighbourOf, Real, RunOptions, Started, Statistics, Task, WalkSeeds, WithKnown,
};
use fredholm_cube::{Cube, FactorTables, KernelFn, ScalarField, functions};
use fredholm_embedded::zerocopy::{FromBytes, Immutable, IntoBytes};
use fredholm_embedded::{Driver, Table};
use fredholm_room::RayNeighbour;
use room_table::RoomTable;
use scene_table::SceneTable;

const TABLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../embedded/firmware/tables");

/// The tables that the firmware was built with are those that the program writes now.
#[test]
fn the_firmwares_tables_are_up_to_date() {
    let tables = Path::new(TABLES);
    let folder = Folder::new();
    for name in [
        "circle_f32.bin",
        "circle_f64.rs",
        "circle_cubic_f32.rs",
        "circle_quartic_f64.bin",
        "cube_f32.rs",
        "cube_f64.bin",
        "cube_quadratic_f32.bin",
        "cube_quadratic_f64.rs",
        "product_f32.bin",
        "product_f64.rs",
        "product_cubic_f32.rs",
        "product_cubic_f64.bin",
        "room_f32.rs",
        "room_f64.bin",
        "room_quadratic_f32.rs",
        "room_rays_f32.bin",
        "room_cubic_f64.bin",
        "scene_f64.rs",
        "scene_linear_f32.bin",
    ] {
        let file = tables.join(name).with_extension("toml");
        let out = folder.at(name);
        let ran = fredholm(&["export", file.to_str().unwrap(), "-o", &out]);
        assert_eq!(ran.quietly(0).stdout, "");
        let written = fs::read(out).unwrap();
        assert!(written == fs::read(tables.join(name)).unwrap(), "{name}");
    }
}

/// What a device makes of a circle's table: u(0.3).
fn circle<F: Real + FromBytes + Immutable>(bytes: &[u8]) -> Statistics {
    let table = Table::read(bytes, "circle").unwrap();
    let circle = circle_table::circle::<F>(&table).unwrap();
    let start = circle.point(0.3);
    let v = table.slice("v").unwrap();
    let diagonal = match table.one::<u32>("pairs").unwrap() {
        1 => PairKind::Pointwise,
        2 => PairKind::Dropped,
        3 => {
            let moments: &[Moment<F>] = table.slice("moments").unwrap();
            return walk(&circle, &Residual::new(&circle, v, moments).unwrap(), start);
        }
        other => panic!("pairs {other}"),
    };
    let pairs = DiagonalRule { diagonal };
    let g = table.slice("source").unwrap();
    let neighbour = Piecewise::with_pointwise(&circle, &circle, pairs, v, g).unwrap();
    walk(&circle, &neighbour, start)
}

/// The same with B functions per cell.
fn circle_of_degree<F: Real + FromBytes + Immutable, const B: usize>(bytes: &[u8]) -> Statistics {
    let table = Table::read(bytes, "circle").unwrap();
    assert_eq!(table.one::<u32>("degree"), Ok(B as u32 - 1));
    let circle = circle_table::circle::<F>(&table).unwrap();
    let polynomials = circle.with_functions::<B>();
    let start = circle.point(0.3);
    let v = table.slice("v").unwrap();
    if table.one::<u32>("pairs") == Ok(3) {
        let moments: &[Moment<F>] = table.slice("moments").unwrap();
        let neighbour = Residual::new(&polynomials, v, moments).unwrap();
        return walk(&circle, &neighbour, start);
    }
    assert_eq!(table.one::<u32>("pairs"), Ok(1));
    let pairs = DiagonalRule {
        diagonal: PairKind::Pointwise,
    };
    let g = table.slice("source").unwrap();
    let neighbour = Piecewise::with_pointwise(&polynomials, &polynomials, pairs, v, g).unwrap();
    walk(&circle, &neighbour, start)
}

/// K(x,y) = ½/(1 + x₁ + y₂) and F = 1, without a function whose last bit a library might change.
#[derive(Clone, Copy)]
struct Fraction;

impl<F: Real> KernelFn<F, 2> for Fraction {
    fn kernel(&self, x: &[F; 2], y: &[F; 2]) -> F {
        F::from_f64(0.5) / (F::one() + x[0] + y[1])
    }
}

impl<F: Real> ScalarField<F, 2> for Fraction {
    fn value(&self, _: &[F; 2]) -> F {
        F::one()
    }
}

/// ½/(1 + x + y) along the first axis, 1/(1 + x + y) along the second.
#[derive(Clone, Copy)]
struct Fractions;

impl<F: Real> KernelFn<F, 2> for Fractions {
    fn kernel(&self, x: &[F; 2], y: &[F; 2]) -> F {
        let factor = |scale: f64, axis: usize| F::from_f64(scale) / (F::one() + x[axis] + y[axis]);
        factor(0.5, 0) * factor(1.0, 1)
    }
}

/// What a device makes of a cube's table with B functions on a cell: u(0.3, 0.6).
fn cube<F: Real + FromBytes + Immutable, const B: usize>(bytes: &[u8]) -> Statistics {
    let table = Table::read(bytes, "cube").unwrap();
    let &[2, per_axis] = table.slice::<u32>("axes").unwrap() else {
        panic!("two dimensions")
    };
    let per_axis = per_axis as usize;
    let start = [F::from_f64(0.3), F::from_f64(0.6)];
    let absorption = table.one("absorb").unwrap();
    let (v, g) = (table.slice("v").unwrap(), table.slice("source").unwrap());
    let pairs = DiagonalRule {
        diagonal: PairKind::Galerkin,
    };
    if table.has("factors") {
        let flat = Cube::new(Fractions, Fraction, per_axis, absorption).unwrap();
        let cube = flat.with_functions::<B>();
        assert_eq!(table.one::<u32>("degree"), Ok(cube.degree() as u32));
        let factors = table.slice("factors").unwrap();
        let factors = FactorTables::<f64, 2, B>::of_functions(per_axis, factors).unwrap();
        let rounded = Rounded::new(&factors);
        return walk(
            &flat,
            &Piecewise::new(&cube, &rounded, pairs, v, g).unwrap(),
            start,
        );
    }
    let flat = Cube::new(Fraction, Fraction, per_axis, absorption).unwrap();
    let cube = flat.with_functions::<B>();
    assert_eq!(table.one::<u32>("degree"), Ok(cube.degree() as u32));
    if B == 1 {
        // In the walk's own scalar.
        let dense = Dense::new(table.slice::<F>("coeffs").unwrap(), v.len(), 1).unwrap();
        return walk(
            &flat,
            &Piecewise::new(&cube, &dense, pairs, v, g).unwrap(),
            start,
        );
    }
    let entries = table.slice::<f64>("coeffs").unwrap();
    let dense = Dense::new(entries, v.len() / B, B).unwrap();
    let rounded = Rounded::new(&dense);
    walk(
        &flat,
        &Piecewise::new(&cube, &rounded, pairs, v, g).unwrap(),
        start,
    )
}

/// The same of a room's: u in the middle of its first wall.
fn room<F: Real + FromBytes + Immutable>(bytes: &[u8]) -> Statistics {
    let table = Table::read(bytes, "room").unwrap();
    let table = RoomTable::<F>::read(&table).unwrap();
    let (room, pairs) = (table.room().unwrap(), table.pairs().unwrap());
    let dense = table.coefficients::<1>().unwrap();
    let neighbour = Piecewise::with_pointwise(&room, &dense, pairs, table.v, table.source).unwrap();
    let start = table.point(&room, 0, 0.5).unwrap();
    walk(&room, &neighbour, start)
}

/// The same with B functions on a cell, more than one.
fn room_of_degree<F: Real + FromBytes + Immutable, const B: usize>(bytes: &[u8]) -> Statistics {
    let table = Table::read(bytes, "room").unwrap();
    let table = RoomTable::<F, f64>::read(&table).unwrap();
    let (room, pairs) = (table.room().unwrap(), table.pairs().unwrap());
    let polynomials = room.with_functions::<B>();
    // A table is of one degree.
    assert!(table.coefficients::<1>().is_none());
    let dense = table.coefficients::<B>().unwrap();
    let rounded = Rounded::new(&dense);
    let neighbour =
        Piecewise::with_pointwise(&polynomials, &rounded, pairs, table.v, table.source).unwrap();
    let start = table.point(&room, 0, 0.5).unwrap();
    walk(&room, &neighbour, start)
}

/// A room without pairs, of degree B − 1.
fn room_of_rays<F: Real + FromBytes + Immutable, const B: usize>(bytes: &[u8]) -> Statistics {
    let table = Table::read(bytes, "room").unwrap();
    let control = room_table::rays(&table).unwrap();
    let table = RoomTable::<F>::read(&table).unwrap();
    assert_eq!(
        (table.degree, table.pairs().is_none()),
        (B as u32 - 1, true)
    );
    let room = table.room().unwrap();
    let polynomials = room.with_functions::<B>();
    let neighbour = RayNeighbour::new(&polynomials, table.v, control).unwrap();
    walk(&room, &neighbour, table.point(&room, 0, 0.5).unwrap())
}

/// The neighbour equation by its address: the compiler makes one walk of an equation, whatever its degree.
fn walk<E: Equation>(
    equation: &E,
    neighbour: &dyn Neighbour<Scalar = E::Scalar, Point = E::Point>,
    start: E::Point,
) -> Statistics {
    let task = Task {
        equation,
        neighbour,
        functional: &At(start),
        control_mean: Some(neighbour.value(&neighbour.locate(start)).to_f64()),
        estimator: Estimator::Absorption,
        form: Form::Residual,
        seeds: <WalkSeeds>::new(1, 0),
        length: Length::default(),
    };
    finish(task)
}

fn finish<E: Equation, N: NeighbourOf<E> + ?Sized, T: Functional<E>>(
    task: Task<'_, E, N, T, DefaultGenerator>,
) -> Statistics {
    let mut options = RunOptions::new(walks());
    options.batch = 512;
    let mut driver = Driver::new(task, options).unwrap();
    driver.poll(u64::MAX).unwrap();
    driver.statistics()
}

/// The walks of a comparison, two stages at least. Devices walk slowly here, where nothing is optimised.
fn walks() -> u64 {
    if is_long() { 20_000 } else { 5000 }
}

const ALL_PAIRS: [&str; 3] = ["default", "paper", "pointwise"];

/// What a device makes of a table in f32 and in f64.
type Device = [fn(&[u8]) -> Statistics; 2];

/// The estimates of the program for the first target of `problem`, which says pairs = "default" and
/// scalar = "f64", and those of a device, for these pairs and both scalars.
fn compare(problem: &str, all_pairs: &[&str], device: Device) {
    for &pairs in all_pairs {
        for (scalar, device) in ["f32", "f64"].into_iter().zip(device) {
            let mut problem = problem.replace("walks = 20000", &format!("walks = {}", walks()));
            for (key, default, value) in [("pairs", "default", pairs), ("scalar", "f64", scalar)] {
                let old = format!("{key} = \"{default}\"");
                assert!(problem.contains(&old));
                problem = problem.replace(&old, &format!("{key} = \"{value}\""));
            }
            let folder = Folder::new();
            let solved = folder.solve(&problem, &["--json"]);
            // In f32 high degrees warn of rounding.
            let solved = solved.warning(0, &[]).json();
            let solved = &list(&solved, "targets")[0];
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
    compare(common::CIRCLE, &ALL_PAIRS, [circle::<f32>, circle::<f64>]);
}

#[test]
fn a_device_with_an_exported_circle_of_any_degree_has_the_programs_bits() {
    fn check<const B: usize>() {
        let problem = circle_with("degree = 0", &format!("degree = {}", B - 1));
        let device: Device = [circle_of_degree::<f32, B>, circle_of_degree::<f64, B>];
        compare(&problem, &["default", "pointwise"], device);
    }
    check::<2>();
    check::<3>();
    check::<4>();
    check::<5>();
}

#[test]
fn a_device_with_an_exported_cube_of_any_degree_has_the_programs_bits() {
    fn check<const B: usize>(degree: usize) {
        for kernel in [
            "kernel = '0.5 / (1 + x1 + y2)'",
            "kernel_factors = ['0.5 / (1 + x + y)', '1 / (1 + x + y)']",
        ] {
            let problem = format!(
                "[problem]\nkind = 'cube'\ndimension = 2\n{kernel}\nsource = '1'\n\
                 [galerkin]\ncells = 2\ndegree = {degree}\npairs = \"default\"\n\
                 [walk]\nwalks = 20000\nbatch = 512\nscalar = \"f64\"\n\
                 [[target]]\nname = 'point'\nat = [0.3, 0.6]\n"
            );
            compare(&problem, &["default"], [cube::<f32, B>, cube::<f64, B>]);
        }
    }
    check::<1>(0);
    check::<{ functions(2, 1) }>(1);
    check::<{ functions(2, 2) }>(2);
    check::<{ functions(2, 3) }>(3);
    check::<{ functions(2, 4) }>(4);
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
    compare(&problem, &ALL_PAIRS, [room::<f32>, room::<f64>]);
}

#[test]
fn a_device_with_an_exported_room_of_any_degree_has_the_programs_bits() {
    fn check<const B: usize>(file: &str) {
        let problem = fs::read_to_string(Path::new(TABLES).join(file)).unwrap();
        let target = "[[target]]\nname = \"mean\"\nover = \"all\"\n";
        let mut problem = problem.replace(
            target,
            "batch = 512\nwalks = 20000\n[[target]]\nname = \"point\"\n\
             at = { surface = \"floor\", t = 0.5 }\n",
        );
        let degree = "degree = 3";
        assert!(problem.contains(degree) && problem.contains("walks"));
        problem = problem.replace(degree, &format!("degree = {}", B - 1));
        let device: Device = [room_of_degree::<f32, B>, room_of_degree::<f64, B>];
        compare(&problem, &ALL_PAIRS, device);
    }
    let file = "room_cubic_f64.toml";
    check::<2>(file);
    check::<3>(file);
    check::<4>(file);
    check::<5>(file);
}

#[test]
fn a_device_with_rays_has_the_programs_bits() {
    let file = Path::new(TABLES).join("room_cubic_f64.toml");
    let problem = fs::read_to_string(file).unwrap().replace(
        "[[target]]\nname = \"mean\"\nover = \"all\"\n",
        "batch = 512\nwalks = 20000\n[[target]]\nname = \"point\"\n\
         at = { surface = \"floor\", t = 0.5 }\n",
    );
    let problem = |degree| problem.replace("degree = 3", &format!("degree = {degree}"));
    let rays = &["rays"];
    compare(
        &problem(0),
        rays,
        [room_of_rays::<f32, 1>, room_of_rays::<f64, 1>],
    );
    compare(
        &problem(2),
        rays,
        [room_of_rays::<f32, 3>, room_of_rays::<f64, 3>],
    );
}

/// What a device makes of a scene's table with B functions on a cell: u on the floor, with its last step to the light.
fn scene<F: Real + FromBytes + Immutable, const B: usize>(bytes: &[u8]) -> Statistics {
    let table = Table::read(bytes, "scene").unwrap();
    let table = SceneTable::<F>::read(&table).unwrap();
    let radiosity = table.radiosity().unwrap();
    let sampled = table.neighbour::<B>(&radiosity).unwrap();
    let last = LastStep(&radiosity);
    let (equation, neighbour) = (WithKnown(&last), WithKnown(&sampled));
    let start = KnownPart {
        functional: At(radiosity.at(0, [0.3, 0.6, 0.0]).unwrap()),
        known: radiosity.emission_of_light(0),
    };
    let at = neighbour.locate(Started {
        point: start.functional.0,
        known: start.known,
    });
    let control_mean = Some(neighbour.value(&at).to_f64());
    let neighbour: &dyn Neighbour<Scalar = F, Point = _> = &neighbour;
    finish(Task {
        equation: &equation,
        neighbour,
        functional: &start,
        control_mean,
        estimator: Estimator::Collision,
        form: Form::Residual,
        seeds: <WalkSeeds>::new(1, 0),
        length: Length::default(),
    })
}

#[test]
fn a_device_with_an_exported_scene_has_the_programs_bits() {
    fn check(degree: usize, device: Device) {
        let file = Path::new(TABLES).join("scene_linear_f32.toml");
        let mut problem = fs::read_to_string(file).unwrap();
        for (old, new) in [
            (
                "degree = 1",
                format!("degree = {degree}\npairs = \"default\""),
            ),
            (
                "scalar = \"f32\"",
                "scalar = \"f64\"\nlast_step = true".to_owned(),
            ),
            (
                "[[target]]\nname = \"walls\"\nover = \"walls\"\n",
                "batch = 512\nwalks = 20000\n[[target]]\nname = \"point\"\nat = [0.3, 0.6, 0]\n"
                    .to_owned(),
            ),
        ] {
            assert!(problem.contains(old));
            problem = problem.replace(old, &new);
        }
        compare(&problem, &["default"], device);
    }
    check(0, [scene::<f32, 1>, scene::<f64, 1>]);
    check(1, [scene::<f32, 3>, scene::<f64, 3>]);
    check(2, [scene::<f32, 6>, scene::<f64, 6>]);
}

#[test]
fn a_scene_with_other_light_than_that_of_its_surfaces_is_not_exported() {
    let file = Path::new(TABLES).join("scene_f64.toml");
    let problem = fs::read_to_string(file).unwrap();
    let folder = Folder::new();
    let lamp = "[[problem.light]]\nat = [0.5, 0.5, 0.5]\nintensity = 1\n\n[galerkin]";
    let file = folder.file("lamp.toml", problem.replace("[galerkin]", lamp));
    let ran = fredholm(&["export", &file, "-o", &folder.at("lamp.bin")]);
    assert_eq!(ran.status, Some(2), "{ran:?}");
    assert!(
        ran.stderr.contains("leave `sky` and `light` out"),
        "{ran:?}"
    );
    assert_eq!(folder.names(), ["lamp.toml"]);
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
    let few = folder.file(
        "c.toml",
        circle_with("degree = 0", "degree = 1").replace("\"default\"", "\"paper\""),
    );
    let ran = fredholm(&["export", &few, "-o", &folder.at("c.bin")]);
    assert_eq!(ran.status, Some(2), "{ran:?}");
    assert!(ran.stderr.contains("steps within a cell"), "{ran:?}");
    assert_eq!(folder.names(), ["a.toml", "b.toml", "c.toml"]);
}
