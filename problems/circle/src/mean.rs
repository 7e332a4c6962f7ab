//! The mean of u over an interval of angles, as a functional.

use fredholm_core::galerkin::Cells;
use fredholm_core::{Equation, Functional, Real, Space, Start, StartOf, Uniforms};

use crate::{CircleError, Point};

/// (u, Φ) with Φ = 1/(to − from) on [from, to]: walks start uniformly on it, φ = 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanOver {
    from: f64,
    to: f64,
}

impl MeanOver {
    /// The mean over the angles [from, to].
    ///
    /// # Errors
    /// [`CircleError::Interval`] unless 0 ≤ from < to ≤ 2π.
    pub fn new(from: f64, to: f64) -> Result<Self, CircleError> {
        if !(0.0 <= from && from < to && to <= core::f64::consts::TAU) {
            return Err(CircleError::Interval);
        }
        Ok(Self { from, to })
    }

    /// (v, Φ), exact up to rounding, of a piecewise polynomial v with as many functions on each of `cells` cells.
    #[must_use]
    pub fn of<F: Real>(&self, cells: usize, v: &[F]) -> f64 {
        let width = core::f64::consts::TAU / cells as f64;
        let functions = v.len().checked_div(cells).unwrap_or(0).max(1);
        let mut sum = 0.0;
        for (i, v) in v.chunks_exact(functions).enumerate() {
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

impl<E> Functional<E> for MeanOver
where
    E: Equation<Point = Point<<E as Space>::Scalar>> + Cells + ?Sized,
{
    #[inline]
    fn start<U: Uniforms<E::Scalar>>(&self, equation: &E, uniforms: &mut U) -> StartOf<E> {
        let angle = self.from + (self.to - self.from) * uniforms.uniform().to_f64();
        // Rounding may lead beyond the last point.
        let end = || equation.point(equation.cells() - 1, &[1.0]);
        let point = equation.at(&[angle]).unwrap_or_else(end);
        Start::of(equation, point, E::Scalar::from_u32(1))
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
