//! What `fredholm solve` answers: its fields, its bits, and when it stops.

use crate::common;

use core::time::Duration;
use std::fs;
use std::thread::sleep;

use common::{
    CIRCLE, Folder, Ran, circle_with, command, is_long, keys, list, number, signal, wait,
};
use serde_json::Value;

/// More walks than any machine finishes.
const ENDLESS: &str = "9000000000000000";

/// `CIRCLE` with the ways in which walks end: with constant absorption and both estimators, and by roulette.
fn endings() -> [String; 3] {
    let line = "estimator = \"absorption\"\n";
    let roulette = circle_with(&format!("absorption = 0.2\n{line}"), "");
    [CIRCLE.to_owned(), circle_with(line, ""), roulette]
}

/// The targets of a report.
fn targets(report: &Value) -> &[Value] {
    list(report, "targets")
}

/// Asserts that both estimates of every target have std_error = std_dev/sqrt(walks), the walks all
/// ended somehow, and the known solution lies within five standard errors.
fn assert_sound(report: &Value) {
    for target in targets(report) {
        let walks = number(target, "walks");
        let endings = &target["endings"];
        let ended = number(endings, "absorbed") + number(endings, "step_limit");
        assert_eq!(ended, walks, "{target}");
        for kind in ["plain", "preconditioned"] {
            let estimate = &target[kind];
            let error = number(estimate, "std_error");
            let expected = number(estimate, "std_dev") / walks.sqrt();
            assert!((error / expected - 1.0).abs() < 1e-12, "{target}");
            if let Some(exact) = target["exact"].as_f64() {
                let distance = (number(estimate, "estimate") - exact).abs();
                let floor = number(target, "rounding_floor");
                assert!(distance <= 5.0 * error.max(floor), "{target}");
            }
        }
    }
}

#[test]
fn the_document_has_every_promised_field() {
    let ran = Folder::new().solve(CIRCLE, &["--json"]).quietly(0);
    assert!(ran.stdout.ends_with("}\n") && ran.stdout.starts_with('{'));
    let report = ran.json();
    let words = [
        ("problem", "circle"),
        ("pairs", "default"),
        ("estimator", "absorption"),
        ("scalar", "f64"),
    ];
    for (key, word) in words {
        assert_eq!(report[key], word);
    }
    assert!(!report["generator"].as_str().unwrap().is_empty());
    for (key, count) in [("cells", 20), ("degree", 0), ("batch", 512), ("seed", 1)] {
        assert_eq!(report[key], count);
    }
    assert!(number(&report, "setup_seconds") >= 0.0);
    assert!(number(&report, "walk_seconds") > 0.0);

    let names: Vec<_> = targets(&report).iter().map(|t| &t["name"]).collect();
    let expected = [
        "point",
        "mean",
        "half",
        "profile[0]",
        "profile[1]",
        "profile[2]",
    ];
    assert_eq!(names, expected);
    // A walk visits 1/q0 = 5 states on average.
    let states = number(&report, "states");
    assert!((states / (6.0 * 20_000.0) - 5.0).abs() < 0.1, "{states}");
    for target in targets(&report) {
        assert_eq!(target["walks"], 20_000);
        assert_eq!(keys(&target["endings"]), ["absorbed", "step_limit"]);
        assert_eq!(target["endings"]["absorbed"], 20_000);
        for key in ["exact", "galerkin", "rounding_floor"] {
            assert!(number(target, key) > 0.0);
        }
        for kind in ["plain", "preconditioned"] {
            for key in ["estimate", "std_error", "std_dev"] {
                assert!(number(&target[kind], key) > 0.0);
            }
        }
        // The neighbour equation is what the program is for.
        let deviation = |kind: &str| number(&target[kind], "std_dev");
        assert!(deviation("preconditioned") < 0.3 * deviation("plain"));
    }
    // C + D sin(5 s), and its means.
    let exact = |i: usize| number(&targets(&report)[i], "exact");
    assert!((exact(0) - (5.0 + (1.5_f64).sin())).abs() < 1e-13);
    assert!((exact(1) - 5.0).abs() < 1e-13);
    let half = 5.0 + ((5.0_f64).cos() - (20.0_f64).cos()) / 15.0;
    assert!((exact(2) - half).abs() < 1e-13);
}

#[test]
fn estimates_lie_around_the_solution() {
    let folder = Folder::new();
    for problem in endings() {
        for scalar in ["f64", "f32"] {
            for pairs in ["default", "paper"] {
                let args = ["--scalar", scalar, "--pairs", pairs, "--json"];
                let ran = folder.solve(&problem, &args);
                assert_eq!(ran.status, Some(0), "{ran:?}");
                assert_sound(&ran.json());
            }
        }
    }
}

#[test]
fn the_table_is_for_people() {
    let ran = Folder::new().solve(CIRCLE, &[]).quietly(0);
    for part in [
        "20 cells",
        "point",
        "profile[2]",
        "preconditioned",
        " ± ",
        "120000 walks",
    ] {
        assert!(ran.stdout.contains(part), "{part}: {}", ran.stdout);
    }
    assert!(!ran.stdout.contains('\u{1b}'), "no colours in a pipe");
}

#[test]
fn what_is_unknown_is_null() {
    let folder = Folder::new();
    let formula = "{ constant = 5.0, amplitude = 1.0, frequency = 5 }";
    let ran = folder.solve(&circle_with(formula, "[1.0, 0.0]"), &["--json"]);
    let report = ran.quietly(0).json();
    assert!(targets(&report).iter().all(|t| t["exact"].is_null()));
    assert_sound(&report);

    let dark = circle_with(formula, "0");
    let ran = folder.solve(&dark, &["--json"]);
    let report = ran.warning(0, &["no walk scored anything"]).json();
    for target in targets(&report) {
        assert!(target["exact"].is_null());
        for kind in ["plain", "preconditioned"] {
            assert_eq!(target[kind]["estimate"], 0.0);
            assert!(target[kind]["std_error"].is_null(), "{target}");
        }
    }
    let ran = folder.solve(&dark, &[]).warning(0, &["6 targets"]);
    assert!(ran.stdout.contains("nothing scored"));
    assert!(!ran.stdout.contains("± 0"));

    // One walk has no deviation.
    let report = folder
        .solve(CIRCLE, &["--walks", "1", "--json"])
        .quietly(0)
        .json();
    for target in targets(&report) {
        assert_eq!(target["walks"], 1);
        assert!(target["plain"]["std_dev"].is_null());
        assert!(target["preconditioned"]["std_error"].is_null());
    }
    let ran = folder.solve(CIRCLE, &["--walks", "1"]).quietly(0);
    assert!(!ran.stdout.contains("nothing scored"), "{}", ran.stdout);
}

#[test]
fn bits_do_not_depend_on_threads() {
    let folder = Folder::new();
    for problem in endings() {
        let stops = [
            &["--walks", "20001"][..],
            &["--walks", "200000", "--target-error", "5e-3"],
        ];
        for (number, scalar) in ["f64", "f32"].into_iter().enumerate() {
            for (own, stop) in stops.into_iter().enumerate() {
                // By day each scalar has a stop of its own.
                if own != number && !is_long() {
                    continue;
                }
                let of = |threads| {
                    let common = ["--json", "--scalar", scalar, "--threads", threads];
                    let ran = folder.solve(&problem, &[&common[..], stop].concat());
                    ran.quietly(0).timeless()
                };
                let one = of("1");
                for threads in ["2", "3", "7"] {
                    assert_eq!(of(threads), one, "{threads} {scalar} {stop:?} {problem}");
                }
            }
        }
    }
}

#[test]
fn other_seeds_have_other_bits() {
    let folder = Folder::new();
    let estimate = |seed| {
        let ran = folder.solve(CIRCLE, &["--json", "--seed", seed]);
        targets(&ran.quietly(0).json())[0]["plain"]["estimate"].clone()
    };
    assert_eq!(estimate("1"), estimate("1"));
    assert_ne!(estimate("1"), estimate("2"));
}

#[test]
fn plain_estimates_know_nothing_of_the_cells() {
    let folder = Folder::new();
    let plain = |problem: &str, args: &[&str]| -> Vec<String> {
        let ran = folder.solve(problem, &[args, &["--json"]].concat());
        assert_eq!(ran.status, Some(0), "{ran:?}");
        let report = ran.json();
        let all = targets(&report).iter();
        all.map(|target| target["plain"].to_string()).collect()
    };
    for (scalar, by_day) in [("f64", 0), ("f32", 2)] {
        // By day single precision has the last ending alone.
        let skipped = if is_long() { 0 } else { by_day };
        for problem in endings().into_iter().skip(skipped) {
            let first = plain(&problem, &["--scalar", scalar]);
            for (cells, pairs) in [("2", "paper"), ("64", "pointwise"), ("1000", "default")] {
                let args = ["--scalar", scalar, "--cells", cells, "--pairs", pairs];
                assert_eq!(plain(&problem, &args), first, "{args:?}");
            }
        }
    }
}

#[test]
fn a_batch_size_counts_the_same_walks() {
    let folder = Folder::new();
    let estimate = |batch: &str| {
        let problem = circle_with("batch = 512", &format!("batch = {batch}"));
        let report = folder.solve(&problem, &["--json"]).quietly(0).json();
        assert_eq!(report["batch"].to_string(), batch);
        number(&targets(&report)[0]["plain"], "estimate")
    };
    let first = estimate("512");
    for batch in ["1", "7", "4096", "20000", "1000000000"] {
        let other = estimate(batch);
        assert!((other / first - 1.0).abs() < 1e-12, "{batch}: {other}");
    }
}

#[test]
fn flags_override_the_file() {
    let folder = Folder::new();
    let overrides = [
        ("--cells", "cells", "40"),
        ("--degree", "degree", "0"),
        ("--pairs", "pairs", "\"paper\""),
        ("--estimator", "estimator", "\"collision\""),
        ("--scalar", "scalar", "\"f32\""),
        ("--seed", "seed", "9223372036854775807"),
    ];
    for (flag, key, value) in overrides {
        let ran = folder.solve(CIRCLE, &[flag, value.trim_matches('"'), "--json"]);
        let report = ran.quietly(0).json();
        assert_eq!(report[key].to_string(), value);
    }
    let ran = folder.solve(CIRCLE, &["--walks", "777", "--json"]);
    let report = ran.quietly(0).json();
    assert!(targets(&report).iter().all(|t| t["walks"] == 777));

    // A flag and the file's key are the same thing.
    let in_file = circle_with("walks = 20000", "walks = 777");
    let from_file = folder.solve(&in_file, &["--json"]).quietly(0);
    let ran = folder.solve(CIRCLE, &["--walks", "777", "--json"]);
    assert_eq!(ran.timeless(), from_file.timeless());

    // A good flag stands for a bad value.
    let bad = circle_with("cells = 20", "cells = 7");
    let report = folder
        .solve(&bad, &["--cells", "6", "--json"])
        .quietly(0)
        .json();
    assert_eq!(report["cells"], 6);
}

#[test]
fn cells_are_found_where_there_are_none() {
    let problem = circle_with("cells = 20\ndegree = 0\n", "degree = 4\n");
    let problem = problem.replace("[0.3, 0.7]", "[0.3, 0.7, 0.1]");
    let ran = Folder::new().solve(&problem, &["--json"]).quietly(0);
    // Every arc has as many.
    let cells = number(&ran.json(), "cells");
    assert!(cells > 0.0 && cells % 3.0 == 0.0, "{cells}");
}

#[test]
fn a_target_error_is_reached() {
    let folder = Folder::new();
    let solve = |args: &[&str], status| {
        let args = [args, &["--json", "--walks", "1000000"]].concat();
        let ran = folder.solve(CIRCLE, &args);
        assert_eq!(ran.status, Some(status), "{ran:?}");
        ran
    };
    let error = |target: &Value| number(&target["preconditioned"], "std_error");

    let report = solve(&["--target-error", "0.003"], 0).json();
    for target in targets(&report) {
        assert!(error(target) <= 0.003, "{target}");
        assert!(number(target, "walks") < 1e6);
    }
    assert_sound(&report);

    let report = solve(&["--target-error", "0.001", "--relative"], 0).json();
    for target in targets(&report) {
        let estimate = number(&target["preconditioned"], "estimate");
        assert!(error(target) <= 0.001 * estimate.abs(), "{target}");
        assert!(number(target, "walks") < 1e6);
    }
    // Estimates are about 5, so a relative error is the larger.
    let absolute = solve(&["--target-error", "0.002"], 0).json();
    let walks = |report: &Value| number(&targets(report)[0], "walks");
    assert!(walks(&report) < walks(&absolute));

    // The file's keys do the same.
    let keys = "walks = 1000000\ntarget_error = 1e-3\nrelative = true";
    let in_file = circle_with("walks = 20000", keys);
    let ran = folder.solve(&in_file, &["--json"]).quietly(0);
    let flags = solve(&["--target-error", "1e-3", "--relative"], 0);
    assert_eq!(ran.timeless(), flags.timeless());
}

#[test]
fn a_target_error_out_of_reach_is_said() {
    let folder = Folder::new();
    let args = ["--target-error", "1e-9", "--walks", "10000"];
    let ran = folder.solve(CIRCLE, &[&args[..], &["--json"]].concat());
    let ran = ran.warning(3, &["error was not reached", "10000"]);
    let report = ran.json();
    assert!(targets(&report).iter().all(|t| t["walks"] == 10_000));
    assert_sound(&report);

    let ran = folder.solve(CIRCLE, &args).warning(3, &["not reached"]);
    assert!(ran.stdout.contains("profile[2]"));
}

#[test]
fn a_time_limit_ends_the_walks() {
    let folder = Folder::new();
    let endless = ["--walks", ENDLESS, "--time-limit", "0.2"];
    let early = |ran: &Ran| {
        let report = ran.json();
        for target in targets(&report) {
            let walks = number(target, "walks");
            assert!((1.0..9e15).contains(&walks), "{target}");
        }
        assert_sound(&report);
        assert!(ran.time < Duration::from_secs(20), "{:?}", ran.time);
    };
    let ran = folder.solve(CIRCLE, &[&endless[..], &["--json"]].concat());
    early(&ran.warning(0, &["time limit"]));
    // One batch is longer than the limit.
    let one = circle_with("batch = 512", "batch = 1000000000")
        .replace("[[target]]\nname = \"profile\"\ngrid = 3\n", "")
        .replace("[[target]]\nname = \"half\"\nover = [1.0, 4.0]\n", "")
        .replace("[[target]]\nname = \"mean\"\nover = \"all\"\n", "");
    let args = [&endless[..], &["--json", "--threads", "1"]].concat();
    early(&folder.solve(&one, &args).warning(0, &["time limit"]));

    let args = [&endless[..], &["--json", "--target-error", "1e-12"]].concat();
    early(&folder.solve(CIRCLE, &args).warning(3, &["time limit"]));
    // A limit that is not met changes nothing.
    let ran = folder.solve(CIRCLE, &["--json", "--time-limit", "1e6"]);
    let without = folder.solve(CIRCLE, &["--json"]).quietly(0);
    assert_eq!(ran.quietly(0).timeless(), without.timeless());
}

#[test]
#[cfg(unix)]
fn an_interrupt_prints_what_is_there() {
    let folder = Folder::new();
    let problem = folder.file("problem.toml", CIRCLE);
    let out = Folder::new();
    let result = out.at("result.json");
    let args = ["solve", &problem, "--json", "--walks", ENDLESS];
    let args = [&args[..], &["--out", &result]].concat();
    let child = command(&args).spawn().unwrap();
    // The temporary file is there shortly before interrupts are caught.
    while out.names().is_empty() {
        sleep(Duration::from_millis(5));
    }
    sleep(Duration::from_millis(500));
    signal("INT", child.id());
    let ran = wait(child).warning(130, &["interrupted"]);
    let report = ran.json();
    assert!(targets(&report).iter().all(|t| number(t, "walks") > 0.0));
    assert_sound(&report);
    assert_eq!(out.names(), ["result.json"]);
    assert_eq!(fs::read_to_string(&result).unwrap(), ran.stdout);
}

/// Every degree and all pairs, with as many threads: within five standard errors or the rounding floor, and the
/// same bits.
#[test]
fn degrees_sharpen_the_estimate() {
    let folder = Folder::new();
    let mut before = f64::INFINITY;
    for degree in ["0", "1", "2", "3", "4"] {
        let flags = [
            "--json", "--degree", degree, "--cells", "200", "--walks", "4000",
        ];
        let report = folder.solve(CIRCLE, &flags).json();
        assert_sound(&report);
        assert_eq!(report["degree"].to_string(), degree);
        let target = &targets(&report)[0];
        let deviation = number(&target["preconditioned"], "std_dev");
        assert!(deviation < 0.1 * before, "degree {degree}: {deviation}");
        before = deviation;
        let with = |pairs| {
            let mut flags = flags.to_vec();
            flags.extend(["--pairs", pairs]);
            folder.solve(CIRCLE, &flags)
        };
        assert_sound(&with("pointwise").json());
        if degree != "0" {
            // 4000 walks make a step within a cell or none: an error bar without one would be a lie.
            let refused = with("paper");
            assert_eq!(refused.status, Some(2));
            assert!(
                refused.stderr.contains("leaves steps within a cell out"),
                "{refused:?}"
            );
        }
        let bits = |threads| {
            let mut flags = flags.to_vec();
            flags.extend(["--threads", threads]);
            folder.solve(CIRCLE, &flags).json()["targets"].to_string()
        };
        assert_eq!(bits("1"), bits("3"));
    }
}

/// No walks: values of cells alone.
#[test]
fn no_walks_are_needed() {
    let folder = Folder::new();
    let cube = "[problem]\nkind = 'cube'\ndimension = 1\nkernel = '2 * exp(-(x - y)^2)'\nsource = '1 + x'\n\
                [[target]]\nname = 'u'\nat = 0.3\n";
    for (problem, method, exact) in [
        (cube, "resolvent", -2.443_115_819_070_29),
        (CIRCLE, "walks", f64::NAN),
    ] {
        let report = folder
            .solve(problem, &["--walks", "0", "--json"])
            .quietly(0);
        let report = report.json();
        assert_eq!(
            (&report["method"], &report["stop"]),
            (&method.into(), &"done".into())
        );
        let target = &list(&report, "targets")[0];
        assert!(target["preconditioned"]["std_error"].is_null(), "{target}");
        let value = number(target, "galerkin");
        assert!(exact.is_nan() || (value - exact).abs() < 1e-9, "{value}");
    }
}
