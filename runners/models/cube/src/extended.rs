//! Equations of closures, and what is known of an equation besides its kernel and its source.

use core::any::Any;
use std::sync::Arc;

use fredholm_core::Real;

use super::closures::{Closures, Factors, in_double};
use super::compiled::CompiledWalks;
use super::{CubeFunctions, CubeModel, CubeValues};
use fredholm_model::Field;

/// ∫ K(x, t) dt up to y, by the number of the axis.
type Primitive = dyn Fn(usize, f64, f64) -> f64 + Send + Sync;

/// What is known of an equation besides its kernel and its source.
#[derive(Clone, Default)]
pub(super) struct Known {
    domain: Vec<[f64; 2]>,
    integral: Option<Arc<Primitive>>,
    solution: Option<Arc<Field>>,
}

/// An equation of which more is known.
struct Extended {
    functions: Arc<dyn CubeFunctions>,
    known: Known,
}

impl CubeModel {
    /// Creates the equation u(x) = ∫ K(x,y) u(y) dy + F(x) on [0, 1]^D of a kernel K and a source F, with D from 1 to 6.
    /// They are called in double precision, also by walks in f32; walks in f64 are compiled for them.
    ///
    /// ```
    /// use fredholm::{CubeModel, Solver};
    ///
    /// // u(x) = ∫₀¹ ½ x y u(y) dy + x, whose solution is 6x/5.
    /// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    /// let report = Solver::new(&u).at(0.5).cells(10).degree(1).walks(10_000).solve()?;
    /// let u = report.goals[0].preconditioned;
    /// assert!((u.estimate.unwrap() - 0.6).abs() < 1e-12);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    #[must_use]
    pub fn from_fn<const D: usize>(
        kernel: impl Fn(&[f64; D], &[f64; D]) -> f64 + Send + Sync + 'static,
        source: impl Fn(&[f64; D]) -> f64 + Send + Sync + 'static,
    ) -> Self {
        const { assert!(1 <= D && D <= 6, "a cube has from 1 to 6 dimensions") }
        let closures = Arc::new(Closures { kernel, source });
        let mut model = Self::new(closures.clone());
        let compiled: Arc<dyn CompiledWalks<f64, D>> = closures;
        model.compiled = Some(Box::new(compiled));
        model
    }

    /// Creates the equation of a product kernel K(x,y) = Π_a K_a(x_a, y_a) on [0, 1]^D: `factor` is K_a(x_a, y_a) by the
    /// number of the axis. Tables then have the size of an axis, so that there may be many more cells.
    ///
    /// ```
    /// use fredholm::{CubeModel, Solver};
    ///
    /// // u(x) = ½ ∫ exp(−|x − y|²) u(y) dy + 1 on [0, 1]³.
    /// let factor = |axis, x: f64, y: f64| (if axis == 0 { 0.5 } else { 1.0 }) * (-(x - y).powi(2)).exp();
    /// let u = CubeModel::from_factors::<3>(factor, |_| 1.0);
    /// let report = Solver::new(&u).mean().cells(20).walks(10_000).solve()?;
    /// assert_eq!(report.unknowns, 8000);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    #[must_use]
    pub fn from_factors<const D: usize>(
        factor: impl Fn(usize, f64, f64) -> f64 + Send + Sync + 'static,
        source: impl Fn(&[f64; D]) -> f64 + Send + Sync + 'static,
    ) -> Self {
        const { assert!(1 <= D && D <= 6, "a cube has from 1 to 6 dimensions") }
        Self::new(Arc::new(Factors { factor, source }))
    }

    /// Moves the equation from [0, 1]^d to the product of these intervals, one for each axis: kernel and source are
    /// functions of points there, and the measure is dy there.
    ///
    /// ```
    /// use fredholm::{CubeModel, Solver};
    ///
    /// // u(x) = ∫₋₁¹ ¼ u(y) dy + x², whose solution is x² + ⅓.
    /// let u = CubeModel::from_fn::<1>(|_, _| 0.25, |x| x[0] * x[0]).on([[-1.0, 1.0]]);
    /// let report = Solver::new(&u).at(-0.5).cells(10).degree(2).walks(1000).solve()?;
    /// assert!((report.goals[0].preconditioned.estimate.unwrap() - 7.0 / 12.0).abs() < 1e-12);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    #[must_use]
    pub fn on(self, intervals: impl Into<Vec<[f64; 2]>>) -> Self {
        let domain = intervals.into();
        self.knowing(|known| known.domain = domain)
    }

    /// Adds the exact integral of the kernel: `primitive` is ∫ K(x, t) dt from anywhere up to y, in one dimension; of a
    /// product kernel that of the factor on an axis. Pairs may then be pointwise, and the kernel singular at x = y.
    ///
    /// ```
    /// use fredholm::{CubeModel, Pairs, Solver};
    ///
    /// // K = ½|x − y|, and its primitive.
    /// let primitive = |_, x: f64, y: f64| 0.25 * (y - x) * (y - x).abs();
    /// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * (x[0] - y[0]).abs(), |_| 1.0).with_integral(primitive);
    /// let solver = Solver::new(&u).mean().cells(20).walks(10_000);
    /// let [all, none] = [Pairs::Pointwise, Pairs::Paper].map(|pairs| solver.clone().pairs(pairs).solve());
    /// assert!(all?.goals[0].preconditioned.std_error < none?.goals[0].preconditioned.std_error);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    #[must_use]
    pub fn with_integral(
        self,
        primitive: impl Fn(usize, f64, f64) -> f64 + Send + Sync + 'static,
    ) -> Self {
        self.knowing(|known| known.integral = Some(Arc::new(primitive)))
    }

    /// Adds the known solution, with which reports compare.
    ///
    /// ```
    /// use fredholm::{CubeModel, Solver};
    ///
    /// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]).with_solution(|x| 1.2 * x[0]);
    /// let report = Solver::new(&u).at(0.5).mean().walks(1000).solve()?;
    /// assert!((report.goals[0].exact.unwrap() - 0.6).abs() < 1e-15 && report.goals[1].z.is_some());
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    #[must_use]
    pub fn with_solution(self, solution: impl Fn(&[f64]) -> f64 + Send + Sync + 'static) -> Self {
        self.knowing(|known| known.solution = Some(Arc::new(solution)))
    }

    /// Adds what is known to what was known before.
    fn knowing(mut self, add: impl FnOnce(&mut Known)) -> Self {
        add(&mut self.known);
        // What is compiled knows the points of [0, 1]^d alone.
        let compiled = self.compiled.filter(|_| self.known.domain.is_empty());
        let functions = Arc::new(Extended {
            functions: self.base.clone(),
            known: self.known.clone(),
        });
        Self {
            base: self.base,
            known: self.known,
            compiled,
            ..Self::new(functions)
        }
    }

    /// Walks that are compiled for the equation, if there are some.
    pub(super) fn compiled<const D: usize>(&self) -> Option<&dyn CompiledWalks<f64, D>> {
        let compiled: &(dyn Any + Send + Sync) = self.compiled.as_deref()?;
        let compiled = compiled.downcast_ref::<Arc<dyn CompiledWalks<f64, D>>>()?;
        Some(&**compiled)
    }
}

impl CubeFunctions for Extended {
    fn dimension(&self) -> usize {
        self.functions.dimension()
    }

    fn domain(&self) -> &[[f64; 2]] {
        match self.known.domain.as_slice() {
            [] => self.functions.domain(),
            domain => domain,
        }
    }

    fn is_product(&self) -> bool {
        self.functions.is_product()
    }

    fn has_integral(&self) -> bool {
        self.known.integral.is_some() || self.functions.has_integral()
    }

    fn has_solution(&self) -> bool {
        self.known.solution.is_some() || self.functions.has_solution()
    }

    fn weights(&self) -> usize {
        self.functions.weights()
    }

    fn weight_text(&self, number: usize) -> Option<&str> {
        self.functions.weight_text(number)
    }

    fn seconds(&self) -> [f64; 3] {
        let [kernel, integral, source] = self.functions.seconds();
        let integral = match self.known.integral {
            Some(_) => kernel,
            None => integral,
        };
        [kernel, integral, source]
    }

    fn with_f64(&self, then: &mut dyn FnMut(&dyn CubeValues<f64>)) {
        let known = &self.known;
        self.functions
            .with_f64(&mut |values| then(&ExtendedValues { values, known }));
    }

    fn with_f32(&self, then: &mut dyn FnMut(&dyn CubeValues<f32>)) {
        let known = &self.known;
        self.functions
            .with_f32(&mut |values| then(&ExtendedValues { values, known }));
    }
}

/// The values of an equation of which more is known.
struct ExtendedValues<'a, F> {
    values: &'a dyn CubeValues<F>,
    known: &'a Known,
}

impl<F: Real> CubeValues<F> for ExtendedValues<'_, F> {
    fn kernel(&self, x: &[F], y: &[F]) -> F {
        self.values.kernel(x, y)
    }

    fn factor(&self, axis: usize, x: F, y: F) -> F {
        self.values.factor(axis, x, y)
    }

    fn integral(&self, axis: usize, x: F, y: F) -> F {
        match &self.known.integral {
            Some(primitive) => F::from_f64(primitive(axis, x.to_f64(), y.to_f64())),
            None => self.values.integral(axis, x, y),
        }
    }

    fn source(&self, x: &[F]) -> F {
        self.values.source(x)
    }

    fn solution(&self, x: &[F]) -> F {
        match &self.known.solution {
            Some(solution) => F::from_f64(in_double(x, |x| solution(x))),
            None => self.values.solution(x),
        }
    }

    fn weight(&self, number: usize, x: &[F]) -> F {
        self.values.weight(number, x)
    }
}
