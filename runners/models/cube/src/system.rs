//! A solved cube: walks and predictions of one dimension, whatever the degree.

use fredholm_core::galerkin::{AllPointwise, DiagonalRule, GalerkinMatrix, PairKind, Solution};
use fredholm_core::{Absorption, Form, Goals, Neighbour, Real, Sobol};
use fredholm_cube::{CubeRule, CubeScores, Mean, Weighted};
use fredholm_embedded::{Number, TableBuilder};
use fredholm_variance::{MeanCoefficients, VarianceSetup};

use super::compiled::{Follow, MakeGoals, Parts};
use super::degree::{AnyDegree, Of};
use super::functions::{CubeScalar, Watched, WeightOf, Which, with_values};
use super::global::CubeGlobal;
use super::lift::{Lifted, LiftedNeighbour};
use super::regions::place_of;
use super::starts::{WeightedStart, goals_of, with_starts};
use super::table::Table;
use super::{CubeModel, CubePartition, export};
use fredholm_model::Examined;
use fredholm_model::cost::PointwisePairs;
use fredholm_model::pairs::{AnyPairs, Band};
use fredholm_model::{
    Error, GlobalSystem, Pairs, Partitioned, SavedSystem, Sequence, System, in_scalar,
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
    dyn Neighbour<Scalar = F, Point = [F; D], Value = F> + Sync + 'a;

/// What is done with a neighbour equation.
pub(super) type Use<'a, F, const D: usize> = dyn FnMut(&Boxed<'_, F, D>) -> Result<(), Error> + 'a;

/// The pairs of a neighbour equation.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kinds {
    /// All in S, or the diagonal of another kind.
    Diagonal(DiagonalRule),
    /// Pairs near the diagonal are pointwise.
    Band(Band),
    /// All pointwise.
    AllPointwise,
}

impl Kinds {
    /// The pairs in one type.
    pub(super) const fn any(self) -> AnyPairs<'static> {
        match self {
            Self::AllPointwise => AnyPairs::AllPointwise,
            Self::Diagonal(pairs) => AnyPairs::Diagonal(pairs),
            Self::Band(band) => AnyPairs::Band(band),
        }
    }
}

/// A weight that is asked for, and numbers near the means over the cells of it times the functions there.
type WeightMeans<'a, F> = (WeightOf<'a>, Vec<F>);

impl<const D: usize> CubeSystem<'_, D> {
    /// The spectral radius of T_h²p if it is looked at, which must be below 1: the residual form asks for none.
    pub(super) fn check_neighbour(&self, walk: &WalkOptions) -> Result<Option<f64>, Error> {
        let is_residual = walk.form == Form::Residual || self.lifted.is_some();
        // With all pairs pointwise h is k, which has been looked at.
        if walk.allow_infinite_variance
            || is_residual
            || self.cut.diagonal_rule(walk.pairs).is_none()
        {
            return Ok(None);
        }
        self.check_second_moment(walk.absorption).map(Some)
    }

    fn check_second_moment(&self, absorption: Absorption) -> Result<f64, Error> {
        self.cut.check_second_moment(&self.solved.table, absorption)
    }

    /// The kinds of pairs that are asked for.
    pub(super) fn kinds(&self, pairs: Pairs) -> Kinds {
        match (self.cut.band(pairs), self.cut.diagonal_rule(pairs)) {
            (Some(band), _) => Kinds::Band(band),
            (None, Some(pairs)) => Kinds::Diagonal(pairs),
            (None, None) => Kinds::AllPointwise,
        }
    }

    /// The weights that are asked for, with numbers near their means.
    fn weight_means<'r, F: Real>(
        &self,
        request: &Request<'r>,
    ) -> Result<Vec<WeightMeans<'r, F>>, Error> {
        let goals = request.goals.iter();
        let weights: Vec<_> = goals
            .filter_map(|goal| WeightOf::region(&goal.region))
            .collect();
        if weights.is_empty() {
            return Ok(Vec::new());
        }
        with_values::<f64, _>(self.cut.functions(), |values| {
            let rule: CubeRule<D> = self.cut.rule(values)?;
            let of = |weight| {
                let means = rule.means(&values.function(Which::Weight(weight)))?;
                Ok((weight, fredholm_core::galerkin::rounded(&means)?))
            };
            weights.into_iter().map(of).collect()
        })
    }

    /// The weighted means that are asked for.
    fn weighted<'a, F: CubeScalar>(
        &self,
        values: &'a Watched<'a, F>,
        means: &'a [WeightMeans<'a, F>],
        v: &[F],
    ) -> Result<Vec<WeightedStart<'a, F, D>>, Error> {
        let cube = values.cube::<D>(self.cut.per_axis)?;
        let scores = CubeScores::new(&cube, self.cut.degree)?;
        let of = |(weight, means): &'a WeightMeans<'a, F>| {
            let weight = values.function(Which::Weight(*weight));
            Ok(WeightedStart {
                weight,
                weighted: Some(Weighted::new(weight, scores, means, v)?),
            })
        };
        means.iter().map(of).collect()
    }

    /// v, or the part of a lifted one that means ask for.
    fn v<F: Real>(&self) -> Result<Vec<F>, Error> {
        match &self.lifted {
            Some(lifted) => Ok(lifted.lower::<F, D>(self.cut.degree)),
            None => Ok(self.solved.solution.rounded::<F>()?),
        }
    }

    /// Hands out the neighbour equation with these pairs, or that of the lift.
    pub(super) fn with_neighbour<F: CubeScalar>(
        &self,
        values: &Watched<'_, F>,
        pairs: Pairs,
        v: &[F],
        then: &mut Use<'_, F, D>,
    ) -> Result<(), Error> {
        if let Some(lifted) = &self.lifted {
            return with_values::<f64, _>(self.cut.functions(), |exact| {
                then(&LiftedNeighbour::new(&self.cut, lifted, values, exact)?)
            });
        }
        let of = Of {
            cut: &self.cut,
            values,
            table: &self.solved.table,
            solution: &self.solved.solution,
            v,
        };
        F::degree(self.degree).with_neighbour(&of, &self.kinds(pairs), then)
    }

    fn job_in<F: CubeScalar>(
        &self,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error> {
        let (walk, solution) = (request.walk, &self.solved.solution);
        let neighbour_second_moment_radius = self.check_neighbour(walk)?;
        let means = self.weight_means::<F>(request)?;
        let pointwise = match &self.lifted {
            Some(_) => PointwisePairs::default(),
            None => self.cut.pointwise_pairs(walk.pairs)?,
        };
        let v = self.v::<F>()?;
        with_values::<F, _>(self.cut.functions(), |values| {
            let weighted = self.weighted::<F>(values, &means, &v)?;
            let mean = Mean::of(&v, self.cut.functions_on_cell());
            let parts = Parts {
                values,
                per_axis: self.cut.per_axis,
                options: walk.for_core(),
            };
            let goals = |neighbour: &Boxed<'_, F, D>| {
                goals_of(values.domain(), neighbour, request, &weighted, mean)
            };
            let mut follow = |follow: Follow<'_, F, D>| {
                let of = (self.cut.model, walk.sequence);
                with_job(of, &parts, follow, &goals, &mut |job, galerkin| {
                    then(&Prepared {
                        job,
                        galerkin,
                        largest: fredholm_model::numbers::largest(&v),
                        radius_bound: solution.radius_bound,
                        convergence: solution.convergence,
                        pointwise,
                        neighbour_second_moment_radius,
                    })
                })
            };
            let in_s = match self.kinds(walk.pairs) {
                Kinds::Diagonal(rule) if rule.diagonal == PairKind::Galerkin => Some(rule),
                _ => None,
            };
            if let (Some(rule), None, Sequence::Random) = (in_s, &self.lifted, walk.sequence)
                && F::compiled::<D>(self.cut.model).is_some()
                && let Some(dense) = self.solved.table.constants()
            {
                return follow(Follow::Constants(
                    &dense,
                    &solution.for_walks(&dense, rule)?,
                ));
            }
            self.with_neighbour(values, walk.pairs, &v, &mut |neighbour| {
                follow(Follow::Any(neighbour))
            })
        })
    }

    fn examine_in(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let (cells, pairs) = (self.cut.all_cells(), request.walk.pairs);
        let means = self.weight_means::<f64>(request)?;
        let v = self.v::<f64>()?;
        with_values::<f64, _>(self.cut.functions(), |values| {
            let cube = values.cube::<D>(self.cut.per_axis)?;
            let weighted = self.weighted::<f64>(values, &means, &v)?;
            let lifted = self.lifted.as_ref();
            let degree = lifted.map_or(self.cut.degree, |lifted| lifted.degree);
            let quadrature = CubeRule::sites(&cube, degree, nodes)?;
            let table = &self.solved.table;
            // Of piecewise constants alone: there the first function of a cell is all of it.
            let is_constant = lifted.is_none() && table.constants().is_some();
            let mean = |i, j| table.mean(i, j);
            let coefficients = MeanCoefficients { cells, mean: &mean };
            let kinds = match lifted {
                Some(_) => Kinds::AllPointwise,
                None => self.kinds(pairs),
            };
            let domain = values.domain();
            self.with_neighbour(values, pairs, &v, &mut |neighbour| {
                with_starts(request, domain, neighbour, &weighted, &mut |starts| {
                    let setting = VarianceSetup {
                        equation: &cube,
                        neighbour,
                        pairs: kinds.any(),
                        quadrature: &quadrature,
                        absorption: request.walk.absorption,
                    };
                    then(&Examined {
                        model: &setting.with_starts(starts)?,
                        coefficients: is_constant.then_some(coefficients),
                        pieces: None,
                        goals: request.goals,
                        known: &[],
                        place: &|site| place_of(&quadrature, domain, site),
                    })?;
                    values.check()
                })
            })
        })
    }

    fn tables_in<F: Real + Number>(&self, pairs: Pairs) -> Result<TableBuilder, Error> {
        if self.lifted.is_some() {
            return Err(Error::Internal("tables have no lift"));
        }
        let Solved { table, solution } = &self.solved;
        let diagonal_rule = self.cut.diagonal_rule(pairs);
        if diagonal_rule.is_some() {
            self.check_second_moment(Absorption::Roulette)?;
        }
        let g = match diagonal_rule {
            Some(pairs) => solution.source(table, &pairs)?,
            None => solution.source(table, &AllPointwise)?,
        };
        let v = solution.rounded::<F>()?;
        let shape = [D, self.cut.per_axis, self.cut.degree];
        Ok(export::cube(shape, table, diagonal_rule, [&v, &g]))
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

    fn tables(&self, pairs: Pairs) -> Result<TableBuilder, Error> {
        in_scalar!(self.cut.scalar, F => self.tables_in::<F>(pairs))
    }

    fn saved(&self) -> Option<SavedSystem<'_>> {
        let Solved { table, solution } = &self.solved;
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

    fn whole<'s>(self: Box<Self>) -> Result<Box<dyn GlobalSystem<'s> + 's>, Error>
    where
        Self: 's,
    {
        Ok(Box::new(CubeGlobal::new(*self)))
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
    let cube = parts.values.cube::<D>(parts.per_axis)?;
    let (goals, galerkin) = goals(neighbour)?;
    let job = Goals::new(&cube, neighbour, &goals, parts.options);
    match sequence {
        Sequence::Random => then(&job, &galerkin),
        Sequence::Sobol => then(&job.with_generator::<Sobol>(), &galerkin),
    }
}
