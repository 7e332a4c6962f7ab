//! View2D decks: where errors are, combined surfaces, subsurfaces, crossing baffles.

use crate::common;

use common::{Folder, fredholm, list};

#[test]
fn decks_are_told_by_their_lines() {
    let folder = Folder::new();
    let deck = "C 1\nG 2\nV 1 0 0\nV 2 1 0\nV 3 1 1\nV 4 0 1\nV 5 0 0.9\nS 1 1 2 0 0 0 0.9 floor\n\
                S 2 2 3 0 0 0 0.5 right\nS 3 3 4 0 0 0 0.9 top\nS 4 4 5 0 0 0 1.0 left\nEnd of data\n";
    let path = folder.file("gap.vs2", deck);
    common::refused(
        &fredholm(&["factors", &path]),
        &[
            "gap.vs2:8:1: ",
            "set `encl` to 0",
            "gap of 9.000e-1",
            "8 | S 1 1 2",
        ],
    );
    let file = "[problem]\nkind = 'room'\ndeck = 'gap.vs2'\n[[target]]\nname = 'a'\nover = 'all'\n";
    let ran = folder.solve(file, &[]);
    for word in ["gap.vs2:8:1: ", "`open = true`"] {
        assert!(ran.stderr.contains(word), "{word}: {ran:?}");
    }
    for command in ["solve", "check"] {
        common::refused(&fredholm(&[command, &path]), &["is a View2D deck"]);
    }
}

/// The form factors of a deck: row by row, with names.
fn factors_of(folder: &Folder, deck: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let path = folder.file("factors.vs2", deck);
    let json = fredholm(&["factors", &path, "--json"]).quietly(0).json();
    let name = |name: &serde_json::Value| name.as_str().unwrap().to_owned();
    let row = |row: &serde_json::Value| {
        row.as_array()
            .unwrap()
            .iter()
            .map(|f| f.as_f64().unwrap())
            .collect()
    };
    let names = list(&json, "surfaces").iter().map(name).collect();
    (names, list(&json, "factors").iter().map(row).collect())
}

/// A rectangle of 2 by 1 whose floor is drawn in two parts, of which the second is combined with the first or is a window in the
/// first: factors are those of the floor as one segment, and of the window as one of its own.
#[test]
fn surfaces_of_decks_are_combined() {
    let folder = Folder::new();
    let deck = |floor: &str| {
        format!(
            "C 1\nG 2\nV 1 0 0\nV 2 2 0\nV 3 2 1\nV 4 0 1\nV 5 0.5 0\nV 6 1.25 0\n{floor}\
             S 7 2 3 0 0 0 0.9 east\nS 8 3 4 0 0 0 0.9 top\nS 9 4 1 0 0 0 0.9 west\nEnd of data\n"
        )
    };
    let assert_same = |one: &[f64], other: &[f64]| {
        assert_eq!(one.len(), other.len());
        for (a, b) in one.iter().zip(other) {
            assert!((a - b).abs() < 1e-14, "{one:?} {other:?}");
        }
    };
    let (names, whole) = factors_of(&folder, &deck("S 1 1 2 0 0 0 0.9 floor\n"));
    assert_eq!(names, ["floor", "east", "top", "west"]);
    let parts = "S 1 1 5 0 0 0 0.9 floor\nS 2 5 6 0 0 1 0.9 middle\nS 3 6 2 0 0 2 0.9 rest\n";
    let (same, combined) = factors_of(&folder, &deck(parts));
    assert_eq!(same, names);
    for (one, other) in whole.iter().zip(&combined) {
        assert_same(one, other);
    }
    let window = "S 1 1 2 0 0 0 0.9 floor\nS 2 5 6 0 1 0 0.9 window\n";
    let (found, with_window) = factors_of(&folder, &deck(window));
    assert_eq!(found, ["floor", "window", "east", "top", "west"]);
    let apart = "S 1 1 5 0 0 0 0.9 floor\nS 2 5 6 0 0 0 0.9 window\nS 3 6 2 0 0 1 0.9 rest\n";
    let (_, expected) = factors_of(&folder, &deck(apart));
    for (one, other) in with_window.iter().zip(&expected) {
        assert_same(one, other);
    }
    assert!(with_window[1][3] > 0.4 && with_window[0][1] == 0.0);
    for (floor, words) in [
        (
            "S 1 2 1 0 0 0 0.9 floor\nS 2 5 6 0 1 0 0.9 window\n",
            "face in the same direction",
        ),
        (
            "S 1 1 2 0 0 0 0.9 floor\nS 2 5 4 0 1 0 0.9 window\n",
            "must lie on its base \"floor\"",
        ),
        (
            "S 1 1 2 0 0 0 0.9 floor\nS 2 1 2 0 1 0 0.9 window\n",
            "cover it wholly",
        ),
        (
            "S 1 1 2 0 0 0 0.9 floor\nS 2 1 6 0 1 0 0.9 a\nS 3 5 2 0 1 0 0.9 b\n",
            "lies on another subsurface",
        ),
        ("S 1 1 2 0 0 5 0.9 floor\n", "no surface 5 above this line"),
    ] {
        let ran = fredholm(&["factors", &folder.file("wrong.vs2", deck(floor))]);
        assert_eq!(ran.status, Some(2), "{ran:?}");
        assert!(
            ran.stderr.contains(words) && ran.stderr.contains("wrong.vs2:"),
            "{ran:?}"
        );
    }
    let file =
        "[problem]\nkind = 'room'\ndeck = 'factors.vs2'\n[[target]]\nname = 'a'\nover = 'all'\n";
    common::refused(&folder.solve(file, &[]), &["are for `fredholm factors`"]);
}

/// Two baffles on the diagonals of a square, each of two sides, are cut where they cross: every wall sees the two halves that are
/// its triangle's other sides, each with half of its view.
#[test]
fn baffles_of_decks_may_cross() {
    let folder = Folder::new();
    let deck = "C 1\nG 2\nV 1 0 0\nV 2 1 0\nV 3 1 1\nV 4 0 1\nS 1 1 2 0 0 0 0.9 floor\nS 2 2 3 0 0 0 0.9 east\n\
        S 3 3 4 0 0 0 0.9 top\nS 4 4 1 0 0 0 0.9 west\nS 5 1 3 0 0 0 0.9 up\nS 6 3 1 0 0 0 0.9 up, below\n\
        S 7 4 2 0 0 0 0.9 down\nS 8 2 4 0 0 0 0.9 down, below\nEnd of data\n";
    let (names, factors) = factors_of(&folder, deck);
    assert_eq!(names.len(), 8);
    let root = 0.5_f64.sqrt();
    for (name, row) in names.iter().zip(&factors) {
        assert!(
            (row.iter().sum::<f64>() - 1.0).abs() < 1e-13,
            "{name} {row:?}"
        );
    }
    // The left side of what goes up from the left sees the top and the west, and both sides of the other.
    let expected = [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.5],
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.5, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.5],
    ];
    for (row, expected) in factors.iter().zip(expected) {
        for (found, expected) in row.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-13, "{factors:?}");
        }
    }
    // Half of a baffle, from the corner of a triangle whose sides are √½, √½ and 1.
    assert!(
        (factors[4][6] - 0.5 * (1.0 - root)).abs() < 1e-13,
        "{factors:?}"
    );
    assert!((factors[4][2] - 0.5 * root).abs() < 1e-13, "{factors:?}");
    // One that goes through a wall is refused.
    let through = deck.replace("V 4 0 1\n", "V 4 0 1\nV 5 1.5 1.25\n");
    let through = through
        .replace("S 5 1 3", "S 5 1 5")
        .replace("S 6 3 1", "S 6 5 1");
    common::refused(
        &fredholm(&["factors", &folder.file("through.vs2", through)]),
        &["split them where they meet"],
    );
}

/// A wall that an obstacle covers wholly gives nothing and receives nothing, and a note says so.
#[test]
fn what_is_covered_has_no_factors() {
    let folder = Folder::new();
    let deck = "C 1\nG 2\nV 1 0 0\nV 2 1 0\nV 3 1 1\nV 4 0 1\nV 5 0.6 0.5\nS 1 1 2 0 0 0 0.9 floor\n\
                S 2 2 3 0 0 0 0.9 right\nS 3 3 4 0 0 0 0.9 top\nS 4 4 1 0 0 0 0.9 left\nS 5 2 5 0 0 0 0.9 low\n\
                S 6 5 3 0 0 0 0.9 high\nEnd of data\n";
    let path = folder.file("covered.vs2", deck);
    let ran = fredholm(&["factors", &path, "--json"]);
    for word in ["note: ", "\"right\"", "is covered by"] {
        assert!(ran.stderr.contains(word), "{word}: {ran:?}");
    }
    let rows = ran.json();
    let sums = list(&rows, "factors").iter().map(|row| {
        let numbers = row.as_array().unwrap().iter();
        numbers.map(|f| f.as_f64().unwrap()).sum::<f64>()
    });
    for (number, sum) in sums.enumerate() {
        let expected = if number == 1 { 0.0 } else { 1.0 };
        assert!((sum - expected).abs() < 1e-12, "{number}: {sum}");
    }
}
