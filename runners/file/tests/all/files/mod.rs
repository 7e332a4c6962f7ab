//! Good files, and every bad one.

mod channels;
mod cubes;
mod scenes;
mod shape;
mod solved;
mod systems;
mod text;
mod values;

use fredholm_file::kinds::{Circle, Emission, KernelText};
use fredholm_file::*;

/// A file with every key.
const FULL: &str = r#"# every key
[problem]
kind = "circle"
reflectance = [0.3, 0.7]
emission = { constant = 5, amplitude = 1.0, frequency = 5 }

[galerkin]
cells = 1_000
degree = 0
pairs = "paper"

[walk]
walks = 0x10
absorption = 0.25
estimator = "collision"
scalar = "f32"
seed = 9223372036854775807
batch = 10
target_error = 1e-4
relative = true

[[target]]
name = "a"
at = 0.3
[[target]]
name = "mean"
over = "all"
[[target]]
name = "half"
over = [0, 3.0]
[[target]]
name = "profile"
grid = 200
"#;

/// The smallest file, with what a test adds at the end of a section.
fn small(problem: &str, galerkin: &str, walk: &str, target: &str) -> String {
    format!(
        "[problem]\nkind = \"circle\"\n{problem}\n\
             [galerkin]\n{galerkin}\n[walk]\n{walk}\n[[target]]\n{target}\n"
    )
}

/// A good `[problem]` of two lines: with it, `[galerkin]` is line 5.
const PROBLEM: &str = "reflectance = [0.3, 0.7]\nemission = [1, 0, 2]";
/// A good `[[target]]`.
const TARGET: &str = "name = \"a\"\nat = 0";

fn circle(file: &ProblemFile) -> &Circle {
    let circle = file.problem.of::<Circle>();
    circle.unwrap_or_else(|| panic!("{:?}", file.problem))
}

fn good(text: &str) -> ProblemFile {
    let file = read("t.toml", text).and_then(|file| file.validate().map(|()| file));
    file.unwrap_or_else(|error| panic!("{error}"))
}

/// The error of reading or, failing that, of validating, or of the model. The marks « and » are no part of a text.
fn failure(text: &str) -> String {
    let text = text.replace(['«', '»'], "");
    let resolved = read("t.toml", &text).and_then(|file| {
        file.validate()?;
        file.resolve()
    });
    match resolved {
        Ok(_) => panic!("no error in:\n{text}"),
        Err(error) => error.to_string(),
    }
}

/// Demands an error at what stands between « and », with these words in the message.
fn fails(text: &str, words: &[&str]) {
    let (before, rest) = text.split_once('«').unwrap();
    let (marked, _) = rest.split_once('»').unwrap();
    let line = before.matches('\n').count() + 1;
    let own = before.rsplit('\n').next().unwrap_or_default();
    // An editor does not show a byte order mark.
    let column = own.trim_start_matches('\u{feff}').chars().count() + 1;
    // A value of several lines is marked to the end of its first, and control characters are not passed on.
    let marked = marked.lines().next().unwrap_or_default();
    let marked = marked.replace(char::is_control, "\u{fffd}");
    let error = failure(text);
    let place = format!("t.toml:{line}:{column}: ");
    assert!(error.starts_with(&place), "wanted {place} in\n{error}");
    let lines = error.lines().collect::<Vec<_>>();
    let [message, _, source, mark] = lines[..] else {
        panic!("not four lines:\n{error}");
    };
    if !source.contains('…') {
        let gutter = line.to_string().len() + 3;
        let found = mark.chars().position(|c| c == '^');
        assert_eq!(found, Some(gutter + column - 1), "{error}");
    }
    for word in words {
        assert!(message.contains(word), "wanted {word} in\n{error}");
    }
    let under = source.chars().zip(mark.chars()).collect::<Vec<_>>();
    let found = under.iter().filter(|(_, mark)| *mark == '^');
    assert_eq!(found.map(|(c, _)| c).collect::<String>(), marked, "{error}");
    // A tab of the source must be over a tab, else the mark is shifted.
    assert!(
        under
            .iter()
            .all(|(c, mark)| (*c == '\t') == (*mark == '\t'))
    );
}

fn values(numbers: &Placed<Vec<Placed<f64>>>) -> Vec<f64> {
    numbers.value.iter().map(|number| number.value).collect()
}
