//! Files of batches that are incomplete, changed and many.

use std::fs;
use std::path::{Path, PathBuf};

use fredholm::execute::OnThreads;
use fredholm::{CubeModel, Error, Execute, Sequence, SolveError, Solver};
use fredholm_core::Statistics;
use fredholm_file::parts::{Header, Keeper, Part, Share, merge};
use tempfile::TempDir;

const WALKS: u64 = 2000;

fn header(problem: &str) -> Header {
    let problem = vec![("problem".to_owned(), problem.to_owned())];
    Header::new(problem, "a.toml".to_owned(), String::new())
}

fn share(part: u64, of: u64) -> Option<Share> {
    Some(Share { part, of, after: 0 })
}

/// The statistics of u = 6x/5: 20 batches of two goals.
fn run(execute: &dyn Execute, change: fn(Solver<'_>) -> Solver<'_>) -> Vec<Statistics> {
    let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    let settings = fredholm::Settings {
        cells: Some(4),
        walks: Some(WALKS),
        batch: Some(100),
        ..fredholm::Settings::default()
    };
    let solver = Solver::with(&u, settings, Vec::new()).mean().at([0.3]);
    let answer = change(solver.execute(execute)).answer();
    answer.unwrap().outcome.statistics
}

/// Runs or goes on with a part.
fn keep(path: &Path, share: Option<Share>) -> Vec<Statistics> {
    let keeper = Keeper::open(Some(path), &header("x"), share).unwrap();
    run(&keeper, |solver| solver)
}

fn read(path: &Path) -> Part {
    Part::read(path, &fs::read(path).unwrap()).unwrap()
}

fn write(path: &Path, part: &Part) {
    let mut bytes = Vec::new();
    part.write(&mut bytes).unwrap();
    fs::write(path, bytes).unwrap();
}

#[test]
fn a_file_with_any_batches_is_gone_on_with_to_the_same_bits() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("run");
    let expected = run(&OnThreads, |solver| solver);
    assert_eq!(keep(&path, None), expected);
    let whole = read(&path);
    let count = |part: &Part| part.runs[0].batches.len();
    assert_eq!(count(&whole), 40);
    for number in 0..30_u64 {
        let mut some = whole.clone();
        let has = |(batch, goal): (u64, u64)| (batch * 7 + goal * 3 + number) % 5 < number % 4;
        some.runs[0].batches.retain(|key, _| has(*key));
        write(&path, &some);
        let merged = merge(core::slice::from_ref(&path), None).unwrap();
        // Batches of each goal up to its first gap.
        for (goal, statistics) in (0..).zip(&merged.outcome.statistics) {
            let front = (0..20).take_while(|&batch| has((batch, goal))).count();
            assert_eq!(statistics.walks(), 100 * front as u64, "{number}");
        }
        let lacked = (0..20).filter(|&batch| !(has((batch, 0)) && has((batch, 1))));
        let missing: Vec<u64> = merged.missing.into_iter().flatten().collect();
        assert_eq!(missing, lacked.collect::<Vec<_>>(), "{number}");
        assert_eq!(keep(&path, None), expected, "{number}");
        assert_eq!(count(&read(&path)), 40);
        let merged = merge(core::slice::from_ref(&path), None).unwrap();
        assert!(merged.missing.is_empty());
        assert_eq!(merged.outcome.statistics, expected, "{number}");
    }
    // A file that is there and empty is begun.
    fs::write(&path, "").unwrap();
    assert_eq!(keep(&path, None), expected);
}

/// Replicates of a sequence are batches: parts of them are those of one run.
#[test]
fn parts_of_a_sequence_merge_to_the_same_replicates() {
    fn sobol(solver: Solver<'_>) -> Solver<'_> {
        solver.sequence(Sequence::Sobol).forced_steps(3)
    }
    let folder = TempDir::new().unwrap();
    let paths = [1, 2].map(|part| {
        let path = folder.path().join(format!("part-{part}"));
        run(
            &Keeper::open(Some(&path), &header("x"), share(part, 2)).unwrap(),
            sobol,
        );
        path
    });
    let expected = run(&OnThreads, sobol);
    assert!(expected.iter().all(|all| all.replicates() == 20));
    assert_eq!(merge(&paths, None).unwrap().outcome.statistics, expected);
}

#[test]
fn a_part_that_is_changed_or_cut_off_is_refused() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("part");
    keep(&path, share(1, 2));
    let good = fs::read(&path).unwrap();
    let refused = |bytes: &[u8]| Part::read(&path, bytes).unwrap_err().message;
    for place in 0..good.len() {
        let mut spoilt = good.clone();
        spoilt[place] ^= 1;
        let expected = match place {
            0..14 => "no part of a run",
            14..24 => "another version of the format",
            _ => "cut off or damaged",
        };
        assert!(refused(&spoilt).contains(expected), "{place}");
        assert!(!refused(&good[..place]).is_empty());
    }
    // A good file of numbers that cannot be.
    let mut part = read(&path);
    let statistics = part.runs[0].batches[&(0, 0)];
    part.runs[0].batches.insert((0, 2), statistics);
    write(&path, &part);
    assert!(refused(&fs::read(&path).unwrap()).contains("contradict"));
}

#[test]
fn statistics_come_back_to_the_bit() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("part");
    let all = keep(&path, None);
    let mut part = read(&path);
    let key = (1 << 40, 1);
    part.runs[0].batches.insert(key, all[1]);
    write(&path, &part);
    assert_eq!(read(&path).runs[0].batches, part.runs[0].batches);
    // As bits, not only as numbers.
    let found = read(&path).runs[0].batches[&key];
    assert_eq!(found.to_bytes(), all[1].to_bytes());
}

#[test]
fn a_file_of_other_walks_is_not_gone_on_with() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("run");
    keep(&path, None);
    let before = fs::read(&path).unwrap();
    let other = Keeper::open(Some(&path), &header("y"), None).unwrap_err();
    assert!(
        other.message.contains("`problem` has y here and x there"),
        "{other}"
    );
    let keeper = Keeper::open(Some(&path), &header("x"), None).unwrap();
    let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    let solver = Solver::new(&u).mean().cells(4).seed(2);
    let refused = solver.execute(&keeper).solve().unwrap_err();
    let SolveError::Failed(Error::Kept {
        message,
        is_input: true,
    }) = refused
    else {
        panic!("{refused}");
    };
    assert!(message.contains("seed: 2 here and seed: 1"), "{message}");
    assert_eq!(fs::read(&path).unwrap(), before);
}

#[test]
fn many_parts_merge_in_any_order_and_batches_that_differ_are_refused() {
    const OF: u64 = 200;
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("run");
    let keeper = Keeper::open(Some(&path), &header("x"), None).unwrap();
    let expected = run(&keeper, |solver| solver.walks(10 * 100 * OF));
    drop(keeper);
    let whole = read(&path);
    let mut paths: Vec<PathBuf> = (1..=OF)
        .map(|number| {
            let path = folder.path().join(format!("part-{number}"));
            let mut part = whole.clone();
            part.share = share(number, OF);
            let its = (number - 1) * 10..number * 10;
            part.runs[0].batches.retain(|key, _| its.contains(&key.0));
            write(&path, &part);
            path
        })
        .collect();
    // In no order.
    paths.sort_by_key(|path| path.to_string_lossy().chars().rev().collect::<String>());
    let merged = merge(&paths, None).unwrap();
    assert!(merged.missing.is_empty());
    assert_eq!(merged.outcome.statistics, expected);
    let mut other = whole;
    let statistics = other.runs[0].batches[&(4, 0)];
    other.runs[0].batches.insert((3, 0), statistics);
    write(&path, &other);
    paths.push(path);
    let error = merge(&paths, None).unwrap_err();
    assert!(error.message.contains("batch 3 of goal 0"), "{error}");
}

/// The lock is of the open file, so that one process may stand for two.
#[test]
fn a_file_that_is_held_is_refused_and_left_as_it_is() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("held");
    let held = Keeper::open(Some(&path), &header("x"), None).unwrap();
    let is_refused = || {
        let error = Keeper::open(Some(&path), &header("x"), None).unwrap_err();
        error.is_input && error.message.contains("another process is writing it")
    };
    assert!(is_refused());
    // Nor when it was written again since.
    run(&held, |solver| solver);
    let written = fs::read(&path).unwrap();
    assert!(is_refused());
    assert_eq!(fs::read(&path).unwrap(), written);
    // It may be looked at meanwhile, and had when nobody holds it any more.
    let merged = merge(core::slice::from_ref(&path), None).unwrap();
    assert!(merged.missing.is_empty());
    drop(held);
    assert!(Keeper::open(Some(&path), &header("x"), None).is_ok());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}
