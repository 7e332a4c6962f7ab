//! What the checks need to know of the circle.

use core::f64::consts::TAU;

use fredholm_circle::{Circle, Emission, Point};
use fredholm_core::Real;
use fredholm_core::galerkin::Partition;

use crate::quadrature::{Quadrature, gauss_legendre};

impl<F: Real, E: Emission<F>> Quadrature for Circle<'_, F, E> {
    fn nodes(&self, x: &Point<F>, j: usize) -> Vec<(Point<F>, f64)> {
        let width = TAU / self.cells() as f64;
        let (left, right) = (j as f64 * width, (j + 1) as f64 * width);
        // p(x, ·) has a kink at x.
        let kink = x.angle().to_f64().clamp(left, right);
        let rule = gauss_legendre(16);
        let part = |from: f64, to: f64| {
            rule.iter()
                .filter(move |_| from < to)
                .map(move |&(t, w)| (self.point(from + t * (to - from)), w * (to - from)))
        };
        part(left, kink).chain(part(kink, right)).collect()
    }

    fn inside(&self, j: usize, t: f64) -> Point<F> {
        self.point(TAU * ((j as f64 + t) / self.cells() as f64))
    }
}
