//! Means over the cube, as functionals.

use fredholm_core::array::from_fn;
use fredholm_core::{Equation, Functional, LastStep, Lights, Located, Real, Start, Uniforms};

use crate::{Cube, CubeError, CubeScores, KernelFn, ScalarField};

/// The mean of u over X: Φ = 1, walks start uniformly, φ = 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mean;

impl Mean {
    /// (v, Φ) with so many functions on a cell, exact up to rounding: the average of the v_i0, as the means of
    /// the other functions are 0.
    #[must_use]
    pub fn of<F: Real>(v: &[F], functions: usize) -> f64 {
        let functions = functions.max(1);
        let firsts = v.iter().step_by(functions).map(|v| v.to_f64());
        firsts.sum::<f64>() / (v.len() / functions) as f64
    }
}

/// The weighted mean ∫ w u dx: Φ = w, walks start uniformly, φ = w(x0).
///
/// (v, Φ) is Σ_ia v_ia ∫_Xi w ψ_ia dx, and few weights have exact integrals over cells; quadrature in their
/// place would be a bias. With *any* numbers w_ia near the means of w ψ_ia over the cells,
///
/// ```text
/// Σ_ia v_ia w_ia/n + (w(x0) − Σ_a w_ia ψ_ia(x0)) v(x0)        (x0 ∈ X_i)
/// ```
///
/// has the mean (v, Φ), since the ψ_ia are orthonormal, and varies little: it is this functional's
/// `control_estimate`, so that a goal leaves its own `None`.
#[derive(Clone, Copy, Debug)]
pub struct Weighted<'a, F, const D: usize, W> {
    weight: W,
    means: &'a [F],
    scores: CubeScores<D>,
    value: f64,
}

impl<'a, F: Real, const D: usize, W> Weighted<'a, F, D, W> {
    /// The weight w, the functions of v, numbers w_ia near the means of w times each of them, and v.
    ///
    /// # Errors
    /// [`CubeError::Length`]: there are not n·B numbers w_ia, or v_ia.
    pub fn new(
        weight: W,
        scores: CubeScores<D>,
        means: &'a [F],
        v: &[F],
    ) -> Result<Self, CubeError> {
        CubeError::check_length(scores.unknowns(), means.len())?;
        CubeError::check_length(scores.unknowns(), v.len())?;
        let products = means.iter().zip(v).map(|(w, v)| w.to_f64() * v.to_f64());
        let cells = scores.unknowns() / scores.functions();
        Ok(Self {
            weight,
            means,
            scores,
            value: products.sum::<f64>() / cells as f64,
        })
    }

    /// Σ_ia v_ia w_ia/n, which is (v, Φ) as far as the w_ia are the means of w ψ_ia.
    #[must_use]
    pub const fn of_means(&self) -> f64 {
        self.value
    }

    /// The estimate of (v, Φ) from a start x0, from φ(x0) and v(x0).
    pub fn control(&self, x0: &Located<[F; D]>, phi: F, v: F) -> f64 {
        let near = self.scores.value(x0, self.means);
        self.value + (phi.to_f64() - near) * v.to_f64()
    }
}

/// The equation of a cube, for u or for what a last step leaves of it.
trait OnCube<F: Real, const D: usize>: Equation<Scalar = F, Point = [F; D], Value = F> {
    /// What is known of u in a point.
    fn known_at(&self, x: &[F; D]) -> F;

    /// A uniform start, with this weight.
    #[inline]
    fn uniform<U: Uniforms<F>>(
        &self,
        uniforms: &mut U,
        weight: impl FnOnce(&[F; D]) -> F,
    ) -> Start<[F; D], F, F> {
        let point = from_fn(|_| uniforms.uniform());
        let phi = weight(&point);
        Start {
            point,
            phi,
            known: phi * self.known_at(&point),
        }
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> OnCube<F, D> for Cube<F, D, K, S, B>
where
    K: KernelFn<F, D>,
    S: ScalarField<F, D>,
{
    #[inline]
    fn known_at(&self, _: &[F; D]) -> F {
        F::zero()
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> OnCube<F, D>
    for LastStep<'_, Cube<F, D, K, S, B>>
where
    K: KernelFn<F, D>,
    S: ScalarField<F, D>,
{
    #[inline]
    fn known_at(&self, x: &[F; D]) -> F {
        self.0.known(x)
    }
}

/// A mean of u, and of what a last step leaves of it: then a start knows φ F of its point.
impl<E, F: Real, const D: usize> Functional<E> for Mean
where
    E: Equation<Scalar = F, Point = [F; D], Value = F> + OnCube<F, D>,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, equation: &E, uniforms: &mut U) -> Start<[F; D], F, F> {
        equation.uniform(uniforms, |_| F::one())
    }
}

/// A weighted mean of u, and of what a last step leaves of it.
impl<E, F: Real, const D: usize, W: ScalarField<F, D>> Functional<E> for Weighted<'_, F, D, W>
where
    E: Equation<Scalar = F, Point = [F; D], Value = F> + OnCube<F, D>,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, equation: &E, uniforms: &mut U) -> Start<[F; D], F, F> {
        equation.uniform(uniforms, |x| self.weight.value(x))
    }

    fn control_estimate(&self, x0: &Located<[F; D]>, phi: F, v: &F) -> f64 {
        self.control(x0, phi, *v)
    }
}
