//! Solved systems in files: one set-up for many runs, with the bits of a set-up of each.

use std::fs;

use crate::common::{CIRCLE, Folder, Ran, circle_with, fredholm, is_long, limited, refused, wait};
use crate::parts::{CUBE, ROOM, SPHERE, merge, parts, whole};

/// A product in two dimensions, whose tables are those of axes.
const PRODUCT: &str = "[problem]\nkind = 'cube'\ndimension = 2\n\
    kernel_factors = ['0.5 * exp(-(x - y)^2)', '1 - 0.3 * x * y']\nsource = '1 + x1'\n\
    [galerkin]\ncells = 4\ndegree = 1\n[walk]\nwalks = 20000\nbatch = 256\n\
    [[target]]\nname = 'mean'\nover = 'all'\n";

/// A cube of one dimension whose cells and degree are open.
pub(crate) const LINE: &str = "[problem]\nkind = 'cube'\ndimension = 1\nkernel = '0.5 * exp(-(x - y)^2)'\nsource = '1 + x'\n\
    [walk]\nmethod = 'walks'\n[[target]]\nname = 'u'\nat = 0.3\n";

/// A cube with a lamp for a floor.
pub(crate) const SCENE: &str = "[problem]\nkind = 'scene'\n[[problem.surface]]\nname = 'room'\npolygons = [\
    [[0,0,1],[0,1,1],[1,1,1],[1,0,1]], [[0,0,0],[0,0,1],[1,0,1],[1,0,0]], [[0,1,0],[1,1,0],[1,1,1],[0,1,1]], \
    [[0,0,0],[0,1,0],[0,1,1],[0,0,1]], [[1,0,0],[1,0,1],[1,1,1],[1,1,0]]]\nreflectance = 0.5\n\
    [[problem.surface]]\nname = 'lamp'\npolygon = [[0,0,0],[1,0,0],[1,1,0],[0,1,0]]\nemission = 1\n\
    [galerkin]\ncells = 24\n[walk]\nwalks = 20000\nbatch = 256\n\
    [[target]]\nname = 'a'\nat = [0.5, 0.5, 1]\n[[target]]\nname = 'b'\nover = 'room'\n";

/// The problem of this degree.
fn of_degree(problem: &str, degree: usize) -> String {
    let problem = problem
        .replace("degree = 0\n", "")
        .replace("degree = 1\n", "");
    problem.replace("[galerkin]\n", &format!("[galerkin]\ndegree = {degree}\n"))
}

fn solve(folder: &Folder, problem: &str, args: &[&str]) -> Ran {
    let ran = folder.solve(problem, &[args, &["--json"]].concat());
    assert_eq!(ran.status, Some(0), "{ran:?}");
    ran
}

/// The file with `--save-system`, with it again, and by `--system`: all have the bits of a run without.
fn has_the_same_bits(problem: &str, args: &[&str]) {
    let folder = Folder::new();
    let path = folder.at("system");
    // Several batches.
    let args: &[&str] = &[args, &["--walks", "1000"]].concat();
    let expected = whole(problem, args);
    for option in ["--save-system", "--save-system", "--system"] {
        let ran = solve(&folder, problem, &[args, &[option, &path]].concat());
        assert_eq!(ran.timeless(), expected, "{option} {args:?} {problem}");
    }
    // No more than the system is left.
    assert_eq!(folder.names(), ["problem.toml", "system"]);
}

#[test]
fn a_saved_system_has_the_bits_of_its_set_up() {
    for problem in [CIRCLE, CUBE, PRODUCT, ROOM, SPHERE, SCENE] {
        let degrees: &[usize] = match problem {
            SPHERE => &[0],
            _ if is_long() => &[0, 1, 2],
            _ => &[1],
        };
        for &degree in degrees {
            let problem = of_degree(problem, degree);
            let walks: &[[&str; 2]] = &[
                ["f64", "absorption"],
                ["f32", "collision"],
                ["f64", "collision"],
                ["f32", "absorption"],
            ];
            for [scalar, estimator] in &walks[..if is_long() { 4 } else { 2 }] {
                has_the_same_bits(&problem, &["--scalar", scalar, "--estimator", estimator]);
            }
        }
    }
}

#[test]
fn a_saved_system_serves_other_pairs_forms_and_global_estimates() {
    has_the_same_bits(ROOM, &["--pairs", "pointwise"]);
    has_the_same_bits(CIRCLE, &["--form", "product"]);
    for problem in [CIRCLE, CUBE, ROOM, SPHERE] {
        let global = ["--global", "--method", "walks", "--degree", "0"];
        has_the_same_bits(problem, &global);
    }
}

#[test]
fn one_system_serves_all_parts_seeds_and_targets() {
    let folder = Folder::new();
    let path = folder.at("system");
    let args = ["--save-system", path.as_str()];
    let paths = parts(&folder, ROOM, 3, &args);
    assert_eq!(merge(&paths, &["--json"]).timeless(), whole(ROOM, &[]));
    let written = fs::read(&path).unwrap();
    // What does not belong to the system may be other.
    let other = ROOM
        .replace("t = 0.4", "t = 0.7")
        .replace("batch = 256", "batch = 512");
    let args = ["--seed", "5", "--walks", "3000", "--pairs", "pointwise"];
    let system = ["--system", path.as_str()];
    let ran = solve(&folder, &other, &[&args[..], &system].concat());
    assert_eq!(ran.timeless(), whole(&other, &args));
    assert_eq!(fs::read(&path).unwrap(), written);
}

/// A file that may have no more bytes stands for a full disk.
#[test]
#[cfg(unix)]
fn a_full_disk_leaves_no_system_behind() {
    let folder = Folder::new();
    // 300² numbers of eight bytes.
    let file = folder.file("problem.toml", CUBE.replace("cells = 4", "cells = 10"));
    let path = folder.at("system");
    let args = ["solve", &file, "--save-system", &path];
    let ran = wait(limited("trap '' XFSZ; ulimit -f 100;", &args));
    assert_eq!((ran.status, ran.stdout.as_str()), (Some(1), ""), "{ran:?}");
    assert!(ran.stderr.contains("cannot write"), "{ran:?}");
    assert_eq!(folder.names(), ["problem.toml"]);
}

#[test]
fn a_system_of_another_problem_is_refused_with_what_differs() {
    let folder = Folder::new();
    let path = folder.at("system");
    solve(&folder, CIRCLE, &["--save-system", &path]);
    let written = fs::read(&path).unwrap();
    let others: [(&str, &[&str], &str); 6] = [
        (CIRCLE, &["--cells", "22"], "cells: 22 here and cells: 20"),
        (CIRCLE, &["--degree", "1"], "degree: 1 here and degree: 0"),
        (CIRCLE, &["--scalar", "f32"], "F32 here and scalar: F64"),
        (
            &circle_with("[0.3, 0.7]", "[0.3, 0.6]"),
            &[],
            "`problem` has",
        ),
        (
            &circle_with("constant = 5.0", "constant = 6.0"),
            &[],
            "`problem` has",
        ),
        (CUBE, &[], "`kind` has cube here and circle there"),
    ];
    for (problem, args, what) in others {
        for option in ["--system", "--save-system"] {
            let ran = folder.solve(problem, &[args, &[option, &path]].concat());
            refused(&ran, &["another problem", what, option, "system"]);
        }
    }
    assert_eq!(fs::read(&path).unwrap(), written);
}

/// Those of a run of its own; whoever takes the file has them, whatever its walks: alone 300 of them have more cells.
#[test]
fn open_cells_are_chosen_and_kept() {
    let folder = Folder::new();
    let path = folder.at("system");
    let alone = solve(&folder, LINE, &["--walks", "2000"]).json();
    let kept = ["--walks", "2000", "--save-system", &path];
    let kept = solve(&folder, LINE, &kept).json();
    let few = ["--walks", "300", "--system", &path];
    let few = solve(&folder, LINE, &few).json();
    for key in ["cells", "degree"] {
        assert_eq!([&kept[key], &few[key]], [&alone[key]; 2], "{key}");
    }
    let again = ["--walks", "2000", "--system", &path];
    let again = solve(&folder, LINE, &again).json();
    for found in [kept, again] {
        for key in ["pairs", "targets"] {
            assert_eq!(found[key], alone[key]);
        }
    }
    // More walks than there are without an error.
    let exact = ["--target-error", "1e-7", "--system", &path];
    let exact = solve(&folder, LINE, &exact).json();
    assert_eq!(
        [&exact["stop"], &exact["cells"]],
        [&"done".into(), &alone["cells"]]
    );
}

#[test]
fn what_is_no_system_is_refused_and_left_alone() {
    let folder = Folder::new();
    let path = folder.at("system");
    refused(
        &folder.solve(CIRCLE, &["--system", &path]),
        &["cannot open it"],
    );
    let none = folder.at("none/system");
    refused(
        &folder.solve(CIRCLE, &["--save-system", &none]),
        &["there is no folder"],
    );
    let notes = folder.file("notes", "buy milk");
    let empty = folder.file("empty", "");
    solve(&folder, CIRCLE, &["--save-system", &path]);
    let good = fs::read(&path).unwrap();
    let mut later = good.clone();
    later[16] = b'9';
    let later = folder.file("later", &later);
    let mut damaged = good.clone();
    damaged[good.len() / 2] ^= 1;
    let damaged = folder.file("damaged", &damaged);
    let short = folder.file("short", &good[..good.len() - 8]);
    let part = folder.at("part");
    solve(&folder, CIRCLE, &["--save", &part]);
    for option in ["--system", "--save-system"] {
        for (path, word) in [
            (&notes, "no solved system"),
            (&empty, "no solved system"),
            (&part, "no solved system"),
            (&later, "another version of the format"),
            (&damaged, "cut off or damaged"),
            (&short, "cut off or damaged"),
        ] {
            refused(&folder.solve(CIRCLE, &[option, path]), &[word, path]);
        }
    }
    assert_eq!(fs::read_to_string(&notes).unwrap(), "buy milk");
    refused(
        &folder.solve(CIRCLE, &["--system", &path, "--save-system", &path]),
        &["cannot be used with"],
    );
    // Plain walks are faster.
    let open = circle_with("cells = 20\n", "");
    let new = folder.at("new");
    let ran = folder.solve(&open, &["--save-system", &new, "--target-error", "0.5"]);
    refused(&ran, &["no system is set up", "`cells`"]);
    assert!(!folder.names().contains(&"new".to_owned()));
    assert!(
        folder.names().iter().all(|name| !name.starts_with('.')),
        "{:?}",
        folder.names()
    );
    let merged = fredholm(&["merge", &path]);
    refused(&merged, &["no part of a run"]);
}
