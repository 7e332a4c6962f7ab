//! The shape of a file: keys, types, words, defaults.

use fredholm::{Choices, Settings};

use super::*;

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
    assert_eq!(file.walk.absorption.map(|q| q.value), Some(0.25));
    assert_eq!(file.walk.estimator.value, Estimator::Collision);
    assert_eq!(file.walk.scalar.value, Scalar::F32);
    assert_eq!(file.walk.seed.value, i64::MAX.unsigned_abs());
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

/// A value that the file does not give.
fn unsaid<T>(value: T) -> Placed<T> {
    let place = Place::Default;
    Placed { value, place }
}

#[test]
fn defaults() {
    let text = "problem = { kind = 'circle', reflectance = 0, emission = 1 }\n\
                    target = [{ name = 'a', at = 1 }]";
    let file = good(text);
    assert_eq!(values(&circle(&file).reflectance), [0.0]);
    assert!(matches!(&circle(&file).emission, Emission::Arcs(arcs) if values(arcs) == [1.0]));
    assert_eq!(file.galerkin.cells, None);
    assert_eq!(file.galerkin.degree, unsaid(0));
    assert_eq!(file.galerkin.pairs, unsaid(Pairs::Default));
    assert_eq!(
        file.walk,
        Walk {
            method: None,
            walks: unsaid(100_000),
            absorption: None,
            estimator: unsaid(Estimator::Collision),
            form: unsaid(Settings::FORM),
            sequence: unsaid(Sequence::Random),
            forced_steps: unsaid(0),
            last_step: None,
            adjoint: None,
            sensitivities: unsaid(false),
            scalar: unsaid(Scalar::F64),
            seed: unsaid(1),
            batch: unsaid(4096),
            target_error: None,
            relative: unsaid(false),
            global: None,
            allow_infinite_variance: false,
        }
    );
    // A header without keys is as good as none.
    let file = good(&small(PROBLEM, "", "", TARGET));
    assert_eq!(file.walk.walks, unsaid(100_000));
}

#[test]
fn words_of_the_file() {
    for (word, pairs) in ["paper", "default", "pointwise", "rays"]
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
    let top = format!("{FULL}\n[«wlak»]\nwalks = 1\n");
    fails(&top, &["top level", "did you mean `walk`?"]);
    let top = format!("[«colour»]\n{FULL}");
    let words = [
        "`colour`",
        "`problem`, `galerkin`, `walk`, `target`, `output`, `uncertainties` and `fit`",
    ];
    fails(&top, &words);
    let words = ["in `[walk]`", "did you mean `walks`?"];
    fails(&walk("«wlaks» = 1"), &words);
    let words = [
        "in `[galerkin]`",
        "known here: `cells`, `degree`, `pairs`, `lift`, `points`, `grading` and `shadow_cuts`",
    ];
    fails(&galerkin("  «mesh» = 1"), &words);
    // A typo is reported as such even where the right key is missing.
    let emission = "reflectance = 0\nemission = { constant = 1, amplitude = 1, «freq» = 2 }";
    let text = small(emission, "", "", TARGET);
    fails(&text, &["in `emission`", "did you mean `frequency`?"]);
    let emission = "reflectance = 0\n\
                        emission = { constant = 1, amplitude = 1, frequency = 2, «phase» = 0 }";
    let text = small(emission, "", "", TARGET);
    fails(&text, &["unknown key `phase` in `emission`"]);
    let text = small(&format!("{PROBLEM}\n«refl» = 1"), "", "", TARGET);
    fails(&text, &["in `[problem]`", "`reflectance`?"]);
    let text = small(PROBLEM, "", "", "name = 'a'\n«At» = 1");
    fails(&text, &["in `[[target]]`", "did you mean `at`?"]);
    let text = small(PROBLEM, "", "", "name = 'a'\nat = 1\n«weight» = 1");
    fails(&text, &["both `at` and `weight`"]);
    // The first in the file, though the parser sorts by key.
    fails(&walk("«zz» = 1\naa = 1"), &["`zz`"]);
    // A key is shown as it can be typed.
    fails(&walk(r#"«"a\n\"b"» = 1"#), &[r#"key `a\n\"b` in"#]);
}

#[test]
fn missing_keys() {
    let problem = "[problem]\nkind = 'circle'\nreflectance = 0\n";
    fails("«»", &["`problem` is missing at the top level"]);
    let text = format!("«[»[target]]\n{TARGET}");
    fails(&text, &["`problem` is missing"]);
    fails("a = 1\n[«problm»]\n", &["did you mean `problem`?"]);
    let text = "\n «[problem]»\nreflectance = 0\nemission = 0";
    fails(text, &["`kind` is missing in `[problem]`"]);
    let text = problem.replace("[problem]", "«[problem]»");
    fails(&text, &["`emission` is missing"]);
    let text = format!("{problem}emission = «{{}}»");
    fails(&text, &["`constant` is missing in `emission`"]);
    let text = format!("{problem}emission = 0\n[[target]]\nover = [0,\n  1]");
    let file = read("t.toml", &text).unwrap();
    assert_eq!(file.targets[0].name.value, "over = [0, 1]");
}

#[test]
fn kinds() {
    let text = |kind: &str| format!("[problem]\nkind = {kind}\nsides = 3\n");
    let words = ["`kind` must be \"circle\", \"cube\"", "found \"ball\""];
    let mut words = words.map(str::to_owned).to_vec();
    words.extend(KINDS.iter().map(|kind| format!("\"{}\"", kind.word)));
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    fails(&text("«'ball'»"), &words);
    fails(&text("«'circel'»"), &["did you mean \"circle\"?"]);
    fails(&text("«3»"), &["`kind` must be a string, found an integer"]);
}

#[test]
fn wrong_types() {
    let walk = |walk: &str| small(PROBLEM, "", walk, TARGET);
    let words = ["`walks` must be an integer, found a string"];
    fails(&walk("walks = «'5'»"), &words);
    let words = ["an integer, found 1e5: write 100000"];
    fails(&walk("walks = «1e5»"), &words);
    fails(&walk("walks = «1.5»"), &["an integer, found 1.5"]);
    fails(&walk("walks = «-1»"), &["must not be negative"]);
    let huge = "9".repeat(60);
    fails(&walk(&format!("seed = «{huge}»")), &["too large"]);
    fails(&walk("relative = «1»"), &["must be true or false"]);
    fails(&walk("absorption = «[]»"), &["a number, found an array"]);
    fails(&walk("absorption = «1e999»"), &["a finite number"]);
    let words = [
        "must be \"absorption\" or \"collision\"",
        "mean \"collision\"?",
    ];
    fails(&walk("estimator = «'colision'»"), &words);
    fails(
        &walk("scalar = «32»"),
        &["\"f32\" or \"f64\", found an integer"],
    );
    let text = small(PROBLEM, "pairs = «'x'»", "", TARGET);
    fails(
        &text,
        &["\"paper\", \"default\", \"pointwise\" or \"rays\""],
    );
    fails("problem = «5»", &["`problem` must be a table"]);
    let one = small(PROBLEM, "", "", TARGET);
    let text = one.replace("[[target]]", "«[target]»");
    fails(&text, &["write `[[target]]`"]);
    let text = one.replace("[walk]", "«[[walk]]»");
    fails(&text, &["`walk` must be a table, found an array"]);
    let problem = "reflectance = [0.1, «'0.2'»]\nemission = 1";
    let words = ["`reflectance[1]` must be a number"];
    fails(&small(problem, "", "", TARGET), &words);
    let problem = "reflectance = 0.1\nemission = «true»";
    let words = [
        "a number, an array of numbers, or a table",
        "found a boolean",
    ];
    fails(&small(problem, "", "", TARGET), &words);
}

#[test]
fn every_template_is_a_good_file_of_its_kind() {
    for kind in KINDS {
        let file = good(kind.template);
        let resolved = file.resolve().unwrap();
        // A vacuum is a scene of molecules.
        let word = if kind.word == "vacuum" {
            "scene"
        } else {
            kind.word
        };
        assert_eq!(resolved.model.model().about().kind, word);
        assert!(!resolved.targets.is_empty());
    }
}
