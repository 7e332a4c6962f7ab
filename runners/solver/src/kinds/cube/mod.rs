//! Equations on [0, 1]^d and other products of intervals, with dimension and sizes chosen at run time.

mod equation;
mod functions;
mod nystrom;
mod values;

use std::sync::{Arc, OnceLock};

use fredholm_core::Real;
use fredholm_model::resolvent::{ResolventFound, ResolventQuestion};
use fredholm_model::{About, Deterministic, Differentiated, Field, Quantity};

use super::derivatives::{Derivatives, Given};
use super::system;
use super::watch::Watch;
use crate::domain::{self, Domain};
use crate::{
    CustomModel, Discretisation, Error, Goal, Model, Pairs, Partitioned, Region, Subject, WeightFn,
};
pub use functions::{CubeFunctions, CubeValues};

use equation::{CubeEquation, base, with, with_degrees};
use functions::{Closures, Factor};
use values::{InDomain, Values};

/// The largest dimension.
const MOST_DIMENSIONS: usize = 6;

/// An equation on [0, 1]^d, or on another product of intervals: walks and cells are those of [0, 1]^d, points and
/// functions those of the domain.
///
/// ```
/// use fredholm::{CubeModel, Solver};
///
/// // u(x) = ¼ ∫∫ (x₁ + y₂) u(y) dy + 1 on [0, 1]².
/// let u = CubeModel::from_fn::<2>(|x, y| 0.25 * (x[0] + y[1]), |_| 1.0);
/// let report = Solver::new(&u).mean().solve_to(1e-6)?;
/// assert!((report.goals[0].preconditioned.estimate.unwrap() - 4.0 / 3.0).abs() < 1e-5);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
pub struct CubeModel {
    functions: Arc<dyn CubeFunctions>,
    /// The domain, in place of that of the functions.
    domain: Option<Vec<[f64; 2]>>,
    /// Coordinates on every axis where cells end.
    edges: Vec<Vec<f64>>,
    /// The solution, in place of that of the functions.
    solution: Option<Arc<Field>>,
    derivatives: Option<Arc<Derivatives>>,
    watch: Arc<Watch>,
    /// The equation in its dimension, once it is asked for.
    model: OnceLock<Box<dyn Model>>,
}

impl core::fmt::Debug for CubeModel {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("CubeModel")
            .field("dimension", &self.functions.dimension())
            .finish_non_exhaustive()
    }
}

impl CubeModel {
    /// The equation of these functions.
    #[must_use]
    pub fn new(functions: Arc<dyn CubeFunctions>) -> Self {
        Self {
            functions,
            domain: None,
            edges: Vec::new(),
            solution: None,
            derivatives: None,
            watch: Arc::default(),
            model: OnceLock::new(),
        }
    }

    /// Creates the equation u(x) = ∫ K(x,y) u(y) dy + F(x) on [0, 1]^D of a kernel K and a source F, with D from 1 to 6.
    /// They are called in double precision, also by walks in f32.
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
        Self::of_closures(kernel, source, None)
    }

    fn of_closures<const D: usize>(
        kernel: impl Fn(&[f64; D], &[f64; D]) -> f64 + Send + Sync + 'static,
        source: impl Fn(&[f64; D]) -> f64 + Send + Sync + 'static,
        factor: Option<Box<Factor>>,
    ) -> Self {
        const {
            assert!(
                1 <= D && D <= MOST_DIMENSIONS,
                "a cube has from 1 to 6 dimensions"
            );
        }
        Self::new(Arc::new(Closures {
            kernel,
            source,
            factor,
        }))
    }

    /// Creates the equation u(x) = ∫ K(x,y) u(y) dy + F(x) on an interval, whose ends may be infinite.
    ///
    /// ```
    /// use fredholm::{CubeModel, Solver};
    ///
    /// // u(x) = ∫₀^∞ ½ e^(−x−y) u(y) dy + e^−x, whose solution is ⁴⁄₃ e^−x.
    /// let u = CubeModel::on_interval([0.0, f64::INFINITY], |x, y| 0.5 * (-x - y).exp(), |x| (-x).exp());
    /// let report = Solver::new(&u).at(0.0).solve_to(1e-6)?;
    /// assert!((report[0].value() - 4.0 / 3.0).abs() < 1e-5);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    #[must_use]
    pub fn on_interval(
        [low, high]: [f64; 2],
        kernel: impl Fn(f64, f64) -> f64 + Send + Sync + 'static,
        source: impl Fn(f64) -> f64 + Send + Sync + 'static,
    ) -> Self {
        let model = Self::from_fn::<1>(move |[x], [y]| kernel(*x, *y), move |[x]| source(*x));
        match [low, high] {
            [0.0, 1.0] => model,
            ends => model.on([ends]),
        }
    }

    /// Creates the equation of a product kernel K(x,y) = Π_a K_a(x_a, y_a) on [0, 1]^D: `factor` is K_a(x_a, y_a) by the
    /// number of the axis. Tables of the walks of a chain then have the size of an axis, so that there may be many more cells.
    ///
    /// ```
    /// use fredholm::{CubeModel, Method, Solver};
    ///
    /// // u(x) = ½ ∫ exp(−|x − y|²) u(y) dy + 1 on [0, 1]³.
    /// let factor = |axis, x: f64, y: f64| (if axis == 0 { 0.5 } else { 1.0 }) * (-(x - y).powi(2)).exp();
    /// let u = CubeModel::from_factors::<3>(factor, |_| 1.0);
    /// let report = Solver::new(&u).method(Method::Walks).mean().cells(20).degree(0).walks(10_000).solve()?;
    /// assert_eq!(report.unknowns, 8000);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    #[must_use]
    pub fn from_factors<const D: usize>(
        factor: impl Fn(usize, f64, f64) -> f64 + Send + Sync + 'static,
        source: impl Fn(&[f64; D]) -> f64 + Send + Sync + 'static,
    ) -> Self {
        Self::of_closures(|_, _| f64::NAN, source, Some(Box::new(factor)))
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
        self.with(|own| own.domain = Some(intervals.into()))
    }

    /// Adds coordinates on every axis where cells of resolvent walks end, besides those where jumps are found.
    ///
    /// ```
    /// use fredholm::{CubeModel, Solver};
    ///
    /// // u = 1 + 2 [x < 0.001], of which the mean is 1.002: few points see the part that counts.
    /// let jump = |x: f64| if x < 0.001 { 3.0 } else { 1.0 };
    /// let u = CubeModel::from_fn::<1>(|_, _| 0.0, move |x| jump(x[0])).with_edges([vec![0.001]]);
    /// let report = Solver::new(&u).mean().solve()?;
    /// assert!((report[0].value() - 1.002).abs() < 1e-12);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    #[must_use]
    pub fn with_edges(self, edges: impl Into<Vec<Vec<f64>>>) -> Self {
        self.with(|own| own.edges = edges.into())
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
        self.with(|own| own.solution = Some(Arc::new(solution)))
    }

    /// Adds the derivatives of K and F by some quantities, for [`Solver::sensitivities`](crate::Solver::sensitivities). Components of an equation of one
    /// unknown function are 0.
    #[must_use]
    pub fn with_derivatives(self, derivatives: Derivatives) -> Self {
        self.with(|own| own.derivatives = Some(Arc::new(derivatives)))
    }

    /// This equation with a change, for which its model is made anew.
    fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self.model = OnceLock::new();
        self
    }

    fn ends(&self) -> &[[f64; 2]] {
        self.domain.as_deref().unwrap_or(self.functions.domain())
    }

    /// The interval of every axis.
    fn intervals(&self) -> Vec<[f64; 2]> {
        match self.ends() {
            [] => vec![[0.0, 1.0]; self.functions.dimension()],
            ends => ends.to_vec(),
        }
    }

    /// The functions in one scalar.
    fn values<F: Real>(&self, values: Arc<dyn CubeValues<F>>) -> Arc<Values<F>> {
        Arc::new(Values {
            values,
            domain: Domain::new(self.ends()),
            is_product: self.functions.is_product(),
            watch: self.watch.clone(),
        })
    }

    /// The equation in one scalar with all that is known of it.
    fn knowing<F: Real, const D: usize>(
        &self,
        mut model: CustomModel<CubeEquation<F, D>>,
        values: &Arc<Values<F>>,
    ) -> CustomModel<CubeEquation<F, D>> {
        for (number, text) in self.functions.weights().iter().enumerate() {
            let values = values.clone();
            model = model.weight(text, move |x| values.weight(number, x).to_f64());
        }
        let values = values.clone();
        model.with_positions(InDomain(values))
    }

    /// The equation in its dimension.
    fn model(&self) -> &dyn Model {
        macro_rules! in_dimension {
            ($($d:pat => $dimension:literal: $degrees:tt)*) => {
                match self.functions.dimension() {
                    $($d => {
                        let values = self.values(self.functions.clone().in_f64());
                        let singles = self.values(self.functions.clone().in_f32());
                        let single = self.knowing(with_degrees!($dimension, &singles, $degrees), &singles);
                        let model = self.knowing(with_degrees!($dimension, &values, $degrees), &values);
                        self.finished(model.with_f32(single), values)
                    })*
                }
            };
        }
        &**self.model.get_or_init(|| {
            in_dimension!(1 => 1: [0 1 2 3 4] 2 => 2: [0 1 2 3 4] 3 => 3: [0 1 2 3 4]
                          4 => 4: [0 1 2] 5 => 5: [0 1 2] _ => 6: [0 1 2])
        })
    }

    /// The equation with what walks in both scalars share.
    fn finished<const D: usize>(
        &self,
        model: CustomModel<CubeEquation<f64, D>>,
        values: Arc<Values<f64>>,
    ) -> Box<dyn Model> {
        let [kernel, _] = self.functions.seconds();
        let model = model
            .named("cube")
            .with_coordinates(self.intervals())
            .with_edges(values.domain.parameters(&self.edges))
            .with_kernel_seconds(kernel);
        let own = self.solution.clone();
        match own {
            Some(own) => {
                Box::new(model.with_solution(move |t: &[f64; D]| own(&values.domain.point(t))))
            }
            None if self.functions.has_solution() => {
                Box::new(model.with_solution(move |t| values.solution(t)))
            }
            None => Box::new(model),
        }
    }
}

impl Model for CubeModel {
    delegated!(model);

    fn about(&self) -> About {
        About {
            dimension: Some(self.functions.dimension()),
            less_memory: ": use fewer cells, or `kernel_factors` if the kernel is a product",
            ..self.model().about()
        }
    }

    fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
        for goal in goals {
            match &goal.region {
                Region::Point(x) => domain::check_point(x, &self.intervals())?,
                Region::Whole => domain::check_mean(self.ends())?,
                _ => {}
            }
        }
        self.model().check_goals(goals)
    }

    fn check(&self, discretisation: &Discretisation, pairs: Pairs) -> Result<(), Error> {
        let ends = self.ends();
        let fits = ends.is_empty() || ends.len() == self.functions.dimension();
        let (subject, message) = if !(fits && domain::are_intervals(ends)) {
            let message = "the domain is one interval for each axis, from a number, or -inf, to a larger one, or inf";
            (Subject::Problem, message)
        } else if pairs == Pairs::Pointwise {
            let message = "pointwise pairs need exact integrals of the kernel over cells, and a cube has none: leave `pairs` out";
            (Subject::Pairs, message)
        } else {
            return self.model().check(discretisation, pairs);
        };
        let message = message.to_owned();
        Err(Error::Option { subject, message })
    }

    fn by_resolvent(&self, question: &ResolventQuestion<'_>) -> Result<ResolventFound<'_>, Error> {
        let answer = self.model().by_resolvent(question);
        // It says where a value was no number.
        self.watch.check()?;
        answer
    }

    fn quantities(&self) -> Vec<Quantity> {
        let own = self.derivatives.as_ref();
        own.map_or(Vec::new(), |own| own.quantities.clone())
    }

    fn with_derivatives(&self, goals: &[Goal]) -> Result<Option<Differentiated>, Error> {
        let Some(derivatives) = &self.derivatives else {
            return Ok(None);
        };
        if self.functions.dimension() > system::MOST_DIMENSIONS {
            return Err(Error::Option {
                subject: Subject::Problem,
                message: format!(
                    "sensitivities are those of equations in up to {} dimensions: leave them out",
                    system::MOST_DIMENSIONS
                ),
            });
        }
        let [values, of_source, of_weights] = [(); 3].map(|()| self.functions.clone().in_f64());
        let is_product = self.functions.is_product();
        let given = Given {
            ends: self.intervals(),
            edges: &self.edges,
            components: 1,
            is_system: false,
            seconds: self.functions.seconds()[0],
            kernel: Arc::new(move |_, x, y| match is_product {
                true => (0..x.len())
                    .map(|axis| values.factor(axis, x[axis], y[axis]))
                    .product(),
                false => values.kernel(x, y),
            }),
            source: Arc::new(move |_, x| of_source.source(x)),
            derivatives,
        };
        let weight = |region: &Region| match region {
            Region::Weight(number) => {
                let (number, values) = (*number, of_weights.clone());
                Some((0, WeightFn::new(move |x| values.weight(number, x))))
            }
            Region::Function(weight) => Some((0, weight.clone())),
            _ => None,
        };
        given.with_derivatives(goals, &weight).map(Some)
    }

    fn explain(&self, error: Error) -> Error {
        self.watch.explain(error)
    }

    fn nystrom(&self) -> Result<Vec<Deterministic>, Error> {
        let values = self.values(self.functions.clone().in_f64());
        macro_rules! in_dimension {
            ($($d:pat => $dimension:literal),*) => {
                match self.functions.dimension() {
                    $($d => nystrom::solutions::<$dimension>(&values)),*
                }
            };
        }
        let solutions = in_dimension!(1 => 1, 2 => 2, 3 => 3, 4 => 4, 5 => 5, _ => 6);
        solutions.map_err(|error| self.explain(error))
    }
}
