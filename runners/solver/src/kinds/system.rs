//! Systems of equations u_i(x) = Σ_j ∫ K_ij(x,y) u_j(y) dy + F_i(x) on a product of intervals.
//!
//! A system is one equation on m copies of the space: a state is (i, x), the measure is the sum of those of the copies, and the kernel from
//! (i, x) to (j, y) is K_ij(x, y). Nothing asks that cells touch.

use std::sync::{Arc, OnceLock};

use fredholm_core::array::from_fn;
use fredholm_core::galerkin::Cells;
use fredholm_core::resolvent::{Grid, Regular};
use fredholm_core::{Located, Space};
use fredholm_model::resolvent::{ResolventFound, ResolventQuestion};
use fredholm_model::{About, Differentiated, Quantity};

use super::derivatives::{Derivatives, Given};
use super::watch::Watch;
use crate::custom::Coordinates;
use crate::domain::{self, Domain};
use crate::{
    CustomModel, Discretisation, Error, Goal, Model, Pairs, Partitioned, Region, Subject,
    Uniformly, WeightFn,
};

/// The largest dimension.
pub const MOST_DIMENSIONS: usize = 3;
/// The most unknown functions.
pub const MOST_COMPONENTS: usize = 64;
/// Seconds of a value of a kernel or a source, unless the system says otherwise.
const SECONDS: f64 = 10e-9;

/// K_ij(x, y) by [i, j], x and y.
pub(super) type Kernels = dyn Fn([usize; 2], &[f64], &[f64]) -> f64 + Send + Sync;
/// F_i(x) or u_i(x) by i and x.
pub(super) type Components = dyn Fn(usize, &[f64]) -> f64 + Send + Sync;

/// A system of equations on a product of intervals, whose ends may be infinite. Components are counted from 0; the coordinates of a point are
/// those of x, and its component as it is counted from 1.
///
/// ```
/// use fredholm::{Region, Solver, SystemModel};
///
/// // u = 1 + 2∫₀¹ v and v = x + 2∫₀¹ u.
/// let kernel = |[i, j]: [usize; 2], _: &[f64], _: &[f64]| if i == j { 0.0 } else { 2.0 };
/// let source = |i: usize, x: &[f64]| if i == 0 { 1.0 } else { x[0] };
/// let system = SystemModel::new([[0.0, 1.0]], 2, kernel, source);
/// let report = Solver::new(&system).goal("mean of u", Region::Part(0)).at([0.25, 2.0]).solve_to(1e-9)?;
/// // Their means are −2/3 and −5/6.
/// assert!((report[0].value() + 2.0 / 3.0).abs() < 1e-8);
/// assert!((report[1].value() + 13.0 / 12.0).abs() < 1e-8);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
pub struct SystemModel {
    ends: Vec<[f64; 2]>,
    /// Coordinates on every axis where cells end.
    edges: Vec<Vec<f64>>,
    functions: Arc<Functions>,
    solution: Option<Arc<Components>>,
    weights: Vec<(String, usize, WeightFn)>,
    seconds: f64,
    derivatives: Option<Arc<Derivatives>>,
    /// The system in its dimension, once it is asked for.
    model: OnceLock<Box<dyn Model>>,
}

/// What is given of a system.
struct Functions {
    domain: Domain<f64>,
    /// m.
    components: usize,
    kernel: Arc<Kernels>,
    source: Arc<Components>,
    watch: Watch,
}

impl core::fmt::Debug for SystemModel {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("SystemModel")
            .field("domain", &self.ends)
            .field("components", &self.functions.components)
            .finish_non_exhaustive()
    }
}

impl SystemModel {
    /// Creates the system of so many equations with K_ij and F_i on the product of these intervals.
    #[must_use]
    pub fn new(
        domain: impl Into<Vec<[f64; 2]>>,
        components: usize,
        kernel: impl Fn([usize; 2], &[f64], &[f64]) -> f64 + Send + Sync + 'static,
        source: impl Fn(usize, &[f64]) -> f64 + Send + Sync + 'static,
    ) -> Self {
        let ends = domain.into();
        Self {
            functions: Arc::new(Functions {
                domain: Domain::new(&ends),
                components,
                kernel: Arc::new(kernel),
                source: Arc::new(source),
                watch: Watch::default(),
            }),
            ends,
            edges: Vec::new(),
            solution: None,
            weights: Vec::new(),
            seconds: SECONDS,
            derivatives: None,
            model: OnceLock::new(),
        }
    }

    /// Adds coordinates on every axis where cells end, besides those where jumps are found.
    #[must_use]
    pub fn with_edges(self, edges: impl Into<Vec<Vec<f64>>>) -> Self {
        self.with(|own| own.edges = edges.into())
    }

    /// Adds the known solution, with which reports compare.
    #[must_use]
    pub fn with_solution(
        self,
        solution: impl Fn(usize, &[f64]) -> f64 + Send + Sync + 'static,
    ) -> Self {
        self.with(|own| own.solution = Some(Arc::new(solution)))
    }

    /// Adds the derivatives of K and F by some quantities, for [`Solver::sensitivities`](crate::Solver::sensitivities).
    #[must_use]
    pub fn with_derivatives(self, derivatives: Derivatives) -> Self {
        self.with(|own| own.derivatives = Some(Arc::new(derivatives)))
    }

    /// This system with a change, for which its model is made anew.
    fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self.model = OnceLock::new();
        self
    }

    /// Adds a weight w of one component, for integrals ∫ w u_i dx that [`Solver::weighted`](crate::Solver::weighted) asks for.
    ///
    /// ```
    /// use fredholm::{Solver, SystemModel};
    ///
    /// // u = ½ ∫₀^∞ e^(−y) v(y) dy and v = 1 on [0, ∞): u = ½.
    /// let kernel = |ij: [usize; 2], _: &[f64], y: &[f64]| if ij == [0, 1] { 0.5 * (-y[0]).exp() } else { 0.0 };
    /// let system = SystemModel::new([[0.0, f64::INFINITY]], 2, kernel, |i, _| i as f64)
    ///     .weight("first", 0, |x| (-2.0 * x[0]).exp());
    /// let report = Solver::new(&system).weighted("first").solve_to(1e-7)?;
    /// assert!((report[0].value() - 0.25).abs() < 1e-6);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    #[must_use]
    pub fn weight(
        self,
        name: &str,
        component: usize,
        weight: impl Fn(&[f64]) -> f64 + Send + Sync + 'static,
    ) -> Self {
        let weight = (name.to_owned(), component, WeightFn::new(weight));
        self.with(|own| own.weights.push(weight))
    }

    /// Sets about how many seconds a value of a kernel or a source takes, for the choice; by default 10 ns.
    #[must_use]
    pub fn with_seconds(self, seconds: f64) -> Self {
        self.with(|own| own.seconds = seconds)
    }

    /// The system in its dimension.
    fn model(&self) -> &dyn Model {
        &**self.model.get_or_init(|| match self.ends.len() {
            1 => Box::new(self.in_dimension::<1, 2, 3, 4, 5>()),
            2 => Box::new(self.in_dimension::<2, 3, 6, 10, 15>()),
            _ => Box::new(self.in_dimension::<3, 4, 10, 20, 35>()),
        })
    }

    /// The system in D dimensions, with the polynomials of degrees 1 to 4.
    fn in_dimension<
        const D: usize,
        const B1: usize,
        const B2: usize,
        const B3: usize,
        const B4: usize,
    >(
        &self,
    ) -> CustomModel<Uniformly<Grid<System<D>>>> {
        let system = System::<D>(self.functions.clone());
        let mut model = CustomModel::from_kernel(system.clone())
            .with_functions::<B1>()
            .with_functions::<B2>()
            .with_functions::<B3>()
            .with_functions::<B4>()
            .named("system")
            .with_coordinates(self.ends.clone())
            .with_edges(self.functions.domain.parameters(&self.edges))
            .with_kernel_seconds(self.seconds);
        for part in 0..self.functions.components {
            let share = move |x: &State<D>| if x.0 == part { 1.0 } else { 0.0 };
            model = model.with_part(&(part + 1).to_string(), share);
        }
        for (name, component, weight) in &self.weights {
            let (system, weight, component) = (system.clone(), weight.clone(), *component);
            model = model.weight(name, move |x| match x.0 == component {
                true => system.weighted(&weight, &x.1),
                false => 0.0,
            });
        }
        match self.solution.clone() {
            Some(solution) => {
                model.with_solution(move |x: &State<D>| solution(x.0, &system.0.domain.point(&x.1)))
            }
            None => model,
        }
    }

    /// Refuses what is no point of the domain with a component.
    fn check_point(&self, coordinates: &[f64]) -> Result<(), Error> {
        let m = self.functions.components;
        let (number, x) = coordinates.split_last().unwrap_or((&0.0, &[]));
        if (1..=m).any(|own| own as f64 == *number) {
            return domain::check_point(x, &self.ends);
        }
        let message = format!(
            "a point of a system has {} coordinates of the domain and a component from 1 to {m}",
            self.ends.len()
        );
        Err(Error::Region { message })
    }
}

/// A state: a component, and a point of [0, 1]^D.
type State<const D: usize> = (usize, [f64; D]);

/// A system in one cell for each component.
#[derive(Clone)]
struct System<const D: usize>(Arc<Functions>);

impl<const D: usize> System<D> {
    /// A weight with respect to the measure of [0, 1]^D.
    fn weighted(&self, weight: &WeightFn, t: &[f64; D]) -> f64 {
        let x = self.0.domain.point(t);
        let value = weight.value(&x);
        let value = self.0.watch.finite(value, || {
            format!("`weight` is {value} at x = {}", Coordinates(&x))
        });
        self.0.domain.times_volume(value, t)
    }
}

impl<const D: usize> Space for System<D> {
    type Scalar = f64;
    type Point = State<D>;
}

impl<const D: usize> Cells for System<D> {
    const DIMENSION: usize = D;

    fn cells(&self) -> usize {
        self.0.components
    }

    fn locate(&self, x: &State<D>) -> usize {
        x.0
    }

    fn measure(&self, _: usize) -> f64 {
        1.0
    }

    fn point(&self, cell: usize, t: &[f64]) -> State<D> {
        (cell, from_fn(|axis| t[axis]))
    }

    fn parameters(&self, x: &Located<State<D>>, t: &mut [f64]) {
        t.copy_from_slice(&x.point.1);
    }

    fn at(&self, coordinates: &[f64]) -> Option<State<D>> {
        let (&number, x) = coordinates.split_last()?;
        let component = (1..=self.cells()).find(|&own| own as f64 == number)?;
        Some((component - 1, self.0.domain.unit(x)?))
    }

    fn copies(&self) -> usize {
        self.0.components
    }
}

impl<const D: usize> Regular for System<D> {
    fn kernel(&self, x: &State<D>, y: &State<D>) -> f64 {
        let (own, [i, j]) = (&*self.0, [x.0, y.0]);
        let [at_x, at_y] = [x, y].map(|state| own.domain.point(&state.1));
        let value = (own.kernel)([i, j], &at_x, &at_y);
        let name = || format!("`kernel[{j}]` of equation {}", i + 1);
        let value = own.watch.kernel(value, [&at_x, &at_y], name);
        own.domain.times_volume(value, &y.1)
    }

    fn source(&self, x: &State<D>) -> f64 {
        let at = self.0.domain.point(&x.1);
        let value = (self.0.source)(x.0, &at);
        self.0.watch.finite(value, || {
            let number = x.0 + 1;
            format!(
                "`source` of equation {number} is {value} at x = {}",
                Coordinates(&at)
            )
        })
    }
}

impl Model for SystemModel {
    delegated!(model);

    fn about(&self) -> About {
        self.model().about()
    }

    fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
        for goal in goals {
            match &goal.region {
                Region::Point(x) => self.check_point(x)?,
                Region::Part(_) => domain::check_mean(&self.ends)?,
                Region::Weight(_) => {}
                _ => {
                    let message = "a system has points, means of components, and weights of them";
                    return Err(Error::Region {
                        message: message.to_owned(),
                    });
                }
            }
        }
        self.model().check_goals(goals)
    }

    fn by_resolvent(&self, question: &ResolventQuestion<'_>) -> Result<ResolventFound<'_>, Error> {
        let answer = self.model().by_resolvent(question);
        // It says where a value was no number.
        self.functions.watch.check()?;
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
        let given = Given {
            ends: self.ends.clone(),
            edges: &self.edges,
            components: self.functions.components,
            is_system: true,
            seconds: self.seconds,
            kernel: self.functions.kernel.clone(),
            source: self.functions.source.clone(),
            derivatives,
        };
        let weight = |region: &Region| match region {
            Region::Weight(number) => {
                let (_, component, weight) = self.weights.get(*number)?;
                Some((*component, weight.clone()))
            }
            _ => None,
        };
        given.with_derivatives(goals, &weight).map(Some)
    }

    fn explain(&self, error: Error) -> Error {
        self.functions.watch.explain(error)
    }

    fn check(&self, discretisation: &Discretisation, pairs: Pairs) -> Result<(), Error> {
        let has_domain = (1..=MOST_DIMENSIONS).contains(&self.ends.len());
        let has_equations = (1..=MOST_COMPONENTS).contains(&self.functions.components);
        if has_domain && has_equations && domain::are_intervals(&self.ends) {
            return self.model().check(discretisation, pairs);
        }
        Err(Error::Option {
            subject: Subject::Problem,
            message: format!(
                "a system has from 1 to {MOST_COMPONENTS} equations on from 1 to {MOST_DIMENSIONS} intervals, each from a number, or -inf, \
                 to a larger one, or inf"
            ),
        })
    }
}
