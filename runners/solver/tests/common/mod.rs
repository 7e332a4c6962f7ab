//! What several tests have.

use fredholm_core::galerkin::Cells;
use fredholm_core::resolvent::Regular;
use fredholm_core::{Located, Space};

/// An equation on [0, 1] by its kernel and its source.
#[derive(Clone, Copy)]
pub(crate) struct Line<K, S>(pub(crate) K, pub(crate) S);

impl<K, S> Space for Line<K, S> {
    type Scalar = f64;
    type Point = f64;
}

impl<K, S> Cells for Line<K, S> {
    const DIMENSION: usize = 1;

    fn cells(&self) -> usize {
        1
    }

    fn locate(&self, _: &f64) -> usize {
        0
    }

    fn measure(&self, _: usize) -> f64 {
        1.0
    }

    fn point(&self, _: usize, t: &[f64]) -> f64 {
        t[0]
    }

    fn parameters(&self, x: &Located<f64>, t: &mut [f64]) {
        t[0] = x.point;
    }

    fn at(&self, x: &[f64]) -> Option<f64> {
        x.first().copied()
    }
}

impl<K: Fn(f64, f64) -> f64, S: Fn(f64) -> f64> Regular for Line<K, S> {
    fn kernel(&self, x: &f64, y: &f64) -> f64 {
        (self.0)(*x, *y)
    }

    fn source(&self, x: &f64) -> f64 {
        (self.1)(*x)
    }
}
