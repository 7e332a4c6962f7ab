//! The whole function of a circle.

use core::f64::consts::TAU;
use std::sync::Arc;

use fredholm_circle::{Circle, ClosedForm, Moment, Point, Residual, moments};
use fredholm_core::whole::{BasisScores, Scores, WholeTask};
use fredholm_core::{Located, Real, Source};
use fredholm_model::{
    Error, Pairs, Region, Scalar, Subject, WholeField, WholeRequest, WholeSystem, WithWholeJob,
};
use fredholm_model::numbers::largest;
use fredholm_rayon::fill_rows;
use fredholm_variance::gauss;

use super::light::Light;
use super::system::CircleSystem;

/// The largest degree of scores.
const MOST_DEGREE: usize = 6;

/// Gauss points on a cell for means over arcs: F and T_K v are waves on it, of which the shortest that cells resolve at
/// all has twice a cell's length.
const POINTS: usize = 8;

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

    fn walks_in<F: Real>(
        &self,
        request: &WholeRequest<'_>,
        then: &mut WithWholeJob<'_>,
    ) -> Result<(), Error> {
        let walk = request.walk;
        if walk.pairs == Pairs::Theory {
            return Err(Error::Option {
                subject: Subject::Pairs,
                message: "\"theory\" chooses pairs for targets, and the whole function has none: use \"default\""
                    .to_owned(),
            });
        }
        let setup = self.system.set_up::<F>(walk.pairs, None, walk.absorption)?;
        let circle = self.system.cut.circle(&setup.tables, walk.absorption)?;
        setup.boxed(&circle, &mut |neighbour| {
            of_score_degree!(request.degree, B => {
                let polynomials = circle.with_functions::<B>();
                let scores: &(dyn Scores<Point<F>> + Sync) = &BasisScores::<_, B>(&polynomials);
                then(&WholeTask::new(&circle, neighbour, scores, walk.for_core()))
            })
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

    fn sizes(&self) -> [f64; 2] {
        let solution = &self.system.solution;
        [largest(&solution.v), solution.radius_bound]
    }

    fn walks(&self, request: &WholeRequest<'_>, then: &mut WithWholeJob<'_>) -> Result<(), Error> {
        match self.system.cut.scalar {
            Scalar::F32 => self.walks_in::<f32>(request, then),
            Scalar::F64 => self.walks_in::<f64>(request, then),
        }
    }

    fn field(
        &self,
        request: &WholeRequest<'_>,
        rows: Vec<f64>,
    ) -> Result<Box<dyn WholeField + 'm>, Error> {
        let v = match self.system.cut.scalar {
            Scalar::F32 => self.system.solution.rounded_through::<f32>()?,
            Scalar::F64 => self.system.solution.v.clone(),
        };
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
        self.system.cut.circle(&self.system.tables, self.absorption)
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

    /// The points of a region with weights.
    fn nodes(&self, region: &Region) -> Result<Vec<(f64, f64)>, Error> {
        let whole = Region::Arc(0.0, TAU);
        let region = if *region == Region::Whole { &whole } else { region };
        match *region {
            Region::Angle(angle) => Ok(vec![(angle, 1.0)]),
            Region::Arc(from, to) => {
                let (cells, rule) = (self.system.cut.cells, gauss(POINTS)?);
                let width = TAU / cells as f64;
                let mut nodes = Vec::new();
                for cell in 0..cells {
                    let start = (cell as f64 * width).max(from);
                    let end = ((cell + 1) as f64 * width).min(to);
                    if start < end {
                        let half = 0.5 * (end - start);
                        nodes.extend(rule.iter().map(|(t, weight)| {
                            (start + half * (1.0 + t), half * weight / (to - from))
                        }));
                    }
                }
                Ok(nodes)
            }
            _ => Err(Error::Internal("a circle has angles and arcs")),
        }
    }
}

impl WholeField for CircleField<'_> {
    fn rows(&self) -> usize {
        (self.rows.len() / self.unknowns()).saturating_sub(1)
    }

    fn images(&self, regions: &[Region]) -> Result<Vec<f64>, Error> {
        let width = 1 + self.rows();
        let mut out = vec![0.0; regions.len() * width];
        of_score_degree!(self.degree, B => {
            let circle = self.circle()?;
            let polynomials = circle.with_functions::<B>();
            let residuals = self.residuals::<_, B>(&polynomials)?;
            fill_rows(&mut out, width, |region, out| {
                for (angle, weight) in self.nodes(&regions[region])? {
                    let point = circle.point(angle);
                    let x = Located { point, cell: point.cell() };
                    for (out, residual) in out.iter_mut().zip(&residuals) {
                        *out += weight * residual.reflected(&x);
                    }
                    if let Some(iterate) = out.first_mut() {
                        *iterate += weight * circle.source(&point);
                    }
                }
                Ok::<(), Error>(())
            })?;
            Ok(out)
        })
    }
}
