//! Problems of the workspace pass the kit: one of every kind by day, two of circles, for one of three base seeds. The feature `long` has all
//! problems, those that take some seconds at most for all three seeds. With `FREDHOLM_LONG` there are three seeds for every
//! problem, and means are of ten times as many walks.

use core::time::Duration;
use std::collections::BTreeMap;
use std::time::Instant;

use fredholm_tests::check::{COMPARISONS, KOLMOGOROV, SEEDS, STANDARD_ERRORS, long, walks};
use fredholm_tests::runners::RUNNERS;
use problems::problems;
use rayon::prelude::*;

mod problems;

/// A line of the table of cases.
#[derive(Default)]
struct Line {
    problems: u64,
    plain: u64,
    preconditioned: u64,
    comparisons: u64,
    time: Duration,
}

#[test]
fn every_problem_passes_for_every_seed() {
    let began = Instant::now();
    let runs: Vec<_> = problems()
        .enumerate()
        .flat_map(|(i, problem)| {
            let (name, _) = problem;
            let (cube, room) = (name.starts_with("cube"), name.starts_with("room"));
            // Nothing is in the way there.
            let empty = ["room, square", "room, yard, open"].contains(name);
            let slow = (cube && (name.contains("degree") || name.contains("d = 5")))
                || (room && !empty)
                || *name == "circle, n = 200";
            let seeds = SEEDS.into_iter().enumerate();
            seeds
                .filter(move |&(s, _)| {
                    long() || cfg!(feature = "long") && !slow || s == i % SEEDS.len()
                })
                .map(move |(_, seed)| (problem, seed))
        })
        .collect();
    let reports: Vec<_> = runs
        .par_iter()
        .map(|&(&(name, examine), seed)| {
            let start = Instant::now();
            let report = examine(seed);
            let (name, time) = (format!("{name}, seed {seed}"), start.elapsed());
            println!("== {name}, {:.1} s\n{report}", time.as_secs_f64());
            (name, report, time)
        })
        .collect();
    let mut failures = Vec::new();
    let mut lines: BTreeMap<&str, Line> = BTreeMap::new();
    let mut nearest = (f64::INFINITY, String::new());
    for (name, report, time) in &reports {
        for row in report.failures() {
            failures.push(format!(
                "{name}, {} [{}]: {}",
                row.check, row.subject, row.outcome
            ));
        }
        let line = lines.entry(kind(name)).or_default();
        let [plain, preconditioned] = report.cases();
        line.problems += 1;
        line.plain += plain;
        line.preconditioned += preconditioned;
        line.time += *time;
        for row in report.rows() {
            let outcome = &row.outcome;
            if outcome.allowed == STANDARD_ERRORS || outcome.allowed == KOLMOGOROV {
                line.comparisons += outcome.comparisons;
            }
            let margin = outcome.allowed - outcome.distance;
            if outcome.allowed == STANDARD_ERRORS && !(margin >= nearest.0) {
                let case = format!("{name}, {} [{}]: {outcome}", row.check, row.subject);
                nearest = (margin, case);
            }
        }
    }
    println!(
        "{:<13} problems   plain with neighbour statistics seconds",
        ""
    );
    let mut all = Line::default();
    for (kind, line) in &lines {
        print(kind, line);
        all.problems += line.problems;
        all.plain += line.plain;
        all.preconditioned += line.preconditioned;
        all.comparisons += line.comparisons;
        all.time += line.time;
    }
    print("all", &all);
    let cases = all.plain + all.preconditioned;
    println!(
        "{cases} cases of problem, seed, scalar, estimator, generator and neighbour equation or none, each by \
         {RUNNERS} runners with the same bits; {} walks for a mean, {} with other generators; {} statistical comparisons; \
         {:.0} s on {} threads\nsmallest margin {:.2} of {STANDARD_ERRORS} standard errors: {}",
        walks(true),
        walks(false),
        all.comparisons,
        began.elapsed().as_secs_f64(),
        rayon::current_num_threads(),
        nearest.0,
        nearest.1
    );
    assert!(
        failures.is_empty(),
        "{} failures\n{}",
        failures.len(),
        failures.join("\n")
    );
    // What the derivation of STANDARD_ERRORS assumes.
    assert!(
        all.comparisons <= COMPARISONS,
        "{} statistical comparisons",
        all.comparisons
    );
}

/// "cube, d = 2" of "cube, d = 2, s t^2, seed 1", and "room" of "room, square, seed 1".
fn kind(name: &str) -> &str {
    let comma = |nth: usize| name.match_indices(", ").nth(nth).map(|(at, _)| at);
    let end = comma(usize::from(name.starts_with("cube")));
    let kind = &name[..end.unwrap_or(name.len())];
    kind.strip_suffix(" that leaves").unwrap_or(kind)
}

fn print(kind: &str, line: &Line) {
    let Line {
        problems,
        plain,
        preconditioned,
        comparisons,
        time,
    } = line;
    let seconds = time.as_secs_f64();
    println!(
        "{kind:<13} {problems:>8} {plain:>7} {preconditioned:>14} {comparisons:>10} {seconds:>7.0}"
    );
}
