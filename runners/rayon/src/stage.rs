//! One stage of batches: dealt out, merged in batch order.

use core::ops::Range;
use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use web_time::Instant;

use fredholm_core::{Batch, Job, NotFinite, StopReason};

use crate::crew::{Finished, Piece, Work};
use crate::run::{Observer, Outcome, RunError, Runner};

/// States between two looks at the clock and the observer: some milliseconds, however long walks are.
const SLICE: u64 = 1 << 17;

/// Whether to go on.
pub(crate) struct Clock<'a> {
    deadline: Option<Instant>,
    late: AtomicBool,
    observer: &'a dyn Observer,
}

impl<'a> Clock<'a> {
    pub(crate) fn new(time_limit: Option<Duration>, observer: &'a dyn Observer) -> Self {
        Self {
            // A limit beyond the clock's range is none.
            deadline: time_limit.and_then(|limit| Instant::now().checked_add(limit)),
            late: AtomicBool::new(false),
            observer,
        }
    }

    fn stopped(&self) -> bool {
        if self
            .deadline
            .is_some_and(|deadline| Instant::now() >= deadline)
        {
            self.late.store(true, Ordering::Relaxed);
        }
        self.late.load(Ordering::Relaxed) || self.observer.cancelled()
    }

    /// Walks that were run elsewhere, or before.
    fn walked(&self, finished: &Finished) {
        self.observer.walked(finished.statistics.walks());
    }

    /// Why it stopped.
    fn reason(&self) -> StopReason {
        if self.late.load(Ordering::Relaxed) {
            StopReason::TimeLimit
        } else {
            StopReason::Cancelled
        }
    }
}

/// The next batches of every active goal.
pub(crate) struct Stage<'a> {
    /// The numbers of these goals; of those that share their walks that of the first.
    pub(crate) active: &'a [usize],
    pub(crate) batches: Range<u64>,
    pub(crate) runner: &'a Runner<'a>,
}

impl Stage<'_> {
    /// The number of pieces of work: one batch of one goal each, and of those that share its walks.
    fn count(&self) -> usize {
        (self.batches.end - self.batches.start) as usize * self.active.len()
    }

    /// The next batch of every goal, then the one after.
    fn pieces(&self) -> impl Iterator<Item = Piece> {
        let goals = |batch| self.active.iter().map(move |&goal| Piece { batch, goal });
        self.batches.clone().flat_map(goals)
    }

    /// Runs the stage and merges it into the outcome. Returns whether it was cut short; the outcome then says why.
    pub(crate) fn run(
        &self,
        job: &dyn Job,
        clock: &Clock<'_>,
        outcome: &mut Outcome,
    ) -> Result<bool, RunError> {
        let mut known = Vec::new();
        let mut open = Vec::new();
        let shared = job.shared();
        for piece in self.pieces() {
            // Walks that one of them lacks are run for all.
            let all: Option<Vec<Finished>> = sharing(piece, shared)
                .map(|piece| self.known(piece))
                .collect();
            match all {
                Some(all) => {
                    all.first().into_iter().for_each(|one| clock.walked(one));
                    known.extend(all);
                }
                None => open.push(piece),
            }
        }
        let keep = |finished: &Finished| {
            if finished.is_whole && finished.not_finite.is_none() {
                let Piece { batch, goal } = finished.piece;
                self.runner.store.keep(goal, batch, &finished.statistics);
            }
        };
        let run = |piece| {
            let finished = self.run_piece(job, piece, clock);
            finished.iter().for_each(keep);
            finished
        };
        let came = |finished: &Finished| {
            if finished.piece.goal.is_multiple_of(shared) {
                clock.walked(finished);
            }
            keep(finished);
        };
        let work = Work {
            pieces: &open,
            run: &run,
            stopped: &|| clock.stopped() || self.runner.store.is_broken(),
            came: &came,
        };
        let mut finished = self.runner.crew.stage(known, &work);
        finished.sort_unstable_by_key(|finished| finished.piece);
        let is_cut = self.merge(&finished, outcome)? < shared * self.count();
        let Outcome {
            statistics, tails, ..
        } = &*outcome;
        clock.observer.merged_with_tails(statistics, tails);
        if is_cut {
            outcome.stop = clock.reason();
        }
        Ok(is_cut)
    }

    fn batch(&self, index: u64) -> Batch {
        let options = &self.runner.options;
        Batch::new(index, options.batch, options.walks)
    }

    /// The piece as the store knows it, if it has all its walks.
    fn known(&self, piece: Piece) -> Option<Finished> {
        let statistics = self.runner.store.known(piece.goal, piece.batch)?;
        let options = &self.runner.options;
        let batch = Batch::resume(piece.batch, options.batch, options.walks, statistics)?;
        if !batch.is_done() {
            return None;
        }
        Some(Finished {
            piece,
            statistics,
            is_whole: true,
            not_finite: None,
        })
    }

    /// Runs a batch of a goal and of those that share its walks.
    fn run_piece(&self, job: &dyn Job, piece: Piece, clock: &Clock<'_>) -> Vec<Finished> {
        let shared = job.shared();
        let mut batches = vec![self.batch(piece.batch); shared];
        let result = run_batches(job, piece.goal, &mut batches, clock);
        let all = sharing(piece, shared).zip(&batches);
        all.map(|(piece, batch)| Finished {
            piece,
            statistics: batch.statistics(),
            is_whole: batch.is_done(),
            not_finite: result.err(),
        })
        .collect()
    }

    /// Merges the batches of every goal, and says how many of them had all their walks.
    fn merge(&self, finished: &[Finished], outcome: &mut Outcome) -> Result<usize, RunError> {
        let mut next = vec![self.batches.start; outcome.statistics.len()];
        let mut complete = 0;
        for finished in finished {
            let Piece { batch, goal } = finished.piece;
            if let Some(NotFinite { walk }) = finished.not_finite {
                return Err(RunError::NotFinite { goal, batch, walk });
            }
            // Behind a batch that is not there, or was cut short, the walks have a gap.
            if next[goal] == batch {
                outcome.statistics[goal].merge(&finished.statistics);
                outcome.tails[goal].add(&finished.statistics);
                next[goal] += u64::from(finished.is_whole);
            }
            complete += usize::from(finished.is_whole);
        }
        Ok(complete)
    }
}

/// The pieces of this batch: one of each goal that shares walks with this one, the first of them.
fn sharing(first: Piece, shared: usize) -> impl Iterator<Item = Piece> {
    let goals = first.goal..first.goal + shared;
    goals.map(move |goal| Piece { goal, ..first })
}

fn run_batches(
    job: &dyn Job,
    first: usize,
    batches: &mut [Batch],
    clock: &Clock<'_>,
) -> Result<(), NotFinite> {
    while let Some(batch) = batches.first().copied() {
        let before = batch.statistics().walks();
        // The first walk tells how long walks are, and those so far tell it better and better.
        let states = batch.statistics().states().max(1);
        let walks = u128::from(SLICE) * u128::from(before) / u128::from(states);
        job.run(first, batches, (walks as u64).clamp(1, SLICE))?;
        let after = batches
            .first()
            .map_or(before, |batch| batch.statistics().walks());
        clock.observer.walked(after - before);
        if batches.iter().all(Batch::is_done) || clock.stopped() {
            break;
        }
    }
    Ok(())
}
