//! What is done to the program while it runs, and what it leaves behind. The table of it is in
//! docs/interruption.md.

#![cfg(unix)]

use crate::common;

use core::time::Duration;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::ExitStatusExt;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Instant;

use common::{
    CIRCLE, Folder, Ran, assert_svg, command, fredholm, is_long, limited, list, number, signal,
    wait,
};

/// More walks than anybody waits for.
const ENDLESS: &str = "9007199254740991";

/// A cube whose set-up takes minutes: 4,096 cells and 625 points for each pair of them.
const LONG_SET_UP: &str = "[problem]\nkind = 'cube'\ndimension = 2\n\
    kernel = '0.5 * exp(-((x1 - y1)^2 + (x2 - y2)^2))'\nsource = '1'\n\
    [galerkin]\ncells = 64\npoints = 5\n[[target]]\nname = 'mean'\nover = 'all'\n";

/// A square with the light u = 1.
const FURNACE: &str = "[problem]\nkind = 'room'\n[[problem.surface]]\nname = 'walls'\n\
    points = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]\nreflectance = 0.6\nemission = 0.4\n\
    [galerkin]\ncells = 40\n[[target]]\nname = 'mean'\nover = 'all'\n";

/// u = x.
const CUBE: &str = "[problem]\nkind = 'cube'\ndimension = 1\nkernel = 'abs(x - y)'\n\
    source = '-(2 * x^3 - 9 * x + 2) / 6'\nsolution = 'x'\n[galerkin]\ncells = 40\n\
    [[target]]\nname = 'mean'\nover = 'all'\n";

/// Waits until something is true.
fn until(what: &str, mut is_true: impl FnMut() -> bool) {
    let start = Instant::now();
    while !is_true() {
        assert!(start.elapsed() < Duration::from_secs(60), "{what}");
        sleep(Duration::from_millis(1));
    }
}

/// Starts the program, waits until `out` is not empty and a while longer, and sends a signal.
fn signalled(args: &[&str], out: &Folder, longer: Duration, name: &str) -> Ran {
    let child = command(args).spawn().unwrap();
    until("nothing was begun", || !out.names().is_empty());
    sleep(longer);
    signal(name, child.id());
    wait(child)
}

/// Every kind of problem, every signal that asks for an end: what was finished is printed, right, and
/// written whole; status 130.
#[test]
fn walks_end_with_what_is_there() {
    let folder = Folder::new();
    let problems = [(CIRCLE, Some(5.0)), (CUBE, None), (FURNACE, Some(1.0))];
    for (turn, (problem, exact)) in problems.into_iter().enumerate() {
        let problem = folder.file("problem.toml", problem);
        for (other, name) in ["INT", "TERM", "HUP"].into_iter().enumerate() {
            // By day each problem has one of the signals.
            if !is_long() && turn != other {
                continue;
            }
            let mut walking = Duration::from_millis(500);
            let (out, ran) = loop {
                let out = Folder::new();
                let result = out.at("result.json");
                let args = [
                    "solve", &problem, "--json", "--walks", ENDLESS, "--out", &result,
                ];
                let ran = signalled(&args, &out, walking, name).warning(130, &["interrupted"]);
                // A machine that has much else to do may not have begun to walk.
                if !out.names().is_empty() || walking > Duration::from_secs(8) {
                    break (out, ran);
                }
                walking *= 2;
            };
            assert_eq!(out.names(), ["result.json"]);
            let written = fs::read_to_string(out.at("result.json")).unwrap();
            assert_eq!(written, ran.stdout);
            let report = ran.json();
            assert_eq!(report["stop"], "cancelled");
            let mean = list(&report, "targets");
            let mean = mean.iter().find(|target| target["name"] == "mean").unwrap();
            let exact = exact.unwrap_or_else(|| number(mean, "exact"));
            let plain = (!mean["plain"]["estimate"].is_null()).then_some("plain");
            for estimate in plain.into_iter().chain(["preconditioned"]) {
                // Of 18 comparisons one is off by chance in 100,000 runs.
                let found = &mean[estimate];
                let allowed = 5.0 * number(found, "std_error") + number(mean, "rounding_floor");
                let difference = number(found, "estimate") - exact;
                assert!(difference.abs() <= allowed, "{name}: {mean}");
            }
        }
    }
}

/// A choice, a set-up and walks of a tenth of a second or more each, and a curve of many points to print.
const CHOSEN: &str = "[problem]\nkind = 'cube'\ndimension = 2\n\
    kernel = '1.2 * exp(-((x1 - y1)^2 + (x2 - y2)^2))'\nsource = '1 + x1'\n[walk]\ntarget_error = 3e-8\n\
    [[target]]\nname = 'mean'\nover = 'all'\n";

/// Ctrl-C at any instant, of the choice, the set-up, the walks or the output: status 130, a word, and the results so far, or
/// none; or the run was done. Six instants by day, 200 with `FREDHOLM_LONG=1`.
#[test]
fn an_interrupt_may_come_at_any_instant() {
    let is_long = is_long();
    let instants = if is_long { 100 } else { 3 };
    let many = CIRCLE.replace("grid = 3", "grid = 3000");
    let folder = Folder::new();
    let mut seen = [0; 3];
    for (problem, args) in [(CHOSEN, &[][..]), (&many, &["--walks", "300"][..])] {
        let problem = folder.file("problem.toml", problem);
        let result = folder.at("result.json");
        let solve = [&["solve", &problem, "--json", "--out", &result], args].concat();
        let whole = fredholm(&solve).quietly(0).time;
        for instant in 0..instants {
            // As evenly spread as possible, and a little beyond the end.
            let share = (f64::from(instant) * 0.618_034 + 0.31).fract();
            let out = Folder::new();
            let result = out.at("result.json");
            let solve = [&solve[..4], &[&result], args].concat();
            let ran = signalled(&solve, &out, whole.mul_f64(1.05 * share), "INT");
            let files = out.names();
            let ended = match (ran.status, ran.stdout.is_empty()) {
                (Some(0), false) => 0,
                (Some(130), false) => 1,
                (Some(130), true) => 2,
                _ => panic!("{share}: {ran:?}"),
            };
            seen[ended] += 1;
            assert_eq!(ended > 0, ran.stderr.contains("interrupted"), "{ran:?}");
            // A file is whole, and that of what is printed.
            let is_there = ended < 2;
            assert_eq!(files.len(), usize::from(is_there), "{files:?}, {ran:?}");
            if is_there {
                let written = fs::read_to_string(out.at("result.json")).unwrap();
                assert_eq!(written, ran.stdout);
                let stop = if ended == 0 { "done" } else { "cancelled" };
                assert_eq!(ran.json()["stop"], stop);
            }
        }
    }
    println!(
        "{} done, {} with results, {} without",
        seen[0], seen[1], seen[2]
    );
    assert!(seen[1] + seen[2] > 0, "{seen:?}");
}

/// There is nothing to print: status 130 at once, and nothing is left, whatever was to be written.
#[test]
fn a_set_up_ends_at_once() {
    let folder = Folder::new();
    let problem = folder.file("problem.toml", LONG_SET_UP);
    for name in ["INT", "TERM"] {
        for command in ["solve", "export", "diagnose", "rates"] {
            let out = Folder::new();
            let target = match command {
                "solve" => out.at("result.json"),
                "export" => out.at("table.bin"),
                // Folders that are made, and one that they are made in.
                _ => out.at("new/folder"),
            };
            let mut args = vec![command, &problem, "--out", &target];
            if command == "rates" {
                args.extend(["--cells", "64"]);
            }
            let ran = signalled(&args, &out, Duration::ZERO, name);
            assert!(ran.time < Duration::from_secs(20), "{command}: {ran:?}");
            // That it takes long is said beforehand.
            let ran = match command {
                "diagnose" => ran.warning(130, &["to minutes", "interrupted"]),
                _ => ran.warning(130, &["interrupted"]),
            };
            assert_eq!(ran.stdout, "", "{command}");
            assert_eq!(out.names(), [""; 0], "{command}, {name}");
        }
    }
}

/// Commands with several files: all of them, or none. What was finished is printed.
#[test]
fn several_files_are_written_all_or_none() {
    let folder = Folder::new();
    let circle = folder.file("circle.toml", CIRCLE);
    let room = folder.file("room.toml", FURNACE);
    let out = Folder::new();
    let target = out.at("new");
    let picture = out.at("room.png");
    let commands: [&[&str]; 3] = [
        &["paper", "--json", "--max-walks", ENDLESS, "--out", &target],
        &[
            "rates", &circle, "--json", "--cells", "8,16,20", "--walks", ENDLESS, "--out", &target,
        ],
        &["render", &room, "--walks", "1000000", "--out", &picture],
    ];
    for args in commands {
        let ran = signalled(args, &out, Duration::from_millis(700), "INT");
        let ran = ran.warning(130, &["interrupted"]);
        assert_eq!(out.names(), [""; 0], "{args:?}");
        if args[0] == "render" {
            assert_eq!(ran.stdout, "");
        } else {
            list(&ran.json(), "rows");
        }
    }
}

/// The comparison with published numbers prints the sources that were finished, and does not say that
/// all agree.
#[test]
fn a_verification_says_that_it_was_cut() {
    let mut child = command(&["verify"]).spawn().unwrap();
    let mut stdout = BufReader::new(child.stdout.take().unwrap());
    let mut first = String::new();
    stdout.read_line(&mut first).unwrap();
    assert!(first.contains("Heinrich 1995"), "{first}");
    signal("INT", child.id());
    let mut rest = String::new();
    stdout.read_to_string(&mut rest).unwrap();
    wait(child).warning(130, &["interrupted"]);
    let last = rest.lines().last().unwrap();
    let (agree, all) = last
        .trim_end_matches(" numbers agree")
        .split_once(" of ")
        .unwrap();
    assert_eq!(agree, all);
    assert!((1..101).contains(&all.parse::<u32>().unwrap()), "{last}");
}

/// `| head -1`: quiet, and the line is right. A pipe holds 64 KiB; these results are larger.
#[test]
fn a_reader_may_leave() {
    let folder = Folder::new();
    let grid = CIRCLE.replace("grid = 3", "grid = 2000");
    let problem = folder.file("problem.toml", grid);
    let solve: &[&str] = &["solve", &problem, "--json", "--walks", "10"];
    let out = Folder::new();
    let result = out.at("result.json");
    let writes = [solve, &["--out", &result]].concat();
    let verify: &[&str] = &["verify"];
    for (args, first, status) in [
        (solve, "{\n", 0),
        (&writes, "{\n", 0),
        // Nobody has seen that all numbers agree.
        (verify, "Heinrich 1995", 1),
    ] {
        let mut child = command(args).spawn().unwrap();
        let mut stdout = BufReader::with_capacity(64, child.stdout.take().unwrap());
        let mut line = String::new();
        stdout.read_line(&mut line).unwrap();
        drop(stdout);
        assert!(line.starts_with(first), "{line}");
        wait(child).quietly(status);
    }
    // The file does not depend on who reads.
    assert_eq!(out.names(), ["result.json"]);
    serde_json::from_slice::<serde_json::Value>(&fs::read(result).unwrap()).unwrap();
}

/// What lets no file grow beyond 4 KiB: a full disk for everybody.
const SMALL_DISK: &str = "ulimit -f 4;";
/// So that a write fails there.
const FULL_DISK: &str = "ulimit -f 4; trap '' XFSZ;";

/// The results are printed, the file is not there, one of that name stays as it was, and the status
/// says that something failed.
#[test]
fn a_full_disk_leaves_no_part_of_a_file() {
    let folder = Folder::new();
    let problem = folder.file("problem.toml", CIRCLE.replace("grid = 3", "grid = 200"));
    let glowing = folder.file("room.toml", FURNACE);
    for old in [None, Some("what was there before")] {
        let out = Folder::new();
        let result = out.at("result.json");
        if let Some(old) = old {
            fs::write(&result, old).unwrap();
        }
        let args = [
            "solve", &problem, "--json", "--walks", "100", "--out", &result,
        ];
        let ran = wait(limited(FULL_DISK, &args));
        assert_eq!(ran.status, Some(1), "{ran:?}");
        assert!(ran.stderr.contains("cannot write"), "{ran:?}");
        assert_eq!(list(&ran.json(), "targets").len(), 203);
        assert_eq!(fs::read_to_string(&result).ok().as_deref(), old);
        assert_eq!(out.names().len(), usize::from(old.is_some()));
    }
    // Of several files, those that were whole before the disk was full have their names.
    let out = Folder::new();
    let target = out.at("new");
    let args = ["paper", "--max-walks", "100", "--out", &target];
    let ran = wait(limited(FULL_DISK, &args));
    assert_eq!(ran.status, Some(1), "{ran:?}");
    assert!(ran.stdout.contains("√Var"), "{ran:?}");
    for name in common::names(target.as_ref()) {
        let text = fs::read_to_string(out.path().join("new").join(&name)).unwrap();
        assert!(["table.csv", "table.json"].contains(&&*name), "{name}");
        assert!(text.ends_with('\n'), "{name}: {text}");
    }
    let picture = out.at("field.csv");
    let args = [
        "render", &glowing, "--walks", "1", "--width", "150", "--out", &picture,
    ];
    let ran = wait(limited(FULL_DISK, &args));
    assert_eq!(ran.status, Some(1), "{ran:?}");
    assert_eq!(out.names(), ["new"]);
}

/// Killed in the middle of writing: nothing under the final name, or what was there before. What is
/// left is one file, hidden and named after the program.
#[test]
fn killed_while_writing() {
    let folder = Folder::new();
    let problem = folder.file("problem.toml", CIRCLE.replace("grid = 3", "grid = 20000"));
    for old in [None, Some("what was there before")] {
        let out = Folder::new();
        let result = out.at("result.json");
        if let Some(old) = old {
            fs::write(&result, old).unwrap();
        }
        let args = ["solve", &problem, "--walks", "1", "--out", &result];
        // By the system, at 4 KiB: between two writes, surely.
        let mut child = limited(SMALL_DISK, &args);
        // SIGXFSZ is 25 on Linux and on the BSDs.
        assert_eq!(child.wait().unwrap().signal(), Some(25));
        let left = out.names();
        let hidden = left.iter().filter(|name| name.starts_with(".fredholm-"));
        assert_eq!(hidden.count(), 1, "{left:?}");
        assert_eq!(left.len(), 1 + usize::from(old.is_some()), "{left:?}");
        assert_eq!(fs::read_to_string(&result).ok().as_deref(), old);
        // The next run is not troubled by it, and leaves it alone.
        fredholm(&["solve", &problem, "--walks", "1", "--out", &result]).quietly(0);
        assert_eq!(out.names(), [&*left[0], "result.json"]);
    }
    // By SIGKILL, at any time: walks, writing, or done.
    for after in [5, 20, 50, 100, 200, 400] {
        let out = Folder::new();
        let result = out.at("result.csv");
        let args = ["solve", &problem, "--walks", "20", "--out", &result];
        let child = command(&args).stdout(Stdio::null()).spawn().unwrap();
        sleep(Duration::from_millis(after));
        // It may have ended by itself.
        let _ = Command::new("kill")
            .args(["-KILL", &child.id().to_string()])
            .output();
        wait(child);
        for name in out.names() {
            if name == "result.csv" {
                assert_eq!(common::csv_rows(result.as_ref()).len(), 20_004);
            } else {
                assert!(name.starts_with(".fredholm-"), "{name}");
            }
        }
    }
}

/// Results that cannot be printed are in their file nevertheless.
#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_behind_stdout() {
    let folder = Folder::new();
    let problem = folder.file("problem.toml", CIRCLE);
    let out = Folder::new();
    let (result, picture) = (out.at("result.json"), out.at("profile.svg"));
    let solve: &[&str] = &["solve", &problem, "--json", "--out", &result];
    let draw: &[&str] = &["solve", &problem, "--out", &picture];
    let mut all: Vec<&[&str]> = vec![solve, draw, &["verify"]];
    if is_long() {
        all.push(&["verify", "--json"]);
    }
    for args in all {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let ran = wait(command(args).stdout(full).spawn().unwrap());
        assert_eq!(ran.status, Some(1), "{args:?}: {ran:?}");
        assert!(ran.stderr.contains("cannot write the output"), "{ran:?}");
    }
    assert_eq!(out.names(), ["profile.svg", "result.json"]);
    let whole = fs::read(result).unwrap();
    serde_json::from_slice::<serde_json::Value>(&whole).unwrap();
    assert_svg(picture.as_ref());
}
