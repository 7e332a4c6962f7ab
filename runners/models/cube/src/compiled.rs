//! Walks that are compiled for the closures of an equation: a kernel as a closure takes no longer than one by trait.
//!
//! All else, set-ups and predictions among it, is compiled once for all equations and calls closures by their address.

use fredholm_core::galerkin::{Dense, DiagonalRule, NeighbourVectors, Piecewise};
use fredholm_core::whole::{Replicate, ReplicateCounts, WholeJob, WholeTask};
use fredholm_core::{Batch, Goals, Job, WalkOptions};
use fredholm_cube::{Cube, CubeScores};
use fredholm_rayon::RunError;

use super::closures::Closures;
use super::functions::Watched;
use super::starts::{GoalsOf, Start};
use super::system::Boxed;
use fredholm_model::Error;
use fredholm_model::{WithJob, WithWholeJob};

/// What tells the goals of a neighbour equation.
pub(super) type MakeGoals<'a, F, const D: usize> =
    dyn Fn(&Boxed<'_, F, D>) -> Result<GoalsOf<'a, F, D>, Error> + 'a;

/// What walks of an equation depend on, besides their goals.
#[derive(Clone, Copy)]
pub(super) struct Parts<'a, F> {
    pub(super) values: &'a Watched<'a, F>,
    pub(super) per_axis: usize,
    pub(super) absorption: f64,
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

    /// Hands on the walks of a whole function that score on these functions, of whose coefficients some are known.
    fn with_whole(
        &self,
        parts: &Parts<'_, F>,
        neighbour: &Boxed<'_, F, D>,
        scored: (&CubeScores<F, D>, &[f64]),
        then: &mut WithWholeJob<'_>,
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
        let (m, absorption) = (parts.per_axis, parts.absorption);
        let cube = Cube::<f64, D, _, _>::new(&self.kernel, &self.source, m, absorption)?;
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

    fn with_whole(
        &self,
        parts: &Parts<'_, f64>,
        neighbour: &Boxed<'_, f64, D>,
        (scores, known): (&CubeScores<f64, D>, &[f64]),
        then: &mut WithWholeJob<'_>,
    ) -> Result<(), Error> {
        let (m, absorption) = (parts.per_axis, parts.absorption);
        let cube = Cube::<f64, D, _, _>::new(&self.kernel, &self.source, m, absorption)?;
        let job: WholeTask<'_, _, _, _, _> =
            WholeTask::new(&cube, &cube, neighbour, scores, parts.options);
        then(&job.with_known(known)).map_err(|error| parts.explain_whole(error, neighbour, scores))
    }
}

impl Parts<'_, f64> {
    /// Walks a walk that was not finite again, with values that are watched. That takes longer than the check of every value
    /// would, but once.
    fn explain<const D: usize>(
        &self,
        error: Error,
        neighbour: &Boxed<'_, f64, D>,
        goals: &[fredholm_core::Goal<Start<'_, f64, D>>],
    ) -> Error {
        if let Error::Run(RunError::NotFinite { goal, walk, .. }) = error
            && let Ok(cube) = self.values.cube::<D>(self.per_axis, self.absorption)
        {
            let job = Goals::new(&cube, neighbour, goals, self.options);
            let mut batch = Batch::new(walk, 1, walk.saturating_add(1));
            // Whoever asked for the values tells of the first that is not finite.
            let _ = job.run(goal, &mut batch, 1);
        }
        error
    }

    /// Walks such a walk of a whole function again, in the same way.
    fn explain_whole<const D: usize>(
        &self,
        error: Error,
        neighbour: &Boxed<'_, f64, D>,
        scores: &CubeScores<f64, D>,
    ) -> Error {
        if let Error::Run(RunError::Replicate { walk, .. }) = error
            && let Ok(cube) = self.values.cube::<D>(self.per_axis, self.absorption)
        {
            let job = WholeTask::new(&cube, &cube, neighbour, scores, self.options);
            let mut sums = vec![0.0; job.unknowns()];
            let mut replicate = Replicate::new(walk, 1, ReplicateCounts::default(), &mut sums);
            let _ = job.run(&mut replicate, 1);
        }
        error
    }
}
