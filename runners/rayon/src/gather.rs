//! Work that is done more than once, for functions that are better called with many points than with one.

use core::cell::{Cell, RefCell};
use core::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

/// Doer of pieces of work, each again and again until all that it asks for is known: functions of another language, say, that
/// are called with all points of several pieces at once.
///
/// ```
/// use std::ops::Range;
/// use std::sync::Arc;
///
/// use fredholm_rayon::{Gather, fill_rows, with_gather};
///
/// /// Does every piece once, as if nothing were asked for.
/// struct Once;
/// impl Gather for Once {
///     fn gather(&self, pieces: Range<usize>, work: &dyn Fn(usize)) {
///         pieces.for_each(work);
///     }
/// }
/// let mut table = [0.0; 6];
/// with_gather(Arc::new(Once), || {
///     fill_rows(&mut table, 3, |i, row| Ok::<(), ()>(row.fill(i as f64)))
/// })?;
/// assert_eq!(table, [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
/// # Ok::<(), ()>(())
/// ```
pub trait Gather: Send + Sync {
    /// Does these pieces of work on this thread. A piece that asks for something may be done again, and then writes what it finds over what
    /// it has found before; any other is done once.
    fn gather(&self, pieces: Range<usize>, work: &dyn Fn(usize));
}

/// Chunks of pieces for every thread: their lengths differ.
const CHUNKS: usize = 2;

thread_local! {
    /// Who does the work that this thread begins.
    static GATHER: RefCell<Gathering> = const { RefCell::new(Gathering::Nobody) };
    /// Whether the work that this thread does has asked for what is not known yet.
    static INCOMPLETE: Cell<bool> = const { Cell::new(false) };
}

/// Does work, and says whether all was known that it asked for, so that nobody has called [`leave_out`].
///
/// ```
/// use fredholm_rayon::{is_complete, is_incomplete, leave_out};
///
/// assert!(is_complete(|| ()));
/// assert!(!is_complete(|| {
///     leave_out();
///     assert!(is_incomplete());
/// }));
/// ```
pub fn is_complete(work: impl FnOnce()) -> bool {
    INCOMPLETE.set(false);
    work();
    !INCOMPLETE.replace(false)
}

/// Says that a value is not known that the work of this thread asks for, which is then done once more. Not a number is a good value
/// meanwhile: walks and rules end with it.
pub fn leave_out() {
    INCOMPLETE.set(true);
}

/// Whether the work of this thread has asked for what is not known yet, so that its values mean nothing.
#[must_use]
pub fn is_incomplete() -> bool {
    INCOMPLETE.get()
}

#[derive(Clone)]
enum Gathering {
    Nobody,
    By(Arc<dyn Gather>),
    /// The thread does a piece of such work, of which another one is a part.
    Piece,
}

/// Does work on this thread with that gathering.
fn with<T>(gathering: Gathering, work: impl FnOnce() -> T) -> T {
    /// Puts back what was there, also where the work panics.
    struct Before(Option<Gathering>);
    impl Drop for Before {
        fn drop(&mut self) {
            if let Some(before) = self.0.take() {
                GATHER.set(before);
            }
        }
    }
    let _before = Before(Some(GATHER.replace(gathering)));
    work()
}

/// Does work on this thread, whose [tables](crate::fill_rows) and [parts](gathered) are gathered.
pub fn with_gather<T>(gather: Arc<dyn Gather>, work: impl FnOnce() -> T) -> T {
    with(Gathering::By(gather), work)
}

/// Does a part of the work, which is done again until all that it asks for is known, if somebody [gathers](with_gather) it; once if not.
///
/// ```
/// assert_eq!(fredholm_rayon::gathered(|| 1 + 1), 2);
/// ```
pub fn gathered<T>(work: impl Fn() -> T) -> T {
    let found = RefCell::new(None);
    if let Gathering::By(gather) = GATHER.with_borrow(Clone::clone) {
        with(Gathering::Piece, || {
            gather.gather(0..1, &|_| {
                found.replace(Some(work()));
            });
        });
    }
    found.into_inner().unwrap_or_else(work)
}

/// Does so many pieces of work, and says whether that was done: somebody gathers it, or it is a part of what is gathered.
pub(crate) fn all_gathered(count: usize, work: &(dyn Fn(usize) + Sync)) -> bool {
    match GATHER.with_borrow(Clone::clone) {
        Gathering::Nobody => return false,
        // On other threads nobody would know what it asks for.
        Gathering::Piece => (0..count).for_each(work),
        Gathering::By(gather) => {
            let chunks = count.min(CHUNKS * rayon::current_num_threads());
            (0..chunks).into_par_iter().for_each(|chunk| {
                let pieces = count * chunk / chunks..count * (chunk + 1) / chunks;
                with(Gathering::Piece, || gather.gather(pieces, work));
            });
        }
    }
    true
}
