//! Product kernels.

use fredholm_core::Real;
use fredholm_core::array::from_fn;

use crate::{KernelFn, KernelIntegral};

/// The factors of a product kernel K(x,y) = Π_a K_a(x_a, y_a).
///
/// Every closure `Fn(usize, F, F) -> F` gives them. With [`Product`] around it, it is a kernel whose
/// Galerkin coefficients are products, too: D tables of m² numbers in place of one of m^2D.
pub trait KernelFactors<F> {
    /// K_a(x_a, y_a) for the axis a, counted from 0.
    fn factor(&self, axis: usize, x: F, y: F) -> F;
}

impl<F, T: Fn(usize, F, F) -> F> KernelFactors<F> for T {
    #[inline]
    fn factor(&self, axis: usize, x: F, y: F) -> F {
        self(axis, x, y)
    }
}

/// Exact integrals of the factors; see [`KernelIntegral`].
pub trait FactorIntegral<F>: KernelFactors<F> {
    /// ∫ K_a(x_a, y) dy over low ≤ y ≤ high.
    fn factor_integral(&self, axis: usize, x: F, low: F, high: F) -> F;
}

/// The kernel with these factors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Product<T>(pub T);

impl<F: Real, const D: usize, T: KernelFactors<F>> KernelFn<F, D> for Product<T> {
    #[inline]
    fn kernel(&self, x: &[F; D], y: &[F; D]) -> F {
        product(from_fn::<_, D>(|a| self.0.factor(a, x[a], y[a])))
    }
}

impl<F: Real, const D: usize, T: FactorIntegral<F>> KernelIntegral<F, D> for Product<T> {
    #[inline]
    fn integral(&self, x: &[F; D], low: &[F; D], high: &[F; D]) -> F {
        product(from_fn::<_, D>(|a| {
            self.0.factor_integral(a, x[a], low[a], high[a])
        }))
    }
}

#[inline]
pub(crate) fn product<F: Real, const D: usize>(factors: [F; D]) -> F {
    factors.into_iter().fold(F::one(), |p, factor| p * factor)
}
