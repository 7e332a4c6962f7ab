//! Walks that draw from a sequence, where nothing is said of it.

use crate::common;

use common::{Folder, is_long, list, number};
use serde_json::Value;

/// A kink along x = y in three dimensions, where cells are few.
const KINK: &str = "[problem]\nkind = 'cube'\ndimension = 3\n\
    kernel = '0.3 * exp(-abs(x1 - y1) - abs(x2 - y2) - abs(x3 - y3))'\nsource = '1 + x1 * x2 * x3'\n\
    [walk]\ntarget_error = 5e-6\n[[target]]\nname = 'u'\nat = [0.3, 0.4, 0.7]\n[[target]]\nname = 'mean'\nover = 'all'\n";

/// KINK, which has a degree by day: to choose one takes most of the pilots.
fn kink() -> String {
    let degree = if is_long() {
        ""
    } else {
        "[galerkin]\ndegree = 2\n"
    };
    KINK.replace("[walk]\n", &format!("{degree}[walk]\n"))
}

/// The estimates agree, and their errors are below the target error.
fn assert_agree(a: &Value, b: &Value, error: f64) {
    for (a, b) in list(a, "targets").iter().zip(list(b, "targets")) {
        let [a, b] = [a, b].map(|target| &target["preconditioned"]);
        let errors = [a, b].map(|found| number(found, "std_error"));
        assert!(errors.iter().all(|found| *found <= error), "{errors:?}");
        let off = (number(a, "estimate") - number(b, "estimate")).abs();
        // Few targets: not one of ten thousand choices of seeds is beyond.
        assert!(off < 4.5 * errors[0].hypot(errors[1]), "{a} {b}");
    }
}

#[test]
fn a_sequence_is_chosen_where_it_pays() {
    let folder = Folder::new();
    let solve = |file: &str, flags: &[&str]| {
        let all: Vec<&str> = [&["--method", "walks", "--json", "--no-global"], flags].concat();
        folder.solve(file, &all).quietly(0).json()
    };
    let kink = kink();
    let chosen = solve(&kink, &[]);
    assert_eq!(chosen["sequence"], "sobol", "{chosen}");
    let all = |json: &Value, of: &str| -> f64 {
        list(json, "targets")
            .iter()
            .map(|target| number(target, of))
            .sum()
    };
    // As many walks as four times fewer states on the same cells: they are longer.
    let [cells, degree] = ["cells", "degree"].map(|key| chosen[key].to_string());
    let same = ["--cells", &cells, "--degree", &degree];
    let file = kink.replace("5e-6", "5e-6\nsequence = 'random'");
    let alone = solve(&file, &[&same[..], &["--walks", "100000000"]].concat());
    assert!(alone["sequence"].is_null(), "{alone}");
    assert_agree(&chosen, &alone, 5e-6);
    assert!(
        4.0 * all(&chosen, "walks") < all(&alone, "walks"),
        "{chosen} {alone}"
    );
    let predicted = |json: &Value| {
        let split = &json["split"];
        number(split, "predicted_setup_seconds") + number(split, "predicted_walk_seconds")
    };
    assert!(predicted(&chosen) < predicted(&alone), "{chosen} {alone}");
    // Without a sequence other cells are better, and take longer nevertheless.
    if is_long() {
        let random = solve(&kink, &["--sequence", "random"]);
        assert!(random["sequence"].is_null());
        assert_agree(&chosen, &random, 5e-6);
        assert!(predicted(&chosen) < predicted(&random), "{chosen} {random}");
    }
    for target in list(&chosen, "targets") {
        assert!(number(target, "replicates") >= 32.0, "{target}");
    }
    let threads = solve(&kink, &[&same[..], &["--threads", "1"]].concat());
    assert_eq!(threads["targets"], chosen["targets"]);
}

/// By the file as by the flag: the choice itself draws pseudo-random numbers for 1e-3, as the least number of walks is enough.
/// From a sequence it draws for 5e-6, where the test above asks for random numbers.
#[test]
fn a_sequence_that_is_asked_for_is_kept() {
    let folder = Folder::new();
    let solve = |said: &str, flags: &[&str]| {
        let file = KINK.replace("5e-6", &format!("1e-3\n{said}"));
        let all: Vec<&str> = [&["--json"], flags].concat();
        folder.solve(&file, &all).quietly(0).json()
    };
    let open = solve("", &[]);
    assert!(open["sequence"].is_null(), "{open}");
    let asked = solve("sequence = 'sobol'", &[]);
    assert_eq!(asked["sequence"], "sobol", "{asked}");
    for target in list(&asked, "targets") {
        assert!(number(target, "replicates") >= 32.0, "{target}");
    }
    assert_agree(&open, &asked, 1e-3);
    let flag = solve("", &["--sequence", "sobol"]);
    assert_eq!(flag["targets"], asked["targets"]);
    let over = solve("sequence = 'random'", &["--sequence", "sobol"]);
    assert_eq!(over["targets"], asked["targets"]);
}
