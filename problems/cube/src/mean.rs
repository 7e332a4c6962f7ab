//! Means over the cube, as functionals.

use fredholm_core::{Functional, Real, Uniforms};

use crate::{Cube, Function};

/// The mean of u over X: Φ = 1, walks start uniformly, φ = 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mean;

impl Mean {
    /// (v, Φ), exact up to rounding: the average of v.
    #[must_use]
    pub fn of<F: Real>(v: &[F]) -> f64 {
        v.iter().map(|v| v.to_f64()).sum::<f64>() / v.len() as f64
    }
}

impl<F: Real, const D: usize, K, S> Functional<Cube<F, D, K, S>> for Mean {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> ([F; D], F) {
        (core::array::from_fn(|_| uniforms.uniform()), F::one())
    }
}

/// The weighted mean ∫ w u dx: Φ = w, walks start uniformly, φ = w(x0).
///
/// (v, Φ) is Σ_i v_i ∫_Xi w dx. Whoever has the integrals of w over the cells exactly hands it to the
/// task as `neighbour_value`; others leave that `None`. Quadrature would be a bias.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weighted<W>(pub W);

impl<F, const D: usize, K, S, W> Functional<Cube<F, D, K, S>> for Weighted<W>
where
    F: Real,
    W: Function<F, D>,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> ([F; D], F) {
        let x: [F; D] = core::array::from_fn(|_| uniforms.uniform());
        (x, self.0.value(&x))
    }
}
