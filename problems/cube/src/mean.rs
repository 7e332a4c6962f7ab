//! Means over the cube, as functionals.

use fredholm_core::array::from_fn;
use fredholm_core::{Functional, Located, Real, Uniforms};

use crate::functions::CellFunctions;
use crate::mesh::Mesh;
use crate::{Cube, CubeError, ScalarField};

/// The mean of u over X: Φ = 1, walks start uniformly, φ = 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mean;

impl Mean {
    /// (v, Φ) of piecewise constants, exact up to rounding: the average of v.
    #[must_use]
    pub fn of<F: Real>(v: &[F]) -> f64 {
        Self::of_blocks::<F, 1>(v)
    }

    /// (v, Φ) with B functions on a cell, exact up to rounding: the average of the v_i0, as the means of
    /// the other functions are 0.
    #[must_use]
    pub fn of_blocks<F: Real, const B: usize>(v: &[F]) -> f64 {
        Self::of_functions(v, B)
    }

    /// (v, Φ) with a number of functions on a cell that is known at run time: see [`of_blocks`](Self::of_blocks).
    #[must_use]
    pub fn of_functions<F: Real>(v: &[F], functions: usize) -> f64 {
        let functions = functions.max(1);
        let firsts = v.iter().step_by(functions).map(|v| v.to_f64());
        firsts.sum::<f64>() / (v.len() / functions) as f64
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> Functional<Cube<F, D, K, S, B>> for Mean {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> ([F; D], F) {
        (from_fn(|_| uniforms.uniform()), F::one())
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
/// `control_estimate`, so that a task leaves its own `None`.
#[derive(Clone, Copy, Debug)]
pub struct Weighted<'a, F, const D: usize, W> {
    weight: W,
    means: &'a [F],
    mesh: Mesh<D>,
    functions: CellFunctions<D>,
    value: f64,
}

impl<'a, F: Real, const D: usize, W> Weighted<'a, F, D, W> {
    /// The weight w on the cells of a cube, numbers w_ia near the means of w ψ_ia (see [`Cube::means`]),
    /// and v.
    ///
    /// # Errors
    /// [`CubeError::Length`]: there are not n·B numbers w_ia, or v_ia.
    pub fn new<K, S, const B: usize>(
        cube: &Cube<F, D, K, S, B>,
        weight: W,
        means: &'a [F],
        v: &[F],
    ) -> Result<Self, CubeError> {
        Self::on_mesh(cube.mesh(), CellFunctions::new::<B>(), weight, means, v)
    }

    /// The weight on the cells of a cube with a number of functions that is known at run time: see [`new`](Self::new).
    ///
    /// # Errors
    /// [`CubeError::Length`]: there are not n·B numbers w_ia, or v_ia.
    pub fn with_functions<K, S>(
        cube: &Cube<F, D, K, S>,
        functions: CellFunctions<D>,
        weight: W,
        means: &'a [F],
        v: &[F],
    ) -> Result<Self, CubeError> {
        Self::on_mesh(cube.mesh(), functions, weight, means, v)
    }

    fn on_mesh(
        mesh: Mesh<D>,
        functions: CellFunctions<D>,
        weight: W,
        means: &'a [F],
        v: &[F],
    ) -> Result<Self, CubeError> {
        let expected = mesh.cells().saturating_mul(functions.count());
        for found in [means.len(), v.len()] {
            if found != expected {
                return Err(CubeError::Length { expected, found });
            }
        }
        let products = means.iter().zip(v).map(|(w, v)| w.to_f64() * v.to_f64());
        Ok(Self {
            weight,
            means,
            mesh,
            functions,
            value: products.sum::<f64>() / mesh.cells() as f64,
        })
    }

    /// Σ_ia v_ia w_ia/n, which is (v, Φ) as far as the w_ia are the means of w ψ_ia.
    #[must_use]
    pub const fn of_means(&self) -> f64 {
        self.value
    }

    /// The estimate of (v, Φ) from a start x0, from φ(x0) and v(x0).
    pub fn control(&self, x0: &Located<[F; D]>, phi: F, v: F) -> f64 {
        let functions = self.functions.count();
        let first = x0.cell.saturating_mul(functions);
        let block = self.means.get(first..first.saturating_add(functions));
        let near = block.map_or(f64::NAN, |w| self.functions.sum(&self.mesh, x0, w));
        self.value + (phi.to_f64() - near) * v.to_f64()
    }
}

impl<F, const D: usize, K, S, W, const B: usize> Functional<Cube<F, D, K, S, B>>
    for Weighted<'_, F, D, W>
where
    F: Real,
    W: ScalarField<F, D>,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> ([F; D], F) {
        let x: [F; D] = from_fn(|_| uniforms.uniform());
        (x, self.weight.value(&x))
    }

    fn control_estimate(&self, x0: &Located<[F; D]>, phi: F, v: F) -> f64 {
        self.control(x0, phi, v)
    }
}
