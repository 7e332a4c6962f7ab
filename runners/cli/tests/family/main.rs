//! Random problems with an error and nothing else: every run ends, with an answer or with a reason, and takes little more
//! than the best of a ladder of fixed settings.
//!
//! A day's share of each half is run by default, all of them with `FREDHOLM_LONG=1`, so many with `FREDHOLM_LONG=40`.
//! `FREDHOLM_NUMBER=15.25` runs number 25 of seed 15, and prints its file.

mod ladder;
mod problems;

use core::fmt::Write as _;

use fredholm::answer::Answer;
use fredholm::choice::Chosen;
use fredholm::execute::OnThreads;
use fredholm::{Choices, Error, Execute, Settings, SolveObserver, Target, Tolerance};
use fredholm_core::{Statistics, StopReason};

use ladder::{Opened, Rung};
use problems::{MOST_ERROR, Problem, Random};

/// Problems that were looked at when the choice was made, and others.
const SEEN: u64 = 1;
const UNSEEN: u64 = 21;

/// The problems of a half in a day's share, and in all.
const FEW: u64 = 2;
const ALL: u64 = 250;

/// The time of the choice is at most so many times that of the best of the ladder.
const MOST_TIMES: f64 = 4.0;
/// Variance times time of given walks is at most so many times that of the best of the ladder: its set-up may take four times as long as all
/// pilots may, and leave so much less.
const MOST_GIVEN: f64 = 16.0;
/// Walks of each target where no error is asked for.
const GIVEN: u64 = 30_000;
/// A problem whose best rung takes more seconds at the largest error is left out: nobody waits for it.
const LONGEST: f64 = 60.0;
/// Seconds that are lost in any case: some pilots of some hundred walks.
const LEAST_SECONDS: f64 = 0.005;

#[test]
fn problems_that_were_seen_end() {
    let Ok(number) = std::env::var("FREDHOLM_NUMBER") else {
        return run(SEEN);
    };
    let (seed, number) = number.split_once('.').expect("seed.number");
    let (seed, number): (u64, u64) = (seed.parse().unwrap(), number.parse().unwrap());
    let mut random = Random(seed);
    let all = (0..=number).map(|number| Problem::new(&mut random, 1000 * seed + number, true));
    let problem = all.last().unwrap();
    println!("{}", problem.text);
    let ran = ran_on_one_thread(&problem);
    println!("{}", ran.text);
    summary(&[ran]);
}

#[test]
fn problems_that_were_not_seen_end() {
    run(UNSEEN);
}

fn run(seed: u64) {
    let long = std::env::var("FREDHOLM_LONG").ok();
    let long = long.and_then(|text| text.parse().ok());
    let count = match long {
        None => FEW,
        Some(1) => ALL,
        Some(count) => count,
    };
    let mut random = Random(seed);
    let mut all = Vec::new();
    for number in 0..count {
        let problem = Problem::new(&mut random, 1000 * seed + number, long.is_some());
        let ran = ran_on_one_thread(&problem);
        println!("{seed}.{number} {}", ran.text);
        all.push(ran);
    }
    summary(&all);
}

/// What the choice is compared with.
struct Reference {
    /// The error that the ladder reaches soon.
    error: f64,
    /// Whether it is larger than what was drawn.
    is_relaxed: bool,
    /// The best of the ladder, if one ends.
    best: Option<Best>,
    /// What was looked at.
    rungs: Vec<Rung>,
    /// Whether none of the ladder comes to an end that somebody waits for.
    is_left_out: bool,
}

/// The best of the ladder.
struct Best {
    name: String,
    seconds: f64,
    /// The estimate of the first target, and its standard error.
    found: [f64; 2],
}

impl Reference {
    fn new(problem: &Problem, opened: &Opened<'_>) -> Self {
        let (mut rungs, mut steps) = (Vec::new(), opened.steps(problem.cells));
        let (mut tolerance, mut is_relaxed) = (problem.tolerance(problem.error), false);
        loop {
            let until = (tolerance, problem.most_seconds);
            opened.refine(&mut rungs, &mut steps, until);
            let found = feasible(problem, &rungs);
            if found.0 == tolerance {
                break;
            }
            (tolerance, is_relaxed) = found;
        }
        let best = best(&rungs, problem, opened, tolerance);
        let ends = rungs.iter().any(|rung| rung.seconds(tolerance).is_finite());
        Self {
            is_left_out: ends && best.is_none(),
            error: tolerance.bound(),
            is_relaxed,
            best,
            rungs,
        }
    }
}

/// What came of a problem.
struct Ran {
    text: String,
    is_relaxed: bool,
    /// The time over that of the best of the ladder, if both came to an end.
    ratio: Option<f64>,
    /// The difference of both estimates in standard errors.
    z: Option<f64>,
    /// Variance times seconds over that of the best of the ladder, where no error is asked for.
    given: Option<f64>,
}

/// Runs a problem on one thread: its clock is that of the work.
fn ran_on_one_thread(problem: &Problem) -> Ran {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1);
    pool.build().unwrap().install(|| ran(problem))
}

fn ran(problem: &Problem) -> Ran {
    let file = fredholm_file::read("problem.toml", &problem.text).unwrap();
    file.validate().unwrap();
    let resolved = file.resolve().unwrap();
    let without = Settings {
        tolerance: None,
        walks: Some(GIVEN),
        ..resolved.settings.clone()
    };
    let mut opened = Opened::new(&resolved);
    let reference = Reference::new(problem, &opened);
    let tolerance = problem.tolerance(reference.error);
    let mut ran = Ran {
        text: format!("{}, {tolerance:?}: ", problem.name),
        is_relaxed: reference.is_relaxed,
        ratio: None,
        z: None,
        given: None,
    };
    if reference.is_left_out {
        ran.text.push_str("left out");
        return ran;
    }

    let mut settings = opened.settings.clone();
    settings.tolerance = Some(tolerance);
    opened.settings = &settings;
    opened.look_at_variance();
    let goals = &opened.goals;
    let solved = fredholm::choice::solve(
        opened.model,
        &resolved.targets,
        goals,
        &settings,
        (&(), &OnThreads),
    );
    let text = &mut ran.text;
    let best = reference.best.as_ref();
    match solved {
        Ok(Some((chosen, answer))) => {
            let seconds = seconds(&chosen, &answer);
            let is_done = answer.outcome.stop == StopReason::Done;
            write!(
                text,
                "{} {seconds:.4} s {}",
                ending(&answer),
                setting(&chosen)
            )
            .unwrap();
            if let Some(why) = answer.gave_up {
                write!(text, " ({why})").unwrap();
            }
            if let Some(best) = best {
                let times = seconds / (best.seconds + LEAST_SECONDS);
                write!(
                    text,
                    ", {times:.2} times {:.4} s of {}",
                    best.seconds, best.name
                )
                .unwrap();
                ran.ratio = is_done.then_some(times);
                let found = &answer.outcome.statistics[0];
                ran.z = deviation(found, best.found, answer.floors[0]);
            }
        }
        Ok(None) => panic!("nothing was chosen: {}", problem.text),
        Err(refusal @ (Error::TooLong { .. } | Error::InfiniteVariance { .. } | Error::Dark)) => {
            write!(text, "refused: {refusal}").unwrap();
            if let Some(best) = best {
                write!(text, ", {:.4} s of {}", best.seconds, best.name).unwrap();
            }
        }
        Err(other) => panic!("{other}: {}", problem.text),
    }
    if let Some(z) = ran.z {
        write!(ran.text, ", z {z:.2}").unwrap();
    }
    opened.settings = &without;
    if let Some((times, names)) = given(&opened, &resolved.targets, &reference.rungs) {
        write!(ran.text, "; {times:.2} times without an error, {names}").unwrap();
        ran.given = Some(times);
    }
    ran
}

/// Variance times seconds of given walks over that of the best of the ladder that takes no longer than these may, and the names of both. `None`: the
/// choice is refused, or the ladder has no such rung.
fn given(opened: &Opened<'_>, targets: &[Target], rungs: &[Rung]) -> Option<(f64, String)> {
    let plain = rungs.iter().find_map(|rung| rung.plain_seconds(GIVEN))?;
    let most = (6.0 * plain).max(1.0);
    let by: (&dyn SolveObserver, &dyn Execute) = (&(), &OnThreads);
    let solved = fredholm::choice::solve(opened.model, targets, &opened.goals, opened.settings, by);
    let (chosen, answer) = solved.ok()??;
    let own = seconds(&chosen, &answer) - chosen.report.predicted_pilot_seconds;
    let floors = answer.floors.iter();
    let deviations = answer.outcome.statistics.iter().zip(floors);
    let deviations: Vec<[f64; 2]> = deviations
        .map(|(of, floor)| {
            let found = of.preconditioned().std_dev.unwrap_or(0.0);
            let floor = floor * f64::sqrt(GIVEN as f64);
            [found.max(floor), floor]
        })
        .collect();
    let mut rungs: Vec<Rung> = rungs.to_vec();
    loop {
        rungs.retain(|rung| rung.is_within(GIVEN, most));
        let least = rungs.iter_mut().min_by(|a, b| {
            let [a, b] = [a, b].map(|rung| rung.variance_time(GIVEN, &deviations));
            a.total_cmp(&b)
        })?;
        if !least.is_told_by_few() {
            let names = format!("{} beside {}", setting(&chosen), least.name());
            return Some((own / least.variance_time(GIVEN, &deviations), names));
        }
        let again = opened.walk_again(least);
        *least = again?;
    }
}

/// The error that is asked for, or the least that the ladder reaches soon; whether that is larger.
fn feasible(problem: &Problem, rungs: &[Rung]) -> (Tolerance, bool) {
    let mut error = problem.error;
    loop {
        let tolerance = problem.tolerance(error);
        let soon = rungs
            .iter()
            .any(|rung| rung.seconds(tolerance) < problem.most_seconds);
        if soon || error >= MOST_ERROR {
            return (tolerance, error > problem.error);
        }
        error = (1.5 * error).min(MOST_ERROR);
    }
}

/// The rung that is the fastest by few walks, and its walks: the next one if it takes many times as many. `None` if none ends, or if rungs
/// that did not end took as long as the best may: the error is then a part of a u that few walks do not tell from 0.
fn best(
    rungs: &[Rung],
    problem: &Problem,
    opened: &Opened<'_>,
    tolerance: Tolerance,
) -> Option<Best> {
    let mut sorted: Vec<&Rung> = rungs.iter().collect();
    sorted.sort_by(|a, b| a.seconds(tolerance).total_cmp(&b.seconds(tolerance)));
    let first = sorted.first()?.seconds(tolerance);
    let soon = 2.0 * first.max(problem.most_seconds);
    let mut lost = 0.0;
    let mut soon = sorted.into_iter().take_while(|rung| {
        let is_due =
            first <= LONGEST && rung.seconds(tolerance) <= soon && lost <= problem.most_seconds;
        // What does not end has so many times the walks before it is given up.
        lost += ladder::MOST_TIMES * rung.seconds(tolerance);
        is_due
    });
    soon.find_map(|rung| {
        let walked = rung.run(opened, tolerance)?;
        let found = walked.first()?.preconditioned();
        let seconds = rung.seconds_of(&walked);
        Some(Best {
            name: rung.name(),
            seconds,
            found: [found.estimate, found.std_error?],
        })
    })
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
        "{cells} {} {} {:?}",
        cut.degree,
        walk.pairs.word(),
        walk.absorption
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
fn deviation(one: &Statistics, [estimate, error]: [f64; 2], floor: f64) -> Option<f64> {
    let one = one.preconditioned();
    let error = one.std_error?.hypot(error);
    let difference = ((one.estimate - estimate).abs() - 2.0 * floor).max(0.0);
    Some(difference / error)
}

/// The median and the largest.
fn median_and_most(all: impl Iterator<Item = Option<f64>>) -> [f64; 2] {
    let mut all: Vec<f64> = all.flatten().collect();
    all.sort_by(f64::total_cmp);
    let median = all.get(all.len() / 2).copied().unwrap_or(0.0);
    [median, all.last().copied().unwrap_or(0.0)]
}

/// The least number within 1.96 standard errors of as many as there are, if error bars are what they say: with fewer the chance
/// is below 1 in 2000, by the binomial distribution.
fn least_inside(count: usize) -> usize {
    let (mut term, mut sum) = (0.05_f64.powi(count as i32), 0.0);
    for inside in 0..count {
        sum += term;
        if sum >= 1.0 / 2000.0 {
            return inside;
        }
        term *= (count - inside) as f64 / (inside + 1) as f64 * 0.95 / 0.05;
    }
    count
}

fn summary(all: &[Ran]) {
    let done = all.iter().filter(|ran| ran.ratio.is_some()).count();
    let relaxed = all.iter().filter(|ran| ran.is_relaxed).count();
    let [median, most] = median_and_most(all.iter().map(|ran| ran.ratio));
    let deviations: Vec<f64> = all.iter().filter_map(|ran| ran.z).collect();
    let inside = deviations.iter().filter(|&&z| z <= 1.96).count();
    println!(
        "{done} of {} done, {relaxed} with a larger error than drawn; times over the best of the ladder: median \
         {median:.2}, most {most:.2}; {inside} of {} within 1.96",
        all.len(),
        deviations.len()
    );
    let [median, most_given] = median_and_most(all.iter().map(|ran| ran.given));
    println!("without an error: median {median:.2}, most {most_given:.2}");
    assert!(
        median < 1.5 && most_given < MOST_GIVEN,
        "{median} {most_given}"
    );
    assert!(most < MOST_TIMES, "{most}");
    assert!(inside >= least_inside(deviations.len()), "{inside}");
}
