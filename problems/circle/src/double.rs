//! Pairs of f64 whose sum is a number of about 106 bits, for setting up the tables.
//!
//! Dekker 1971; Joldes, Muller and Popescu 2017 for the error bounds.

use core::ops::{Add, Mul, Neg};

use fredholm_core::Real;

/// hi + lo with |lo| ≤ ½ ulp(hi).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Double {
    pub(crate) hi: f64,
    pub(crate) lo: f64,
}

impl Double {
    /// π.
    const PI: Self = Self {
        hi: core::f64::consts::PI,
        lo: 1.224_646_799_147_353_2e-16,
    };

    /// a + b, exact for |a| ≥ |b|.
    fn quick(a: f64, b: f64) -> Self {
        let hi = a + b;
        Self {
            hi,
            lo: b - (hi - a),
        }
    }

    /// self divided by a number that is exact in f64.
    fn over(self, divisor: f64) -> Self {
        let hi = self.hi / divisor;
        let product = hi * divisor;
        let remainder = ((self.hi - product) - hi.product_error(divisor)) + self.lo;
        Self::quick(hi, remainder / divisor)
    }

    /// cos and sin of π/m for m ≥ 1, by their Taylor series.
    pub(crate) fn turn(m: f64) -> [Self; 2] {
        let x = Self::PI.over(m);
        let one = Self { hi: 1.0, lo: 0.0 };
        let mut sums = [one, x];
        let mut term = x;
        // |x| ≤ π: the terms from x⁵⁰/50! on are below 10⁻³⁷.
        for k in 2..50_u32 {
            term = (term * x).over(f64::from(k));
            let sign = if k & 2 == 0 { term } else { -term };
            let sum = &mut sums[(k & 1) as usize];
            *sum = *sum + sign;
        }
        sums
    }
}

impl Add for Double {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let hi = self.hi + other.hi;
        let part = hi - self.hi;
        let lo = (self.hi - (hi - part)) + (other.hi - part);
        Self::quick(hi, lo + (self.lo + other.lo))
    }
}

impl Neg for Double {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            hi: -self.hi,
            lo: -self.lo,
        }
    }
}

impl Mul for Double {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let hi = self.hi * other.hi;
        let lo = self.hi.product_error(other.hi);
        Self::quick(hi, lo + (self.hi * other.lo + self.lo * other.hi))
    }
}

/// The sum of the angles of two unit vectors (cos, sin).
pub(crate) fn rotate(a: [Double; 2], b: [Double; 2]) -> [Double; 2] {
    [a[0] * b[0] + -(a[1] * b[1]), a[1] * b[0] + a[0] * b[1]]
}

#[cfg(test)]
mod tests {
    use super::{Double, rotate};

    fn close(a: Double, hi: f64, lo: f64) {
        assert!(((a.hi - hi) + (a.lo - lo)).abs() < 1e-31, "{a:?}");
    }

    /// cos π/5 = (1 + √5)/4 with its rounding error, sin π/6 = ½, sin π = 0, cos π = −1; the first
    /// computed with 60 digits elsewhere.
    #[test]
    fn turns_have_thirty_digits() {
        close(
            Double::turn(5.0)[0],
            0.809_016_994_374_947_5,
            -2.716_057_601_841_252_9e-17,
        );
        close(Double::turn(6.0)[1], 0.5, 0.0);
        close(Double::turn(1.0)[1], 0.0, 0.0);
        close(Double::turn(1.0)[0], -1.0, 0.0);
    }

    #[test]
    fn a_million_small_turns_come_round() {
        let step = Double::turn(500_000.0);
        let mut at = Double::turn(1_000_000.0);
        for _ in 0..1_000_000 {
            at = rotate(at, step);
        }
        let start = Double::turn(1_000_000.0);
        assert!(((at[1].hi - start[1].hi) + (at[1].lo - start[1].lo)).abs() < 1e-24);
        assert!(((at[0].hi - start[0].hi) + (at[0].lo - start[0].lo)).abs() < 1e-24);
    }
}
