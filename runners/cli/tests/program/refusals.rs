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

#[test]
fn reflectances() {
    let values = "[0.3, 0.7]";
    replaced(values, "[]", "[]", &["`reflectance`", "at least one"]);
    replaced(values, "[0.3, nan]", "nan", &["`reflectance[1]`", "finite"]);
    for rho in ["1.0", "1", "-0.25", "1.5", "-1"] {
        let words = ["reflectance", "at least 0 and less than 1", "converge"];
        replaced(
            values,
            &format!("[0.125, {rho}]"),
            &format!("{rho}]"),
            &words,
        );
    }
    replaced(values, "[0.3, inf]", "inf", &["`reflectance[1]`", "finite"]);
    replaced(
        values,
        "\"a\"",
        "\"a\"",
        &["`reflectance`", "found a string"],
    );
    replaced(
        "reflectance = [0.3, 0.7]\n",
        "",
        "[problem]",
        &["`reflectance` is missing"],
    );
}

#[test]
fn emissions() {
    let table = "{ constant = 5.0, amplitude = 1.0, frequency = 5 }";
    replaced(table, "[]", "[]", &["`emission`", "at least one"]);
    replaced(table, "[1.0, nan]", "nan", &["`emission[1]`", "finite"]);
    replaced(
        "frequency = 5",
        "frequency = 0",
        "0 }",
        &["`frequency`", "at least 1"],
    );
    replaced(
        "frequency = 5",
        "frequency = 2.5",
        "2.5",
        &["`frequency`", "integer", "2.5"],
    );
    replaced(
        "constant = 5.0",
        "constant = inf",
        "inf",
        &["`constant`", "finite"],
    );
    replaced(
        ", amplitude = 1.0",
        "",
        "{ constant",
        &["`amplitude` is missing"],
    );
}

#[test]
fn cells() {
    let fits = ["multiple", "2 arcs", "6 or 8"];
    replaced("cells = 20", "cells = 7", "7\n", &fits);
    refused_flags(&["--cells", "7"], &[&["`--cells 7`"], &fits[..]].concat());
    // Arcs of the emission count too: 2 and 3 have 6.
    let problem = circle_with(
        "{ constant = 5.0, amplitude = 1.0, frequency = 5 }",
        "[1, 2, 3]",
    );
    refused(
        &problem,
        "20\n",
        &["multiple", "3 arcs of `emission`", "18 or 24"],
    );

    replaced(
        "cells = 20",
        "cells = 0",
        "0\ndegree",
        &["`cells`", "at least 1"],
    );
    replaced("cells = 20", "cells = -2", "-2", &["`cells`", "negative"]);
    replaced(
        "cells = 20",
        "cells = 2e1",
        "2e1",
        &["`cells`", "integer", "write 20"],
    );
    replaced(
        "cells = 20",
        "cells = 1000000000",
        "1000000000",
        &["`cells`", "at most 100000000", "memory"],
    );
    replaced(
        "cells = 20",
        "cells = 9223372036854775806",
        "9223372036854775806",
        &["`cells`", "at most"],
    );
    refused_flags(
        &["--cells", "1000000000"],
        &["--cells 1000000000", "memory"],
    );
    refused_flags(&["--cells", "0"], &["--cells 0", "at least 1"]);
    refused_flags(&["--cells", "many"], &["--cells", "many"]);
}

#[test]
fn degrees() {
    let degree = "from 0 to 4";
    replaced(
        "degree = 0",
        "degree = 5",
        "5\npairs",
        &["`degree`", degree],
    );
    refused_flags(&["--degree", "5"], &["--degree 5", degree]);
    let paper = fredholm(&["paper", "--degree", "5", "--max-walks", "10"]);
    assert_refused(&paper, &["--degree"]);
}

#[test]
fn walks() {
    replaced(
        "walks = 20000",
        "walks = 1e5",
        "1e5",
        &["`walks`", "write 100000"],
    );
    refused_flags(&["--walks", "1e5"], &["--walks", "1e5"]);
    for absorption in ["0", "1", "0.0", "1.0", "-0.2", "1.5"] {
        replaced(
            "absorption = 0.2",
            &format!("absorption = {absorption}"),
            &format!("{absorption}\nestimator"),
            &["`absorption`", "more than 0", "less than 1"],
        );
    }
    replaced(
        "absorption = 0.2",
        "absorption = nan",
        "nan",
        &["`absorption`", "finite"],
    );
    // Numbers which only one of the scalar types has.
    for absorption in ["1e-300", "0.999999999999"] {
        let problem = circle_with("\"f64\"", "\"f32\"").replace("0.2", absorption);
        refused(&problem, absorption, &["`absorption`", "f32", "f64"]);
    }
    replaced(
        "batch = 512",
        "batch = 0",
        "0\n\n[[target]]\nname = \"point\"",
        &["`batch`"],
    );
    replaced("seed = 1", "seed = -1", "-1", &["`seed`", "negative"]);
    replaced(
        "\"absorption\"",
        "\"colision\"",
        "\"colision\"",
        &["`estimator`", "did you mean \"collision\"?"],
    );
    replaced(
        "\"f64\"",
        "\"f16\"",
        "\"f16\"",
        &["`scalar`", "\"f32\" or \"f64\""],
    );
    replaced(
        "\"default\"",
        "\"all\"",
        "\"all\"\n\n[walk]",
        &["`pairs`", "pointwise"],
    );
    refused_flags(
        &["--estimator", "wrong"],
        &["--estimator", "absorption", "collision"],
    );
    refused_flags(&["--pairs", "wrong"], &["--pairs", "paper", "pointwise"]);
    refused_flags(&["--scalar", "wrong"], &["--scalar", "f32", "f64"]);
}

#[test]
fn targets() {
    let (head, _) = CIRCLE.split_once("[[target]]").unwrap();
    let folder = Folder::new();
    let ran = folder.solve(head, &["--json"]);
    assert_refused(&ran, &["at least one `[[target]]`"]);

    replaced(
        "\"mean\"",
        "\"point\"\n# two",
        "\"point\"\n# two",
        &["second target named \"point\"", "first is on line 20"],
    );
    replaced("\"mean\"", "\"\"", "\"\"", &["name", "empty"]);
    // A point of a grid has a name as well.
    let ran = folder.solve(&circle_with("\"mean\"", "\"profile[1]\""), &["--json"]);
    assert_refused(&ran, &["\"profile[1]\"", "grid"]);

    for angle in ["-0.1", "6.2831853071795865", "7", "1e300"] {
        replaced(
            "at = 0.3",
            &format!("at = {angle}"),
            &format!("{angle}\n"),
            &["angle `at`", "at least 0 and less than 2 pi"],
        );
    }
    replaced("at = 0.3", "at = nan", "nan", &["`at`", "finite"]);
    replaced(
        "[1.0, 4.0]",
        "[1.0, 7.0]",
        "7.0]",
        &["`over`", "from 0 to 2 pi"],
    );
    replaced(
        "[1.0, 4.0]",
        "[4.0, 1.0]",
        "1.0]",
        &["second angle", "more than the first"],
    );
    replaced("[1.0, 4.0]", "[4.0, 4.0]", "4.0]", &["more than the first"]);
    replaced("[1.0, 4.0]", "[1.0]", "[1.0]", &["`over`", "[from, to]"]);
    replaced("\"all\"", "\"some\"", "\"some\"", &["`over`", "\"all\""]);
    replaced("grid = 3", "grid = -0", "-0", &["`grid`", "from 1 to"]);
    replaced("grid = 3", "grid = 100001", "100001", &["`grid`", "100000"]);
    replaced(
        "grid = 3",
        "grid = 3\nat = 0.5",
        "at = 0.5",
        &["both `grid` and `at`"],
    );
}

#[test]
fn unknown_keys_are_shown_where_they_stand() {
    let keys = [
        (
            "reflectance =",
            "refelctance =",
            "[problem]",
            "`reflectance`",
        ),
        ("amplitude =", "amplitud =", "`emission`", "`amplitude`"),
        ("cells =", "cell =", "[galerkin]", "`cells`"),
        ("batch =", "bach =", "[walk]", "`batch`"),
        ("grid =", "gird =", "[[target]]", "`grid`"),
        ("[walk]", "[wlk]", "top level", "`walk`"),
    ];
    for (part, other, section, meant) in keys {
        let name = other.trim_matches(&['[', ']', ' ', '='][..]);
        let problem = circle_with(part, other);
        refused(
            &problem,
            name,
            &["unknown key", name, section, "did you mean", meant],
        );
    }
    // Nothing like it, behind keys that are all right: says what there is.
    let behind = [
        ("[problem]\n", "", "top level", "`galerkin`"),
        ("kind = \"circle\"", "\n", "[problem]", "`reflectance`"),
        ("frequency = 5", ", ", "`emission`", "`amplitude`"),
        ("cells = 20", "\n", "[galerkin]", "`degree`"),
        ("seed = 1", "\n", "[walk]", "`absorption`"),
        ("at = 0.3", "\n", "[[target]]", "`grid`"),
    ];
    for (part, joint, section, known) in behind {
        let other = match joint {
            "" => format!("temperature = 3\n{part}"),
            _ => format!("{part}{joint}temperature = 3"),
        };
        let words = ["unknown key `temperature`", section, "known here", known];
        replaced(part, &other, "temperature", &words);
    }
}

#[test]
fn kinds() {
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
    assert_refused(&fredholm(&["init", "square"]), &["square", "circle"]);
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
    refused_flags(&["--foo"], &["--foo"]);
    refused_flags(&["--cels", "20"], &["--cels", "--cells"]);
    refused_flags(&["--threads", "0"], &["--threads", "0"]);
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
    replaced(
        "seed = 1",
        "seed = 1\nrelative = true",
        "true",
        &["`target_error`"],
    );
    replaced(
        "seed = 1",
        "seed = 1\nrelative = false",
        "false",
        &["`target_error`"],
    );
    replaced(
        "seed = 1",
        "seed = 1\ntarget_error = 0",
        "0\nbatch",
        &["`target_error`"],
    );
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
        "leave `absorption` out, or use one below 2.00e-2",
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
