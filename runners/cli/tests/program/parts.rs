//! Runs in parts: files of batches that are merged to the bits of one run, and that a killed run goes on with.

use crate::common;

use core::time::Duration;
use std::fs;
use std::thread::sleep;

use crate::systems::LINE;
use common::{
    CIRCLE, Folder, Ran, circle_with, command, fredholm, is_long, limited, list, number, refused,
    wait,
};

pub(crate) const CUBE: &str = "[problem]\nkind = 'cube'\ndimension = 2\n\
    kernel = '0.5 * exp(-((x1 - y1)^2 + (x2 - y2)^2))'\nsource = '1 + x1'\n\
    [galerkin]\ncells = 4\ndegree = 1\n[walk]\nwalks = 20000\nbatch = 256\n\
    [[target]]\nname = 'mean'\nover = 'all'\n[[target]]\nname = 'weight'\nweight = 'x1 * x2'\n";

/// A square with temperatures: irradiances and net fluxes have walks of their own.
pub(crate) const ROOM: &str = "[problem]\nkind = 'room'\n\
    [[problem.surface]]\nname = 'floor'\npoints = [[0, 0], [1, 0]]\nemissivity = 0.5\ntemperature = 350\n\
    [[problem.surface]]\nname = 'others'\npoints = [[1, 0], [1, 1], [0, 1], [0, 0]]\nemissivity = 0.9\ntemperature = 290\n\
    [galerkin]\ncells = 20\ndegree = 0\npairs = 'default'\n[walk]\nwalks = 20000\nbatch = 256\n\
    [[target]]\nname = 'mean'\nover = 'all'\n[[target]]\nname = 'spot'\nat = { surface = 'floor', t = 0.4 }\n";

pub(crate) const SPHERE: &str = "[problem]\nkind = 'sphere'\nalbedo = 0.7\nasymmetry = 0.2\nemission = [1, 0.3, 0.2, 0.1]\n\
    [galerkin]\ncells = 6\n[walk]\nwalks = 20000\nbatch = 256\n\
    [[target]]\nname = 'north'\nat = [0.1, 0.0]\n[[target]]\nname = 'mean'\nover = 'all'\n";

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
    for problem in [CIRCLE, CUBE, ROOM, SPHERE] {
        let long = is_long();
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

/// The batches of resolvent walks are samples of their own.
#[test]
fn parts_of_any_equation_are_one_run() {
    let problem = "[problem]\nkind = 'cube'\ndimension = 1\nkernel = '2 * exp(-(x - y)^2)'\nsource = '1 + x'\n\
        [galerkin]\ncells = 6\n[walk]\nwalks = 20000\nbatch = 256\n\
        [[target]]\nname = 'u'\nat = 0.3\n[[target]]\nname = 'mean'\nover = 'all'\n";
    let folder = Folder::new();
    let paths = parts(&folder, problem, 3, &[]);
    let ran = merge(&paths, &["--json"]);
    assert_eq!((ran.status, ran.timeless()), (Some(0), whole(problem, &[])));
    let report = ran.json();
    assert_eq!(report["method"], "resolvent");
    // Two resolutions of a Nyström scheme.
    let exact = [-2.443_115_819_070_29, -2.041_824_202_519_37];
    for (target, exact) in list(&report, "targets").iter().zip(exact) {
        let found = &target["preconditioned"];
        let [value, bar] = ["estimate", "std_error"].map(|name| number(found, name));
        assert!(
            bar < 1e-6 && (value - exact).abs() < 4.9 * bar,
            "{value} {bar}"
        );
    }
}

#[test]
fn what_is_missing_is_said_and_the_longest_front_is_the_result() {
    let folder = Folder::new();
    let mut paths = parts(&folder, CIRCLE, 5, &[]);
    paths.sort();
    // 40 batches, the last of which is short: parts of eight.
    let some = [0, 1, 3].map(|number| paths[number].clone());
    let ran = merge(&some, &["--json"]);
    assert_eq!(ran.status, Some(3), "{ran:?}");
    let words = "batches 17 to 24, 33 to 40 of 40 are missing, of parts 3/5, 5/5";
    assert!(ran.stderr.contains(words), "{ran:?}");
    let report = ran.json();
    assert_eq!(report["stop"], "cancelled");
    // As a run of so many walks, whose last batch is whole.
    let short = folder.solve(CIRCLE, &["--walks", "8192", "--json"]).json();
    assert_eq!(report["targets"], short["targets"]);
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
        (CIRCLE, &["--seed", "2"], "seed: 1 here and seed: 2 there"),
        (
            CIRCLE,
            &["--cells", "22"],
            "`cells` has cells: 20 here and cells: 22 there",
        ),
        (
            CIRCLE,
            &["--scalar", "f32"],
            "scalar: F64 here and scalar: F32 there",
        ),
        (
            &circle_with("[0.3, 0.7]", "[0.3, 0.6]"),
            &[],
            "`problem` has",
        ),
        (&circle_with("at = 0.3", "at = 0.4"), &[], "`targets` has"),
        (CUBE, &[], "`kind` has circle here and cube there"),
    ];
    for (number, (problem, args, what)) in others.into_iter().enumerate() {
        let other = folder.at(&format!("other-{number}"));
        assert_eq!(save(&other, problem, "2/2", args).status, Some(0), "{what}");
        refused(&merge(&[one.clone(), other], &[]), &[what]);
        // Nor is it gone on with.
        refused(
            &save(&one, problem, "1/2", args),
            &["another file to `--save`"],
        );
    }
    refused(
        &save(&one, CIRCLE, "2/2", &[]),
        &["it is part 1/2, and not part 2/2"],
    );
    // What is written differently and says the same is the same.
    let same = circle_with("degree = 0", "degree = +0").replace("0.7", "0.70") + "# a word\n";
    let two = folder.at("two");
    assert_eq!(save(&two, &same, "2/2", &[]).status, Some(0));
    assert_eq!(
        merge(&[two, one.clone()], &["--json"]).timeless(),
        whole(CIRCLE, &[])
    );
    // What is no part is left alone, as is what was cut off.
    let good = fs::read(&one).unwrap();
    for (name, content, word) in [
        ("notes", &b"buy milk"[..], "no part of a run"),
        ("short", &good[..good.len() - 1], "cut off or damaged"),
    ] {
        let path = folder.file(name, content);
        refused(&save(&path, CIRCLE, "1/2", &[]), &[word]);
        refused(&merge(core::slice::from_ref(&path), &[]), &[word]);
        assert_eq!(fs::read(&path).unwrap(), content);
    }
    for (args, word) in [
        (["--part", "3/2", "--save", "x"].as_slice(), "a part is k/n"),
        (&["--global", "--save", "x"], "--global"),
        (&["--save", &folder.at("none/x")], "cannot open it"),
    ] {
        refused(&folder.solve(CIRCLE, args), &[word]);
    }
}

/// Walks of a fifth of a second or more, which are killed again and again.
const LONG_WALKS: [&str; 4] = ["--walks", "200000", "--threads", "2"];

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
                // Instants that nobody chose: 1 to 201 ms.
                sleep(Duration::from_millis((round * 97 + time * 53) % 201 + 1));
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
                // The file is whole, or not yet there.
                if fs::exists(&save).unwrap() {
                    let ran = merge(core::slice::from_ref(&save), &[]);
                    let is_begun = ran.stderr.contains("no part has begun to walk");
                    assert!(is_begun || matches!(ran.status, Some(0 | 3)), "{ran:?}");
                }
            }
        }
    }
}

/// What is open is chosen for the walks with which a run began, however many follow.
#[test]
fn walks_that_go_on_have_the_choice_of_those_before() {
    let folder = Folder::new();
    let file = folder.file("open.toml", LINE);
    let save = folder.at("run");
    let solve = |walks: &str, options: &[&str]| {
        let args = ["solve", &file, "--json", "--walks", walks];
        fredholm(&[&args[..], options].concat()).quietly(0).json()
    };
    let begun = solve("1000", &["--save", &save]);
    let after = solve("50000", &["--save", &save]);
    assert_eq!(after["cells"], begun["cells"]);
    assert_eq!(after["split"]["walks"], 1000);
    assert_eq!(list(&after, "targets")[0]["walks"], 50_000);
}

#[test]
#[cfg(unix)]
fn an_interrupt_keeps_what_is_done_and_the_same_command_goes_on() {
    let folder = Folder::new();
    let file = folder.file("problem.toml", CIRCLE);
    let save = folder.at("run");
    let solve = |walks| ["solve", &file, "--json", "--save", &save, "--walks", walks];
    // One thread takes twice as long.
    let alone = [&solve("500000")[..], &["--threads", "1"]].concat();
    let child = command(&alone).spawn().unwrap();
    while fs::metadata(&save).map_or(0, |found| found.len()) < 20_000 {
        sleep(Duration::from_millis(1));
    }
    // A second process is refused, and the first one never knows.
    refused(
        &fredholm(&solve("500000")),
        &["another process is writing it"],
    );
    common::signal("INT", child.id());
    let ran = wait(child).warning(130, &["interrupted"]);
    assert_eq!(ran.json()["stop"], "cancelled");
    // What it has may be looked at in between: all that was printed but for walks of batches that were not done.
    let front = merge(core::slice::from_ref(&save), &["--json"]);
    assert_eq!(front.status, Some(3), "{front:?}");
    let walks = |ran: &Ran| -> Vec<u64> {
        let targets = list(&ran.json(), "targets").to_vec();
        targets
            .iter()
            .map(|found| number(found, "walks") as u64)
            .collect()
    };
    let printed: Vec<u64> = walks(&ran).iter().map(|walks| walks / 512 * 512).collect();
    assert_eq!(walks(&front), printed);
    // More walks go on with it, too.
    for walks in ["500000", "520000"] {
        let ran = fredholm(&solve(walks)).quietly(0);
        assert_eq!(ran.timeless(), whole(CIRCLE, &["--walks", walks]));
    }
    assert_eq!(folder.names(), ["problem.toml", "run"]);
}

/// A file that may have no more bytes stands for a full disk.
#[test]
#[cfg(unix)]
fn a_full_disk_is_said_and_what_was_written_stays() {
    let folder = Folder::new();
    let file = folder.file("problem.toml", CIRCLE);
    let save = folder.at("run");
    let args = [
        "solve", &file, "--json", "--save", &save, "--walks", "100000",
    ];
    let child = limited("trap '' XFSZ; ulimit -f 40;", &args);
    let ran = wait(child);
    assert_eq!((ran.status, ran.stdout.as_str()), (Some(1), ""), "{ran:?}");
    for word in [
        "cannot write",
        "it keeps what it had before: make room, and give the same command again",
    ] {
        assert!(ran.stderr.contains(word), "{ran:?}");
    }
    assert_eq!(folder.names(), ["problem.toml", "run"]);
    let kept = fs::metadata(&save).unwrap().len();
    assert!((1_000..=40_960).contains(&kept), "{kept}");
    let ran = fredholm(&args).quietly(0);
    assert_eq!(ran.timeless(), whole(CIRCLE, &["--walks", "100000"]));
}

#[test]
fn a_merge_decides_where_a_target_error_ends() {
    let folder = Folder::new();
    let many = ["--walks", "20000"];
    let paths = parts(&folder, CUBE, 4, &many);
    let deviation = {
        let report = merge(&paths, &["--json"]).json();
        number(&list(&report, "targets")[0]["preconditioned"], "std_dev")
    };
    // Reached by less than half of the walks, and by some times as many.
    let [easy, hard] = [2500.0, 80_000.0].map(|walks: f64| (deviation / walks.sqrt()).to_string());
    let error = ["--target-error", easy.as_str()];
    let expected = whole(CUBE, &[&many[..], &error].concat());
    let ran = merge(&paths, &[&["--json"][..], &error].concat());
    assert_eq!((ran.status, ran.timeless()), (Some(0), expected.clone()));
    assert!(number(&list(&ran.json(), "targets")[0], "walks") < 10_000.0);
    // The others need not be there.
    let mut few = paths.clone();
    few.sort();
    few.truncate(2);
    let ran = merge(&few, &[&["--json"][..], &error].concat());
    assert_eq!((ran.status, ran.timeless()), (Some(0), expected));
    let error = ["--target-error", hard.as_str()];
    let ran = merge(&paths, &[&["--json"][..], &error].concat());
    assert_eq!(
        (ran.status, ran.json()["stop"].as_str()),
        (Some(3), Some("error_not_reached")),
        "{ran:?}"
    );
    // As many as it says are enough.
    let (_, note) = ran.stderr.split_once("make parts of them with `").unwrap();
    let (options, _) = note.split_once('`').unwrap();
    let options: Vec<&str> = options.split(' ').collect();
    assert_eq!(options[2..], ["--after", "19968"]);
    let more = parts(&folder, CUBE, 3, &options);
    let ran = merge(&[paths, more].concat(), &[&["--json"][..], &error].concat());
    assert_eq!(ran.status, Some(0), "{ran:?}");
    let expected = whole(CUBE, &[&options[..2], &error].concat());
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
    refused(&ran, &["`--part` needs `--walks`"]);
    let args = ["--walks", "30000"];
    let paths = parts(&folder, &open, 2, &args);
    let expected = folder.solve(&open, &[&args[..], &["--json"]].concat());
    let ran = merge(&paths, &["--json"]);
    assert_eq!(
        (ran.status, ran.timeless()),
        (expected.status, expected.timeless()),
        "{ran:?}"
    );
    assert!(ran.json()["resolvent"].is_object());
    // And one that is kept is the one that is not.
    let save = folder.at("run");
    let kept = folder.solve(&open, &["--json", "--save", &save]);
    let again = folder.solve(&open, &["--json", "--save", &save]);
    let never = folder.solve(&open, &["--json"]);
    assert_eq!(kept.timeless(), never.timeless());
    assert_eq!(again.timeless(), never.timeless());
}
