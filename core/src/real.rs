//! The scalar types, and their mathematics by name.

use core::fmt::{Debug, Display, LowerExp};
use core::ops::Neg;

use num_traits::NumAssign;

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// A scalar: `f32` or `f64`.
///
/// Arithmetic is num-traits'. Every transcendental function calls `libm` **by name**, never the
/// platform's maths: num-traits' own `Float` switches from one to the other as soon as any crate
/// of a build enables its `std` feature, and then the last bit of a sine depends on who else is
/// in the build. Results would no longer be the same bits everywhere.
///
/// ```
/// use fredholm_core::Real;
///
/// fn hypotenuse<F: Real>(a: F, b: F) -> F {
///     (a * a + b * b).sqrt()
/// }
/// assert_eq!(hypotenuse(3.0_f32, 4.0), 5.0);
/// assert_eq!(hypotenuse(3.0_f64, 4.0), 5.0);
/// ```
pub trait Real:
    sealed::Sealed
    + NumAssign
    + Neg<Output = Self>
    + PartialOrd
    + Copy
    + Default
    + Debug
    + Display
    + LowerExp
    + Send
    + Sync
    + 'static
{
    /// The distance from 1 to the next larger number: 2⁻²³ or 2⁻⁵².
    const EPSILON: Self;
    /// Not a number.
    const NAN: Self;
    /// Half the circumference of the unit circle.
    const PI: Self;

    /// The nearest number of this type.
    fn from_f64(x: f64) -> Self;
    /// This number as an `f64`; exact.
    fn to_f64(self) -> f64;
    /// The nearest number of this type.
    fn from_u32(x: u32) -> Self;
    /// The integer part, towards zero; 0 for negative numbers and NaN, `u32::MAX` where it is larger.
    fn to_u32(self) -> u32;
    /// A number in [0, 1) from the top bits of `bits`, a multiple of [`EPSILON`](Self::EPSILON)/2.
    fn unit_from_bits(bits: u64) -> Self;
    /// Neither infinite nor NaN.
    fn is_finite(self) -> bool;
    /// Not a number.
    fn is_nan(self) -> bool;
    /// The absolute value.
    #[must_use]
    fn abs(self) -> Self;
    /// The magnitude of `self` with the sign of `sign`.
    #[must_use]
    fn copysign(self, sign: Self) -> Self;
    /// The square root, correctly rounded.
    #[must_use]
    fn sqrt(self) -> Self;
    /// The rounding error of the product: self · factor − fl(self · factor), exact unless it
    /// underflows or a factor is above 2¹⁰⁰⁰.
    #[must_use]
    fn product_error(self, factor: Self) -> Self;
    /// The sine; radians.
    #[must_use]
    fn sin(self) -> Self;
    /// The cosine; radians.
    #[must_use]
    fn cos(self) -> Self;
    /// The angle of the vector (x, self), in [−π, π].
    #[must_use]
    fn atan2(self, x: Self) -> Self;
    /// The exponential.
    #[must_use]
    fn exp(self) -> Self;
    /// The natural logarithm.
    #[must_use]
    fn ln(self) -> Self;
    /// self to the power `exponent`.
    #[must_use]
    fn pow(self, exponent: Self) -> Self;

    /// The larger of the two; `other` where `self` is NaN.
    #[inline]
    #[must_use]
    fn max(self, other: Self) -> Self {
        if self >= other { self } else { other }
    }
}

macro_rules! real {
    ($float:ident, $digits:literal, $sqrt:ident, $product_error:ident, $sin:ident, $cos:ident, $atan2:ident, $exp:ident, $ln:ident, $pow:ident) => {
        impl Real for $float {
            const EPSILON: Self = $float::EPSILON;
            const NAN: Self = $float::NAN;
            const PI: Self = core::$float::consts::PI;

            #[inline]
            fn from_f64(x: f64) -> Self {
                x as Self
            }
            #[inline]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline]
            fn from_u32(x: u32) -> Self {
                x as Self
            }
            #[inline]
            fn to_u32(self) -> u32 {
                self as u32
            }
            #[inline]
            fn unit_from_bits(bits: u64) -> Self {
                (bits >> (64 - $digits)) as Self * (Self::EPSILON / 2.0)
            }
            #[inline]
            fn is_finite(self) -> bool {
                self.is_finite()
            }
            #[inline]
            fn is_nan(self) -> bool {
                self.is_nan()
            }
            #[inline]
            fn abs(self) -> Self {
                self.abs()
            }
            #[inline]
            fn copysign(self, sign: Self) -> Self {
                self.copysign(sign)
            }
            #[inline]
            fn sqrt(self) -> Self {
                libm::$sqrt(self)
            }
            #[inline]
            fn product_error(self, factor: Self) -> Self {
                $product_error(self, factor)
            }
            #[inline]
            fn sin(self) -> Self {
                libm::$sin(self)
            }
            #[inline]
            fn cos(self) -> Self {
                libm::$cos(self)
            }
            #[inline]
            fn atan2(self, x: Self) -> Self {
                libm::$atan2(self, x)
            }
            #[inline]
            fn exp(self) -> Self {
                libm::$exp(self)
            }
            #[inline]
            fn ln(self) -> Self {
                libm::$ln(self)
            }
            #[inline]
            fn pow(self, exponent: Self) -> Self {
                libm::$pow(self, exponent)
            }
        }
    };
}

real!(
    f32,
    24,
    sqrtf,
    product_error_f32,
    sinf,
    cosf,
    atan2f,
    expf,
    logf,
    powf
);
real!(
    f64,
    53,
    sqrt,
    product_error_f64,
    sin,
    cos,
    atan2,
    exp,
    log,
    pow
);

/// A product of two 24-bit numbers is exact in f64.
#[inline]
fn product_error_f32(a: f32, b: f32) -> f32 {
    (f64::from(a) * f64::from(b) - f64::from(a * b)) as f32
}

/// Dekker 1971. A fused multiply-add would be shorter, but most builds for x86 call a function for
/// it.
#[inline]
fn product_error_f64(a: f64, b: f64) -> f64 {
    let [a_high, a_low] = halves(a);
    let [b_high, b_low] = halves(b);
    (((a_high * b_high - a * b) + a_high * b_low) + a_low * b_high) + a_low * b_low
}

/// Veltkamp's splitting: two numbers of 26 bits whose sum is `x`.
#[inline]
fn halves(x: f64) -> [f64; 2] {
    let shifted = 134_217_729.0 * x;
    let high = shifted - (shifted - x);
    [high, x - high]
}

#[cfg(test)]
mod tests {
    use super::Real;

    #[test]
    fn unit_stays_below_one() {
        assert_eq!(f32::unit_from_bits(u64::MAX), 1.0 - f32::EPSILON / 2.0);
        assert_eq!(f64::unit_from_bits(u64::MAX), 1.0 - f64::EPSILON / 2.0);
        assert_eq!(<f32 as Real>::unit_from_bits(0), 0.0);
        assert_eq!(f64::unit_from_bits(1 << 63), 0.5);
    }

    #[test]
    fn products_and_their_errors_are_exact() {
        // (1 + 2⁻³⁰)² = 1 + 2⁻²⁹ + 2⁻⁶⁰, and (1 + 2⁻¹³)² = 1 + 2⁻¹² + 2⁻²⁶.
        let x = 1.0 + 2.0_f64.powi(-30);
        assert_eq!(x * x, 1.0 + 2.0_f64.powi(-29));
        assert_eq!(x.product_error(x), 2.0_f64.powi(-60));
        let x = 1.0 + 2.0_f32.powi(-13);
        assert_eq!(x * x, 1.0 + 2.0_f32.powi(-12));
        assert_eq!(x.product_error(-x), -(2.0_f32.powi(-26)));
        for (a, b) in [(0.1, 0.3), (1e-5, 7e8), (-2.5, 1.0 / 3.0)] {
            assert_eq!(f64::product_error(a, b), f64::mul_add(a, b, -(a * b)));
        }
    }

    #[test]
    fn a_float_out_of_range_becomes_an_integer_without_panic() {
        assert_eq!((-1.0_f64).to_u32(), 0);
        assert_eq!(<f64 as Real>::NAN.to_u32(), 0);
        assert_eq!(1e300_f64.to_u32(), u32::MAX);
    }
}
