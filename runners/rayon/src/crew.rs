//! Whoever runs the batches of a stage: the threads of this process, or many processes.

use core::sync::atomic::{AtomicUsize, Ordering};

use fredholm_core::{NotFinite, Statistics};

/// One batch of one goal; in a [`Work`], of all goals that share walks with it, of which it is the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Piece {
    /// The number of the batch, from 0.
    pub batch: u64,
    /// The number of the goal, from 0.
    pub goal: usize,
}

/// The result of one batch of one goal: its statistics, whether all its walks were run, and a walk that was not finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finished {
    /// The batch and the goal.
    pub piece: Piece,
    /// The statistics of the walks that were run.
    pub statistics: Statistics,
    /// Whether all walks of the batch were run.
    pub is_whole: bool,
    /// The walk that scored an infinity or NaN, if there was one.
    pub not_finite: Option<NotFinite>,
}

/// The work of a stage, as a crew sees it.
#[derive(Clone, Copy)]
pub struct Work<'a> {
    /// The pieces to run, in this order.
    pub pieces: &'a [Piece],
    /// Runs a piece on this thread, to its end or until [`stopped`](Self::stopped): the results of all goals that share its walks.
    pub run: &'a (dyn Fn(Piece) -> Vec<Finished> + Sync),
    /// Whether to take no more pieces.
    pub stopped: &'a (dyn Fn() -> bool + Sync),
    /// Is told of every result of a piece that was run elsewhere.
    pub came: &'a (dyn Fn(&Finished) + Sync),
}

impl core::fmt::Debug for Work<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Work")
            .field("pieces", &self.pieces)
            .finish_non_exhaustive()
    }
}

/// Whoever runs the batches of a stage.
///
/// ```
/// use fredholm_rayon::{Crew, Finished, Work};
///
/// /// One piece after the other.
/// struct Alone;
/// impl Crew for Alone {
///     fn stage(&self, mut known: Vec<Finished>, work: &Work<'_>) -> Vec<Finished> {
///         let open = work.pieces.iter().take_while(|_| !(work.stopped)());
///         known.extend(open.flat_map(|&piece| (work.run)(piece)));
///         known
///     }
/// }
/// let work = Work { pieces: &[], run: &|_| unreachable!(), stopped: &|| false, came: &|_| () };
/// assert!(Alone.stage(Vec::new(), &work).is_empty());
/// ```
pub trait Crew: Sync {
    /// The results of the pieces that were known before and of those that were run, in any order: of a goal those count that are
    /// a beginning without a gap. Where several processes follow the same run, each of them gets the same.
    fn stage(&self, known: Vec<Finished>, work: &Work<'_>) -> Vec<Finished>;

    /// Compares what the processes are about to run, by a digest of all that the results depend on.
    ///
    /// # Errors
    /// They are about to run different walks.
    fn agree(&self, digest: u64) -> Result<(), String> {
        let _ = digest;
        Ok(())
    }
}

/// The threads of the current rayon pool.
#[derive(Clone, Copy, Debug)]
pub struct Threads;

impl Crew for Threads {
    fn stage(&self, mut known: Vec<Finished>, work: &Work<'_>) -> Vec<Finished> {
        let next = AtomicUsize::new(0);
        known.extend(work.on_threads(&next));
        known
    }
}

impl Work<'_> {
    /// Runs pieces on the threads of the current rayon pool, each the next one of this counter, until none is left.
    #[must_use]
    pub fn on_threads(&self, next: &AtomicUsize) -> Vec<Finished> {
        let all = rayon::broadcast(|_| {
            let mut finished = Vec::new();
            while !(self.stopped)() {
                let number = next.fetch_add(1, Ordering::Relaxed);
                let Some(&piece) = self.pieces.get(number) else {
                    break;
                };
                finished.extend((self.run)(piece));
            }
            finished
        });
        all.into_iter().flatten().collect()
    }
}

/// The number of threads of the current rayon pool.
#[must_use]
pub fn threads() -> usize {
    rayon::current_num_threads()
}
