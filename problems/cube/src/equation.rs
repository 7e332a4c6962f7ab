//! What a user gives: kernel and functions, as closures or as types.

/// The kernel K of u(x) = ∫ K(x,y) u(y) dy + F(x) on [0, 1]^D.
///
/// Every closure `Fn(&[F; D], &[F; D]) -> F` is one, with the types of its arguments written out. A
/// type that is one for every [`Real`](fredholm_core::Real) walks in `f32` and is set up in `f64`.
pub trait KernelFn<F, const D: usize> {
    /// K(x, y).
    fn kernel(&self, x: &[F; D], y: &[F; D]) -> F;
}

impl<F, const D: usize, T: Fn(&[F; D], &[F; D]) -> F> KernelFn<F, D> for T {
    #[inline]
    fn kernel(&self, x: &[F; D], y: &[F; D]) -> F {
        self(x, y)
    }
}

/// A function on [0, 1]^D: a source, a weight, a known solution. Every closure `Fn(&[F; D]) -> F` is
/// one.
pub trait ScalarField<F, const D: usize> {
    /// The value at `x`.
    fn value(&self, x: &[F; D]) -> F;
}

impl<F, const D: usize, T: Fn(&[F; D]) -> F> ScalarField<F, D> for T {
    #[inline]
    fn value(&self, x: &[F; D]) -> F {
        self(x)
    }
}

/// Exact integrals of a kernel over boxes: with them a pair of cells may be pointwise, which is
/// where a kernel with a kink or a jump along the diagonal wants its diagonal.
///
/// **Exact** up to rounding: an error here is a bias.
pub trait KernelIntegral<F, const D: usize>: KernelFn<F, D> {
    /// ∫ K(x, y) dy over low_a ≤ y_a ≤ high_a.
    fn integral(&self, x: &[F; D], low: &[F; D], high: &[F; D]) -> F;
}
