//! Files of batches.

use std::path::Path;

use fredholm::{CubeModel, Method, Solver};
use fredholm_file::parts::{Header, Keeper, Part};

use crate::container::mended;
use crate::memory::Bound;

/// What reading takes: numbers of two letters become sixteen bytes each, in lists that grow to twice their size.
const MEMORY: Bound = Bound {
    each: 128,
    besides: 64 << 10,
};

/// Reads a part.
///
/// # Panics
/// If that takes more memory than it may, if a refusal does not name the file, or if what is read is written otherwise.
pub fn part(bytes: &[u8]) {
    let path = Path::new("part-1");
    match MEMORY.holds(bytes.len(), || Part::read(path, bytes)) {
        Err(error) => {
            let text = error.to_string();
            assert!(
                text.starts_with("part-1: ") && !text.contains(char::is_control),
                "{text:?}"
            );
        }
        Ok(part) => {
            let mut written = Vec::new();
            part.write(&mut written).expect("room for some bytes");
            let again = Part::read(path, &written).expect("it was written");
            let mut twice = Vec::new();
            again.write(&mut twice).expect("room for some bytes");
            assert_eq!(written, twice);
        }
    }
}

/// As [`part`], with the checksum and the length of the head mended, so that what is behind them is met.
///
/// # Panics
/// As [`part`].
pub fn part_with_checksum(bytes: &[u8]) {
    let end = |head: &[u8]| head.windows(2).rposition(|two| two == b"}}");
    if let Some(mended) = mended(bytes, b"fredholm part 2        \n", end) {
        part(&mended);
    }
}

/// A good part, of three batches.
///
/// # Panics
/// Where there is no folder for temporary files.
#[must_use]
pub fn good_part() -> Vec<u8> {
    let name = format!("fredholm-hostile-{}", std::process::id());
    let path = std::env::temp_dir().join(name);
    let problem = vec![("kind".to_owned(), "cube".to_owned())];
    let header = Header::new(problem, "a.toml".to_owned(), String::new());
    let share = "1/2".parse().ok();
    let keeper = Keeper::open(Some(&path), &header, share).expect("a temporary file");
    let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    let solver = Solver::new(&u)
        .mean()
        .cells(4)
        .walks(6 * 4096)
        .method(Method::Walks);
    solver.execute(&keeper).solve().expect("some walks");
    let bytes = std::fs::read(&path).expect("what was kept");
    std::fs::remove_file(&path).expect("what was kept");
    bytes
}
