//! What several tests have.

#![allow(dead_code, reason = "no test needs all of it")]

use fredholm_core::galerkin::{Basis, Cells, TransitionMoments};
use fredholm_core::resolvent::Regular;
use fredholm_core::{Chain, Density, Equation, Located, Space, Uniforms};

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

/// An equation on so many equal cells of [0, 1] by its kernel and its source, whose chain jumps to uniform points.
pub(crate) struct Interval {
    pub(crate) cells: usize,
    pub(crate) kernel: fn(f64, f64) -> f64,
    pub(crate) source: fn(f64) -> f64,
}

impl Interval {
    pub(crate) fn width(&self) -> f64 {
        1.0 / self.cells as f64
    }
}

impl Space for Interval {
    type Scalar = f64;
    type Point = f64;
}

impl Chain for Interval {
    fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
        Some(uniforms.uniform())
    }
}

impl Density for Interval {
    fn density(&self, _: &f64, _: &f64) -> f64 {
        1.0
    }
}

impl Equation for Interval {
    type Value = f64;

    fn kernel(&self, x: &f64, y: &f64) -> f64 {
        (self.kernel)(*x, *y)
    }

    fn source<U: Uniforms<f64>>(&self, x: &f64, _: &mut U) -> f64 {
        (self.source)(*x)
    }
}

impl Cells for Interval {
    const DIMENSION: usize = 1;

    fn cells(&self) -> usize {
        self.cells
    }

    fn locate(&self, x: &f64) -> usize {
        ((x * self.cells as f64) as usize).min(self.cells - 1)
    }

    fn measure(&self, _: usize) -> f64 {
        self.width()
    }

    fn point(&self, cell: usize, t: &[f64]) -> f64 {
        (cell as f64 + t[0]) * self.width()
    }

    fn parameters(&self, x: &Located<f64>, t: &mut [f64]) {
        t[0] = x.point * self.cells as f64 - x.cell as f64;
    }

    fn at(&self, coordinates: &[f64]) -> Option<f64> {
        match *coordinates {
            [x] if (0.0..=1.0).contains(&x) => Some(x),
            _ => None,
        }
    }
}

impl<const B: usize> Basis<B> for Interval {}

impl<const B: usize> TransitionMoments<B> for Interval {
    fn moments(&self, _: &Located<f64>, _: usize) -> [[f64; B]; B] {
        let mass = self.width();
        core::array::from_fn(|a| core::array::from_fn(|b| if a == b { mass } else { 0.0 }))
    }
}
