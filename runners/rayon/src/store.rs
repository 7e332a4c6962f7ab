//! Keepers of batches: a run that was ended anywhere goes on with what they kept.

use fredholm_core::Statistics;

/// A keeper of batches that were run. A runner asks it before it runs a batch, and gives it every batch that is done.
///
/// The statistics of a batch follow from the job, the goal and the batch alone, so that it does not matter who ran it, and
/// when. `()` keeps nothing.
///
/// ```
/// use std::collections::BTreeMap;
/// use std::sync::Mutex;
///
/// use fredholm_core::Statistics;
/// use fredholm_rayon::BatchStore;
///
/// /// Keeps batches in memory.
/// struct Kept(Mutex<BTreeMap<(usize, u64), Statistics>>);
/// impl BatchStore for Kept {
///     fn known(&self, goal: usize, batch: u64) -> Option<Statistics> {
///         self.0.lock().unwrap().get(&(goal, batch)).copied()
///     }
///     fn keep(&self, goal: usize, batch: u64, statistics: &Statistics) {
///         self.0.lock().unwrap().insert((goal, batch), *statistics);
///     }
/// }
///
/// let kept = Kept(Mutex::default());
/// kept.keep(0, 3, &Statistics::default());
/// assert!(kept.known(0, 3).is_some() && kept.known(1, 3).is_none());
/// ```
pub trait BatchStore: Sync {
    /// The statistics of all walks of a batch of a goal, if it was run before.
    fn known(&self, goal: usize, batch: u64) -> Option<Statistics> {
        let _ = (goal, batch);
        None
    }
    /// All walks of a batch of a goal are done; called from any thread.
    fn keep(&self, goal: usize, batch: u64, statistics: &Statistics) {
        let _ = (goal, batch, statistics);
    }
    /// Whether batches cannot be kept any more, so that the run ends as if it were cancelled.
    fn is_broken(&self) -> bool {
        false
    }
}

impl BatchStore for () {}
