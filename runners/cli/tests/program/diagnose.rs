//! `fredholm diagnose`: against what `solve` measures, and its advice.

use crate::common;

use crate::systems::LINE;
use common::{Folder, diagnose, fredholm, is_long, list, number};
use serde_json::Value;

const CIRCLE: &str = "[problem]
kind = 'circle'
reflectance = [0.3, 0.7]
emission = { constant = 5.0, amplitude = 1.0, frequency = 5 }
[galerkin]
cells = 40
[walk]
method = 'walks'
walks = 100000
[[target]]
name = 'point'
at = 1.0
[[target]]
name = 'arc'
over = [0.5, 2.0]
[[target]]
name = 'mean'
over = 'all'
";

const CUBE: &str = "[problem]
kind = 'cube'
dimension = 2
kernel = '0.5 * exp(-(x1 - y1)^2 - (x2 - y2)^2)'
source = '1 + x1'
[galerkin]
cells = 6
[walk]
method = 'walks'
walks = 100000
[[target]]
name = 'point'
at = [0.3, 0.6]
[[target]]
name = 'mean'
over = 'all'
[[target]]
name = 'weighted'
weight = '1 + x1 * x2'
";

const ROOM: &str = "[problem]
kind = 'room'
[[problem.surface]]
name = 'floor'
points = [[0, 0], [3, 0]]
reflectance = 0.5
[[problem.surface]]
name = 'rest'
points = [[3, 0], [3, 2], [0, 2]]
reflectance = 0.6
[[problem.surface]]
name = 'lamp'
points = [[0, 2], [0, 0]]
reflectance = 0.3
emission = 1.0
[[problem.surface]]
name = 'table, top'
points = [[2.2, 0.8], [1, 0.8]]
reflectance = 0.4
[[problem.surface]]
name = 'table, bottom'
points = [[1, 0.8], [2.2, 0.8]]
reflectance = 0.4
[galerkin]
cells = 150
[walk]
method = 'walks'
last_step = false
walks = 100000
[[target]]
name = 'below'
at = { surface = 'floor', t = 0.5 }
[[target]]
name = 'floor'
over = 'floor'
[[target]]
name = 'all'
over = 'all'
";

/// √Var of both estimates, predicted and measured, within 10 %: 100,000 walks know them to some per cent, as do 30,000 of
/// the room, where kurtoses are large. The accuracy itself is measured by `fredholm-tests`, test `variance`.
fn agrees(text: &str, options: &[&str]) {
    let folder = Folder::new();
    let file = folder.file("a.toml", text);
    let run = |command: &[&str]| {
        let arguments = [command, &[file.as_str(), "--json"], options].concat();
        fredholm(&arguments).quietly(0).json()
    };
    let (predicted, measured) = (run(diagnose()), run(&["solve"]));
    let (predicted, measured) = (list(&predicted, "targets"), list(&measured, "targets"));
    assert_eq!(predicted.len(), measured.len());
    for (predicted, measured) in predicted.iter().zip(measured.iter()) {
        assert_eq!(predicted["name"], measured["name"]);
        for kind in ["plain", "preconditioned"] {
            let (sd, found) = (number(predicted, kind), number(&measured[kind], "std_dev"));
            assert!(
                (sd / found - 1.0).abs() < 0.1,
                "{} {kind} {sd} {found}",
                predicted["name"]
            );
        }
        let (u, found) = (number(predicted, "solution"), &measured["preconditioned"]);
        let off = (u - number(found, "estimate")).abs();
        // Arcs end within sites, of which there are several hundred.
        let rest = 2e-3 * u.abs();
        assert!(off < 5.0 * number(found, "std_error") + rest, "{predicted}");
        let parts = &predicted["parts"];
        let of = |name| number(parts, name);
        let sum = of("kernel") + of("left_out") + of("sources") + of("mean") + of("start");
        assert!((sum - 1.0).abs() < 1e-3, "{parts}");
    }
}

#[test]
fn predictions_are_what_solve_measures() {
    let all = ["--pairs", "default"];
    agrees(CIRCLE, &[&all[..], &["--degree", "0"]].concat());
    agrees(CIRCLE, &[&all[..], &["--degree", "2"]].concat());
    let paper = ["--pairs", "paper", "--estimator", "absorption"];
    agrees(CIRCLE, &[&paper[..], &["--degree", "0"]].concat());
    agrees(CUBE, &["--degree", "0"]);
    agrees(
        CUBE,
        &["--cells", "3", "--degree", "1", "--estimator", "absorption"],
    );
    agrees(ROOM, &["--degree", "0", "--pairs", "rays"]);
    // Their walks take seven times as long.
    let walks = if is_long() { "100000" } else { "30000" };
    let room = ROOM.replace("100000", walks);
    agrees(&room, &["--degree", "0", "--pairs", "pointwise"]);
}

/// Fewer cells where so many would take longer. By day a room and a square are told their degree.
#[test]
fn what_is_open_is_what_solve_chooses() {
    let folder = Folder::new();
    let file = |name: &str, text: &str, cells: &str, degree: &str| {
        let degree = if is_long() { "" } else { degree };
        let text = text.replace("walks = 100000", "walks = 10000");
        folder.file(name, text.replace(cells, degree))
    };
    let room = file("room.toml", ROOM, "cells = 150", "degree = 0");
    let square = file("square.toml", CUBE, "cells = 6", "degree = 1");
    let line = folder.file(
        "line.toml",
        LINE.replace("[walk]\n", "[walk]\nwalks = 2000\n"),
    );
    let run = |command: &[&str], file: &str| {
        let args = [command, &[file, "--json"]].concat();
        fredholm(&args).quietly(0).json()
    };
    let [of_room, solved] = [diagnose(), &["solve"]].map(|command| run(command, &room));
    for key in ["cells", "degree", "pairs"] {
        assert_eq!(of_room[key], solved[key], "{key}");
    }
    assert!(!is_long() || number(&of_room, "degree") > 0.0, "{of_room}");
    let nodes = if is_long() { 2400.0 } else { 400.0 };
    for (cube, dimension) in [(line, 1), (square, 2)] {
        let [diagnosed, solved] = [diagnose(), &["solve"]].map(|command| run(command, &cube));
        assert!(number(&diagnosed, "degree") > 0.0, "{diagnosed}");
        assert_eq!(diagnosed["degree"], solved["degree"]);
        let [few, all] = [&diagnosed, &solved].map(|json| number(json, "cells"));
        let points = |cells: f64| (cells * (number(&solved, "degree") + 2.0)).powi(dimension);
        assert!(points(few) <= nodes, "{diagnosed}");
        assert_eq!(few < all, points(all) > nodes, "{diagnosed}");
    }
}

#[test]
fn one_result_for_any_number_of_threads() {
    let folder = Folder::new();
    let file = folder.file("a.toml", ROOM);
    let of = |threads: &str| -> Value {
        let args = ["--json", "--degree", "1", "--threads", threads];
        let mut json = fredholm(&[diagnose(), &[&file], &args].concat())
            .quietly(0)
            .json();
        json.as_object_mut().unwrap().remove("seconds");
        json
    };
    assert_eq!(of("1"), of("3"));
}

#[test]
fn text_and_pictures() {
    let folder = Folder::new();
    // What the paper has is of pairs in S and of its estimator.
    for (name, text, pairs, words) in [
        ("circle", CIRCLE, "paper", "[0.94, 1.41]"),
        ("cube", CUBE, "paper", "[0.25, 0.5]"),
        ("room", ROOM, "rays", "table, top"),
    ] {
        let file = folder.file(&format!("{name}.toml"), text);
        let out = folder.path().join(name);
        let args = [
            "--degree",
            "0",
            "--pairs",
            pairs,
            "--estimator",
            "absorption",
            "--out",
            out.to_str().unwrap(),
        ];
        let ran = fredholm(&[diagnose(), &[&*file], &args].concat()).quietly(0);
        for expected in [
            words,
            "Theorem 3: √Var is at most",
            "quantities of the paper",
            "finite variance",
            "sources differ",
        ] {
            assert!(
                ran.stdout.contains(expected),
                "{name}: no {expected:?}: {}",
                ran.stdout
            );
        }
        let svg = std::fs::read_to_string(out.join("where.svg")).unwrap();
        assert!(
            svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"),
            "{name}"
        );
        assert!(svg.matches("fill").count() > 20, "{name}: nothing is drawn");
        let json = std::fs::read_to_string(out.join("diagnosis.json")).unwrap();
        let json: Value = serde_json::from_str(&json).unwrap();
        assert!(number(&json["quantities"], "epsilon") >= number(&json["quantities"], "delta"));
        // By rays no pair is in S.
        assert!(
            pairs == "rays"
                || number(&json["quantities"]["pairs"], "proposition_6")
                    > number(&json["quantities"], "sigma")
        );
        assert!(number(&json["quantities"], "proposition_7") > number(&json["quantities"], "tau"));
    }
}

/// Without a variance there is nothing to predict, which is no error: it says what may help.
#[test]
fn an_infinite_variance_is_said() {
    let folder = Folder::new();
    let text = "[problem]
kind = 'cube'
dimension = 1
kernel = '3 * x * y^4'
source = '1'
[walk]
absorption = 0.2
[[target]]
name = 'mean'
over = 'all'
";
    let file = folder.file("a.toml", text);
    let is_long = is_long();
    let few: &[&str] = if is_long { &[] } else { &["--cells", "100"] };
    let arguments = [diagnose(), &[file.as_str(), "--json"], few].concat();
    let json = fredholm(&arguments).quietly(0).json();
    let target = &list(&json, "targets")[0];
    assert!(json["kernel_power"].is_null(), "{json}");
    assert!(target["plain"].is_null() && target["preconditioned"].is_null());
    assert!(
        list(target, "advice")[0]
            .as_str()
            .unwrap()
            .contains("infinite")
    );
}

#[test]
fn refusals() {
    let folder = Folder::new();
    let file = folder.file("a.toml", CUBE.replace("cells = 6", "cells = 100"));
    let ran = fredholm(&["diagnose", &file]);
    assert_eq!(ran.status, Some(2), "{ran:?}");
    assert!(ran.stderr.contains("use fewer cells"), "{}", ran.stderr);
}
