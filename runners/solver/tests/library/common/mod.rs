//! What several tests have.

use fredholm_core::galerkin::{Basis, Cells, TransitionMoments};
use fredholm_core::resolvent::Regular;
use fredholm_core::{Chain, Density, Equation, Located, Space, Uniforms};

/// Whether the long forms of the tests are asked for.
pub(crate) fn is_long() -> bool {
    std::env::var_os("FREDHOLM_LONG").is_some()
}

/// An equation on [0, 1] by its kernel, its source and its number of cells; as a chain, whose steps are uniform, and for resolvent walks.
#[derive(Clone, Copy)]
pub(crate) struct Line<K, S>(pub(crate) K, pub(crate) S, pub(crate) usize);

impl<K, S> Space for Line<K, S> {
    type Scalar = f64;
    type Point = f64;
}

impl<K, S> Chain for Line<K, S> {
    fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
        Some(uniforms.uniform())
    }
}

impl<K, S> Density for Line<K, S> {
    fn density(&self, _: &f64, _: &f64) -> f64 {
        1.0
    }
}

impl<K: Fn(f64, f64) -> f64, S: Fn(f64) -> f64> Equation for Line<K, S> {
    type Value = f64;

    fn kernel(&self, x: &f64, y: &f64) -> f64 {
        (self.0)(*x, *y)
    }

    fn source<U: Uniforms<f64>>(&self, x: &f64, _: &mut U) -> f64 {
        (self.1)(*x)
    }
}

impl<K, S> Cells for Line<K, S> {
    const DIMENSION: usize = 1;

    fn cells(&self) -> usize {
        self.2
    }

    fn locate(&self, x: &f64) -> usize {
        ((x * self.2 as f64) as usize).min(self.2 - 1)
    }

    fn measure(&self, _: usize) -> f64 {
        1.0 / self.2 as f64
    }

    fn point(&self, cell: usize, t: &[f64]) -> f64 {
        (cell as f64 + t[0]) * self.measure(cell)
    }

    fn parameters(&self, x: &Located<f64>, t: &mut [f64]) {
        t[0] = x.point * self.2 as f64 - x.cell as f64;
    }

    fn at(&self, x: &[f64]) -> Option<f64> {
        x.first().copied().filter(|x| (0.0..=1.0).contains(x))
    }
}

impl<K, S, const B: usize> Basis<B> for Line<K, S> {}

impl<K, S, const B: usize> TransitionMoments<B> for Line<K, S> {
    fn moments(&self, _: &Located<f64>, j: usize) -> [[f64; B]; B] {
        let mass = self.measure(j);
        core::array::from_fn(|a| core::array::from_fn(|b| if a == b { mass } else { 0.0 }))
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
