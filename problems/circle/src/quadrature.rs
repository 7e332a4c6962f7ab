//! What is computed once: Gauss sums, and spherical Bessel functions.

use fredholm_core::array::from_fn;

/// The Gauss–Legendre rule of 16 points on [−1, 1], positive half: nodes and weights. Abramowitz and
/// Stegun 1964, table 25.4, to the digits of f64.
const RULE: [(f64, f64); 8] = [
    (0.095_012_509_837_637_44, 0.189_450_610_455_068_5),
    (0.281_603_550_779_258_9, 0.182_603_415_044_923_58),
    (0.458_016_777_657_227_4, 0.169_156_519_395_002_53),
    (0.617_876_244_402_643_7, 0.149_595_988_816_576_73),
    (0.755_404_408_355_003, 0.124_628_971_255_533_88),
    (0.865_631_202_387_831_8, 0.095_158_511_682_492_79),
    (0.944_575_023_073_232_6, 0.062_253_523_938_647_894),
    (0.989_400_934_991_649_9, 0.027_152_459_411_754_096),
];

/// The nodes of one of equal pieces of [−1, 1], with weights that sum to its length.
pub(crate) fn nodes(piece: usize, pieces: usize) -> impl Iterator<Item = (f64, f64)> {
    let half = 1.0 / pieces as f64;
    let middle = (2 * piece + 1) as f64 * half - 1.0;
    let both = move |(node, weight): (f64, f64)| {
        [-node, node].map(|node| (middle + half * node, half * weight))
    };
    RULE.into_iter().flat_map(both)
}

/// ∫ of a function from `low` to `high`: exact to rounding for polynomials of degree 31.
pub(crate) fn integrate(low: f64, high: f64, function: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let terms = nodes(0, 1).map(|(node, weight)| weight * function(middle + half * node));
    half * terms.sum::<f64>()
}

/// |∫| of a function of t and of |t − start|, from `start` to `end`: the distance keeps its digits.
pub(crate) fn integrate_from(start: f64, end: f64, function: impl Fn(f64, f64) -> f64) -> f64 {
    let length = (end - start).abs();
    let at = |part: f64| function(start + (end - start) * part, length * part);
    length * integrate(0.0, 1.0, at)
}

/// The spherical Bessel functions j_0(x) … j_(B−1)(x) for 0 ≤ x ≤ 2, by their series
/// x^b/(2b + 1)!! Σ_k (−x²/2)^k/(k! (2b + 3)(2b + 5) … (2b + 2k + 1)).
pub(crate) fn bessel<const B: usize>(x: f64) -> [f64; B] {
    let mut scale = 1.0;
    from_fn(|b| {
        if b > 0 {
            scale *= x / (2 * b + 1) as f64;
        }
        // (x²/2)^k/(k! 3 · 5 … ) is below 10⁻¹⁸ of 1 behind the twelfth term.
        let tail = (1..13_u32).rev().fold(1.0, |sum, k| {
            let factor = f64::from(k) * (2 * b + 1 + 2 * k as usize) as f64;
            1.0 - 0.5 * x * x / factor * sum
        });
        scale * tail
    })
}

#[cfg(test)]
mod tests {
    use super::{bessel, integrate, integrate_from};

    #[test]
    fn degree_31_is_exact() {
        let power = |t: f64| (0..31).fold(1.0, |product, _| product * t);
        assert!((integrate(0.0, 2.0, power) * 32.0 / 4_294_967_296.0 - 1.0).abs() < 1e-14);
        let distance = |_: f64, distance: f64| distance;
        assert!((integrate_from(0.25, -1.0, distance) - 0.781_25).abs() < 1e-15);
    }

    /// j_0 … j_4 in ½ and in π/2, computed with 40 digits elsewhere.
    #[test]
    fn spherical_bessel_functions_have_their_digits() {
        let expected = [
            (
                0.5,
                [
                    0.958_851_077_208_406,
                    0.162_537_030_636_066_56,
                    0.016_371_106_607_993_412,
                    0.001_174_035_443_867_557_2,
                    6.538960615238971e-05,
                ],
            ),
            (
                core::f64::consts::FRAC_PI_2,
                [
                    core::f64::consts::FRAC_2_PI,
                    0.405_284_734_569_351_1,
                    0.137_417_054_029_206_4,
                    0.032_127_333_708_133_93,
                    0.005_753_217_075_140_424,
                ],
            ),
        ];
        for (x, expected) in expected {
            for (j, expected) in bessel::<5>(x).into_iter().zip(expected) {
                assert!((j / expected - 1.0).abs() < 1e-15, "{x} {j} {expected}");
            }
        }
    }
}
