//! Any text: syntax, line ends, long lines, places in them.

use super::*;

/// The most characters that are shown of a line.
const SHOWN: usize = 100;

#[test]
fn syntax_errors() {
    fails("[problem]\nkind = «»\n", &["not valid TOML: "]);
    fails("a = 1\n«a» = 2", &["duplicate key"]);
    fails("a = 1\n\nb = [1,«»", &["not valid TOML"]);
    fails("[walk«»\n", &["not valid TOML"]);
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
    let text = small(PROBLEM, "", "batch = «0»", TARGET).replace('\n', "\r\n");
    fails(&text, &["`batch`"]);
    assert!(!failure(&text).contains('\r'));
    let walk = "walks = 1\n\tbatch\t=\t«0» # x";
    fails(&small(PROBLEM, "", walk, TARGET), &["`batch`"]);
    let text = "problem = { \"é∑𝕏\" = 'ü', kind = «'öl'» }";
    fails(text, &["found \"öl\""]);
    fails("\u{feff}«a» = 1", &["`problem` is missing"]);
    fails("\u{feff}«problm» = 1", &["did you mean `problem`?"]);
    // Control characters are not passed on.
    fails("a = '«\u{1b}»[31m'", &["not valid TOML"]);
    // A value of several lines is marked to the end of its first.
    let text = small("reflectance = «[»\r\n]\nemission = 1", "", "", TARGET);
    fails(&text, &["at least one"]);
}

#[test]
fn long_lines_are_cut() {
    for zeros in [0, 10, 60, 100, 1000] {
        for after in [0, 1, 50, 1000] {
            let array = format!("[{}«nan»{}]", "0,".repeat(zeros), ",0".repeat(after));
            let text = small(
                &format!("reflectance = {array}\nemission = 1"),
                "",
                "",
                TARGET,
            );
            fails(&text, &["finite"]);
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
    fails("[problem]\r\nkind = «»\r\n", &["not valid TOML"]);
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
