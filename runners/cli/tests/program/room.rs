//! `kind = "room"`, decks and form factors, against published numbers.

use crate::common;

use common::{Folder, assert_svg, example, fredholm, is_long, list, number, refused};
use fredholm_room::Material;
use fredholm_tests::room::{Drawing, Published, SQUARE_VALUE, published, square};

const EXAMPLES: [&str; 4] = [
    "furnished.toml",
    "doorway.toml",
    "furnace.toml",
    "facet.toml",
];

/// A drawing as a problem file, its surfaces called S1, S2, ….
fn file_of(drawing: &Drawing) -> String {
    let mut text = "[problem]\nkind = 'room'\n".to_owned();
    for (i, (points, materials)) in drawing.surfaces.iter().enumerate() {
        let numbers = |of: fn(&Material) -> f64| materials.iter().map(of).collect::<Vec<_>>();
        text += &format!(
            "[[problem.surface]]\nname = 'S{}'\npoints = {points:?}\nreflectance = {:?}\n\
             emission = {:?}\n",
            i + 1,
            numbers(|m| m.reflectance),
            numbers(|m| m.emission),
        );
    }
    text + "[[target]]\nname = 'all'\nover = 'all'\n"
}

/// The table of `factors --json`, each row of which sums to 1 without being normalised.
fn factors(path: &str) -> Vec<Vec<f64>> {
    let json = fredholm(&["factors", path, "--json"]).quietly(0).json();
    let row = |row: &serde_json::Value| -> Vec<f64> {
        let row = row.as_array().unwrap();
        row.iter().map(|f| f.as_f64().unwrap()).collect()
    };
    let rows: Vec<_> = list(&json, "factors").iter().map(row).collect();
    let expected: Vec<String> = (1..=rows.len()).map(|i| format!("S{i}")).collect();
    let surfaces = list(&json, "surfaces");
    let names: Vec<_> = surfaces.iter().map(|s| s.as_str().unwrap()).collect();
    assert_eq!(names, expected);
    for row in &rows {
        let sum: f64 = row.iter().sum();
        assert!((sum - 1.0).abs() < 1e-7, "{sum}");
    }
    rows
}

/// To nine digits, with occlusion and without; of FACET from its deck, too.
#[test]
fn factors_are_the_published_ones() {
    let folder = Folder::new();
    let close = |path: &str, published: &Published| {
        let rows = factors(path);
        for (found, expected) in rows[published.row].iter().zip(published.factors.iter()) {
            let difference = (found - expected).abs();
            assert!(difference < 1e-9, "{path}: {found} {expected}");
        }
    };
    for published in published() {
        let drawing = &published.drawing;
        close(&folder.file("room.toml", file_of(drawing)), &published);
        if drawing.name == "FACET" {
            close(&example("facet.vs2"), &published);
        }
    }
    // The file with the deck has the same factors, and the table prints them.
    let table = fredholm(&["factors", &example("facet.toml")])
        .quietly(0)
        .stdout;
    assert!(
        table.contains("0.259688") && table.contains("1.000000"),
        "{table}"
    );
}

/// An example in which every surface has a reflectance ρ of its own and emits 1 − ρ.
fn glowing(name: &str) -> String {
    let text = std::fs::read_to_string(example(name)).unwrap();
    let mut glowing = String::new();
    let mut surfaces = 0;
    let mut material = || {
        surfaces += 1;
        let reflectance = 0.15 + 0.7 * (f64::from(surfaces) * 0.618).fract();
        format!(
            "reflectance = {reflectance}\nemission = {}\n",
            1.0 - reflectance
        )
    };
    let own = ["reflectance", "emission", "emissivity", "temperature"];
    let kept = text
        .lines()
        .filter(|line| !own.iter().any(|key| line.starts_with(key)));
    // What is asked for there takes long; and a deck's surfaces are not all named.
    for line in kept.take_while(|line| *line != "[galerkin]" && *line != "[[target]]") {
        let deck = line.starts_with("deck =");
        if deck {
            glowing += &format!("deck = {:?}\n", example("facet.vs2"));
            for i in 1..=12 {
                glowing += &format!("[[problem.surface]]\nname = 'S{i}'\n{}", material());
            }
        } else if line.starts_with("points") {
            glowing += &format!("{}{line}\n", material());
        } else if name != "facet.toml" || line.contains("problem]") || line.starts_with("kind") {
            glowing += &format!("{line}\n");
        }
    }
    glowing + "[[target]]\nname = 'all'\nover = 'all'\n"
}

/// u = 1 in every closed room with F = 1 − ρ, for any ρ: four standard errors, rays and pairs; of 48 comparisons one is off by chance
/// once in 320 seeds.
#[test]
fn every_example_is_a_furnace_if_it_glows() {
    let folder = Folder::new();
    for name in EXAMPLES {
        let problem = glowing(name);
        let point = if name == "facet.toml" { "S5" } else { "all" };
        // The mean, over all and over a surface, and a point of it.
        let surface = match point {
            "S5" => "S5".to_owned(),
            _ => problem
                .split("name = \"")
                .nth(1)
                .unwrap()
                .split('"')
                .next()
                .unwrap()
                .to_owned(),
        };
        let problem = format!(
            "{problem}[[target]]\nname = 'one'\nover = {surface:?}\n[[target]]\nname = 'point'\n\
             at = {{ surface = {surface:?}, t = 0.37 }}\n"
        );
        for (pairs, walks) in [("rays", "5000"), ("pointwise", "1000")] {
            let args = ["--json", "--cells", "60", "--degree", "1"];
            let args = [&args[..], &["--pairs", pairs, "--walks", walks]].concat();
            let json = folder.solve(&problem, &args).quietly(0).json();
            let targets = list(&json, "targets");
            assert_eq!(targets.len(), 3);
            for target in targets {
                for key in ["plain", "preconditioned"] {
                    let found = &target[key];
                    let allowed =
                        4.0 * number(found, "std_error") + number(target, "rounding_floor");
                    let difference = (number(found, "estimate") - 1.0).abs();
                    assert!(difference <= allowed, "{name}, {pairs}, {key}: {target}");
                }
                assert!(number(&target["preconditioned"], "std_error") > 0.0);
            }
        }
    }
}

/// A screen in the middle of a square, whose tips are in line with x = ½: there its shadow ends for
/// a lamp on the left wall's side. With cuts a cell ends there, on the floor and on the ceiling.
#[test]
fn walls_are_cut_at_shadows_where_that_is_asked_for() {
    let problem = |shadow_cuts: &str| {
        let drawing = Drawing::new("screen")
            .line(&[[0.0, 0.0], [1.0, 0.0]], 0.5, 0.0)
            .line(&[[1.0, 0.0], [1.0, 1.0]], 0.5, 0.0)
            .line(&[[1.0, 1.0], [0.0, 1.0]], 0.5, 0.0)
            .line(&[[0.0, 1.0], [0.0, 0.0]], 0.5, 1.0)
            .baffle([0.5, 0.3], [0.5, 0.7], 0.5);
        // Five equal cells a side: the middle of none of them is an end.
        let at =
            |t: f64| format!("[[target]]\nname = 'at {t}'\nat = {{ surface = 'S1', t = {t} }}\n");
        format!(
            "{}{}{}[galerkin]\ncells = 24\ndegree = 0\ngrading = 1\n{shadow_cuts}\n[walk]\nwalks = 1000\nlast_step = false\n",
            file_of(&drawing),
            // The line from the lamp's upper end past the screen's lower one meets the floor at
            // 5/7.
            at(0.7),
            at(0.73),
        )
    };
    let folder = Folder::new();
    let solved = |shadow_cuts: &str| {
        let json = folder
            .solve(&problem(shadow_cuts), &["--json"])
            .quietly(0)
            .json();
        let targets = list(&json, "targets");
        let [left, right] = [1, 2].map(|i| number(&targets[i], "galerkin"));
        (number(&json, "unknowns"), left, right)
    };
    let (without, left, right) = solved("");
    assert_eq!((without, left), (24.0, right));
    assert_eq!(solved("shadow_cuts = false"), (without, left, right));
    let (with, left, right) = solved("shadow_cuts = true");
    // Two more are at 2/5 and 3/5 of the right wall, where cells end anyway.
    assert_eq!(with, 26.0);
    assert!(left > 1.05 * right, "{left} {right}");
    let path = folder.file("cuts.toml", problem("shadow_cuts = true"));
    let check = fredholm(&["check", &path]).quietly(0).stdout;
    assert!(check.contains("26 (24 requested)"), "{check}");
    refused(
        &folder.solve(
            &common::circle_with("degree = 0", "shadow_cuts = true"),
            &[],
        ),
        &["problem.toml:8:", "`shadow_cuts` belongs to rooms"],
    );
}

#[test]
fn the_square_has_its_known_value() {
    let folder = Folder::new();
    let problem = file_of(&square())
        + "[galerkin]\ncells = 200\ndegree = 0\n[walk]\nwalks = 40000\n\
           [[target]]\nname = 'point'\nat = { surface = 'S1', t = 0.37 }\n";
    for (seed, scalar) in [("1", "f64"), ("2", "f64"), ("3", "f64"), ("1", "f32")] {
        for pairs in ["rays", "pointwise"] {
            let args = [
                "--json", "--seed", seed, "--scalar", scalar, "--pairs", pairs,
            ];
            let walks = if pairs == "pointwise" {
                "2000"
            } else {
                "40000"
            };
            let json = folder
                .solve(&problem, &[&args[..], &["--walks", walks]].concat())
                .quietly(0)
                .json();
            let target = &list(&json, "targets")[1];
            for estimate in ["plain", "preconditioned"] {
                let found = &target[estimate];
                let allowed = 4.5 * number(found, "std_error") + number(target, "rounding_floor");
                let difference = number(found, "estimate") - SQUARE_VALUE;
                assert!(difference.abs() <= allowed, "{pairs}, {estimate}: {target}");
            }
            // u = F + ρ H.
            let h = &target["irradiance"];
            let u = &target["preconditioned"];
            assert!((0.3 * number(h, "estimate") - number(u, "estimate")).abs() < 1e-14);
        }
    }
}

#[test]
fn every_example_runs_and_its_bits_do_not_depend_on_threads() {
    for name in EXAMPLES {
        let run = |threads: &str| {
            let args = [
                "solve",
                &example(name),
                "--json",
                "--cells",
                "200",
                "--walks",
                "500",
                "--threads",
                threads,
            ];
            fredholm(&args).quietly(0)
        };
        let one = run("1");
        assert_eq!(one.timeless(), run("2").timeless(), "{name}");
        for target in list(&one.json(), "targets") {
            assert!(
                number(&target["irradiance"], "estimate") > 0.0,
                "{name}: {target}"
            );
        }
    }
}

/// Everything emits 1 − ρ: the radiosity and the irradiance are 1 everywhere, and nothing flows.
/// Every degree, scalar and choice of pairs; walls are cut at shadows without being asked, of which
/// this room has none.
#[test]
fn the_square_has_its_known_value_at_every_degree() {
    let folder = Folder::new();
    let problem = file_of(&square())
        + "[galerkin]\ncells = 80\n[walk]\nwalks = 4000\n\
           [[target]]\nname = 'point'\nat = { surface = 'S1', t = 0.37 }\n";
    for degree in ["1", "2", "3", "4"] {
        for (scalar, pairs) in [("f64", "rays"), ("f32", "rays"), ("f64", "pointwise")] {
            let args = ["--json", "--degree", degree, "--scalar", scalar];
            let args = [&args[..], &["--pairs", pairs]].concat();
            // In f32 there may be a warning that rounding is what is left.
            let ran = folder.solve(&problem, &args);
            assert_eq!(ran.status, Some(0), "{ran:?}");
            let json = ran.json();
            assert_eq!(number(&json, "degree").to_string(), degree);
            let functions = number(&json, "degree") + 1.0;
            assert_eq!(number(&json, "unknowns"), 80.0 * functions);
            let target = &list(&json, "targets")[1];
            for estimate in ["plain", "preconditioned"] {
                let found = &target[estimate];
                let allowed = 4.5 * number(found, "std_error") + number(target, "rounding_floor");
                let difference = number(found, "estimate") - SQUARE_VALUE;
                assert!(
                    difference.abs() <= allowed,
                    "{args:?}, {estimate}: {target}"
                );
            }
            if scalar == "f64" && pairs == "rays" {
                let [plain, best] =
                    ["plain", "preconditioned"].map(|name| number(&target[name], "std_error"));
                assert!(best < plain / 30.0, "{degree}: {plain} {best}");
            }
        }
    }
    let path = folder.file(
        "square.toml",
        problem.replace("cells = 80", "cells = 80\ndegree = 2"),
    );
    let check = fredholm(&["check", &path]).quietly(0).stdout;
    assert!(check.contains("unknowns   240"), "{check}");
    let picture = folder.at("square.png");
    fredholm(&["render", &path, "--width", "250", "-o", &picture]).quietly(0);
    refused(
        &folder.solve(&problem, &["--degree", "5"]),
        &["--degree 5", "from 0 to 4 in a room"],
    );
}

#[test]
fn a_furnace_is_in_balance() {
    let folder = Folder::new();
    let sigma = 5.670374419e-8;
    let whole = sigma * 300.0_f64.powi(4);
    let surface = |name: &str, points: &str, emissivity: f64| {
        format!(
            "[[problem.surface]]\nname = '{name}'\npoints = {points}\nemissivity = {emissivity}\n\
             temperature = 300\n"
        )
    };
    let problem = [
        "[problem]\nkind = 'room'\n".to_owned(),
        surface("floor", "[[0, 0], [2, 0]]", 0.3),
        surface("black", "[[2, 0], [2, 1]]", 1.0),
        surface("rest", "[[2, 1], [0, 1], [0, 0]]", 0.6),
        surface(
            "block",
            "[[0.8, 0.4], [0.8, 0.6], [1.2, 0.6], [1.2, 0.4], [0.8, 0.4]]",
            0.8,
        ),
        "[galerkin]\ncells = 200\ndegree = 1\n[walk]\nwalks = 20000\n\
         [[target]]\nname = 'black'\nover = 'black'\n[[target]]\nname = 'all'\nover = 'all'\n\
         [[target]]\nname = 'p'\nat = { surface = 'black', t = 0.3 }\n"
            .to_owned(),
    ]
    .concat();
    for seed in ["1", "2", "3"] {
        let ran = folder
            .solve(&problem, &["--json", "--seed", seed])
            .quietly(0);
        let json = ran.json();
        for target in list(&json, "targets") {
            for key in ["plain", "preconditioned", "irradiance"] {
                let found = &target[key];
                let allowed = 4.5 * number(found, "std_error") + 1e-10 * whole;
                let difference = (number(found, "estimate") - whole).abs();
                assert!(difference <= allowed, "{key}: {target}");
            }
        }
        let balance = &json["energy_balance"];
        let allowed = 4.5 * number(balance, "std_error") + 1e-9 * whole;
        assert!(number(balance, "estimate").abs() <= allowed, "{json}");
        for surface in list(&json, "surfaces") {
            let flux = &surface["net_flux"];
            let allowed = 4.5 * number(flux, "std_error") + 1e-9 * whole;
            assert!(number(flux, "estimate").abs() <= allowed, "{surface}");
        }
    }
    // 20,000 walks for each of three targets, for the fluxes of four surfaces, and for the irradiance of what is black, a
    // point, a mean and a surface, of which u does not tell.
    let check = fredholm(&["check", &folder.file("furnace.toml", &problem)]).quietly(0);
    assert!(check.stdout.contains("walks      200000\n"), "{check:?}");
    let table = folder.solve(&problem, &[]).quietly(0).stdout;
    for word in ["irradiance", "net flux", "W per metre", "all"] {
        assert!(table.contains(word), "{table}");
    }
}

/// A street of period 4 with a box on its ground and a screen of two sides, its walls and the sky all 1.
const STREET: &str = "[problem]\nkind = 'room'\nsky = { altitudes = [0, 20, 90], sectors = [1, 2], emission = 1 }\nperiod = 4\n\
    [[problem.surface]]\nname = 'street'\npoints = [[0, 2.5], [0, 0], [3, 0], [3, 1.5], [4, 2.5]]\nreflectance = 0.4\nemission = 0.6\n\
    [[problem.surface]]\nname = 'box'\npoints = [[0.7, 0.1], [0.7, 0.8], [1.2, 0.8], [1.2, 0.1], [0.7, 0.1]]\nreflectance = 0\nemission = 1\n\
    [[problem.surface]]\nname = 'screen'\ntwo_sided = true\npoints = [[1.6, 0.6], [2.5, 1.1]]\nreflectance = 0.7\nemission = 0.3\n\
    [galerkin]\ncells = 20\ndegree = 1\n[walk]\nwalks = 200\n\
    [[target]]\nname = 'box'\nover = 'box'\n[[target]]\nname = 'back'\nover = 'screen (back)'\n\
    [[target]]\nname = 'point'\nat = { surface = 'street', t = 0.3 }\n";

/// All that is seen is 1, in every way of walks, between the walls of another period, too.
#[test]
fn a_street_is_a_furnace_under_its_sky() {
    let folder = Folder::new();
    let air = "[[target]]\nname = 'air'\nat = [5.4, 0.5]\n";
    let file = [STREET, air].concat();
    let coloured = file.replace("period = 4", "period = 4\nchannels = ['a', 'b']");
    for (file, options) in [
        (&file, &["--pairs", "rays"][..]),
        (&file, &["--pairs", "pointwise"]),
        (&file, &["--global"]),
        (&coloured, &["--pairs", "pointwise", "--last-step", "true"]),
    ] {
        let args = [options, &["--json"]].concat();
        let ran = folder.solve(file, &args);
        assert_eq!(ran.status, Some(0), "{ran:?}");
        for target in list(&ran.json(), "targets") {
            let mut count = 0;
            let is_sum = target["name"]
                .as_str()
                .is_some_and(|name| name.ends_with(" sum"));
            let exact = if is_sum { 2.0 } else { 1.0 };
            // Of a global estimate the target itself.
            for own in [target, &target["preconditioned"], &target["irradiance"]] {
                let Some(found) = own["estimate"].as_f64() else {
                    continue;
                };
                let error = own["std_error"].as_f64().unwrap_or(0.0);
                // Integrals over kinks are as good as that.
                let allowed = 4.5 * error + 2e-6;
                assert!((found - exact).abs() <= allowed, "{options:?}: {target}");
                count += 1;
            }
            assert!(count > 0, "{target}");
        }
    }
    // Rows sum to 1 with the sky: of its three patches, and of what is below the horizon, which nothing sees.
    let path = folder.file("street.toml", STREET);
    let json = fredholm(&["factors", &path, "--json"]).quietly(0).json();
    let rows = list(&json, "factors")
        .iter()
        .zip(list(&json["sky"], "factors"));
    let mut all = 0.0;
    for (row, sky) in rows {
        let sum = |row: &serde_json::Value| -> f64 {
            let row = row.as_array().unwrap();
            row.iter().map(|f| f.as_f64().unwrap()).sum()
        };
        assert_eq!(sky.as_array().unwrap().len(), 3);
        assert!((sum(row) + sum(sky) - 1.0).abs() < 1e-12, "{row} {sky}");
        all += sum(sky);
    }
    assert!(all > 1.0, "{all}");
    assert_eq!(
        json["sky"]["below"],
        serde_json::json!([0.0, 0.0, 0.0, 0.0])
    );
}

/// In a street of black walls what falls on the ground is that of the form factor, √(1 + h²) − h, and of the part that the sun reaches. With
/// walls that reflect all ways of walks agree.
#[test]
fn a_street_in_the_sun() {
    let folder = Folder::new();
    let file = |reflectance: f64| {
        let surface = |name: &str, points: &str| {
            format!(
                "[[problem.surface]]\nname = '{name}'\npoints = {points}\nreflectance = {reflectance}\n"
            )
        };
        let start = "[problem]\nkind = 'room'\nperiod = 2\nsky = { emission = 100 }\n\
            [[problem.light]]\ntowards = [1, 2]\nirradiance = 900\n";
        let walls = [
            surface("west", "[[0, 1], [0, 0]]"),
            surface("ground", "[[0, 0], [1, 0]]"),
            surface("east", "[[1, 0], [1, 1], [2, 1]]"),
        ];
        let end = "[galerkin]\ncells = 30\ndegree = 1\n[walk]\nwalks = 2000\n\
            [[target]]\nname = 'ground'\nover = 'ground'\nask = 'irradiance'\n";
        [start, &walls.concat(), end].concat()
    };
    let irradiance = |reflectance: f64, options: &[&str]| {
        let args = [options, &["--json"]].concat();
        let ran = folder.solve(&file(reflectance), &args);
        assert_eq!(ran.status, Some(0), "{ran:?}");
        let json = ran.json();
        let target = &list(&json, "targets")[0];
        let own = match target["estimate"].is_number() {
            true => target,
            false => &target["preconditioned"],
        };
        [
            number(own, "estimate"),
            own["std_error"].as_f64().unwrap_or(0.0),
        ]
    };
    let exact = 100.0 * (2f64.sqrt() - 1.0) + 900.0 * 0.5 * 2.0 / 5f64.sqrt();
    for options in [&["--pairs", "rays"][..], &["--global"]] {
        let [found, error] = irradiance(0.0, options);
        assert!(
            (found - exact).abs() < 4.5 * error + 1e-3,
            "{options:?} {found} ± {error}"
        );
    }
    let [rays, of_rays] = irradiance(0.6, &["--pairs", "rays"]);
    assert!(rays > exact + 50.0, "{rays}");
    for options in [&["--pairs", "pointwise"][..], &["--global"]] {
        let [found, error] = irradiance(0.6, options);
        let allowed = 4.5 * (error * error + of_rays * of_rays).sqrt() + 1e-3;
        assert!(
            (found - rays).abs() < allowed,
            "{options:?} {found} {rays} {allowed}"
        );
    }
}

/// What belongs to other rooms, or is none, is said.
#[test]
fn skies_and_periods_that_are_refused() {
    let folder = Folder::new();
    for (from, to, words) in [
        (
            "sky = {",
            "open = false\nsky = {",
            "a closed room has no sky",
        ),
        ("sectors = [1, 2]", "sectors = [1, 3]", "has 1 sector, or 2"),
        ("period = 4", "period = 0", "the period must be above 0"),
        ("period = 4", "period = 0.01", "not less than a hundredth"),
        (", emission = 1 }", " }", "this `sky` gives no light"),
        (
            "name = 'box'",
            "name = 'screen (back)'",
            "the back of a surface",
        ),
        (
            "period = 4",
            "light = [{ at = [1, 2], irradiance = 1 }]",
            "a lamp is a surface",
        ),
        (
            "period = 4",
            "light = [{ towards = [0, 0], irradiance = 1 }]",
            "not both 0",
        ),
        (
            "period = 4",
            "light = [{ towards = [0, 1], irradiance = -1 }]",
            "0 or more",
        ),
    ] {
        assert!(STREET.contains(from), "{from}");
        let file = STREET.replacen(from, to, 1);
        refused(&folder.solve(&file, &[]), &[words]);
    }
    let closed = STREET.replacen(
        "sky = { altitudes = [0, 20, 90], sectors = [1, 2], emission = 1 }\nperiod = 4",
        "light = [{ towards = [0, 1], irradiance = 1 }]",
        1,
    );
    refused(&folder.solve(&closed, &[]), &["open rooms alone"]);
    let method = STREET.replacen("degree = 1", "degree = 0", 1);
    refused(
        &folder.solve(&method, &["--method", "paper"]),
        &["without a period"],
    );
    let path = folder.file("street.toml", STREET);
    let table = folder.at("street.bin");
    refused(
        &fredholm(&["export", &path, "-o", &table]),
        &["leave `sky`, `light` and `period` out"],
    );
    refused(
        &fredholm(&["factors", &path, "--watts"]),
        &["leave `sky` out"],
    );
}

#[test]
fn the_template_runs_as_it_stands() {
    let template = fredholm(&["init", "room"]).quietly(0).stdout;
    let folder = Folder::new();
    let path = folder.file("room.toml", &template);
    fredholm(&["check", &path]).quietly(0);
    let table = fredholm(&["solve", &path, "--walks", "1000"])
        .quietly(0)
        .stdout;
    assert!(
        table.contains("under the table") && table.contains("profile[7]"),
        "{table}"
    );
    let svg = folder.at("profile.svg");
    folder
        .solve(&template, &["--walks", "1000", "--out", &svg])
        .quietly(0);
    assert_svg(svg.as_ref());
    let csv = folder.at("all.csv");
    folder
        .solve(&template, &["--walks", "1000", "--out", &csv])
        .quietly(0);
    let rows = common::csv_rows(csv.as_ref());
    assert_eq!(rows.len(), 11);
    let column = rows[0]
        .iter()
        .position(|name| name == "irradiance")
        .unwrap();
    assert!(rows[1][column].parse::<f64>().unwrap() > 0.0);
}

#[test]
fn bad_rooms_are_refused_at_their_place() {
    let template = fredholm(&["init", "room"]).quietly(0).stdout;
    let folder = Folder::new();
    let with = |from: &str, to: &str| {
        assert!(template.matches(from).count() >= 1, "{from}");
        folder.solve(
            &template.replacen(from, to, 1),
            &["--out", &folder.at("result.json")],
        )
    };
    let line = |text: &str| template.lines().position(|l| l.contains(text)).unwrap() + 1;
    let gap = line("[[1.5, 0.7], [1.5, 0.8]");
    refused(
        &with("[2.5, 0.7], [1.5, 0.7]]", "[2.5, 0.7]]"),
        &[
            &format!("problem.toml:{gap}:"),
            "surface \"table\"",
            "not closed",
            "open = true",
        ],
    );
    refused(
        &with("[[0, 0], [4, 0]]", "[[0, 0], [4, 0], [4, 0]]"),
        &["surface \"floor\", vertex 2", "no length"],
    );
    refused(
        &with("[[1.5, 0.7], [1.5, 0.8]", "[[1.5, -0.7], [1.5, 0.8]"),
        &["crosses", "surface \"floor\""],
    );
    refused(
        &with("[0.7, 0.6]", "[0.7, 0.6, 0.5]"),
        &["\"walls\"", "one for each"],
    );
    refused(&with("[0.7, 0.6]", "1.1"), &["at most 1", "1.1"]);
    refused(
        &with("over = \"floor\"", "over = \"flor\""),
        &["no surface \"flor\"", "mean \"floor\""],
    );
    refused(&with("t = 0.5", "t = 1.5"), &["from 0 to 1"]);
    refused(&with("surface = \"floor\"\n", ""), &["add `surface"]);
    refused(
        &with("name = \"lamp\"", "name = \"floor\""),
        &["second surface named \"floor\""],
    );
    refused(&with("name = \"lamp\"", "name = \"all\""), &["nor \"all\""]);
    refused(
        &with("# grading = 1.5", "grading = 0.5"),
        &["`grading` must be from 1"],
    );
    refused(
        &with("emission = 1.0", "emissivity = 0.5"),
        &["either `reflectance`"],
    );
    refused(
        &with("[[0, 0], [4, 0]]", "[[0, 0], [4]]"),
        &["two coordinates"],
    );
    refused(
        &with("# open = true", "deck = 'none.vs2'"),
        &["leave `points` out"],
    );
    assert_eq!(folder.names(), ["problem.toml"]);
    // A deck that is wrong is shown there.
    let deck = std::fs::read_to_string(example("facet.vs2")).unwrap();
    let path = folder.file(
        "bad.vs2",
        deck.replace("S  5        5  4", "S  5        5 44"),
    );
    refused(
        &fredholm(&["factors", &path]),
        &["bad.vs2:20:15", "no vertex 44"],
    );
    let path = folder.file("open.vs2", deck.replace("S 12        1 10", "! S 12"));
    refused(&fredholm(&["factors", &path]), &["not closed", "S1"]);
    refused(
        &fredholm(&["factors", &folder.at("none.vs2")]),
        &["cannot read"],
    );
    refused(
        &fredholm(&["factors", &folder.file("c.toml", common::CIRCLE)]),
        &["belong to rooms"],
    );
}

/// A round room of a million walls, or a hundred thousand without FREDHOLM_LONG in the environment:
/// more than there is memory for, which is said at once.
#[test]
fn more_surfaces_than_there_is_memory_for() {
    use core::fmt::Write;

    let long = is_long();
    let n = if long { 1_000_000 } else { 100_000 };
    let mut deck = "T round\nC 1 0 1e-4 8 0 1\nG 2\n".to_owned();
    for i in 0..n {
        let angle = core::f64::consts::TAU * f64::from(i) / f64::from(n);
        writeln!(deck, "V {i} {} {}", angle.cos(), angle.sin()).unwrap();
    }
    for i in 0..n {
        writeln!(deck, "S {i} {i} {} 0 0 0 0.9", (i + 1) % n).unwrap();
    }
    let folder = Folder::new();
    let path = folder.file("round.vs2", deck.clone() + "End of data\n");
    let words = ["surfaces need", "GB of memory"];
    refused(&fredholm(&["factors", &path]), &words);
    let file = "[problem]\nkind = 'room'\ndeck = 'round.vs2'\n[galerkin]\nshadow_cuts = true\n\
                [[target]]\nname = 'all'\nover = 'all'\n";
    let words = ["unknowns need", "GB of memory"];
    refused(&folder.solve(file, &[]), &words);
    // And before the time that long slanted walls side by side would take.
    let mut file = "[problem]\nkind = 'room'\nopen = true\n".to_owned();
    for i in 0..n {
        let x = f64::from(i) / f64::from(n);
        let points = [[x, 0.0], [x + 10.0, 10.0]];
        write!(
            file,
            "[[problem.surface]]\nname = '{i}'\npoints = {points:?}\n"
        )
        .unwrap();
        file += "reflectance = 0.5\n";
    }
    file += "[[target]]\nname = 'all'\nover = 'all'\n";
    refused(&folder.solve(&file, &[]), &words);
    if long {
        folder.file("round.vs2", deck + "S 1000000 1 2 0 0 0 0.9\nEnd of data\n");
        let words = ["round.vs2:2000004:1", "more than 1000000 surfaces"];
        refused(&fredholm(&["factors", &path]), &words);
    }
}

/// Through the program: a file that is no text, and one of each kind that is cut short.
#[test]
fn what_is_no_file_is_refused_with_status_2() {
    let folder = Folder::new();
    let template = fredholm(&["init", "room"]).quietly(0).stdout;
    let mut bytes = template.clone().into_bytes();
    let place = template.find("problem]").unwrap();
    bytes[place] = 0xff;
    let path = folder.file("bytes.toml", bytes);
    let line = template[..place].matches('\n').count() + 1;
    refused(
        &fredholm(&["check", &path]),
        &[&format!("bytes.toml:{line}:2: this is not UTF-8 text")],
    );
    let path = folder.file("cut.toml", &template[..template.len() / 2]);
    refused(&fredholm(&["solve", &path]), &["cut.toml:"]);
    let deck = std::fs::read_to_string(example("facet.vs2")).unwrap();
    let path = folder.file("cut.vs2", &deck[..deck.len() / 2]);
    refused(&fredholm(&["factors", &path]), &["cut.vs2:"]);
}
