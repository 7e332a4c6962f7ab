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
    use crate::Formula;

    /// Values at 0.25, 1, 2.5 and 40, of mpmath with 40 digits. Those at 1 are in Abramowitz and Stegun, tables 5.1, 5.4, 7.1, 9.1 and 9.8.
    const ROWS: [(&str, [f64; 4]); 15] = [
        (
            "erf",
            [
                0.276_326_390_168_236_96,
                0.842_700_792_949_714_9,
                0.999_593_047_982_555,
                1.0,
            ],
        ),
        (
            "erfc",
            [
                0.723_673_609_831_763_1,
                0.157_299_207_050_285_13,
                0.000_406_952_017_444_958_9,
                0.0,
            ],
        ),
        (
            "gamma",
            [
                3.625_609_908_221_908,
                1.0,
                1.329_340_388_179_137,
                2.039_788_208_119_744_4e46,
            ],
        ),
        (
            "lgamma",
            [
                1.288_022_524_698_077_4,
                0.0,
                0.284_682_870_472_919_2,
                106.631_760_260_643_46,
            ],
        ),
        (
            "E1",
            [
                1.044_282_634_443_738_1,
                0.219_383_934_395_520_29,
                0.024_914_917_870_269_736,
                1.036_773_261_451_657e-19,
            ],
        ),
        (
            "E2",
            [
                0.517_730_124_460_470_3,
                0.148_495_506_775_922_05,
                0.019_797_703_948_224_457,
                1.012_612_094_849_611e-19,
            ],
        ),
        (
            "E3",
            [
                0.324_684_125_978_143_67,
                0.109_691_967_197_760_14,
                0.016_295_369_376_668_83,
                9.895_293_794_657_237e-20,
            ],
        ),
        (
            "J0",
            [
                0.984_435_929_295_852_7,
                0.765_197_686_557_966_6,
                -0.048_383_776_468_198,
                0.007_366_890_584_237_29,
            ],
        ),
        (
            "J1",
            [
                0.124_025_977_322_726_92,
                0.440_050_585_744_933_5,
                0.497_094_102_464_274_05,
                0.126_038_318_037_585,
            ],
        ),
        (
            "Y0",
            [
                -0.931_573_024_930_058_7,
                0.088_256_964_215_676_96,
                0.498_070_359_615_231_9,
                0.125_936_417_058_260_92,
            ],
        ),
        (
            "Y1",
            [
                -2.704_105_229_315_282_5,
                -0.781_212_821_300_288_7,
                0.145_918_137_966_785_8,
                -0.005_793_505_821_549_633,
            ],
        ),
        (
            "I0",
            [
                1.015_686_141_223_608,
                1.266_065_877_752_008_4,
                3.289_839_144_050_123,
                1.489_477_479_341_99e16,
            ],
        ),
        (
            "I1",
            [
                0.125_979_108_945_467_93,
                0.565_159_103_992_485,
                2.516_716_245_288_698_4,
                1.470_739_616_325_935_2e16,
            ],
        ),
        (
            "K0",
            [
                1.541_506_751_248_302_7,
                0.421_024_438_240_708_34,
                0.062_347_553_200_366_19,
                8.392_861_100_099_567e-19,
            ],
        ),
        (
            "K1",
            [
                3.747_025_974_440_711_5,
                0.601_907_230_197_234_6,
                0.073_890_816_347_747_07,
                8.497_131_954_861_039e-19,
            ],
        ),
    ];

    #[test]
    fn values_are_those_of_tables() {
        for (name, values) in ROWS {
            let text = format!("{name}(x)");
            let formula = Formula::<f64>::new(&text, &[]).unwrap();
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
