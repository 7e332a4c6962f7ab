//! Runs in parts: files of batches that are merged to the bits of one run, and that a killed run goes on with.

use crate::common;

use core::time::Duration;
use std::fs;
use std::process::Command;
use std::thread::sleep;

use common::{CIRCLE, Folder, Ran, circle_with, command, fredholm, is_long, list, number, wait};

pub(crate) const CUBE: &str = "[problem]\nkind = 'cube'\ndimension = 2\n\
    kernel = '0.5 * exp(-((x1 - y1)^2 + (x2 - y2)^2))'\nsource = '1 + x1'\n\
    [galerkin]\ncells = 4\ndegree = 1\n[walk]\nwalks = 20000\nbatch = 256\n\
    [[target]]\nname = 'mean'\nover = 'all'\n[[target]]\nname = 'weight'\nweight = 'x1 * x2'\n";

/// A square with temperatures: irradiances and net fluxes have walks of their own.
pub(crate) const ROOM: &str = "[problem]\nkind = 'room'\n\
    [[problem.surface]]\nname = 'floor'\npoints = [[0, 0], [1, 0]]\nemissivity = 0.5\ntemperature = 350\n\
    [[problem.surface]]\nname = 'others'\npoints = [[1, 0], [1, 1], [0, 1], [0, 0]]\nemissivity = 0.9\ntemperature = 290\n\
    [galerkin]\ncells = 20\n[walk]\nwalks = 20000\nbatch = 256\n\
    [[target]]\nname = 'mean'\nover = 'all'\n[[target]]\nname = 'spot'\nat = { surface = 'floor', t = 0.4 }\n";

pub(crate) const SPHERE: &str = "[problem]\nkind = 'sphere'\nalbedo = 0.7\nasymmetry = 0.2\nemission = [1, 0.3, 0.2, 0.1]\n\
    [galerkin]\ncells = 6\n[walk]\nwalks = 20000\nbatch = 256\n\
    [[target]]\nname = 'north'\nat = [0.1, 0.0]\n[[target]]\nname = 'mean'\nover = 'all'\n";

/// An exact source: (v, Φ) has an error of its own, which is no sum over walks.
pub(crate) const EXACT: &str = "[problem]\nkind = 'cube'\ndimension = 1\nkernel = '0.5 * exp(-(x - y)^2)'\nsource = 'abs(x - 0.3)'\n\
    [galerkin]\ncells = 4\nexact_source = true\n[walk]\nwalks = 20000\nbatch = 256\n\
    [[target]]\nname = 'mean'\nover = 'all'\n";

/// The JSON of a run without what the clock told.
pub(crate) fn whole(problem: &str, args: &[&str]) -> String {
    let folder = Folder::new();
    let ran = folder.solve(problem, &[args, &["--json"]].concat());
    assert_eq!(ran.status, Some(0), "{ran:?}");
    ran.timeless()
}

/// The parts of a run, each in a file; in the order of a shuffle.
pub(crate) fn parts(folder: &Folder, problem: &str, of: usize, args: &[&str]) -> Vec<String> {
    let file = folder.file("problem.toml", problem);
    let mut paths: Vec<String> = (1..=of)
        .map(|k| {
            let path = folder.at(&format!("part-{of}-{k}"));
            let share = format!("{k}/{of}");
            let own = ["solve", &file, "--part", &share, "--save", &path];
            let ran = fredholm(&[&own, args].concat());
            assert_eq!(ran.status, Some(0), "{ran:?}");
            assert!(
                ran.stderr.contains(&format!("part {share} alone")),
                "{ran:?}"
            );
            path
        })
        .collect();
    // 7919 is prime to all counts.
    let place = |k: usize| (k * 7919 + 3) % of;
    for k in 0..of {
        paths.swap(k, place(k));
    }
    paths
}

pub(crate) fn merge(paths: &[String], args: &[&str]) -> Ran {
    let paths: Vec<&str> = paths.iter().map(String::as_str).collect();
    fredholm(&[&["merge"], &paths[..], args].concat())
}

#[test]
fn merged_parts_are_one_run() {
    let counts: &[usize] = if is_long() { &[1, 2, 7, 64] } else { &[3] };
    let problems = [CIRCLE, CUBE, ROOM, SPHERE, EXACT];
    for problem in problems {
        let long = is_long() && problem != EXACT;
        let scalars: &[&str] = if long { &["f64", "f32"] } else { &["f64"] };
        let estimators: &[&str] = if long {
            &["absorption", "collision"]
        } else {
            &["absorption"]
        };
        for scalar in scalars {
            for estimator in estimators {
                let args = ["--scalar", scalar, "--estimator", estimator];
                let expected = whole(problem, &args);
                for &of in counts {
                    let folder = Folder::new();
                    let paths = parts(&folder, problem, of, &args);
                    // Twice each.
                    let twice = [&paths[..], &paths].concat();
                    for paths in [&paths, &twice] {
                        let ran = merge(paths, &["--json"]);
                        assert_eq!(ran.status, Some(0), "{ran:?}");
                        assert_eq!(ran.timeless(), expected, "{of} parts of {problem}");
                    }
                }
            }
        }
    }
}

#[test]
fn what_is_missing_is_said_and_the_longest_front_is_the_result() {
    let folder = Folder::new();
    let mut paths = parts(&folder, CIRCLE, 5, &[]);
    paths.sort();
    // 40 batches, the last of which is short: parts of eight.
    let some = [paths[0].clone(), paths[1].clone(), paths[3].clone()];
    let ran = merge(&some, &["--json"]);
    assert_eq!(ran.status, Some(3), "{ran:?}");
    let words = [
        "batches 17 to 24, 33 to 40 of 40 are missing",
        "part 3/5 is not there",
        "--part 5/5",
    ];
    for word in words {
        assert!(ran.stderr.contains(word), "{word}: {ran:?}");
    }
    let report = ran.json();
    assert_eq!(
        (
            &report["stop"],
            list(&report, "targets")[0]["walks"].as_u64()
        ),
        (&"cancelled".into(), Some(16 * 512))
    );
    // As a run of so many walks, whose last batch is whole.
    let short = whole(CIRCLE, &["--walks", "8192"]);
    let short: serde_json::Value =
        serde_json::from_str(&format!("{{{}", short.trim_start_matches('{'))).unwrap();
    assert_eq!(report["targets"], short["targets"]);
    // The command that it names makes the missing part.
    let line = ran
        .stderr
        .lines()
        .find(|line| line.contains("part 3/5"))
        .unwrap();
    let (_, named) = line.split_once("fredholm ").unwrap();
    let args: Vec<&str> = named.split(' ').collect();
    let made = command(&args).current_dir(folder.path()).spawn().unwrap();
    assert_eq!(wait(made).status, Some(0));
    let all = [&some[..], &[folder.at("part-3"), paths[4].clone()]].concat();
    assert_eq!(merge(&all, &["--json"]).timeless(), whole(CIRCLE, &[]));
}

#[test]
fn parts_of_other_walks_are_refused_with_what_differs() {
    let folder = Folder::new();
    let one = folder.at("one");
    let save = |path: &str, problem: &str, share: &str, args: &[&str]| {
        let own = ["--part", share, "--save", path];
        folder.solve(problem, &[&own, args].concat())
    };
    assert_eq!(save(&one, CIRCLE, "1/2", &[]).status, Some(0));
    let others: [(&str, &[&str], &str); 6] = [
        (CIRCLE, &["--seed", "2"], "`seed` is 1 here and 2 there"),
        (
            CIRCLE,
            &["--cells", "22"],
            "`cells` is 20 here and 22 there",
        ),
        (
            CIRCLE,
            &["--scalar", "f32"],
            "`scalar` is f64 here and f32 there",
        ),
        (
            &circle_with("[0.3, 0.7]", "[0.3, 0.6]"),
            &[],
            "`problem` is",
        ),
        (&circle_with("at = 0.3", "at = 0.4"), &[], "`targets` is"),
        (CUBE, &[], "`kind` is circle here and cube there"),
    ];
    for (number, (problem, args, what)) in others.into_iter().enumerate() {
        let other = folder.at(&format!("other-{number}"));
        assert_eq!(save(&other, problem, "2/2", args).status, Some(0), "{what}");
        let ran = merge(&[one.clone(), other], &[]);
        assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""), "{ran:?}");
        assert!(ran.stderr.contains(what), "{what}: {ran:?}");
        // Nor is it gone on with.
        let ran = save(&one, problem, "1/2", args);
        assert_eq!(ran.status, Some(2), "{ran:?}");
    }
    let ran = save(&one, CIRCLE, "2/2", &[]);
    assert!(
        ran.status == Some(2) && ran.stderr.contains("it is part 1/2, and not part 2/2"),
        "{ran:?}"
    );
    // What is written differently and says the same is the same.
    let same = circle_with("degree = 0\n", "").replace("0.7", "0.70") + "# a word\n";
    let two = folder.at("two");
    assert_eq!(save(&two, &same, "2/2", &[]).status, Some(0));
    assert_eq!(
        merge(&[two, one.clone()], &["--json"]).timeless(),
        whole(CIRCLE, &[])
    );
    // What is no part is left alone.
    let notes = folder.file("notes", "buy milk");
    let ran = save(&notes, CIRCLE, "1/2", &[]);
    assert!(
        ran.status == Some(2) && ran.stderr.contains("no part of a run"),
        "{ran:?}"
    );
    assert_eq!(fs::read_to_string(&notes).unwrap(), "buy milk");
    let ran = folder.solve(CIRCLE, &["--part", "3/2", "--save", "x"]);
    assert!(
        ran.status == Some(2) && ran.stderr.contains("a part is k/n"),
        "{ran:?}"
    );
    let ran = folder.solve(CIRCLE, &["--whole", "--save", "x"]);
    assert!(
        ran.status == Some(2) && ran.stderr.contains("--whole"),
        "{ran:?}"
    );
}

/// Walks of a second or so, which are killed again and again.
const LONG_WALKS: [&str; 4] = ["--walks", "400000", "--threads", "2"];

#[test]
fn a_run_that_is_killed_again_and_again_ends_with_the_same_bits() {
    let kills = if is_long() { 200 } else { 6 };
    for problem in [CIRCLE, ROOM] {
        let expected = whole(problem, &LONG_WALKS);
        let folder = Folder::new();
        let file = folder.file("problem.toml", problem);
        let (mut killed, mut round) = (0, 0);
        while killed < kills / 2 {
            round += 1;
            let save = folder.at(&format!("run-{round}"));
            let args = [
                &["solve", &file, "--json", "--save", &save][..],
                &LONG_WALKS,
            ]
            .concat();
            // As long as a kill comes before the end.
            for time in 0.. {
                let mut child = command(&args).spawn().unwrap();
                // Instants that nobody chose: 1 to 151 ms.
                sleep(Duration::from_millis((round * 97 + time * 53) % 151 + 1));
                let has_ended = child.try_wait().unwrap().is_some();
                if has_ended || killed >= kills / 2 {
                    let ran = wait(child);
                    assert_eq!(ran.status, Some(0), "{ran:?}");
                    assert_eq!(ran.timeless(), expected);
                    break;
                }
                child.kill().unwrap();
                child.wait().unwrap();
                killed += 1;
                // A write that was cut anywhere.
                if time % 3 == 1 {
                    let length = fs::metadata(&save).map_or(0, |found| found.len());
                    let cut = (round * 31 + time * 17) % 137;
                    if length > cut {
                        let part = fs::OpenOptions::new().write(true).open(&save).unwrap();
                        part.set_len(length - cut).unwrap();
                    }
                }
            }
        }
    }
}

#[test]
#[cfg(unix)]
fn an_interrupt_keeps_what_is_done_and_the_same_command_goes_on() {
    let folder = Folder::new();
    let file = folder.file("problem.toml", CIRCLE);
    let save = folder.at("run");
    let args = [
        "solve", &file, "--json", "--save", &save, "--walks", "1500000",
    ];
    let child = command(&args).spawn().unwrap();
    while fs::metadata(&save).map_or(0, |found| found.len()) < 20_000 {
        sleep(Duration::from_millis(1));
    }
    // A second process is refused, and the first one never knows.
    let second = fredholm(&args);
    assert!(
        second.status == Some(2) && second.stderr.contains("another process is writing it"),
        "{second:?}"
    );
    common::signal("INT", child.id());
    let ran = wait(child).warning(130, &["interrupted"]);
    assert_eq!(ran.json()["stop"], "cancelled");
    let kept = fs::metadata(&save).unwrap().len();
    assert!(kept > 20_000);
    // What it has may be looked at in between.
    let front = merge(core::slice::from_ref(&save), &["--json"]);
    assert_eq!(front.status, Some(3), "{front:?}");
    assert!(number(&list(&front.json(), "targets")[0], "walks") > 0.0);
    let ran = fredholm(&args).quietly(0);
    assert_eq!(ran.timeless(), whole(CIRCLE, &["--walks", "1500000"]));
    // More walks go on with it, too.
    let more = fredholm(&[
        "solve", &file, "--json", "--save", &save, "--walks", "1600000",
    ]);
    assert_eq!(
        more.quietly(0).timeless(),
        whole(CIRCLE, &["--walks", "1600000"])
    );
    let length = fs::metadata(&save).unwrap().len();
    // Nothing is run twice: six targets, 3125 batches of each, 136 bytes, and what stands before them.
    assert!(
        (6 * 3125 * 136..6 * 3140 * 136 + 20_000).contains(&length),
        "{length}"
    );
}

/// A file that may have no more bytes stands for a full disk.
#[test]
#[cfg(unix)]
fn a_full_disk_is_said_and_nothing_is_lost() {
    let folder = Folder::new();
    let file = folder.file("problem.toml", CIRCLE);
    let save = folder.at("run");
    let program = env!("CARGO_BIN_EXE_fredholm");
    let script = format!("trap '' XFSZ; ulimit -f 20; exec {program} solve {file} --save {save}");
    let child = Command::new("bash")
        .args(["-c", &script])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let ran = wait(child);
    assert_eq!((ran.status, ran.stdout.as_str()), (Some(1), ""), "{ran:?}");
    for word in [
        "cannot write to it",
        "make room, and give the same command again",
    ] {
        assert!(ran.stderr.contains(word), "{ran:?}");
    }
    let kept = fs::metadata(&save).unwrap().len();
    assert!((15_000..=20_480).contains(&kept), "{kept}");
    let ran = fredholm(&["solve", &file, "--json", "--save", &save]).quietly(0);
    assert_eq!(ran.timeless(), whole(CIRCLE, &[]));
}

#[test]
fn a_merge_decides_where_a_target_error_ends() {
    let folder = Folder::new();
    let many = ["--walks", "200000"];
    let paths = parts(&folder, CUBE, 4, &many);
    let deviation = {
        let report = merge(&paths, &["--json"]).json();
        number(&list(&report, "targets")[0]["preconditioned"], "std_dev")
    };
    // Reached by about a quarter of the walks, and by four times as many.
    let [easy, hard] =
        [50_000.0, 800_000.0].map(|walks: f64| (deviation / walks.sqrt()).to_string());
    let error = ["--target-error", easy.as_str()];
    let expected = whole(CUBE, &[&many[..], &error].concat());
    let ran = merge(&paths, &[&["--json"][..], &error].concat());
    assert_eq!((ran.status, ran.timeless()), (Some(0), expected));
    assert!(number(&list(&ran.json(), "targets")[0], "walks") < 100_000.0);
    // The others need not be there.
    let few = merge(&paths[..], &[&["--json"][..], &error].concat());
    assert_eq!(few.status, Some(0));
    let error = ["--target-error", hard.as_str()];
    let ran = merge(&paths, &[&["--json"][..], &error].concat());
    assert_eq!(
        (ran.status, ran.json()["stop"].as_str()),
        (Some(3), Some("error_not_reached")),
        "{ran:?}"
    );
    let line = ran
        .stderr
        .lines()
        .find(|line| line.contains("the target error takes"))
        .unwrap();
    // The command that it prints is run as it is, by a shell.
    let (_, command) = line.split_once("in 4 parts: ").unwrap();
    let program = env!("CARGO_BIN_EXE_fredholm");
    let command = command.replace("fredholm solve", &format!("{program} solve"));
    let child = Command::new("bash")
        .args(["-c", &command])
        .current_dir(folder.path())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    assert_eq!(wait(child).status, Some(0));
    let more: Vec<String> = folder
        .names()
        .into_iter()
        .filter(|name| name.starts_with("problem-"))
        .collect();
    assert_eq!(more.len(), 4, "{more:?}");
    let all: Vec<String> = paths
        .iter()
        .cloned()
        .chain(more.iter().map(|name| folder.at(name)))
        .collect();
    let ran = merge(&all, &[&["--json"][..], &error].concat());
    assert_eq!(ran.status, Some(0), "{ran:?}");
    let walks = more[0].split('-').nth(1).unwrap();
    let expected = whole(CUBE, &[&["--walks", walks][..], &error].concat());
    assert_eq!(ran.timeless(), expected);
}

/// What a file leaves open every part chooses for itself: the choice follows from the file alone.
#[test]
fn parts_of_a_file_that_leaves_cells_open_choose_the_same() {
    let open = CUBE
        .replace("cells = 4\ndegree = 1\n", "")
        .replace("walks = 20000\n", "target_error = 1e-4\n");
    let folder = Folder::new();
    let ran = folder.solve(&open, &["--part", "1/2", "--save", "x"]);
    assert!(
        ran.status == Some(2) && ran.stderr.contains("`--part` needs `--walks`"),
        "{ran:?}"
    );
    let args = ["--walks", "30000"];
    let paths = parts(&folder, &open, 2, &args);
    let expected = folder.solve(&open, &[&args[..], &["--json"]].concat());
    let ran = merge(&paths, &["--json"]);
    assert_eq!(
        (ran.status, ran.timeless()),
        (expected.status, expected.timeless()),
        "{ran:?}"
    );
    assert!(ran.json()["split"].is_object());
    // And one that is kept is the one that is not.
    let save = folder.at("run");
    let kept = folder.solve(&open, &["--json", "--save", &save]);
    let again = folder.solve(&open, &["--json", "--save", &save]);
    let never = folder.solve(&open, &["--json"]);
    assert_eq!(kept.timeless(), never.timeless());
    assert_eq!(again.timeless(), never.timeless());
}
