//! Walks that are compiled for the closures of an equation: a kernel as a closure takes no longer than one by trait.
//!
//! All else, set-ups and predictions among it, is compiled once for all equations and calls closures by their address.

use fredholm_core::galerkin::{Dense, DiagonalRule, NeighbourVectors, Piecewise};
use fredholm_core::global::{GlobalJob, GlobalTask, Replicate, ReplicateCounts};
use fredholm_core::{Goals, WalkOptions};
use fredholm_cube::{Cube, CubeScores};
use fredholm_rayon::RunError;

use super::closures::Closures;
use super::functions::Watched;
use super::starts::{Begin, GoalsOf};
use super::system::Boxed;
use fredholm_model::{Error, WithGlobalJob, WithJob};

/// What tells the goals of a neighbour equation.
pub(super) type MakeGoals<'a, F, const D: usize> =
    dyn Fn(&Boxed<'_, F, D>) -> Result<GoalsOf<'a, F, D>, Error> + 'a;

/// What walks of an equation depend on, besides their goals.
#[derive(Clone, Copy)]
pub(super) struct Parts<'a, F> {
    pub(super) values: &'a Watched<'a, F>,
    pub(super) per_axis: usize,
    pub(super) options: WalkOptions,
}

/// The neighbour equation that walks follow.
#[derive(Clone, Copy)]
pub(super) enum Follow<'a, F, const D: usize> {
    /// Piecewise constants with all pairs in S, to be compiled with the walk.
    Constants(&'a Dense<'a, f64>, &'a NeighbourVectors<F, DiagonalRule>),
    /// Any other, called by its address.
    Any(&'a Boxed<'a, F, D>),
}

/// Walks that are compiled for an equation.
pub(super) trait CompiledWalks<F, const D: usize>: Send + Sync {
    /// Hands on the job of all goals.
    fn with_job(
        &self,
        parts: &Parts<'_, F>,
        follow: Follow<'_, F, D>,
        goals: &MakeGoals<'_, F, D>,
        then: &mut WithJob<'_>,
    ) -> Result<(), Error>;

    /// Hands on the walks of a global estimate that score on these functions, of whose coefficients some are known.
    fn with_global(
        &self,
        parts: &Parts<'_, F>,
        neighbour: &Boxed<'_, F, D>,
        scored: (&CubeScores<D>, &[f64]),
        then: &mut WithGlobalJob<'_>,
    ) -> Result<(), Error>;
}

impl<K, S, const D: usize> CompiledWalks<f64, D> for Closures<K, S, D>
where
    K: Fn(&[f64; D], &[f64; D]) -> f64 + Send + Sync,
    S: Fn(&[f64; D]) -> f64 + Send + Sync,
{
    fn with_job(
        &self,
        parts: &Parts<'_, f64>,
        follow: Follow<'_, f64, D>,
        goals: &MakeGoals<'_, f64, D>,
        then: &mut WithJob<'_>,
    ) -> Result<(), Error> {
        let cube = Cube::<f64, D, _, _>::new(&self.kernel, &self.source, parts.per_axis)?;
        match follow {
            Follow::Constants(coefficients, vectors) => {
                let neighbour: Piecewise<'_, _, _, _, _, _, 1> =
                    vectors.piecewise(&cube, coefficients)?;
                let (goals, galerkin) = goals(&neighbour)?;
                let job = Goals::new(&cube, &neighbour, &goals, parts.options);
                then(&job, &galerkin).map_err(|error| parts.explain(error, &neighbour, &goals))
            }
            Follow::Any(neighbour) => {
                let (goals, galerkin) = goals(neighbour)?;
                let job = Goals::new(&cube, neighbour, &goals, parts.options);
                then(&job, &galerkin).map_err(|error| parts.explain(error, neighbour, &goals))
            }
        }
    }

    fn with_global(
        &self,
        parts: &Parts<'_, f64>,
        neighbour: &Boxed<'_, f64, D>,
        (scores, known): (&CubeScores<D>, &[f64]),
        then: &mut WithGlobalJob<'_>,
    ) -> Result<(), Error> {
        let cube = Cube::<f64, D, _, _>::new(&self.kernel, &self.source, parts.per_axis)?;
        let job: GlobalTask<'_, _, _, _, _> =
            GlobalTask::new(&cube, &cube, neighbour, scores, parts.options);
        then(&job.with_known(known)).map_err(|error| parts.explain_global(error, neighbour, scores))
    }
}

impl Parts<'_, f64> {
    /// Walks a walk that was not finite again, with values that are watched. That takes longer than the check of every value
    /// would, but once.
    fn explain<const D: usize>(
        &self,
        error: Error,
        neighbour: &Boxed<'_, f64, D>,
        goals: &[fredholm_core::Goal<Begin<'_, f64, D>, f64>],
    ) -> Error {
        if let Error::Run(RunError::NotFinite { goal, walk, .. }) = error
            && let Ok(cube) = self.values.cube::<D>(self.per_axis)
        {
            // What watches the values tells of the first that is not finite.
            let _ = Goals::new(&cube, neighbour, goals, self.options).replay(goal, walk);
        }
        error
    }

    /// Walks such a walk of a global estimate again, in the same way.
    fn explain_global<const D: usize>(
        &self,
        error: Error,
        neighbour: &Boxed<'_, f64, D>,
        scores: &CubeScores<D>,
    ) -> Error {
        if let Error::Run(RunError::Replicate { walk, .. }) = error
            && let Ok(cube) = self.values.cube::<D>(self.per_axis)
        {
            let job: GlobalTask<'_, _, _, _, _> =
                GlobalTask::new(&cube, &cube, neighbour, scores, self.options);
            let mut sums = vec![0.0; job.unknowns()];
            let mut replicate = Replicate::new(walk, 1, ReplicateCounts::default(), &mut sums);
            let _ = job.run(&mut replicate, 1);
        }
        error
    }
}
