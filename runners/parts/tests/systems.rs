//! Solved systems in files: that they are used, shared, and never written in place.

use std::fs;
use std::path::Path;

use fredholm::systems::SystemStore;
use fredholm::{CubeModel, Solver};
use fredholm_core::Statistics;
use fredholm_parts::{Alone, Header, PartError, SystemContent, SystemFile};
use tempfile::TempDir;

fn header() -> Header {
    let problem = vec![("problem".to_owned(), "x y/2, x".to_owned())];
    Header::new(problem, String::new(), String::new(), String::new())
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

fn open(path: &Path) -> Result<SystemFile<'static>, PartError> {
    SystemFile::open(path, &header(), &Alone)
}

#[test]
fn the_numbers_of_the_file_are_those_that_walks_follow() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("system");
    let expected = walks(4, None);
    let file = SystemFile::make(&path, &header(), &Alone).unwrap();
    assert_eq!(walks(4, Some(&file)), expected);
    assert_eq!(walks(4, Some(&open(&path).unwrap())), expected);
    // Another v, a good file otherwise: as right, with other bits.
    let bytes = fs::read(&path).unwrap();
    let mut content = SystemContent::read(&path, &bytes).unwrap();
    content.saved.solution.to_mut().v[0] += 0.1;
    let mut changed = Vec::new();
    content.write(&mut changed).unwrap();
    let mapped = open(&path).unwrap();
    fs::remove_file(&path).unwrap();
    fs::write(&path, &changed).unwrap();
    assert_ne!(walks(4, Some(&open(&path).unwrap())), expected);
    // Whoever had the file mapped keeps what was there.
    assert_eq!(walks(4, Some(&mapped)), expected);
}

#[test]
fn numbers_that_do_not_fit_the_cells_are_refused() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("system");
    walks(
        4,
        Some(&SystemFile::make(&path, &header(), &Alone).unwrap()),
    );
    let bytes = fs::read(&path).unwrap();
    let changes: [fn(&mut SystemContent<'_>); 6] = [
        |content| content.saved.solution.to_mut().v.push(0.0),
        |content| content.saved.solution.to_mut().v[1] = f64::NAN,
        |content| content.saved.solution.to_mut().radius_bound = 1.0,
        |content| content.saved.coefficients.to_mut().truncate(3),
        |content| content.saved.coefficients.to_mut()[2] = f64::INFINITY,
        |content| content.saved.views.to_mut().push(0),
    ];
    for change in changes {
        let mut content = SystemContent::read(&path, &bytes).unwrap();
        change(&mut content);
        let mut changed = Vec::new();
        content.write(&mut changed).unwrap();
        fs::write(&path, &changed).unwrap();
        let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
        let file = open(&path).unwrap();
        let error = Solver::new(&u)
            .mean()
            .cells(4)
            .systems(&file)
            .solve()
            .unwrap_err();
        assert!(
            error.to_string().contains("do not fit these cells"),
            "{error}"
        );
    }
}

#[test]
fn a_system_of_other_cells_or_another_equation_is_refused() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("system");
    walks(
        4,
        Some(&SystemFile::make(&path, &header(), &Alone).unwrap()),
    );
    let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    let file = open(&path).unwrap();
    let error = Solver::new(&u)
        .mean()
        .cells(5)
        .systems(&file)
        .solve()
        .unwrap_err();
    assert!(
        error.to_string().contains("`cells` is 5 here and 4 there"),
        "{error}"
    );
    let other = vec![("problem".to_owned(), "x y/3, x".to_owned())];
    let other = Header::new(other, String::new(), String::new(), String::new());
    for open in [SystemFile::open, SystemFile::make] {
        let error = open(&path, &other, &Alone).unwrap_err();
        assert!(
            error.is_input && error.message.contains("`problem` is x y/3"),
            "{error}"
        );
    }
}
