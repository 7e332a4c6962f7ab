//! Random problems with an error and nothing else: every run ends, with an answer or with a reason, and takes little more
//! than the best of a ladder of fixed settings.
//!
//! A day's share of each half is run by default, all of them with `FREDHOLM_LONG=1`, so many with `FREDHOLM_LONG=40`;
//! then the time is compared with the ladder's, for which the machine should be idle.

#[path = "program/common/mod.rs"]
mod common;

use core::fmt::Write as _;

use common::{Folder, Ran, list, number};
use serde_json::Value;

/// Problems that were looked at when the choice was made, and others.
const SEEN: u64 = 1;
const UNSEEN: u64 = 2;

/// The problems of a half in a day's share, and in all.
const FEW: usize = 10;
const ALL: usize = 250;

/// The standard deviation of what few walks of a ladder tell is off by less than this.
const LADDER_WALKS: &str = "16384";
/// Seconds below which a ratio of times says nothing.
const SHORT: f64 = 0.5;

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
    let (mut table, mut ratios) = (String::new(), Vec::new());
    for number in 0..count {
        let problem = Problem::new(&mut random, long.is_some());
        let ran = problem.solve(&[]);
        let outcome = outcome(&ran);
        write!(table, "{seed}.{number} {} {outcome}", problem.name).unwrap();
        if long.is_some() {
            let best = problem.best_of_ladder();
            if let (Some(report), Some(best)) = (report(&ran), &best) {
                let ratio = seconds(&report) / best.seconds;
                write!(
                    table,
                    ": {:.3} s, {}, {ratio:.2} times {:.3} s of {}",
                    seconds(&report),
                    chosen(&report),
                    best.seconds,
                    best.setting
                )
                .unwrap();
                if ran.status == Some(0) && best.seconds > SHORT {
                    ratios.push(ratio);
                }
                best.agrees_with(&report, &problem);
            } else if let Some(best) = best {
                write!(table, ", {:.1} s of {}", best.seconds, best.setting).unwrap();
            }
        }
        table.push('\n');
    }
    ratios.sort_by(f64::total_cmp);
    println!("{table}{ratios:.2?}");
}

/// In a word how it ended: with an answer, or with a reason.
fn outcome(ran: &Ran) -> &'static str {
    let said = |word: &str| ran.stderr.contains(word);
    match ran.status {
        Some(0) => "answered",
        Some(2) if said("not begun unasked") => "too long",
        Some(2) if said("the variance of a walk is infinite") => "infinite",
        Some(3) if said("the asked error was not reached: ") => "given up",
        _ => panic!("{ran:?}"),
    }
}

fn report(ran: &Ran) -> Option<Value> {
    (ran.status != Some(2)).then(|| ran.json())
}

/// Seconds of the whole choice, the set-up and the walks.
fn seconds(report: &Value) -> f64 {
    let split = report.get("split");
    let choice = split.map_or(0.0, |split| number(split, "pilot_seconds"));
    choice + number(report, "setup_seconds") + number(report, "walk_seconds")
}

fn chosen(report: &Value) -> String {
    let of = |key: &str| report[key].to_string().replace('"', "");
    let keys = ["cells", "degree", "pairs", "absorption", "estimator"];
    keys.map(of).join(" ")
}

/// Numbers that look random: splitmix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn of<T: Copy>(&mut self, all: &[T]) -> T {
        all[(self.next() % all.len() as u64) as usize]
    }
}

struct Problem {
    name: String,
    /// The file without an error, an absorption or cells.
    text: String,
    error: f64,
    relative: bool,
    /// Cells of the ladder.
    cells: &'static [&'static str],
}

impl Problem {
    fn new(random: &mut Random, long: bool) -> Self {
        let least = if long { -10.0 } else { -6.0 };
        let error = 10_f64.powf(random.between(least, -2.0));
        let relative = random.next().is_multiple_of(2);
        let (name, text, cells) = match random.next() % 5 {
            0 => circle(random),
            1 => room(random),
            _ => cube(random),
        };
        let kind = if relative { "relative" } else { "absolute" };
        Self {
            name: format!("{name}, {error:.1e} {kind}"),
            text,
            error,
            relative,
            cells,
        }
    }

    fn solve(&self, args: &[&str]) -> Ran {
        let error = self.error.to_string();
        let mut all = vec!["--target-error", &error, "--threads", "1", "--json"];
        all.extend(self.relative.then_some("--relative"));
        all.extend(args);
        Folder::new().solve(&self.text, &all)
    }

    /// What takes least of some cells, degrees and absorptions, and of plain walks.
    fn best_of_ladder(&self) -> Option<Rung> {
        let mut best: Option<Rung> = None;
        for absorption in ["0.5", "0.2", "0.05", "0.01"] {
            let text = format!("{}walk.absorption = {absorption}\n", self.text);
            for cells in self.cells {
                for degree in ["0", "2", "4"] {
                    let setting = ["--cells", cells, "--degree", degree];
                    let walks = ["--walks", LADDER_WALKS, "--threads", "1", "--json"];
                    let ran = Folder::new().solve(&text, &[&setting[..], &walks].concat());
                    if ran.status != Some(0) {
                        continue;
                    }
                    for of in ["preconditioned", "plain"] {
                        let rung = Rung::new(self, &ran.json(), of);
                        if best.as_ref().is_none_or(|best| rung.seconds < best.seconds) {
                            best = Some(rung);
                        }
                    }
                }
            }
            // Longer walks are for what has no finite variance with shorter ones.
            if best.is_some() && absorption != "0.5" {
                break;
            }
        }
        best
    }
}

/// What a fixed setting takes to the error, as few walks tell.
struct Rung {
    setting: String,
    seconds: f64,
    estimate: f64,
    std_error: f64,
}

impl Rung {
    fn new(problem: &Problem, report: &Value, of: &str) -> Self {
        let found = &list(report, "targets")[0];
        let walks = number(found, "walks");
        let found = &found[of];
        let estimate = number(found, "estimate");
        let size = if problem.relative {
            estimate.abs()
        } else {
            1.0
        };
        let needed = (number(found, "std_dev") / (size * problem.error)).powi(2);
        // No error is believed before 16 batches.
        let share = needed.max(65_536.0) / walks;
        let set_up = if of == "plain" {
            0.0
        } else {
            number(report, "setup_seconds")
        };
        Self {
            setting: format!("{} {of}", chosen(report)),
            seconds: set_up + share * number(report, "walk_seconds"),
            estimate,
            std_error: number(found, "std_dev") / walks.sqrt(),
        }
    }

    /// Both estimates are of the same number: 6 standard errors, and what few walks may have missed.
    fn agrees_with(&self, report: &Value, problem: &Problem) {
        let found = &list(report, "targets")[0]["preconditioned"];
        let Some(error) = found["std_error"].as_f64() else {
            return;
        };
        let difference = (number(found, "estimate") - self.estimate).abs();
        let rounding = 1e-9 * self.estimate.abs();
        assert!(
            difference <= 6.0 * (error.hypot(self.std_error)) + rounding,
            "{}: {difference}, {error}, {}\n{}",
            problem.name,
            self.std_error,
            problem.text
        );
    }
}

type Drawn = (String, String, &'static [&'static str]);

/// A kernel of one axis with a parameter.
type Axis = (&'static str, fn(f64, f64, f64) -> f64);

const AXES: [Axis; 5] = [
    ("exp(-A*(X-Y)^2)", |a, x, y| (-a * (x - y).powi(2)).exp()),
    ("1/(1+A*(X-Y)^2)", |a, x, y| {
        1.0 / (1.0 + a * (x - y).powi(2))
    }),
    ("cos(A*(X-Y))", |a, x, y| (a * (x - y)).cos()),
    ("exp(A*X*Y)", |a, x, y| (a * x * y).exp()),
    ("(1+A*X)/(1+Y)", |a, x, y| (1.0 + a * x) / (1.0 + y)),
];
const SOURCES: [&str; 6] = [
    "1",
    "1+x1",
    "x1-0.4",
    "cos(7*x1)",
    "x1 < 0.37 ? 1 : 0",
    "sqrt(abs(x1-0.3))",
];

/// The spectral radius of the square of a kernel of one axis, by the powers of a matrix of its midpoints.
fn radius_of_square(kernel: impl Fn(f64, f64) -> f64) -> f64 {
    const N: usize = 80;
    let at = |i: usize| (i as f64 + 0.5) / N as f64;
    let mut v = vec![1.0; N];
    let mut largest = 0.0;
    for _ in 0..60 {
        let row = |i| {
            (0..N)
                .map(|j| kernel(at(i), at(j)).powi(2) * v[j])
                .sum::<f64>()
                / N as f64
        };
        let w: Vec<f64> = (0..N).map(row).collect();
        largest = w.iter().copied().fold(0.0, f64::max);
        v = w.iter().map(|w| w / largest).collect();
    }
    largest
}

fn cube(random: &mut Random) -> Drawn {
    let dimension = random.of(&[1_usize, 1, 1, 2, 2, 3]);
    let (axis, kernel) = random.of(&AXES);
    let parameter = 2_f64.powf(random.between(-1.0, 4.0));
    let parameter = if axis.contains("exp(A") {
        1.0
    } else {
        parameter
    };
    let share = random.between(0.33, 0.99);
    let radius = radius_of_square(|x, y| kernel(parameter, x, y)).powi(dimension as i32);
    let constant = share / radius.sqrt();
    let factor = |i: usize| {
        let axis = axis.replace('A', &parameter.to_string());
        axis.replace('X', &format!("x{i}"))
            .replace('Y', &format!("y{i}"))
    };
    let factors: Vec<String> = (1..=dimension)
        .map(|i| format!("({})", factor(i)))
        .collect();
    let mut source = random.of(&SOURCES).to_owned();
    let mut formula = format!("{constant}*{}", factors.join("*"));
    if dimension == 1 {
        source = source.replace("x1", "x");
        formula = formula.replace("x1", "x").replace("y1", "y");
    }
    let at = vec![format!("{:.3}", random.between(0.0, 1.0)); dimension].join(", ");
    let target = random.of(&["over = \"all\"", ""]);
    let target = match (target, dimension) {
        ("", 1) => format!("at = {at}"),
        ("", _) => format!("at = [{at}]"),
        (target, _) => target.to_owned(),
    };
    let text = format!(
        "problem = {{ kind = \"cube\", dimension = {dimension}, kernel = \"{formula}\", source = \"{source}\" }}\n\
         target = [{{ name = \"t\", {target} }}]\n"
    );
    let cells: &[&str] = match dimension {
        1 => &["4", "12", "48"],
        2 => &["2", "4", "8"],
        _ => &["1", "2", "3"],
    };
    let name = format!("d = {dimension}, {axis} with {parameter:.2}, {share:.2}, {source}");
    (name, text, cells)
}

fn circle(random: &mut Random) -> Drawn {
    let arcs = random.of(&[2, 5, 12]);
    let most = random.between(0.3, 0.99);
    let mut arc = || format!("{:.4}", random.between(0.0, most));
    let mut reflectance: Vec<String> = (1..arcs).map(|_| arc()).collect();
    reflectance.push(format!("{most:.4}"));
    let amplitude = random.of(&["0.0", "1.0", "4.9"]);
    let frequency = random.of(&["1", "5"]);
    let text = format!(
        "problem = {{ kind = \"circle\", reflectance = [{}], emission = {{ constant = 5.0, amplitude = {amplitude}, \
         frequency = {frequency} }} }}\ntarget = [{{ name = \"t\", at = {:.3} }}]\n",
        reflectance.join(", "),
        random.between(0.0, core::f64::consts::TAU),
    );
    let name = format!("circle, {arcs} arcs up to {most:.2}, amplitude {amplitude}");
    (name, text, &["60", "120", "480"])
}

fn room(random: &mut Random) -> Drawn {
    let most = random.between(0.3, 0.99);
    let (width, height) = (random.between(1.0, 4.0), random.between(1.0, 4.0));
    let notch = random.next().is_multiple_of(2);
    let (w, h) = (0.5 * width, 0.6 * height);
    let mut corners = vec![[0.0, 0.0], [width, 0.0], [width, height]];
    if notch {
        corners.extend([[w, height], [w, h], [0.0, h]]);
    } else {
        corners.push([0.0, height]);
    }
    let lamp = random.next() as usize % corners.len();
    let mut surfaces = Vec::new();
    for (i, [x, y]) in corners.iter().enumerate() {
        let [to_x, to_y] = corners[(i + 1) % corners.len()];
        let reflectance = if i == 0 {
            most
        } else {
            random.between(0.0, most)
        };
        let emission = if i == lamp { ", emission = 1" } else { "" };
        surfaces.push(format!(
            "{{ name = \"s{i}\", points = [[{x:.4}, {y:.4}], [{to_x:.4}, {to_y:.4}]], reflectance = {reflectance:.4}{emission} }}"
        ));
    }
    let target = random.of(&["at = { surface = \"s0\", t = 0.37 }", "over = \"all\""]);
    let text = format!(
        "problem.kind = \"room\"\nproblem.surface = [{}]\ntarget = [{{ name = \"t\", {target} }}]\n",
        surfaces.join(", ")
    );
    let name = format!("room of {} walls up to {most:.2}", corners.len());
    (name, text, &["25", "100", "200"])
}
