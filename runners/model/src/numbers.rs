//! Numbers for people, and straight lines through points.

/// Three significant digits.
pub fn short(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 || !x.is_finite() {
        format!("{x}")
    } else if (1e-3..1e5).contains(&size) {
        let decimals = 2 - size.log10().floor() as i32;
        format!("{x:.*}", usize::try_from(decimals).unwrap_or(0))
    } else {
        format!("{x:.2e}")
    }
}

/// A number with at most this many decimals: "0.5", "4", and no zero with a sign.
pub fn with_decimals(x: f64, decimals: usize) -> String {
    let rounded = format!("{x:.decimals$}");
    let short = match rounded.contains('.') {
        true => rounded.trim_end_matches('0').trim_end_matches('.'),
        false => &rounded,
    };
    if short == "-0" { "0" } else { short }.to_owned()
}

/// Below this a number is told by its power of ten.
const SMALL: f64 = 1e-4;

/// A small number by six digits at most and its power of ten, "6.496e-7"; `None` of others, which have decimals.
pub fn by_power(x: f64) -> Option<String> {
    let text = format!("{x:.5e}");
    let (digits, power) = text.split_once('e')?;
    let digits = digits.trim_end_matches('0').trim_end_matches('.');
    (x != 0.0 && x.abs() < SMALL).then(|| format!("{digits}e{power}"))
}

/// A value and its standard error, with two digits of the latter: `5.997 ± 0.024`.
pub fn with_error(value: f64, error: Option<f64>) -> String {
    match error {
        None => "nothing scored".to_owned(),
        Some(error) if error > 0.0 && error.is_finite() => {
            let decimals = 1 - error.log10().floor() as i32;
            let power = value.abs().log10().floor() as i32;
            if decimals > 7 && value.abs() < SMALL && value.abs() > error {
                let digits = usize::try_from(decimals + power).unwrap_or(0);
                format!("{value:.digits$e} ± {error:.1e}")
            } else if decimals > 7 {
                format!("{value:.*} ± {error:.1e}", decimals.min(15) as usize)
            } else {
                let decimals = usize::try_from(decimals).unwrap_or(0);
                format!("{value:.decimals$} ± {error:.decimals$}")
            }
        }
        Some(error) => format!("{value} ± {error}"),
    }
}

/// The slope of the least-squares line through the points; `None` for fewer than two abscissas.
pub fn slope(points: impl Iterator<Item = (f64, f64)> + Clone) -> Option<f64> {
    let n = points.clone().count() as f64;
    let (sx, sy) = points
        .clone()
        .fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
    let (mx, my) = (sx / n, sy / n);
    let (xx, xy) = points.fold((0.0, 0.0), |(xx, xy), (x, y)| {
        (xx + (x - mx) * (x - mx), xy + (x - mx) * (y - my))
    });
    (xx > 0.0)
        .then(|| xy / xx)
        .filter(|slope| slope.is_finite())
}

/// Lines whose columns are as wide as their widest entry; the first column is left-aligned, the
/// others right-aligned.
pub fn aligned(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (column, (cell, width)) in row.iter().zip(&widths).enumerate() {
            if column == 0 {
                line += &format!("{cell:<width$}");
            } else {
                line += &format!("  {cell:>width$}");
            }
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

/// The sum of numbers, of which rounding leaves no more than of one of them (Neumaier 1974).
pub fn sum(terms: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut lost) = (0.0_f64, 0.0);
    for term in terms {
        let next = sum + term;
        lost += if sum.abs() >= term.abs() {
            (sum - next) + term
        } else {
            (term - next) + sum
        };
        sum = next;
    }
    sum + lost
}

/// The normal distribution's quantile of 95 % on both sides.
pub const NORMAL: f64 = 1.959_964;

/// Student's quantile of 95 % with so many degrees of freedom, over that of the normal distribution: an error bar of few counts for as
/// much as its interval is wider. The expansion of Cornish and Fisher, 3 % too small at 2.
#[must_use]
pub fn widening(freedom: f64) -> f64 {
    1.0 + excess(NORMAL, freedom) / NORMAL
}

/// Student's quantile with so many degrees of freedom less z, that of the normal distribution, by the expansion of Cornish and Fisher.
fn excess(z: f64, freedom: f64) -> f64 {
    let first = (z.powi(3) + z) / 4.0;
    let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
    let third = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0;
    (first + (second + third / freedom) / freedom) / freedom
}

/// The number of standard errors that contain so many normal deviations at once with this probability, whatever their correlations
/// (Šidák 1967); of Student's deviations with degrees of freedom.
///
/// ```
/// use fredholm_model::numbers::simultaneous;
///
/// assert!((simultaneous(0.95, 1, None) - 1.959_964).abs() < 1e-6);
/// assert!((simultaneous(0.95, 100, None) - 3.473_979).abs() < 1e-6);
/// assert!(simultaneous(0.95, 100, Some(63.0)) > 3.6);
/// ```
#[must_use]
pub fn simultaneous(level: f64, count: usize, freedom: Option<f64>) -> f64 {
    // That is 1 − level^(1/count) without cancellation.
    let outside = -(level.ln() / count.max(1) as f64).exp_m1();
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if libm::erfc(middle / core::f64::consts::SQRT_2) > outside {
            low = middle;
        } else {
            high = middle;
        }
    }
    freedom.map_or(high, |freedom| high + excess(high, freedom))
}

/// Σ a b over as many numbers as both have, in four sums, which the compiler may take at once.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a4, a) = a.as_chunks::<4>();
    let (b4, b) = b.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (a, b) in a4.iter().zip(b4) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    let rest: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// ‖v‖∞ of a vector in the walk's scalar.
pub fn largest<F: fredholm_core::Real>(v: &[F]) -> f64 {
    v.iter().fold(0.0, |m: f64, v| m.max(v.to_f64().abs()))
}

#[cfg(test)]
mod tests {
    use super::{aligned, by_power, short, slope, with_decimals, with_error};

    #[test]
    fn digits() {
        assert_eq!(short(0.0), "0");
        assert_eq!(short(7.7621), "7.76");
        assert_eq!(short(-0.0364), "-0.0364");
        assert_eq!(short(9.731e-5), "9.73e-5");
        assert_eq!(short(123_456.0), "1.23e5");
        assert_eq!(with_error(5.99713, Some(0.0241)), "5.997 ± 0.024");
        assert_eq!(
            with_error(5.9971312345, Some(3.14e-9)),
            "5.9971312345 ± 3.1e-9"
        );
        assert_eq!(with_error(8.837e-9, Some(2.1e-11)), "8.837e-9 ± 2.1e-11");
        assert_eq!(with_error(8e-9, Some(2.1e-8)), "0.000000008 ± 2.1e-8");
        assert_eq!(
            [0.0, 0.310_525_28, -6.496e-7, 2e-6].map(by_power),
            [None, None, Some("-6.496e-7".into()), Some("2e-6".into())]
        );
        assert_eq!(with_error(599.0, Some(24.0)), "599 ± 24");
        assert_eq!(with_error(1.0, None), "nothing scored");
        assert_eq!(with_error(1.5, Some(0.0)), "1.5 ± 0");
    }

    #[test]
    fn decimals_end_where_they_say_nothing() {
        assert_eq!(with_decimals(0.25, 6), "0.25");
        assert_eq!(with_decimals(4.0, 9), "4");
        assert_eq!(with_decimals(-1e-9, 6), "0");
        assert_eq!(with_decimals(100.0, 0), "100");
        assert_eq!(with_decimals(2.0 / 3.0, 3), "0.667");
    }

    #[test]
    fn a_line_has_its_slope() {
        let points = [(1.0, 5.0), (2.0, 3.0), (3.0, 1.0)];
        assert_eq!(slope(points.into_iter()), Some(-2.0));
        assert_eq!(slope([(1.0, 5.0)].into_iter()), None);
        assert_eq!(
            slope([(1.0, 5.0), (2.0, f64::NEG_INFINITY)].into_iter()),
            None
        );
    }

    #[test]
    fn columns_line_up() {
        let rows = [
            vec!["a".into(), "10".into()],
            vec!["long".into(), "1".into()],
        ];
        assert_eq!(aligned(&rows), "a     10\nlong   1\n");
    }
}
