//! Formulas as people type them, in the signs that are compiled: |x − y|, x², π, and parameters by name.

use core::f64::consts::{E, PI};
use core::ops::Range;

use super::FormulaError;

/// A number that formulas know by a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// The name: letters, digits and `_`, not a digit first.
    pub name: String,
    /// The number.
    pub value: f64,
    /// The formula of those before it by which it is given, if it is.
    pub formula: Option<String>,
}

impl Parameter {
    /// The parameter of this name that is a number.
    ///
    /// ```
    /// use fredholm_file::formula::Parameter;
    ///
    /// assert_eq!(Parameter::new("a", 0.5).value, 0.5);
    /// ```
    pub fn new(name: impl Into<String>, value: f64) -> Self {
        Self {
            name: name.into(),
            value,
            formula: None,
        }
    }
}

/// Signs of paper, and what is compiled in their place.
const SIGNS: [(char, &str); 8] = [
    ('−', "-"),
    ('–', "-"),
    ('·', "*"),
    ('×', "*"),
    ('÷', "/"),
    ('≤', "<="),
    ('≥', ">="),
    ('≠', "!="),
];
/// What is said of factors side by side.
const NO_SIGN: &str = "a product needs its sign, write ";
/// The digits of exponents.
const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];

/// The formula that is compiled for one that is typed.
///
/// ```
/// use fredholm_file::formula::{Parameter, Plain};
///
/// let a = Parameter::new("a", -0.5);
/// let plain = Plain::new("a·exp(−|x − y|²)", &[a]).unwrap();
/// assert_eq!(plain.text(), "(-0.5)*exp(-abs(x - y)^2)");
/// ```
#[derive(Clone, Debug)]
pub struct Plain {
    text: String,
    /// Where every byte of the text comes from.
    origins: Vec<usize>,
    length: usize,
}

/// What is open.
#[derive(Clone, Copy, PartialEq)]
enum Open {
    Parenthesis,
    Bar,
}

impl Plain {
    /// Replaces signs of paper and the names of constants and parameters.
    ///
    /// # Errors
    /// Parentheses or bars without their other half; an exponent without what it belongs to; a π beside a factor.
    pub fn new(typed: &str, parameters: &[Parameter]) -> Result<Self, FormulaError> {
        let mut plain = Self {
            text: String::new(),
            origins: Vec::new(),
            length: typed.len(),
        };
        let mut open: Vec<(Open, usize)> = Vec::new();
        // Whether a value ends here, so that only an operator may follow.
        let mut has_value = false;
        let mut at = 0;
        while let Some(c) = typed.get(at..).and_then(|rest| rest.chars().next()) {
            let rest = &typed[at..];
            let here = at..at + c.len_utf8();
            let length = match c {
                '0'..='9' | '.' | 'a'..='z' | 'A'..='Z' | '_' => {
                    let end = rest.find(|c: char| !is_word(c) && c != '.');
                    let is_number = c == '.' || c.is_ascii_digit();
                    let name_end = rest.find(|c: char| !is_word(c));
                    let length = if is_number { end } else { name_end }.unwrap_or(rest.len());
                    let word = &rest[..length];
                    if typed[..at].ends_with('π') {
                        return Err(error(at..at + length, &format!("{NO_SIGN}π * {word}")));
                    }
                    let own = parameters.iter().find(|own| own.name == word);
                    match own.map(|own| own.value).or(constant(word)) {
                        Some(value) => plain.push(&number(value), at),
                        None => plain.copy(word, at),
                    }
                    has_value = true;
                    length
                }
                'π' => {
                    if has_value {
                        return Err(error(here, &format!("{NO_SIGN}… * π")));
                    }
                    plain.push(&number(PI), at);
                    has_value = true;
                    c.len_utf8()
                }
                '(' => {
                    open.push((Open::Parenthesis, at));
                    plain.push("(", at);
                    has_value = false;
                    1
                }
                ')' => {
                    match open.pop() {
                        Some((Open::Parenthesis, _)) => {}
                        Some((Open::Bar, bar)) => return Err(unclosed_bar(bar)),
                        None => return Err(error(here, "this `)` closes nothing")),
                    }
                    plain.push(")", at);
                    has_value = true;
                    1
                }
                '|' if !has_value => {
                    open.push((Open::Bar, at));
                    plain.push("abs(", at);
                    1
                }
                '|' if rest.starts_with("||") && !closes_twice(&open) => {
                    if let Some((Open::Bar, _)) = open.last() {
                        let message = "`||` is \"or\": between bars write abs(…) for |…|";
                        return Err(error(at..at + 2, message));
                    }
                    plain.copy("||", at);
                    has_value = false;
                    2
                }
                '|' => {
                    if open.pop_if(|(open, _)| *open == Open::Bar).is_none() {
                        let message = format!("{NO_SIGN}… * |…|; \"or\" is written ||");
                        return Err(error(here, &message));
                    }
                    plain.push(")", at);
                    1
                }
                _ if DIGITS.contains(&c) || c == '⁻' => {
                    let (exponent, length) = exponent(rest);
                    let next = rest[length..].trim_start();
                    if !has_value {
                        return Err(error(here, "this exponent has nothing before it"));
                    }
                    if exponent.is_empty() || next.starts_with('^') || next.starts_with("**") {
                        return Err(error(at..at + length, "write this exponent as ^(…)"));
                    }
                    plain.push(&format!("^{exponent}"), at);
                    length
                }
                _ => {
                    match SIGNS.iter().find(|(sign, _)| *sign == c) {
                        Some((_, text)) => {
                            plain.push(text, at);
                            has_value = false;
                        }
                        None => {
                            plain.push(&rest[..c.len_utf8()], at);
                            has_value &= c.is_whitespace();
                        }
                    }
                    c.len_utf8()
                }
            };
            at += length;
        }
        match open.last() {
            Some(&(Open::Bar, at)) => Err(unclosed_bar(at)),
            Some(&(Open::Parenthesis, at)) => Err(error(
                at..at + 1,
                "this `(` is not closed: a `)` is missing",
            )),
            None => Ok(plain),
        }
    }

    /// The formula in the signs that are compiled.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Where a part of the text was typed.
    pub(crate) fn typed(&self, part: Range<usize>) -> Range<usize> {
        let of = |at: usize| self.origins.get(at).copied().unwrap_or(self.length);
        let start = of(part.start);
        start..of(part.end).max(start)
    }

    /// Adds what stands for the sign at a place.
    fn push(&mut self, text: &str, at: usize) {
        self.text.push_str(text);
        self.origins.resize(self.text.len(), at);
    }

    /// Adds what is typed at a place.
    fn copy(&mut self, text: &str, at: usize) {
        self.text.push_str(text);
        self.origins.extend(at..at + text.len());
    }
}

pub(crate) fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// The constant of this name.
pub(crate) fn constant(name: &str) -> Option<f64> {
    match name {
        "pi" => Some(PI),
        "e" => Some(E),
        _ => None,
    }
}

/// The number as a value of its own wherever it is put.
fn number(value: f64) -> String {
    let text = format!("{value:?}");
    match text.starts_with('-') {
        true => format!("({text})"),
        false => text,
    }
}

/// The exponent with which a text begins, and its length.
fn exponent(text: &str) -> (String, usize) {
    let (mut digits, mut length, mut sign) = (String::new(), 0, "");
    for c in text.chars() {
        match DIGITS.iter().position(|digit| *digit == c) {
            Some(digit) => digits += &digit.to_string(),
            None if c == '⁻' && length == 0 => sign = "-",
            None => break,
        }
        length += c.len_utf8();
    }
    let exponent = match (digits.is_empty(), sign) {
        (true, _) | (_, "") => digits,
        _ => format!("({sign}{digits})"),
    };
    (exponent, length)
}

/// Whether the two that were opened last are bars.
fn closes_twice(open: &[(Open, usize)]) -> bool {
    matches!(open, [.., (Open::Bar, _), (Open::Bar, _)])
}

fn error(span: Range<usize>, message: &str) -> FormulaError {
    FormulaError {
        span,
        message: message.to_owned(),
    }
}

fn unclosed_bar(at: usize) -> FormulaError {
    error(
        at..at + 1,
        "this `|` is not closed: write |…| or abs(…); \"or\" is written ||",
    )
}

#[cfg(test)]
mod tests {
    use super::{Parameter, Plain};

    fn plain(typed: &str) -> String {
        let of = |(name, value): (&str, f64)| Parameter::new(name, value);
        let parameters = [("a", 0.5), ("b", -2.0), ("tiny", 1e-300)].map(of);
        match Plain::new(typed, &parameters) {
            Ok(plain) => plain.text().to_owned(),
            Err(error) => format!("{}: {}", &typed[error.span.clone()], error.message),
        }
    }

    #[test]
    fn signs_of_paper_are_replaced() {
        for (typed, expected) in [
            ("|x-y|", "abs(x-y)"),
            ("2 * |x - |y|| - 1", "2 * abs(x - abs(y)) - 1"),
            ("||x| - y|^-0.5", "abs(abs(x) - y)^-0.5"),
            ("max(|x|, |y|)", "max(abs(x), abs(y))"),
            ("|x| < 1 || |y| < 1", "abs(x) < 1 || abs(y) < 1"),
            ("|(x) - y| * |x|", "abs((x) - y) * abs(x)"),
            ("|-x|", "abs(-x)"),
            ("(x-y)²", "(x-y)^2"),
            ("x¹² + y⁻³", "x^12 + y^(-3)"),
            ("|x|² − 2·π", "abs(x)^2 - 2*3.141592653589793"),
            ("e^(pi*x)", "2.718281828459045^(3.141592653589793*x)"),
            ("x ≤ y ? 1 : 0", "x <= y ? 1 : 0"),
            ("a + b", "0.5 + (-2.0)"),
            ("a^b * tiny", "0.5^(-2.0) * 1e-300"),
            // Names of which a parameter's is a part, and numbers, stay.
            ("ab + a1 + 2a + exp(a)", "ab + a1 + 2a + exp(0.5)"),
            ("1e-3 * x", "1e-3 * x"),
        ] {
            assert_eq!(plain(typed), expected, "{typed}");
        }
    }

    #[test]
    fn what_is_not_whole_is_shown() {
        for (typed, expected) in [
            ("exp(-(x - y)^2", "(: this `(` is not closed"),
            ("(x + y)) * 2", "): this `)` closes nothing"),
            ("|x - y", "|: this `|` is not closed"),
            ("(|x)|", "|: this `|` is not closed"),
            ("2 |x|", "|: a product needs its sign"),
            ("|x||y|", "||: `||` is \"or\": between bars write abs(…)"),
            ("² + x", "²: this exponent has nothing before it"),
            ("x²^3", "²: write this exponent as ^(…)"),
            ("2π", "π: a product needs its sign, write … * π"),
            ("x π", "π: a product needs its sign, write … * π"),
            ("π2", "2: a product needs its sign, write π * 2"),
            ("πx", "x: a product needs its sign, write π * x"),
        ] {
            assert!(
                plain(typed).starts_with(expected),
                "{typed}: {}",
                plain(typed)
            );
        }
    }

    #[test]
    fn places_are_those_of_what_was_typed() {
        let plain = Plain::new("|x²| + foo", &[]).unwrap();
        let at = plain.text().find("foo").unwrap();
        let typed = plain.typed(at..at + 3);
        assert_eq!(&"|x²| + foo"[typed], "foo");
        let end = plain.text().len();
        assert_eq!(plain.typed(end..end), 11..11);
    }
}
