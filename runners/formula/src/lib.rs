#![doc = include_str!("../README.md")]

mod functions;

use core::cmp::Ordering;
use core::ops::Range;

use fredholm_core::Real;
use nanoexpr::{Context, ErrorKind, Evaluator, Instruction, Number, Program};

pub use functions::Formulas;

/// The words of formulas, for messages.
pub const KNOWN: &str = "numbers, pi, e, + - * / % ^, comparisons, `condition ? a : b`, abs, \
     sign, min, max, sqrt, cbrt, exp, ln, log10, sin, cos, tan, asin, acos, atan, atan2, sinh, cosh, \
     tanh, floor, ceil";

type Unary = (&'static str, fn(f64) -> f64);

/// The functions of one argument.
const UNARY: [Unary; 12] = [
    ("cbrt", libm::cbrt),
    ("log10", libm::log10),
    ("tan", libm::tan),
    ("asin", libm::asin),
    ("acos", libm::acos),
    ("atan", libm::atan),
    ("sinh", libm::sinh),
    ("cosh", libm::cosh),
    ("tanh", libm::tanh),
    ("floor", libm::floor),
    ("ceil", libm::ceil),
    ("sign", sign),
];
/// The functions that a call looks up first.
const FAST: [&str; 6] = ["abs", "sqrt", "exp", "ln", "sin", "cos"];
/// The functions of two arguments.
const TWO: [&str; 3] = ["min", "max", "atan2"];

fn sign(x: f64) -> f64 {
    if x == 0.0 { x } else { x.signum() }
}

/// The most values that a formula may have pending at once.
const STACK: usize = 32;

/// The number of values that most formulas have pending at once. Room for them is cleared at each
/// evaluation: for 32 it takes a twelfth of the instructions of a short formula.
const FEW: usize = 8;

/// Which names a formula may use besides functions and constants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variables {
    /// d: with 1 the coordinates are x and y (and x1, y1), with more x1 … xd, y1 … yd.
    pub dimension: usize,
    /// Whether y is there.
    pub two: bool,
}

impl Variables {
    /// x and y on one axis.
    pub const FACTOR: Self = Self {
        dimension: 1,
        two: true,
    };

    fn knows(self, name: &str) -> bool {
        let axis = match name.split_at_checked(1) {
            Some(("x", axis)) => axis,
            Some(("y", axis)) if self.two => axis,
            _ => return false,
        };
        match axis {
            "" => self.dimension == 1,
            _ if axis.starts_with(['0', '+']) => false,
            _ => axis
                .parse()
                .is_ok_and(|a| (1..=self.dimension).contains(&a)),
        }
    }

    /// "x and y", "x1 to x3".
    pub fn names(self) -> String {
        let of = |letter: &str| match self.dimension {
            1 => letter.to_owned(),
            d => format!("{letter}1 to {letter}{d}"),
        };
        if self.two {
            format!("{} and {}", of("x"), of("y"))
        } else {
            of("x")
        }
    }
}

/// Seconds of an instruction, and of a call of a function or of a power besides, on the machines this was measured on.
const INSTRUCTION: f64 = 3e-9;
const CALL: f64 = 15e-9;
const POWER: f64 = 45e-9;

/// About how many seconds a value takes of a formula that validation has checked.
pub fn seconds(text: &str) -> f64 {
    let mut room = room::<f64>(text);
    let length = Formula::new(text, &mut room).map_or(0, |formula| formula.len());
    let calls = names(text).into_iter().filter(|(.., called)| *called);
    // Squares and cubes are products.
    let is_power = |exponent: &&str| {
        let number = exponent.trim_start();
        let rest = number.trim_start_matches(|c: char| c.is_alphanumeric() || c == '.');
        !matches!(&number[..number.len() - rest.len()], "2" | "3")
    };
    let powers = text.split('^').skip(1).filter(is_power).count();
    length as f64 * INSTRUCTION + calls.count() as f64 * CALL + powers as f64 * POWER
}

/// An error in a formula, and its place there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FormulaError {
    /// These bytes of it.
    pub span: Range<usize>,
    /// The message.
    pub message: String,
}

/// Checks all that can be checked without values: syntax, names, numbers of arguments.
pub fn check(text: &str, variables: Variables) -> Result<(), FormulaError> {
    if let Err(error) = Formula::new(text, &mut room::<f64>(text)) {
        return Err(with_product(text, error));
    }
    for (name, span, called) in names(text) {
        let message = unknown(name, called, variables).or_else(|| {
            called
                .then(|| miscounted(name, &text[span.end..]))
                .flatten()
        });
        if let Some(message) = message {
            return Err(FormulaError { span, message });
        }
    }
    Ok(())
}

/// The error with advice where two factors stand side by side: "0.2x", "0.5 x", "2(x + y)".
fn with_product(text: &str, error: FormulaError) -> FormulaError {
    let (Some(before), Some(after)) = (text.get(..error.span.start), text.get(error.span.start..))
    else {
        return error;
    };
    let word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
    let left = before.trim_end();
    let start = left.trim_end_matches(word).len();
    let right = after.trim_start();
    let end = right.find(|c| !word(c)).unwrap_or(right.len());
    let left = match left.ends_with(')') {
        true => "…)",
        false => &left[start..],
    };
    let right = match right.starts_with('(') {
        true => "(…",
        false => &right[..end],
    };
    if left.is_empty() || right.is_empty() {
        return error;
    }
    FormulaError {
        message: format!(
            "{}: a product needs its sign, write {left} * {right}",
            error.message
        ),
        ..error
    }
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
fn unknown(name: &str, called: bool, variables: Variables) -> Option<String> {
    let function = FAST.contains(&name)
        || TWO.contains(&name)
        || UNARY.iter().any(|(known, _)| *known == name);
    let known = if called {
        function
    } else {
        matches!(name, "pi" | "e") || variables.knows(name)
    };
    if known {
        return None;
    }
    let names = variables.names();
    Some(match name {
        "mod" => "the remainder is written with %".to_owned(),
        "log" => "`log` has two meanings: write ln or log10".to_owned(),
        _ if function => format!("`{name}` is a function: write {name}(…)"),
        _ if called => format!("unknown function `{name}`; known: {KNOWN}"),
        _ => format!("unknown name `{name}`; the coordinates here are {names}"),
    })
}

/// The names in a formula, with their places and whether they are called.
fn names(text: &str) -> Vec<(&str, Range<usize>, bool)> {
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
            let called = text[at..].trim_start().starts_with('(');
            found.push((&text[start..at], start..at, called));
        } else {
            at += 1;
        }
    }
    found
}

/// Room for the instructions of a formula.
pub type Room<'c, F> = Vec<Instruction<'c, Value<F>>>;

/// Room for the instructions of a formula: none needs more than two for a character.
pub fn room<F: Real>(text: &str) -> Room<'_, F> {
    vec![Instruction::default(); 2 * text.len() + 1]
}

/// A compiled formula.
#[derive(Clone, Copy, Debug)]
pub struct Formula<'c, F>(Compiled<'c, F>);

/// A formula by the number of its pending values.
#[derive(Clone, Copy, Debug)]
enum Compiled<'c, F> {
    Few(Program<'c, 'c, Value<F>, FEW>),
    Many(Program<'c, 'c, Value<F>, STACK>),
}

impl<'c, F: Real> Formula<'c, F> {
    /// Compiles a formula into the [`room`] for it.
    pub fn new(
        text: &'c str,
        room: &'c mut [Instruction<'c, Value<F>>],
    ) -> Result<Self, FormulaError> {
        let evaluator = Evaluator::<()>::new(&());
        let few = evaluator.compile::<_, FEW>(text, &mut *room).is_ok();
        let compiled = if few {
            evaluator.compile(text, room).map(Compiled::Few)
        } else {
            evaluator.compile(text, room).map(Compiled::Many)
        };
        compiled.map(Self).map_err(|error| FormulaError {
            span: error.span.start..error.span.end,
            message: error.kind.description().to_owned(),
        })
    }

    /// The value of the formula at (x, y); NaN where it has none.
    #[inline]
    pub fn value(&self, x: &[F], y: &[F]) -> F {
        let at = At { x, y };
        let value = match &self.0 {
            Compiled::Few(program) => program.evaluate(&at),
            Compiled::Many(program) => program.evaluate(&at),
        };
        value.map_or(F::NAN, |value| value.0)
    }

    /// The number of its instructions.
    fn len(&self) -> usize {
        match &self.0 {
            Compiled::Few(program) => program.len(),
            Compiled::Many(program) => program.len(),
        }
    }
}

/// The values of the coordinates.
struct At<'a, F> {
    x: &'a [F],
    y: &'a [F],
}

impl<F: Real> Context<Value<F>> for At<'_, F> {
    #[inline]
    fn variable(&self, name: &str) -> Option<Value<F>> {
        let value = match name.as_bytes() {
            b"x" => self.x.first().copied(),
            b"y" => self.y.first().copied(),
            [b'x', axis @ b'1'..=b'9'] => self.x.get(usize::from(axis - b'1')).copied(),
            [b'y', axis @ b'1'..=b'9'] => self.y.get(usize::from(axis - b'1')).copied(),
            b"pi" => Some(F::from_f64(core::f64::consts::PI)),
            b"e" => Some(F::from_f64(core::f64::consts::E)),
            _ => None,
        };
        value.map(Value)
    }

    #[inline]
    fn call(&self, name: &str, arguments: &[Value<F>]) -> Option<Result<Value<F>, ErrorKind>> {
        let value = match (name, arguments) {
            ("abs", [x]) => x.0.abs(),
            ("sqrt", [x]) => x.0.sqrt(),
            ("exp", [x]) => x.0.exp(),
            ("ln", [x]) => x.0.ln(),
            ("sin", [x]) => x.0.sin(),
            ("cos", [x]) => x.0.cos(),
            ("min", [x, y]) => if_nan_or(x.0, y.0, |x, y| y < x),
            ("max", [x, y]) => if_nan_or(x.0, y.0, |x, y| y > x),
            ("atan2", [x, y]) => x.0.atan2(y.0),
            (_, [x]) => {
                let Some((_, function)) = UNARY.iter().find(|(known, _)| *known == name) else {
                    return Some(Err(ErrorKind::ArgumentCount));
                };
                F::from_f64(function(x.0.to_f64()))
            }
            _ => return Some(Err(ErrorKind::ArgumentCount)),
        };
        Some(Ok(Value(value)))
    }
}

/// The second where it is `better`, or not a number; else the first.
fn if_nan_or<F: Real>(x: F, y: F, better: impl Fn(F, F) -> bool) -> F {
    if y.is_nan() || better(x, y) { y } else { x }
}

/// A number of a formula.
#[derive(Clone, Copy, Debug, Default)]
pub struct Value<F>(F);

impl<F: Real> Number for Value<F> {
    fn parse(literal: &str) -> Option<Self> {
        let value: f64 = literal.parse().ok()?;
        value.is_finite().then(|| Self(F::from_f64(value)))
    }
    #[inline]
    fn add(self, other: Self) -> Result<Self, ErrorKind> {
        Ok(Self(self.0 + other.0))
    }
    #[inline]
    fn subtract(self, other: Self) -> Result<Self, ErrorKind> {
        Ok(Self(self.0 - other.0))
    }
    #[inline]
    fn multiply(self, other: Self) -> Result<Self, ErrorKind> {
        Ok(Self(self.0 * other.0))
    }
    #[inline]
    fn divide(self, other: Self) -> Result<Self, ErrorKind> {
        Ok(Self(self.0 / other.0))
    }
    #[inline]
    fn remainder(self, other: Self) -> Result<Self, ErrorKind> {
        Ok(Self(self.0 % other.0))
    }
    /// Squares and cubes are products: faster, and no less accurate.
    #[inline]
    fn power(self, exponent: Self) -> Result<Self, ErrorKind> {
        let (x, n) = (self.0, exponent.0.to_f64());
        Ok(Self(if n == 2.0 {
            x * x
        } else if n == 3.0 {
            x * x * x
        } else {
            x.pow(exponent.0)
        }))
    }
    #[inline]
    fn negate(self) -> Result<Self, ErrorKind> {
        Ok(Self(-self.0))
    }
    #[inline]
    fn compare(self, other: Self) -> Result<Ordering, ErrorKind> {
        self.0.partial_cmp(&other.0).ok_or(ErrorKind::Domain)
    }
    fn from_bool(value: bool) -> Result<Self, ErrorKind> {
        Ok(Self(if value { F::one() } else { F::zero() }))
    }
}

#[cfg(test)]
mod tests {
    use super::{Formula, KNOWN, Variables, check, room};

    fn value(text: &str, x: &[f64], y: &[f64]) -> f64 {
        let mut room = room(text);
        Formula::new(text, &mut room).unwrap().value(x, y)
    }

    #[test]
    fn formulas_mean_what_they_mean_on_paper() {
        let at = |text| value(text, &[0.3], &[0.8]);
        assert_eq!(at("-x^2"), -(0.3 * 0.3));
        assert_eq!(at("2^3^2"), 512.0);
        assert_eq!(at("1 - 2 - 3"), -4.0);
        assert_eq!(
            at("0.5 / (1 + (x - y)^2)"),
            0.5 / (1.0 + (0.3 - 0.8) * (0.3 - 0.8))
        );
        assert_eq!(at("1.5e-3 * x1"), 1.5e-3 * 0.3);
        assert_eq!(
            at("x < y ? -x * (1 - y) : -y * (1 - x)"),
            -0.3 * (1.0 - 0.8)
        );
        assert_eq!(at("min(x, y) + max(x, y)"), 0.3 + 0.8);
        assert_eq!(
            at("exp(-x) * cos(pi * y)"),
            libm::exp(-0.3) * libm::cos(core::f64::consts::PI * 0.8)
        );
        assert_eq!(value("x2 * y3", &[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0]), 12.0);
        assert!(at("sqrt(-x)").is_nan() && at("ln(x - y)").is_nan());
        assert!(at("min(x, sqrt(-1))").is_nan() && at("max(sqrt(-1), x)").is_nan());
        assert_eq!(at("1 / (x - 0.3)"), f64::INFINITY);
        let deep = format!("{}x{}", "y - (".repeat(12), ")".repeat(12));
        assert_eq!(value(&deep, &[0.25], &[0.5]), 0.25);
        let mut room = room::<f32>("0.1 * x");
        let single = Formula::new("0.1 * x", &mut room).unwrap();
        assert_eq!(single.value(&[0.3], &[]), 0.1_f32 * 0.3);
    }

    #[test]
    fn every_function_that_is_promised_is_there() {
        for word in KNOWN.split([' ', ',']).filter(|word| word.len() > 1) {
            let one = format!("{word}(0.5)");
            let two = format!("{word}(0.5, 0.25)");
            let value = [one, two]
                .into_iter()
                .filter(|text| check(text, Variables::FACTOR).is_ok())
                .map(|text| value(&text, &[0.5], &[0.5]))
                .find(|value| value.is_finite());
            let function = !matches!(
                word,
                "numbers" | "pi" | "comparisons" | "`condition" | "a" | "b`"
            );
            assert_eq!(value.is_some(), function, "{word}");
        }
    }

    #[test]
    fn what_is_wrong_is_shown_where_it_is() {
        let place = |text: &str| {
            let error = check(text, Variables::FACTOR).unwrap_err();
            (text[error.span.clone()].to_owned(), error.message)
        };
        assert_eq!(place("1 + * x").0, "*");
        assert_eq!(place("exp(-x").0, "(");
        assert_eq!(place("x + z").0, "z");
        assert_eq!(place("x < y ? 1 : foo(x)").0, "foo");
        assert_eq!(place("sin + 1").0, "sin");
        assert!(place("log(x)").1.contains("log10"));
        assert!(place("log10").1.contains("write log10(…)"));
        assert_eq!(place("min(x) + 1").1, "`min` takes 2 arguments, not 1");
        assert_eq!(place("sin( )").1, "`sin` takes 1 argument, not 0");
        assert_eq!(place("exp (x, y)").0, "exp");
        // Where no value would show it: in a branch that few points take.
        let hidden = "x < 0.1 ? (y < 0.1 ? x : atan2((x), max(x, y), 1)) : 1";
        assert_eq!(place(hidden).1, "`atan2` takes 2 arguments, not 3");
        // An operator of the library that is none of ours, and would pass for a coordinate.
        assert!(place("mod").1.contains("%") && place("x mod y").1.contains("%"));
        assert_eq!(place("x $ y").0, "$");
        for (text, advice) in [
            ("0.2x", "write 0.2 * x"),
            ("0.5 x y", "write 0.5 * x"),
            ("2(x + y)", "write 2 * (…"),
            ("(x + y) x", "write …) * x"),
        ] {
            assert!(place(text).1.contains(advice), "{text}: {}", place(text).1);
        }
        assert!(!place("1 + * x").1.contains("write"));
        assert!(check("", Variables::FACTOR).is_err());
        // Of two dimensions, and of a function of x alone.
        let plane = Variables {
            dimension: 2,
            two: true,
        };
        assert!(check("x1 * y2", plane).is_ok());
        assert!(
            check("x * y", plane)
                .unwrap_err()
                .message
                .contains("x1 to x2")
        );
        assert!(check("x3", plane).is_err() && check("x0", plane).is_err());
        let one = Variables {
            dimension: 1,
            two: false,
        };
        assert!(check("x + y", one).is_err());
        assert!(check(&"(".repeat(10_000), one).is_err());
        assert!(check(&"x + (".repeat(40), one).is_err());
    }
}
