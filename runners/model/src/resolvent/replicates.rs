//! Walks that other processes, or other times, have a part of: every batch is a sample of its own.

use fredholm_core::{Batch, Job, NotFinite};

use super::{ResolventAnswer, ResolventQuestion, ResolventWalks, RunReplicates};
use crate::cost::PointwisePairs;
use crate::numbers::largest;
use crate::{Error, NO_ITERATION, Prepared};

/// Batches of all goals together.
struct Replicates<'a> {
    walks: &'a dyn ResolventWalks,
    goals: usize,
    /// Points of a batch.
    batch: u64,
    seed: u64,
}

impl Job for Replicates<'_> {
    fn goals(&self) -> usize {
        self.goals
    }

    fn shared(&self) -> usize {
        self.goals.max(1)
    }

    /// Nothing is left of a batch behind a call: nets have all of their points or none.
    fn run(&self, _: usize, batches: &mut [Batch], _: u64) -> Result<(), NotFinite> {
        let Some(first) = batches.iter().find(|batch| !batch.is_done()) else {
            return Ok(());
        };
        let walk = first.next_walk();
        // Numbers of batches that nobody can reach have the draws of others.
        let number = (walk / self.batch) as u32;
        let found = self.walks.replicate(number, self.batch as f64, self.seed);
        let (values, states) = found.map_err(|_| NotFinite { walk })?;
        let mut all = batches.iter_mut().zip(values);
        all.try_for_each(|(batch, value)| batch.finish_as_replicate(value, states))
    }
}

/// Has somebody run the walks of a question, whose choice is known.
pub(super) fn run(
    question: &ResolventQuestion<'_>,
    walks: &dyn ResolventWalks,
    chosen: &ResolventAnswer,
    run: &RunReplicates<'_>,
) -> Result<(), Error> {
    let settings = question.settings.divided(chosen);
    let job = Replicates {
        walks,
        goals: question.goals.len(),
        batch: settings.batch(),
        seed: settings.seed,
    };
    let (known, sizes): (Vec<f64>, Vec<f64>) = walks
        .known()
        .into_iter()
        .map(|[known, size]| (known, size))
        .unzip();
    let prepared = Prepared {
        job: &job,
        galerkin: &known,
        largest: largest(&sizes),
        radius_bound: 0.0,
        convergence: NO_ITERATION,
        pointwise: PointwisePairs::default(),
        neighbour_second_moment_radius: None,
    };
    run(&prepared, &settings, chosen)
}
