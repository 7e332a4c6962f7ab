//! A solved cube: walks and predictions of one dimension, whatever the degree.

use fredholm_core::galerkin::{GalerkinMatrix, PairKind, Solution};
use fredholm_core::{Form, Goals, Neighbour, Real, Sobol, UncertainControl};
use fredholm_cube::{CubeQuadrature, CubeSetup, Mean, Weighted};
use fredholm_embedded::{Number, TableBuilder};
use fredholm_variance::{MeanCoefficients, PairCosts, VarianceSetup};

use super::compiled::{Follow, MakeGoals, Parts};
use super::degree::{AnyDegree, Of};
use super::functions::{CubeScalar, Watched, WeightOf, Which, with_values};
use super::lift::{Lifted, LiftedNeighbour};
use super::regions::place_of;
use super::setup::ANY;
use super::starts::{WeightedStart, goals_of, with_starts};
use super::table::Table;
use super::whole::CubeWhole;
use super::{CubeModel, CubePartition, export};
use fredholm_model::Examined;
use fredholm_model::cost::PointwisePairs;
use fredholm_model::pairs::{self, AnyPairs, Band, PairCounts};
use fredholm_model::{
    Error, Pairs, Partitioned, SavedSystem, Sequence, Subject, System, WholeSystem, in_scalar,
};
use fredholm_model::{Prepared, Request, Then, WalkOptions, WithJob};

/// Coefficients and Galerkin solution of a cube.
pub(super) struct CubeSystem<'m, const D: usize> {
    pub(super) cut: CubePartition<'m>,
    pub(super) solved: Solved<'m, D>,
    /// What makes neighbour equations of its degree.
    pub(super) degree: &'static dyn AnyDegree<D>,
    /// What takes the place of the solution in neighbour equations with h = k.
    pub(super) lifted: Option<Lifted>,
}

/// The coefficients, and the Galerkin solution.
#[derive(Debug)]
pub(super) struct Solved<'a, const D: usize> {
    pub(super) table: Table<'a, D>,
    pub(super) solution: Solution,
}

/// A neighbour equation of any kind and degree: one type of walk for all.
pub(super) type Boxed<'a, F, const D: usize> =
    dyn Neighbour<Scalar = F, Point = [F; D]> + Sync + 'a;

/// What is done with a neighbour equation.
pub(super) type Use<'a, F, const D: usize> = dyn FnMut(&Boxed<'_, F, D>) -> Result<(), Error> + 'a;

/// The pairs of a neighbour equation.
#[derive(Clone, Debug)]
pub(super) enum Kinds {
    /// All in S, or the diagonal of another kind.
    Diagonal(fredholm_core::galerkin::DiagonalRule),
    /// Pairs near the diagonal are pointwise.
    Band(Band),
    /// All pointwise.
    AllPointwise,
    /// Each by itself.
    Table(Vec<u8>),
}

impl Kinds {
    /// The pairs in one type.
    pub(super) fn any(&self, cells: usize) -> Result<AnyPairs<'_>, Error> {
        Ok(match self {
            Self::AllPointwise => AnyPairs::AllPointwise,
            Self::Diagonal(pairs) => AnyPairs::Diagonal(*pairs),
            Self::Band(band) => AnyPairs::Band(*band),
            Self::Table(table) => {
                AnyPairs::Table(fredholm_core::galerkin::PairTable::new(table, cells)?)
            }
        })
    }
}

/// The weights that are asked for.
fn weights<'a>(request: &Request<'a>) -> impl Iterator<Item = WeightOf<'a>> {
    let goals = request.goals.iter();
    goals.filter_map(|goal| WeightOf::region(&goal.region))
}

impl<const D: usize> CubeSystem<'_, D> {
    /// The spectral radius of T_h²p if it is looked at, which must be below 1.
    pub(super) fn check_neighbour(
        &self,
        pairs: Pairs,
        absorption: f64,
    ) -> Result<Option<f64>, Error> {
        // With all pairs pointwise h is k, which has been looked at.
        if self.cut.diagonal_rule(pairs).is_none() {
            return Ok(None);
        }
        let radius = match &self.solved.table {
            table @ Table::Dense { .. } => with_values::<f64, _>(self.cut.functions(), |values| {
                let cube = values.cube::<D>(self.cut.per_axis, absorption)?;
                let setup = CubeSetup::new(&cube, self.degree.functions());
                Ok(setup.neighbour_second_moment_radius(table)?)
            })?,
            Table::Product(tables) => tables.neighbour_second_moment_radius(absorption)?,
            // h is k at the middles of cells, which is what the estimate for k is made of.
            Table::Middles(_) => self.cut.plain_radius(absorption)?,
        };
        if radius < 1.0 {
            return Ok(Some(radius));
        }
        Err(Error::InfiniteNeighbour {
            cells: self.cut.per_axis,
            points: self.cut.points(),
            radius,
        })
    }

    /// The kinds of pairs that are asked for.
    pub(super) fn kinds(&self, request: &Request<'_>) -> Result<Kinds, Error> {
        Ok(match request.walk.pairs {
            Pairs::Theory => Kinds::Table(self.theory(request)?),
            pairs => match (self.cut.band(pairs), self.cut.diagonal_rule(pairs)) {
                (Some(band), _) => Kinds::Band(band),
                (None, Some(pairs)) => Kinds::Diagonal(pairs),
                (None, None) => Kinds::AllPointwise,
            },
        })
    }

    /// The kinds of all pairs, for what is asked for.
    fn theory(&self, request: &Request<'_>) -> Result<Vec<u8>, Error> {
        let cells = self.cut.all_cells();
        let nodes = pairs::nodes(cells, 2_usize.saturating_pow(D as u32))?;
        with_values::<f64, _>(self.cut.functions(), |values| {
            let absorption = request.walk.absorption;
            let cube = values.cube::<D>(self.cut.per_axis, absorption)?;
            let v = self.solved.solution.rounded::<f64>()?;
            let means = self.weight_means::<f64>(request)?;
            let weighted = self.weighted::<f64>(values, &means, &v)?;
            let quadrature = CubeQuadrature::new(&cube, nodes, 0)?;
            let terms = PairCosts {
                cells,
                allowed: &|_, _| quadrature.allowed_kinds(true),
            };
            let default = fredholm_core::galerkin::DiagonalRule {
                diagonal: PairKind::Pointwise,
            };
            let in_s = Kinds::Diagonal(fredholm_core::galerkin::DiagonalRule {
                diagonal: PairKind::Galerkin,
            });
            let of = Of {
                cut: &self.cut,
                values,
                absorption,
                table: &self.solved.table,
                solution: &self.solved.solution,
                moments: None,
                v: &v,
            };
            let with = |kinds: &Kinds, then: &mut Use<'_, f64, D>| {
                f64::degree(self.degree).with_neighbour(&of, kinds, then)
            };
            let mut chosen = None;
            with(&in_s, &mut |galerkin| {
                with_starts(
                    request,
                    values.domain(),
                    galerkin,
                    &weighted,
                    &mut |starts| {
                        let table = pairs::table_of(&default, cells);
                        let found = pairs::choose(table, |table, last| {
                            let kinds = Kinds::Table(table.to_vec());
                            let mut evaluated = None;
                            with(&kinds, &mut |neighbour| {
                                let setting = VarianceSetup {
                                    equation: &cube,
                                    neighbour,
                                    pairs: kinds.any(cells)?,
                                    quadrature: &quadrature,
                                    galerkin: Some(galerkin),
                                };
                                let model = setting.with_starts(starts)?;
                                let scores = (request.walk.estimator, request.walk.form);
                                let goals = starts.len();
                                evaluated =
                                    Some(pairs::evaluate(&model, scores, goals, &terms, last)?);
                                Ok(())
                            })?;
                            evaluated.ok_or(Error::Internal("no pairs were looked at"))
                        })?;
                        chosen = Some(found);
                        Ok(())
                    },
                )
            })?;
            chosen.ok_or(Error::Internal("no pairs were chosen"))
        })
    }

    /// Numbers near the means over the cells of every weight times the functions there.
    pub(super) fn weight_means<'r, F: Real>(
        &self,
        request: &Request<'r>,
    ) -> Result<Vec<(WeightOf<'r>, Vec<F>)>, Error> {
        with_values::<f64, _>(self.cut.functions(), |values| {
            weights(request)
                .map(|weight| {
                    let cube = values.cube::<D>(self.cut.per_axis, ANY)?;
                    let setup = CubeSetup::new(&cube, self.degree.functions());
                    let weight_fn = values.function(Which::Weight(weight));
                    let means = setup.means(&weight_fn, self.cut.rule()?)?;
                    Ok((weight, fredholm_core::galerkin::rounded(&means)?))
                })
                .collect()
        })
    }

    /// The weighted means that are asked for.
    fn weighted<'a, F: CubeScalar>(
        &self,
        values: &'a Watched<'a, F>,
        means: &'a [(WeightOf<'a>, Vec<F>)],
        v: &[F],
    ) -> Result<Vec<WeightedStart<'a, F, D>>, Error> {
        let cube = values.cube::<D>(self.cut.per_axis, ANY)?;
        let functions = self.degree.functions();
        let of = |(weight, means): &'a (WeightOf<'a>, Vec<F>)| {
            let weight = values.function(Which::Weight(*weight));
            let weighted = Weighted::with_functions(&cube, functions, weight, means, v)?;
            Ok(WeightedStart {
                weight,
                weighted: Some(weighted),
            })
        };
        means.iter().map(of).collect()
    }

    fn job_in<F: CubeScalar>(
        &self,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error> {
        let walk = request.walk;
        let is_residual = walk.form == Form::Residual || self.lifted.is_some();
        let neighbour_second_moment_radius = if walk.allow_infinite_variance || is_residual {
            None
        } else {
            self.check_neighbour(walk.pairs, walk.absorption)?
        };
        let kinds = self.kinds(request)?;
        let means = self.weight_means::<F>(request)?;
        let pointwise = match &self.lifted {
            Some(_) => PointwisePairs::default(),
            None => self.cut.pointwise_pairs(walk.pairs)?,
        };
        let moments = self.moments(request)?;
        let errors = self.control_errors(moments.as_ref(), request)?;
        let (moments, solution) = self.own(moments.as_ref());
        with_values::<F, _>(self.cut.functions(), |values| {
            let v = match &self.lifted {
                // What means ask for.
                Some(lifted) => lifted.lower::<F, D>(self.cut.degree),
                None => solution.rounded::<F>()?,
            };
            let weighted = self.weighted::<F>(values, &means, &v)?;
            let degree = F::degree(self.degree);
            let mean = Mean::of_functions(&v, self.degree.functions().count());
            let of = Of {
                cut: &self.cut,
                values,
                absorption: walk.absorption,
                table: &self.solved.table,
                solution,
                moments,
                v: &v,
            };
            let parts = Parts {
                values,
                per_axis: self.cut.per_axis,
                absorption: walk.absorption,
                options: walk.for_core(),
            };
            let goals = |neighbour: &Boxed<'_, F, D>| {
                goals_of(values.domain(), neighbour, request, &weighted, mean)
            };
            let mut follow = |follow: Follow<'_, F, D>| {
                with_job(
                    (self.cut.model, walk.sequence),
                    &parts,
                    follow,
                    &goals,
                    &mut |job, galerkin| {
                        then(&Prepared {
                            job: &UncertainControl {
                                job,
                                errors: &errors,
                            },
                            galerkin,
                            largest: fredholm_model::numbers::largest(&v),
                            radius_bound: solution.radius_bound,
                            convergence: solution.convergence,
                            pointwise,
                            neighbour_second_moment_radius,
                            pair_counts: match &kinds {
                                Kinds::Table(table) => Some(PairCounts::of(table)),
                                _ => None,
                            },
                        })
                    },
                )
            };
            if let Some(lifted) = &self.lifted {
                return with_values::<f64, _>(self.cut.functions(), |exact| {
                    let neighbour = LiftedNeighbour::new(&self.cut, lifted, values, exact)?;
                    follow(Follow::Any(&neighbour))
                });
            }
            let constants = match &kinds {
                Kinds::Diagonal(rule)
                    if rule.diagonal == PairKind::Galerkin
                        && moments.is_none()
                        && walk.sequence == Sequence::Random =>
                {
                    F::compiled::<D>(self.cut.model)
                        .and(self.solved.table.constants())
                        .map(|dense| (dense, *rule))
                }
                _ => None,
            };
            if let Some((dense, rule)) = constants {
                let vectors = solution.for_walks(&dense, rule)?;
                return follow(Follow::Constants(&dense, &vectors));
            }
            degree.with_neighbour(&of, &kinds, &mut |neighbour| follow(Follow::Any(neighbour)))
        })
    }

    fn examine_in(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let cells = self.cut.all_cells();
        let kinds = self.kinds(request)?;
        let means = self.weight_means::<f64>(request)?;
        let moments = self.moments(request)?;
        let (moments, solution) = self.own(moments.as_ref());
        let lifted = self.lifted.as_ref();
        with_values::<f64, _>(self.cut.functions(), |values| {
            let absorption = request.walk.absorption;
            let cube = values.cube::<D>(self.cut.per_axis, absorption)?;
            let v = match lifted {
                Some(lifted) => lifted.lower::<f64, D>(self.cut.degree),
                None => solution.rounded::<f64>()?,
            };
            let weighted = self.weighted::<f64>(values, &means, &v)?;
            let degree = lifted.map_or(self.cut.degree, |lifted| lifted.degree);
            let quadrature = CubeQuadrature::new(&cube, nodes, degree)?;
            let table = &self.solved.table;
            // Of piecewise constants alone: there the first function of a cell is all of it.
            let is_dense = matches!(table, Table::Dense { functions: 1, .. });
            let mean = |i, j| table.mean(i, j);
            let coefficients =
                (is_dense && lifted.is_none()).then_some(MeanCoefficients { cells, mean: &mean });
            let of = Of {
                cut: &self.cut,
                values,
                absorption,
                table: &self.solved.table,
                solution,
                moments,
                v: &v,
            };
            let mut examine = |neighbour: &Boxed<'_, f64, D>, pairs: AnyPairs<'_>| {
                with_starts(
                    request,
                    values.domain(),
                    neighbour,
                    &weighted,
                    &mut |starts| {
                        let setting = VarianceSetup {
                            equation: &cube,
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
                            known: &[],
                            place: &|site| place_of(&quadrature, values.domain(), site),
                        })?;
                        values.check()
                    },
                )
            };
            if let Some(lifted) = lifted {
                let neighbour = LiftedNeighbour::new(&self.cut, lifted, values, values)?;
                return examine(&neighbour, AnyPairs::AllPointwise);
            }
            let degree = f64::degree(self.degree);
            degree.with_neighbour(&of, &kinds, &mut |neighbour| {
                examine(neighbour, kinds.any(cells)?)
            })
        })
    }

    fn tables_in<F: Real + Number>(
        &self,
        pairs: Pairs,
        absorption: f64,
    ) -> Result<TableBuilder, Error> {
        if self.lifted.is_some() {
            return Err(Error::Internal("tables have no lift"));
        }
        if self.cut.exact_source.is_some() {
            return Err(Error::Option {
                subject: Subject::ExactSource,
                message: "tables have no source F: leave `exact_source` out".to_owned(),
            });
        }
        self.check_neighbour(pairs, absorption)?;
        let v = self.solved.solution.rounded::<F>()?;
        let diagonal_rule = self.cut.diagonal_rule(pairs);
        let (solution, table) = (&self.solved.solution, &self.solved.table);
        let g = match diagonal_rule {
            Some(pairs) => solution.source(table, &pairs)?,
            None => solution.source(table, &fredholm_core::galerkin::AllPointwise)?,
        };
        Ok(export::cube(
            [D, self.cut.per_axis, self.cut.degree],
            absorption,
            table,
            diagonal_rule,
            [&v, &g],
        ))
    }
}

impl<const D: usize> System for CubeSystem<'_, D> {
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
        self.examine_in(request, nodes, then)
    }

    fn tables(&self, pairs: Pairs, absorption: f64) -> Result<TableBuilder, Error> {
        if matches!(self.solved.table, Table::Middles(_)) {
            return Err(Error::Option {
                subject: Subject::Problem,
                message: "a device needs the coefficients that `stages` do without".to_owned(),
            });
        }
        in_scalar!(self.cut.scalar, F => self.tables_in::<F>(pairs, absorption))
    }

    fn saved(&self) -> Option<SavedSystem<'_>> {
        let Solved { table, solution } = &self.solved;
        if matches!(table, Table::Middles(_)) {
            return None;
        }
        Some(SavedSystem::new(solution, table.entries()))
    }

    fn lift<'s>(mut self: Box<Self>, degree: usize) -> Result<Box<dyn System + 's>, Error>
    where
        Self: 's,
    {
        let lifted = with_values::<f64, _>(self.cut.functions(), |values| {
            let lifted = Lifted::new::<D>(&self.cut, values, &self.solved.solution, degree)?;
            values.check()?;
            Ok(lifted)
        })?;
        self.lifted = Some(lifted);
        Ok(self)
    }

    fn whole<'s>(self: Box<Self>) -> Result<Box<dyn WholeSystem<'s> + 's>, Error>
    where
        Self: 's,
    {
        Ok(Box::new(CubeWhole::new(*self)))
    }
}

/// Hands on the job of all goals, and (v, Φ) of each: compiled for the equation, if it has such walks and they draw
/// pseudo-random numbers. Those of a sequence are compiled once for all equations.
pub(super) fn with_job<F: CubeScalar, const D: usize>(
    (model, sequence): (&CubeModel, Sequence),
    parts: &Parts<'_, F>,
    follow: Follow<'_, F, D>,
    goals: &MakeGoals<'_, F, D>,
    then: &mut WithJob<'_>,
) -> Result<(), Error> {
    let is_random = sequence == Sequence::Random;
    if let Some(compiled) = F::compiled::<D>(model).filter(|_| is_random) {
        return compiled.with_job(parts, follow, goals, then);
    }
    let Follow::Any(neighbour) = follow else {
        return Err(Error::Internal("nothing is compiled for the equation"));
    };
    let cube = parts.values.cube::<D>(parts.per_axis, parts.absorption)?;
    let (goals, galerkin) = goals(neighbour)?;
    let job = Goals::new(&cube, neighbour, &goals, parts.options);
    match sequence {
        Sequence::Random => then(&job, &galerkin),
        Sequence::Sobol => then(&job.with_generator::<Sobol>(), &galerkin),
    }
}
