//! Prints the error of v and √Var against stages in place of a matrix, with processor seconds and memory, on Linux.
//!
//! ```text
//! cargo run --profile dist -p fredholm --example stages -- CELLS STAGES DIMENSION
//! ```
//!
//! CELLS of an axis in two or three dimensions (3 if DIMENSION is left out), so that 46 are 97,336 in all; for every number of
//! stages up to STAGES.

mod common;

use common::{gauss, seconds};
use fredholm::Solver;

/// A number of /proc/self/status in MB; 0 where nobody tells.
fn megabytes(key: &str) -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix(key));
    let number = line.and_then(|line| {
        line.trim_start_matches(':')
            .split_whitespace()
            .next()?
            .parse()
            .ok()
    });
    number.unwrap_or(0.0) / 1024.0
}

fn table<const D: usize>(cells: u32, most: u32) {
    println!("{} cells in {D} dimensions", cells.pow(D as u32));
    println!(
        "stages   error of v in the mean, in a middle   std_dev of both   processor s   most MB"
    );
    for stages in 1..=most {
        let model = gauss::<D>().with_stages(stages);
        let middle = (f64::from(cells / 2) + 0.5) / f64::from(cells);
        let solver = Solver::new(&model)
            .mean()
            .at([middle; D])
            .cells(cells as usize);
        let start = seconds();
        let report = solver.walks(20_000).solve().expect("a result");
        let took = seconds() - start;
        let [mean, point] = &report.goals[..] else {
            return;
        };
        let exact = [1.0 + D as f64 / 3.0, 1.0 + D as f64 * middle * middle];
        let off = [mean.galerkin - exact[0], point.galerkin - exact[1]];
        let deviation = [mean, point].map(|goal| goal.preconditioned.std_dev.unwrap_or(f64::NAN));
        println!(
            "{stages:6}   {:10.2e} {:10.2e}   {:10.2e} {:10.2e}   {took:11.2}   {:7.1}",
            off[0],
            off[1],
            deviation[0],
            deviation[1],
            megabytes("VmHWM")
        );
    }
}

fn main() {
    let mut numbers = std::env::args()
        .skip(1)
        .map(|text| text.parse::<u32>().expect("a number"));
    let mut next = |otherwise: u32| numbers.next().unwrap_or(otherwise);
    let (cells, most) = (next(10), next(3));
    match next(3) {
        2 => table::<2>(cells, most),
        _ => table::<3>(cells, most),
    }
}
