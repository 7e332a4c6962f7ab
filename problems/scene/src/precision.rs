//! How precisely coordinates are known, from the coordinates themselves.

use core::fmt;

use fredholm_core::Real;

use crate::vector::Vector;

/// The places to which the coordinates of a scene were rounded before they were given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Rounding {
    /// Numbers of double precision.
    Double,
    /// Numbers of single precision, as in every binary STL file.
    Single,
    /// Decimals, this many of them.
    Decimals(u32),
}

/// The precision of a scene's coordinates, in its unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precision {
    /// What coordinates were rounded to.
    pub rounding: Rounding,
    /// The largest distance of a vertex from where it was before its coordinates were rounded.
    pub distance: f64,
}

/// The bits of a fraction that a short number leaves 0, and one of single precision hardly ever does.
const LOW_BITS: u32 = 0xff;

/// The most decimals that are looked for: those of larger numbers are lost to double precision.
const MOST_DECIMALS: u32 = 12;

/// Decimals were rounded if the last one is at most this share of the scene's width. What is typed by hand has fewer, and means them.
const ROUNDED: f64 = 1e-5;

/// The least number of last decimals of which a number is long.
const LONG: f64 = 1e4;

/// The diagonal of a cube of side 1.
const DIAGONAL: f64 = 1.732_050_807_568_877_2;

impl Precision {
    /// This without what the scalar of the walks makes of it, which is nothing that the coordinates as given say. The distance stays.
    #[cfg(feature = "alloc")]
    pub(crate) fn of_input<F: Real>(self) -> Self {
        let is_ours = self.rounding == Rounding::Single && F::EPSILON > F::from_f64(f64::EPSILON);
        Self {
            rounding: if is_ours {
                Rounding::Double
            } else {
                self.rounding
            },
            ..self
        }
    }

    /// The precision of vertices of a scene of this width. Numbers that are few or short are as they are given.
    ///
    /// ```
    /// use fredholm_scene::{Precision, Rounding};
    ///
    /// let third = [1.0 / 3.0, -2.0 / 3.0, 1.0];
    /// assert_eq!(Precision::of(&[third], 1.0).rounding, Rounding::Double);
    /// let single = third.map(|x| f64::from(x as f32));
    /// assert_eq!(Precision::of(&[single], 1.0).rounding, Rounding::Single);
    /// assert_eq!(Precision::of(&[[0.333333, 0.666667, 1.0]], 1.0).rounding, Rounding::Decimals(6));
    /// // Typed by hand.
    /// assert_eq!(Precision::of(&[[0.25, 2.5, 1.1]], 3.0).rounding, Rounding::Double);
    /// assert_eq!(Precision::of(&[[10_000_001.0, 10_000_011.0, 0.0]], 10.0).rounding, Rounding::Double);
    /// ```
    #[must_use]
    pub fn of(points: &[Vector<f64>], width: f64) -> Self {
        let numbers = || points.iter().flatten().copied();
        let largest = numbers().fold(0.0, |m: f64, x| Real::max(m, x.abs()));
        let of = |rounding, step: f64| Self {
            rounding,
            distance: 0.5 * DIAGONAL * step,
        };
        let is_single = |x: f64| f64::from(x as f32) == x;
        // Whole numbers are as they were typed: single precision makes others whole only where it has no fractions at all.
        let is_long = |x: f64| {
            let is_whole = x.abs() == nearest(x.abs());
            !is_whole && (x as f32).to_bits() & LOW_BITS != 0
        };
        if numbers().all(is_single) && numbers().any(is_long) {
            return of(Rounding::Single, f64::from(f32::EPSILON) * largest);
        }
        let mut power = 1.0;
        for decimals in 0..=MOST_DECIMALS {
            let is_whole = |x: f64| {
                let scaled = x.abs() * power;
                (scaled - nearest(scaled)).abs() <= 2.0 * f64::EPSILON * scaled
            };
            if numbers().all(is_whole) {
                // A number of digits that double precision has besides.
                let step = 1.0 / power;
                // Of numbers that were rounded nine in ten have all digits.
                let is_long = |x: &f64| {
                    let scaled = nearest(x.abs() * power);
                    scaled >= LONG && nearest(0.1 * scaled) * 10.0 != scaled
                };
                let others = numbers().filter(|&x| x != 0.0).count();
                let are_long = 2 * numbers().filter(is_long).count() > others;
                let is_fine = step <= ROUNDED * width && step >= 16.0 * f64::EPSILON * largest;
                if !(are_long && is_fine) {
                    break;
                }
                return of(Rounding::Decimals(decimals), step);
            }
            power *= 10.0;
        }
        of(Rounding::Double, f64::EPSILON * largest)
    }
}

/// The integer nearest to a number that is not negative; the number itself if it is beyond integers of 64 bits.
fn nearest(x: f64) -> f64 {
    if x < 9e18 { (x + 0.5) as u64 as f64 } else { x }
}

impl fmt::Display for Rounding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Double => f.write_str("double precision"),
            Self::Single => f.write_str("single precision"),
            Self::Decimals(1) => f.write_str("one decimal"),
            Self::Decimals(n) => write!(f, "{n} decimals"),
        }
    }
}
