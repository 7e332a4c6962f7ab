//! The mean of u over an interval of angles, as a functional.

use fredholm_core::{Functional, Real, Uniforms};

use crate::{Circle, CircleError, Emission, Point};

/// (u, Φ) with Φ = 1/(to − from) on [from, to]: walks start uniformly on it, φ = 1.
#[derive(Clone, Copy, Debug)]
pub struct MeanOver<'a, 'b, F, E> {
    circle: &'a Circle<'b, F, E>,
    from: f64,
    to: f64,
}

impl<'a, 'b, F: Real, E: Emission<F>> MeanOver<'a, 'b, F, E> {
    /// The mean over the angles [from, to].
    ///
    /// # Errors
    /// [`CircleError::Interval`] unless 0 ≤ from < to ≤ 2π.
    pub fn new(circle: &'a Circle<'b, F, E>, from: f64, to: f64) -> Result<Self, CircleError> {
        if !(0.0 <= from && from < to && to <= core::f64::consts::TAU) {
            return Err(CircleError::Interval);
        }
        Ok(Self { circle, from, to })
    }

    /// (v, Φ), exact up to rounding: the mean of the piecewise constant v over the interval.
    #[must_use]
    pub fn of(&self, v: &[F]) -> f64 {
        let width = core::f64::consts::TAU / v.len() as f64;
        let mut sum = 0.0;
        for (i, v) in v.iter().enumerate() {
            let left = (i as f64 * width).max(self.from);
            let right = ((i + 1) as f64 * width).min(self.to);
            sum += v.to_f64() * (right - left).max(0.0);
        }
        sum / (self.to - self.from)
    }
}

impl<F: Real, E: Emission<F>> Functional<Circle<'_, F, E>> for MeanOver<'_, '_, F, E> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Point<F>, F) {
        let xi: F = uniforms.uniform();
        let angle = self.from + (self.to - self.from) * xi.to_f64();
        (self.circle.point(angle), F::one())
    }
}
