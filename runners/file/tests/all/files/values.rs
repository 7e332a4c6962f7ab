//! Ranges, and what values ask of one another.

use super::*;

#[test]
fn reflectance_and_emission() {
    let text = |reflectance: &str, emission: &str| {
        let problem = format!("reflectance = {reflectance}\nemission = {emission}");
        small(&problem, "", "", TARGET)
    };
    for number in ["nan", "-inf", "+inf"] {
        let array = format!("[0, «{number}»]");
        let words = ["`reflectance[1]` must be a finite number"];
        fails(&text(&array, "1"), &words);
        let words = ["`emission` must be a finite number"];
        fails(&text("0", &format!("«{number}»")), &words);
    }
    fails(&text("«[]»", "1"), &["`reflectance`", "at least one"]);
    fails(&text("0", "«[]»"), &["`emission`", "at least one"]);
    let words = [
        "at least 0 and less than 1",
        "series of reflections converge",
    ];
    fails(&text("[0.5, «1»]", "1"), &words);
    fails(&text("«1.0»", "1"), &words);
    fails(&text("«-0.1»", "1"), &words);
    let harmonic = "{ constant = 1, amplitude = 1, frequency = «0» }";
    fails(&text("0", harmonic), &["`frequency` must be at least 1"]);
}

#[test]
fn cells() {
    let text = |galerkin: &str| small(PROBLEM, galerkin, "", TARGET);
    good(&text("cells = 6"));
    let words = ["the 2 arcs of `reflectance` and of the 3 arcs of `emission`"];
    fails(&text("cells = «10»"), &words);
    fails(&text("cells = «10»"), &["nearest: 6 or 12"]);
    assert!(failure(&text("cells = 1")).contains("nearest: 6\n"));
    assert!(failure(&text("cells = 100000000")).contains("nearest: 99999996\n"));
    fails(&text("cells = «0»"), &["at least 1"]);
    fails(&text("cells = «100000001»"), &["memory"]);
    fails(
        &text("degree = «5»"),
        &["`degree` must be from 0 to 4 on a circle"],
    );
    let harmonic = FULL.replace("1_000", "«7»");
    let words = ["multiple of the 2 arcs of `reflectance`; nearest: 6 or 8"];
    fails(&harmonic, &words);
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
    fails(&text("absorption = «0»"), &["more than 0", "less than 1"]);
    fails(&text("absorption = «1»"), &["more than 0", "less than 1"]);
    fails(&text("batch = «0»"), &["from 1 to 1000000000"]);
    fails(&text("batch = «1000000001»"), &["from 1 to"]);
    fails(&text("target_error = «0.0»"), &["more than 0"]);
    fails(&text("target_error = «-1»"), &["more than 0"]);
    for value in ["true", "false"] {
        let words = ["does nothing without a `target_error`"];
        fails(&text(&format!("relative = «{value}»")), &words);
    }
    good(&text("relative = false\ntarget_error = 1"));
}

#[test]
fn targets() {
    let text = |target: &str| small(PROBLEM, "", "", target);
    let none = text("").replace("[[target]]\n", "");
    let end = format!("{none}«»");
    fails(&end, &["at least one `[[target]]`"]);
    let none = format!("target = «[]»\n{none}");
    fails(&none, &["at least one `[[target]]`"]);
    let two = text("name = 'a'\nat = 1\n[[target]]\nname = «\"a\"»\nat = 2");
    let words = ["a second target named \"a\"; the first is on line 10"];
    fails(&two, &words);
    fails(&text("name = «' '»\nat = 1"), &["must not be empty"]);
    for angle in ["-0.1", "6.2832", "7"] {
        let target = format!("name = 'a'\nat = «{angle}»");
        fails(&text(&target), &["less than 2 pi = 6.28318"]);
    }
    let words = ["target \"a\" has both `grid` and `at`"];
    fails(&text("name = 'a'\ngrid = 3\n«at» = 0"), &words);
    let words = [
        "target \"a\" does not say what to compute",
        "`over = \"all\"`",
    ];
    let text_without = text("name = 'a'").replace("[[target]]", "«[[target]]»");
    fails(&text_without, &words);
    fails(&text("name = 'a'\ngrid = «0»"), &["from 1 to 100000"]);
    fails(&text("name = 'a'\ngrid = «100001»"), &["100000"]);
    let over = |over: &str| text(&format!("name = 'a'\nover = {over}"));
    good(&over("[0, 6.283185307179586]"));
    fails(&over("[0, «7»]"), &["from 0 to 2 pi"]);
    fails(&over("[«-1», 2]"), &["from 0 to 2 pi"]);
    fails(&over("[2, «2»]"), &["more than the first"]);
    fails(&over("«[2]»"), &["\"all\", two angles"]);
    fails(&over("«'half'»"), &["or two angles"]);
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
    file.walk.absorption = Some(Placed::flag("--absorption", f64::NAN));
    let error = file.validate().unwrap_err().to_string();
    assert!(
        error.starts_with("`--absorption NaN`: `absorption` must"),
        "{error}"
    );
    file.walk.absorption = Some(Placed::flag("--absorption", 0.5));
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
