//! Work on other threads, while Python's own shows progress and looks for an interrupt.

use core::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use core::time::Duration;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Instant;

use fredholm::choice::ChoiceReport;
use fredholm::{Observer, Settings, SolveObserver};
use pyo3::prelude::*;

use crate::blocks::is_repeated;
use crate::failure::exception;

/// An interrupt is seen after so long at most.
const LOOK: Duration = Duration::from_millis(50);
/// Progress is shown so often at most.
const SHOW: Duration = Duration::from_millis(250);

/// An observer that counts walks and may cancel them.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    cancelled: AtomicBool,
    walked: AtomicU64,
    /// The number of walks that are expected; 0: it is not known.
    expected: AtomicU64,
}

impl Watch {
    pub(crate) fn cancel(&self) {
        self.cancelled.store(true, Relaxed);
    }

    /// Whether no walks have been made yet.
    pub(crate) fn is_in_set_up(&self) -> bool {
        self.walked.load(Relaxed) == 0
    }

    pub(crate) fn expect(&self, walks: u64) {
        self.expected.store(walks, Relaxed);
    }
}

impl Observer for Watch {
    fn walked(&self, walks: u64) {
        // What functions are called in blocks for is walked more than once.
        if !is_repeated() {
            self.walked.fetch_add(walks, Relaxed);
        }
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Relaxed)
    }
}

impl SolveObserver for Watch {
    fn chosen(&self, _: &Settings, report: &ChoiceReport) {
        self.walked.store(0, Relaxed);
        self.expect(report.predicted_walks as u64);
    }
}

/// What work came to, and the exception that ended it early.
pub(crate) struct Done<T> {
    pub(crate) value: T,
    pub(crate) interrupt: Option<PyErr>,
}

/// Does work on so many threads, or on all cores. `progress` is called with the walks so far and those expected.
///
/// # Errors
/// A panic of the work, which is a defect; no threads.
pub(crate) fn on_threads<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    watch: &Watch,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce() -> T + Send,
) -> PyResult<Done<T>> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0))
        .build()
        .map_err(|error| {
            exception(
                py,
                "FredholmError",
                format!("cannot start threads: {error}"),
            )
        })?;
    std::thread::scope(|scope| {
        let (end, mut ended) = channel();
        let worker = scope.spawn(move || {
            let value = pool.install(work);
            // Nobody listens if the other side panicked.
            let _ = end.send(());
            value
        });
        let mut interrupt = None;
        let mut shown = Instant::now();
        loop {
            let (still, waited) = py.detach(move || {
                let waited = ended.recv_timeout(LOOK);
                (ended, waited)
            });
            ended = still;
            if !matches!(waited, Err(RecvTimeoutError::Timeout)) {
                break;
            }
            let mut seen = py.check_signals();
            if let Some(progress) = progress.filter(|_| shown.elapsed() >= SHOW) {
                shown = Instant::now();
                let (walked, expected) = (watch.walked.load(Relaxed), watch.expected.load(Relaxed));
                seen = seen.and(progress.call1((walked, expected)).map(|_| ()));
            }
            if let Err(error) = seen {
                watch.cancel();
                interrupt.get_or_insert(error);
            }
        }
        // Its last drops may need the interpreter.
        match py.detach(|| worker.join()) {
            Ok(value) => Ok(Done { value, interrupt }),
            Err(panic) => {
                let text = panic.downcast_ref::<String>().cloned();
                let text = text.or_else(|| panic.downcast_ref::<&str>().map(ToString::to_string));
                let text = text.unwrap_or_default();
                Err(exception(
                    py,
                    "FredholmError",
                    format!("a defect of fredholm: {text}"),
                ))
            }
        }
    })
}
