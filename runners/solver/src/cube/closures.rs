//! Equations on a cube whose functions are closures.

use fredholm_core::Real;

use super::functions::{CubeFunctions, CubeValues};

/// Seconds of a value of a closure, for the choice: as of a kernel with an elementary function.
const VALUE: f64 = 10e-9;

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

    fn is_product(&self) -> bool {
        false
    }

    fn has_integral(&self) -> bool {
        false
    }

    fn has_solution(&self) -> bool {
        false
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

    fn factor(&self, _: usize, _: F, _: F) -> F {
        F::NAN
    }

    fn integral(&self, _: usize, _: F, _: F) -> F {
        F::NAN
    }

    fn source(&self, x: &[F]) -> F {
        self.source_in(x)
    }

    fn solution(&self, _: &[F]) -> F {
        F::NAN
    }

    fn weight(&self, _: usize, _: &[F]) -> F {
        F::NAN
    }
}
