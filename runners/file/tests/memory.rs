//! A formula's memory ends with its model: many solves in one process take no more than few.
#![cfg(target_os = "linux")]

use fredholm::answer::{Solved, Walks};
use fredholm::goals;
use fredholm::model::{Request, Wanted};

/// Solves a cube whose formula nobody has seen before, and gives the estimate.
fn solve(number: u32) -> f64 {
    let text = format!(
        "[problem]
kind = 'cube'
dimension = 1
kernel = '0.5 * exp(-(x - y)^2) / (1 + {number} / 100000)'
source = '1 + x / {}'
[galerkin]
cells = 4
[walk]
walks = 10
[[target]]
name = 'middle'
at = 0.5
",
        number + 1
    );
    let file = fredholm_file::read("mine.toml", &text).unwrap();
    file.validate().unwrap();
    let resolved = file.resolve().unwrap();
    let model = resolved.model.model();
    let goals = goals(model, &resolved.targets).unwrap();
    let walk = resolved.settings.walk_options();
    let cells = model
        .partition(&resolved.settings.discretisation())
        .unwrap();
    let solved = Solved::new(&*cells).unwrap();
    let request = Request {
        goals: &goals,
        walk: &walk,
        wanted: Wanted::All,
    };
    let walks = Walks {
        model,
        scalar: resolved.settings.scalar,
        execution: None,
    };
    let answer = solved.walk(&walks, &request, &()).unwrap();
    answer.outcome.statistics[0].preconditioned().estimate
}

/// Makes a system whose formulas nobody has seen before.
fn system(number: u32) {
    let text = format!(
        "[problem]
kind = 'system'
dimension = 1
[[problem.equation]]
kernel = ['x * y / (1 + {number})', '0.1']
source = '1'
[[problem.equation]]
kernel = ['0', '0.2']
source = 'x + {number}'
[[target]]
name = 'middle'
component = 1
at = 0.5
"
    );
    let file = fredholm_file::read("mine.toml", &text).unwrap();
    file.validate().unwrap();
    let resolved = file.resolve().unwrap();
    assert_eq!(resolved.targets.len(), 1);
}

/// Pages of this process that are in memory.
fn resident() -> f64 {
    let statm = std::fs::read_to_string("/proc/self/statm").unwrap();
    statm.split_whitespace().nth(1).unwrap().parse().unwrap()
}

#[test]
fn many_formulas_take_the_memory_of_few() {
    // A twentieth is half a megabyte: 180 bytes of each formula by day, and 55 in the long form.
    let few = if std::env::var_os("FREDHOLM_LONG").is_some() {
        1000
    } else {
        300
    };
    let mut after_few = f64::NAN;
    // In memory from the start, so that it is not counted.
    let mut estimates = vec![1_u64; 10 * few];
    for (number, estimate) in (1..).zip(&mut estimates) {
        *estimate = solve(number).to_bits();
        system(number);
        if number as usize == few {
            after_few = resident();
        }
    }
    let ratio = resident() / after_few;
    println!(
        "{after_few} pages after {few} solves, {ratio:.4} times as many after ten times so many"
    );
    assert!((0.95..1.05).contains(&ratio), "{ratio}");
    // Each was another equation: all but a few results differ.
    estimates.sort_unstable();
    estimates.dedup();
    assert!(estimates.len() > 99 * few / 10, "{}", estimates.len());
}
