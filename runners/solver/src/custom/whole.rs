//! The global estimate of an equation of a crate of its own.

use std::sync::Arc;

use fredholm_core::galerkin::Cells;
use fredholm_core::global::{GlobalTask, Scores, Stationary};
use fredholm_core::{Form, Located, Real, Uniforms};
use fredholm_model::numbers::{dot, largest};
use fredholm_model::{
    CellNodes, GlobalField, GlobalQuantity, GlobalRequest, GlobalSystem, IMAGE_HEAD, WithGlobalJob,
    known_first, only_u, refined_mean, v_of_walks,
};
use fredholm_rayon::fill_rows;

use super::CustomEquation;
use super::cells::{DrawFn, MOST_DIMENSIONS, Nodes, Uniform};
use super::degree::Boxed;
use super::scores::{Integrals, MOST_DEGREE, Polynomials, parameters};
use super::system::CustomSystem;
use super::walk::{ScoredOn, Solved, is_weight, nodes_between, place};
use crate::{Error, Region, Sequence};

/// What rounding leaves of a density over its value, in single precision.
const ROUNDING: f64 = 1e-5;
/// The most Gauss points of a cell and axis, and the most values of the kernel for one point: more are not tried.
const MOST_POINTS: usize = 12;
const MOST_NODES: f64 = 4e6;
/// Values of the kernel that a mean over x may take, once it has been compared.
const MOST_WORK: f64 = 1e9;
/// Parts in which the cells of a mean are gone through, by as many threads.
const PARTS: usize = 64;
/// Seconds of a node besides its kernel, for every function.
const FUNCTION_SECONDS: f64 = 5e-9;

/// Walks of a global estimate, but for what they start from.
pub(super) struct GlobalWalks<'a, E: CustomEquation> {
    pub(super) equation: &'a E,
    pub(super) neighbour: &'a Boxed<'a, E>,
    pub(super) scores: &'a (dyn Scores<E::Point> + Sync),
    pub(super) request: &'a GlobalRequest<'a>,
}

impl<E: CustomEquation> GlobalWalks<'_, E> {
    fn hand_on(
        &self,
        starts: &(impl Stationary<E> + Sync),
        then: &mut WithGlobalJob<'_>,
    ) -> Result<(), Error> {
        let (equation, request) = (self.equation, self.request);
        let options = request.walk.for_core();
        let job: GlobalTask<'_, _, _, _, _> =
            GlobalTask::new(equation, starts, self.neighbour, self.scores, options);
        let nodes = CellNodes {
            cells: equation.cells(),
            dimension: E::DIMENSION,
            points: request.degree + 1,
            share: 1.0,
        };
        let known = known_first(request, self.scores, nodes, &|cell, t| {
            let (x, first) = job.first(equation.point(cell, t));
            Some((x, first.to_f64()))
        })?;
        let job = job.with_known(&known);
        match request.walk.sequence {
            Sequence::Random => then(&job),
            Sequence::Sobol => then(&job.with_generators(Sequence::Sobol)),
        }
    }
}

/// What a global estimate's walks of an equation start from. It is object safe.
pub(super) trait AnyStarts<E: CustomEquation>: Send + Sync {
    /// Hands on these walks.
    fn start(&self, walks: &GlobalWalks<'_, E>, then: &mut WithGlobalJob<'_>) -> Result<(), Error>;

    /// How the equation draws points that are uniform on the space, if it does.
    fn uniform(&self, equation: &E) -> Option<DrawFn<E>> {
        let _ = equation;
        None
    }
}

/// Starts that are uniform on the space, of a chain of which nothing else is known.
pub(super) struct UniformStarts;

/// The equation's own starts.
pub(super) struct OwnStarts;

impl<E: CustomEquation> AnyStarts<E> for UniformStarts {
    fn start(&self, walks: &GlobalWalks<'_, E>, then: &mut WithGlobalJob<'_>) -> Result<(), Error> {
        walks.hand_on(&Uniform::new(walks.equation, None), then)
    }
}

impl<E: CustomEquation + Stationary> AnyStarts<E> for OwnStarts {
    fn start(&self, walks: &GlobalWalks<'_, E>, then: &mut WithGlobalJob<'_>) -> Result<(), Error> {
        walks.hand_on(walks.equation, then)
    }

    fn uniform(&self, equation: &E) -> Option<DrawFn<E>> {
        let middle = [0.5; MOST_DIMENSIONS];
        let cells = 0..equation.cells();
        let measure: f64 = cells.clone().map(|cell| equation.measure(cell)).sum();
        let is_even = |cell| {
            let x = equation.point(cell, &middle[..E::DIMENSION]);
            (equation.start_density(&x) * measure - 1.0).abs() < ROUNDING
        };
        cells
            .clone()
            .all(is_even)
            .then_some(|equation, mut uniforms| Stationary::start(equation, &mut uniforms))
    }
}

impl<E: Cells> Stationary<E> for Uniform<'_, E> {
    fn start<U: Uniforms<E::Scalar>>(&self, uniforms: &mut U) -> E::Point {
        self.draw(uniforms)
    }

    fn start_density(&self, _: &E::Point) -> f64 {
        1.0 / self.measure
    }

    fn is_preserved(&self) -> bool {
        false
    }
}

/// A solved equation whose walks score in every state of which the density is known.
pub(super) struct CustomWhole<'m, E: CustomEquation> {
    system: Arc<CustomSystem<'m, E>>,
    /// μ(X_j).
    measures: Vec<f64>,
}

impl<'m, E: CustomEquation<Scalar = f64>> CustomWhole<'m, E> {
    pub(super) fn new(system: CustomSystem<'m, E>) -> Result<Self, Error> {
        let equation = system.cut.equation()?;
        Ok(Self {
            measures: (0..equation.cells()).map(|j| equation.measure(j)).collect(),
            system: Arc::new(system),
        })
    }

    /// Values of the kernel for one point, with so many Gauss points of a cell and axis.
    fn nodes(&self, points: usize) -> f64 {
        nodes::<E>(self.measures.len(), points)
    }

    fn walks_on(
        &self,
        request: &GlobalRequest<'_>,
        on: ScoredOn<'_>,
        then: &mut WithGlobalJob<'_>,
    ) -> Result<(), Error> {
        let (system, walk) = (&*self.system, request.walk);
        let nodes = self.nodes(request.degree + 1);
        if nodes > MOST_NODES {
            return Err(Error::TooMuch {
                message: format!(
                    "T_K by quadrature takes {nodes:.1e} values of the kernel for each point, and more than \
                     {MOST_NODES:.0e} take too long: use fewer cells"
                ),
            });
        }
        let kinds = system.kinds(walk.pairs);
        if !(walk.allow_infinite_variance || walk.form == Form::Residual) {
            system.check_neighbour(kinds, walk.absorption)?;
        }
        let walks = system.cut.walks()?;
        walks.whole_job(&system.solved, kinds, (request, on), then)
    }
}

fn nodes<E: Cells>(cells: usize, points: usize) -> f64 {
    cells as f64 * (points as f64).powi(E::DIMENSION as i32)
}

impl<'m, E: CustomEquation<Scalar = f64>> GlobalSystem<'m> for CustomWhole<'m, E> {
    fn degree(&self) -> usize {
        let lifted = self.system.solved.lifted.as_ref();
        lifted.map_or(self.system.cut.degree, |lifted| lifted.degree)
    }

    fn most_degree(&self) -> usize {
        MOST_DEGREE
    }

    fn degrees(&self, degree: usize) -> Vec<usize> {
        Polynomials::new(E::DIMENSION, degree).totals().collect()
    }

    fn cells(&self) -> usize {
        self.measures.len()
    }

    fn measure(&self, cell: usize) -> f64 {
        self.measures.get(cell).copied().unwrap_or(f64::NAN)
    }

    fn point_seconds(&self, degree: usize) -> f64 {
        let functions = self.degrees(degree).len() as f64;
        let each = self.system.cut.model.kernel_seconds + FUNCTION_SECONDS * functions;
        each * self.nodes(degree + 1)
    }

    fn mean_points(&self, degree: usize) -> f64 {
        self.nodes(degree + 3)
    }

    fn sizes(&self) -> [f64; 2] {
        let Solved {
            solution, lifted, ..
        } = &self.system.solved;
        let v = lifted.as_ref().map_or(&solution.v, |lifted| &lifted.v);
        [largest(v), solution.radius_bound]
    }

    fn walks(
        &self,
        request: &GlobalRequest<'_>,
        then: &mut WithGlobalJob<'_>,
    ) -> Result<(), Error> {
        let polynomials = Polynomials::new(E::DIMENSION, request.degree);
        self.walks_on(request, ScoredOn::Polynomials(&polynomials), then)
    }

    fn adjoint_walks(
        &self,
        request: &GlobalRequest<'_>,
        points: &[Region],
        then: &mut WithGlobalJob<'_>,
    ) -> Result<(), Error> {
        self.walks_on(request, ScoredOn::Points(points), then)
    }

    fn field(
        &self,
        request: &GlobalRequest<'_>,
        rows: Vec<f64>,
    ) -> Result<Box<dyn GlobalField + 'm>, Error> {
        let polynomials = Polynomials::new(E::DIMENSION, request.degree);
        let v = match &self.system.solved.lifted {
            Some(lifted) => lifted.v.clone(),
            None => v_of_walks(&self.system.solved.solution, self.system.cut.scalar)?,
        };
        let mut all = polynomials.embed(self.degree(), self.cells(), &v);
        all.extend(&rows);
        Ok(Box::new(CustomField {
            v,
            all,
            unknowns: self.cells() * polynomials.functions(),
            points: request.degree + 1,
            least_points: request.degree + 1,
            system: Arc::clone(&self.system),
            polynomials,
        }))
    }
}

/// v, piecewise polynomials, and the quadrature of T_K.
struct CustomField<'m, E: CustomEquation> {
    system: Arc<CustomSystem<'m, E>>,
    v: Vec<f64>,
    polynomials: Polynomials,
    unknowns: usize,
    /// The coefficients of v, if its functions are products of Legendre polynomials, and then all rows.
    all: Vec<f64>,
    /// Gauss points of a cell and axis.
    points: usize,
    /// The fewest that a mean over x begins with.
    least_points: usize,
}

impl<E: CustomEquation<Scalar = f64>> CustomField<'_, E> {
    /// F, T_K v and all integrals, as they are or in the mean over nodes of x with a weight.
    fn mean(
        &self,
        of: &Integrals<'_, E>,
        nodes: &Nodes<E::Point>,
        weight: &(dyn Fn(&E::Point) -> f64 + Sync),
    ) -> Result<Vec<f64>, Error> {
        let width = IMAGE_HEAD + self.unknowns;
        let mut parts = vec![0.0; PARTS * width];
        fill_rows(&mut parts, width, |part, out| {
            for cell in (part..nodes.cells()).step_by(PARTS) {
                for (x, share) in nodes.weighted(cell) {
                    of.add(&x, share * weight(&x), out);
                }
            }
            Ok::<(), Error>(())
        })?;
        let mut all = vec![0.0; width];
        for part in parts.chunks_exact(width) {
            all.iter_mut()
                .zip(part)
                .for_each(|(all, part)| *all += part);
        }
        Ok(all)
    }

    /// F and T_K v, and the integrals times every row.
    fn contract(&self, all: &[f64], rows: &[f64], out: &mut [f64]) {
        let (head, integrals) = all.split_at(IMAGE_HEAD);
        let images = rows.chunks_exact(self.unknowns.max(1));
        let images = images.map(|row| dot(integrals, row));
        let values = head.iter().copied().chain(images);
        out.iter_mut()
            .zip(values)
            .for_each(|(out, value)| *out = value);
    }

    fn own_rows(&self) -> &[f64] {
        self.all.get(self.unknowns..).unwrap_or(&[])
    }

    /// Whether so many points of a cell and axis are too many.
    fn is_much(&self, points: usize) -> bool {
        let cells = self.unknowns / self.polynomials.functions();
        points > MOST_POINTS || nodes::<E>(cells, points) > MOST_NODES
    }

    /// The images by so many points of a cell and axis.
    fn images_of(&self, regions: &[Region], rows: &[f64], of_y: usize) -> Result<Vec<f64>, Error> {
        let cut = &self.system.cut;
        let equation = cut.equation()?;
        let (equations, functions) = (&cut.model.equations, cut.of_degree()?.on_cells());
        let lifted = self.system.solved.lifted.as_ref();
        let lifted = lifted.map(|lifted| Polynomials::new(E::DIMENSION, lifted.degree));
        let v = |x: &Located<E::Point>| match &lifted {
            Some(polynomials) => {
                let width = polynomials.functions();
                let own = self.v.get(x.cell * width..(x.cell + 1) * width);
                polynomials.value(&parameters(&equation, x), own.unwrap_or(&[]))
            }
            None => functions.series(&equation, &self.v, x),
        };
        let of = Integrals::new((&equation, &self.polynomials), &v, of_y)?;
        let head = IMAGE_HEAD + rows.len() / self.unknowns.max(1);
        let mut images = vec![0.0; regions.len() * head];
        let image = |region: &Region, out: &mut [f64]| {
            let (weight, is_mean) = match region {
                Region::Point(x) => {
                    let mut all = vec![0.0; IMAGE_HEAD + self.unknowns];
                    of.add(&place(&equation, x)?, 1.0, &mut all);
                    self.contract(&all, rows, out);
                    (out[0], out[1]) = (out[0] + out[1], 0.0);
                    return Ok(());
                }
                Region::Arc(from, to) => {
                    return refined_mean(out, &mut |rule, out| {
                        let points = self.least_points + 2 * rule;
                        if points > MOST_POINTS {
                            return Ok(false);
                        }
                        let mut all = vec![0.0; IMAGE_HEAD + self.unknowns];
                        for (x, share) in nodes_between(&equation, [*from, *to], points)? {
                            of.add(&x, share, &mut all);
                        }
                        self.contract(&all, rows, out);
                        Ok(true)
                    });
                }
                region if is_weight(region) => (Some(equations.weight_of(region)?), false),
                _ => (None, true),
            };
            let measure: f64 = (0..equation.cells()).map(|j| equation.measure(j)).sum();
            let whole = if is_mean { measure } else { 1.0 };
            let at = |x: &E::Point| weight.as_ref().map_or(1.0, |weight| weight(x)) / whole;
            refined_mean(out, &mut |rule, out| {
                let points = self.least_points + 2 * rule;
                let work =
                    nodes::<E>(equation.cells(), points) * nodes::<E>(equation.cells(), of_y);
                if points > MOST_POINTS || work > MOST_WORK && rule > 1 {
                    return Ok(false);
                }
                let all = self.mean(&of, &Nodes::new(&equation, points)?, &at)?;
                self.contract(&all, rows, out);
                Ok(true)
            })
        };
        fill_rows(&mut images, head, |region, out| {
            let region = regions.get(region);
            image(region.ok_or(Error::Internal("a region is missing"))?, out)
        })?;
        Ok(images)
    }
}

impl<E: CustomEquation<Scalar = f64>> GlobalField for CustomField<'_, E> {
    fn rows(&self) -> usize {
        self.own_rows().len() / self.unknowns.max(1)
    }

    fn coefficients(&self) -> Option<&[f64]> {
        Some(&self.all)
    }

    fn images(&self, quantity: GlobalQuantity, regions: &[Region]) -> Result<Vec<f64>, Error> {
        only_u(quantity)?;
        self.images_of(regions, self.own_rows(), self.points)
    }

    fn finer(
        &self,
        quantity: GlobalQuantity,
        region: &Region,
        more: usize,
    ) -> Result<Option<Vec<f64>>, Error> {
        only_u(quantity)?;
        let points = self.points + more;
        if self.is_much(points) {
            return Ok(None);
        }
        let region = core::slice::from_ref(region);
        self.images_of(region, self.own_rows(), points).map(Some)
    }

    fn refine(&mut self, points: &[Region], error: f64) -> Result<f64, Error> {
        let mut before = self.images_of(points, &[], self.points)?;
        loop {
            let coarse = self.points;
            self.points += 2;
            if self.is_much(self.points) {
                self.points = coarse;
                return Ok(f64::NAN);
            }
            let now = self.images_of(points, &[], self.points)?;
            let moved = before.iter().zip(&now).map(|(a, b)| (a - b).abs());
            let moved = moved.fold(0.0, f64::max);
            if moved <= error {
                // The coarser rule is as good.
                self.points = coarse;
                return Ok(moved);
            }
            if self.points + 2 > MOST_POINTS {
                return Ok(moved);
            }
            before = now;
        }
    }
}
