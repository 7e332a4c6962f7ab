//! Files of batches that are cut, changed and many.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use fredholm::execute::OnThreads;
use fredholm::{CubeModel, Error, Execute, Sequence, SolveError, Solver};
use fredholm_core::{Batch, Statistics};
use fredholm_parts::{Content, Header, Keeper, Merged, PartFile, Record, Share, merge};
use tempfile::TempDir;

const WALKS: u64 = 2000;

/// Whether `FREDHOLM_LONG` asks for all cases.
fn is_long() -> bool {
    std::env::var_os("FREDHOLM_LONG").is_some()
}

fn header(problem: &str) -> Header {
    let problem = vec![("problem".to_owned(), problem.to_owned())];
    Header::new(problem, "a.toml".to_owned(), String::new(), String::new())
}

/// u = 6x/5: 20 batches of two goals.
fn with_solver<T>(then: impl FnOnce(Solver<'_>) -> T) -> T {
    let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    let settings = fredholm::Settings {
        cells: Some(4),
        walks: Some(WALKS),
        batch: Some(100),
        ..fredholm::Settings::default()
    };
    then(Solver::with(&u, settings, Vec::new()).mean().at([0.3]))
}

/// The statistics of a run that nobody divides.
fn whole() -> Vec<Statistics> {
    with_solver(|solver| solver.answer().unwrap().outcome.statistics)
}

fn bytes(all: &[Statistics]) -> Vec<[u8; Statistics::BYTES]> {
    all.iter().map(Statistics::to_bytes).collect()
}

/// Runs or goes on with a part.
fn keep(path: &Path, share: Option<Share>) -> Vec<Statistics> {
    let keeper = Keeper::open(path, &header("x"), share).unwrap();
    with_solver(|solver| solver.execute(&keeper).answer().unwrap().outcome.statistics)
}

fn of_merge(merged: &Merged) -> Vec<[u8; Statistics::BYTES]> {
    bytes(&merged.outcome.statistics)
}

#[test]
fn a_file_that_is_cut_anywhere_is_gone_on_with_to_the_same_bits() {
    let folder = TempDir::new().unwrap();
    let (path, cut) = (folder.path().join("whole"), folder.path().join("cut"));
    let expected = bytes(&whole());
    assert_eq!(bytes(&keep(&path, None)), expected);
    let all = fs::read(&path).unwrap();
    // Every length of the last records, and others a prime apart.
    let lengths = (0..all.len())
        .step_by(41)
        .chain(all.len() - 300..=all.len());
    for length in lengths {
        fs::write(&cut, &all[..length]).unwrap();
        assert_eq!(bytes(&keep(&cut, None)), expected, "{length}");
        // No batch is run twice: 20 of two goals.
        let content = Content::read(&cut, &fs::read(&cut).unwrap()).unwrap();
        assert_eq!(content.runs[0].records.len(), 40, "{length}");
        let merged = merge(core::slice::from_ref(&cut), None).unwrap();
        assert!(merged.missing.is_empty());
        assert_eq!(of_merge(&merged), expected, "{length}");
    }
}

/// Replicates of a sequence are batches: parts of them are those of one run.
#[test]
fn parts_of_a_sequence_merge_to_the_same_replicates() {
    let run = |execute: &dyn Execute| {
        with_solver(|solver| {
            let solver = solver.sequence(Sequence::Sobol).survivals(3);
            solver.execute(execute).answer().unwrap().outcome.statistics
        })
    };
    let folder = TempDir::new().unwrap();
    let paths = [1, 2].map(|part| {
        let path = folder.path().join(format!("part-{part}"));
        let after = 0;
        let share = Share { part, of: 2, after };
        run(&Keeper::open(&path, &header("x"), Some(share)).unwrap());
        path
    });
    let expected = run(&OnThreads);
    assert!(expected.iter().all(|all| all.replicates() == 20));
    assert_eq!(merge(&paths, None).unwrap().outcome.statistics, expected);
}

#[test]
fn a_part_with_any_byte_changed_is_refused_or_harmless() {
    let folder = TempDir::new().unwrap();
    let paths = [1, 2].map(|part| {
        let path = folder.path().join(format!("part-{part}"));
        keep(
            &path,
            Some(Share {
                part,
                of: 2,
                after: 0,
            }),
        );
        path
    });
    let expected = bytes(&whole());
    let good = fs::read(&paths[0]).unwrap();
    let mut harmless = 0;
    // The last batch, and the seconds behind it.
    let last = good.len() - 250;
    let changes: &[u8] = if is_long() { &[1, 0x80, 0xff] } else { &[1] };
    for place in 0..good.len() {
        for change in changes {
            let mut spoilt = good.clone();
            spoilt[place] ^= change;
            fs::write(&paths[0], &spoilt).unwrap();
            match merge(&paths, None) {
                Err(error) => {
                    assert!(error.is_input && !error.message.is_empty());
                }
                // The last record is left out: seconds. Or it is the last batch, which is then missing.
                Ok(merged) => {
                    assert!(place >= last, "{place}");
                    assert!(
                        !merged.missing.is_empty() || of_merge(&merged) == expected,
                        "{place}"
                    );
                    harmless += 1;
                }
            }
        }
    }
    assert!(harmless > 0);
    fs::write(&paths[0], &good).unwrap();
    assert_eq!(of_merge(&merge(&paths, None).unwrap()), expected);
}

#[test]
fn a_record_comes_back_to_the_bit_and_a_version_is_told() {
    let path = PathBuf::from("part");
    let old = Content::read(&path, b"fredholm part 2\nxyz").unwrap_err();
    assert!(
        old.message.contains("another version of the format"),
        "{old}"
    );
    assert!(
        Content::read(&path, b"fredholm")
            .unwrap_err()
            .message
            .contains("nothing of it")
    );
    // The error of (v, Φ) is no part of the bytes of statistics.
    let walked = Batch::resume(0, WALKS, WALKS, whole()[1]);
    let mut walked = walked.unwrap();
    walked.set_control_error(0.25);
    let record = Record {
        job: 1,
        goal: 2,
        batch: 1 << 40,
        statistics: *walked.statistics(),
    };
    assert_eq!(Record::from_bytes(&record.to_bytes()), Some(record));
}

#[test]
fn a_file_of_other_walks_is_not_gone_on_with() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("run");
    keep(&path, None);
    let before = fs::read(&path).unwrap();
    let other = PartFile::open(&path, &header("y"), None).unwrap_err();
    assert!(
        other.message.contains("`problem` is y here and x there"),
        "{other}"
    );
    let keeper = Keeper::open(&path, &header("x"), None).unwrap();
    let refused = with_solver(|solver| solver.seed(2).execute(&keeper).solve()).unwrap_err();
    let SolveError::Failed(Error::Kept {
        message,
        is_input: true,
    }) = refused
    else {
        panic!("{refused}");
    };
    assert!(
        message.contains("`seed` is 2 here and 1 there"),
        "{message}"
    );
    assert_eq!(fs::read(&path).unwrap(), before);
}

/// 200 parts by day, 10,000 with `FREDHOLM_LONG`, when it also says how long the merge took.
#[test]
fn thousands_of_parts_merge() {
    let of: u64 = if is_long() { 10_000 } else { 200 };
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("run");
    let walks = 10 * 100 * of;
    let keeper = Keeper::open(&path, &header("x"), None).unwrap();
    let expected = with_solver(|solver| {
        let solver = solver.walks(walks).execute(&keeper);
        bytes(&solver.answer().unwrap().outcome.statistics)
    });
    drop(keeper);
    let content = Content::read(&path, &fs::read(&path).unwrap()).unwrap();
    let run = &content.runs[0];
    let mut records = run.records.clone();
    records.sort_by_key(|record| (record.batch, record.goal));
    let mut paths: Vec<PathBuf> = (1..=of)
        .map(|part| {
            let path = folder.path().join(format!("part-{part}"));
            let share = Share { part, of, after: 0 };
            let (file, _) = PartFile::open(&path, &content.header, Some(share)).unwrap();
            file.begin_job(&run.job).unwrap();
            let its = (part as usize - 1) * 20..part as usize * 20;
            records[its].iter().for_each(|record| file.append(record));
            path
        })
        .collect();
    // In no order.
    paths.sort_by_key(|path| path.to_string_lossy().chars().rev().collect::<String>());
    let bytes_max = allocated(|| {
        let (start, before) = (Instant::now(), processor_seconds());
        let merged = merge(&paths, None).unwrap();
        println!(
            "{of} parts of 20 batches in {:.3} s, {:.3} s of the processor's",
            start.elapsed().as_secs_f64(),
            processor_seconds() - before
        );
        assert!(merged.missing.is_empty() && merged.parts == of as usize);
        assert_eq!(of_merge(&merged), expected);
    });
    println!("{bytes_max} bytes at most");
    // Paths, shares and one file; not the records of all, which are 128 bytes each.
    assert!(bytes_max < 400 * of + 200_000, "{bytes_max}");
}

/// Seconds for which this thread ran, which other programs do not matter to; NaN where the system does not say.
fn processor_seconds() -> f64 {
    let text = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = text
        .split(' ')
        .next()
        .and_then(|word| word.parse::<f64>().ok());
    nanoseconds.map_or(f64::NAN, |nanoseconds| 1e-9 * nanoseconds)
}

/// The most bytes that were held at a time.
fn allocated(work: impl FnOnce()) -> u64 {
    allocation_counter::measure(work).bytes_max
}

/// The lock is of the open file, so that one process may stand for two.
#[test]
fn a_file_that_is_held_is_refused_and_left_as_it_is() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("held");
    keep(&path, None);
    let written = fs::read(&path).unwrap();
    let held = Keeper::open(&path, &header("x"), None).unwrap();
    let error = Keeper::open(&path, &header("x"), None).unwrap_err();
    assert!(
        error.is_input && error.message.contains("another process is writing it"),
        "{error}"
    );
    assert_eq!(fs::read(&path).unwrap(), written);
    // It may be looked at meanwhile, and had when nobody holds it any more.
    assert!(
        merge(core::slice::from_ref(&path), None)
            .unwrap()
            .missing
            .is_empty()
    );
    drop(held);
    assert!(Keeper::open(&path, &header("x"), None).is_ok());
}
