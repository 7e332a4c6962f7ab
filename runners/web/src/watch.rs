//! Progress that the page is told, and its wish to stop.

use core::cell::Cell;
use core::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use core::time::Duration;
use std::cell::RefCell;

use fredholm::choice::ChoiceReport;
use fredholm::{Observer, Settings, SolveObserver};
use js_sys::Function;
use wasm_bindgen::JsValue;
use web_time::Instant;

/// The page is told so often at most.
const TELL: Duration = Duration::from_millis(50);

thread_local! {
    /// The function that is told. Observers may be asked by any thread; here there is one.
    static PROGRESS: RefCell<Option<Function>> = const { RefCell::new(None) };
    static TOLD: Cell<Option<Instant>> = const { Cell::new(None) };
}

/// An observer that calls a function of JavaScript.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    cancelled: AtomicBool,
    walked: AtomicU64,
    /// The number of walks that are expected; 0: it is not known.
    expected: AtomicU64,
}

impl Watch {
    pub(crate) fn new(progress: Function) -> Self {
        PROGRESS.set(Some(progress));
        TOLD.set(Some(Instant::now()));
        Self::default()
    }

    pub(crate) fn expect(&self, walks: u64) {
        self.expected.store(walks, Relaxed);
    }

    /// Tells the page, and asks whether to stop.
    fn look(&self) {
        if TOLD.get().is_some_and(|told| told.elapsed() < TELL) {
            return;
        }
        TOLD.set(Some(Instant::now()));
        let [walked, expected] = [&self.walked, &self.expected];
        let [walked, expected] = [walked, expected].map(|n| JsValue::from(n.load(Relaxed) as f64));
        PROGRESS.with_borrow(|progress| {
            let progress = progress.as_ref();
            let told = progress.map(|tell| tell.call2(&JsValue::NULL, &walked, &expected));
            if let Some(Ok(stop)) = told {
                self.cancelled.fetch_or(stop.is_truthy(), Relaxed);
            }
        });
    }
}

impl Observer for Watch {
    fn walked(&self, walks: u64) {
        self.walked.fetch_add(walks, Relaxed);
        self.look();
    }

    fn cancelled(&self) -> bool {
        self.look();
        self.cancelled.load(Relaxed)
    }
}

impl SolveObserver for Watch {
    fn chosen(&self, _: &Settings, report: &ChoiceReport) {
        self.walked.store(0, Relaxed);
        self.expect(report.predicted_walks as u64);
    }
}
