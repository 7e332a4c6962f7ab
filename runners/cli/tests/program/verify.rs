//! `fredholm verify`, and the page that it prints.

use crate::common;

use common::{fredholm, is_long, list, number};

/// The page in the documentation is the one that is printed, and every number agrees. With `FREDHOLM_LONG=1` the same
/// numbers are in the JSON, and one thread finds the same bits.
#[test]
fn the_page_is_what_is_printed() {
    let printed = fredholm(&["verify"]).quietly(0).stdout;
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/verify.md");
    let page = std::fs::read_to_string(folder).unwrap();
    assert!(
        page.contains(&format!("```text\n{printed}```\n")),
        "docs/verify.md is another: `cargo run --release -- verify` prints\n{printed}"
    );
    assert!(!printed.contains("DISAGREES"));
    let last = printed.lines().next_back().unwrap();
    let count: Vec<&str> = last.split(" of ").collect();
    assert!(
        matches!(count[..], [all, rest] if rest == format!("{all} numbers agree")),
        "{last}"
    );
    if !is_long() {
        return;
    }
    let json = fredholm(&["verify", "--json", "--threads", "1"])
        .quietly(0)
        .json();
    assert_eq!(json["agree"], true);
    let rows = list(&json, "rows");
    assert!(printed.ends_with(&format!("\n{0} of {0} numbers agree\n", rows.len())));
    for row in rows {
        assert_eq!(row["agrees"], true, "{row}");
        let case = row["case"].as_str().unwrap();
        assert!(printed.contains(row["source"].as_str().unwrap()), "{row}");
        let lines = printed
            .lines()
            .filter(|line| line.starts_with(&format!("{case}  ")));
        let error = row["std_error"].as_f64();
        match error {
            Some(error) => {
                // z is what it says, and the table has it.
                let z = (number(row, "got") - number(row, "expected")) / error;
                assert_eq!(z, number(row, "z"));
                let mut same = lines.filter(|line| line.contains(&format!(" {z:.1} ")));
                assert!(same.next().is_some(), "{case}: {z}");
                // A control variate that does nothing would show here: every case gains.
                assert!(error < number(&row["plain"], "std_error"), "{row}");
            }
            None => assert!(row["plain"].is_null() && lines.count() == 1, "{row}"),
        }
    }
}

#[test]
fn its_help_teaches() {
    let help = fredholm(&["verify", "--help"]).quietly(0).stdout;
    for word in [
        "published",
        "standard errors",
        "Exit status",
        "--json",
        "--threads",
    ] {
        assert!(help.contains(word), "{word}: {help}");
    }
    let ran = fredholm(&["verify", "everything"]);
    assert_eq!(ran.status, Some(2), "{ran:?}");
}
