//! What a shell and a terminal meet: names, numbers of flags, the standard input, links, help.

use crate::common;

use std::io::Write;
use std::process::Stdio;

use common::{CIRCLE, Folder, circle_with, command, fredholm, list, wait};

#[test]
fn names_can_be_shown() {
    let folder = Folder::new();
    for name in ["\"a\\u001b[31m\"", "\"a\\nb\"", "\"\\u0001\""] {
        let ran = folder.solve(&circle_with("\"profile\"", name), &[]);
        assert_eq!(ran.status, Some(2), "{ran:?}");
        assert!(ran.stderr.contains("control characters"), "{ran:?}");
        assert!(!ran.stderr.contains('\u{1b}'), "{ran:?}");
    }
}

#[test]
fn numbers_of_flags_are_told_how_to_be_written() {
    let folder = Folder::new();
    for (flag, number, advice) in [
        ("--walks", "1e6", "write 1000000"),
        ("--walks", "-5", "must not be negative"),
        ("--cells", "2.5", "must be an integer"),
        ("--seed", "1e3", "write 1000"),
    ] {
        common::refused(&folder.solve(CIRCLE, &[flag, number]), &[advice]);
    }
}

#[test]
fn a_problem_comes_from_the_standard_input() {
    let run = |text: &str| {
        let mut child = command(&["solve", "-", "--json"])
            .stdin(Stdio::piped())
            .spawn()
            .unwrap();
        child
            .stdin
            .take()
            .unwrap()
            .write_all(text.as_bytes())
            .unwrap();
        wait(child)
    };
    let ran = run(CIRCLE).quietly(0);
    assert_eq!(list(&ran.json(), "targets").len(), 6);
    let wrong = run(&circle_with("cells", "cels"));
    assert!(wrong.stderr.contains("standard input:7:1: "), "{wrong:?}");
}

#[test]
#[cfg(unix)]
fn a_link_stays_a_link() {
    let folder = Folder::new();
    let file = folder.file("file.json", "older");
    let link = folder.at("link.json");
    std::os::unix::fs::symlink(&file, &link).unwrap();
    let ran = folder.solve(CIRCLE, &["--json", "--out", &link]).quietly(0);
    assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(std::fs::read_to_string(&file).unwrap(), ran.stdout);
    let device = folder.at("device.json");
    std::os::unix::fs::symlink("/dev/null", &device).unwrap();
    common::refused(
        &folder.solve(CIRCLE, &["--out", &device]),
        &["no regular file"],
    );
}

#[test]
fn help_has_whole_paragraphs_and_its_failure_is_seen() {
    let help = fredholm(&["solve", "--help"]).quietly(0).stdout;
    // The terminal wraps, and nobody else: no line of a paragraph ends early.
    let lines: Vec<&str> = help.lines().collect();
    let early = lines.windows(2).find(|two| {
        let next = two[1].split_whitespace().next().unwrap_or("");
        let starts = two[1].starts_with(|c: char| c.is_alphabetic());
        let is_prose = starts && two[0].len() > 40 && !two[0].ends_with('.');
        is_prose && two[0].len() + 1 + next.len() <= 78
    });
    assert_eq!(early, None, "{help}");
    #[cfg(target_os = "linux")]
    {
        let full = std::fs::File::create("/dev/full").unwrap();
        let ran = wait(command(&["--help"]).stdout(full).spawn().unwrap());
        assert_eq!(ran.status, Some(1), "{ran:?}");
        assert!(ran.stderr.contains("cannot write"), "{ran:?}");
    }
}

#[test]
fn little_memory_is_not_none() {
    let folder = Folder::new();
    let path = folder.file("a.toml", CIRCLE);
    let check = fredholm(&["check", &path]).quietly(0).stdout;
    assert!(
        check.contains(" kB") && !check.contains("0.0 MB"),
        "{check}"
    );
}
