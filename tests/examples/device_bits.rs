//! Prints the firmware's cases as this machine computes them, for `.ci/firmware`: by the embedded
//! runner without an argument, by rayon with so many threads as the argument says.

use fredholm_tests::device::{With, lines};

fn main() {
    let with = match std::env::args().nth(1) {
        Some(threads) => With::Rayon(threads.parse().expect("a number of threads")),
        None => With::Embedded(1000),
    };
    print!("{}", lines(with));
}
