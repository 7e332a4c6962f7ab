//! Every problem of the workspace passes the kit, for three base seeds; cubes and rooms of higher degree, which take
//! minutes, for one of the three, unless `FREDHOLM_LONG` is set.

use fredholm_tests::check::STANDARD_ERRORS;
use fredholm_tests::matrix::{PROBLEMS, SEEDS};
use rayon::prelude::*;

#[test]
fn every_problem_passes_for_every_seed() {
    let long = std::env::var_os("FREDHOLM_LONG").is_some();
    let runs: Vec<_> = PROBLEMS
        .iter()
        .enumerate()
        .flat_map(|(i, problem)| {
            let (name, _) = problem;
            let slow = name.contains("degree") && (name.contains("cube") || name.contains("room"));
            let seeds = SEEDS.into_iter().enumerate();
            seeds
                .filter(move |&(s, _)| long || !slow || s == i % SEEDS.len())
                .map(move |(_, seed)| (problem, seed))
        })
        .collect();
    let reports: Vec<_> = runs
        .par_iter()
        .map(|&(&(name, examine), seed)| {
            let start = std::time::Instant::now();
            let report = examine(seed);
            (format!("{name}, seed {seed}"), report, start.elapsed())
        })
        .collect();
    for (name, report, time) in &reports {
        println!("== {name}, {:.1} s\n{report}", time.as_secs_f64());
    }
    let mut failures = Vec::new();
    for (name, report, _) in &reports {
        for row in report.failures() {
            failures.push(format!(
                "{name}, {} [{}]: {}",
                row.check, row.subject, row.outcome
            ));
        }
    }
    assert!(
        failures.is_empty(),
        "{} failures\n{}",
        failures.len(),
        failures.join("\n")
    );
    let statistical: u64 = reports
        .iter()
        .flat_map(|(_, report, _)| report.rows())
        .filter(|row| row.outcome.allowed == STANDARD_ERRORS)
        .map(|row| row.outcome.comparisons)
        .sum();
    println!("{statistical} statistical comparisons");
    // What the derivation of STANDARD_ERRORS assumes.
    assert!(
        statistical <= 20_000,
        "{statistical} statistical comparisons"
    );
}
