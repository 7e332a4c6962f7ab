//! What an equation on a cube is given by.

use std::sync::Arc;

use fredholm_core::Real;
use fredholm_core::array::from_fn;

/// Seconds of a value of a closure, for the choice: as of a kernel with an elementary function.
const VALUE: f64 = 10e-9;

/// Kernel, source and what else is known of an equation on [0, 1]^d or another product of intervals, for walks in both
/// scalars.
pub trait CubeFunctions: Send + Sync {
    /// d, from 1 to 6.
    fn dimension(&self) -> usize;

    /// The ends of every axis' interval, the lower first; none for [0, 1]^d. An end may be infinite. All points are points of
    /// this domain, and the measure is dy on it.
    fn domain(&self) -> &[[f64; 2]] {
        &[]
    }

    /// Whether the kernel is a product of one factor for each axis.
    fn is_product(&self) -> bool {
        false
    }

    /// Whether the solution is known.
    fn has_solution(&self) -> bool {
        false
    }

    /// The texts of the weights, by their numbers.
    fn weights(&self) -> &[String] {
        &[]
    }

    /// Seconds of a value of the kernel, and of the source.
    fn seconds(&self) -> [f64; 2];

    /// The functions in f64.
    fn in_f64(self: Arc<Self>) -> Arc<dyn CubeValues<f64>>;

    /// The functions in f32.
    fn in_f32(self: Arc<Self>) -> Arc<dyn CubeValues<f32>>;
}

/// The values of a cube's functions in one scalar; x and y have d coordinates.
pub trait CubeValues<F: Real>: Send + Sync {
    /// K(x, y), if it is no product.
    fn kernel(&self, x: &[F], y: &[F]) -> F;

    /// F(x).
    fn source(&self, x: &[F]) -> F;

    /// The factor of the kernel on an axis; NaN if it is no product.
    fn factor(&self, axis: usize, x: F, y: F) -> F {
        let _ = (axis, x, y);
        F::NAN
    }

    /// u(x); NaN if it is not known.
    fn solution(&self, x: &[F]) -> F {
        let _ = x;
        F::NAN
    }

    /// The weight of this number in x; NaN if there is none.
    fn weight(&self, number: usize, x: &[F]) -> F {
        let _ = (number, x);
        F::NAN
    }
}

/// A kernel and a source as closures in double precision on [0, 1]^D.
pub(super) struct Closures<K, S, const D: usize> {
    pub(super) kernel: K,
    pub(super) source: S,
    /// The factors of a kernel that is a product, by the axis: then nobody asks the kernel.
    pub(super) factor: Option<Box<Factor>>,
}

/// The factor of a kernel on an axis.
pub(super) type Factor = dyn Fn(usize, f64, f64) -> f64 + Send + Sync;

/// A point in double precision; NaN where it has too few coordinates.
#[inline]
fn exact<F: Real, const D: usize>(x: &[F]) -> [f64; D] {
    from_fn(|a| x.get(a).map_or(f64::NAN, |x| x.to_f64()))
}

impl<K, S, const D: usize> CubeFunctions for Closures<K, S, D>
where
    K: Fn(&[f64; D], &[f64; D]) -> f64 + Send + Sync + 'static,
    S: Fn(&[f64; D]) -> f64 + Send + Sync + 'static,
{
    fn dimension(&self) -> usize {
        D
    }

    fn is_product(&self) -> bool {
        self.factor.is_some()
    }

    fn seconds(&self) -> [f64; 2] {
        [VALUE; 2]
    }

    fn in_f64(self: Arc<Self>) -> Arc<dyn CubeValues<f64>> {
        self
    }

    fn in_f32(self: Arc<Self>) -> Arc<dyn CubeValues<f32>> {
        self
    }
}

impl<F, K, S, const D: usize> CubeValues<F> for Closures<K, S, D>
where
    F: Real,
    K: Fn(&[f64; D], &[f64; D]) -> f64 + Send + Sync,
    S: Fn(&[f64; D]) -> f64 + Send + Sync,
{
    fn kernel(&self, x: &[F], y: &[F]) -> F {
        F::from_f64((self.kernel)(&exact(x), &exact(y)))
    }

    fn factor(&self, axis: usize, x: F, y: F) -> F {
        let factor = self.factor.as_ref();
        F::from_f64(factor.map_or(f64::NAN, |of| of(axis, x.to_f64(), y.to_f64())))
    }

    fn source(&self, x: &[F]) -> F {
        F::from_f64((self.source)(&exact(x)))
    }
}
