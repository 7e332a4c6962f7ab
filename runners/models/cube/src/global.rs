//! The global estimate of a cube.

use std::sync::Arc;

use fredholm_core::galerkin::{Cells, functions};
use fredholm_core::global::{AdjointImage, AdjointScores, GlobalTask, Scores};
use fredholm_core::{Equation, Located, Sobol};
use fredholm_cube::{CubeRule, CubeScores, KernelMoments, KernelShape, ScalarField};
use fredholm_model::numbers::{dot, largest};
use fredholm_model::{
    CellNodes, Error, GlobalField, GlobalQuantity, GlobalRequest, GlobalSystem, Region, Sequence,
    WithGlobalJob, in_scalar, known_first, only_points, only_u, refined_mean, v_of_walks,
};
use fredholm_rayon::fill_rows;

use super::CubePartition;
use super::compiled::Parts;
use super::functions::{CubeScalar, Watched, WeightOf, Which, with_values};
use super::system::{Boxed, CubeSystem};

/// The most Gauss points of a cell and axis, and the most of all cells: more are not tried.
pub(super) const MOST_POINTS: usize = 12;
const MOST_NODES: f64 = 4e6;

/// Seconds of the sums of a value of the kernel.
const NODE_SECONDS: f64 = 10e-9;

/// Values of the kernel that a mean over x may take, once it has been compared.
const MOST_WORK: f64 = 1e9;

/// Intervals that grow from a singularity, on both sides of it, or shrink to a jump.
const GRADED: usize = 80;

/// Gauss points of a cell by which jumps are told from what is smooth: rules of few points take long to agree on anything.
pub(super) const LOOK_POINTS: usize = 6;

/// F, and the part of its image that comes from rough cells.
const HEAD: usize = 2;

/// Parts in which the cells of a mean are gone through, by as many threads.
const PARTS: usize = 64;

/// A solved cube whose walks score in every state.
pub(super) struct CubeGlobal<'m, const D: usize> {
    system: Arc<CubeSystem<'m, D>>,
    /// n.
    cells: usize,
}

impl<'m, const D: usize> CubeGlobal<'m, D> {
    pub(super) fn new(system: CubeSystem<'m, D>) -> Self {
        Self {
            cells: system.cut.all_cells(),
            system: Arc::new(system),
        }
    }

    fn walks_in<F: CubeScalar>(
        &self,
        request: &GlobalRequest<'_>,
        points: Option<&[Region]>,
        then: &mut WithGlobalJob<'_>,
    ) -> Result<(), Error> {
        let (system, walk) = (&*self.system, request.walk);
        let nodes = nodes(&system.cut, request.degree + 1);
        if nodes > MOST_NODES {
            return Err(Error::TooMuch {
                message: format!(
                    "T_K by quadrature takes {nodes:.1e} values of the kernel for each point, and more than \
                     {MOST_NODES:.0e} take too long: use fewer cells (`--cells`), or a product kernel"
                ),
            });
        }
        system.check_neighbour(walk)?;
        let v = system.solved.solution.rounded::<F>()?;
        with_values::<F, _>(system.cut.functions(), |values| {
            let cube = values.cube::<D>(system.cut.per_axis)?;
            let scores = CubeScores::new(&cube, request.degree)?;
            let parts = Parts {
                values,
                per_axis: system.cut.per_axis,
                options: walk.for_core(),
            };
            let domain = values.domain();
            let image = |region: &Region| match region {
                Region::Point(x) => {
                    let x: [F; D] = domain.unit(x);
                    let cube = &cube;
                    let image = move |y: &Located<[F; D]>| cube.kernel(&x, &y.point).to_f64();
                    Ok(Box::new(image) as Box<AdjointImage<'_, [F; D]>>)
                }
                _ => Err(only_points()),
            };
            let images = points.unwrap_or_default().iter().map(image);
            let images = images.collect::<Result<Vec<_>, Error>>()?;
            let images: Vec<_> = images.iter().map(|image| &**image).collect();
            let mut follow = |neighbour: &Boxed<'_, F, D>| {
                if points.is_some() {
                    let scores: &(dyn Scores<[F; D]> + Sync) = &AdjointScores(&images);
                    let job: GlobalTask<'_, _, _, _, _> =
                        GlobalTask::new(&cube, &cube, neighbour, scores, parts.options);
                    return then(&job);
                }
                let is_random = walk.sequence == Sequence::Random;
                let job: GlobalTask<'_, _, _, _, _> =
                    GlobalTask::new(&cube, &cube, neighbour, &scores, parts.options);
                let nodes = CellNodes {
                    cells: self.cells,
                    dimension: D,
                    points: request.degree + 1,
                    share: 1.0,
                };
                let known = known_first(request, &scores, nodes, &|cell, t| {
                    let (x, first) = job.first(Cells::point(&cube, cell, t));
                    Some((x, first.to_f64()))
                })?;
                if let Some(compiled) = F::compiled::<D>(system.cut.model).filter(|_| is_random) {
                    return compiled.with_global(&parts, neighbour, (&scores, &known), then);
                }
                let job = job.with_known(&known);
                match walk.sequence {
                    Sequence::Random => then(&job),
                    Sequence::Sobol => then(&job.with_generator::<Sobol>()),
                }
            };
            system.with_neighbour(values, walk.pairs, &v, &mut follow)
        })
    }
}

/// Values of the kernel, or of its factors, that T_K takes at one point with so many Gauss points of a cell and axis.
pub(super) fn nodes(cut: &CubePartition<'_>, points: usize) -> f64 {
    // Cells, and the intervals into which a kink or a singularity cuts them.
    let cells = match (cut.model.exponent() > 0.0, cut.model.is_rough()) {
        (true, _) => cut.per_axis + GRADED,
        // Every cell and its halves, and those of the cell with a jump.
        (_, true) => 3 * (cut.per_axis + GRADED),
        _ => cut.per_axis + 1,
    };
    let axis = (cells * points) as f64;
    let dimension = cut.model.dimension as i32;
    if cut.functions().is_product() {
        axis * f64::from(dimension)
    } else {
        axis.powi(dimension)
    }
}

impl<'m, const D: usize> GlobalSystem<'m> for CubeGlobal<'m, D> {
    fn degree(&self) -> usize {
        let lifted = self.system.lifted.as_ref();
        lifted.map_or(self.system.cut.degree, |lifted| lifted.degree)
    }

    fn most_degree(&self) -> usize {
        CubeScores::<D>::MOST_DEGREE
    }

    fn degrees(&self, degree: usize) -> Vec<usize> {
        fredholm_cube::degrees::<D>(degree).collect()
    }

    fn cells(&self) -> usize {
        self.cells
    }

    /// Values of the kernel and their sums.
    fn point_seconds(&self, degree: usize) -> f64 {
        let [kernel, ..] = self.system.cut.functions().seconds();
        (kernel + NODE_SECONDS) * nodes(&self.system.cut, degree + 3)
    }

    fn mean_points(&self, degree: usize) -> f64 {
        let axis = (self.system.cut.per_axis * (degree + 6)) as f64;
        axis.powi(D as i32)
    }

    fn measure(&self, _: usize) -> f64 {
        1.0 / self.cells as f64
    }

    fn sizes(&self) -> [f64; 2] {
        let solution = &self.system.solved.solution;
        let lifted = self.system.lifted.as_ref();
        let v = lifted.map_or(&solution.v, |lifted| &lifted.v);
        [largest(v), solution.radius_bound]
    }

    fn walks(
        &self,
        request: &GlobalRequest<'_>,
        then: &mut WithGlobalJob<'_>,
    ) -> Result<(), Error> {
        in_scalar!(self.system.cut.scalar, F => self.walks_in::<F>(request, None, then))
    }

    fn adjoint_walks(
        &self,
        request: &GlobalRequest<'_>,
        points: &[Region],
        then: &mut WithGlobalJob<'_>,
    ) -> Result<(), Error> {
        in_scalar!(self.system.cut.scalar, F => self.walks_in::<F>(request, Some(points), then))
    }

    fn field(
        &self,
        request: &GlobalRequest<'_>,
        mut rows: Vec<f64>,
    ) -> Result<Box<dyn GlobalField + 'm>, Error> {
        let v = match &self.system.lifted {
            Some(lifted) => lifted.v.clone(),
            None => v_of_walks(&self.system.solved.solution, self.system.cut.scalar)?,
        };
        let unknowns = self.cells * functions(D, request.degree);
        let mut all = vec![0.0; unknowns];
        // Exact where K is of degree p' + 1 on a cell, too.
        let points = request.degree + 1;
        let mut rough = Vec::new();
        let looks = D == 1 && !rows.is_empty() && self.system.cut.model.exponent() == 0.0;
        with_values::<f64, _>(self.system.cut.functions(), |values| {
            let cube = values.cube::<D>(self.system.cut.per_axis)?;
            let scores = CubeScores::new(&cube, request.degree)?;
            scores.embed(self.degree(), &v, &mut all);
            if !looks {
                return Ok(());
            }
            let (look, shape) = (points.max(LOOK_POINTS), KernelShape::Rough);
            let moments = KernelMoments::new(&cube, request.degree, look, shape)?;
            let source = values.function(Which::Source);
            for (cell, projection) in moments.rough_cells(&|y| source.value(y)) {
                // What the highest degree tells of F is no sign of what is lost.
                for row in rows.chunks_exact_mut(unknowns).rev().take(2) {
                    let last = row.get_mut((cell + 1) * scores.functions() - 1);
                    if let (Some(last), Some(part)) = (last, projection.last()) {
                        *last -= part;
                    }
                }
                rough.push(Rough { cell, projection });
            }
            Ok(())
        })?;
        all.extend(rows);
        Ok(Box::new(CubeField {
            system: Arc::clone(&self.system),
            degree: request.degree,
            unknowns,
            rows: all,
            rough: rough.into(),
            points,
        }))
    }
}

/// A cell in which F has a jump or a kink, and the coefficients of PF there.
struct Rough {
    cell: usize,
    projection: Vec<f64>,
}

/// v and other piecewise polynomials of one degree, and the quadrature of T_K.
///
/// Where F has a jump or a kink in a cell, F − PF is what the projection of e loses most, and where K(x, ·) jumps in that cell, too, T_K
/// lets it through. It is known: in one dimension ê + F − PF takes the place of ê on these cells.
struct CubeField<'m, const D: usize> {
    system: Arc<CubeSystem<'m, D>>,
    degree: usize,
    unknowns: usize,
    /// v first.
    rows: Vec<f64>,
    rough: Arc<[Rough]>,
    /// Gauss points of a cell and axis.
    points: usize,
}

/// What integrates over y.
struct Integrals<'a, const D: usize> {
    values: &'a Watched<'a, f64>,
    cut: &'a CubePartition<'a>,
    moments: &'a KernelMoments<D>,
    rough: &'a [Rough],
}

impl<const D: usize> Integrals<'_, D> {
    /// Adds `weight` times F(x) and ∫ K(x,y) F(y) dy over rough cells, and times ∫_Xj K(x,y) ψ_jb(y) dy for all j and b; `scratch` is
    /// as long as `out`.
    fn add(
        &self,
        x: &[f64; D],
        weight: f64,
        [source, out, scratch]: [&mut [f64]; 3],
    ) -> Result<(), Error> {
        let kernel = self.values.kernel();
        if self.cut.functions().is_product() {
            self.moments.fill_product(&kernel, x, scratch)?;
        } else {
            self.moments.fill(&kernel, x, scratch)?;
        }
        for (out, moment) in out.iter_mut().zip(&*scratch) {
            *out += weight * moment;
        }
        if let [source, rough] = source {
            let function = self.values.function(Which::Source);
            let at = |y: &[f64; D]| function.value(y);
            let of = |of: &Rough| self.moments.rough_integral(&kernel, x, of.cell, &at);
            *source += weight * at(x);
            *rough += weight * self.rough.iter().map(of).sum::<f64>();
        }
        Ok(())
    }

    /// Adds the points of every cell of a part, with their weights.
    fn add_cells(
        &self,
        part: usize,
        weight: &(dyn Fn(&[f64; D]) -> f64 + Sync),
        points: usize,
        out: &mut [f64],
    ) -> Result<(), Error> {
        let rule = CubeRule::new(&self.values.cube::<D>(self.cut.per_axis)?, 0, points)?;
        let (source, out) = out.split_at_mut(HEAD);
        let mut scratch = vec![0.0; out.len()];
        for cell in (part..rule.cells()).step_by(PARTS) {
            for (x, share) in rule.points(cell) {
                let share = share / rule.cells() as f64 * weight(&x);
                self.add(&x, share, [&mut *source, &mut *out, &mut scratch])?;
            }
        }
        Ok(())
    }
}

impl<const D: usize> CubeField<'_, D> {
    /// The image of a region: of a point, or of a mean with a weight.
    fn image(
        &self,
        of: &Integrals<'_, D>,
        region: &Region,
        rows: &[f64],
        out: &mut [f64],
    ) -> Result<(), Error> {
        let weight = match region {
            Region::Point(x) => {
                let x = of.values.domain().unit(x);
                let mut all = vec![0.0; HEAD + self.unknowns];
                let mut scratch = vec![0.0; self.unknowns];
                let (source, integrals) = all.split_at_mut(HEAD);
                of.add(&x, 1.0, [source, integrals, &mut scratch])?;
                self.contract(&all, rows, out);
                (out[0], out[1]) = (out[0] + out[1], 0.0);
                return Ok(());
            }
            region => WeightOf::region(region),
        };
        let weight = weight.map(|weight| of.values.function(Which::Weight(weight)));
        let at = |x: &[f64; D]| weight.map_or(1.0, |weight| weight.value(x));
        let cells = (self.unknowns / functions(D, self.degree)) as f64;
        let each = nodes(&self.system.cut, self.points);
        refined_mean(out, &mut |rule, out| {
            // As many points as for y at first, as what is left is as smooth as F and the weight.
            let points = self.degree + 1 + 2 * rule;
            let work = cells * (points as f64).powi(D as i32) * each;
            if points > MOST_POINTS || work > MOST_WORK && rule > 1 {
                return Ok(false);
            }
            let all = self.mean(of, &at, points)?;
            self.contract(&all, rows, out);
            Ok(true)
        })
    }

    /// F and the integrals over y in the mean, by so many points of a cell and axis.
    fn mean(
        &self,
        of: &Integrals<'_, D>,
        weight: &(dyn Fn(&[f64; D]) -> f64 + Sync),
        points: usize,
    ) -> Result<Vec<f64>, Error> {
        let width = HEAD + self.unknowns;
        let mut parts = vec![0.0; PARTS * width];
        fill_rows(&mut parts, width, |part, out| {
            of.add_cells(part, weight, points, out)
        })?;
        let mut all = vec![0.0; width];
        for part in parts.chunks_exact(width) {
            for (all, part) in all.iter_mut().zip(part) {
                *all += part;
            }
        }
        Ok(all)
    }

    /// F, and the integrals times every row.
    fn contract(&self, all: &[f64], rows: &[f64], out: &mut [f64]) {
        let (head, integrals) = all.split_at(HEAD);
        let images = rows
            .chunks_exact(self.unknowns)
            .map(|row| dot(integrals, row));
        let values = head.iter().copied().take(1).chain(images);
        for (out, value) in out.iter_mut().zip(values) {
            *out = value;
        }
        // ê, all but F, v and the parts of the highest degree, has F − PF besides.
        let functions = functions(D, self.degree);
        let projected = self.rough.iter().map(|rough| {
            let own = integrals.iter().skip(rough.cell * functions);
            let own = own.zip(&rough.projection);
            own.map(|(integral, of)| integral * of).sum::<f64>()
        });
        let rough = head.last().copied().unwrap_or(0.0) - projected.sum::<f64>();
        let ends = 2..out.len().saturating_sub(2);
        let replicates = out.get_mut(ends).unwrap_or_default();
        replicates.iter_mut().for_each(|of| *of += rough);
    }

    fn images_of(&self, regions: &[Region], rows: &[f64]) -> Result<Vec<f64>, Error> {
        let system = &self.system;
        with_values::<f64, _>(system.cut.functions(), |values| {
            let cube = values.cube::<D>(system.cut.per_axis)?;
            let shape = system.cut.model.shape();
            let of = Integrals {
                values,
                cut: &system.cut,
                moments: &KernelMoments::new(&cube, self.degree, self.points, shape)?,
                rough: &self.rough,
            };
            let width = 1 + rows.len() / self.unknowns;
            let mut images = vec![0.0; regions.len() * width];
            fill_rows(&mut images, width, |region, out| {
                self.image(&of, &regions[region], rows, out)
            })?;
            values.check()?;
            Ok(images)
        })
    }

    /// Whether so many points of a cell and axis are too many.
    fn is_much(&self, points: usize) -> bool {
        points > MOST_POINTS || nodes(&self.system.cut, points) > MOST_NODES
    }
}

impl<const D: usize> GlobalField for CubeField<'_, D> {
    fn rows(&self) -> usize {
        (self.rows.len() / self.unknowns).saturating_sub(1)
    }

    fn coefficients(&self) -> Option<&[f64]> {
        Some(&self.rows)
    }

    fn images(&self, quantity: GlobalQuantity, regions: &[Region]) -> Result<Vec<f64>, Error> {
        only_u(quantity)?;
        self.images_of(regions, &self.rows)
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
        let finer = Self {
            system: Arc::clone(&self.system),
            rows: Vec::new(),
            rough: Arc::clone(&self.rough),
            points,
            ..*self
        };
        let region = core::slice::from_ref(region);
        finer.images_of(region, &self.rows).map(Some)
    }

    fn refine(&mut self, points: &[Region], error: f64) -> Result<f64, Error> {
        let v = self.rows.get(..self.unknowns).unwrap_or_default().to_vec();
        let mut before = self.images_of(points, &v)?;
        loop {
            let coarse = self.points;
            self.points += 2;
            if self.is_much(self.points) {
                self.points = coarse;
                return Ok(f64::NAN);
            }
            let now = self.images_of(points, &v)?;
            // Points have no finer rule in x: the others are zeros.
            let moved = before.iter().zip(&now).map(|(a, b)| (a - b).abs());
            let moved = moved.fold(0.0, f64::max);
            if moved <= error {
                // The coarser rule is as good.
                self.points = coarse;
                return Ok(moved);
            }
            if self.is_much(self.points + 2) {
                return Ok(moved);
            }
            before = now;
        }
    }
}
