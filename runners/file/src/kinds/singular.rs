//! Kernels c(x) |x − y|^−a and c(x) ln |x − y|, typed as they are: their integral is known.

/// The integral over y of a kernel of one axis, from wherever it begins, if the formula is a product of a function of x
/// alone, and one power or logarithm of |x − y|. It is the formula that says so, and no value of it: what is integrated
/// is the kernel.
pub(super) fn integral(kernel: &str) -> Option<String> {
    let text: String = kernel.split_whitespace().collect();
    // A value at x = y is met by no walk.
    let text = match text.split_once(':') {
        Some((before, rest)) => before
            .strip_prefix("x==y?")
            .and_then(|value| is_simple(value).then_some(rest))?,
        None => &text,
    };
    let text = in_parentheses(text).unwrap_or(text);
    let factors = factors(text)?;
    let mut singular = None;
    let mut others = String::from("1");
    for (operator, factor) in factors {
        match (Singularity::of(operator, factor), has_y(factor)) {
            (Some(found), _) if singular.is_none() => singular = Some(found),
            (_, false) => others = format!("{others}{operator}{factor}"),
            _ => return None,
        }
    }
    Some(singular?.integral(&others))
}

/// What is singular at x = y.
enum Singularity {
    /// |x − y|^−a, with a as it is written.
    Power(f64),
    /// ln |x − y|.
    Logarithm,
}

impl Singularity {
    /// The singularity of a factor that others are multiplied with or divided by.
    fn of(operator: char, factor: &str) -> Option<Self> {
        let factor = in_parentheses(factor).unwrap_or(factor);
        if operator == '*'
            && factor
                .strip_prefix("ln(")
                .and_then(|f| f.strip_suffix(')'))
                .is_some_and(is_distance)
        {
            return Some(Self::Logarithm);
        }
        let (distance, exponent) = factor.split_once('^')?;
        let exponent: f64 = in_parentheses(exponent).unwrap_or(exponent).parse().ok()?;
        let a = if operator == '*' { -exponent } else { exponent };
        (is_distance(distance) && a > 0.0 && a < 1.0).then_some(Self::Power(a))
    }

    /// The formula of the integral over y of the singular factor times others.
    fn integral(&self, others: &str) -> String {
        match self {
            Self::Power(a) => {
                let left = 1.0 - a;
                format!("({others})*sign(y-x)*abs(y-x)^{left}/{left}")
            }
            Self::Logarithm => format!("({others})*(y==x?0:(y-x)*(ln(abs(y-x))-1))"),
        }
    }
}

fn is_distance(text: &str) -> bool {
    matches!(text, "abs(x-y)" | "abs(y-x)" | "abs(x1-y1)" | "abs(y1-x1)")
}

/// Whether a text is a number or a name.
fn is_simple(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '.')
}

/// Whether y is in a formula, as a name of its own or with a number.
fn has_y(text: &str) -> bool {
    text.contains('y')
}

/// What is between the parentheses around a text, if one pair is around all of it.
fn in_parentheses(text: &str) -> Option<&str> {
    let inner = text.strip_prefix('(')?.strip_suffix(')')?;
    let mut depth = 0_i32;
    for c in inner.chars() {
        depth += step(c);
        if depth < 0 {
            return None;
        }
    }
    (depth == 0).then_some(inner)
}

const fn step(c: char) -> i32 {
    match c {
        '(' => 1,
        ')' => -1,
        _ => 0,
    }
}

/// The factors of a product, with "*" or "/" before each; `None` if a text is no product. A sign before it is a factor.
fn factors(text: &str) -> Option<Vec<(char, &str)>> {
    let mut all = Vec::new();
    let (text, sign) = match text.strip_prefix('-') {
        Some(rest) => (rest, Some(('*', "(-1)"))),
        None => (text, None),
    };
    all.extend(sign);
    let (mut depth, mut begin, mut operator, mut before) = (0_i32, 0, '*', '*');
    for (at, c) in text.char_indices() {
        depth += step(c);
        if depth == 0 {
            match c {
                '*' | '/' => {
                    all.push((operator, text.get(begin..at)?));
                    (operator, begin) = (c, at + 1);
                }
                // A sign of an exponent or of a number such as 1e-3.
                '+' | '-' if before == '^' || before == 'e' && is_number(text.get(begin..at)?) => {}
                '+' | '-' | '%' | '<' | '>' | '=' | '!' | '?' | ':' | ',' | '&' | '|' => {
                    return None;
                }
                _ => {}
            }
        }
        before = c;
    }
    all.push((operator, text.get(begin..)?));
    let is_whole = all.iter().all(|(_, factor)| !factor.is_empty());
    (depth == 0 && is_whole).then_some(all)
}

/// Whether a text is a number up to its exponent: "1e", "2.5e".
fn is_number(text: &str) -> bool {
    text.strip_suffix('e').is_some_and(|digits| {
        !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit() || c == '.')
    })
}

#[cfg(test)]
mod tests {
    use super::integral;
    use fredholm_formula::{Formula, room};

    fn value(text: &str, x: f64, y: f64) -> f64 {
        Formula::new(text, &mut room::<f64>(text))
            .unwrap()
            .value(&[x], &[y])
    }

    /// Differences of the integral are those of a fine midpoint rule, on both sides of x.
    #[test]
    fn integrals_are_those_of_the_kernels() {
        for kernel in [
            "0.3*abs(x-y)^-0.3",
            "0.3 * abs(y - x)^(-0.3)",
            "x == y ? 0 : 0.3 * abs(x - y)^-0.3",
            "-(1+x)*abs(x-y)^-0.45/2",
            "0.2/abs(x-y)^0.4",
            "cos(3*x)*(abs(x-y)^-0.25)*1e-1",
            "0.1*ln(abs(x-y))",
            "(-0.1*ln(abs(x-y)))",
        ] {
            let found = integral(kernel).unwrap_or_else(|| panic!("{kernel}"));
            for (x, low, high) in [(0.3, 0.4, 0.9), (0.3, 0.05, 0.2), (0.8, 0.1, 0.7)] {
                let n = 20_000;
                let y = |i: usize| low + (high - low) * (i as f64 + 0.5) / n as f64;
                let sum: f64 = (0..n).map(|i| value(kernel, x, y(i))).sum();
                let expected = sum * (high - low) / n as f64;
                let found = value(&found, x, high) - value(&found, x, low);
                assert!(
                    (found - expected).abs() < 1e-7,
                    "{kernel}: {found}, {expected}"
                );
            }
        }
    }

    #[test]
    fn nothing_else_is_taken_for_one() {
        for kernel in [
            "abs(x-y)^-0.3+0.1",
            "0.3*abs(x-y)^-0.3*(1+y)",
            "0.3*abs(x-y)^-1.3",
            "0.3*abs(x-y)^0.3",
            "0.3*abs(x-y)^-0.3*abs(x-y)^-0.1",
            "x < y ? 1 : abs(x-y)^-0.3",
            "x == y ? 0 : x < 0.5 ? 1 : abs(x-y)^-0.3",
            "abs(x-y)^-0.3^2",
            "2^abs(x-y)^-0.3",
            "abs(x-2*y)^-0.3",
            "1+x*abs(x-y)^-0.3",
            "exp(-(x-y)^2)",
            "x-abs(x-y)^-0.3",
            "max(1,2)*(1+y)*abs(x-y)^-0.3",
        ] {
            assert_eq!(integral(kernel), None, "{kernel}");
        }
    }
}
