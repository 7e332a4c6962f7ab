//! Walks that draw from a sequence, or follow a lift, where nothing is said of it.

use crate::common;

use common::{Folder, list, number};
use serde_json::Value;

/// A kink along x = y in three dimensions, where cells are few.
const KINK: &str = "[problem]\nkind = 'cube'\ndimension = 3\n\
    kernel = '0.3 * exp(-abs(x1 - y1) - abs(x2 - y2) - abs(x3 - y3))'\nsource = '1 + x1 * x2 * x3'\n\
    [walk]\ntarget_error = 5e-6\n[[target]]\nname = 'u'\nat = [0.3, 0.4, 0.7]\n[[target]]\nname = 'mean'\nover = 'all'\n";

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
        let all: Vec<&str> = [&["--json", "--no-global"], flags].concat();
        folder.solve(file, &all).quietly(0).json()
    };
    let chosen = solve(KINK, &[]);
    let random = solve(KINK, &["--sequence", "random"]);
    assert_eq!(chosen["sequence"], "sobol", "{chosen}");
    assert!(random["sequence"].is_null());
    assert_agree(&chosen, &random, 5e-6);
    let all = |json: &Value, of: &str| -> f64 {
        list(json, "targets")
            .iter()
            .map(|target| number(target, of))
            .sum()
    };
    // As many walks as four times fewer states: they are longer.
    assert!(
        4.0 * all(&chosen, "walks") < all(&random, "walks"),
        "{chosen} {random}"
    );
    for target in list(&chosen, "targets") {
        assert!(number(target, "replicates") >= 32.0, "{target}");
    }
    let threads = solve(KINK, &["--threads", "1"]);
    assert_eq!(threads["targets"], chosen["targets"]);
}

/// By the file as by the flag: the choice itself draws pseudo-random numbers for 1e-3, as the least number of walks is enough,
/// and from a sequence for 5e-6.
#[test]
fn a_sequence_that_is_asked_for_is_kept() {
    let folder = Folder::new();
    let solve = |error: &str, said: &str, flags: &[&str]| {
        let file = KINK.replace("5e-6", &format!("{error}\n{said}"));
        let all: Vec<&str> = [&["--json"], flags].concat();
        folder.solve(&file, &all).quietly(0).json()
    };
    let open = solve("1e-3", "", &[]);
    assert!(open["sequence"].is_null(), "{open}");
    let asked = solve("1e-3", "sequence = 'sobol'", &[]);
    assert_eq!(asked["sequence"], "sobol", "{asked}");
    for target in list(&asked, "targets") {
        assert!(number(target, "replicates") >= 32.0, "{target}");
    }
    assert_agree(&open, &asked, 1e-3);
    let flag = solve("1e-3", "", &["--sequence", "sobol"]);
    assert_eq!(flag["targets"], asked["targets"]);
    let over = solve("1e-3", "sequence = 'random'", &["--sequence", "sobol"]);
    assert_eq!(over["targets"], asked["targets"]);
    let random = solve("5e-6", "sequence = 'random'", &["--no-global"]);
    assert!(random["sequence"].is_null(), "{random}");
}

/// A smooth kernel and an error that degree 4 takes many cells for.
const SMOOTH: &str = "[problem]\nkind = 'cube'\ndimension = 2\nkernel = '0.5 * exp(-(x1 - y1)^2 - (x2 - y2)^2)'\n\
    source = '1 + x1 * x2'\n[walk]\ntarget_error = 1e-10\n[[target]]\nname = 'u'\nat = [0.3, 0.4]\n";

#[test]
fn a_lift_is_chosen_where_it_pays() {
    let folder = Folder::new();
    let solve = |flags: &[&str]| {
        let all: Vec<&str> = [&["--json", "--method", "walks"], flags].concat();
        folder.solve(SMOOTH, &all).quietly(0).json()
    };
    let (chosen, without) = (solve(&[]), solve(&["--lift", "0"]));
    assert_eq!(chosen["lift"], 6, "{chosen}");
    assert!(without["lift"].is_null(), "{without}");
    assert!(number(&chosen, "unknowns") < number(&without, "unknowns"));
    assert_agree(&chosen, &without, 1e-10);
    let threads = solve(&["--threads", "1"]);
    assert_eq!(threads["targets"], chosen["targets"]);
}

/// A kink along x = y in two dimensions: what a lift leaves is smooth on cells, and a sequence gains on it.
#[test]
fn a_lift_and_a_sequence_are_chosen_together() {
    let folder = Folder::new();
    let solve = |error: &str, flags: &[&str]| {
        let file = SMOOTH.replace("-(x1 - y1)^2 - (x2 - y2)^2", "-abs(x1 - y1) - abs(x2 - y2)");
        let file = file.replace("1e-10", error);
        let all: Vec<&str> = [&["--json", "--method", "walks"], flags].concat();
        folder.solve(&file, &all).quietly(0).json()
    };
    let both = solve("1e-8", &[]);
    assert_eq!(
        (&both["lift"], &both["sequence"]),
        (&6.into(), &"sobol".into()),
        "{both}"
    );
    assert!(
        number(&list(&both, "targets")[0], "replicates") >= 32.0,
        "{both}"
    );
    // By a lift alone.
    let lifted = solve("1e-7", &["--sequence", "random"]);
    assert_eq!(lifted["lift"], 6, "{lifted}");
    assert_agree(&both, &lifted, 1e-7);
    let (split, other) = (&both["split"], &lifted["split"]);
    let seconds = "predicted_walk_seconds";
    assert!(
        number(split, seconds) < number(other, seconds),
        "{split} {other}"
    );
    let threads = solve("1e-8", &["--threads", "1"]);
    assert_eq!(threads["targets"], both["targets"]);
}
