//! Bounds of memory.

use core::panic::AssertUnwindSafe;
use std::panic::{catch_unwind, resume_unwind};

/// What a reader may take at once.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    /// Bytes for each byte of the input.
    pub each: u64,
    /// Bytes besides, for the smallest input.
    pub besides: u64,
}

impl Bound {
    /// No memory at all.
    pub const NOTHING: Self = Self {
        each: 0,
        besides: 0,
    };

    /// What `read` gives.
    ///
    /// # Panics
    /// If this thread has at any time more memory than the bound has for an input of so many bytes.
    pub fn holds<R>(self, input: usize, read: impl FnOnce() -> R) -> R {
        let mut outcome = None;
        // A panic must not leave the counter within a measurement.
        let taken = allocation_counter::measure(|| {
            outcome = Some(catch_unwind(AssertUnwindSafe(read)));
        });
        let most = self.besides + self.each * input as u64;
        let outcome = outcome.map(|outcome| outcome.unwrap_or_else(|panic| resume_unwind(panic)));
        assert!(
            taken.bytes_max <= most,
            "an input of {input} bytes took {} bytes, more than {most}",
            taken.bytes_max
        );
        outcome.expect("it has been read")
    }
}
