//! The formulas of a cube as the functions of a model.

use std::sync::Arc;

use fredholm::cube::{CubeFunctions, CubeValues};
use fredholm_core::Real;

use super::{Cube, KernelText};
use crate::Placed;
use crate::formula::Formula;

/// The formulas of a cube and of the weights of its targets, which validation has accepted.
pub(super) struct Formulas {
    pub(super) cube: Cube,
    /// Both ends of the interval of every axis; none for [0, 1]^d.
    pub(super) domain: Vec<[f64; 2]>,
    pub(super) weights: Vec<String>,
}

/// The formulas in one scalar; what validation has refused is left out.
struct Compiled<F: Real> {
    kernel: Vec<Formula<F>>,
    weights: Vec<Formula<F>>,
    source: Option<Formula<F>>,
    solution: Option<Formula<F>>,
}

impl<F: Real> Compiled<F> {
    fn new(formulas: &Formulas) -> Self {
        let cube = &formulas.cube;
        let parameters = &cube.space.parameters.value;
        let compiled = |text: &String| Formula::new(text, parameters).ok();
        let placed = |text: &Placed<String>| compiled(&text.value);
        Self {
            kernel: cube.kernel.texts().iter().filter_map(placed).collect(),
            weights: formulas.weights.iter().filter_map(compiled).collect(),
            source: placed(&cube.source),
            solution: cube.solution.as_ref().and_then(placed),
        }
    }
}

/// The value of a formula; NaN without it.
#[inline]
fn value<F: Real>(formula: Option<&Formula<F>>, x: &[F], y: &[F]) -> F {
    formula.map_or(F::NAN, |formula| formula.value(x, y))
}

impl<F: Real> CubeValues<F> for Compiled<F> {
    #[inline]
    fn kernel(&self, x: &[F], y: &[F]) -> F {
        value(self.kernel.first(), x, y)
    }
    #[inline]
    fn factor(&self, axis: usize, x: F, y: F) -> F {
        value(self.kernel.get(axis), &[x], &[y])
    }
    #[inline]
    fn source(&self, x: &[F]) -> F {
        value(self.source.as_ref(), x, &[])
    }
    #[inline]
    fn solution(&self, x: &[F]) -> F {
        value(self.solution.as_ref(), x, &[])
    }
    #[inline]
    fn weight(&self, number: usize, x: &[F]) -> F {
        value(self.weights.get(number), x, &[])
    }
}

impl CubeFunctions for Formulas {
    fn dimension(&self) -> usize {
        self.cube.space.dimension.value
    }

    fn domain(&self) -> &[[f64; 2]] {
        &self.domain
    }

    fn is_product(&self) -> bool {
        matches!(self.cube.kernel, KernelText::Factors(_))
    }

    fn has_solution(&self) -> bool {
        self.cube.solution.is_some()
    }

    fn weights(&self) -> &[String] {
        &self.weights
    }

    fn seconds(&self) -> [f64; 2] {
        let own = Compiled::<f64>::new(self);
        let kernel = own.kernel.iter().map(Formula::seconds).sum();
        [kernel, own.source.as_ref().map_or(0.0, Formula::seconds)]
    }

    fn in_f64(self: Arc<Self>) -> Arc<dyn CubeValues<f64>> {
        Arc::new(Compiled::<f64>::new(&self))
    }

    fn in_f32(self: Arc<Self>) -> Arc<dyn CubeValues<f32>> {
        Arc::new(Compiled::<f32>::new(&self))
    }
}
