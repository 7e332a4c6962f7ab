//! `solve --sensitivities` against closed forms and differences, and what has no derivatives.

use crate::common;

use std::collections::HashMap;

use common::{Folder, list, number, refused};
use serde_json::Value;

/// A bound of |z| over all derivatives of a test, of some twenty.
const SIGMAS: f64 = 4.9;

/// The derivatives of a report, by target and quantity.
fn derivatives(json: &Value) -> HashMap<(String, String), [f64; 2]> {
    let all = list(&json["sensitivities"], "derivatives").iter();
    let text = |own: &Value, key: &str| own[key].as_str().unwrap().to_owned();
    let of = |own: &Value| {
        let names = (text(own, "target"), text(own, "quantity"));
        (names, [number(own, "derivative"), number(own, "std_error")])
    };
    all.map(of).collect()
}

/// All targets' estimates and errors.
fn values(folder: &Folder, problem: &str) -> Vec<(String, [f64; 2])> {
    let json = folder.solve(problem, &["--json"]).quietly(0).json();
    let of = |target: &Value| {
        let found = &target["preconditioned"];
        let name = target["name"].as_str().unwrap().to_owned();
        (
            name,
            [number(found, "estimate"), number(found, "std_error")],
        )
    };
    list(&json, "targets").iter().map(of).collect()
}

/// Compares all derivatives by a quantity with central differences of runs in which a text of the problem has other numbers.
fn check(
    folder: &Folder,
    problem: &str,
    found: &HashMap<(String, String), [f64; 2]>,
    (quantity, text, step): (&str, &str, f64),
) -> f64 {
    let (key, base) = text.rsplit_once(' ').unwrap();
    let at = |sign: f64| {
        let moved = base.parse::<f64>().unwrap() + sign * step;
        assert!(problem.contains(text), "{text}");
        values(folder, &problem.replace(text, &format!("{key} {moved}")))
    };
    let (low, high) = (at(-1.0), at(1.0));
    let mut worst = 0.0_f64;
    for ((target, [low, a]), (_, [high, b])) in low.iter().zip(&high) {
        let difference = (high - low) / (2.0 * step);
        let [own, error] = found[&(target.clone(), quantity.to_owned())];
        let error = error.hypot(a.hypot(*b) / (2.0 * step));
        let z = (own - difference) / error;
        println!("{target} {quantity}: {own} ± {error}, {difference}, {z:.1}");
        worst = worst.max(z.abs());
    }
    worst
}

const HEAT: &str = "[problem]\nkind = 'room'\n\
    [[problem.surface]]\nname = 'floor'\npoints = [[0, 0], [4, 0]]\nemissivity = 0.9\ntemperature = 310\n\
    [[problem.surface]]\nname = 'window'\npoints = [[4, 0], [4, 2.5]]\nemissivity = 0.84\ntemperature = 278\n\
    [[problem.surface]]\nname = 'ceiling'\npoints = [[4, 2.5], [0, 2.5]]\nnet_flux = 5\n\
    [[problem.surface]]\nname = 'wall'\npoints = [[0, 2.5], [0, 0]]\nemissivity = 0.7\ntemperature = 293\n\
    [[target]]\nname = 'ceiling'\nover = 'ceiling'\n[[target]]\nname = 'air'\nat = [1, 1.2]\n\
    [walk]\nwalks = 100000\n";

#[test]
fn derivatives_of_heat_are_those_of_differences() {
    let folder = Folder::new();
    let json = folder
        .solve(HEAT, &["--json", "--sensitivities"])
        .quietly(0)
        .json();
    let found = derivatives(&json);
    assert_eq!(found.len(), 14);
    let moves = [
        ("floor temperature", "temperature = 310", 0.5),
        ("floor emissivity", "emissivity = 0.9", 0.01),
        ("window emissivity", "emissivity = 0.84", 0.01),
        ("wall temperature", "temperature = 293", 0.5),
        ("ceiling net flux", "net_flux = 5", 1.0),
    ];
    for moved in moves {
        let worst = check(&folder, HEAT, &found, moved);
        assert!(worst < SIGMAS, "{moved:?}: {worst}");
    }
}

const SUN: &str = "[problem]\nkind = 'scene'\nopen = true\nsky = { emission = 100 }\n\
    [[problem.light]]\ntowards = [1, -1, 2]\nirradiance = 500\n\
    [[problem.surface]]\nname = 'ground'\npolygon = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]]\nreflectance = 0.4\nemission = 2\n\
    [[problem.surface]]\nname = 'wall'\npolygon = [[0, 4, 0], [4, 4, 0], [4, 4, 3], [0, 4, 3]]\nreflectance = 0.6\n\
    [[problem.surface]]\nname = 'side'\npolygon = [[0, 0, 0], [0, 4, 0], [0, 4, 2], [0, 0, 2]]\nreflectance = 0.3\n\
    [[target]]\nname = 'ground'\nover = 'ground'\n[[target]]\nname = 'wall'\nat = { surface = 'wall', point = [2, 4, 1] }\n\
    [walk]\nwalks = 40000\n";

#[test]
fn derivatives_in_the_sun_are_those_of_differences() {
    let folder = Folder::new();
    let json = folder
        .solve(SUN, &["--json", "--sensitivities"])
        .quietly(0)
        .json();
    let found = derivatives(&json);
    let moves = [
        ("ground reflectance", "reflectance = 0.4", 0.05),
        ("wall reflectance", "reflectance = 0.6", 0.05),
        ("side reflectance", "reflectance = 0.3", 0.05),
        ("ground emission", "emission = 2", 1.0),
    ];
    for moved in moves {
        let worst = check(&folder, SUN, &found, moved);
        assert!(worst < SIGMAS, "{moved:?}: {worst}");
    }
}

const LINE: &str = "[problem]\nkind = 'cube'\ndimension = 1\nkernel = 'a * x * y'\nsource = 'b * x'\n\
    [problem.parameters]\na = 0.5\nb = '2 * c'\nc = 0.5\n\
    [[target]]\nname = 'u'\nat = 0.5\n[[target]]\nname = 'mean'\nover = 'all'\n[[target]]\nname = 'moment'\nweight = 'x'\n";

/// u = b x/(1 − a/3).
#[test]
fn derivatives_by_parameters_have_a_closed_form() {
    let folder = Folder::new();
    // A parameter knows those before it.
    let line = LINE.replace(
        "a = 0.5\nb = '2 * c'\nc = 0.5",
        "a = 0.5\nc = 0.5\nb = '2 * c'",
    );
    let system = line
        .replace("'cube'", "'system'")
        .replace("kernel = 'a * x * y'\nsource = 'b * x'\n", "")
        .replace(
            "[[target]]\nname = 'u'",
            "[[problem.equation]]\nkernel = ['a * x * y']\nsource = 'b * x'\n[[target]]\nname = 'u'",
        )
        .replace("at = 0.5\n", "at = 0.5\ncomponent = 1\n")
        .replace("over = 'all'", "over = 'all'\ncomponent = 1")
        .replace("weight = 'x'", "weight = 'x'\ncomponent = 1");
    for problem in [line, system] {
        let json = folder
            .solve(&problem, &["--json", "--sensitivities"])
            .quietly(0)
            .json();
        let found = derivatives(&json);
        assert_eq!(found.len(), 6, "{found:?}");
        let whole = 1.0 / (1.0 - 0.5 / 3.0);
        for (target, size) in [("u", 0.5), ("mean", 0.5), ("moment", 1.0 / 3.0)] {
            let of = |quantity: &str| found[&(target.to_owned(), quantity.to_owned())];
            for (quantity, exact) in [("a", whole * whole / 3.0), ("c", 2.0 * whole)] {
                let [own, error] = of(quantity);
                let off = (own - size * exact).abs();
                assert!(
                    off < SIGMAS * error && error < 1e-6,
                    "{target} {quantity}: {own} {error}"
                );
            }
        }
    }
}

#[test]
fn walks_that_miss_their_error_or_their_time_have_derivatives() {
    let folder = Folder::new();
    let late = HEAT.replace(
        "walks = 100000",
        "walks = 2000\ntarget_error = 1e-9\nabsorption = 0.2",
    );
    let ran = folder.solve(&late, &["--json", "--sensitivities", "--no-global"]);
    assert_eq!(ran.status, Some(3), "{ran:?}");
    assert_eq!(derivatives(&ran.json()).len(), 14);
    // At a time limit they end with what there is.
    let long = HEAT.replace("100000", "1000000000");
    let args = ["--json", "--sensitivities", "--time-limit", "0.3"];
    let json = folder.solve(&long, &args).json();
    let walks = number(&json["sensitivities"], "walks");
    assert!((4096.0..1e9).contains(&walks), "{walks}");
}

#[test]
fn what_has_no_derivatives_says_so() {
    let folder = Folder::new();
    let refuse = |problem: &str, words: &[&str]| {
        refused(&folder.solve(problem, &["--sensitivities"]), words);
    };
    refuse(
        common::CIRCLE,
        &["sensitivities are those of rooms, scenes and equations with parameters"],
    );
    let line = LINE.replace("b = '2 * c'\nc = 0.5", "b = 1");
    let jump = line.replace("'b * x'", "'x < a ? b : 0'");
    refuse(&jump, &["there is no derivative by `a`", "moves a jump"]);
    let told = format!("{jump}[walk]\nsensitivities = true\n");
    refused(
        &folder.solve(&told, &[]),
        &["sensitivities = true", "there is no derivative by `a`"],
    );
    let end = line.replace("dimension = 1", "dimension = 1\ndomain = [0, 'b']");
    let json = folder
        .solve(&end, &["--json", "--sensitivities"])
        .quietly(0)
        .json();
    assert!(
        derivatives(&json)
            .keys()
            .all(|(_, quantity)| quantity == "a")
    );
    refused(
        &folder.solve(&line, &["--sensitivities", "--global"]),
        &["--global"],
    );
}
