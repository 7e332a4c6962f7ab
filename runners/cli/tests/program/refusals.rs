//! Bad input to `fredholm`: status 2, nothing on stdout, no file, and one message that names the
//! key, the place and what would be right.

use crate::common;

use std::fs;

use common::{CIRCLE, Folder, Ran, circle_with, fredholm};

/// Asserts that a run refused its input with these words, in one message.
fn assert_refused(ran: &Ran, words: &[&str]) {
    assert_eq!(ran.status, Some(2), "{ran:?}");
    assert_eq!(ran.stdout, "", "{ran:?}");
    assert!(ran.stderr.starts_with("error: "), "{ran:?}");
    assert_eq!(ran.stderr.matches("error: ").count(), 1, "{ran:?}");
    assert!(!ran.stderr.contains("panicked"), "{ran:?}");
    for word in words {
        assert!(ran.stderr.contains(word), "no {word:?}: {}", ran.stderr);
    }
}

/// Asserts that a problem is refused at the place of `at`, which is in it once, by `solve` and by
/// `check`, before any file is made.
fn refused(problem: &str, at: &str, words: &[&str]) {
    assert_eq!(problem.matches(at).count(), 1, "{at:?} in {problem}");
    let byte = problem.find(at).unwrap();
    let before = &problem[..byte];
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;

    let folder = Folder::new();
    let result = folder.at("result.json");
    let ran = folder.solve(problem, &["--json", "--out", &result]);
    let file = folder.at("problem.toml");
    let place = format!("error: {file}:{line}:{column}: ");
    assert_refused(&ran, &[&[place.as_str()], words].concat());
    assert_eq!(folder.names(), ["problem.toml"]);

    let check = fredholm(&["check", &file]);
    assert_refused(&check, &[]);
    assert_eq!(check.stderr, ran.stderr);
}

/// Asserts that arguments of `solve` behind a good file are refused before any file is made.
fn refused_flags(args: &[&str], words: &[&str]) {
    let folder = Folder::new();
    let result = folder.at("result.json");
    let args = [args, &["--json", "--out", &result]].concat();
    assert_refused(&folder.solve(CIRCLE, &args), words);
    assert_eq!(folder.names(), ["problem.toml"], "{args:?}");
}

/// Asserts that `part` of the good file, replaced by `other`, is refused at `at`.
fn replaced(part: &str, other: &str, at: &str, words: &[&str]) {
    refused(&circle_with(part, other), at, words);
}

/// One of every section: the tests of `fredholm-file` have all, with their places and messages.
#[test]
fn mistakes_are_shown_where_they_stand() {
    let words = ["reflectance", "at least 0 and less than 1", "converge"];
    replaced("0.7]", "1.0]", "1.0]", &words);
    let words = ["`frequency`", "at least 1"];
    replaced("frequency = 5", "frequency = 0", "0 }", &words);
    let words = ["multiple", "2 arcs", "6 or 8"];
    replaced("cells = 20", "cells = 7", "7\n", &words);
    let words = ["`walks`", "write 100000"];
    replaced("walks = 20000", "walks = 1e5", "1e5", &words);
    let words = ["`estimator`", "did you mean \"collision\"?"];
    replaced("\"absorption\"", "\"colision\"", "\"colision\"", &words);
    let words = ["second angle", "more than the first"];
    replaced("[1.0, 4.0]", "[4.0, 1.0]", "1.0]", &words);
    let words = [
        "unknown key",
        "gird",
        "[[target]]",
        "did you mean",
        "`grid`",
    ];
    replaced("grid =", "gird =", "gird", &words);
    replaced(
        "\"circle\"",
        "\"square\"",
        "\"square\"",
        &["`kind`", "\"circle\""],
    );
    replaced(
        "kind = \"circle\"\n",
        "",
        "[problem]",
        &["`kind` is missing"],
    );
    // Numbers which only one of the scalar types has.
    for absorption in ["1e-300", "0.999999999999"] {
        let problem = circle_with("\"f64\"", "\"f32\"").replace("0.2", absorption);
        refused(&problem, absorption, &["`absorption`", "f32", "f64"]);
    }
    // A point of a grid has a name as well.
    let ran = Folder::new().solve(&circle_with("\"mean\"", "\"profile[1]\""), &["--json"]);
    assert_refused(&ran, &["\"profile[1]\"", "grid"]);
}

#[test]
fn problem_files() {
    let folder = Folder::new();
    let missing = folder.at("missing.toml");
    let latin = folder.file("latin.toml", b"[problem]\nkind = \"circle\" # \xe9\n");
    let broken = folder.file("broken.toml", "[problem\n");
    let empty = folder.file("empty.toml", "");
    let inputs = [
        (missing.as_str(), "No such file"),
        (folder.path().to_str().unwrap(), "directory"),
        (latin.as_str(), "UTF-8"),
        (broken.as_str(), "not valid TOML"),
        (empty.as_str(), "`problem` is missing"),
    ];
    for (file, why) in inputs {
        for command in ["solve", "check"] {
            assert_refused(&fredholm(&[command, file]), &[file, why]);
        }
    }
    assert_refused(&fredholm(&["solve"]), &["FILE"]);
}

#[test]
fn flags() {
    let cases: [(&[&str], &[&str]); 12] = [
        (&["--cells", "7"], &["`--cells 7`", "multiple", "6 or 8"]),
        (
            &["--cells", "1000000000"],
            &["--cells 1000000000", "memory"],
        ),
        (&["--cells", "0"], &["--cells 0", "at least 1"]),
        (&["--cells", "many"], &["--cells", "many"]),
        (&["--degree", "5"], &["--degree 5", "from 0 to 4"]),
        (&["--walks", "1e5"], &["--walks", "1e5"]),
        (
            &["--estimator", "wrong"],
            &["--estimator", "absorption", "collision"],
        ),
        (&["--pairs", "wrong"], &["--pairs", "paper", "pointwise"]),
        (&["--scalar", "wrong"], &["--scalar", "f32", "f64"]),
        (&["--foo"], &["--foo"]),
        (&["--cels", "20"], &["--cels", "--cells"]),
        (&["--threads", "0"], &["--threads", "0"]),
    ];
    for (args, words) in cases {
        refused_flags(args, words);
    }
    refused_flags(&["--threads", "-1"], &["--threads", "-1"]);
    for seconds in ["-1", "nan", "0", "inf", "1e300", "1e-300"] {
        refused_flags(
            &["--time-limit", seconds],
            &["--time-limit", "from 1e-9 to 1e19"],
        );
    }
    refused_flags(&["--time-limit", "soon"], &["--time-limit", "soon"]);
    for error in ["0", "-1", "nan", "inf"] {
        refused_flags(
            &["--target-error", error],
            &["--target-error", "more than 0"],
        );
    }
    refused_flags(&["--relative"], &["--relative", "`target_error`"]);
    refused_flags(&["--seed", "-1"], &["--seed", "-1"]);
    refused_flags(&["--walks", "-5"], &["--walks", "-5"]);
    refused_flags(&["--threads", "60000"], &["--threads", "60000"]);
    refused_flags(
        &["--seed", "18446744073709551615"],
        &["--seed", "9223372036854775807"],
    );
    refused_flags(&["--walks", "5", "--walks", "6"], &["--walks"]);
    let ran = fredholm(&["paper", "--max-walks", "9"]);
    assert_refused(&ran, &["--max-walks", "10"]);
    let ran = fredholm(&["paper", "--degree", "5", "--max-walks", "10"]);
    assert_refused(&ran, &["--degree"]);
    assert_refused(&fredholm(&["init", "square"]), &["square", "circle"]);
    assert_refused(&fredholm(&["fly"]), &["fly"]);
}

#[test]
fn places_for_results() {
    let folder = Folder::new();
    let out = Folder::new();
    out.file("file", "older");
    fs::create_dir(out.path().join("folder.json")).unwrap();
    let places = [
        ("missing/x.json", "missing"),
        ("folder.json", "folder"),
        ("new.json/", "folder"),
        ("file/x.json", "file"),
        ("x.txt", ".json, .csv, .npz, .svg, .vtu or .glb"),
        ("x", ".json, .csv, .npz, .svg, .vtu or .glb"),
        ("x.JSON", ".json, .csv, .npz, .svg, .vtu or .glb"),
    ];
    // So many walks that a run which began them would not end.
    for (name, why) in places {
        let place = out.at(name);
        let args = ["--walks", "9000000000000000", "--out", &place];
        let ran = folder.solve(CIRCLE, &args);
        assert_refused(&ran, &["--out", name, why]);
        assert!(!ran.stderr.contains(".fredholm-"), "{}", ran.stderr);
        assert_eq!(out.names(), ["file", "folder.json"], "{name}");
    }
    assert_eq!(fs::read_to_string(out.at("file")).unwrap(), "older");

    // A picture shows grids of one or two axes.
    let (picture, many) = (out.at("x.svg"), "9000000000000000");
    let none = circle_with("grid = 3", "at = 3");
    let ran = folder.solve(&none, &["--walks", many, "--out", &picture]);
    assert_refused(&ran, &["--out", "x.svg", "grid"]);
    let three = "[problem]\nkind = 'cube'\ndimension = 3\nkernel = '0.1'\nsource = '1'\n\
        [galerkin]\ncells = 2\n[[target]]\nname = 'a'\ngrid = [2, 2, 2]\n";
    let ran = folder.solve(three, &["--walks", many, "--out", &picture]);
    assert_refused(&ran, &["--out", "x.svg", "one or two axes"]);

    let place = out.at("file");
    let ran = fredholm(&["paper", "--out", &place, "--max-walks", "1000000000000"]);
    assert_refused(&ran, &["--out", "file"]);
    assert_eq!(out.names(), ["file", "folder.json"]);
    assert_eq!(fs::read_to_string(place).unwrap(), "older");
}

#[test]
#[cfg(unix)]
fn a_folder_without_permission() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    let out = Folder::new();
    let mode = |mode| fs::set_permissions(out.path(), fs::Permissions::from_mode(mode)).unwrap();
    mode(0o555);
    // Some users may write everywhere.
    if fs::write(out.path().join("probe"), "").is_err() {
        let place = out.at("x.json");
        let ran = folder.solve(CIRCLE, &["--walks", "9000000000000000", "--out", &place]);
        assert_refused(&ran, &["--out", "x.json", "cannot write there"]);
        let ran = fredholm(&["paper", "--out", out.path().to_str().unwrap()]);
        assert_refused(&ran, &["--out", "cannot write there"]);
        assert!(out.names().is_empty());
    }
    mode(0o755);
}

/// k²p must be contracting, or error bars mean nothing: with a reflectance of 0.99 everywhere that
/// is q0 < 1 − 0.99² = 0.0199.
#[test]
fn an_infinite_variance() {
    let mirror = circle_with("[0.3, 0.7]", "[0.99, 0.99]");
    let at = "0.2\n";
    let words = [
        "variance of a walk is infinite",
        "leave `absorption` out, or use one below 1.99e-2",
    ];
    refused(&mirror, at, &words);
    // Almost all light is absorbed on the way: few walks go far, and they weigh too much.
    let impatient = circle_with("absorption = 0.2", "absorption = 0.9");
    refused(
        &impatient,
        "0.9\n",
        &["infinite", "leave `absorption` out, or use one below"],
    );

    let folder = Folder::new();
    let few = ["--walks", "100", "--json"];
    let ran = folder.solve(
        &mirror,
        &[&few[..], &["--allow-infinite-variance"]].concat(),
    );
    assert_eq!(ran.status, Some(0), "{ran:?}");
    let patient = mirror.replace("absorption = 0.2", "absorption = 0.0198");
    assert_eq!(folder.solve(&patient, &few).status, Some(0));
    // One bright arc among dark ones is no reason to refuse: light that meets it seldom comes back.
    let one = circle_with("[0.3, 0.7]", "[0.99, 0.0]");
    assert_eq!(folder.solve(&one, &few).status, Some(0));
}

#[test]
fn emissions_whose_squares_leave_the_range() {
    for size in ["1e200", "1e-200", "-1e101"] {
        let words = ["`constant`", "1e-100 and 1e100", "another unit"];
        replaced(
            "constant = 5.0",
            &format!("constant = {size}"),
            size,
            &words,
        );
    }
    let ran = Folder::new().solve(
        &circle_with("constant = 5.0", "constant = 1e31"),
        &["--scalar", "f32"],
    );
    assert_refused(&ran, &["`constant`", "1e30", "f32"]);
}
