//! The replicates of a global estimate on all threads.

use fredholm_core::NotFinite;
use fredholm_core::global::{GlobalJob, Replicate, ReplicateCounts};
use rayon::prelude::*;

use crate::{Observer, RunError};

/// Walks between two calls of an observer.
const SLICE: u64 = 1 << 12;

/// The sums of all replicates of a global estimate so far, in memory of their own.
///
/// Every replicate is the work of one thread at a time and is merged with no other, so that the bits do not depend on
/// threads.
///
/// ```
/// use fredholm_core::NotFinite;
/// use fredholm_core::global::{Normalisation, Replicate, GlobalJob};
/// use fredholm_rayon::Replicates;
///
/// /// No walks at all.
/// struct Nothing;
/// impl GlobalJob for Nothing {
///     fn unknowns(&self) -> usize {
///         3
///     }
///     fn normalisation(&self) -> Normalisation {
///         Normalisation { functions: 1, cells: 3, states_scored: 1.0 }
///     }
///     fn known(&self) -> &[f64] {
///         &[]
///     }
///     fn run(&self, _: &mut Replicate<'_>, _: u64) -> Result<(), NotFinite> {
///         Ok(())
///     }
/// }
/// let mut replicates = Replicates::new(&Nothing, 8);
/// replicates.run(&Nothing, 100, &())?;
/// assert_eq!(replicates.counts().walks, 0);
/// assert_eq!(replicates.coefficients(&Nothing, &|_| 1.0), [0.0; 24]);
/// # Ok::<(), fredholm_rayon::RunError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Replicates {
    unknowns: usize,
    counts: Vec<ReplicateCounts>,
    sums: Vec<f64>,
}

impl Replicates {
    /// Replicates without walks.
    #[must_use]
    pub fn new(job: &dyn GlobalJob, replicates: usize) -> Self {
        let unknowns = job.unknowns();
        Self {
            unknowns,
            counts: vec![ReplicateCounts::default(); replicates],
            sums: vec![0.0; unknowns.saturating_mul(replicates)],
        }
    }

    /// The number of replicates.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.counts.len()
    }

    /// Whether there is none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.counts.is_empty()
    }

    /// The walks of all of them together.
    #[must_use]
    pub fn counts(&self) -> ReplicateCounts {
        let mut all = ReplicateCounts::default();
        for counts in &self.counts {
            all.add(counts);
        }
        all
    }

    /// Runs so many further walks of every replicate on the threads of the current rayon pool.
    ///
    /// # Errors
    /// [`RunError::Replicate`]: a walk scored an infinity or NaN; of several the one in the first replicate.
    pub fn run(
        &mut self,
        job: &dyn GlobalJob,
        walks: u64,
        observer: &dyn Observer,
    ) -> Result<(), RunError> {
        let of = self.counts.len() as u64;
        let sums = self.sums.par_chunks_mut(self.unknowns.max(1));
        let all = sums.zip(self.counts.par_iter_mut()).enumerate();
        let failed = all.find_map_first(|(number, (sums, counts))| {
            let mut replicate = Replicate::new(number as u64, of, *counts, sums);
            let result = run_one(job, &mut replicate, walks, observer);
            *counts = *replicate.counts();
            result.err().map(|NotFinite { walk }| (number, walk))
        });
        match failed {
            Some((replicate, walk)) => Err(RunError::Replicate { replicate, walk }),
            None => Ok(()),
        }
    }

    /// The coefficients ê_jb of every replicate, one after the other, from the measures of cells.
    #[must_use]
    pub fn coefficients(
        &self,
        job: &dyn GlobalJob,
        measure: &(dyn Fn(usize) -> f64 + Sync),
    ) -> Vec<f64> {
        let mut all = vec![0.0; self.sums.len()];
        let width = self.unknowns.max(1);
        let sums = self.sums.par_chunks(width).zip(&self.counts);
        all.par_chunks_mut(width)
            .zip(sums)
            .for_each(|(out, (sums, counts))| {
                job.normalisation().fill(sums, counts.walks, measure, out);
                for (out, known) in out.iter_mut().zip(job.known()) {
                    *out += known;
                }
            });
        all
    }
}

fn run_one(
    job: &dyn GlobalJob,
    replicate: &mut Replicate<'_>,
    walks: u64,
    observer: &dyn Observer,
) -> Result<(), NotFinite> {
    let mut left = walks;
    while left > 0 {
        let now = left.min(SLICE);
        job.run(replicate, now)?;
        observer.walked(now);
        left -= now;
    }
    Ok(())
}
