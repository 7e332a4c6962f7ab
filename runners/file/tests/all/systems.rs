//! Solved systems in files: that they are used, shared, and never written in place.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use fredholm::systems::SystemStore;
use fredholm::{CubeModel, Solver};
use fredholm_core::Statistics;
use fredholm_file::parts::{Header, SystemContent, SystemFile};
use tempfile::TempDir;

fn header() -> Header {
    let problem = vec![("problem".to_owned(), "x y/2, x".to_owned())];
    Header::new(problem, String::new(), String::new())
}

/// The bytes of the statistics of a run of u = 6x/5 on this number of cells.
fn walks(cells: usize, systems: Option<&dyn SystemStore>) -> Vec<[u8; Statistics::BYTES]> {
    let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    let solver = Solver::new(&u).mean().at(0.3).cells(cells).walks(2000);
    let solver = match systems {
        Some(systems) => solver.systems(systems),
        None => solver,
    };
    let answer = solver.answer().unwrap();
    let all = answer.outcome.statistics.iter();
    all.map(Statistics::to_bytes).collect()
}

/// A file with the system of four cells.
fn made(folder: &TempDir) -> PathBuf {
    let path = folder.path().join("system");
    walks(4, Some(&SystemFile::make(&path, &header()).unwrap()));
    path
}

/// The refusal of a run on this number of cells that follows this file.
fn refusal(cells: usize, file: &SystemFile) -> String {
    let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    let solver = Solver::new(&u).mean().cells(cells).systems(file);
    solver.solve().unwrap_err().to_string()
}

fn write(path: &Path, content: &SystemContent<'_>) {
    let mut bytes = Vec::new();
    content.write(&mut bytes).unwrap();
    fs::write(path, bytes).unwrap();
}

#[test]
fn the_numbers_of_the_file_are_those_that_walks_follow() {
    let folder = TempDir::new().unwrap();
    let path = made(&folder);
    let expected = walks(4, None);
    let mapped = SystemFile::open(&path, &header());
    assert_eq!(walks(4, Some(&mapped)), expected);
    // Another v, a good file otherwise: as right, with other bits.
    let bytes = fs::read(&path).unwrap();
    let mut content = SystemContent::read(&path, &bytes).unwrap();
    content.saved.solution.to_mut().v[0] += 0.1;
    fs::remove_file(&path).unwrap();
    write(&path, &content);
    let other = SystemFile::make(&path, &header()).unwrap();
    assert_ne!(walks(4, Some(&other)), expected);
    // Whoever had the file mapped keeps what was there.
    assert_eq!(walks(4, Some(&mapped)), expected);
}

#[test]
fn numbers_are_read_where_they_lie() {
    let bytes = fs::read(made(&TempDir::new().unwrap())).unwrap();
    // At every place of the memory, one of which is a multiple of 8.
    let borrowed = (0..8).filter(|&offset| {
        let moved = [&vec![0; offset][..], &bytes].concat();
        let read = SystemContent::read(Path::new("a"), &moved[offset..]).unwrap();
        let is_borrowed = matches!(read.saved.coefficients, Cow::Borrowed(_));
        assert_eq!(is_borrowed, moved[offset..].as_ptr().addr() % 8 == 0);
        is_borrowed
    });
    assert_eq!(borrowed.count(), 1);
}

#[test]
fn numbers_that_do_not_fit_the_cells_are_refused() {
    let folder = TempDir::new().unwrap();
    let path = made(&folder);
    let bytes = fs::read(&path).unwrap();
    let changes: [fn(&mut SystemContent<'_>); 5] = [
        |content| content.saved.solution.to_mut().v.push(0.0),
        |content| content.saved.solution.to_mut().v[1] = f64::NAN,
        |content| content.saved.solution.to_mut().radius_bound = 1.0,
        |content| content.saved.coefficients.to_mut().truncate(3),
        |content| content.saved.coefficients.to_mut()[2] = f64::INFINITY,
    ];
    for change in changes {
        let mut content = SystemContent::read(&path, &bytes).unwrap();
        change(&mut content);
        write(&path, &content);
        let error = refusal(4, &SystemFile::open(&path, &header()));
        assert!(error.contains("do not fit these cells"), "{error}");
    }
}

#[test]
fn a_system_that_is_damaged_or_of_other_cells_or_another_equation_is_refused() {
    let folder = TempDir::new().unwrap();
    let path = made(&folder);
    let error = refusal(5, &SystemFile::open(&path, &header()));
    assert!(error.contains("cells: 5 here and cells: 4"), "{error}");
    let other = vec![("problem".to_owned(), "x y/3, x".to_owned())];
    let other = Header::new(other, String::new(), String::new());
    let files = [
        SystemFile::open(&path, &other),
        SystemFile::make(&path, &other).unwrap(),
    ];
    for file in files {
        let error = refusal(4, &file);
        assert!(error.contains("`problem` has x y/3"), "{error}");
    }
    let good = fs::read(&path).unwrap();
    for place in 0..good.len() {
        let mut spoilt = good.clone();
        spoilt[place] ^= 1;
        let error = SystemContent::read(&path, &spoilt).unwrap_err();
        let expected = match place {
            0..16 => "no solved system",
            16..24 => "another version of the format",
            _ => "cut off or damaged",
        };
        assert!(error.message.contains(expected), "{place}: {error}");
        assert!(SystemContent::read(&path, &good[..place]).is_err());
    }
}
