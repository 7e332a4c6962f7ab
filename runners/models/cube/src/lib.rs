//! Equations on [0, 1]^d and other products of intervals, with dimension and sizes chosen at run time.

mod closures;
mod compiled;
mod cost;
mod degree;
mod domain;
mod export;
mod extended;
mod functions;
mod global;
mod integral;
mod lift;
mod mean;
mod nystrom;
mod radius;
mod regions;
mod resolvent;
mod setup;
mod shapes;
mod singular;
mod starts;
mod system;
mod table;

use core::any::Any;
use std::sync::{Arc, OnceLock};

use fredholm_core::NoNeighbour;
use fredholm_core::galerkin::{DiagonalRule, PairKind, functions as count};
use fredholm_cube::{CubeError, CubeRule};

pub use functions::{CubeFunctions, CubeValues};

use compiled::{Follow, Parts};
use degree::{Constants, Smooth};
use domain::Domain;
use extended::Known;
use fredholm_model::Deterministic;
use fredholm_model::cost::{Cost, PointwisePairs};
use fredholm_model::resolvent::{ResolventAnswer, ResolventQuestion};
use fredholm_model::{About, Prepared, Request, Then};
use fredholm_model::{
    Discretisation, Error, Goal, Model, Pairs, Partitioned, Region, SavedSystem, Scalar, Subject,
    System, WalkOptions, in_scalar,
};
use functions::{CubeScalar, Watched, WeightOf, Which, with_values};
use shapes::{in_dimension, in_shape, of_functions};
use starts::{WeightedStart, goals_of};
use system::{Boxed, with_job};

/// The relative residual at which the iteration for v stops. An unconverged solution costs variance and
/// nothing else.
const TOLERANCE: f64 = 1e-14;
/// The most sweeps.
const SWEEPS: u32 = 1000;
/// The most nodes of a diagnosis, whose work grows with their square: a minute or so.
const MOST_NODES: usize = 20_000;
/// The most unknowns of a level of a sweep at degrees above 0.
const LEVEL: usize = 1300;
/// About so many unknowns in all where nothing is said of cells.
const DEFAULT_UNKNOWNS: f64 = 1000.0;
/// The most cells.
const MOST_CELLS: usize = 100_000_000;
/// The dimension up to which an open method means resolvent walks: with more, cells of a degree that pays are more than are inverted.
const MOST_RESOLVED: usize = 4;

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
    /// All that is known.
    functions: Arc<dyn CubeFunctions>,
    /// What was known before more was said.
    base: Arc<dyn CubeFunctions>,
    known: Known,
    /// `Arc<dyn CompiledWalks<D>>` of closures in D dimensions.
    compiled: Option<Box<dyn Any + Send + Sync>>,
    dimension: usize,
    /// The spectral radius of T_k²p, once it is computed: no number of cells changes it.
    squared_radius: OnceLock<f64>,
    /// The exponent of a singularity at x = y, once it is computed; 0 without one.
    exponent: OnceLock<f64>,
    /// Whether a kernel of one dimension has jumps or kinks but at x = y, once it is looked at.
    is_rough: OnceLock<bool>,
}

impl core::fmt::Debug for CubeModel {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("CubeModel")
            .field("dimension", &self.dimension)
            .finish_non_exhaustive()
    }
}

impl CubeModel {
    /// The equation of these functions.
    #[must_use]
    pub fn new(functions: Arc<dyn CubeFunctions>) -> Self {
        Self {
            dimension: functions.dimension(),
            base: functions.clone(),
            functions,
            known: Known::default(),
            compiled: None,
            squared_radius: OnceLock::new(),
            exponent: OnceLock::new(),
            is_rough: OnceLock::new(),
        }
    }

    /// The largest degree that has code of its own.
    const fn most_degree(&self) -> usize {
        if self.dimension <= 3 { 4 } else { 2 }
    }
}

impl Model for CubeModel {
    fn about(&self) -> About {
        About {
            kind: "cube",
            dimension: Some(self.dimension),
            most_degree: self.most_degree(),
            less_memory: ": use fewer cells, or `kernel_factors` if the kernel is a product",
            takes_any_cells: false,
            counts_evaluations: true,
            takes_resolvent: self.dimension <= MOST_RESOLVED,
        }
    }

    fn weight(&self, number: usize) -> Option<&str> {
        self.functions.weight_text(number)
    }

    fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
        goals
            .iter()
            .try_for_each(|goal| self.check_region(&goal.region))
    }

    /// Along every axis, the last one fastest.
    fn grid(&self, points: usize, _: Option<usize>) -> Vec<Region> {
        let last = points.saturating_sub(1).max(1) as f64;
        let domain = Domain::<f64>::new(self.functions.domain());
        let mut all = vec![Vec::new()];
        for axis in 0..self.dimension {
            let at = |i: usize| domain.coordinate(axis, i as f64 / last);
            let more = |x: Vec<f64>| (0..points).map(move |i| [&*x, &[at(i)]].concat());
            all = all.into_iter().flat_map(more).collect();
        }
        all.into_iter().map(Region::Point).collect()
    }

    fn has_sequences(&self) -> bool {
        true
    }

    fn most_lift(&self) -> usize {
        if self.exponent() > 0.0 {
            0
        } else {
            lift::HIGHEST - 1
        }
    }

    /// T_K needs a kernel with an integral.
    fn has_whole(&self) -> bool {
        self.exponent() < 1.0
    }

    fn exact(&self, region: &Region) -> Result<Option<f64>, Error> {
        if !self.functions.has_solution() {
            return Ok(None);
        }
        in_dimension!(self.dimension, D => self.exact_in::<D>(region))
    }

    fn check(&self, discretisation: &Discretisation, pairs: Pairs) -> Result<(), Error> {
        pairs.refuse_rays()?;
        let refuse = |subject, message: &str| {
            let message = message.to_owned();
            Err(Error::Option { subject, message })
        };
        let has_integral = self.functions.has_integral();
        let is_one = self.functions.is_product() || self.dimension == 1;
        if has_integral && !is_one {
            return refuse(
                Subject::KernelIntegral(0),
                "the integral of a kernel that is no product serves in one dimension alone",
            );
        }
        let domain = self.functions.domain();
        let is_right = |&[low, high]: &[f64; 2]| low < high && (high - low).is_finite();
        if !(domain.is_empty() || domain.len() == self.dimension && domain.iter().all(is_right)) {
            return refuse(
                Subject::Problem,
                "the domain is one interval for each axis, from a finite number to a larger one",
            );
        }
        let smooth = pairs == Pairs::Paper || (pairs == Pairs::Default && !has_integral);
        if discretisation.degree > 0 && !smooth {
            return refuse(
                Subject::Degree,
                "pointwise pairs are of piecewise constants, `degree = 0`: for a higher degree put all pairs in \
                 S, by `pairs = \"paper\"`, or by \"default\" without a `kernel_integral`",
            );
        }
        if pairs == Pairs::Pointwise && !has_integral {
            return refuse(
                Subject::Pairs,
                "pointwise pairs need the exact integrals of the kernel over cells: \
                 give `kernel_integral` in `[problem]`",
            );
        }
        Ok(())
    }

    fn partition<'m>(
        &'m self,
        discretisation: &Discretisation,
    ) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
        let dimension = self.dimension as u32;
        let functions = count(self.dimension, discretisation.degree) as f64;
        let default = (DEFAULT_UNKNOWNS / functions)
            .powf(1.0 / f64::from(dimension))
            .floor();
        let per_axis = discretisation.cells.unwrap_or(default.max(2.0) as usize);
        let cells = per_axis.checked_pow(dimension);
        if discretisation.cells.is_some() && cells.is_none_or(|n| n > MOST_CELLS) {
            return Err(Error::Option {
                subject: Subject::Cells,
                message: format!(
                    "{per_axis} cells per axis are too many in {dimension} dimensions: at most {MOST_CELLS} \
                     cells in all"
                ),
            });
        }
        Ok(Box::new(CubePartition {
            model: self,
            per_axis,
            degree: discretisation.degree,
            points: discretisation.points,
            scalar: discretisation.scalar,
        }))
    }

    fn levels(&self, discretisation: &Discretisation) -> Vec<usize> {
        let degree = discretisation.degree;
        let levels: &[usize] = match self.dimension {
            _ if degree > 0 => &[1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 64, 128, 256, 512],
            1 => &[4, 8, 16, 32, 64, 128, 256, 512, 1024],
            2 => &[2, 4, 8, 12, 16, 24, 32],
            3 => &[2, 3, 4, 5, 6, 8, 10],
            4 => &[2, 3, 4, 5],
            5 => &[2, 3, 4],
            _ => &[2, 3],
        };
        let most = if degree > 0 { LEVEL } else { usize::MAX };
        let (d, functions) = (self.dimension as u32, count(self.dimension, degree));
        let unknowns = |m: usize| m.saturating_pow(d).saturating_mul(functions);
        let levels = levels.iter().copied();
        levels.filter(|&m| unknowns(m) <= most).collect()
    }

    /// Beyond a band of pointwise pairs k − h falls like the cells' width to ½ − a.
    fn order(&self, discretisation: &Discretisation, pairs: Pairs) -> f64 {
        match self.exponent() {
            exponent if exponent > 0.0 && pairs != Pairs::Pointwise => {
                (0.5 - exponent).max(singular::LEAST_ORDER)
            }
            _ => self.smooth_order(discretisation.degree),
        }
    }

    fn by_resolvent(&self, question: &ResolventQuestion<'_>) -> Result<ResolventAnswer, Error> {
        let scalar = question.settings.scalar;
        in_scalar!(scalar, F => in_dimension!(self.dimension, D => self.resolvent_in::<F, D>(question)))
    }

    fn nystrom(&self) -> Result<Vec<Deterministic>, Error> {
        in_dimension!(self.dimension, D => nystrom::solutions::<D>(&*self.functions))
    }
}

/// Cells of a cube.
#[derive(Clone, Copy, Debug)]
struct CubePartition<'m> {
    model: &'m CubeModel,
    /// m.
    per_axis: usize,
    /// p.
    degree: usize,
    points: Option<usize>,
    scalar: Scalar,
}

impl<'m> CubePartition<'m> {
    fn functions(&self) -> &'m dyn CubeFunctions {
        &*self.model.functions
    }

    /// B, the number of functions on a cell.
    fn functions_on_cell(&self) -> usize {
        count(self.model.dimension, self.degree)
    }

    /// n.
    fn all_cells(&self) -> usize {
        self.per_axis.saturating_pow(self.model.dimension as u32)
    }

    /// Quadrature points of a cell and axis: one more than the degree is enough.
    fn points(&self) -> usize {
        self.points.unwrap_or(self.degree + 1)
    }

    /// The quadrature of the set-up.
    fn rule<const D: usize>(&self, values: &Watched<'_, f64>) -> Result<CubeRule<D>, CubeError> {
        CubeRule::new(
            &values.cube::<D>(self.per_axis)?,
            self.degree,
            self.points(),
        )
    }

    /// `None`: all pairs are pointwise.
    fn diagonal_rule(&self, pairs: Pairs) -> Option<DiagonalRule> {
        let diagonal = match pairs {
            Pairs::Pointwise => return None,
            Pairs::Default if self.functions().has_integral() => PairKind::Pointwise,
            _ => PairKind::Galerkin,
        };
        Some(DiagonalRule { diagonal })
    }

    /// Plain walks. Their neighbour equation 0 = 0 is called as all others are, so that no walk needs code of
    /// its own.
    fn plain_in<F: CubeScalar, const D: usize>(
        &self,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error> {
        with_values::<F, _>(self.functions(), |values| {
            let weight = |goal| {
                let goal: &Goal = goal;
                Some(WeightedStart {
                    weight: values.function(Which::Weight(WeightOf::region(&goal.region)?)),
                    weighted: None,
                })
            };
            let weighted: Vec<WeightedStart<'_, F, D>> =
                request.goals.iter().filter_map(weight).collect();
            let parts = Parts {
                values,
                per_axis: self.per_axis,
                options: request.walk.for_core(),
            };
            let goals = |neighbour: &Boxed<'_, F, D>| {
                goals_of(values.domain(), neighbour, request, &weighted, 0.0)
            };
            let none: &Boxed<'_, F, D> = &NoNeighbour::new(&values.cube::<D>(self.per_axis)?);
            with_job(
                (self.model, request.walk.sequence),
                &parts,
                Follow::Any(none),
                &goals,
                &mut |job, galerkin| then(&Prepared::plain(job, galerkin)),
            )
        })
    }
}

impl<'m> Partitioned<'m> for CubePartition<'m> {
    fn cells(&self) -> usize {
        self.per_axis
    }

    fn unknowns(&self) -> usize {
        self.all_cells().saturating_mul(self.functions_on_cell())
    }

    fn cells_text(&self) -> String {
        match self.model.dimension {
            1 => self.per_axis.to_string(),
            _ => format!("{} per axis, {} in all", self.per_axis, self.all_cells()),
        }
    }

    fn memory(&self, goals: &[Goal], _: Pairs) -> usize {
        let (n, d) = (self.unknowns(), self.model.dimension);
        let table = if self.functions().is_product() {
            let width = self.per_axis.saturating_mul(self.degree + 1);
            let tables = width.saturating_mul(width).saturating_mul(d);
            // All products of polynomials along the axes, while K'v is computed.
            let tensor = width.saturating_pow(d as u32);
            tables.saturating_add(tensor).saturating_mul(8)
        } else {
            n.saturating_mul(n).saturating_mul(8)
        };
        let weights = goals
            .iter()
            .filter(|goal| WeightOf::region(&goal.region).is_some());
        // F', v, G, their copies and the iteration's own vectors.
        let vectors = n.saturating_mul(8 * (8 + weights.count()));
        table
            .saturating_add(vectors)
            .saturating_add(goals.len().saturating_mul(1024))
    }

    fn cost(&self, _: Pairs) -> Cost {
        self.seconds()
    }

    fn lift_cost(&self, degree: usize) -> Option<Cost> {
        self.lift_seconds(degree)
    }

    fn pointwise_pairs(&self, pairs: Pairs) -> Result<PointwisePairs, Error> {
        let band = self.band(pairs);
        let near = band.map(|band| (2 * band.width + 1).min(self.per_axis) as f64);
        if let Some(seen) = near {
            return Ok(PointwisePairs { seen, hidden: 0.0 });
        }
        let seen = match self.diagonal_rule(pairs) {
            None => self.all_cells() as f64,
            Some(pairs) => f64::from(u8::from(pairs.diagonal == PairKind::Pointwise)),
        };
        Ok(PointwisePairs { seen, hidden: 0.0 })
    }

    /// The factors of a product, one by one, count as one evaluation.
    fn evaluations(&self, _: u32) -> f64 {
        let points = self.points() as f64;
        if self.functions().is_product() {
            (self.per_axis as f64 * points).powi(2)
        } else {
            (self.all_cells() as f64 * points.powi(self.model.dimension as i32)).powi(2)
        }
    }

    fn plain_radius(&self) -> Result<f64, Error> {
        let known = &self.model.squared_radius;
        match known.get() {
            Some(&radius) => Ok(radius),
            None => {
                let radius =
                    in_dimension!(self.model.dimension, D => self.squared_radius_in::<D>())?;
                Ok(*known.get_or_init(|| radius))
            }
        }
    }

    /// T_h²p is looked at where the system is solved.
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        let of = match self.model.exponent() {
            a if a >= 0.5 => format!("K², where K is like |x - y|^-{a:.2} at x = y,"),
            _ => "K²".to_owned(),
        };
        fredholm_model::finite::check_plain(&of, walk.absorption, || self.plain_radius())
    }

    fn check_examination(&self) -> Result<(), Error> {
        let cells = self.all_cells();
        let points = (self.degree + 2).saturating_pow(self.model.dimension as u32);
        let least = cells.saturating_mul(points);
        if least > MOST_NODES {
            return Err(Error::TooMuch {
                message: format!(
                    "a diagnosis on {cells} cells takes integrals in {least} points, and more than {MOST_NODES} take \
                     too long: use fewer cells (`--cells`), which shows the same at a coarser level"
                ),
            });
        }
        Ok(())
    }

    fn solve(&self) -> Result<Box<dyn System + 'm>, Error> {
        let d = self.model.dimension;
        if self.degree == 0 {
            return in_dimension!(d, D => self.solve_in::<D>(&Constants));
        }
        in_shape!(d, self.degree, D, B => self.solve_in::<D>(&Smooth::<B>))
    }

    fn restore(&self, saved: SavedSystem<'m>) -> Result<Box<dyn System + 'm>, Error> {
        let d = self.model.dimension;
        if self.degree == 0 {
            return in_dimension!(d, D => self.restore_in::<D>(&Constants, saved));
        }
        in_shape!(d, self.degree, D, B => self.restore_in::<D>(&Smooth::<B>, saved))
    }

    fn plain_job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let d = self.model.dimension;
        in_scalar!(self.scalar, F => in_dimension!(d, D => self.plain_in::<F, D>(request, then)))
    }
}
