//! A program for an instruction counter: runs one loop, so that two runs of different length tell
//! the instructions of a state without those of the set-up. `.ci/instructions` calls it.
//!
//! Arguments: engine|specialised, cells, walks. Prints the number of states.

mod loops;

use loops::{Setup, Specialised};

fn main() {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    let [name, cells, walks] = &arguments[..] else {
        eprintln!("usage: instructions engine|specialised CELLS WALKS");
        return;
    };
    let setup = Setup::new(cells.parse().expect("a number of cells"));
    let walks = walks.parse().expect("a number of walks");
    let states = match name.as_str() {
        "engine" => setup.engine(walks).states(),
        "specialised" => Specialised::new(&setup).run(walks).2,
        other => panic!("no loop is called {other}"),
    };
    println!("{states}");
}
