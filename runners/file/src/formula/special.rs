//! Exponential integrals and modified Bessel functions, by `libm`'s elementary functions alone.
//!
//! `libm` has erf, erfc, Γ, ln Γ, J and Y. Crates that have the others call the platform's exp and ln, whose last bits depend on the
//! system and on the processor, and results may not. So they are here: series and a continued fraction of the Digital Library of
//! Mathematical Functions (dlmf.nist.gov), and for K a trapezoidal rule, all of them sums of positive terms or nearly so. Relative errors
//! at 400 points from 1e-6 to 200 each were at most 8e-15 of E, 2e-15 of I and 6e-15 of K; of `libm`'s at most 1e-15, but 1e-14 beside a
//! zero of J₀.

/// Euler's γ.
const EULER: f64 = 0.577_215_664_901_532_9;
/// Terms of a series are left out from here on, relative to the sum.
const LEAST: f64 = 1e-17;
/// The most terms of a series, and steps of a continued fraction: what is not a number ends, too.
const MOST: u32 = 500;
/// From here on the asymptotic series of I is exact to all digits.
const FAR: f64 = 30.0;
/// The step of the trapezoidal rule, and its number of points: its error is e^(−2π√(2x)/h) beside a pole and e^(−(π/h)²).
const STEP: f64 = 0.3;
const POINTS: u32 = 21;

/// Σ of terms, each from the one before and its number, which is 1 for the second.
fn series(first: f64, next: impl Fn(f64, f64) -> f64) -> f64 {
    let (mut sum, mut term) = (first, first);
    for k in 1..MOST {
        term = next(term, f64::from(k));
        sum += term;
        if !(term.abs() > LEAST * sum.abs()) {
            break;
        }
    }
    sum
}

/// E_n(x) = ∫₁^∞ e^(−xt) t^(−n) dt, n from 1 to 3; not a number for x < 0.
pub(crate) fn exponential_integral<const N: u32>(x: f64) -> f64 {
    let n = f64::from(N);
    if x == 0.0 && N > 1 {
        return 1.0 / (n - 1.0);
    }
    if !(x > 0.0) {
        return if x == 0.0 { f64::INFINITY } else { f64::NAN };
    }
    if x <= 1.0 {
        // DLMF 6.6.2: −γ − ln x + Σ (−1)^(k+1) x^k/(k k!), and 8.19.12 from there.
        let (mut sum, mut power) = (0.0, 1.0);
        for k in 1..30 {
            let k = f64::from(k);
            power *= -x / k;
            sum -= power / k;
        }
        let first = sum - EULER - libm::log(x);
        return (1..N).fold(first, |before, n| {
            (libm::exp(-x) - x * before) / f64::from(n)
        });
    }
    // DLMF 8.19.17, contracted, by Lentz' method.
    let mut b = x + n;
    let (mut c, mut d) = (f64::INFINITY, 1.0 / b);
    let mut value = d;
    for k in 1..MOST {
        let k = f64::from(k);
        let a = -k * (n - 1.0 + k);
        b += 2.0;
        d = 1.0 / (a * d + b);
        c = b + a / c;
        value *= c * d;
        if !((c * d - 1.0).abs() > f64::EPSILON) {
            break;
        }
    }
    value * libm::exp(-x)
}

/// I_n(x), n = 0 or 1.
pub(crate) fn bessel_i<const N: u32>(x: f64) -> f64 {
    let (n, size) = (f64::from(N), x.abs());
    let value = if size < FAR {
        // DLMF 10.25.2.
        let q = 0.25 * x * x;
        let first = if N == 0 { 1.0 } else { 0.5 * size };
        series(first, |term, k| term * q / (k * (k + n)))
    } else {
        // DLMF 10.40.1; in two factors, since e^x alone is infinite before I is.
        let sum = series(1.0, |term, k| {
            term * ((2.0 * k - 1.0) * (2.0 * k - 1.0) - 4.0 * n * n) / (8.0 * k * size)
        });
        let half = libm::exp(0.5 * size);
        match half.is_finite() {
            true => half * (sum / libm::sqrt(core::f64::consts::TAU * size)) * half,
            false => half,
        }
    };
    if N == 1 && x < 0.0 { -value } else { value }
}

/// K_n(x), n = 0 or 1; not a number for x < 0.
pub(crate) fn bessel_k<const N: u32>(x: f64) -> f64 {
    if !(x > 0.0) {
        return if x == 0.0 { f64::INFINITY } else { f64::NAN };
    }
    if x <= 2.0 {
        // DLMF 10.31.2, with H_k = 1 + ½ + … + 1/k.
        let q = 0.25 * x * x;
        let (mut zero, mut power, mut harmonic) = (0.0, 1.0, 0.0);
        for k in 1..20 {
            let k = f64::from(k);
            power *= q / (k * k);
            harmonic += 1.0 / k;
            zero += power * harmonic;
        }
        zero -= (libm::log(0.5 * x) + EULER) * bessel_i::<0>(x);
        // The Wronskian, DLMF 10.28.2.
        return match N {
            0 => zero,
            _ => (1.0 / x - bessel_i::<1>(x) * zero) / bessel_i::<0>(x),
        };
    }
    // DLMF 10.32.9, K_n = ∫ e^(−x cosh t) cosh nt dt from 0 on, in v = √(2x) sinh(t/2).
    let mut sum = 0.5;
    for k in 1..POINTS {
        let v = STEP * f64::from(k);
        let share = v * v / x;
        let cosh = if N == 0 { 1.0 } else { 1.0 + share };
        sum += libm::exp(-v * v) * cosh / libm::sqrt(1.0 + 0.5 * share);
    }
    STEP * sum * libm::sqrt(2.0 / x) * libm::exp(-x)
}

#[cfg(test)]
mod tests {
    use super::{bessel_i, bessel_k, exponential_integral};
    use crate::formula::Formula;

    /// Values at 0.25, 1, 2.5 and 40, of mpmath with 40 digits. Those at 1 are in Abramowitz and Stegun, tables 5.1, 5.4, 7.1, 9.1 and 9.8.
    const TABLE: &str = "
        erf 0.27632639016823696 0.8427007929497149 0.999593047982555 1.0
        erfc 0.7236736098317631 0.15729920705028513 0.0004069520174449589 0.0
        gamma 3.625609908221908 1.0 1.329340388179137 2.0397882081197444e46
        lgamma 1.2880225246980774 0.0 0.2846828704729192 106.63176026064346
        E1 1.0442826344437381 0.21938393439552029 0.024914917870269736 1.036773261451657e-19
        E2 0.5177301244604703 0.14849550677592205 0.019797703948224457 1.012612094849611e-19
        E3 0.32468412597814367 0.10969196719776014 0.01629536937666883 9.895293794657237e-20
        J0 0.9844359292958527 0.7651976865579666 -0.048383776468198 0.00736689058423729
        J1 0.12402597732272692 0.4400505857449335 0.49709410246427405 0.126038318037585
        Y0 -0.9315730249300587 0.08825696421567696 0.4980703596152319 0.12593641705826092
        Y1 -2.7041052293152825 -0.7812128213002887 0.1459181379667858 -0.005793505821549633
        I0 1.015686141223608 1.2660658777520084 3.289839144050123 1.48947747934199e16
        I1 0.12597910894546793 0.565159103992485 2.5167162452886984 1.4707396163259352e16
        K0 1.5415067512483027 0.42102443824070834 0.06234755320036619 8.392861100099567e-19
        K1 3.7470259744407115 0.6019072301972346 0.07389081634774707 8.497131954861039e-19";

    #[test]
    fn values_are_those_of_tables() {
        for row in TABLE.lines().skip(1) {
            let (name, values) = row.trim().split_once(' ').unwrap();
            let text = format!("{name}(x)");
            let formula = Formula::<f64>::new(&text, &[]).unwrap();
            let values = values.split(' ').map(|value| value.parse::<f64>().unwrap());
            for (x, expected) in [0.25, 1.0, 2.5, 40.0].into_iter().zip(values) {
                let value = formula.value(&[x], &[]);
                let off = (value / expected - 1.0).abs();
                let is_zero = value == 0.0 && expected == 0.0;
                assert!(off < 1e-14 || is_zero, "{name}({x}): off by {off:e}");
            }
        }
    }

    #[test]
    fn ends_of_domains() {
        let e = [
            exponential_integral::<1>,
            exponential_integral::<2>,
            exponential_integral::<3>,
        ];
        assert_eq!(e.map(|e| e(0.0)), [f64::INFINITY, 1.0, 0.5]);
        assert_eq!([bessel_i::<0>(0.0), bessel_i::<1>(0.0)], [1.0, 0.0]);
        assert_eq!(bessel_i::<1>(-1.0), -bessel_i::<1>(1.0));
        assert!(bessel_i::<0>(712.0).is_finite());
        assert_eq!(bessel_i::<0>(2000.0), f64::INFINITY);
        assert_eq!(bessel_k::<0>(0.0), f64::INFINITY);
        for function in e.into_iter().chain([bessel_k::<0>, bessel_k::<1>]) {
            assert!(function(-1.0).is_nan() && function(f64::NAN).is_nan());
            assert_eq!(function(2000.0), 0.0);
        }
        // Both sides of where one way of computing ends and the next begins.
        let (next, before) = (1.0 + 1e-12, 1.0 - 1e-12);
        for (name, function, at) in [
            ("E1", e[0], 1.0),
            ("E3", e[2], 1.0),
            ("I0", bessel_i::<0>, 30.0),
            ("K0", bessel_k::<0>, 2.0),
            ("K1", bessel_k::<1>, 2.0),
        ] {
            let [below, above] = [before, next].map(|factor| function(at * factor));
            let slope = (above - below) / below;
            assert!(slope.abs() < 2e-12 * (1.0 + 2.0 * at), "{name}: {slope:e}");
        }
    }
}
