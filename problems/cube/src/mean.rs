//! Means over the cube, as functionals.

use fredholm_core::{Functional, Located, Real, Uniforms};

use crate::{Cube, CubeError, Function};

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
/// (v, Φ) is Σ_i v_i ∫_Xi w dx, and few weights have exact integrals over cells; quadrature in their
/// place would be a bias. With *any* numbers w_i near the means of w over the cells,
///
/// ```text
/// Σ_i v_i w_i/n + (w(x0) − w_i) v_i        (x0 ∈ X_i)
/// ```
///
/// has the mean (v, Φ) and varies little: it is this functional's `neighbour_value`, so that a task
/// leaves its own `None`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weighted<'a, F, W> {
    weight: W,
    means: &'a [F],
    value: f64,
}

impl<'a, F: Real, W> Weighted<'a, F, W> {
    /// The weight w, numbers w_i near its means over the cells (see [`Cube::means`]), and v.
    ///
    /// # Errors
    /// [`CubeError::Length`]: there are not as many w_i as v_i.
    pub fn new(weight: W, means: &'a [F], v: &[F]) -> Result<Self, CubeError> {
        if means.len() != v.len() {
            return Err(CubeError::Length {
                expected: v.len(),
                found: means.len(),
            });
        }
        let products = means.iter().zip(v).map(|(w, v)| w.to_f64() * v.to_f64());
        Ok(Self {
            weight,
            means,
            value: products.sum::<f64>() / v.len() as f64,
        })
    }

    /// Σ_i v_i w_i/n, which is (v, Φ) as far as the w_i are the means of w.
    #[must_use]
    pub const fn of_means(&self) -> f64 {
        self.value
    }
}

impl<F, const D: usize, K, S, W> Functional<Cube<F, D, K, S>> for Weighted<'_, F, W>
where
    F: Real,
    W: Function<F, D>,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> ([F; D], F) {
        let x: [F; D] = core::array::from_fn(|_| uniforms.uniform());
        (x, self.weight.value(&x))
    }

    fn neighbour_value(&self, x0: &Located<[F; D]>, phi: F, v: F) -> f64 {
        let mean = self.means.get(x0.cell).map_or(f64::NAN, |w| w.to_f64());
        self.value + (phi.to_f64() - mean) * v.to_f64()
    }
}
