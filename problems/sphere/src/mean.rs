//! The mean of u, as a functional.

use fredholm_core::{Functional, Real, Uniforms};

use crate::{Point, Sphere};

/// (u, Φ) with Φ = 1/4π: the mean over the sphere. Walks start evenly on it, φ = 1.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mean;

impl Mean {
    /// (v, Φ), exact up to rounding: all cells have the same area.
    #[must_use]
    pub fn of<F: Real>(v: &[F]) -> f64 {
        let sum: f64 = v.iter().map(|v| v.to_f64()).sum();
        sum / v.len() as f64
    }
}

impl<F: Real> Functional<Sphere<F>> for Mean {
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Point<F>, F) {
        let (one, two) = (F::one(), F::from_f64(2.0));
        let height = two * uniforms.uniform() - one;
        let radius = ((one - height) * (one + height)).sqrt();
        let azimuth = two * F::PI * uniforms.uniform();
        let start = [radius * azimuth.cos(), radius * azimuth.sin(), height];
        (start, one)
    }
}
