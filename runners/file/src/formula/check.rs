//! What is wrong with a formula, where, and what would be right.

use core::ops::Range;

use nanoexpr::ErrorKind;

use super::plain::{constant as constant_of, is_word};
use super::{Formula, FormulaError, KNOWN, Parameter, Plain, TWO, Variables, is_function};

/// Names that mean a function elsewhere, and what is written here.
const ELSEWHERE: [(&str, &str); 24] = [
    ("arcsin", "asin"),
    ("arccos", "acos"),
    ("arctan", "atan"),
    ("arctan2", "atan2"),
    ("tg", "tan"),
    ("fabs", "abs"),
    ("sgn", "sign"),
    ("sig", "sign"),
    ("signum", "sign"),
    ("pow", "x^y"),
    ("power", "x^y"),
    ("square", "x^2"),
    ("tgamma", "gamma"),
    ("gammaln", "lgamma"),
    ("lngamma", "lgamma"),
    ("loggamma", "lgamma"),
    ("expint", "E1, E2 or E3"),
    ("expn", "E1, E2 or E3"),
    ("exp1", "E1"),
    ("besselj", "J0 or J1"),
    ("bessely", "Y0 or Y1"),
    ("besseli", "I0 or I1"),
    ("besselk", "K0 or K1"),
    ("log2", "ln(…)/ln(2)"),
];

/// Checks all that can be checked without values: syntax, names, numbers of arguments.
///
/// # Errors
/// What is wrong, and what would be right.
pub fn check(text: &str, variables: Variables<'_>) -> Result<(), FormulaError> {
    let plain = Plain::new(text, variables.parameters)?;
    let names = names(text);
    for name in &names {
        if let Some(message) = unknown(text, name, variables) {
            let span = name.span.clone();
            return Err(FormulaError { span, message });
        }
    }
    if let Err(error) = Formula::<f64>::compiled(&plain) {
        let span = plain.typed(error.span.start..error.span.end);
        let message = explained(text, error.kind, &span);
        return Err(FormulaError { span, message });
    }
    for name in names.into_iter().filter(|name| name.is_called) {
        if let Some(message) = miscounted(name.text, &text[name.span.end..]) {
            let span = name.span;
            return Err(FormulaError { span, message });
        }
    }
    match chain(plain.text()) {
        Some(span) => Err(FormulaError {
            span: plain.typed(span),
            message: "a second comparison would compare 0 or 1: write a < b && b < c".to_owned(),
        }),
        None => Ok(()),
    }
}

/// The value of a formula without coordinates.
///
/// ```
/// use fredholm_file::formula::constant;
///
/// assert_eq!(constant("3/2 * |-1|", &[]), Ok(1.5));
/// assert!(constant("1/0", &[]).unwrap_err().message.contains("is inf"));
/// ```
///
/// # Errors
/// What is wrong with it: the value must be finite, too.
pub fn constant(text: &str, parameters: &[Parameter]) -> Result<f64, FormulaError> {
    let variables = Variables {
        dimension: 0,
        two: false,
        parameters,
    };
    check(text, variables)?;
    let value = Formula::<f64>::new(text, parameters)?.value(&[], &[]);
    match value.is_finite() {
        true => Ok(value),
        false => Err(FormulaError {
            span: 0..text.len(),
            message: format!("this is {value}, and must be a finite number"),
        }),
    }
}

/// What is wrong with the syntax, and what would be right.
fn explained(text: &str, kind: ErrorKind, span: &Range<usize>) -> String {
    let (before, here) = (&text[..span.start], &text[span.clone()]);
    match kind {
        ErrorKind::UnexpectedEnd if before.matches('?').count() > before.matches(':').count() => {
            "unexpected end: a case is written `condition ? a : b`, and `: b` is missing".to_owned()
        }
        ErrorKind::UnexpectedEnd => "unexpected end: a value is missing".to_owned(),
        ErrorKind::UnexpectedToken => match factors(before, &text[span.start..]) {
            Some((left, right)) => {
                format!("unexpected {here}: a product needs its sign, write {left} * {right}")
            }
            None if here == "," => "unexpected `,`: it belongs between arguments of a function, and numbers have a point, \
                                    0.5"
                .to_owned(),
            None if here == ":" => "unexpected `:`: a case is written `condition ? a : b`".to_owned(),
            None => format!("unexpected `{here}`: a value is missing before it"),
        },
        ErrorKind::UnexpectedCharacter => {
            let right = match here {
                "=" => "a comparison is written ==, and none is needed but in a case, `condition ? a : b`",
                "&" => "\"and\" is written &&",
                "[" | "]" | "{" | "}" => "parentheses are ( and )",
                "√" => "write sqrt(…)",
                "∞" => "only ends of a `domain` are infinite",
                "'" | "′" | "’" => "there are no derivatives",
                _ => "no sign of formulas",
            };
            // It is shown in its place, and may be none that a terminal should have.
            format!("unexpected character: {right}")
        }
        ErrorKind::InvalidNumber => "invalid number: it is too large".to_owned(),
        _ => kind.description().to_owned(),
    }
}

/// The two factors that stand side by side where a text is cut: "0.2" and "x", "…)" and "(…".
fn factors<'t>(before: &'t str, after: &'t str) -> Option<(&'t str, &'t str)> {
    let is_part = |c: char| is_word(c) || c == '.';
    let (left, right) = (before.trim_end(), after.trim_start());
    let start = left.trim_end_matches(is_part).len();
    let end = right.find(|c| !is_part(c)).unwrap_or(right.len());
    let left = match left.chars().next_back()? {
        ')' => "…)",
        '|' => "|…|",
        _ => &left[start..],
    };
    let right = match right.chars().next()? {
        '(' => "(…",
        '|' => "|…|",
        _ => &right[..end],
    };
    (!left.is_empty() && !right.is_empty()).then_some((left, right))
}

/// Why a call of a function has the wrong number of arguments, if so; they and what follows are the rest
/// of a formula whose parentheses match.
fn miscounted(name: &str, rest: &str) -> Option<String> {
    let takes = if TWO.contains(&name) { 2 } else { 1 };
    let (mut depth, mut commas, mut empty) = (0, 0, true);
    for c in rest.trim_start().chars() {
        match c {
            ')' if depth == 1 => break,
            ',' if depth == 1 => commas += 1,
            _ => empty &= depth == 0 || c.is_whitespace(),
        }
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            _ => {}
        }
    }
    let found = if empty { 0 } else { commas + 1 };
    let plural = if takes == 1 { "" } else { "s" };
    (found != takes).then(|| format!("`{name}` takes {takes} argument{plural}, not {found}"))
}

/// Why a name means nothing here, if so.
fn unknown(text: &str, name: &Name<'_>, variables: Variables<'_>) -> Option<String> {
    let (word, rest) = (name.text, text[name.span.end..].trim_start());
    if word == "mod" {
        return Some("the remainder is written with %".to_owned());
    }
    let is_number = constant_of(word).is_some() || variables.knows(word);
    match (is_function(word), is_number, name.is_called) {
        (true, _, true) | (_, true, false) => return None,
        (false, true, true) => {
            return Some(format!(
                "`{word}` is a number, not a function: a product needs its sign, write {word} * (…"
            ));
        }
        (true, false, false) => {
            let end = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
            let (argument, after) = rest.split_at(end);
            let is_alone = !argument.is_empty() && !after.trim_start().starts_with(['(', '^']);
            let argument = if is_alone { argument } else { "…" };
            let power = rest.starts_with(['^', '²', '³']);
            let power = if power { "^2, not after the name" } else { "" };
            return Some(format!(
                "`{word}` is a function: write {word}({argument}){power}"
            ));
        }
        (false, false, _) => {}
    }
    let right = match word.to_lowercase().as_str() {
        "if" | "then" | "else" | "elif" | "where" | "piecewise" => {
            return Some("a case is written `condition ? a : b`, such as x < y ? x : y".to_owned());
        }
        "and" => Some("&&"),
        "or" => Some("||"),
        "not" => Some("!"),
        "log" => return Some("`log` has two meanings: write ln or log10".to_owned()),
        lower => {
            let elsewhere = ELSEWHERE.iter().find(|(name, _)| *name == lower);
            let has_case = |known: &&str| {
                let is_kind = match name.is_called {
                    true => is_function(known),
                    false => constant_of(known).is_some(),
                };
                is_kind && known.to_lowercase() == lower
            };
            let of_case = KNOWN.split([' ', ',']).find(has_case);
            elsewhere.map(|(_, here)| *here).or(of_case)
        }
    };
    let kind = if name.is_called { "function" } else { "name" };
    Some(match right {
        Some(right) => format!("unknown {kind} `{word}`: write {right}"),
        None if !name.is_called && variables.knows(&word.to_lowercase()) => {
            format!("unknown name `{word}`: write {}", word.to_lowercase())
        }
        None if name.is_called => format!("unknown function `{word}`; known: {KNOWN}"),
        None if matches!(word, "i" | "I" | "j") => format!(
            "unknown name `{word}`; formulas are real: a complex equation is a system of two, of the real and of the imaginary part"
        ),
        None => format!("unknown name `{word}`; {}", variables.names()),
    })
}

/// The second of two comparisons of which the first would be compared.
fn chain(text: &str) -> Option<Range<usize>> {
    let mut has_one = vec![false];
    let mut at = 0;
    while let Some(&byte) = text.as_bytes().get(at) {
        let is_wide = text.as_bytes().get(at + 1) == Some(&b'=');
        let length = 1 + usize::from(is_wide && matches!(byte, b'<' | b'>' | b'=' | b'!'));
        match byte {
            b'(' => has_one.push(false),
            b')' => {
                has_one.pop();
            }
            b'<' | b'>' => match has_one.last_mut() {
                Some(true) => return Some(at..at + length),
                Some(one) => *one = true,
                None => {}
            },
            b'?' | b':' | b',' | b'&' | b'|' | b'=' | b'!' => {
                if let Some(one) = has_one.last_mut() {
                    *one = false;
                }
            }
            _ => {}
        }
        at += length;
    }
    None
}

/// A name in a formula.
pub(crate) struct Name<'t> {
    pub(crate) text: &'t str,
    pub(crate) span: Range<usize>,
    pub(crate) is_called: bool,
}

/// The number of times that a text has a name.
///
/// ```
/// assert_eq!(fredholm_file::formula::occurrences("2*a + ab - a", "a"), 2);
/// ```
pub fn occurrences(text: &str, name: &str) -> usize {
    names(text).iter().filter(|own| own.text == name).count()
}

/// The names in a formula.
pub(crate) fn names(text: &str) -> Vec<Name<'_>> {
    let word = |b: u8| b.is_ascii_alphanumeric() || b == b'_';
    let bytes = text.as_bytes();
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let first = bytes[at];
        let start = at;
        if first.is_ascii_digit() || first == b'.' {
            // A number, whose exponent is no name.
            while at < bytes.len() && (word(bytes[at]) || bytes[at] == b'.') {
                at += 1;
            }
        } else if word(first) {
            while at < bytes.len() && word(bytes[at]) {
                at += 1;
            }
            found.push(Name {
                text: &text[start..at],
                span: start..at,
                is_called: text[at..].trim_start().starts_with('('),
            });
        } else {
            at += 1;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::check;
    use crate::formula::{Parameter, Variables};

    /// Demands an error at what stands between « and » in a formula, with these words in the message.
    fn wrong(marked: &str, variables: Variables<'_>, words: &str) {
        let text = marked.replace(['«', '»'], "");
        let Err(error) = check(&text, variables) else {
            panic!("{text} is taken");
        };
        let (start, end) = (error.span.start, error.span.end);
        let found = format!("{}«{}»{}", &text[..start], &text[start..end], &text[end..]);
        assert_eq!(found, marked, "{}", error.message);
        assert!(error.message.contains(words), "{found}: {}", error.message);
    }

    /// Wrong formulas with their marks, and what the message has.
    const WRONG: [(&str, &str); 60] = [
        ("0.5*«sin» x", "`sin` is a function: write sin(x)"),
        ("«sin» + 1", "write sin(…)"),
        ("«sin» 2*x", "write sin(2)"),
        ("«exp» -x", "write exp(…)"),
        ("«sin»^2(x)", "write sin(…)^2, not after the name"),
        ("«sin»²(x)", "write sin(…)^2, not after the name"),
        ("«log10»", "write log10(…)"),
        (
            "exp«(»-(x - y)^2",
            "this `(` is not closed: a `)` is missing",
        ),
        ("exp«(»-x", "is not closed"),
        ("(x - y)«)»^2", "this `)` closes nothing"),
        (
            "«if» x<y then x else y",
            "a case is written `condition ? a : b`",
        ),
        ("x «if» x<y else y", "a case is written `condition ? a : b`"),
        ("«if»(x < y, x, y)", "a case is written `condition ? a : b`"),
        ("x < y ? 1«»", "`: b` is missing"),
        ("x < y «:» 1", "a case is written `condition ? a : b`"),
        ("x > 0 «and» y > 0", "write &&"),
        ("«not» (x < y)", "write !"),
        ("x «=» y ? 1 : 0", "a comparison is written =="),
        ("0 < x «<» y ? 1 : 0", "write a < b && b < c"),
        ("(x <= y) * (0 ≤ x «≤» 1)", "write a < b && b < c"),
        ("«|»x - y", "this `|` is not closed"),
        ("2«|»x - y|", "a product needs its sign, write … * |…|"),
        ("|x - y| «x»", "write |…| * x"),
        ("x «&» y", "\"and\" is written &&"),
        ("«Exp»(-x)", "unknown function `Exp`: write exp"),
        ("«SIN»(x)", "unknown function `SIN`: write sin"),
        ("«e1»(x)", "unknown function `e1`: write E1"),
        ("«j0»(x)", "write J0"),
        ("«Gamma»(x)", "write gamma"),
        ("2 * «Pi» * x", "unknown name `Pi`: write pi"),
        ("«X» + y", "unknown name `X`: write x"),
        ("x + «y2»", "the coordinates here are x and y"),
        (
            "exp(«i» * (x - y))",
            "a complex equation is a system of two",
        ),
        ("«arctan»(x)", "write atan"),
        ("«pow»(x, 2)", "write x^y"),
        ("«log»(x)", "write ln or log10"),
        ("«e»(-x)", "`e` is a number, not a function"),
        ("«x»(1 + y)", "a product needs its sign, write x * (…"),
        (
            "x < y ? 1 : «foo»(x)",
            "unknown function `foo`; known: numbers, pi",
        ),
        ("x + «z»", "the coordinates here are x and y"),
        ("1 + «*» x", "a value is missing before it"),
        ("x +«»", "a value is missing"),
        ("«»", "a value is missing"),
        ("0.2«x»", "write 0.2 * x"),
        ("0.5 «x» y", "write 0.5 * x"),
        ("2«(»x + y)", "write 2 * (…"),
        ("(x + y) «x»", "write …) * x"),
        ("(x + y)«(»x - y)", "write …) * (…"),
        ("0«,»5 * x", "numbers have a point, 0.5"),
        ("«[»x + y]", "parentheses are ( and )"),
        ("«√»x", "write sqrt(…)"),
        ("x «$» y", "no sign of formulas"),
        ("«1e999»", "it is too large"),
        ("«min»(x) + 1", "`min` takes 2 arguments, not 1"),
        ("«sin»( )", "`sin` takes 1 argument, not 0"),
        ("«exp» (x, y)", "`exp` takes 1 argument, not 2"),
        // Where no value would show it: in a branch that few points take.
        (
            "x < 0.1 ? (y < 0.1 ? x : «atan2»((x), max(x, y), 1)) : 1",
            "`atan2` takes 2 arguments, not 3",
        ),
        // An operator of the library that is none of ours, and would pass for a coordinate.
        ("«mod»", "written with %"),
        ("x «mod» y", "written with %"),
        ("x«²³»^2", "write this exponent as ^(…)"),
    ];

    #[test]
    fn every_mistake_has_one_message_that_says_what_is_right() {
        for (marked, words) in WRONG {
            wrong(marked, Variables::FACTOR, words);
        }
    }

    #[test]
    fn names_are_those_of_the_dimension_and_of_parameters() {
        let plane = Variables {
            dimension: 2,
            ..Variables::FACTOR
        };
        assert!(check("x1 * y2", plane).is_ok());
        wrong("«x» * y", plane, "x1 to x2");
        assert!(check("x3", plane).is_err() && check("x0", plane).is_err());
        let one = Variables {
            two: false,
            ..Variables::FACTOR
        };
        assert!(check("x + y", one).is_err());
        assert!(check(&"(".repeat(10_000), one).is_err());
        assert!(check(&format!("{}x{}", "x + (".repeat(40), ")".repeat(40)), one).is_err());
        let parameters = ["a", "k"].map(|name| Parameter::new(name, -0.5));
        let named = Variables {
            parameters: &parameters,
            ..one
        };
        assert!(check("a^2 * exp(-k * |x - a|)", named).is_ok());
        assert!(check("a", one).is_err());
        for (marked, words) in [
            ("«b» * x", "the coordinates here are x, the parameters a, k"),
            ("a «x»", "write a * x"),
            ("«a»(x)", "write a * (…"),
            ("2«a»", "write 2 * a"),
            ("k + + + «»", "a value is missing"),
            ("a + «foo»", "unknown name `foo`"),
        ] {
            wrong(marked, named, words);
        }
    }
}
