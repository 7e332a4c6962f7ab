//! Quadrature along a wall, exact to rounding.
//!
//! Whatever depends on the direction from a point to a place on a wall is an analytic function of
//! the place s, counted from the foot of the point's perpendicular, except at s = ±id, d the length
//! of the perpendicular. On an interval with its middle at m and of half width a these two are at
//! (−m ± id)/a in its own coordinate θ ∈ [−1, 1], at the distance κ = √(m² + d²)/a from 0: on or
//! outside the ellipse with foci ±1 and ρ + 1/ρ = 2κ, as no ellipse with that sum is nearer to 0
//! than it is at its vertex κ (Bernstein 1912). N Gauss points integrate polynomials up to the
//! degree 2N − 1 exactly; where the integrand is a polynomial of degree 2B − 2 times a density with
//! these singularities, their error is that of the best approximation of the density by polynomials
//! of degree 2N − 1 − (2B − 2), of the order ρ^−(2N − 2B + 2).

use fredholm_core::Real;
use fredholm_core::array::Each;
use num_traits::{one, zero};

/// The number of rules.
pub(crate) const RULES: usize = 6;

/// The positive points of Gauss–Legendre rules of 4, 6, 8, 10, 12 and 16 points on [−1, 1], and
/// their weights.
#[rustfmt::skip]
const GAUSS: [&[[f64; 2]]; RULES] = [
    &[
        [0.339_981_043_584_856_26, 0.652_145_154_862_546_1],
        [0.861_136_311_594_052_6, 0.347_854_845_137_453_85],
    ],
    &[
        [0.238_619_186_083_196_9, 0.467_913_934_572_691_04],
        [0.661_209_386_466_264_5, 0.360_761_573_048_138_6],
        [0.932_469_514_203_152, 0.171_324_492_379_170_36],
    ],
    &[
        [0.183_434_642_495_649_8, 0.362_683_783_378_362],
        [0.525_532_409_916_329, 0.313_706_645_877_887_27],
        [0.796_666_477_413_626_7, 0.222_381_034_453_374_48],
        [0.960_289_856_497_536_3, 0.101_228_536_290_376_26],
    ],
    &[
        [0.148_874_338_981_631_22, 0.295_524_224_714_752_87],
        [0.433_395_394_129_247_2, 0.269_266_719_309_996_35],
        [0.679_409_568_299_024_4, 0.219_086_362_515_982_04],
        [0.865_063_366_688_984_5, 0.149_451_349_150_580_6],
        [0.973_906_528_517_171_7, 0.066_671_344_308_688_14],
    ],
    &[
        [0.125_233_408_511_468_9, 0.249_147_045_813_402_77],
        [0.367_831_498_998_180_2, 0.233_492_536_538_354_8],
        [0.587_317_954_286_617_5, 0.203_167_426_723_065_92],
        [0.769_902_674_194_304_7, 0.160_078_328_543_346_22],
        [0.904_117_256_370_474_9, 0.106_939_325_995_318_43],
        [0.981_560_634_246_719_2, 0.047_175_336_386_511_83],
    ],
    &[
        [0.095_012_509_837_637_44, 0.189_450_610_455_068_5],
        [0.281_603_550_779_258_9, 0.182_603_415_044_923_58],
        [0.458_016_777_657_227_37, 0.169_156_519_395_002_54],
        [0.617_876_244_402_643_8, 0.149_595_988_816_576_74],
        [0.755_404_408_355_003, 0.124_628_971_255_533_88],
        [0.865_631_202_387_831_8, 0.095_158_511_682_492_79],
        [0.944_575_023_073_232_6, 0.062_253_523_938_647_894],
        [0.989_400_934_991_649_9, 0.027_152_459_411_754_096],
    ],
];

/// Points on [−1, 1] and weights that sum to 2, of the rule with this number.
#[inline]
pub(crate) fn gauss<F: Real>(rule: usize) -> impl Iterator<Item = (F, F)> {
    let half = GAUSS.get(rule).copied().unwrap_or(&[]).iter();
    half.flat_map(|&[t, weight]| [-t, t].each(|t| (F::from_f64(t), F::from_f64(weight))))
}

/// Which rule serves where, for polynomials of degree 2B − 2.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Panels<F> {
    /// The least κ² of every rule.
    nearest: [F; RULES],
}

impl<F: Real> Panels<F> {
    /// For B = `functions`, at most 5.
    pub(crate) fn new(functions: usize) -> Self {
        let nearest = GAUSS.each(|half| {
            let order = 4 * half.len() as i32 - 2 * functions as i32 + 2;
            if order < 6 {
                return F::from_f64(f64::INFINITY);
            }
            // ρ^−order is a small part of ε: the density is nearly s^−3 where d is small, so that
            // its coefficients in polynomials of degree k are of the order k² ρ^−k.
            let rho = Real::pow(4096.0 / F::EPSILON.to_f64(), 1.0 / f64::from(order));
            let kappa = 0.5 * (rho + 1.0 / rho);
            F::from_f64(kappa * kappa)
        });
        Self { nearest }
    }

    /// The smallest rule for an interval of half width a, with `square` = a² and `distance` = m² +
    /// d². `None`: it is too near for any.
    #[inline]
    pub(crate) fn rule(&self, distance: F, square: F) -> Option<usize> {
        self.nearest
            .iter()
            .position(|&nearest| distance >= nearest * square)
    }

    /// Calls `each` with points s of an interval [from, to] and weights ds, for a point at the
    /// distance `distance` > 0 from its line.
    ///
    /// Where no rule serves the whole interval it is cut at ±d and in halves of what is farther
    /// from the foot: then ρ is at least 4.6 on every part, and s keeps its digits however near the
    /// wall is.
    #[inline]
    pub(crate) fn points(&self, [from, to]: [F; 2], distance: F, mut each: impl FnMut(F, F)) {
        let mut part = |rule: usize, from: F, to: F, sign: F| {
            let half = F::from_f64(0.5) * (to - from);
            for (t, weight) in gauss::<F>(rule) {
                each(sign * (from + half * (one::<F>() + t)), half * weight);
            }
        };
        let half = F::from_f64(0.5);
        let [middle, width] = [half * (from + to), half * (to - from)];
        if let Some(rule) = self.rule(middle * middle + distance * distance, width * width) {
            part(rule, from, to, one());
            return;
        }
        // From afar, so that most is added last, to a sum that is small until then.
        for (sign, near, far) in [(-one::<F>(), -to, -from), (one(), from, to)] {
            let near = near.max(zero());
            let mut far = far;
            while near < far {
                let halved = half * far;
                let begin = if halved > distance {
                    halved
                } else if far > distance {
                    distance
                } else {
                    zero()
                };
                let begin = begin.max(near);
                // Infinite ends lead nowhere.
                if !(begin < far) {
                    break;
                }
                part(RULES - 1, begin, far, sign);
                far = begin;
            }
        }
    }
}
