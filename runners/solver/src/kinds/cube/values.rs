//! The functions of a cube in one scalar, watched for values that are not finite.

use std::sync::Arc;

use fredholm_core::Real;
use fredholm_cube::{KernelFactors, KernelFn, ScalarField};

use super::functions::CubeValues;
use crate::custom::{Coordinates, Positions};
use crate::domain::{Domain, Position};
use crate::kinds::watch::Watch;

/// The functions of a cube in one scalar, as functions on [0, 1]^d.
pub(super) struct Values<F> {
    pub(super) values: Arc<dyn CubeValues<F>>,
    pub(super) domain: Domain<F>,
    pub(super) is_product: bool,
    pub(super) watch: Arc<Watch>,
}

impl<F: Real> Values<F> {
    /// The weight of this number, with respect to the measure of [0, 1]^d.
    pub(super) fn weight<const D: usize>(&self, number: usize, t: &[F; D]) -> F {
        let x = self.domain.point(t);
        let value = self.values.weight(number, &x);
        let value = self.watch.finite(value, || {
            format!("`weight` is {value} at x = {}", Coordinates(&x))
        });
        self.domain.times_volume(value, t)
    }

    /// The known solution.
    pub(super) fn solution<const D: usize>(&self, t: &[F; D]) -> F {
        let x = self.domain.point(t);
        let value = self.values.solution(&x);
        self.watch.finite(value, || {
            format!("`solution` is {value} at x = {}", Coordinates(&x))
        })
    }
}

/// Where points of a cube lie in its domain.
pub(super) struct InDomain<F>(pub(super) Arc<Values<F>>);

impl<F: Real, const D: usize> Positions<[F; D]> for InDomain<F> {
    fn position(&self, t: &[F; D]) -> Position {
        self.0.domain.position(t)
    }

    fn refuse(&self, what: String) {
        self.0.watch.note(|| what);
    }
}

/// The kernel of a cube.
#[derive(Clone)]
pub(super) struct Kernel<F>(pub(super) Arc<Values<F>>);

/// The source of a cube.
#[derive(Clone)]
pub(super) struct Source<F>(pub(super) Arc<Values<F>>);

impl<F: Real, const D: usize> KernelFn<F, D> for Kernel<F> {
    #[inline]
    fn kernel(&self, x: &[F; D], y: &[F; D]) -> F {
        let own = &*self.0;
        if own.is_product {
            let factor = |a: usize| self.factor(a, x[a], y[a]);
            return (0..D).map(factor).fold(F::one(), |k, factor| k * factor);
        }
        let [at_x, at_y] = [x, y].map(|t| own.domain.point(t));
        let value = own.values.kernel(&at_x, &at_y);
        let value = own
            .watch
            .kernel(value, [&at_x, &at_y], || "`kernel`".to_owned());
        own.domain.times_volume(value, y)
    }
}

impl<F: Real> KernelFactors<F> for Kernel<F> {
    #[inline]
    fn factor(&self, axis: usize, x: F, y: F) -> F {
        let own = &*self.0;
        let [at_x, at_y] = [x, y].map(|t| own.domain.coordinate(axis, t));
        let value = own.values.factor(axis, at_x, at_y);
        let name = || format!("`kernel_factors[{axis}]`");
        let value = own.watch.kernel(value, [&[at_x], &[at_y]], name);
        own.domain.times_length(axis, value, y)
    }
}

impl<F: Real, const D: usize> ScalarField<F, D> for Source<F> {
    #[inline]
    fn value(&self, t: &[F; D]) -> F {
        let x = self.0.domain.point(t);
        let value = self.0.values.source(&x);
        self.0.watch.finite(value, || {
            format!("`source` is {value} at x = {}", Coordinates(&x))
        })
    }
}
