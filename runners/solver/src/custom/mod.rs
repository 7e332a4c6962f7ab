//! Any equation that implements the traits of the core, in a crate of its own.

mod cells;
mod degree;
mod lifted;
mod quadrature;
mod regular;
mod scores;
mod system;
mod walk;
mod whole;

use core::fmt;
use std::sync::OnceLock;

use fredholm_core::galerkin::{Cells, PairIntegral, PairKind, TransitionMoments, buffer};
use fredholm_core::global::Stationary;
use fredholm_core::{Density, Dependence, Equation, Lights, Located, Space};
use fredholm_rayon::{fill_rows, gathered};

use crate::domain::Domain;
use crate::{Discretisation, Error, Goal, Model, Pairs, Partitioned, Region, Subject};
pub(crate) use cells::Nodes;
use degree::WithIntegrals;
pub(crate) use degree::{
    Closed, Degree, DegreePairs, IN_S, Kinds, Of, OnCells, Smooth, Use, squared_radius,
};
use fredholm_model::EquationError;
use fredholm_model::finite::radius_above;
use fredholm_model::resolvent::{
    self, AnyRegular, Grid, ResolventFound, ResolventQuestion, ResolventSizes,
};
use fredholm_model::{About, Field, LastSteps, Quantity, WholeValues};
pub use regular::Uniformly;
pub(crate) use regular::grid_levels;
use system::CustomPartition;
pub use walk::PointDependences;
pub(crate) use walk::{Coordinates, Positions};
use walk::{Equations, OwnLights, Walks, place};
use whole::{AnyStarts, OwnStarts, UniformStarts};

/// The place in space of a point with these coordinates.
type PlaceFn = dyn Fn(&[f64]) -> [f64; 3] + Send + Sync;

/// A weight, as a function of the point.
type PointFn<P> = dyn Fn(&P) -> f64 + Send + Sync;

/// Edges that are nearer than that are one: what is found is as exact.
const SAME_EDGE: f64 = 1e-9;
/// About so many unknowns in all where nothing is said of cells.
const DEFAULT_UNKNOWNS: usize = 1000;
/// The most unknowns of a level of a sweep.
const LEVEL: usize = 1300;
/// The dimension up to which an open method means resolvent walks: with more, cells of a degree that pays are more than are inverted.
const MOST_RESOLVED: usize = 4;
/// The most images of a cube that are taken for the whole space, and cut alike: edges are looked for between all pairs.
const MOST_IMAGES: usize = 64;
/// Cells enough to estimate the spectral radius of T_k²p.
const COARSE: usize = 48;
/// Seconds that are spent in looking at K², about.
const LOOK_SECONDS: f64 = 1.0;
/// Seconds of a value of k and of p, unless the equation says otherwise.
const KERNEL: f64 = 10e-9;

/// Equation that a [`CustomModel`] can be of: it has a chain, a kernel, a source, cells that are images of a cube, and exact
/// transition masses. Every type with these traits of `fredholm-core` is one.
///
/// ```
/// use fredholm::{CustomEquation, CustomModel, Report, SolveError, Solver};
///
/// /// The mean of any equation that is told apart by its cells.
/// fn mean<E: CustomEquation<Scalar = f64>>(model: &CustomModel<E>) -> Result<Report, SolveError> {
///     Solver::new(model).mean().solve_to(1e-3)
/// }
/// ```
pub trait CustomEquation:
    Equation<Point: Send + Sync, Value = <Self as Space>::Scalar>
    + Density
    + Cells
    + TransitionMoments
    + Send
    + Sync
    + 'static
{
}

impl<E> CustomEquation for E where
    E: Equation<Point: Send + Sync, Value = <E as Space>::Scalar>
        + Density
        + Cells
        + TransitionMoments
        + Send
        + Sync
        + 'static
{
}

/// Equation of a crate of its own, with everything that the other models have: choice of cells and walks, diagnosis,
/// sweeps, reports.
///
/// It is made from a function that makes the equation with a number of cells. Coefficients
/// come from quadrature over the cells. Walks of its chain are compiled for the equation's own type, and resolvent walks once for all.
///
/// ```
/// use fredholm::{CustomModel, Solver};
/// # use fredholm_core::galerkin::{Basis, Cells, TransitionMoments};
/// # use fredholm_core::{Chain, Density, Equation, Located, Space, Uniforms};
/// # use core::convert::Infallible;
/// # struct Mine { cells: usize }
/// # impl Mine { fn new(cells: usize) -> Result<Self, Infallible> { Ok(Self { cells }) } }
/// # impl Space for Mine { type Scalar = f64; type Point = f64; }
/// # impl Chain for Mine {
/// #     fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> { Some(uniforms.uniform()) }
/// # }
/// # impl Density for Mine { fn density(&self, _: &f64, _: &f64) -> f64 { 1.0 } }
/// # impl Equation for Mine {
/// #     type Value = f64;
/// #     fn kernel(&self, x: &f64, y: &f64) -> f64 { 0.5 * x * y }
/// #     fn source<U: Uniforms<f64>>(&self, x: &f64, _: &mut U) -> f64 { *x }
/// # }
/// # impl Cells for Mine {
/// #     const DIMENSION: usize = 1;
/// #     fn cells(&self) -> usize { self.cells }
/// #     fn locate(&self, x: &f64) -> usize { ((x * self.cells as f64) as usize).min(self.cells - 1) }
/// #     fn measure(&self, _: usize) -> f64 { 1.0 / self.cells as f64 }
/// #     fn point(&self, cell: usize, t: &[f64]) -> f64 { (cell as f64 + t[0]) / self.cells as f64 }
/// #     fn parameters(&self, x: &Located<f64>, t: &mut [f64]) { t[0] = x.point * self.cells as f64 - x.cell as f64 }
/// #     fn at(&self, x: &[f64]) -> Option<f64> {
/// #         match *x { [x] if (0.0..=1.0).contains(&x) => Some(x), _ => None }
/// #     }
/// # }
/// # impl Basis for Mine {}
/// # impl TransitionMoments for Mine {
/// #     fn moments(&self, _: &Located<f64>, _: usize) -> [[f64; 1]; 1] { [[1.0 / self.cells as f64]] }
/// # }
///
/// // u(x) = ∫₀¹ ½ x y u(y) dy + x, whose solution is 6x/5; `Mine` has the traits of the core.
/// let u = CustomModel::from_cells(Mine::new).weight("edge", |x| x * x);
/// let report = Solver::new(&u).at(0.5).mean().weighted("edge").solve_to(1e-4)?;
/// assert!((report.goals[0].preconditioned.estimate.unwrap() - 0.6).abs() < 5e-4);
/// assert!((report.goals[2].preconditioned.estimate.unwrap() - 0.3).abs() < 5e-4);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
pub struct CustomModel<E: CustomEquation> {
    equations: Equations<E>,
    single: Option<Box<dyn Walks>>,
    name: &'static str,
    levels: Option<Vec<usize>>,
    coordinates: Vec<[f64; 2]>,
    /// Where cells end on every axis, as numbers in (0, 1).
    edges: Vec<Vec<f64>>,
    solution: Option<Box<PointFn<E::Point>>>,
    kernel_seconds: f64,
    /// Whether the coordinate goes around a closed curve, of which means over arcs are functionals.
    has_arcs: bool,
    takes_resolvent: bool,
    last_steps: LastSteps,
    quantities: Vec<Quantity>,
    place: Option<Box<PlaceFn>>,
    /// The levels that the equation takes, with n; and the equation on the cells of a run of which nothing is said.
    all: OnceLock<Vec<[usize; 2]>>,
    default: OnceLock<E>,
}

impl<E: CustomEquation> fmt::Debug for CustomModel<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CustomModel")
            .field("name", &self.name)
            .field("degrees", &self.equations.degrees.len())
            .finish_non_exhaustive()
    }
}

impl<E: CustomEquation> CustomModel<E> {
    /// Model of the equation that `build` makes with a number of cells. What a number of
    /// cells means is up to it; it may refuse numbers that it does not take.
    ///
    /// Functions are constant on cells, and all pairs of cells are in S, unless the model is told of more.
    pub fn from_cells<X>(build: impl Fn(usize) -> Result<E, X> + Send + Sync + 'static) -> Self
    where
        X: core::error::Error + Send + Sync + 'static,
    {
        let build = move |cells: usize| {
            build(cells).map_err(|error| Error::Equation(EquationError::new(error)))
        };
        Self::of(build, Box::new(UniformStarts))
    }

    /// Model of the equation that `build` makes, whose global estimates start where it says. Other starts are not compiled.
    pub(crate) fn with_own_starts(
        build: impl Fn(usize) -> Result<E, Error> + Send + Sync + 'static,
    ) -> Self
    where
        E: Stationary,
    {
        Self::of(build, Box::new(OwnStarts))
    }

    fn of(
        build: impl Fn(usize) -> Result<E, Error> + Send + Sync + 'static,
        starts: Box<dyn AnyStarts<E>>,
    ) -> Self {
        Self {
            equations: Equations {
                build: Box::new(build),
                degrees: vec![Box::new(Smooth::<1>)],
                weights: Vec::new(),
                parts: Vec::new(),
                positions: None,
                starts,
                lights: None,
                dependences: None,
            },
            single: None,
            name: "custom",
            levels: None,
            coordinates: vec![[0.0, 1.0]; E::DIMENSION],
            edges: Vec::new(),
            solution: None,
            kernel_seconds: KERNEL,
            has_arcs: false,
            takes_resolvent: true,
            last_steps: LastSteps::Never,
            quantities: Vec::new(),
            place: None,
            all: OnceLock::new(),
            default: OnceLock::new(),
        }
    }

    /// Adds the next degree, which has B functions on a cell.
    #[must_use]
    pub fn with_functions<const B: usize>(mut self) -> Self
    where
        E: TransitionMoments<B>,
    {
        self.equations.degrees.push(Box::new(Smooth::<B>));
        self
    }

    /// Allows pointwise pairs of the degree with B functions on a cell, by the equation's exact integrals.
    #[must_use]
    pub fn with_pair_integrals<const B: usize>(mut self) -> Self
    where
        E: TransitionMoments<B> + PairIntegral<B>,
    {
        for degree in &mut self.equations.degrees {
            if degree.functions() == B {
                *degree = Box::new(WithIntegrals::<B>);
            }
        }
        self
    }

    /// Starts walks of a [global estimate](crate::GlobalEstimate) where the equation says, and scores them in every state of
    /// which it knows the density. Otherwise they start uniformly and score in their starts alone. The equation in single
    /// precision says it for itself.
    ///
    /// The conformance kit checks what the equation says.
    #[must_use]
    pub fn with_starts(mut self) -> Self
    where
        E: Stationary,
    {
        self.equations.starts = Box::new(OwnStarts);
        self
    }

    /// Makes the walks of the equation's chain the method where none is asked for: of chains that know where K is large. Otherwise
    /// it is resolvent walks, which know K and F alone, up to four dimensions.
    #[must_use]
    pub const fn by_its_chain(mut self) -> Self {
        self.takes_resolvent = false;
        self
    }

    /// Lets the last step of walks lead to the equation's lights, whose emission F_s is constant on every cell. `pays`: whether the automatic
    /// choice looks at it.
    #[must_use]
    pub fn with_lights(mut self, pays: bool) -> Self
    where
        E: Lights,
    {
        self.equations.lights = Some(Box::new(OwnLights));
        self.last_steps = LastSteps::Open { pay: pays };
        self
    }

    /// Names the quantities on which the equation depends, for [`Solver::sensitivities`](crate::Solver::sensitivities), and says what points and steps
    /// have to do with each: see [`Dependence`]. The equation in single precision says it for itself.
    ///
    /// ```
    /// use fredholm::sphere::Parameters;
    /// use fredholm::{Solver, SphereModel};
    ///
    /// // The sphere names its albedo a and its emission: the mean of u is e₀/(1 − a).
    /// let u = SphereModel::new(Parameters { albedo: 0.5, asymmetry: 0.0, emission: [1.0, 0.0, 0.0, 0.0], forward: 0.0 });
    /// let found = Solver::new(&u).mean().walks(10_000).sensitivities()?;
    /// let own = found.get("mean", "albedo").unwrap();
    /// assert!((own.derivative - 4.0).abs() < 4.0 * own.std_error.unwrap());
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    #[must_use]
    pub fn with_quantities(
        mut self,
        quantities: Vec<Quantity>,
        dependences: impl Fn(Option<&E::Point>, &E::Point, &mut dyn FnMut(Dependence))
        + Send
        + Sync
        + 'static,
    ) -> Self {
        self.equations.dependences = Some((quantities.len(), Box::new(dependences)));
        self.quantities = quantities;
        self
    }

    /// Says that the only coordinate goes around a closed curve, whose ends are one point: allows means over its arcs. The measure is
    /// proportional to the coordinate, and cells lie in its order.
    #[must_use]
    pub const fn with_arcs(mut self) -> Self {
        self.has_arcs = true;
        self
    }

    /// Sets the place in space of the point with given coordinates, for pictures and meshes.
    #[must_use]
    pub fn with_place(
        mut self,
        place: impl Fn(&[f64]) -> [f64; 3] + Send + Sync + 'static,
    ) -> Self {
        self.place = Some(Box::new(place));
        self
    }

    /// Adds the next degree, with closed forms of its own.
    pub(crate) fn with_degree(mut self, degree: impl Degree<E> + 'static) -> Self {
        self.equations.degrees.push(Box::new(degree));
        self
    }

    /// Takes away all degrees.
    pub(crate) fn without_degrees(mut self) -> Self {
        self.equations.degrees.clear();
        self
    }

    /// Adds a weight w, for integrals ∫ w u dμ that [`Solver::weighted`](crate::Solver::weighted) asks for.
    #[must_use]
    pub fn weight(
        mut self,
        name: &str,
        weight: impl Fn(&E::Point) -> f64 + Send + Sync + 'static,
    ) -> Self {
        let weight = (name.to_owned(), Box::new(weight) as Box<PointFn<E::Point>>);
        self.equations.weights.push(weight);
        self
    }

    /// Adds a part of the space, of which means are asked for: the function that is 1 over the part's measure there and 0 elsewhere. The number
    /// of a point's part, from 1 on, is its last coordinate.
    pub(crate) fn with_part(
        mut self,
        name: &str,
        share: impl Fn(&E::Point) -> f64 + Send + Sync + 'static,
    ) -> Self {
        self.equations
            .parts
            .push((name.to_owned(), Box::new(share)));
        self
    }

    /// Adds the same equation in single precision, for walks in it: with the same degrees, pointwise pairs and weights.
    #[must_use]
    pub fn with_f32<N: CustomEquation<Scalar = f32>>(mut self, single: CustomModel<N>) -> Self {
        self.single = Some(Box::new(single.equations));
        self
    }

    /// Sets the known solution, with which reports compare.
    #[must_use]
    pub fn with_solution(
        mut self,
        solution: impl Fn(&E::Point) -> f64 + Send + Sync + 'static,
    ) -> Self {
        self.solution = Some(Box::new(solution));
        self
    }

    /// Adds places where cells of resolvent walks end on every axis, besides those that are found: numbers in (0, 1), as parameters of a cell
    /// that is the whole space. That serves where kernel or source jump.
    #[must_use]
    pub(crate) fn with_edges(mut self, edges: Vec<Vec<f64>>) -> Self {
        self.edges = edges;
        self
    }

    /// Sets the name in reports, in place of "custom".
    #[must_use]
    pub const fn named(mut self, name: &'static str) -> Self {
        self.name = name;
        self
    }

    /// Sets the numbers of cells to choose from, from few to many; by default those m^d for small m that the equation takes.
    #[must_use]
    pub fn with_levels(mut self, cells: impl Into<Vec<usize>>) -> Self {
        self.levels = Some(cells.into());
        (self.all, self.default) = (OnceLock::new(), OnceLock::new());
        self
    }

    /// Sets the interval of every coordinate over which a grid of points goes; by default [0, 1] for each of d.
    #[must_use]
    pub fn with_coordinates(mut self, intervals: impl Into<Vec<[f64; 2]>>) -> Self {
        self.coordinates = intervals.into();
        self
    }

    /// Says where a point lies in its coordinates, so that there are weights of coordinates, [`Region::Function`], and places have names.
    pub(crate) fn with_positions(mut self, positions: impl Positions<E::Point> + 'static) -> Self {
        self.equations.positions = Some(Box::new(positions));
        self
    }

    /// Sets about how many seconds a value of k and of p takes, for the choice; by default 10 ns. What is chosen depends
    /// on this number, and on no clock.
    #[must_use]
    pub const fn with_kernel_seconds(mut self, seconds: f64) -> Self {
        self.kernel_seconds = seconds;
        self
    }
}

impl<E: CustomEquation<Scalar = f64>> CustomModel<E> {
    /// The equation with so many cells.
    fn equation(&self, cells: usize) -> Result<E, Error> {
        (self.equations.build)(cells)
    }

    /// The equation with so many cells as a run has of which nothing is said.
    fn default_equation(&self) -> Result<&E, Error> {
        if let Some(equation) = self.default.get() {
            return Ok(equation);
        }
        let equation = self.equation(self.default_cells(0))?;
        Ok(self.default.get_or_init(|| equation))
    }

    /// The numbers of cells for these degrees that the equation takes, with n.
    fn all_levels(&self) -> &[[usize; 2]] {
        self.all.get_or_init(|| {
            let d = E::DIMENSION as u32;
            let powers = || {
                let roots: &[usize] = match d {
                    1 => &[4, 8, 16, 32, 64, 128, 256, 512, 1024],
                    2 => &[2, 3, 4, 6, 8, 12, 16, 24, 32],
                    _ => &[1, 2, 3, 4, 5, 6, 8, 10],
                };
                roots.iter().map(|root| root.saturating_pow(d)).collect()
            };
            let levels: Vec<usize> = self.levels.clone().unwrap_or_else(powers);
            let taken = levels.into_iter().filter_map(|cells| {
                let equation = self.equation(cells).ok()?;
                Some([cells, equation.cells()])
            });
            taken.collect()
        })
    }

    /// The numbers of cells with at most about so many unknowns, or the smallest.
    fn levels_up_to(&self, unknowns: usize, degree: usize) -> Vec<usize> {
        let functions = self.equations.degree(degree);
        let functions = functions.map_or(1, |degree| degree.functions());
        let all = self.all_levels();
        let least = all.first().map(|&[_, n]| n).unwrap_or_default();
        let most = (unknowns / functions).max(least);
        let few = all.iter().filter(|[_, n]| *n <= most);
        few.map(|[cells, _]| *cells).collect()
    }

    fn default_cells(&self, degree: usize) -> usize {
        let levels = self.levels_up_to(DEFAULT_UNKNOWNS, degree);
        levels.last().copied().unwrap_or(1)
    }

    /// The spectral radius of T_k²p, estimated on few cells.
    fn plain_radius(&self) -> Result<f64, Error> {
        let levels = self.all_levels();
        let enough = levels.iter().find(|[_, n]| *n >= COARSE).or(levels.last());
        let [cells, n] = enough.copied().unwrap_or([1, 1]);
        let equation = self.equation(cells)?;
        // Fewer points, where their pairs would take long.
        let pairs = (n as f64).powi(2) * 4_f64.powi(E::DIMENSION as i32);
        let points = if pairs * self.kernel_seconds > LOOK_SECONDS {
            1
        } else {
            2
        };
        let nodes = Nodes::new(&equation, points)?;
        let mut matrix: Vec<f64> = buffer(n.saturating_mul(n))?;
        fill_rows(&mut matrix, n, |i, row| {
            for (point, share) in nodes.shares(i) {
                let x = Located { point, cell: i };
                for (j, entry) in row.iter_mut().enumerate() {
                    // p may be as narrow as it likes: its mass in a cell is known.
                    let [[mass]] = equation.moments(&x, j);
                    let squares = nodes.shares(j).map(|(y, weight)| {
                        let k = equation.kernel(&point, &y);
                        weight * k * k
                    });
                    *entry += share * mass * squares.sum::<f64>();
                }
            }
            Ok::<(), Error>(())
        })?;
        // A value that is not a number is none below 1.
        if matrix.iter().any(|entry| !entry.is_finite()) {
            return Ok(f64::INFINITY);
        }
        Ok(radius_above(n, &matrix))
    }

    /// (f, Φ) of a function.
    fn of_function(
        &self,
        region: &Region,
        f: impl Fn(&E::Point) -> f64,
    ) -> Result<Option<f64>, Error> {
        match region {
            Region::Point(x) => Ok(Some(f(&place(self.default_equation()?, x)?))),
            Region::Whole => self.sum_of(f, true),
            Region::Arc(from, to) => {
                let equation = self.default_equation()?;
                Ok(Some(walk::mean_between(equation, [*from, *to], &|x| {
                    f(&x)
                })?))
            }
            region if walk::is_weight(region) => {
                let weight = self.equations.weight_of(region)?;
                self.sum_of(|x| weight(x) * f(x), false)
            }
            _ => Ok(None),
        }
    }

    /// ∫ f dμ over ∫ dμ or 1, if two partitions agree on it.
    fn sum_of(&self, f: impl Fn(&E::Point) -> f64, is_mean: bool) -> Result<Option<f64>, Error> {
        let of = |cells: usize| {
            let nodes = Nodes::new(&self.equation(cells)?, 5)?;
            let measure = if is_mean {
                nodes.integral(|_| 1.0)
            } else {
                1.0
            };
            Ok::<f64, Error>(nodes.integral(&f) / measure)
        };
        let levels = self.levels_up_to(DEFAULT_UNKNOWNS, 0);
        let [.., coarse, fine] = levels.as_slice() else {
            return Ok(None);
        };
        let (coarse, fine) = (of(*coarse)?, of(*fine)?);
        let agree = (coarse - fine).abs() <= 1e-12 * fine.abs().max(1e-300);
        Ok(agree.then_some(fine))
    }

    fn check_region(&self, equation: &E, region: &Region) -> Result<(), Error> {
        let message = match region {
            Region::Whole => return Ok(()),
            Region::Point(x) => return place(equation, x).map(|_| ()),
            Region::Weight(number) if *number < self.equations.weights.len() => return Ok(()),
            Region::Function(_) if self.equations.positions.is_some() => return Ok(()),
            Region::Part(number) if *number < self.equations.parts.len() => return Ok(()),
            Region::Arc(from, to) if self.has_arcs => {
                let [low, high] = self.coordinates.first().copied().unwrap_or([0.0, 1.0]);
                if low <= *from && from < to && *to <= high {
                    return Ok(());
                }
                format!(
                    "an interval is from a coordinate to a larger one, both from {low} to {high}"
                )
            }
            Region::Weight(number) => format!("there is no weight of number {number}"),
            _ => {
                "an equation of a crate of its own has points, weights, and the mean over all of it"
                    .to_owned()
            }
        };
        Err(Error::Region { message })
    }

    /// Refuses an equation in single precision that has not what that in double precision has.
    fn check_single(&self) -> Result<(), Error> {
        let Some(single) = &self.single else {
            return Ok(());
        };
        if single.abilities() == self.equations.abilities() {
            return Ok(());
        }
        Err(Error::Option {
            subject: Subject::Problem,
            message: "the equation in single precision needs the degrees, the pair integrals, the weights and the \
                      lights of that in double precision"
                .to_owned(),
        })
    }
}

impl<E: CustomEquation<Scalar = f64>> Model for CustomModel<E> {
    fn about(&self) -> About {
        About {
            most_degree: self.equations.degrees.len() - 1,
            counts_evaluations: true,
            takes_resolvent: self.takes_resolvent && E::DIMENSION <= MOST_RESOLVED,
            // Where the parameters of points are known there are polynomials of any degree.
            whole: WholeValues::Points,
            most_lift: lifted::HIGHEST - 1,
            has_sequences: true,
            around: self.coordinates.first().copied().filter(|_| self.has_arcs),
            last_steps: self.last_steps,
            ..About::of_kind(self.name)
        }
    }

    fn part(&self, number: usize) -> Option<&str> {
        let part = self.equations.parts.get(number);
        part.map(|(name, _)| name.as_str())
    }

    fn weight(&self, number: usize) -> Option<&str> {
        let weight = self.equations.weights.get(number);
        weight.map(|(name, _)| name.as_str())
    }

    fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
        let equation = self.default_equation()?;
        let mut regions = goals.iter().map(|goal| &goal.region);
        regions.try_for_each(|region| self.check_region(equation, region))
    }

    fn place(&self, region: &Region) -> Option<[f64; 3]> {
        match (region, &self.place) {
            (Region::Point(x), Some(place)) => Some(place(x)),
            (Region::Point(x), None) if x.len() <= 3 => {
                let mut all = [0.0; 3];
                all.get_mut(..x.len())?.copy_from_slice(x);
                Some(all)
            }
            _ => None,
        }
    }

    fn quantities(&self) -> Vec<Quantity> {
        self.quantities.clone()
    }

    /// Where the whole space is one cell, or a few, cells end where functions jump; else they are those of the equation.
    fn by_resolvent(&self, question: &ResolventQuestion<'_>) -> Result<ResolventFound<'_>, Error> {
        let of_cells = |cells: usize| {
            let weight = |region: &Region| self.equations.regular(region);
            Ok::<_, Error>(AnyRegular::new(self.equation(cells)?, weight))
        };
        let whole = of_cells(1).ok();
        let whole = whole.filter(|one| one.cells() <= MOST_IMAGES);
        let cells = question.settings.cells;
        let seconds = [self.kernel_seconds; 2];
        let edges = whole.map(|whole| {
            let mut edges = gathered(|| resolvent::edges(&whole));
            for (found, named) in edges.iter_mut().zip(&self.edges) {
                found.extend(named);
                found.sort_by(f64::total_cmp);
                found.dedup_by(|a, b| *a - *b < SAME_EDGE);
            }
            (whole, edges)
        });
        let sizes = match &edges {
            Some((whole, edges)) => ResolventSizes::of_grid(edges, whole.cells(), cells, seconds),
            None => ResolventSizes {
                levels: match cells {
                    Some(cells) => vec![[cells, self.equation(cells)?.cells()]],
                    None => self.all_levels().to_vec(),
                },
                dimension: E::DIMENSION,
                seconds,
            },
        };
        let cut = |[cells, degree]: [usize; 2]| {
            let grid = match &edges {
                Some((whole, edges)) => Grid::new(whole.clone(), edges, cells),
                None => Grid::new(of_cells(cells)?, &[], 1),
            };
            Ok::<_, Error>((grid, degree))
        };
        resolvent::answer(question, &sizes, &|fine, coarse| {
            let (grid, degree) = cut(fine)?;
            let coarse = coarse.map(cut).transpose()?;
            resolvent::cut_of(grid, degree, coarse, question.watch)
        })
    }

    /// Along every coordinate, the last one fastest; on every part of the space.
    fn grid(&self, points: usize, _: Option<usize>) -> Vec<Region> {
        // The ends of a closed curve are one point.
        let last = points.saturating_sub(usize::from(!self.has_arcs)).max(1) as f64;
        let mut all = vec![Vec::new()];
        for &[low, high] in &self.coordinates {
            let own = Domain::new(&[[low, high]]);
            let at = |i: usize| match (high - low).is_finite() {
                true => low + (high - low) * (i as f64 / last),
                false => own.coordinate(0, (i as f64 + 0.5) / points as f64),
            };
            let more = |x: Vec<f64>| (0..points).map(move |i| [&*x, &[at(i)]].concat());
            all = all.into_iter().flat_map(more).collect();
        }
        let parts = self.equations.parts.len();
        if parts > 0 {
            let of = |x: Vec<f64>| (1..=parts).map(move |part| [&*x, &[part as f64]].concat());
            all = all.into_iter().flat_map(of).collect();
        }
        all.into_iter().map(Region::Point).collect()
    }

    fn spread(&self, points: f64) -> Vec<Region> {
        let of_part = points / self.equations.parts.len().max(1) as f64;
        let per_axis = of_part.powf(1.0 / self.coordinates.len().max(1) as f64) + 1e-9;
        self.grid((per_axis.floor() as usize).max(1), None)
    }

    fn exact(&self, region: &Region) -> Result<Option<f64>, Error> {
        match &self.solution {
            Some(u) => self.of_function(region, u),
            None => Ok(None),
        }
    }

    fn integral(&self, region: &Region, function: &Field) -> Result<Option<f64>, Error> {
        match (&self.equations.positions, region) {
            (_, Region::Point(x)) => Ok(Some(function(x))),
            (Some(positions), _) => self.of_function(region, |x| {
                function(&positions.position(x).coordinates[..E::DIMENSION])
            }),
            (None, _) => Ok(None),
        }
    }

    fn check(&self, discretisation: &Discretisation, pairs: Pairs) -> Result<(), Error> {
        self.check_single()?;
        pairs.refuse_rays()?;
        let refuse = |subject, message: &str| {
            let message = message.to_owned();
            Err(Error::Option { subject, message })
        };
        let Some(degree) = self.equations.degrees.get(discretisation.degree) else {
            return refuse(
                Subject::Degree,
                "the model does not have this degree: see `CustomModel::with_functions`",
            );
        };
        match pairs {
            // A sample without a step of these pairs looks as if there were no variance left.
            Pairs::Paper
                if degree.functions() > 1 && degree.pairs().paper.diagonal == PairKind::Dropped =>
            {
                refuse(
                    Subject::Pairs,
                    "\"paper\" leaves steps within a cell out: with a `degree` above 0 they are what is left of the \
                     variance, and so rare that error bars would miss them; use \"default\"",
                )
            }
            Pairs::Pointwise if !degree.pairs().pointwise => refuse(
                Subject::Pairs,
                "pointwise pairs need the exact integrals of the kernel over cells: see \
                 `CustomModel::with_pair_integrals`",
            ),
            _ => Ok(()),
        }
    }

    fn partition<'m>(
        &'m self,
        discretisation: &Discretisation,
    ) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
        Ok(Box::new(CustomPartition::new(self, discretisation)?))
    }

    fn levels(&self, discretisation: &Discretisation) -> Vec<usize> {
        self.levels_up_to(LEVEL, discretisation.degree)
    }

    fn smooth_order(&self, degree: usize) -> f64 {
        (degree + 1) as f64 / E::DIMENSION as f64
    }
}
