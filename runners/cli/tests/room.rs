//! `kind = "room"`, decks and form factors, against published numbers.

mod common;

use std::path::{Path, PathBuf};

use common::{Folder, Ran, assert_svg, fredholm, list, number};

/// The folder of the examples.
fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples")
}

fn example(name: &str) -> String {
    examples().join(name).to_str().unwrap().to_owned()
}

fn refused(ran: &Ran, words: &[&str]) {
    assert_eq!(ran.status, Some(2), "{ran:?}");
    assert_eq!(ran.stdout, "", "{ran:?}");
    for word in words {
        assert!(ran.stderr.contains(word), "no {word:?}: {}", ran.stderr);
    }
}

/// FACET (UCID-19887, 1983): rows S1 and S5, to nine digits.
#[test]
fn factors_of_a_deck_are_the_published_ones() {
    let json = fredholm(&["factors", &example("facet.vs2"), "--json"])
        .quietly(0)
        .json();
    let names: Vec<_> = list(&json, "surfaces")
        .iter()
        .map(|s| s.as_str().unwrap())
        .collect();
    let expected: Vec<String> = (1..=12).map(|i| format!("S{i}")).collect();
    assert_eq!(names, expected);
    let rows = list(&json, "factors");
    let row = |i: usize| -> Vec<f64> {
        let row = rows[i].as_array().unwrap();
        row.iter().map(|f| f.as_f64().unwrap()).collect()
    };
    let s1 = [
        0.0,
        0.259687576257,
        0.0,
        0.0,
        0.007123828961,
        0.052163627192,
        0.0,
        0.062990978841,
        0.236067977500,
        0.052026984593,
        0.090266807444,
        0.239672219213,
    ];
    let s5 = [
        0.003561914480,
        0.0,
        0.238660722451,
        0.190983005625,
        0.0,
        0.190983005625,
        0.238660722451,
        0.0,
        0.003561914480,
        0.038532750784,
        0.056523213319,
        0.038532750784,
    ];
    for (found, expected) in [(row(0), s1), (row(4), s5)] {
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }
    for i in 0..12 {
        let sum: f64 = row(i).iter().sum();
        assert!((sum - 1.0).abs() < 1e-7, "row {i}: {sum}");
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

/// A square with ρ = .3 .6 .7 .5 and F = 0 1 0 0 has u(0.37, 0) = 0.160505386056 (graded Nyström, two
/// independent computations).
#[test]
fn the_square_has_its_known_value() {
    let folder = Folder::new();
    let problem = "[problem]\nkind = 'room'\n\
        [[problem.surface]]\nname = 'bottom'\npoints = [[0, 0], [1, 0]]\nreflectance = 0.3\n\
        [[problem.surface]]\nname = 'right'\npoints = [[1, 0], [1, 1]]\nreflectance = 0.6\nemission = 1\n\
        [[problem.surface]]\nname = 'top'\npoints = [[1, 1], [0, 1]]\nreflectance = 0.7\n\
        [[problem.surface]]\nname = 'left'\npoints = [[0, 1], [0, 0]]\nreflectance = 0.5\n\
        [galerkin]\ncells = 200\n[walk]\nwalks = 40000\n\
        [[target]]\nname = 'point'\nat = { surface = 'bottom', t = 0.37 }\n";
    for (seed, scalar) in [("1", "f64"), ("2", "f64"), ("3", "f64"), ("1", "f32")] {
        for pairs in ["default", "paper", "pointwise"] {
            let args = [
                "--json", "--seed", seed, "--scalar", scalar, "--pairs", pairs,
            ];
            let walks = if pairs == "pointwise" {
                "2000"
            } else {
                "40000"
            };
            let json = folder
                .solve(problem, &[&args[..], &["--walks", walks]].concat())
                .quietly(0)
                .json();
            let target = &list(&json, "targets")[0];
            for estimate in ["plain", "preconditioned"] {
                let found = &target[estimate];
                let allowed = 4.5 * number(found, "std_error") + number(target, "rounding_floor");
                let difference = number(found, "estimate") - 0.160505386056;
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
    for name in [
        "furnished.toml",
        "doorway.toml",
        "furnace.toml",
        "facet.toml",
    ] {
        let run = |threads: &str| {
            let args = [
                "solve",
                &example(name),
                "--json",
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
        fredholm(&["check", &example(name)]).quietly(0);
    }
}

/// Everything emits 1 − ρ: the radiosity and the irradiance are 1 everywhere, and nothing flows.
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
        "[galerkin]\ncells = 200\n[walk]\nwalks = 20000\n\
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
    let table = folder.solve(&problem, &[]).quietly(0).stdout;
    for word in ["irradiance", "net flux", "W per metre", "all"] {
        assert!(table.contains(word), "{table}");
    }
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
    refused(&with("[0.7, 0.6]", "1.0"), &["less than 1", "1.0"]);
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
        &with("grading = 3.0", "grading = 0.5"),
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
