//! Formulas of kernels, sources and weights on cubes: text that is parsed once and evaluated in the walks.
//!
//! A formula has the same bits on every machine, since its functions are those of `libm`.
//!
//! ```
//! use fredholm_file::formula::{Formula, Variables, check};
//!
//! let text = "0.5 / (1 + (x - y)^2)";
//! assert!(check(text, Variables::FACTOR).is_ok());
//!
//! let kernel = Formula::new(text, &[]).unwrap();
//! assert_eq!(kernel.value(&[0.25], &[1.25]), 0.25);
//!
//! // An error has a place and says what would be right.
//! let error = check("0.5 x", Variables::FACTOR).unwrap_err();
//! assert!(error.message.contains("write 0.5 * x"));
//! ```

mod check;
mod compiled;
mod dual;
mod plain;
mod special;

use core::cmp::Ordering;
use core::ops::Range;

use fredholm_core::Real;
use nanoexpr::{Context, ErrorKind, Number};

pub use check::{check, constant, occurrences};
pub use dual::Slope;
pub use plain::{Parameter, Plain};

use compiled::Compiled;
use special::{bessel_i, bessel_k, exponential_integral};

/// The words of formulas, for messages.
pub const KNOWN: &str = "numbers, pi, e, + - * / % ^, comparisons, `condition ? a : b`, |a|, abs, \
     sign, min, max, sqrt, cbrt, exp, ln, log10, sin, cos, tan, asin, acos, atan, atan2, sinh, cosh, \
     tanh, floor, ceil, erf, erfc, gamma, lgamma, E1, E2, E3, J0, J1, Y0, Y1, I0, I1, K0, K1";

type Unary = (&'static str, fn(f64) -> f64);

/// The functions of one argument, in f64: single precision rounds what they give.
const UNARY: [Unary; 27] = [
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
    ("erf", libm::erf),
    ("erfc", libm::erfc),
    ("gamma", libm::tgamma),
    ("lgamma", libm::lgamma),
    ("E1", exponential_integral::<1>),
    ("E2", exponential_integral::<2>),
    ("E3", exponential_integral::<3>),
    ("J0", libm::j0),
    ("J1", libm::j1),
    ("Y0", libm::y0),
    ("Y1", libm::y1),
    ("I0", bessel_i::<0>),
    ("I1", bessel_i::<1>),
    ("K0", bessel_k::<0>),
    ("K1", bessel_k::<1>),
];
/// The number of them that are elementary.
const ELEMENTARY: usize = 12;
/// The functions that a call looks up first.
const FAST: [&str; 6] = ["abs", "sqrt", "exp", "ln", "sin", "cos"];
/// The functions of two arguments.
const TWO: [&str; 3] = ["min", "max", "atan2"];

/// Whether a name is that of a function.
fn is_function(name: &str) -> bool {
    FAST.contains(&name) || TWO.contains(&name) || UNARY.iter().any(|(known, _)| *known == name)
}

fn sign(x: f64) -> f64 {
    if x == 0.0 { x } else { x.signum() }
}

/// Which names a formula may use besides functions and constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variables<'p> {
    /// d: with 1 the coordinates are x and y (and x1, y1), with more x1 … xd, y1 … yd; with 0 there are none.
    pub dimension: usize,
    /// Whether y is there.
    pub two: bool,
    /// Numbers with names of their own.
    pub parameters: &'p [Parameter],
}

impl Variables<'_> {
    /// x and y on one axis.
    pub const FACTOR: Variables<'static> = Variables {
        dimension: 1,
        two: true,
        parameters: &[],
    };

    fn knows(self, name: &str) -> bool {
        if self.parameters.iter().any(|own| own.name == name) {
            return true;
        }
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

    /// "the coordinates here are x1 to x3 and y1 to y3, the parameters a, b".
    fn names(self) -> String {
        let of = |letter: &str| match self.dimension {
            1 => letter.to_owned(),
            d => format!("{letter}1 to {letter}{d}"),
        };
        let coordinates = match (self.dimension, self.two) {
            (0, _) => "there are no coordinates here".to_owned(),
            (_, true) => format!("the coordinates here are {} and {}", of("x"), of("y")),
            (_, false) => format!("the coordinates here are {}", of("x")),
        };
        let parameters: Vec<&str> = self
            .parameters
            .iter()
            .map(|own| own.name.as_str())
            .collect();
        match parameters.as_slice() {
            [] => coordinates,
            names => format!("{coordinates}, the parameters {}", names.join(", ")),
        }
    }
}

/// Why a name cannot be that of a parameter, if so: it has another meaning in formulas.
///
/// ```
/// use fredholm_file::formula::refused_name;
///
/// assert!(refused_name("sigma").is_none());
/// assert!(refused_name("exp").unwrap().contains("a function"));
/// ```
pub fn refused_name(name: &str) -> Option<String> {
    let coordinate = Variables {
        dimension: usize::MAX,
        ..Variables::FACTOR
    };
    let mut letters = name.chars();
    let is_name = letters
        .next()
        .is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
        && letters.all(plain::is_word);
    let meaning = match name {
        _ if !is_name => {
            return Some(
                "a name has letters from a to z, digits and `_`, and no digit first".to_owned(),
            );
        }
        _ if plain::constant(name).is_some() => "a constant",
        "mod" | "if" | "then" | "else" | "and" | "or" | "not" => "a word",
        "x" | "y" => "a coordinate",
        _ if coordinate.knows(name) => "a coordinate",
        _ if is_function(name) => "a function",
        _ => return None,
    };
    Some(format!(
        "`{name}` is {meaning} of formulas: use another name"
    ))
}

/// Seconds of an instruction, and of a call of an elementary function, of another and of a power besides, on the machines this was
/// measured on.
const INSTRUCTION: f64 = 3e-9;
const CALL: f64 = 15e-9;
const SPECIAL: f64 = 200e-9;
const POWER: f64 = 45e-9;

/// An error in a formula, and its place there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FormulaError {
    /// These bytes of it.
    pub span: Range<usize>,
    /// The message.
    pub message: String,
}

/// A compiled formula.
pub struct Formula<F: Real>(Compiled<Value<F>>);

impl<F: Real> core::fmt::Debug for Formula<F> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_tuple("Formula").field(&self.0.text()).finish()
    }
}

impl<F: Real> Formula<F> {
    /// Compiles a formula as it is typed, with these numbers by their names.
    ///
    /// # Errors
    /// What is wrong with it: [`check`] says more.
    pub fn new(typed: &str, parameters: &[Parameter]) -> Result<Self, FormulaError> {
        let plain = Plain::new(typed, parameters)?;
        Self::compiled(&plain).map_err(|error| FormulaError {
            span: plain.typed(error.span.start..error.span.end),
            message: error.kind.description().to_owned(),
        })
    }

    fn compiled(plain: &Plain) -> Result<Self, nanoexpr::Error> {
        Compiled::of(plain.text().to_owned()).map(Self)
    }

    /// The value of the formula at (x, y); NaN where it has none.
    #[inline]
    pub fn value(&self, x: &[F], y: &[F]) -> F {
        self.0.value(&At { x, y }).map_or(F::NAN, |value| value.0)
    }

    /// About how many seconds a value takes.
    pub fn seconds(&self) -> f64 {
        seconds(self.0.text(), self.0.len())
    }
}

/// About how many seconds a value takes of a plain text with so many instructions.
fn seconds(text: &str, instructions: usize) -> f64 {
    let is_special = |name: &str| {
        UNARY
            .iter()
            .skip(ELEMENTARY)
            .any(|(known, _)| *known == name)
    };
    let calls = check::names(text).into_iter().filter(|name| name.is_called);
    let calls = calls.map(|name| if is_special(name.text) { SPECIAL } else { CALL });
    // Squares and cubes are products.
    let is_power = |exponent: &&str| {
        let number = exponent.trim_start();
        let rest = number.trim_start_matches(|c: char| c.is_alphanumeric() || c == '.');
        !matches!(&number[..number.len() - rest.len()], "2" | "3")
    };
    let powers = text.split('^').skip(1).filter(is_power).count();
    instructions as f64 * INSTRUCTION + calls.sum::<f64>() + powers as f64 * POWER
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
    use super::{Formula, KNOWN, Variables, check};

    fn value(text: &str, x: &[f64], y: &[f64]) -> f64 {
        Formula::new(text, &[]).unwrap().value(x, y)
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
        let single = Formula::<f32>::new("0.1 * x", &[]).unwrap();
        assert_eq!(single.value(&[0.3], &[]), 0.1_f32 * 0.3);
        let single = Formula::<f32>::new("E1(x)", &[]).unwrap();
        assert_eq!(
            single.value(&[1.0], &[]),
            0.219_383_934_395_520_3_f64 as f32
        );
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
                "numbers" | "pi" | "comparisons" | "`condition" | "b`" | "|a|"
            );
            assert_eq!(value.is_some(), function, "{word}");
        }
    }
}
