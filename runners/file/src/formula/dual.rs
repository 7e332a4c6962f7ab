//! Formulas with their derivatives with respect to a parameter, by dual numbers.

use core::cmp::Ordering;

use nanoexpr::{Context, ErrorKind, Number};

use super::check::names;
use super::compiled::Compiled;
use super::special::{bessel_i, bessel_k, exponential_integral};
use super::{At, FormulaError, Parameter, Plain, Value};

/// A number and its derivative with respect to the parameter.
#[derive(Clone, Copy, Debug, Default)]
struct Dual {
    value: f64,
    slope: f64,
}

impl Dual {
    /// What does not depend on the parameter.
    const fn constant(value: f64) -> Self {
        Self { value, slope: 0.0 }
    }

    /// A function of this number, by its value and its derivative.
    fn mapped(self, value: f64, derivative: f64) -> Self {
        // What does not depend on the parameter may have no derivative here.
        let slope = if self.slope == 0.0 {
            0.0
        } else {
            derivative * self.slope
        };
        Self { value, slope }
    }
}

impl Number for Dual {
    fn parse(literal: &str) -> Option<Self> {
        let value: f64 = literal.parse().ok()?;
        value.is_finite().then(|| Self::constant(value))
    }

    fn add(self, other: Self) -> Result<Self, ErrorKind> {
        Ok(Self {
            value: self.value + other.value,
            slope: self.slope + other.slope,
        })
    }

    fn subtract(self, other: Self) -> Result<Self, ErrorKind> {
        Ok(Self {
            value: self.value - other.value,
            slope: self.slope - other.slope,
        })
    }

    fn multiply(self, other: Self) -> Result<Self, ErrorKind> {
        Ok(Self {
            value: self.value * other.value,
            slope: self.slope * other.value + self.value * other.slope,
        })
    }

    fn divide(self, other: Self) -> Result<Self, ErrorKind> {
        let value = self.value / other.value;
        Ok(Self {
            value,
            slope: (self.slope - value * other.slope) / other.value,
        })
    }

    /// x − n y with n = ⌊x/y⌋ towards 0, which jumps where n does.
    fn remainder(self, other: Self) -> Result<Self, ErrorKind> {
        let whole = (self.value / other.value).trunc();
        let is_fixed = self.slope == 0.0 && other.slope == 0.0;
        Ok(Self {
            value: self.value % other.value,
            slope: if is_fixed {
                0.0
            } else {
                self.slope - whole * other.slope
            },
        })
    }

    fn power(self, exponent: Self) -> Result<Self, ErrorKind> {
        let plain = Value(self.value).power(Value(exponent.value))?;
        let by_base = self.mapped(
            plain.0,
            exponent.value * libm::pow(self.value, exponent.value - 1.0),
        );
        let by_exponent = exponent.mapped(plain.0, plain.0 * libm::log(self.value));
        Ok(Self {
            value: plain.0,
            slope: by_base.slope + by_exponent.slope,
        })
    }

    fn negate(self) -> Result<Self, ErrorKind> {
        Ok(Self {
            value: -self.value,
            slope: -self.slope,
        })
    }

    /// Where the parameter moves what is compared it moves a jump, of which a derivative at a point says nothing.
    fn compare(self, other: Self) -> Result<Ordering, ErrorKind> {
        if self.slope != other.slope {
            return Err(ErrorKind::Domain);
        }
        Value(self.value).compare(Value(other.value))
    }

    fn from_bool(value: bool) -> Result<Self, ErrorKind> {
        Ok(Self::constant(f64::from(u8::from(value))))
    }
}

/// The derivative of a function of one argument; NaN of one that has none.
fn derivative(name: &str, x: f64, value: f64) -> f64 {
    match name {
        "abs" => super::sign(x),
        "sqrt" => 0.5 / value,
        "exp" => value,
        "sinh" => libm::cosh(x),
        "ln" => 1.0 / x,
        "sin" => libm::cos(x),
        "cos" => -libm::sin(x),
        "cbrt" => 1.0 / (3.0 * value * value),
        "log10" => 1.0 / (x * core::f64::consts::LN_10),
        "tan" => 1.0 + value * value,
        "asin" => 1.0 / libm::sqrt(1.0 - x * x),
        "acos" => -1.0 / libm::sqrt(1.0 - x * x),
        "atan" => 1.0 / (1.0 + x * x),
        "cosh" => libm::sinh(x),
        "tanh" => 1.0 - value * value,
        "erf" => core::f64::consts::FRAC_2_SQRT_PI * libm::exp(-x * x),
        "erfc" => -core::f64::consts::FRAC_2_SQRT_PI * libm::exp(-x * x),
        "E1" => -libm::exp(-x) / x,
        "E2" => -exponential_integral::<1>(x),
        "E3" => -exponential_integral::<2>(x),
        "J0" => -libm::j1(x),
        "J1" => libm::j0(x) - value / x,
        "Y0" => -libm::y1(x),
        "Y1" => libm::y0(x) - value / x,
        "I0" => bessel_i::<1>(x),
        "I1" => bessel_i::<0>(x) - value / x,
        "K0" => -bessel_k::<1>(x),
        "K1" => -bessel_k::<0>(x) - value / x,
        _ => f64::NAN,
    }
}

/// The values of the coordinates and of the parameter.
struct DualAt<'a> {
    at: At<'a, f64>,
    name: &'a str,
    value: f64,
}

impl Context<Dual> for DualAt<'_> {
    fn variable(&self, name: &str) -> Option<Dual> {
        if name == self.name {
            let value = self.value;
            return Some(Dual { value, slope: 1.0 });
        }
        self.at.variable(name).map(|own| Dual::constant(own.0))
    }

    fn call(&self, name: &str, arguments: &[Dual]) -> Option<Result<Dual, ErrorKind>> {
        let values = |all: &[Dual]| {
            self.at.call(
                name,
                &all.iter().map(|own| Value(own.value)).collect::<Vec<_>>(),
            )
        };
        let value = match values(arguments)? {
            Ok(value) => value.0,
            Err(error) => return Some(Err(error)),
        };
        Some(Ok(match (name, arguments) {
            // Of two that are equal the first is taken.
            ("min" | "max", [x, y]) => {
                let slope = if value == x.value { x.slope } else { y.slope };
                Dual { value, slope }
            }
            ("atan2", [y, x]) => {
                let square = x.value * x.value + y.value * y.value;
                let slope = (x.value * y.slope - y.value * x.slope) / square;
                Dual { value, slope }
            }
            (_, [x]) => x.mapped(value, derivative(name, x.value, value)),
            _ => return Some(Err(ErrorKind::ArgumentCount)),
        }))
    }
}

/// A text with a formula in the place of a name.
fn replaced(text: &str, name: &str, formula: &str) -> String {
    let (mut found, mut from) = (String::new(), 0);
    for own in names(text).iter().filter(|own| own.text == name) {
        found += text.get(from..own.span.start).unwrap_or_default();
        found += &format!("({formula})");
        from = own.span.end;
    }
    found + text.get(from..).unwrap_or_default()
}

/// A formula with its derivative with respect to a parameter.
///
/// ```
/// use fredholm_file::formula::{Parameter, Slope};
///
/// let a = Parameter::new("a", 0.5);
/// let kernel = Slope::new("a * exp(-a * |x - y|)", &[a], 0).unwrap();
/// let [value, slope] = kernel.value(&[0.25], &[1.25]);
/// assert!((value - 0.5 * (-0.5_f64).exp()).abs() < 1e-15);
/// assert!((slope - 0.5 * (-0.5_f64).exp()).abs() < 1e-15);
/// ```
pub struct Slope {
    formula: Compiled<Dual>,
    name: String,
    value: f64,
}

impl core::fmt::Debug for Slope {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Slope")
            .field("parameter", &self.name)
            .finish_non_exhaustive()
    }
}

impl Slope {
    /// Compiles a formula as it is typed, for its derivative with respect to the parameter of this number.
    ///
    /// # Errors
    /// What is wrong with it; there is no such parameter.
    pub fn new(typed: &str, parameters: &[Parameter], number: usize) -> Result<Self, FormulaError> {
        let wrong = |message: &str| FormulaError {
            span: 0..typed.len(),
            message: message.to_owned(),
        };
        let own = parameters.get(number);
        let own = own.ok_or_else(|| wrong("there is no such parameter"))?;
        // What is given by the parameter stands as its formula.
        let mut text = typed.to_owned();
        for other in parameters.iter().skip(number + 1).rev() {
            if let Some(formula) = &other.formula {
                text = replaced(&text, &other.name, formula);
            }
        }
        let others = parameters.iter().filter(|other| other.name != own.name);
        let plain = Plain::new(&text, &others.cloned().collect::<Vec<_>>())?;
        let formula = Compiled::of(plain.text().to_owned());
        Ok(Self {
            formula: formula.map_err(|error| wrong(error.kind.description()))?,
            name: own.name.clone(),
            value: own.value,
        })
    }

    /// The value at (x, y) and its derivative; NaN where there is none, as where the parameter moves a jump.
    #[must_use]
    pub fn value(&self, x: &[f64], y: &[f64]) -> [f64; 2] {
        let at = DualAt {
            at: At { x, y },
            name: &self.name,
            value: self.value,
        };
        let found = self.formula.value(&at);
        found.map_or([f64::NAN; 2], |own| [own.value, own.slope])
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Formula, UNARY};
    use super::{Parameter, Slope};

    fn both(text: &str, value: f64) -> [[f64; 2]; 2] {
        let a = |value: f64| [Parameter::new("a", value)];
        const STEP: f64 = 1e-5;
        let at = |value: f64| Formula::new(text, &a(value)).unwrap().value(&[0.3], &[0.8]);
        let difference = (at(value + STEP) - at(value - STEP)) / (2.0 * STEP);
        let own = Slope::new(text, &a(value), 0).unwrap();
        [own.value(&[0.3], &[0.8]), [at(value), difference]]
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let texts = [
            "a * x + y / a",
            "(a + x) % 0.4",
            "a^3",
            "x^a",
            "a^a",
            "2^(a * y)",
            "-a^2",
            "|x - a|",
            "min(a, x)",
            "max(a * y, x)",
            "atan2(a, x)",
            "atan2(x, a)",
            "x < y ? a * x : y",
            "sqrt(a) + exp(a) * ln(a)",
            "sin(a) / cos(a)",
        ];
        let named = UNARY.iter().map(|(name, _)| *name);
        let smooth =
            named.filter(|name| !["floor", "ceil", "sign", "gamma", "lgamma"].contains(name));
        let named = smooth.map(|name| format!("{name}(a * (x + y))"));
        for text in texts.map(str::to_owned).into_iter().chain(named) {
            for value in [0.35, 0.7] {
                let [own, [plain, difference]] = both(&text, value);
                assert_eq!(own[0], plain, "{text}");
                assert!(
                    (own[1] - difference).abs() < 1e-7 * (1.0 + difference.abs()),
                    "{text}: {own:?} {difference}"
                );
            }
        }
    }

    #[test]
    fn what_follows_from_a_parameter_moves_with_it() {
        let b = Parameter {
            formula: Some("2 * a".to_owned()),
            ..Parameter::new("b", 1.0)
        };
        let c = Parameter {
            formula: Some("b^2".to_owned()),
            ..Parameter::new("c", 1.0)
        };
        let all = [Parameter::new("a", 0.5), b, c];
        let of = |text, number| Slope::new(text, &all, number).unwrap().value(&[3.0], &[])[1];
        assert_eq!(
            [of("c * x", 0), of("b + x", 0), of("a", 0)],
            [12.0, 2.0, 1.0]
        );
        assert_eq!(of("c * x", 1), 6.0);
    }

    #[test]
    fn what_has_no_derivative_is_none() {
        for text in ["x < a ? 1 : 2", "gamma(a)", "floor(a)"] {
            assert!(both(text, 0.35)[0][1].is_nan(), "{text}");
        }
        // They may stand beside.
        assert_eq!(
            both("a * gamma(x) + floor(x)", 0.35)[0][1],
            libm::tgamma(0.3)
        );
    }
}
