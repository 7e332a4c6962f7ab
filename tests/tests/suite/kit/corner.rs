//! A problem that is right in all parts, with pairs in S that do not belong there.

use fredholm_core::galerkin::{Basis, Cells, TransitionMoments};
use fredholm_core::{Chain, Density, Equation, Located, Space, Uniforms};
use fredholm_tests::quadrature::gauss_legendre;
use fredholm_tests::{Description, Neighbours, Offers};

use super::{ALL, CELLS};

/// u(x) = ½ ∫ p(x,y) u(y) dy + 1 on [0, 1], where a step leads to the left half with probability x.
/// It is right in all parts; but as x goes to 0 the masses of the left half vanish, so that they do
/// not belong in S.
pub(super) struct Corner;

impl Space for Corner {
    type Scalar = f64;
    type Point = f64;
}
impl Chain for Corner {
    fn step<U: Uniforms<f64>>(&self, x: &f64, uniforms: &mut U) -> Option<f64> {
        let xi = uniforms.uniform();
        Some(if xi < *x {
            0.5 * xi / x
        } else {
            0.5 + 0.5 * (xi - x) / (1.0 - x)
        })
    }
}
impl Density for Corner {
    fn density(&self, x: &f64, y: &f64) -> f64 {
        2.0 * if *y < 0.5 { *x } else { 1.0 - x }
    }
}
impl Equation for Corner {
    type Value = f64;
    fn kernel(&self, _: &f64, _: &f64) -> f64 {
        0.5
    }
    fn source<U: Uniforms<f64>>(&self, _: &f64, _: &mut U) -> f64 {
        1.0
    }
}
impl Cells for Corner {
    const DIMENSION: usize = 1;

    fn cells(&self) -> usize {
        CELLS
    }
    fn locate(&self, x: &f64) -> usize {
        ((x * CELLS as f64) as usize).min(CELLS - 1)
    }
    fn measure(&self, _: usize) -> f64 {
        1.0 / CELLS as f64
    }
    fn point(&self, cell: usize, t: &[f64]) -> f64 {
        (cell as f64 + t[0]) / CELLS as f64
    }
    fn parameters(&self, x: &Located<f64>, t: &mut [f64]) {
        t[0] = x.point * CELLS as f64 - x.cell as f64;
    }
    fn at(&self, x: &[f64]) -> Option<f64> {
        x.first().copied()
    }
}
impl Basis for Corner {}
impl TransitionMoments for Corner {
    fn moments(&self, x: &Located<f64>, j: usize) -> [[f64; 1]; 1] {
        let middle = (j as f64 + 0.5) / CELLS as f64;
        [[self.density(&x.point, &middle) / CELLS as f64]]
    }
}
impl Description for Corner {
    type Equation = Self;

    fn equation(&self) -> &Self {
        self
    }
    fn contains(&self, cell: usize, x: &f64) -> bool {
        (x * CELLS as f64 - cell as f64 - 0.5).abs() <= 0.5 + 1e-14
    }
    fn nodes(&self, _: &f64, cell: usize) -> Vec<(f64, f64)> {
        let rule = gauss_legendre(4).into_iter();
        rule.map(|(t, w)| (self.point(cell, &[t]), w * self.measure(cell)))
            .collect()
    }
}

impl Neighbours for Corner {
    fn offers(&self, offers: &mut Offers<'_, Self>) {
        offers.pairs("all in S", ALL);
    }
}
