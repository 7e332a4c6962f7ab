//! A solved circle: neighbour equations of all pairs and degrees, walks, predictions.

use core::f64::consts::TAU;
use std::borrow::Cow;

use fredholm_circle::{
    Circle, CircleQuadrature, LaneReal, MeanOver, Moment, Point, Residual, Tables, residual_moments,
};
use fredholm_core::galerkin::{
    Basis, DiagonalRule, GalerkinMatrix, PairKind, PairTable, Piecewise, Solution,
};
use fredholm_core::{DefaultGenerator, Job, Located, Neighbour, Real, Sobol, Source};
use fredholm_embedded::TableBuilder;
use fredholm_variance::{
    Density, MeanCoefficients, PairCosts, Quadrature, Start as Begin, VarianceSetup, gauss,
};

use super::jobs::{side_by_side, with_job, with_same_kernel};
use super::light::Light;
use super::whole::CircleWhole;
use super::{CirclePartition, diagonal, export, of_degree};
use fredholm_model::Examined;
use fredholm_model::cost::PointwisePairs;
use fredholm_model::pairs::{self, AnyPairs, PairCounts};
use fredholm_model::{
    Error, Goal, Pairs, Partitioned, Region, SavedSystem, Sequence, System, WholeSystem, in_scalar,
};
use fredholm_model::{Prepared, Request, Then, WalkOptions, WithStarts};

/// The tables of the coefficients, and the Galerkin solution.
#[derive(Debug)]
pub(super) struct CircleSystem<'m> {
    pub(super) cut: CirclePartition<'m>,
    pub(super) tables: Tables<f64>,
    pub(super) solution: Solution,
    /// Whether the solution is a lift, so that all pairs are pointwise, whatever else is asked for.
    pub(super) lifted: bool,
}

/// Tables, v and G of walks in one scalar.
#[derive(Debug)]
pub(super) struct Setup<'s, F> {
    pub(super) system: &'s CircleSystem<'s>,
    pub(super) tables: Tables<F>,
    pub(super) v: Vec<F>,
    pub(super) source: NeighbourSource<F>,
}

/// G as the neighbour equation of these pairs has it.
#[derive(Debug)]
pub(super) enum NeighbourSource<F> {
    /// G over S.
    Table(DiagonalRule, Vec<F>),
    /// The kinds of all pairs, and G over S.
    Kinds(Vec<u8>, Vec<F>),
    /// All pairs are pointwise.
    ClosedForm(Vec<Moment<F>>),
}

/// A neighbour equation of any kind: one type of walk for all degrees.
pub(super) type Boxed<'a, F> = dyn Neighbour<Scalar = F, Point = Point<F>> + Sync + 'a;

impl<'m> CircleSystem<'m> {
    /// The degree of the polynomials on a cell.
    pub(super) const fn degree(&self) -> usize {
        self.cut.degree
    }

    fn circle(&self, absorption: f64) -> Result<Circle<'_, f64, Light<'m>>, Error> {
        self.cut.circle(&self.tables, (absorption, false))
    }

    /// The Galerkin solution of u, or that of u less the emission of lights.
    fn solution(&self, last_step: bool) -> Cow<'_, Solution> {
        if !last_step {
            return Cow::Borrowed(&self.solution);
        }
        let emission = self.cut.emission_of_lights(last_step);
        let mut v = self.solution.v.clone();
        for (own, emission) in v.chunks_exact_mut(self.cut.degree + 1).zip(emission) {
            own[0] -= emission;
        }
        Cow::Owned(Solution { v, ..self.solution })
    }

    /// G, with these kinds of all pairs if there are some.
    fn source<F: Real>(
        &self,
        pairs: Pairs,
        kinds: Option<&[u8]>,
        absorption: f64,
        solution: &Solution,
    ) -> Result<NeighbourSource<F>, Error> {
        let pairs = if self.lifted { Pairs::Pointwise } else { pairs };
        let circle = self.circle(absorption)?;
        match self.cut.degree {
            0 => {
                let residual = || Ok(residual_moments(&circle, solution)?);
                self.source_of(pairs, kinds, (&circle, solution), &residual)
            }
            degree => of_degree!(degree, B => {
                let polynomials = circle.with_functions::<B>();
                let residual = || Ok(residual_moments(&polynomials, solution)?);
                self.source_of(pairs, kinds, (&polynomials, solution), &residual)
            }),
        }
    }

    fn source_of<F: Real>(
        &self,
        pairs: Pairs,
        kinds: Option<&[u8]>,
        (matrix, solution): (&dyn GalerkinMatrix<Scalar = f64>, &Solution),
        residual: &dyn Fn() -> Result<Vec<Moment<F>>, Error>,
    ) -> Result<NeighbourSource<F>, Error> {
        Ok(match (kinds, diagonal(pairs)) {
            (Some(table), _) => {
                let pairs = PairTable::new(table, self.cut.cells)?;
                let g = solution.source(matrix, &pairs)?;
                NeighbourSource::Kinds(table.to_vec(), g)
            }
            (None, Some(diagonal)) => {
                let pairs = DiagonalRule { diagonal };
                NeighbourSource::Table(pairs, solution.source(matrix, &pairs)?)
            }
            (None, None) => NeighbourSource::ClosedForm(residual()?),
        })
    }

    /// Tables, v and G, with these kinds of all pairs if there are some.
    pub(super) fn set_up<F: Real>(
        &self,
        pairs: Pairs,
        kinds: Option<&[u8]>,
        (absorption, last_step): (f64, bool),
    ) -> Result<Setup<'_, F>, Error> {
        let solution = self.solution(last_step);
        Ok(Setup {
            source: self.source(pairs, kinds, absorption, &solution)?,
            tables: self.cut.tables()?,
            v: solution.rounded()?,
            system: self,
        })
    }

    /// Sets up with the pairs that are asked for, one by one if they come from the theory.
    fn set_up_for<F: Real>(&self, request: &Request<'_>) -> Result<Setup<'_, F>, Error> {
        let pairs = request.walk.pairs;
        let walk = (request.walk.absorption, request.walk.last_step);
        if pairs != Pairs::Theory {
            return self.set_up(pairs, None, walk);
        }
        let kinds = self.theory(request)?;
        self.set_up(pairs, Some(&kinds), walk)
    }

    /// The kinds of all pairs, for what is asked for.
    fn theory(&self, request: &Request<'_>) -> Result<Vec<u8>, Error> {
        let (cells, degree) = (self.cut.cells, self.cut.degree);
        let theory = Pairs::Theory;
        let walk = (request.walk.absorption, request.walk.last_step);
        let nodes = pairs::nodes(cells, degree + 2)?;
        let of = |diagonal| pairs::table_of(&DiagonalRule { diagonal }, cells);
        let in_s = of(PairKind::Galerkin);
        let setup = self.set_up::<f64>(theory, Some(&in_s), walk)?;
        let circle = self.cut.circle(&setup.tables, walk)?;
        let quadrature = CircleQuadrature::new(&circle, nodes, degree)?;
        let terms = PairCosts {
            cells,
            allowed: &|_, _| quadrature.allowed_kinds(),
        };
        let mut chosen = None;
        setup.boxed(&circle, &mut |galerkin| {
            with_starts(request.goals, &circle, &quadrature, &mut |starts| {
                let chosen = &mut chosen;
                *chosen = Some(pairs::choose(of(PairKind::Pointwise), |table, last| {
                    let setup = self.set_up::<f64>(theory, Some(table), walk)?;
                    let mut evaluated = None;
                    setup.boxed(&circle, &mut |neighbour| {
                        let setting = VarianceSetup {
                            equation: &circle,
                            neighbour,
                            pairs: setup.pairs()?,
                            quadrature: &quadrature,
                            galerkin: Some(galerkin),
                        };
                        let model = setting.with_starts(starts)?;
                        let scores = (request.walk.estimator, request.walk.form);
                        evaluated =
                            Some(pairs::evaluate(&model, scores, starts.len(), &terms, last)?);
                        Ok(())
                    })?;
                    evaluated.ok_or(Error::Internal("no pairs were looked at"))
                })?);
                Ok(())
            })
        })?;
        chosen.ok_or(Error::Internal("no pairs were chosen"))
    }

    fn job_in<F: LaneReal>(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let setup = self.set_up_for::<F>(request)?;
        let walk = (request.walk.absorption, request.walk.last_step);
        let circle = self.cut.circle(&setup.tables, walk)?;
        let known = self.cut.known(&circle, request)?.into_iter();
        let goals = known
            .zip(request.goals)
            .map(|(known, goal)| Ok((known, setup.galerkin(&circle, &goal.region)?)))
            .collect::<Result<Vec<(f64, f64)>, Error>>()?;
        let galerkin: Vec<f64> = goals.iter().map(|(known, v)| known + v).collect();
        let goals = &goals;
        let mut walk = |job: &dyn Job| {
            then(&Prepared {
                job,
                galerkin: &galerkin,
                largest: fredholm_model::numbers::largest(&setup.v),
                radius_bound: self.solution.radius_bound,
                convergence: self.solution.convergence,
                // Their closed forms are a part of a score.
                pointwise: PointwisePairs::default(),
                neighbour_second_moment_radius: None,
                pair_counts: match &setup.source {
                    NeighbourSource::Kinds(table, _) => Some(PairCounts::of(table)),
                    _ => None,
                },
            })
        };
        match &setup.source {
            _ if request.walk.sequence == Sequence::Sobol => {
                setup.boxed(&circle, &mut |neighbour| {
                    with_job::<Sobol, _, _, _>(&circle, neighbour, request, goals, &mut walk)
                })
            }
            NeighbourSource::Table(pairs, g) if self.cut.degree == 0 => {
                let neighbour = Piecewise::with_pointwise(&circle, &circle, *pairs, &setup.v, g)?;
                side_by_side(&circle, &neighbour, request, goals, &mut walk)
            }
            NeighbourSource::ClosedForm(moments) if self.cut.degree == 0 => {
                let neighbour = Residual::new(&circle, &setup.v, moments)?;
                side_by_side(&circle, &neighbour, request, goals, &mut walk)
            }
            NeighbourSource::ClosedForm(_) => setup.boxed(&circle, &mut |neighbour| {
                with_same_kernel(&circle, neighbour, request, goals, &mut walk)
            }),
            _ => setup.boxed(&circle, &mut |neighbour| {
                with_job::<DefaultGenerator, _, _, _>(&circle, neighbour, request, goals, &mut walk)
            }),
        }
    }

    fn tables_in<F: Real + fredholm_embedded::Number>(
        &self,
        pairs: Pairs,
        absorption: f64,
    ) -> Result<TableBuilder, Error> {
        let walk = (absorption, false);
        let setup = self.set_up::<F>(pairs, None, walk)?;
        let circle = self.cut.circle(&setup.tables, walk)?;
        Ok(export::circle(
            &setup,
            circle.constants(),
            *circle.emission(),
        ))
    }
}

/// What is done with a neighbour equation.
type Use<'a, F> = dyn FnMut(&Boxed<'_, F>) -> Result<(), Error> + 'a;

impl<F: Real> Setup<'_, F> {
    /// (v, Φ).
    fn galerkin(&self, circle: &Circle<'_, F, Light<'_>>, region: &Region) -> Result<f64, Error> {
        Ok(match *region {
            Region::Angle(s) if self.system.cut.degree > 0 => {
                of_degree!(self.system.cut.degree, B => self.value::<B>(circle, s))
            }
            Region::Angle(s) => {
                let cell = circle.point(s).cell();
                self.v.get(cell).map_or(f64::NAN, |v| v.to_f64())
            }
            Region::Arc(from, to) => MeanOver::new(circle, from, to)?.of(&self.v),
            _ => return Err(Error::Internal("a circle has angles and arcs")),
        })
    }

    /// v at an angle, of B functions per cell.
    fn value<const B: usize>(&self, circle: &Circle<'_, F, Light<'_>>, s: f64) -> f64 {
        let point = circle.point(s);
        let cell = point.cell();
        let psi: [F; B] = circle.with_functions().basis(&Located { point, cell });
        let v = self.v.iter().skip(cell * B);
        let sum = v.zip(psi).fold(F::zero(), |sum, (&v, psi)| sum + v * psi);
        sum.to_f64()
    }

    /// Whether h = k for all pairs.
    pub(super) const fn has_same_kernel(&self) -> bool {
        matches!(self.source, NeighbourSource::ClosedForm(_))
    }

    /// Calls `then` with the neighbour equation as one type for all degrees and pairs.
    pub(super) fn boxed(
        &self,
        circle: &Circle<'_, F, Light<'_>>,
        then: &mut Use<'_, F>,
    ) -> Result<(), Error> {
        let cells = self.system.cut.cells;
        let v = &self.v;
        if self.system.cut.degree > 0 {
            return of_degree!(self.system.cut.degree, B => {
                let polynomials = circle.with_functions::<B>();
                let own = &polynomials;
                match &self.source {
                    NeighbourSource::Table(pairs, g) => {
                        then(&Piecewise::with_pointwise(own, own, *pairs, v, g)?)
                    }
                    NeighbourSource::Kinds(table, g) => {
                        let pairs = PairTable::new(table, cells)?;
                        then(&Piecewise::with_pointwise(own, own, pairs, v, g)?)
                    }
                    NeighbourSource::ClosedForm(moments) => {
                        then(&Residual::new(own, v, moments)?)
                    }
                }
            });
        }
        match &self.source {
            NeighbourSource::Table(pairs, g) => {
                then(&Piecewise::with_pointwise(circle, circle, *pairs, v, g)?)
            }
            NeighbourSource::Kinds(table, g) => {
                let pairs = PairTable::new(table, cells)?;
                then(&Piecewise::with_pointwise(circle, circle, pairs, v, g)?)
            }
            NeighbourSource::ClosedForm(moments) => then(&Residual::new(circle, v, moments)?),
        }
    }

    /// The kinds of pairs; with all pairs pointwise none is left out.
    fn pairs(&self) -> Result<AnyPairs<'_>, Error> {
        Ok(match &self.source {
            NeighbourSource::Table(pairs, _) => AnyPairs::Diagonal(*pairs),
            NeighbourSource::Kinds(table, _) => {
                AnyPairs::Table(PairTable::new(table, self.system.cut.cells)?)
            }
            NeighbourSource::ClosedForm(_) => AnyPairs::Diagonal(DiagonalRule {
                diagonal: PairKind::Pointwise,
            }),
        })
    }
}

impl CircleSystem<'_> {
    /// The projection of F + T_K v on polynomials of a degree from 1 on.
    fn lifted(&self, degree: usize) -> Result<Vec<f64>, Error> {
        let circle = self.circle(ANY)?;
        let (own, cells) = (&self.solution.v, self.cut.cells);
        let mut moments = vec![Moment::default(); cells];
        let project = |reflected: &(dyn Fn(&Located<Point<f64>>) -> f64 + Sync)| {
            let mut v = vec![0.0; cells * (degree + 1)];
            of_degree!(degree, B => {
                let polynomials = circle.with_functions::<B>();
                let rule = gauss(B + 2)?;
                let width = TAU / cells as f64;
                for (cell, v) in v.chunks_exact_mut(B).enumerate() {
                    for (t, weight) in &rule {
                        let point = circle.point(width * (cell as f64 + 0.5 * (1.0 + t)));
                        let x = Located { point, cell };
                        let value = 0.5 * weight * (circle.source(&point) + reflected(&x));
                        let psi: [f64; B] = polynomials.basis(&x);
                        for (v, psi) in v.iter_mut().zip(psi) {
                            *v += value * psi;
                        }
                    }
                }
            });
            Ok(v)
        };
        match self.cut.degree {
            0 => {
                fredholm_circle::moments(&circle, own, &mut moments)?;
                let residual = Residual::<_, _, 1>::new(&circle, own, &moments)?;
                project(&|x| residual.reflected(x))
            }
            own_degree => of_degree!(own_degree, B => {
                let polynomials = circle.with_functions::<B>();
                fredholm_circle::moments(&polynomials, own, &mut moments)?;
                let residual = Residual::<_, _, B>::new(&polynomials, own, &moments)?;
                project(&|x| residual.reflected(x))
            }),
        }
    }
}

/// A q0 for what does not depend on it.
const ANY: f64 = 0.5;

impl System for CircleSystem<'_> {
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        self.cut.check_variance(walk)
    }

    fn job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        in_scalar!(self.cut.scalar, F => self.job_in::<F>(request, then))
    }

    fn examine(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let setup = self.set_up_for::<f64>(request)?;
        let walk = (request.walk.absorption, request.walk.last_step);
        let circle = self.cut.circle(&setup.tables, walk)?;
        let quadrature = CircleQuadrature::new(&circle, nodes, self.cut.degree)?;
        let known = self.cut.known(&circle, request)?;
        let sites = quadrature.sites();
        let pairs = setup.pairs()?;
        let coefficients = MeanCoefficients {
            cells: self.cut.cells,
            mean: &|i, j| circle.mean(i, j),
        };
        let coefficients =
            (self.cut.degree == 0 && self.cut.cells <= sites).then_some(coefficients);
        setup.boxed(&circle, &mut |neighbour| {
            with_starts(request.goals, &circle, &quadrature, &mut |starts| {
                let setting = VarianceSetup {
                    equation: &circle,
                    neighbour,
                    pairs,
                    quadrature: &quadrature,
                    galerkin: None,
                };
                then(&Examined {
                    model: &setting.with_starts(starts)?,
                    coefficients,
                    hides: None,
                    pieces: None,
                    goals: request.goals,
                    known: &known,
                    place: &|site| {
                        // A sixteenth of the circle.
                        let part = (16.0 * (site as f64 + 0.5) / sites as f64).floor();
                        let [from, to] = [part, part + 1.0].map(|part| TAU * part / 16.0);
                        format!("[{from:.2}, {to:.2}]")
                    },
                })
            })
        })
    }

    fn tables(&self, pairs: Pairs, absorption: f64) -> Result<TableBuilder, Error> {
        in_scalar!(self.cut.scalar, F => self.tables_in::<F>(pairs, absorption))
    }

    fn saved(&self) -> Option<SavedSystem<'_>> {
        Some(SavedSystem::new(&self.solution, &[]))
    }

    fn lift<'s>(self: Box<Self>, degree: usize) -> Result<Box<dyn System + 's>, Error>
    where
        Self: 's,
    {
        let v = self.lifted(degree)?;
        Ok(Box::new(Self {
            cut: CirclePartition { degree, ..self.cut },
            tables: self.tables,
            solution: Solution { v, ..self.solution },
            lifted: true,
        }))
    }

    fn whole<'s>(self: Box<Self>) -> Result<Box<dyn WholeSystem<'s> + 's>, Error>
    where
        Self: 's,
    {
        Ok(Box::new(CircleWhole::new(*self)))
    }
}

/// Calls `then` with the starts of the walks of all goals, as an analysis sees it.
fn with_starts(
    goals: &[Goal],
    circle: &Circle<'_, f64, Light<'_>>,
    quadrature: &CircleQuadrature<'_, '_, Light<'_>>,
    then: &mut WithStarts<'_, Point<f64>>,
) -> Result<(), Error> {
    let densities: Vec<_> = goals
        .iter()
        .map(|goal| uniform_on(&goal.region, quadrature))
        .collect();
    let start = |(goal, density)| match (&goal as &&Goal).region {
        Region::Angle(s) => Begin::At(circle.point(s)),
        _ => Begin::Density(density),
    };
    let starts: Vec<Begin<'_, Point<f64>>> = goals
        .iter()
        .zip(densities.iter().map(|density| density as _))
        .map(start)
        .collect();
    then(&starts)
}

/// The mean over an arc, by the nodes in it.
fn uniform_on<L: Quadrature<Point = Point<f64>>>(
    region: &Region,
    quadrature: &L,
) -> impl Fn(&Point<f64>) -> Density + use<L> {
    let (from, to) = match *region {
        Region::Arc(from, to) => (from, to),
        _ => (0.0, TAU),
    };
    let inside = move |x: &Point<f64>| (from..=to).contains(&x.angle());
    let mut measure = 0.0;
    for site in 0..quadrature.sites() {
        quadrature.nodes(site, |x, weight| {
            measure += if inside(&x) { weight } else { 0.0 }
        });
    }
    move |x| {
        if inside(x) {
            Density::uniform(measure)
        } else {
            Density::nothing()
        }
    }
}
