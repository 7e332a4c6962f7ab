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

    /// (v, Φ), exact up to rounding: the mean of the piecewise constant v over the interval; of piecewise
    /// polynomials, where v has a multiple of n entries.
    #[must_use]
    pub fn of(&self, v: &[F]) -> f64 {
        let cells = self.circle.table().len();
        let width = core::f64::consts::TAU / cells as f64;
        let mut sum = 0.0;
        for (i, v) in v.chunks_exact((v.len() / cells).max(1)).enumerate() {
            let begin = i as f64 * width;
            let left = begin.max(self.from);
            let right = ((i + 1) as f64 * width).min(self.to);
            let part = (right - left).max(0.0);
            let Some((constant, others)) = v.split_first() else {
                continue;
            };
            sum += constant.to_f64() * part;
            // The others have the mean 0 over a whole cell.
            if 0.0 < part && part < width {
                let t = |s: f64| 2.0 * (s - begin) / width - 1.0;
                sum += 0.5 * width * between(others, t(left), t(right));
            }
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

/// Σ_b v_b ∫ ψ_b dt from `left` to `right`, b from 1: ∫ P_b dt = (P_(b+1) − P_(b−1))/(2b + 1).
fn between<F: Real>(v: &[F], left: f64, right: f64) -> f64 {
    // P_(b−1) and P_b at both ends.
    let (mut before, mut now) = ([1.0; 2], [left, right]);
    let mut sum = 0.0;
    for (b, v) in (1..).zip(v) {
        let degree = f64::from(b);
        let odd = 2.0 * degree + 1.0;
        let next = |at: usize, t: f64| (odd * t * now[at] - degree * before[at]) / (degree + 1.0);
        let next = [next(0, left), next(1, right)];
        let integral = ((next[1] - before[1]) - (next[0] - before[0])) / odd;
        sum += v.to_f64() * Real::sqrt(odd) * integral;
        (before, now) = (now, next);
    }
    sum
}
