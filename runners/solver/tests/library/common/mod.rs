//! What several tests have.

use std::sync::Arc;

use fredholm_core::galerkin::{Basis, Cells, TransitionMoments};
use fredholm_core::resolvent::Regular;
use fredholm_core::{
    Chain, DefaultGenerator, Density, Equation, Located, RngUniforms, Space, Uniforms, WalkSeeds,
};

/// Whether the long forms of the tests are asked for.
pub(crate) fn is_long() -> bool {
    std::env::var_os("FREDHOLM_LONG").is_some()
}

/// Random numbers of a problem of a family.
pub(crate) struct Draws(RngUniforms<DefaultGenerator>);

impl Draws {
    pub(crate) fn new(family: u64, number: u64) -> Self {
        let seeds = WalkSeeds::<DefaultGenerator>::new(family, 0);
        Self(RngUniforms(seeds.generator(number)))
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        let share: f64 = self.0.uniform();
        low + (high - low) * share
    }

    /// A normal number, by Box and Muller.
    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.between(0.0, 1.0)).ln()).sqrt();
        radius * (core::f64::consts::TAU * self.between(0.0, 1.0)).cos()
    }
}

/// An equation on [0, 1] by its kernel, its source and its number of cells; as a chain, whose steps are uniform, and for resolvent walks.
/// All such equations have one type, so that walks are compiled once for them.
#[derive(Clone)]
pub(crate) struct Line {
    kernel: Arc<dyn Fn(f64, f64) -> f64 + Send + Sync>,
    source: Arc<dyn Fn(f64) -> f64 + Send + Sync>,
    cells: usize,
}

impl Line {
    pub(crate) fn new(
        kernel: impl Fn(f64, f64) -> f64 + Send + Sync + 'static,
        source: impl Fn(f64) -> f64 + Send + Sync + 'static,
        cells: usize,
    ) -> Self {
        Self {
            kernel: Arc::new(kernel),
            source: Arc::new(source),
            cells,
        }
    }
}

impl Space for Line {
    type Scalar = f64;
    type Point = f64;
}

impl Chain for Line {
    fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
        Some(uniforms.uniform())
    }
}

impl Density for Line {
    fn density(&self, _: &f64, _: &f64) -> f64 {
        1.0
    }
}

impl Equation for Line {
    type Value = f64;

    fn kernel(&self, x: &f64, y: &f64) -> f64 {
        (self.kernel)(*x, *y)
    }

    fn source<U: Uniforms<f64>>(&self, x: &f64, _: &mut U) -> f64 {
        (self.source)(*x)
    }
}

impl Cells for Line {
    const DIMENSION: usize = 1;

    fn cells(&self) -> usize {
        self.cells
    }

    fn locate(&self, x: &f64) -> usize {
        ((x * self.cells as f64) as usize).min(self.cells - 1)
    }

    fn measure(&self, _: usize) -> f64 {
        1.0 / self.cells as f64
    }

    fn point(&self, cell: usize, t: &[f64]) -> f64 {
        (cell as f64 + t[0]) * self.measure(cell)
    }

    fn parameters(&self, x: &Located<f64>, t: &mut [f64]) {
        t[0] = x.point * self.cells as f64 - x.cell as f64;
    }

    fn at(&self, x: &[f64]) -> Option<f64> {
        x.first().copied().filter(|x| (0.0..=1.0).contains(x))
    }
}

impl<const B: usize> Basis<B> for Line {}

impl<const B: usize> TransitionMoments<B> for Line {
    fn moments(&self, _: &Located<f64>, j: usize) -> [[f64; B]; B] {
        let mass = self.measure(j);
        core::array::from_fn(|a| core::array::from_fn(|b| if a == b { mass } else { 0.0 }))
    }
}

impl Regular for Line {
    fn kernel(&self, x: &f64, y: &f64) -> f64 {
        (self.kernel)(*x, *y)
    }

    fn source(&self, x: &f64) -> f64 {
        (self.source)(*x)
    }
}
