//! How large, and how small, what is drawn may be.

use fredholm_core::Real;

/// Limits of coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// The furthest that coordinates may be from 0.
    pub largest: f64,
    /// The nearest to each other that their extremes may be.
    pub narrowest: f64,
    /// The smallest distance, as a share of the extremes' distance.
    pub smallest: f64,
}

impl Limits {
    /// The limits of walks in `F`, of which `largest` and `narrowest` are said for f32 and f64.
    #[must_use]
    pub fn of<F: Real>(largest: [f64; 2], narrowest: [f64; 2]) -> Self {
        let wide = usize::from(F::EPSILON.to_f64() < 1e-10);
        Self {
            largest: largest[wide],
            narrowest: narrowest[wide],
            smallest: [1.0 / 65_536.0, 1.0 / (1_u64 << 40) as f64][wide],
        }
    }
}

/// What the tests of boxes may be wrong by: a few rounding errors of the largest coordinate.
#[must_use]
pub fn margin(coordinates: impl Iterator<Item = f64>, epsilon: f64) -> f64 {
    let largest = coordinates.fold(0.0, |m: f64, x| Real::max(m, x.abs()));
    32.0 * epsilon * largest
}
