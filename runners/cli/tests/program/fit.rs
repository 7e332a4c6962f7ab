//! `fredholm fit` and budgets of uncertainties: closed forms, files with what was found, parts, and what cannot be found.

use crate::common;

use common::{Folder, Ran, fredholm, list, number, refused};
use serde_json::Value;

/// u = b x/(1 − a/3), so that ∂u/∂a = b x/(3 (1 − a/3)²).
const LINE: &str = "[problem]\nkind = 'cube'\ndimension = 1\nkernel = 'a * x * y'\nsource = 'b * x'\n\
    [problem.parameters]\na = 0.2\nb = 1\n\
    [[target]]\nname = 'u'\nat = 0.5\nmeasured = { value = 0.6, error = 0.006 }\n\
    [[target]]\nname = 'mean'\nover = 'all'\n[fit]\nquantities = ['a']\n";

const ROOM: &str = "[problem]\nkind = 'room'\n\
    [[problem.surface]]\nname = 'hot'\npoints = [[0, 0], [2, 0]]\nemissivity = 0.8\ntemperature = '900 K'\n\
    [[problem.surface]]\nname = 'cold'\npoints = [[2, 0], [2, 1]]\nemissivity = 0.6\ntemperature = 400\n\
    [[problem.surface]]\nname = 'brick'\npoints = [[2, 1], [0, 1], [0, 0]]\nnet_flux = 0\n\
    [[target]]\nname = 'brick'\nover = 'brick'\nmeasured = { temperature = 800, error = 2 }\n\
    [walk]\nwalks = 20000\n[galerkin]\ncells = 60\ndegree = 1\n";

/// Fits what LINE says, and what it leaves open.
fn fit_line(folder: &Folder, problem: &str, args: &[&str]) -> Ran {
    let cells = "[galerkin]\ncells = 2\ndegree = 2\n[walk]\nwalks = 2000\n[fit]\n";
    fit(folder, &problem.replace("[fit]\n", cells), args)
}

fn fit(folder: &Folder, problem: &str, args: &[&str]) -> Ran {
    let file = folder.file("p.toml", problem);
    fredholm(&[&["fit", &file], args].concat())
}

fn quantity(json: &Value) -> [f64; 2] {
    let own = &list(json, "quantities")[0];
    [number(own, "value"), number(own, "std_error")]
}

#[test]
fn a_parameter_is_found_with_its_error() {
    let folder = Folder::new();
    let found = |problem: &str| fit_line(&folder, problem, &["--json"]);
    let json = found(LINE).quietly(0).json();
    // a = 3 − 3 b x/u = ½, and σ_a = σ_u/0.24.
    let [value, error] = quantity(&json);
    assert!((value - 0.5).abs() < 1e-6, "{value}");
    assert!((error - 0.025).abs() < 1e-5, "{error}");
    // What is not known of b counts, too: ∂u/∂b = 0.6.
    let doubtful = format!("{LINE}[uncertainties]\nb = '1 %'\n");
    let [_, error] = quantity(&found(&doubtful).quietly(0).json());
    assert!((error - 0.025 * 2.0_f64.sqrt()).abs() < 1e-4, "{error}");
    // What was known of a before is one measurement more: the derivative of χ² is 0.
    let known = format!("{LINE}[uncertainties]\na = 0.025\n");
    let [a, error] = quantity(&found(&known).json());
    let whole = 1.0 / (1.0 - a / 3.0);
    let [of_u, of_a] = [0.5 / 3.0 * whole * whole / 0.006, 1.0 / 0.025];
    let slope = of_u * (0.5 * whole - 0.6) / 0.006 + of_a * (a - 0.2) / 0.025;
    assert!(slope.abs() < 0.01 * of_u.hypot(of_a), "{a}: {slope}");
    assert!((error * of_u.hypot(of_a) - 1.0).abs() < 1e-6, "{error}");
}

#[test]
fn a_temperature_is_explained_by_the_file_that_is_written() {
    let folder = Folder::new();
    let out = folder.at("found.toml");
    let hot = |out| {
        let few = ["--quantity", "hot temperature", "--walks", "2000"];
        fit(&folder, ROOM, &[&few[..], &["--out", out]].concat()).quietly(0)
    };
    let ran = hot(&out);
    assert!(ran.stdout.contains("hot temperature"), "{}", ran.stdout);
    let solved = fredholm(&["solve", &out, "--json"]).quietly(0).json();
    let kelvin = number(&list(&solved, "targets")[0]["temperature"], "estimate");
    assert!((kelvin - 800.0).abs() < 0.5, "{kelvin}");
    let json = folder.at("found.json");
    hot(&json);
    let found: Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    assert_eq!(list(&found, "targets").len(), 1);
}

#[test]
fn what_no_quantity_explains_is_told() {
    let folder = Folder::new();
    let second = LINE.replace(
        "over = 'all'\n",
        "over = 'all'\nmeasured = { value = 0.9, error = 0.006 }\n",
    );
    let ran = fit_line(&folder, &second, &[]);
    assert_eq!(ran.status, Some(1), "{ran:?}");
    assert!(
        ran.stdout
            .contains("the model does not explain the measurements"),
        "{}",
        ran.stdout
    );
}

#[test]
fn what_cannot_be_found_says_so() {
    let folder = Folder::new();
    let refuse = |problem: &str, args: &[&str], words: &[&str]| {
        refused(&fit(&folder, problem, args), words);
    };
    refuse(
        LINE,
        &["--quantity", "A"],
        &["--quantity", "no quantity \"A\"; did you mean \"a\""],
    );
    refuse(
        LINE,
        &["--quantity", "a", "--quantity", "b"],
        &["2 quantities do not follow from 1 measurements"],
    );
    refuse(
        &LINE.replace("[fit]\nquantities = ['a']\n", ""),
        &[],
        &["`[fit]`", "\"a\" and \"b\""],
    );
    refuse(
        &LINE.replace("measured = { value = 0.6, error = 0.006 }\n", ""),
        &[],
        &["no target is measured"],
    );
    refuse(
        &LINE.replace("error = 0.006", "error = 0"),
        &[],
        &["p.toml:12:35:", "above 0"],
    );
    refuse(
        &LINE.replace("value = 0.6", "temperature = 600"),
        &[],
        &["no temperature that follows from u"],
    );
    refuse(
        &LINE.replace("value = 0.6, ", ""),
        &[],
        &["`value`", "`temperature`"],
    );
    let grid = LINE.replace("at = 0.5\n", "grid = 5\n");
    refuse(
        &grid,
        &[],
        &["p.toml:12:1:", "a measurement is of one number"],
    );
    refuse(
        ROOM,
        &["--quantity", "brick net flux"],
        &["its emissivity is not known"],
    );
    // Two emissivities of a segment each are no one number.
    let two = ROOM.replace(
        "net_flux = 0\n",
        "emissivity = [0.5, 0.6]\ntemperature = 500\n",
    );
    let two = two.replace(
        "measured = { temperature = 800, error = 2 }",
        "measured = { value = 9000, error = 20 }",
    );
    refuse(
        &two,
        &["--quantity", "brick emissivity"],
        &["does not stand in the file as one number"],
    );
    let wrong = |text: &str, words: &[&str]| {
        let problem = format!("{LINE}[uncertainties]\n{text}\n");
        refused(&folder.solve(&problem, &[]), words);
    };
    wrong("c = 0.1", &["no quantity \"c\""]);
    wrong("a = -1", &["problem.toml:19:5:", "above 0"]);
    wrong("a = 'much'", &["\"5 %\""]);
    wrong(
        "a = 1\n[walk]\nglobal = true",
        &["sensitivities", "leave `global` and `adjoint` out"],
    );
}

/// σ² = (∂u/∂a σ_a)² + (∂u/∂b σ_b)².
#[test]
fn budgets_have_closed_forms_and_parts() {
    let folder = Folder::new();
    let doubtful = LINE.replace("a = 0.2", "a = 0.5") + "[uncertainties]\na = 0.02\nb = '1 %'\n";
    let json = folder.solve(&doubtful, &["--json"]).quietly(0).json();
    let budget = &list(&json["sensitivities"], "budgets")[0];
    assert_eq!(budget["largest"], "b");
    let both = (0.24 * 0.02_f64).hypot(0.006);
    assert!((number(budget, "std_error") - both).abs() < 1e-7);
    assert!((number(budget, "without_largest") - 0.0048).abs() < 1e-7);
    // Those of a room are in parts of its walks, too, and merge to the bits of one run.
    let room =
        ROOM.to_owned() + "[uncertainties]\n'hot temperature' = 5\n'cold emissivity' = '5 %'\n";
    let file = folder.file("room.toml", &room);
    let whole = fredholm(&["solve", &file, "--json"]).quietly(0).json();
    let parts = ["1/3", "2/3", "3/3"].map(|part| {
        let kept = folder.at(&part.replace('/', "of"));
        let args = [
            "solve", &file, "--walks", "20000", "--part", part, "--save", &kept,
        ];
        assert_eq!(fredholm(&args).status, Some(0));
        kept
    });
    let merged = ["merge", &parts[2], &parts[0], &parts[1], "--json"];
    let merged = fredholm(&merged).quietly(0).json();
    for key in ["derivatives", "budgets", "walks", "states"] {
        assert_eq!(
            merged["sensitivities"][key], whole["sensitivities"][key],
            "{key}"
        );
    }
    let budget = &list(&whole["sensitivities"], "budgets")[0];
    assert_eq!(budget["largest"], "hot temperature");
    // σT⁴ of brick is between those of both: it moves less than the hot wall.
    let kelvin = number(budget, "temperature_std_error");
    assert!((3.0..7.2).contains(&kelvin), "{kelvin}");
}
