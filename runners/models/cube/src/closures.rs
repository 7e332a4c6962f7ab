//! Equations on a cube whose functions are closures.

use fredholm_core::Real;

use super::functions::{CubeFunctions, CubeValues};

/// Seconds of a value of a closure, for the choice: as of a kernel with an elementary function.
const VALUE: f64 = 10e-9;

/// The largest dimension of a cube.
const MOST_DIMENSIONS: usize = 6;

/// Kernel and source of an equation on [0, 1]^D in double precision.
pub(super) struct Closures<K, S, const D: usize> {
    pub(super) kernel: K,
    pub(super) source: S,
}

impl<K, S, const D: usize> Closures<K, S, D>
where
    K: Fn(&[f64; D], &[f64; D]) -> f64,
    S: Fn(&[f64; D]) -> f64,
{
    fn kernel_in<F: Real>(&self, x: &[F], y: &[F]) -> F {
        match (exact::<F, D>(x), exact::<F, D>(y)) {
            (Some(x), Some(y)) => F::from_f64((self.kernel)(&x, &y)),
            _ => F::NAN,
        }
    }

    fn source_in<F: Real>(&self, x: &[F]) -> F {
        exact::<F, D>(x).map_or(F::NAN, |x| F::from_f64((self.source)(&x)))
    }
}

/// The value of a function of coordinates in double precision.
#[inline]
pub(super) fn in_double<F: Real>(x: &[F], function: impl FnOnce(&[f64]) -> f64) -> f64 {
    let mut exact = [0.0; MOST_DIMENSIONS];
    for (exact, x) in exact.iter_mut().zip(x) {
        *exact = x.to_f64();
    }
    exact.get(..x.len()).map_or(f64::NAN, function)
}

/// A point in double precision.
#[inline]
fn exact<F: Real, const D: usize>(x: &[F]) -> Option<[f64; D]> {
    let x: &[F; D] = x.first_chunk()?;
    Some(fredholm_core::array::from_fn(|a| x[a].to_f64()))
}

impl<K, S, const D: usize> CubeFunctions for Closures<K, S, D>
where
    K: Fn(&[f64; D], &[f64; D]) -> f64 + Send + Sync,
    S: Fn(&[f64; D]) -> f64 + Send + Sync,
{
    fn dimension(&self) -> usize {
        D
    }

    fn seconds(&self) -> [f64; 3] {
        [VALUE, 0.0, VALUE]
    }

    fn with_f64(&self, then: &mut dyn FnMut(&dyn CubeValues<f64>)) {
        then(self);
    }

    fn with_f32(&self, then: &mut dyn FnMut(&dyn CubeValues<f32>)) {
        then(self);
    }
}

impl<F: Real, K, S, const D: usize> CubeValues<F> for Closures<K, S, D>
where
    K: Fn(&[f64; D], &[f64; D]) -> f64 + Send + Sync,
    S: Fn(&[f64; D]) -> f64 + Send + Sync,
{
    fn kernel(&self, x: &[F], y: &[F]) -> F {
        self.kernel_in(x, y)
    }

    fn source(&self, x: &[F]) -> F {
        self.source_in(x)
    }
}

/// The factors of a product kernel by axis, and the source, of an equation on [0, 1]^D in double precision.
pub(super) struct Factors<K, S, const D: usize>
where
    S: Fn(&[f64; D]) -> f64,
{
    pub(super) factor: K,
    pub(super) source: S,
}

impl<K, S, const D: usize> CubeFunctions for Factors<K, S, D>
where
    K: Fn(usize, f64, f64) -> f64 + Send + Sync,
    S: Fn(&[f64; D]) -> f64 + Send + Sync,
{
    fn dimension(&self) -> usize {
        D
    }

    fn is_product(&self) -> bool {
        true
    }

    fn seconds(&self) -> [f64; 3] {
        [VALUE, 0.0, VALUE]
    }

    fn with_f64(&self, then: &mut dyn FnMut(&dyn CubeValues<f64>)) {
        then(self);
    }

    fn with_f32(&self, then: &mut dyn FnMut(&dyn CubeValues<f32>)) {
        then(self);
    }
}

impl<F: Real, K, S, const D: usize> CubeValues<F> for Factors<K, S, D>
where
    K: Fn(usize, f64, f64) -> f64 + Send + Sync,
    S: Fn(&[f64; D]) -> f64 + Send + Sync,
{
    fn kernel(&self, x: &[F], y: &[F]) -> F {
        let factors = x.iter().zip(y).enumerate();
        let factors = factors.map(|(axis, (x, y))| (self.factor)(axis, x.to_f64(), y.to_f64()));
        F::from_f64(factors.product())
    }

    fn factor(&self, axis: usize, x: F, y: F) -> F {
        F::from_f64((self.factor)(axis, x.to_f64(), y.to_f64()))
    }

    fn source(&self, x: &[F]) -> F {
        exact::<F, D>(x).map_or(F::NAN, |x| F::from_f64((self.source)(&x)))
    }
}
