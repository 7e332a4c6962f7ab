//! `domain`, grids, lists of points and known solutions.

use crate::common;

use common::{Folder, assert_svg, csv_rows, fredholm, list, number};

/// There are fewer than 100 comparisons: one is beyond this by chance in 10,000 sets of seeds.
const STANDARD_ERRORS: f64 = 4.9;

/// A cube's file: its `[problem]` without the kind, and what follows. It has 12 cells on a line and 4 by 4 in a square.
fn cube(problem: &str, rest: &str) -> String {
    let cells = if problem.contains("dimension = 1") {
        12
    } else {
        4
    };
    format!(
        "[problem]\nkind = 'cube'\n{problem}\n[galerkin]\ncells = {cells}\n[walk]\nwalks = 20000\n{rest}"
    )
}

const ALL: &str = "[[target]]\nname = 'low'\nat = LOW\n[[target]]\nname = 'inner'\nat = INNER\n\
                   [[target]]\nname = 'mean'\nover = 'all'\n[[target]]\nname = 'weighted'\nweight = 'WEIGHT'\n";

#[test]
fn a_domain_has_its_own_coordinates_and_measure() {
    let folder = Folder::new();
    // Equations, their points and weight, and u at these, its mean and its weighted integral.
    let line =
        "dimension = 1\nkernel = '0.05 * x * y^2'\nsource = 'x^2 - 0.33 * x'\nsolution = 'x^2'";
    let kink = "dimension = 1\nkernel = 'abs(x - y) / 4'\n\
                source = 'x - (x^3 / 3 - x) / 4'\nsolution = 'x'";
    let plane = "dimension = 2\nkernel = '0.5 * x1 * y1^2 * x2 * y2^2'\n\
                 source = '(x1 * x2)^2 - 0.020625 * x1 * x2'\nsolution = '(x1 * x2)^2'";
    let factors = plane.replace(
        "kernel = '0.5 * x1 * y1^2 * x2 * y2^2'",
        "kernel_factors = ['0.05 * x * y^2', '10 * x * y^2']",
    );
    let rectangle = ("[[-1, 2], [0, 0.5]]", "[-1, 0.5]", "[0.5, 0.25]", "x1 * x2");
    let of_rectangle = [0.25, 0.015625, 1.0 / 12.0, 3.75 / 64.0];
    let cases = [
        (line, ("[-1, 2]", "-1", "0.5", "x"), [1.0, 0.25, 1.0, 3.75]),
        (line, ("[[-1, 2]]", "2", "0.5", "x"), [4.0, 0.25, 1.0, 3.75]),
        // The mean is 0, which no two rules find to the same digits.
        (
            kink,
            ("[-1, 1]", "-1", "0.5", "x"),
            [-1.0, 0.5, f64::NAN, 2.0 / 3.0],
        ),
        (plane, rectangle, of_rectangle),
        (&factors, rectangle, of_rectangle),
    ];
    for (problem, (domain, low, inner, weight), expected) in cases {
        let targets = ALL
            .replace("LOW", low)
            .replace("INNER", inner)
            .replace("WEIGHT", weight);
        let text = cube(&format!("domain = {domain}\n{problem}"), &targets);
        let by = |method| folder.solve(&text, &["--json", "--method", method]);
        let reports = ["walks", "resolvent"].map(|method| by(method).quietly(0).json());
        let all = reports
            .iter()
            .flat_map(|report| list(report, "targets").iter().zip(expected));
        for (target, expected) in all {
            if expected.is_nan() {
                continue;
            }
            let exact = number(target, "exact");
            assert!((exact - expected).abs() < 1e-9, "{problem}: {target}");
            let floor = number(target, "rounding_floor");
            let plain = (!target["plain"]["estimate"].is_null()).then_some("plain");
            for kind in plain.into_iter().chain(["preconditioned"]) {
                let estimate = number(&target[kind], "estimate");
                let error = number(&target[kind], "std_error").max(floor);
                let z = (estimate - exact) / error;
                assert!(z.abs() < STANDARD_ERRORS, "{problem}, {kind}: {target}");
            }
            // v is off by what so few cells leave, and not by a factor.
            let galerkin = number(target, "galerkin");
            assert!((galerkin - exact).abs() < 0.6, "{problem}: {target}");
        }
    }
}

#[test]
fn a_domain_is_the_same_equation_transformed_by_hand() {
    let folder = Folder::new();
    let targets = "[[target]]\nname = 'a'\nat = AT\n[[target]]\nname = 'g'\ngrid = 3\n";
    let own = cube(
        "dimension = 1\ndomain = [-1, 1]\nkernel = '0.3 * exp(-(x - y)^2)'\nsource = 'x'",
        &targets.replace("AT", "0.5"),
    );
    let hand = cube(
        "dimension = 1\nkernel = '0.6 * exp(-4 * (x - y)^2)'\nsource = '2 * x - 1'",
        &targets.replace("AT", "0.75"),
    );
    let [own, hand] = [own, hand].map(|text| folder.solve(&text, &["--json"]).quietly(0).json());
    let places = [0.5, -1.0, 0.0, 1.0];
    let pairs = list(&own, "targets").iter().zip(list(&hand, "targets"));
    for ((own, hand), place) in pairs.zip(places) {
        assert_eq!(own["at"][0].as_f64(), Some(place));
        // The same walks, up to rounding.
        let [own, hand] = [own, hand].map(|target| number(&target["preconditioned"], "estimate"));
        assert!((own - hand).abs() < 1e-10, "{own} {hand}");
    }
}

#[test]
fn a_singularity_at_x_equals_y_needs_no_value() {
    let folder = Folder::new();
    let problem = "dimension = 1\nkernel = '0.3 * abs(x - y)^-0.3'\nsource = '1'\n";
    let target = "[[target]]\nname = 'mid'\nat = 0.5\n";
    let ran = folder.solve(&cube(problem, target), &["--json"]);
    let report = ran.quietly(0).json();
    // By product integration on 400 cells.
    let found = &list(&report, "targets")[0]["preconditioned"];
    let (estimate, error) = (number(found, "estimate"), number(found, "std_error"));
    assert!((estimate - 2.071_909).abs() < 4.9 * error + 1e-4, "{found}");
    // The chain's neighbour needs it: its coefficients are quadratures with points at x = y.
    let flags = ["--method", "walks", "--cells", "10"];
    common::refused(
        &folder.solve(&cube(problem, target), &flags),
        &[
            "`kernel` is inf at x = ",
            "where x = y",
            "take no singularity",
        ],
    );
}

#[test]
fn grids_in_several_dimensions_and_lists_of_points() {
    let folder = Folder::new();
    folder.file("points.csv", "x1, x2\n# a corner\n-1, 0\n\n2, 0.5\n");
    let problem =
        "dimension = 2\ndomain = [[-1, 2], [0, 0.5]]\nkernel = '0.1 * x1 * y2'\nsource = 'x1 + x2'";
    let targets =
        "[[target]]\nname = 'g'\ngrid = [3, 2]\n[[target]]\nname = 'p'\nat = 'points.csv'\n";
    let text = cube(problem, targets);
    let csv = folder.at("out.csv");
    let ran = folder.solve(&text, &["--out", &csv]).quietly(0);
    let words: Vec<&str> = ran.stdout.split_whitespace().collect();
    let table = words.join(" ");
    for row in [
        "target at exact",
        "g[1] -1, 0.5 -",
        "g[2] 0.5, 0 -",
        "p[1] 2, 0.5 -",
    ] {
        assert!(table.contains(row), "{table}");
    }
    let rows = csv_rows(csv.as_ref());
    let column = |name: &str| rows[0].iter().position(|key| key == name).unwrap();
    let places: Vec<_> = rows[1..]
        .iter()
        .map(|row| [0, column("x1"), column("x2")].map(|i| row[i].as_str()))
        .collect();
    let expected = [
        ["g[0]", "-1", "0"],
        ["g[1]", "-1", "0.5"],
        ["g[2]", "0.5", "0"],
        ["g[3]", "0.5", "0.5"],
        ["g[4]", "2", "0"],
        ["g[5]", "2", "0.5"],
        ["p[0]", "-1", "0"],
        ["p[1]", "2", "0.5"],
    ];
    assert_eq!(places, expected);
    // A point outside is shown in its file.
    folder.file("points.csv", "0, 0\n0, 0.6\n");
    common::refused(
        &folder.solve(&text, &[]),
        &["points.csv:2:1: ", "from 0 to 0.5", "2 | 0, 0.6"],
    );
    let ran = folder.solve(&text.replace("points.csv", "none.csv"), &[]);
    for word in ["problem.toml:", "cannot read", "none.csv"] {
        assert!(ran.stderr.contains(word), "{ran:?}");
    }
    // A picture of a grid has the domain on its axis.
    let line = "dimension = 1\ndomain = [2, 4]\nkernel = '0.1 * x * y / 9'\nsource = '1'";
    let svg = folder.at("out.svg");
    let text = cube(line, "[[target]]\nname = 'g'\ngrid = 5\n");
    folder.solve(&text, &["--out", &svg]).quietly(0);
    assert_svg(svg.as_ref());
    let text = std::fs::read_to_string(&svg).unwrap();
    assert!(
        text.contains(">4</text>") || text.contains(">4.0</text>"),
        "{text}"
    );
}

/// u = 1 + [x < 0.3] ∫ u jumps, and its line ends there; several grids are in one picture, one below the other.
#[test]
fn grids_of_a_file_share_a_picture() {
    let folder = Folder::new();
    let svg = folder.at("out.svg");
    let drawn = |problem: &str, targets: &str| {
        let args = ["--degree", "1", "--out", &svg];
        folder.solve(&cube(problem, targets), &args).quietly(0);
        std::fs::read_to_string(&svg).unwrap()
    };
    let line = "dimension = 1\nkernel = 'x < 0.3 ? 0.5 : 0'\nsource = '1'";
    let grid = |name: &str| format!("[[target]]\nname = '{name}'\ngrid = 41\n");
    let one = drawn(line, &grid("a"));
    let two = drawn(line, &(grid("a") + &grid("b")));
    assert_svg(svg.as_ref());
    for name in ["a: the solution", "b: the solution"] {
        assert!(two.contains(name), "{name}");
    }
    let panels = |text: &str| text.matches("translate(0,").count();
    assert_eq!(panels(&two), 1 + 2 * panels(&one));
    // Twice as many lines as of a curve.
    let smooth = drawn(&line.replace("x < 0.3 ? 0.5 : 0", "0.5 * x"), &grid("a"));
    let first = |text: &str| {
        text.split("translate(0,")
            .next()
            .map_or(0, |of| of.matches("<path").count())
    };
    assert_eq!(first(&one), 2 * first(&smooth), "{one}");
    // Of two axes, too.
    let plane = "dimension = 2\nkernel = '0.5'\nsource = 'x1'";
    let maps = drawn(
        plane,
        "[[target]]\nname = 'm'\ngrid = [3, 4]\n[[target]]\nname = 'n'\ngrid = [2, 2]\n",
    );
    for name in ["m: the solution u(x1, x2)", "n: its standard error"] {
        assert!(maps.contains(name), "{name}: {maps}");
    }
}

#[test]
fn a_solution_that_is_none_is_seen() {
    let folder = Folder::new();
    let of = |solution: &str| {
        let problem = format!(
            "dimension = 1\nkernel = '0.05 * x * y^2'\nsource = 'x^2 - 0.01 * x'\nsolution = '{solution}'"
        );
        cube(&problem, "[[target]]\nname = 'a'\nat = 0.5\n")
    };
    let good = folder.solve(&of("x^2"), &[]).quietly(0);
    assert!(good.stdout.contains("  error  "), "{}", good.stdout);
    let wrong = folder.solve(&of("x"), &["--json"]);
    let wrong = wrong.warning(0, &["no solution of this equation, it seems"]);
    let target = &list(&wrong.json(), "targets")[0].clone();
    assert!((number(target, "error") + 0.25).abs() < 1e-2, "{target}");
    assert!(number(target, "z") < -5.0, "{target}");
}

#[test]
fn a_mean_over_several_surfaces_is_that_of_their_lengths() {
    let folder = Folder::new();
    let surface = |name: &str, points: &str, rest: &str| {
        format!("[[problem.surface]]\nname = '{name}'\npoints = {points}\n{rest}\n")
    };
    let room = [
        "[problem]\nkind = 'room'\n".to_owned(),
        surface("floor", "[[0, 0], [4, 0]]", "reflectance = 0.5"),
        surface("right", "[[4, 0], [4, 3]]", "reflectance = 0.8"),
        surface(
            "lamp",
            "[[4, 3], [0, 3]]",
            "reflectance = 0.2\nemission = 1",
        ),
        surface("left", "[[0, 3], [0, 0]]", "reflectance = 0.3"),
    ];
    let over = |name: &str, over: &str| format!("[[target]]\nname = '{name}'\nover = {over}\n");
    let targets = [
        over("both", "['left', 'lamp']"),
        over("left", "'left'"),
        over("lamp", "'lamp'"),
        over("one", "['lamp']"),
    ];
    folder.file("places.csv", "surface, t\nfloor, 0.25\n\"left\", 0.5\n");
    let list_of_places = "[[target]]\nname = 'p'\nat = 'places.csv'\n";
    let text = format!(
        "{}[galerkin]\ncells = 40\n[walk]\nwalks = 20000\n{}{list_of_places}",
        room.concat(),
        targets.concat()
    );
    let report = folder.solve(&text, &["--json"]).quietly(0).json();
    let found = list(&report, "targets");
    assert_eq!(found[0]["over"], serde_json::json!(["left", "lamp"]));
    let mean = |of: &dyn Fn(usize) -> f64| (3.0 * of(1) + 4.0 * of(2)) / 7.0;
    let galerkin = |i: usize| number(&found[i], "galerkin");
    assert!((galerkin(0) - mean(&galerkin)).abs() < 1e-12);
    for kind in ["plain", "preconditioned", "irradiance"] {
        let estimate = |i: usize| number(&found[i][kind], "estimate");
        let error = |i: usize| number(&found[i][kind], "std_error");
        let allowed = STANDARD_ERRORS * (error(0) + mean(&error));
        assert!(
            (estimate(0) - mean(&estimate)).abs() < allowed,
            "{kind}: {found:?}"
        );
    }
    // One surface in a list is that surface, bit by bit: only the stream of its walks is another.
    assert_eq!(galerkin(3), galerkin(2));
    // Points of a list know where they are.
    assert_eq!(found[4]["position"], serde_json::json!([1.0, 0.0]));
    assert_eq!(found[5]["position"], serde_json::json!([0.0, 1.5]));
    let twice = text.replace("['lamp']", "['lamp', 'lamp']");
    let ran = folder.solve(&twice, &[]);
    assert!(ran.stderr.contains("in the list already"), "{ran:?}");
    let ran = folder.solve(&text.replace("['lamp']", "['lmap']"), &[]);
    assert!(ran.stderr.contains("did you mean \"lamp\"?"), "{ran:?}");
    let ran = folder.solve(&text.replace("['lamp']", "['lamp', 3]"), &[]);
    assert!(ran.stderr.contains("`over[1]` must be a string"), "{ran:?}");
    folder.file("places.csv", "floor, 0.25\nceiling, 0.5\n");
    let ran = folder.solve(&text, &[]);
    for word in ["places.csv:2:1: ", "no surface \"ceiling\""] {
        assert!(ran.stderr.contains(word), "{ran:?}");
    }
    let path = folder.at("problem.toml");
    assert_eq!(fredholm(&["check", &path]).status, Some(2));
}

#[test]
fn what_takes_long_is_said_beforehand() {
    let folder = Folder::new();
    let sum = vec!["0.001 * exp(-x * y)"; 300].join(" + ");
    let target = "[[target]]\nname = 'a'\nat = 0.5\n";
    let text = cube(
        &format!("dimension = 1\nkernel = '{sum}'\nsource = '1'"),
        target,
    );
    let text = text.replace("walks = 20000", "walks = 10");
    let text = text.replace("cells = 12", "cells = 2\ndegree = 0");
    folder
        .solve(&text, &[])
        .warning(0, &["problem.toml:4: ", "microseconds"]);
    let solid = "dimension = 3\nkernel = '0.1 * x1 * y2'\nsource = 'x3'";
    let target = "[[target]]\nname = 'a'\nover = 'all'\n";
    let text = cube(solid, target).replace("cells = 4", "cells = 3");
    let path = folder.file("solid.toml", text);
    let args = ["diagnose", &path, "--degree", "1", "--nodes", "100"];
    fredholm(&args).warning(0, &["729 points instead of 100"]);
}
