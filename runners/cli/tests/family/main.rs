//! Random problems with an error and nothing else: every run ends, with an answer or with a reason, and takes little more
//! than the best of a ladder of fixed settings.
//!
//! A day's share of each half is run by default, all of them with `FREDHOLM_LONG=1`, so many with `FREDHOLM_LONG=40`.

mod ladder;
mod problems;

use core::fmt::Write as _;
use std::time::Instant;

use fredholm::answer::Answer;
use fredholm::choice::Chosen;
use fredholm::{Choices, Error, Tolerance};
use fredholm_core::{Statistics, StopReason};

use ladder::{Opened, Rung};
use problems::{Problem, Random};

/// Problems that were looked at when the choice was made, and others.
const SEEN: u64 = 1;
const UNSEEN: u64 = 3;

/// The problems of a half in a day's share, and in all.
const FEW: usize = 3;
const ALL: usize = 250;

/// Seconds that the best of the ladder may take: the error of a problem that takes longer is made larger.
const MOST_SECONDS: f64 = 20.0;
/// The time of the choice is at most so many times that of the best of the ladder.
const MOST_TIMES: f64 = 4.0;
/// Seconds that are lost in any case: some pilots of some hundred walks.
const LEAST_SECONDS: f64 = 0.005;

#[test]
fn problems_that_were_seen_end() {
    run(SEEN);
}

#[test]
fn problems_that_were_not_seen_end() {
    run(UNSEEN);
}

fn run(seed: u64) {
    let long = std::env::var("FREDHOLM_LONG").ok();
    let count = match long.as_deref().map(str::parse) {
        None => FEW,
        Some(Ok(count)) if count > 1 => count,
        Some(_) => ALL,
    };
    let mut random = Random(seed);
    let mut all = Vec::new();
    for number in 0..count {
        let problem = Problem::new(&mut random, long.is_some());
        let ran = ran(&problem);
        println!("{seed}.{number} {}", ran.text);
        all.push(ran);
    }
    summary(&all);
}

/// What came of a problem.
struct Ran {
    text: String,
    /// The time over that of the best of the ladder, if both came to an end.
    ratio: Option<f64>,
    /// The difference of both estimates in standard errors.
    z: Option<f64>,
}

fn ran(problem: &Problem) -> Ran {
    let file = fredholm_file::read("problem.toml", &problem.text).unwrap();
    file.validate().unwrap();
    let resolved = file.resolve().unwrap();
    let mut opened = Opened::new(&resolved);
    let rungs = opened.ladder(problem.cells);
    let tolerance = feasible(problem, &rungs);
    let best = best(&rungs, &opened, tolerance);

    let mut settings = opened.settings.clone();
    settings.tolerance = Some(tolerance);
    opened.settings = &settings;
    let start = Instant::now();
    let goals = &opened.goals;
    let solved = fredholm::choice::solve(opened.model, &resolved.targets, goals, &settings, &());
    let measured = start.elapsed().as_secs_f64();
    let (mut ratio, mut z) = (None, None);
    let mut text = format!("{}, {tolerance:?}: ", problem.name);
    match solved {
        Ok(Some((chosen, answer))) => {
            let seconds = seconds(&chosen, &answer);
            let found = &answer.outcome.statistics[0];
            write!(
                text,
                "{} {seconds:.4} s ({measured:.4}) {}",
                ending(&answer),
                setting(&chosen)
            )
            .unwrap();
            if let Some(why) = answer.gave_up {
                write!(text, " ({why})").unwrap();
            }
            if let Some((rung, walked)) = &best {
                let least = rung.seconds_of(walked.walks());
                let times = seconds / (least + LEAST_SECONDS);
                write!(text, ", {times:.2} times {least:.4} s of {}", rung.name()).unwrap();
                ratio = (answer.outcome.stop == StopReason::Done).then_some(times);
                z = deviation(found, walked, answer.floors[0]);
            }
        }
        Ok(None) => panic!("nothing was chosen: {}", problem.text),
        Err(refusal @ (Error::TooLong { .. } | Error::InfiniteVariance { .. } | Error::Dark)) => {
            write!(text, "refused: {refusal}").unwrap();
            if let Some((rung, walked)) = &best {
                write!(
                    text,
                    ", {:.4} s of {}",
                    rung.seconds_of(walked.walks()),
                    rung.name()
                )
                .unwrap();
            }
        }
        Err(other) => panic!("{other}: {}", problem.text),
    }
    if let Some(z) = z {
        write!(text, ", z {z:.2}").unwrap();
    }
    Ran { text, ratio, z }
}

/// The error that is asked for, or the least that the ladder reaches soon.
fn feasible(problem: &Problem, rungs: &[Rung]) -> Tolerance {
    let mut error = problem.error;
    loop {
        let tolerance = if problem.relative {
            Tolerance::Relative(error)
        } else {
            Tolerance::Absolute(error)
        };
        let soon = rungs
            .iter()
            .any(|rung| rung.seconds(tolerance) < MOST_SECONDS);
        if soon || error > 1.0 {
            return tolerance;
        }
        error *= 1.5;
    }
}

/// The rung that is the fastest by few walks, and its walks: the next one if it takes many times as many.
fn best(rungs: &[Rung], problem: &Opened<'_>, tolerance: Tolerance) -> Option<(Rung, Statistics)> {
    let mut sorted: Vec<&Rung> = rungs.iter().collect();
    sorted.sort_by(|a, b| a.seconds(tolerance).total_cmp(&b.seconds(tolerance)));
    let soon = sorted
        .into_iter()
        .filter(|rung| rung.seconds(tolerance) < 2.0 * MOST_SECONDS);
    let mut ran = soon.map(|rung| Some((*rung, rung.run(problem, tolerance)?)));
    ran.find_map(|ran| ran)
}

/// Predicted seconds of what was done.
fn seconds(chosen: &Chosen<'_>, answer: &Answer) -> f64 {
    let report = &chosen.report;
    let states: u64 = answer
        .outcome
        .statistics
        .iter()
        .map(Statistics::states)
        .sum();
    let walked = states as f64 / report.predicted_states;
    report.predicted_pilot_seconds
        + report.predicted_setup_seconds
        + walked * report.predicted_walk_seconds
}

fn setting(chosen: &Chosen<'_>) -> String {
    let (cut, walk) = (
        chosen.settings.discretisation(),
        chosen.settings.walk_options(),
    );
    let cells = if chosen.plain {
        0
    } else {
        cut.cells.unwrap_or(0)
    };
    format!(
        "{cells} {} {} {} {}",
        cut.degree,
        walk.pairs.word(),
        walk.absorption,
        walk.estimator.word()
    )
}

/// In a word how it ended.
fn ending(answer: &Answer) -> &'static str {
    match answer.outcome.stop {
        StopReason::Done => "done",
        StopReason::ToleranceNotReached if answer.gave_up.is_some() => "gave up",
        other => panic!("{other:?}"),
    }
}

/// The difference in standard errors, of which rounding may leave some.
fn deviation(one: &Statistics, other: &Statistics, floor: f64) -> Option<f64> {
    let [one, other] = [one, other].map(Statistics::preconditioned);
    let error = one.std_error?.hypot(other.std_error?);
    let difference = ((one.estimate - other.estimate).abs() - 2.0 * floor).max(0.0);
    Some(difference / error)
}

fn summary(all: &[Ran]) {
    let mut ratios: Vec<f64> = all.iter().filter_map(|ran| ran.ratio).collect();
    ratios.sort_by(f64::total_cmp);
    let deviations: Vec<f64> = all.iter().filter_map(|ran| ran.z).collect();
    let inside = deviations.iter().filter(|&&z| z <= 1.96).count();
    let median = ratios.get(ratios.len() / 2);
    println!(
        "{} of {} done, ratios {:?} in the median, {:?} at most; {inside} of {} within 1.96",
        ratios.len(),
        all.len(),
        median,
        ratios.last(),
        deviations.len()
    );
    assert!(ratios.last() < Some(&MOST_TIMES), "{ratios:.2?}");
}
