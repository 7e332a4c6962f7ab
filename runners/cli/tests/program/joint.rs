//! One set of walks for all targets where nothing is said of it.

use core::fmt::Write;

use crate::common;

use common::{Folder, is_long, list, number};
use serde_json::Value;

/// u = 1 + x², with F = u − ∫ ½xy u dy.
const LINE: &str = "[problem]\nkind = 'cube'\ndimension = 1\nkernel = '0.5 * x * y'\nsource = '1 + x^2 - 3/8 * x'\n\
    solution = '1 + x^2'\n[walk]\nmethod = 'walks'\ntarget_error = 1e-5\n[[target]]\nname = 'u'\ngrid = 20\n";

#[test]
fn many_targets_share_walks_where_that_is_faster() {
    let folder = Folder::new();
    let source = "1 + x^2 - 0.5 * exp(-x)";
    let file = LINE
        .replace("0.5 * x * y", "0.5 * exp(-(x - y)^2)")
        .replace("solution = '1 + x^2'\n", "");
    let file = file.replace("1 + x^2 - 3/8 * x", source);
    let shared = folder.solve(&file, &["--json"]).quietly(0).json();
    let alone = folder
        .solve(&file, &["--json", "--no-global"])
        .quietly(0)
        .json();
    assert_eq!(shared["split"]["method"], "global estimate", "{shared}");
    assert_eq!(alone["split"]["method"], "preconditioned");
    assert!(alone["whole"].is_null() && alone["split"]["predicted_whole_seconds"].is_null());
    assert!(number(&shared["whole"], "largest_std_error") > 0.0);
    let fields = |of: &Value| of.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    let has_all = |one: &Value, other: &Value| {
        for field in fields(other) {
            assert!(one.get(&field).is_some(), "{field}");
        }
    };
    has_all(&shared, &alone);
    for (a, b) in list(&shared, "targets").iter().zip(list(&alone, "targets")) {
        has_all(a, b);
        let [a, b] = [a, b].map(|target| &target["preconditioned"]);
        let error = number(a, "std_error");
        assert!(error <= 1e-5);
        // Two estimates of twenty values, which share walks: not one of a thousand choices of seeds is beyond.
        let off = (number(a, "estimate") - number(b, "estimate")).abs();
        assert!(off < 5.0 * error.hypot(number(b, "std_error")), "{a} {b}");
    }
    let file_says = |word: &str| file.replace("[walk]\n", &format!("[walk]\nglobal = {word}\n"));
    let says_no = folder
        .solve(&file_says("false"), &["--json"])
        .quietly(0)
        .json();
    assert_eq!(says_no["targets"], alone["targets"]);
    let one = file.replace("grid = 20", "at = 0.3");
    let one = folder.solve(&one, &["--json"]).quietly(0).json();
    assert_eq!(one["split"]["method"], "preconditioned");
    let threads = folder
        .solve(&file, &["--json", "--threads", "1"])
        .quietly(0)
        .json();
    assert_eq!(threads["targets"], shared["targets"]);
    // What the command line asks for, the file asks for, too.
    let given = file.replace("[walk]\n", "[galerkin]\ncells = 4\n[walk]\nwalks = 2000\n");
    let given = given.replace("target_error = 1e-5\n", "");
    let flag = folder
        .solve(&given, &["--global", "--json"])
        .quietly(0)
        .json();
    let asked = given.replace("[walk]\n", "[walk]\nglobal = true\n");
    let asked = folder.solve(&asked, &["--json"]).quietly(0).json();
    assert_eq!(asked["targets"], flag["targets"]);
    assert!(flag.get("truncation").is_some());
}

/// A polynomial solution: all walks of the global estimate agree to rounding, and v is exact.
#[test]
fn a_difference_that_is_none_is_no_error() {
    let folder = Folder::new();
    let json = folder.solve(LINE, &["--json"]).quietly(0).json();
    for target in list(&json, "targets") {
        let exact = number(target, "exact");
        let found = number(&target["preconditioned"], "estimate");
        assert!((found - exact).abs() < 1e-4, "{target}");
    }
}

/// Numbers that a seed gives.
struct Draws(u64);

impl Draws {
    fn unit(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn of<'a>(&mut self, all: &[&'a str]) -> &'a str {
        all[(self.unit() * all.len() as f64) as usize]
    }
}

/// A random problem with several targets.
fn random(number: u64) -> String {
    let mut draws = Draws(number.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5f37);
    for _ in 0..4 {
        draws.unit();
    }
    let error = 10_f64.powf(-2.0 - 4.0 * draws.unit());
    let points = (2.0 * 50_f64.powf(draws.unit())) as usize;
    let strength = 0.3 + 0.5 * draws.unit();
    let problem = match (draws.unit() * 4.0) as usize {
        0 => format!(
            "kind = 'circle'\nreflectance = [0.3, {strength:.3}]\nemission = {{ constant = 5.0, amplitude = 1.0, frequency = 3 }}\n"
        ),
        1 => format!(
            "kind = 'cube'\ndimension = 1\nkernel = '{strength:.3} * {}'\nsource = '{}'\n",
            draws.of(&[
                "exp(-(x - y)^2)",
                "exp(-3 * abs(x - y))",
                "cos(4 * x * y)",
                "1 / (1 + 9 * (x - y)^2)"
            ]),
            draws.of(&["1 + x", "sin(9 * x)", "sqrt(x)", "exp(x)"])
        ),
        2 => format!(
            "kind = 'cube'\ndimension = 2\nkernel = '{strength:.3} * {}'\nsource = '{}'\n",
            draws.of(&[
                "exp(-(x1 - y1)^2 - (x2 - y2)^2)",
                "cos(x1 * y2)",
                "exp(-abs(x1 - y1))"
            ]),
            draws.of(&["1 + x1", "sin(5 * x1 * x2)", "exp(-x2)"])
        ),
        _ => format!(
            "kind = 'room'\n[[problem.surface]]\nname = 'lamp'\npoints = [[0, 2], [0, 0]]\nreflectance = 0.4\nemission = 1\n\
             [[problem.surface]]\nname = 'rest'\npoints = [[0, 0], [{:.2}, 0], [3, 2], [0, 2]]\nreflectance = {strength:.3}\n\
             emission = 0\n",
            2.0 + 2.0 * draws.unit()
        ),
    };
    let target = match problem.split('\'').nth(1) {
        Some("room") => format!("surface = 'rest'\ngrid = {points}"),
        _ if problem.contains("dimension = 2") => {
            let side = (points as f64).sqrt().ceil() as usize;
            format!("grid = [{side}, {side}]")
        }
        _ => format!("grid = {points}"),
    };
    let mut file = format!(
        "[problem]\n{problem}[walk]\nmethod = 'walks'\ntarget_error = {error:e}\n[[target]]\nname = 'u'\n{target}\n"
    );
    let _ = write!(file, "[[target]]\nname = 'mean'\nover = 'all'\n");
    file
}

/// Where one set of walks takes less than separate walks, it does so with its pilots; and these take half as long again as an answer of
/// seconds at most, and a second more for a shorter one: they took 12 seconds for one of a second.
#[test]
fn pilots_of_separate_walks_end_where_one_set_is_better() {
    let folder = Folder::new();
    let errors = ["1e-6", "1e-8"];
    for error in &errors[..if is_long() { 2 } else { 1 }] {
        let file = format!(
            "[problem]\nkind = 'cube'\ndimension = 1\ndomain = [[-1, 1]]\nkernel = '0.4 * exp(-abs(x - y))'\n\
             source = '1 + x'\n[walk]\nmethod = 'walks'\ntarget_error = {error}\n[[target]]\nname = 'u'\ngrid = 41\n"
        );
        let split = folder.solve(&file, &["--json"]).quietly(0).json()["split"].clone();
        assert_eq!(split["method"], "global estimate", "{split}");
        let of = |field| number(&split, field);
        let (walks, pilots) = (of("predicted_walk_seconds"), of("predicted_pilot_seconds"));
        assert!(pilots + walks < of("predicted_separate_seconds"), "{split}");
        assert!(pilots < 1.0 + 1.5 * walks, "{split}");
        assert!(walks < 1.0 || pilots < 1.5 * walks, "{split}");
    }
}

/// Problems with an even number were looked at while the decision was made. Times are measured on one thread and printed: of the
/// choice, with separate walks, and without a sequence; the values of all agree.
#[test]
fn a_random_family_takes_no_longer_together() {
    let seconds = |json: &Value| {
        let split = &json["split"];
        number(split, "pilot_seconds")
            + number(json, "setup_seconds")
            + number(json, "walk_seconds")
    };
    let (first, count) = if is_long() { (0, 100) } else { (1, 2) };
    let (mut beyond, mut compared) = (0, 0);
    for problem in first..count {
        let folder = Folder::new();
        let file = random(problem);
        let solve = |flags: &[&str]| {
            let all: Vec<&str> = [&["--json", "--threads", "1"], flags].concat();
            let ran = folder.solve(&file, &all);
            (ran.status == Some(0)).then(|| ran.json())
        };
        let all = [
            solve(&[]),
            solve(&["--no-global"]),
            solve(&["--sequence", "random"]),
        ];
        let [Some(open), Some(alone), Some(without)] = all else {
            println!("{problem:>3}: ended with a reason");
            continue;
        };
        let split = &open["split"];
        let predicted = |name: &str| split[name].as_f64().unwrap_or(f64::NAN);
        println!(
            "{problem:>3} {:<15} {:>3} targets{}{}: {:>8.3} s, separate {:>8.3} s, plain draws {:>8.3} s; predicted {:>8.3} and \
             {:>8.3} s",
            split["method"].as_str().unwrap(),
            list(&open, "targets").len(),
            open["sequence"].as_str().map_or("", |_| ", sobol"),
            open["lift"].as_u64().map_or("", |_| ", lifted"),
            seconds(&open),
            seconds(&alone),
            seconds(&without),
            predicted("predicted_whole_seconds"),
            predicted("predicted_separate_seconds"),
        );
        let pairs = |other| list(&open, "targets").iter().zip(list(other, "targets"));
        for (a, b) in pairs(&alone).chain(pairs(&without)) {
            let [a, b] = [a, b].map(|target| &target["preconditioned"]);
            let bar = number(a, "std_error").hypot(number(b, "std_error"));
            compared += 1;
            beyond += u32::from(
                (number(a, "estimate") - number(b, "estimate")).abs() > 4.0 * bar + 1e-12,
            );
        }
    }
    // Values of one problem share walks, so that a few may be beyond together.
    assert!(
        compared > 0 && f64::from(beyond) <= 0.01 * f64::from(compared) + 1.0,
        "{beyond} of {compared}"
    );
}
