//! The formulas of one equation as the functions of a model.

use std::sync::Arc;

use fredholm::cube::{CubeFunctions, CubeValues};
use fredholm_core::Real;

use super::{Formula, Parameter};

/// The formulas of an equation on a cube, which [`check`](super::check) has accepted.
///
/// ```
/// use std::sync::Arc;
///
/// use fredholm::cube::CubeFunctions;
/// use fredholm_file::formula::Formulas;
///
/// let formulas = Formulas {
///     dimension: 1,
///     domain: vec![],
///     is_product: false,
///     kernel: vec!["0.5 * exp(-(x - y)^2)".to_owned()],
///     source: "1 + x".to_owned(),
///     solution: None,
///     weights: vec![],
///     parameters: vec![],
/// };
/// assert_eq!(Arc::new(formulas).in_f64().source(&[0.5]), 1.5);
/// ```
#[derive(Clone, Debug)]
pub struct Formulas {
    /// d, from 1 to 6.
    pub dimension: usize,
    /// Both ends of the interval of every axis; none for [0, 1]^d.
    pub domain: Vec<[f64; 2]>,
    /// Whether the kernel is a product of one factor per axis.
    pub is_product: bool,
    /// K(x, y), or its factors, one of each axis.
    pub kernel: Vec<String>,
    /// F(x).
    pub source: String,
    /// u(x), if it is known.
    pub solution: Option<String>,
    /// Weights of functionals, in x.
    pub weights: Vec<String>,
    /// Numbers that all of these know by a name.
    pub parameters: Vec<Parameter>,
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
        let one = |text: &String| Formula::new(text, &formulas.parameters).ok();
        let all = |texts: &[String]| texts.iter().filter_map(one).collect();
        Self {
            kernel: all(&formulas.kernel),
            weights: all(&formulas.weights),
            source: one(&formulas.source),
            solution: formulas.solution.as_ref().and_then(one),
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
        self.dimension
    }

    fn domain(&self) -> &[[f64; 2]] {
        &self.domain
    }

    fn is_product(&self) -> bool {
        self.is_product
    }

    fn has_solution(&self) -> bool {
        self.solution.is_some()
    }

    fn weights(&self) -> &[String] {
        &self.weights
    }

    fn seconds(&self) -> [f64; 2] {
        let own = Compiled::<f64>::new(self);
        let of = |formula: &Formula<f64>| formula.seconds();
        let kernel = own.kernel.iter().map(of).sum();
        [kernel, own.source.as_ref().map_or(0.0, of)]
    }

    fn in_f64(self: Arc<Self>) -> Arc<dyn CubeValues<f64>> {
        Arc::new(Compiled::<f64>::new(&self))
    }

    fn in_f32(self: Arc<Self>) -> Arc<dyn CubeValues<f32>> {
        Arc::new(Compiled::<f32>::new(&self))
    }
}
