//! Good files, and every bad one.

use fredholm::Choices;

use super::place::SHOWN;
use super::section::nearest;
use super::*;

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
    match &file.problem {
        Problem::Circle(circle) => circle,
        other => panic!("{other:?}"),
    }
}

fn good(text: &str) -> ProblemFile {
    let file = read("t.toml", text).and_then(|file| file.validate().map(|()| file));
    file.unwrap_or_else(|error| panic!("{error}"))
}

/// The error of reading or, failing that, of validating.
fn failure(text: &str) -> String {
    match read("t.toml", text).and_then(|file| file.validate()) {
        Ok(()) => panic!("no error in:\n{text}"),
        Err(error) => error.to_string(),
    }
}

/// Demands an error at this place, with this under the mark and these words
/// in the message.
fn fails(text: &str, line: usize, column: usize, marked: &str, words: &[&str]) {
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

#[test]
fn full_file() {
    let file = good(FULL);
    assert_eq!(values(&circle(&file).reflectance), [0.3, 0.7]);
    let Emission::Harmonic {
        constant,
        amplitude,
        frequency,
    } = &circle(&file).emission
    else {
        panic!("{:?}", circle(&file).emission);
    };
    assert_eq!((constant.value, amplitude.value), (5.0, 1.0));
    assert_eq!(frequency.value, 5);
    assert_eq!(file.galerkin.cells.map(|cells| cells.value), Some(1000));
    assert_eq!(file.galerkin.degree.value, 0);
    assert_eq!(file.galerkin.pairs.value, Pairs::Paper);
    assert_eq!(file.walk.walks.value, 16);
    assert_eq!(file.walk.absorption.value, 0.25);
    assert_eq!(file.walk.estimator.value, Estimator::Collision);
    assert_eq!(file.walk.scalar.value, Scalar::F32);
    assert_eq!(file.walk.seed.value, MAX_SEED);
    assert_eq!(file.walk.batch.value, 10);
    assert_eq!(file.walk.target_error.map(|error| error.value), Some(1e-4));
    assert!(file.walk.relative.value);
    let names = file.targets.iter().map(|target| target.name.value.as_str());
    assert_eq!(names.collect::<Vec<_>>(), ["a", "mean", "half", "profile"]);
    assert!(matches!(&file.targets[0].what, What::At(at) if values(at) == [0.3]));
    assert!(matches!(&file.targets[1].what, What::OverAll));
    assert!(matches!(
        &file.targets[2].what,
        What::Over(from, to) if from.value == 0.0 && to.value == 3.0
    ));
    assert!(matches!(&file.targets[3].what, What::Grid(n, None) if n.value == 200));
}

#[test]
fn places_are_those_of_the_values() {
    let file = good(FULL);
    let shows = |place: &Place| match place {
        Place::File(span) => &FULL[span.clone()],
        other => panic!("{other:?}"),
    };
    assert_eq!(shows(&circle(&file).reflectance.place), "[0.3, 0.7]");
    assert_eq!(shows(&circle(&file).reflectance.value[1].place), "0.7");
    assert_eq!(shows(&file.walk.walks.place), "0x10");
    assert_eq!(shows(&file.targets[3].name.place), "\"profile\"");
}

#[test]
fn defaults() {
    let text = "problem = { kind = 'circle', reflectance = 0, emission = 1 }\n\
                    target = [{ name = 'a', at = 1 }]";
    let file = good(text);
    assert_eq!(values(&circle(&file).reflectance), [0.0]);
    assert!(matches!(&circle(&file).emission, Emission::Arcs(arcs) if values(arcs) == [1.0]));
    assert_eq!(file.galerkin.cells, None);
    assert_eq!(file.galerkin.degree, Placed::default(0));
    assert_eq!(file.galerkin.pairs, Placed::default(Pairs::Default));
    assert_eq!(
        file.walk,
        Walk {
            walks: Placed::default(100_000),
            absorption: Placed::default(0.2),
            estimator: Placed::default(Estimator::Absorption),
            scalar: Placed::default(Scalar::F64),
            seed: Placed::default(1),
            batch: Placed::default(4096),
            target_error: None,
            relative: Placed::default(false),
            allow_infinite_variance: false,
        }
    );
    // A header without keys is as good as none.
    let file = good(&small(PROBLEM, "", "", TARGET));
    assert_eq!(file.walk.walks, Placed::default(100_000));
}

#[test]
fn words_of_the_file() {
    for (word, pairs) in ["paper", "default", "pointwise", "theory"]
        .iter()
        .zip(Pairs::ALL)
    {
        assert_eq!(pairs.value.word(), *word);
    }
    let text = small(PROBLEM, "pairs = 'pointwise'", "scalar = 'f64'", TARGET);
    assert_eq!(good(&text).galerkin.pairs.value, Pairs::Pointwise);
}

#[test]
fn unknown_keys() {
    let walk = |walk: &str| small(PROBLEM, "", walk, TARGET);
    let galerkin = |galerkin: &str| small(PROBLEM, galerkin, "", TARGET);
    let top = format!("{FULL}\n[wlak]\nwalks = 1\n");
    fails(&top, 35, 2, "wlak", &["top level", "did you mean `walk`?"]);
    let top = format!("[colour]\n{FULL}");
    let words = ["`colour`", "`problem`, `galerkin`, `walk` and `target`"];
    fails(&top, 1, 2, "colour", &words);
    let words = ["in `[walk]`", "did you mean `walks`?"];
    fails(&walk("wlaks = 1"), 8, 1, "wlaks", &words);
    let words = [
        "in `[galerkin]`",
        "known here: `cells`, `degree`, `pairs`, `points`, `grading` and `shadow_cuts`",
    ];
    fails(&galerkin("  mesh = 1"), 6, 3, "mesh", &words);
    // A typo is reported as such even where the right key is missing.
    let emission = "reflectance = 0\nemission = { constant = 1, amplitude = 1, freq = 2 }";
    let text = small(emission, "", "", TARGET);
    fails(
        &text,
        4,
        43,
        "freq",
        &["in `emission`", "did you mean `frequency`?"],
    );
    let emission = "reflectance = 0\n\
                        emission = { constant = 1, amplitude = 1, frequency = 2, phase = 0 }";
    let text = small(emission, "", "", TARGET);
    fails(
        &text,
        4,
        58,
        "phase",
        &["unknown key `phase` in `emission`"],
    );
    let text = small(&format!("{PROBLEM}\nrefl = 1"), "", "", TARGET);
    fails(&text, 5, 1, "refl", &["in `[problem]`", "`reflectance`?"]);
    let text = small(PROBLEM, "", "", "name = 'a'\nAt = 1");
    fails(
        &text,
        11,
        1,
        "At",
        &["in `[[target]]`", "did you mean `at`?"],
    );
    let text = small(PROBLEM, "", "", "name = 'a'\nat = 1\nweight = 1");
    fails(&text, 12, 1, "weight", &["both `at` and `weight`"]);
    // The first in the file, though the parser sorts by key.
    fails(&walk("zz = 1\naa = 1"), 8, 1, "zz", &["`zz`"]);
    // A key is shown as it can be typed.
    let key = r#""a\n\"b""#;
    fails(
        &walk(&format!("{key} = 1")),
        8,
        1,
        key,
        &[r#"key `a\n\"b` in"#],
    );
}

#[test]
fn missing_keys() {
    let problem = "[problem]\nkind = 'circle'\nreflectance = 0\n";
    fails("", 1, 1, "", &["`problem` is missing at the top level"]);
    fails(
        &format!("[[target]]\n{TARGET}"),
        1,
        1,
        "[",
        &["`problem` is missing"],
    );
    let text = "a = 1\n[problm]\n";
    fails(text, 2, 2, "problm", &["did you mean `problem`?"]);
    let text = "\n [problem]\nreflectance = 0\nemission = 0";
    fails(
        text,
        2,
        2,
        "[problem]",
        &["`kind` is missing in `[problem]`"],
    );
    fails(problem, 1, 1, "[problem]", &["`emission` is missing"]);
    let text = format!("{problem}emission = {{}}");
    fails(&text, 4, 12, "{}", &["`constant` is missing in `emission`"]);
    let text = format!("{problem}emission = 0\n[[target]]\nat = 0");
    fails(&text, 5, 1, "[[target]]", &["`name` is missing"]);
}

#[test]
fn kinds() {
    let text = |kind: &str| format!("[problem]\nkind = {kind}\nsides = 3\n");
    let words = ["`kind` must be \"circle\", \"cube\" or \"room\", found \"ball\""];
    fails(&text("'ball'"), 2, 8, "'ball'", &words);
    fails(
        &text("'circel'"),
        2,
        8,
        "'circel'",
        &["did you mean \"circle\"?"],
    );
    fails(
        &text("3"),
        2,
        8,
        "3",
        &["`kind` must be a string, found an integer"],
    );
}

#[test]
fn wrong_types() {
    let walk = |walk: &str| small(PROBLEM, "", walk, TARGET);
    let words = ["`walks` must be an integer, found a string"];
    fails(&walk("walks = '5'"), 8, 9, "'5'", &words);
    let words = ["an integer, found 1e5: write 100000"];
    fails(&walk("walks = 1e5"), 8, 9, "1e5", &words);
    fails(
        &walk("walks = 1.5"),
        8,
        9,
        "1.5",
        &["an integer, found 1.5"],
    );
    fails(&walk("walks = -1"), 8, 9, "-1", &["must not be negative"]);
    let huge = "9".repeat(60);
    fails(
        &walk(&format!("seed = {huge}")),
        8,
        8,
        &huge,
        &["too large"],
    );
    fails(
        &walk("relative = 1"),
        8,
        12,
        "1",
        &["must be true or false"],
    );
    fails(
        &walk("absorption = []"),
        8,
        14,
        "[]",
        &["a number, found an array"],
    );
    fails(
        &walk("absorption = 1e999"),
        8,
        14,
        "1e999",
        &["a finite number"],
    );
    let words = [
        "must be \"absorption\" or \"collision\"",
        "mean \"collision\"?",
    ];
    fails(&walk("estimator = 'colision'"), 8, 13, "'colision'", &words);
    fails(
        &walk("scalar = 32"),
        8,
        10,
        "32",
        &["\"f32\" or \"f64\", found an integer"],
    );
    let text = small(PROBLEM, "pairs = 'x'", "", TARGET);
    fails(
        &text,
        6,
        9,
        "'x'",
        &["\"paper\", \"default\", \"pointwise\" or \"theory\""],
    );
    fails("problem = 5", 1, 11, "5", &["`problem` must be a table"]);
    let one = small(PROBLEM, "", "", TARGET);
    let text = one.replace("[[target]]", "[target]");
    fails(&text, 9, 1, "[target]", &["write `[[target]]`"]);
    let text = one.replace("[walk]", "[[walk]]");
    fails(
        &text,
        7,
        1,
        "[[walk]]",
        &["`walk` must be a table, found an array"],
    );
    let problem = "reflectance = [0.1, '0.2']\nemission = 1";
    let words = ["`reflectance[1]` must be a number"];
    fails(&small(problem, "", "", TARGET), 3, 21, "'0.2'", &words);
    let problem = "reflectance = 0.1\nemission = true";
    let words = [
        "a number, an array of numbers, or a table",
        "found a boolean",
    ];
    fails(&small(problem, "", "", TARGET), 4, 12, "true", &words);
}

#[test]
fn reflectance_and_emission() {
    let text = |reflectance: &str, emission: &str| {
        let problem = format!("reflectance = {reflectance}\nemission = {emission}");
        small(&problem, "", "", TARGET)
    };
    for number in ["nan", "-inf", "+inf"] {
        let array = format!("[0, {number}]");
        let words = ["`reflectance[1]` must be a finite number"];
        fails(&text(&array, "1"), 3, 19, number, &words);
        let words = ["`emission` must be a finite number"];
        fails(&text("0", number), 4, 12, number, &words);
    }
    fails(
        &text("[]", "1"),
        3,
        15,
        "[]",
        &["`reflectance`", "at least one"],
    );
    fails(
        &text("0", "[]"),
        4,
        12,
        "[]",
        &["`emission`", "at least one"],
    );
    let words = [
        "at least 0 and less than 1",
        "series of reflections converge",
    ];
    fails(&text("[0.5, 1]", "1"), 3, 21, "1", &words);
    fails(&text("1.0", "1"), 3, 15, "1.0", &words);
    fails(&text("-0.1", "1"), 3, 15, "-0.1", &words);
    let harmonic = "{ constant = 1, amplitude = 1, frequency = 0 }";
    fails(
        &text("0", harmonic),
        4,
        55,
        "0",
        &["`frequency` must be at least 1"],
    );
}

#[test]
fn cells() {
    let text = |galerkin: &str| small(PROBLEM, galerkin, "", TARGET);
    good(&text("cells = 6"));
    let words = ["the 2 arcs of `reflectance` and of the 3 arcs of `emission`"];
    fails(&text("cells = 10"), 6, 9, "10", &words);
    fails(&text("cells = 10"), 6, 9, "10", &["nearest: 6 or 12"]);
    assert!(failure(&text("cells = 1")).contains("nearest: 6\n"));
    assert!(failure(&text("cells = 100000000")).contains("nearest: 99999996\n"));
    fails(&text("cells = 0"), 6, 9, "0", &["at least 1"]);
    fails(&text("cells = 100000001"), 6, 9, "100000001", &["memory"]);
    fails(
        &text("degree = 5"),
        6,
        10,
        "5",
        &["`degree` must be from 0 to 4 on a circle"],
    );
    let harmonic = FULL.replace("1_000", "7");
    let words = ["multiple of the 2 arcs of `reflectance`; nearest: 6 or 8"];
    fails(&harmonic, 8, 9, "7", &words);
    // Two coprime numbers of arcs leave no number of cells.
    let zeros = |n| vec!["0"; n].join(",");
    let problem = format!(
        "reflectance = [{}]\nemission = [{}]",
        zeros(10007),
        zeros(10009)
    );
    let error = failure(&small(&problem, "", "", TARGET));
    assert!(
        error.contains("100160063, is beyond the 100000000"),
        "{error}"
    );
}

#[test]
fn walk_ranges() {
    let text = |walk: &str| small(PROBLEM, "", walk, TARGET);
    fails(
        &text("absorption = 0"),
        8,
        14,
        "0",
        &["more than 0", "less than 1"],
    );
    fails(
        &text("absorption = 1"),
        8,
        14,
        "1",
        &["more than 0", "less than 1"],
    );
    fails(
        &text("walks = 0"),
        8,
        9,
        "0",
        &["`walks` must be at least 1"],
    );
    fails(&text("batch = 0"), 8, 9, "0", &["from 1 to 1000000000"]);
    fails(
        &text("batch = 1000000001"),
        8,
        9,
        "1000000001",
        &["from 1 to"],
    );
    fails(&text("target_error = 0.0"), 8, 16, "0.0", &["more than 0"]);
    fails(&text("target_error = -1"), 8, 16, "-1", &["more than 0"]);
    for value in ["true", "false"] {
        let words = ["does nothing without a `target_error`"];
        fails(&text(&format!("relative = {value}")), 8, 12, value, &words);
    }
    good(&text("relative = false\ntarget_error = 1"));
}

#[test]
fn targets() {
    let text = |target: &str| small(PROBLEM, "", "", target);
    let none = text("").replace("[[target]]\n", "");
    fails(&none, 10, 1, "", &["at least one `[[target]]`"]);
    let none = format!("target = []\n{none}");
    fails(&none, 1, 10, "[]", &["at least one `[[target]]`"]);
    let two = text("name = 'a'\nat = 1\n[[target]]\nname = \"a\"\nat = 2");
    let words = ["a second target named \"a\"; the first is on line 10"];
    fails(&two, 13, 8, "\"a\"", &words);
    fails(
        &text("name = ' '\nat = 1"),
        10,
        8,
        "' '",
        &["must not be empty"],
    );
    for angle in ["-0.1", "6.2832", "7"] {
        let target = format!("name = 'a'\nat = {angle}");
        fails(&text(&target), 11, 6, angle, &["less than 2 pi = 6.28318"]);
    }
    let words = ["target \"a\" has both `grid` and `at`"];
    fails(&text("name = 'a'\ngrid = 3\nat = 0"), 12, 1, "at", &words);
    let words = [
        "target \"a\" does not say what to compute",
        "`over = \"all\"`",
    ];
    fails(&text("name = 'a'"), 9, 1, "[[target]]", &words);
    fails(
        &text("name = 'a'\ngrid = 0"),
        11,
        8,
        "0",
        &["from 1 to 100000"],
    );
    fails(
        &text("name = 'a'\ngrid = 100001"),
        11,
        8,
        "100001",
        &["100000"],
    );
    let over = |over: &str| text(&format!("name = 'a'\nover = {over}"));
    good(&over("[0, 6.283185307179586]"));
    fails(&over("[0, 7]"), 11, 12, "7", &["from 0 to 2 pi"]);
    fails(&over("[-1, 2]"), 11, 9, "-1", &["from 0 to 2 pi"]);
    fails(&over("[2, 2]"), 11, 12, "2", &["more than the first"]);
    fails(&over("[2]"), 11, 8, "[2]", &["\"all\", two angles"]);
    fails(&over("'half'"), 11, 8, "'half'", &["or two angles"]);
}

#[test]
fn flags() {
    let mut file = good(&small(PROBLEM, "", "", TARGET));
    file.galerkin.cells = Some(Placed::flag("--cells", 7));
    let error = file.validate().unwrap_err().to_string();
    assert!(
        error.starts_with("`--cells 7`: the number of cells must be"),
        "{error}"
    );
    file.galerkin.cells = None;
    file.walk.absorption = Placed::flag("--absorption", f64::NAN);
    let error = file.validate().unwrap_err().to_string();
    assert!(
        error.starts_with("`--absorption NaN`: `absorption` must"),
        "{error}"
    );
    file.walk.absorption = Placed::flag("--absorption", 0.5);
    file.walk.seed = Placed::flag("--seed", u64::MAX);
    assert!(file.validate().is_err());
    file.walk.seed = Placed::flag("--seed", 0);
    assert_eq!(file.validate(), Ok(()));
    // A good flag hides a bad value of the file.
    let mut file = read("t.toml", &small(PROBLEM, "", "walks = 0", TARGET)).unwrap();
    file.walk.walks = Placed::flag("--walks", 1);
    assert_eq!(file.validate(), Ok(()));
    let error = file.error(&Place::Default, "nothing").to_string();
    assert_eq!(error, "t.toml: nothing");
}

#[test]
fn syntax_errors() {
    fails("[problem]\nkind = \n", 2, 8, "", &["not valid TOML: "]);
    fails("a = 1\na = 2", 2, 1, "a", &["duplicate key"]);
    fails("a = 1\n\nb = [1,", 3, 8, "", &["not valid TOML"]);
    fails("[walk\n", 1, 6, "", &["not valid TOML"]);
}

#[test]
fn whole_message() {
    let error = failure("[problem]\nkind = \"circle\"\n\trefletance = 0.5 # é\n");
    let wanted = "t.toml:3:2: unknown key `refletance` in `[problem]`; \
                      did you mean `reflectance`?\n  |\n3 | \trefletance = 0.5 # é\n  | \t^^^^^^^^^^";
    assert_eq!(error, wanted);
}

#[test]
fn line_ends_tabs_and_unicode() {
    let text = small(PROBLEM, "", "walks = 0", TARGET).replace('\n', "\r\n");
    fails(&text, 8, 9, "0", &["`walks`"]);
    assert!(!failure(&text).contains('\r'));
    let walk = "walks = 1\n\tbatch\t=\t0 # x";
    fails(&small(PROBLEM, "", walk, TARGET), 9, 10, "0", &["`batch`"]);
    let text = "problem = { \"é∑𝕏\" = 'ü', kind = 'öl' }";
    fails(text, 1, 33, "'öl'", &["found \"öl\""]);
    fails("\u{feff}a = 1", 1, 1, "a", &["`problem` is missing"]);
    fails(
        "\u{feff}problm = 1",
        1,
        1,
        "problm",
        &["did you mean `problem`?"],
    );
    // Control characters are not passed on.
    fails("a = '\u{1b}[31m'", 1, 6, "\u{fffd}", &["not valid TOML"]);
    // A value of several lines is marked to the end of its first.
    let text = small("reflectance = [\r\n]\nemission = 1", "", "", TARGET);
    fails(&text, 3, 15, "[", &["at least one"]);
}

#[test]
fn long_lines_are_cut() {
    for zeros in [0, 10, 60, 100, 1000] {
        for after in [0, 1, 50, 1000] {
            let array = format!("[{}nan{}]", "0,".repeat(zeros), ",0".repeat(after));
            let text = small(
                &format!("reflectance = {array}\nemission = 1"),
                "",
                "",
                TARGET,
            );
            fails(&text, 3, 16 + 2 * zeros, "nan", &["finite"]);
            assert!(
                failure(&text)
                    .lines()
                    .all(|line| line.chars().count() <= SHOWN + 6)
            );
        }
    }
}

#[test]
fn marks_stay_in_the_line() {
    let text = small(
        PROBLEM,
        "",
        &format!("scalar = '{}'", "x".repeat(300)),
        TARGET,
    );
    let error = failure(&text);
    let mark = error.lines().last().unwrap_or_default();
    assert_eq!(mark.chars().count(), "8 | ".len() + SHOWN, "{error}");
    // The place is between the two bytes of the line's end.
    fails("[problem]\r\nkind = \r\n", 2, 8, "", &["not valid TOML"]);
    let source = Source {
        name: String::new(),
        text: "aé\r\nb".to_owned(),
    };
    let before = [0, 1, 2, 3, 4, 5, 6].map(|byte| source.locate(byte).before);
    assert_eq!(before, [0, 1, 1, 2, 2, 0, 1]);
}

#[test]
fn no_input_panics() {
    let text = FULL.replace("mean", "größe\t").replace("\n\n", "\r\n\n");
    let whole = Source {
        name: "t.toml".to_owned(),
        text: text.clone(),
    };
    for (index, c) in text.char_indices() {
        let (head, tail) = text.split_at(index);
        let rest = &tail[c.len_utf8()..];
        let mut inputs = vec![head.to_owned(), format!("{head}{rest}")];
        for wrong in ['[', '}', '"', '=', '\r', '\n', '\0', 'ß', '\u{feff}'] {
            inputs.push(format!("{head}{wrong}{tail}"));
        }
        for input in inputs {
            if let Ok(file) = read("t.toml", &input) {
                let _ = file.validate();
            }
        }
    }
    // Places which no parser gives.
    for start in 0..text.len() + 3 {
        for end in [
            0,
            start.saturating_sub(1),
            start,
            start + 1,
            start + 40,
            usize::MAX,
        ] {
            let _ = whole.error(start..end, "");
        }
    }
}

#[test]
fn near_words() {
    let known = ["walks", "batch", "seed"];
    assert_eq!(nearest("Walk", &known), Some("walks"));
    assert_eq!(nearest("seeds", &known), Some("seed"));
    assert_eq!(nearest("temperature", &known), None);
}

/// A file of a cube: its `[problem]`, what else it has before targets, and a target.
fn cube(problem: &str, rest: &str, target: &str) -> String {
    format!("[problem]\nkind = \"cube\"\n{problem}\n{rest}\n[[target]]\nname = \"a\"\n{target}\n")
}

#[test]
fn a_cube_in_every_spelling() {
    let of = |text: &str| match good(text).problem {
        Problem::Cube(cube) => cube,
        other => panic!("{other:?}"),
    };
    let plain = of(&cube(
        "dimension = 1\nkernel = 'x * y1'\nsource = '1'",
        "",
        "at = 0.5",
    ));
    assert_eq!(plain.dimension.value, 1);
    assert!(matches!(plain.kernel, KernelText::General(text) if text.value == "x * y1"));
    assert!(plain.integral.is_none() && plain.solution.is_none());
    let full = "dimension = 2\nkernel_factors = ['abs(x - y)', 'x < y ? x : y']\n\
                kernel_integral = ['0.5 * (y - x) * abs(y - x)', 'x < y ? x * y : y^2 / 2']\n\
                source = 'x1 + x2'\nsolution = 'pi'";
    let rest = "[galerkin]\ncells = 3\npairs = 'pointwise'\npoints = 5";
    for target in ["at = [0, 1]", "over = 'all'", "weight = 'x1 * exp(-x2)'"] {
        let full = of(&cube(full, rest, target));
        assert!(matches!(full.kernel, KernelText::Factors(texts) if texts.value.len() == 2));
    }
}

#[test]
fn what_cubes_refuse() {
    let problem = "dimension = 2\nkernel = 'x1 * y2'\nsource = 'x1'";
    let all = "over = 'all'";
    let of = |problem: &str| cube(problem, "", all);
    // Line 3 is the dimension, 4 the kernel, 5 the source.
    fails(
        &of("dimension = 7\nkernel = '1'\nsource = '1'"),
        3,
        13,
        "7",
        &["from 1 to 6"],
    );
    let kernel = |text: &str| of(&format!("dimension = 2\nkernel = {text}\nsource = '1'"));
    fails(
        &kernel("'x1 * (y1 + z)'"),
        4,
        22,
        "z",
        &["unknown name `z`", "x1 to x2 and y1 to y2"],
    );
    fails(&kernel("'x1 * y3'"), 4, 16, "y3", &["unknown name `y3`"]);
    fails(&kernel("'x1 * + '"), 4, 18, "'", &["unexpected end"]);
    fails(
        &kernel("'1 + foo(x1)'"),
        4,
        15,
        "foo",
        &["unknown function `foo`", "sqrt"],
    );
    fails(&kernel("'x1 y1'"), 4, 14, "y1", &["unexpected"]);
    // Where the file spells it with escapes, the whole string is shown.
    let escaped = r#""x1 \u002B z""#;
    fails(&kernel(escaped), 4, 10, escaped, &["unknown name `z`"]);
    fails(&kernel("3"), 4, 10, "3", &["`kernel` must be a string"]);
    fails(
        &of("dimension = 2\nkernel = '1'\nsource = 'y1'"),
        5,
        11,
        "y1",
        &["coordinates here are x1 to x2"],
    );
    fails(
        &of("dimension = 2\nkernel = '1'\nkernel_factors = ['1', '1']\nsource = '1'"),
        5,
        1,
        "kernel_factors",
        &["one of `kernel` and `kernel_factors`"],
    );
    fails(
        &of("dimension = 2\nsource = '1'"),
        1,
        1,
        "[problem]",
        &["`kernel`", "missing"],
    );
    fails(
        &of("dimension = 2\nkernel_factors = ['x * y']\nsource = '1'"),
        4,
        18,
        "['x * y']",
        &["2 formulas", "not 1"],
    );
    fails(
        &of("dimension = 2\nkernel_factors = ['x * y', 'x2']\nsource = '1'"),
        4,
        29,
        "x2",
        &["unknown name `x2`", "x and y"],
    );
    fails(
        &of(&format!("{problem}\nkernel_integral = 'x1'")),
        6,
        19,
        "'x1'",
        &["`kernel_factors`"],
    );
    fails(
        &of("dimension = 1\nkernel = '1'\nkernel_integral = ['y']\nsource = '1'"),
        5,
        19,
        "['y']",
        &["must be one formula"],
    );
    fails(
        &cube(problem, "[galerkin]\npairs = 'pointwise'", all),
        7,
        9,
        "'pointwise'",
        &["`kernel_integral`"],
    );
    fails(
        &cube(problem, "[galerkin]\npoints = 6", all),
        7,
        10,
        "6",
        &["from 1 to 5"],
    );
    let target = |what: &str| cube(problem, "", what);
    fails(&target("at = 0.5"), 9, 6, "0.5", &["2 coordinates"]);
    fails(&target("at = [0.5, 1.5]"), 9, 12, "1.5", &["from 0 to 1"]);
    fails(&target("over = [0, 1]"), 9, 9, "0", &["weight"]);
    fails(&target("grid = 3"), 9, 8, "3", &["dimension = 1"]);
    fails(&target("weight = 'x'"), 9, 11, "x", &["unknown name `x`"]);
    // And what circles do not have.
    let text = small(PROBLEM, "points = 2", "", TARGET);
    fails(&text, 6, 10, "2", &["`points` belongs to cubes"]);
    let text = small(PROBLEM, "", "", "name = 'a'\nweight = 'x'");
    fails(&text, 11, 10, "'x'", &["`weight` belongs to cubes"]);
    let text = small(PROBLEM, "", "", "name = 'a'\nat = [1, 2]");
    fails(&text, 11, 6, "[1, 2]", &["one angle"]);
}
