//! The whole function of a circle.

use core::f64::consts::TAU;
use std::sync::Arc;

use fredholm_circle::{
    Circle, CircleScores, ClosedForm, Moment, Point, Residual, WholeLaneReal, WholeSideBySide,
    moments,
};
use fredholm_core::whole::{AdjointImage, AdjointScores, Scores, WholeTask};
use fredholm_core::{Kernel, Located, Real, Sobol, Source, TransitionDensity};
use fredholm_model::numbers::largest;
use fredholm_model::{
    CellNodes, Error, IMAGE_HEAD, Region, Sequence, WholeField, WholeQuantity, WholeRequest,
    WholeSystem, WithWholeJob, in_scalar, known_first, only_points, only_u, refined_mean,
    v_of_walks,
};
use fredholm_rayon::fill_rows;
use fredholm_variance::gauss;

use super::light::Light;
use super::system::CircleSystem;

/// The largest degree of scores.
const MOST_DEGREE: usize = 6;

/// Gauss points on a cell for means over arcs, more and more.
const POINTS: [usize; 4] = [6, 10, 16, 32];

/// An expression in which the number of functions of a degree from 1 to [`MOST_DEGREE`] is a constant of this name.
macro_rules! of_score_degree {
    ($degree:expr, $name:ident => $then:expr) => {
        match $degree {
            1 => super::of_degree!(2 as $name => $then),
            2 => super::of_degree!(3 as $name => $then),
            3 => super::of_degree!(4 as $name => $then),
            4 => super::of_degree!(5 as $name => $then),
            5 => super::of_degree!(6 as $name => $then),
            6 => super::of_degree!(7 as $name => $then),
            _ => Err(Error::Internal("scores of this degree are not offered")),
        }
    };
}

/// A solved circle whose walks score in every state.
#[derive(Clone, Debug)]
pub(super) struct CircleWhole<'m> {
    system: Arc<CircleSystem<'m>>,
}

impl<'m> CircleWhole<'m> {
    pub(super) fn new(system: CircleSystem<'m>) -> Self {
        Self {
            system: Arc::new(system),
        }
    }

    fn walks_in<F: WholeLaneReal>(
        &self,
        request: &WholeRequest<'_>,
        then: &mut WithWholeJob<'_>,
    ) -> Result<(), Error> {
        let walk = request.walk;
        let setup = self
            .system
            .set_up::<F>(walk.pairs, None, (walk.absorption, false))?;
        let circle = self
            .system
            .cut
            .circle(&setup.tables, (walk.absorption, false))?;
        setup.boxed(&circle, &mut |neighbour| {
            of_score_degree!(request.degree, B => {
                let polynomials = circle.with_functions::<B>();
                let scores: &(dyn Scores<Point<F>> + Sync) = &CircleScores(&polynomials);
                let options = walk.for_core();
                let job: WholeTask<'_, _, _, _, _> =
                    WholeTask::new(&circle, &circle, neighbour, scores, options);
                let nodes = CellNodes {
                    cells: self.cells(),
                    dimension: 1,
                    points: B,
                    share: 1.0,
                };
                let width = TAU / self.cells() as f64;
                let known = known_first(request, scores, nodes, &|cell, t| {
                    let angle = width * (cell as f64 + t.first()?);
                    Some(job.first(circle.point(angle)))
                })?;
                let job = job.with_known(&known);
                match walk.sequence {
                    Sequence::Random if setup.has_same_kernel() => {
                        then(&WholeSideBySide::with_same_kernel(&job, &polynomials))
                    }
                    Sequence::Random => then(&job),
                    Sequence::Sobol => then(&job.with_generator::<Sobol>()),
                }
            })
        })
    }

    fn adjoint_walks_in<F: Real>(
        &self,
        request: &WholeRequest<'_>,
        points: &[Region],
        then: &mut WithWholeJob<'_>,
    ) -> Result<(), Error> {
        let walk = request.walk;
        let setup = self
            .system
            .set_up::<F>(walk.pairs, None, (walk.absorption, false))?;
        let circle = self
            .system
            .cut
            .circle(&setup.tables, (walk.absorption, false))?;
        let image = |region: &Region| match region {
            Region::Angle(angle) => {
                let (circle, x) = (&circle, circle.point(*angle));
                let image = move |y: &Located<Point<F>>| {
                    (circle.kernel(&x, &y.point) * circle.density(&x, &y.point)).to_f64()
                };
                Ok(Box::new(image) as Box<AdjointImage<'_, Point<F>>>)
            }
            _ => Err(only_points()),
        };
        let images = points
            .iter()
            .map(image)
            .collect::<Result<Vec<_>, Error>>()?;
        let images: Vec<_> = images.iter().map(|image| &**image).collect();
        let scores: &(dyn Scores<Point<F>> + Sync) = &AdjointScores(&images);
        setup.boxed(&circle, &mut |neighbour| {
            then(&WholeTask::new(
                &circle,
                &circle,
                neighbour,
                scores,
                walk.for_core(),
            ))
        })
    }
}

impl<'m> WholeSystem<'m> for CircleWhole<'m> {
    fn degree(&self) -> usize {
        self.system.cut.degree
    }

    fn most_degree(&self) -> usize {
        MOST_DEGREE
    }

    fn degrees(&self, degree: usize) -> Vec<usize> {
        (0..=degree).collect()
    }

    fn cells(&self) -> usize {
        self.system.cut.cells
    }

    fn measure(&self, _: usize) -> f64 {
        TAU / self.system.cut.cells as f64
    }

    fn adjoint_walks(
        &self,
        request: &WholeRequest<'_>,
        points: &[Region],
        then: &mut WithWholeJob<'_>,
    ) -> Result<(), Error> {
        in_scalar!(self.system.cut.scalar, F => self.adjoint_walks_in::<F>(request, points, then))
    }

    fn sizes(&self) -> [f64; 2] {
        let solution = &self.system.solution;
        [largest(&solution.v), solution.radius_bound]
    }

    fn walks(&self, request: &WholeRequest<'_>, then: &mut WithWholeJob<'_>) -> Result<(), Error> {
        in_scalar!(self.system.cut.scalar, F => self.walks_in::<F>(request, then))
    }

    fn field(
        &self,
        request: &WholeRequest<'_>,
        rows: Vec<f64>,
    ) -> Result<Box<dyn WholeField + 'm>, Error> {
        let v = v_of_walks(&self.system.solution, self.system.cut.scalar)?;
        let (own, functions) = (self.degree() + 1, request.degree + 1);
        let mut all = Vec::with_capacity(self.cells() * functions + rows.len());
        for v in v.chunks_exact(own) {
            // A polynomial of a lower degree is one of a higher.
            all.extend(v);
            all.resize(all.len() + functions - own, 0.0);
        }
        all.extend(rows);
        let mut field = CircleField {
            system: Arc::clone(&self.system),
            degree: request.degree,
            absorption: request.walk.absorption,
            rows: all,
            moments: Vec::new(),
        };
        field.moments = field.all_moments()?;
        Ok(Box::new(field))
    }
}

/// v and other piecewise polynomials of one degree, and what makes T_K of them.
#[derive(Debug)]
struct CircleField<'m> {
    system: Arc<CircleSystem<'m>>,
    degree: usize,
    absorption: f64,
    /// v first.
    rows: Vec<f64>,
    moments: Vec<Moment<f64>>,
}

impl CircleField<'_> {
    fn unknowns(&self) -> usize {
        self.system.cut.cells * (self.degree + 1)
    }

    fn circle(&self) -> Result<Circle<'_, f64, Light<'_>>, Error> {
        self.system
            .cut
            .circle(&self.system.tables, (self.absorption, false))
    }

    fn all_moments(&self) -> Result<Vec<Moment<f64>>, Error> {
        let cells = self.system.cut.cells;
        let mut all = vec![Moment::default(); self.rows.len() / (self.degree + 1)];
        of_score_degree!(self.degree, B => {
            let circle = self.circle()?;
            let polynomials = circle.with_functions::<B>();
            fill_rows(&mut all, cells, |row, out| {
                let from = row * self.unknowns();
                let row = self.rows.get(from..from + self.unknowns()).unwrap_or_default();
                moments::<f64, _, B>(&polynomials, row, out)
            })?;
            Ok(all)
        })
    }

    /// What turns every row into its image.
    fn residuals<'f, P: ClosedForm<f64, B>, const B: usize>(
        &'f self,
        polynomials: &'f P,
    ) -> Result<Vec<Residual<'f, f64, P, B>>, Error> {
        let rows = self.rows.chunks_exact(self.unknowns());
        let moments = self.moments.chunks_exact(self.system.cut.cells);
        let all = rows.zip(moments);
        let all = all.map(|(row, moments)| Ok(Residual::new(polynomials, row, moments)?));
        all.collect()
    }

    /// Gauss points on the cells of an arc, with weights.
    fn nodes(&self, [from, to]: [f64; 2], points: usize) -> Result<Vec<(f64, f64)>, Error> {
        let (cells, rule) = (self.system.cut.cells, gauss(points)?);
        let width = TAU / cells as f64;
        let mut nodes = Vec::new();
        for cell in 0..cells {
            let start = (cell as f64 * width).max(from);
            let end = ((cell + 1) as f64 * width).min(to);
            if start < end {
                let half = 0.5 * (end - start);
                nodes
                    .extend(rule.iter().map(|(t, weight)| {
                        (start + half * (1.0 + t), half * weight / (to - from))
                    }));
            }
        }
        Ok(nodes)
    }
}

/// Adds `weight` times F, T_K v and all other images at an angle.
fn add<P: ClosedForm<f64, B>, const B: usize>(
    circle: &Circle<'_, f64, Light<'_>>,
    residuals: &[Residual<'_, f64, P, B>],
    (angle, weight): (f64, f64),
    out: &mut [f64],
) {
    let point = circle.point(angle);
    let cell = point.cell();
    let x = Located { point, cell };
    let Some((source, images)) = out.split_first_mut() else {
        return;
    };
    *source += weight * circle.source(&point);
    for (image, residual) in images.iter_mut().zip(residuals) {
        *image += weight * residual.reflected(&x);
    }
}

impl WholeField for CircleField<'_> {
    fn rows(&self) -> usize {
        (self.rows.len() / self.unknowns()).saturating_sub(1)
    }

    fn coefficients(&self) -> Option<&[f64]> {
        Some(&self.rows)
    }

    fn images(&self, quantity: WholeQuantity, regions: &[Region]) -> Result<Vec<f64>, Error> {
        only_u(quantity)?;
        let width = IMAGE_HEAD + self.rows();
        let mut out = vec![0.0; regions.len() * width];
        of_score_degree!(self.degree, B => {
            let circle = self.circle()?;
            let polynomials = circle.with_functions::<B>();
            let residuals = self.residuals::<_, B>(&polynomials)?;
            fill_rows(&mut out, width, |region, out| {
                let arc = match regions[region] {
                    Region::Angle(angle) => {
                        add(&circle, &residuals, (angle, 1.0), out);
                        (out[0], out[1]) = (out[0] + out[1], 0.0);
                        return Ok(());
                    }
                    Region::Arc(from, to) => [from, to],
                    Region::Whole => [0.0, TAU],
                    _ => return Err(Error::Internal("a circle has angles and arcs")),
                };
                refined_mean(out, &mut |rule, out| {
                    let Some(&points) = POINTS.get(rule) else {
                        return Ok(false);
                    };
                    for node in self.nodes(arc, points)? {
                        add(&circle, &residuals, node, out);
                    }
                    Ok(true)
                })
            })?;
            Ok(out)
        })
    }
}
