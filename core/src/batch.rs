//! Batches: the unit of work that runners hand out.

use core::fmt;

use crate::{Real, Statistics, Termination, Walk, WalkNumber};

/// The default of [`WalkOptions::step_limit`](crate::WalkOptions::step_limit): with an absorption of 10⁻³ in every state a walk
/// in 10⁴³⁰ gets there.
pub const STEP_LIMIT: u32 = 1_000_000;

/// A walk scored an infinity or NaN. The walk can be run again alone by [`Goals::replay`](crate::Goals::replay).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotFinite {
    /// The number of the walk.
    pub walk: u64,
}

impl fmt::Display for NotFinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "walk {} scored a value that is not finite", self.walk)
    }
}

impl core::error::Error for NotFinite {}

/// The number of no walk.
const NONE: u64 = u64::MAX;

/// No walk has scored bit by bit.
#[cfg(feature = "serde")]
const fn none() -> u64 {
    NONE
}

/// Consecutive walks of a goal and their statistics so far. Work on it may stop after any walk and
/// go on later with the same bits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Batch {
    next: u64,
    end: u64,
    statistics: Statistics,
    /// The walk that has scored last, where walks score bit by bit; [`NONE`] elsewhere. It is not in the statistics yet.
    #[cfg_attr(feature = "serde", serde(default = "none"))]
    last: u64,
    /// What it has scored so far.
    #[cfg_attr(feature = "serde", serde(default))]
    accrued: f64,
    /// Walks that are not in the statistics since they scored nothing.
    #[cfg_attr(feature = "serde", serde(default))]
    silent: u64,
}

impl Batch {
    /// Batch number `index` of batches of `size` walks, the last of which ends at `walks` walks.
    #[must_use]
    pub fn new(index: u64, size: u64, walks: u64) -> Self {
        let next = index.saturating_mul(size).min(walks);
        Self {
            next,
            end: next.saturating_add(size).min(walks),
            statistics: Statistics::default(),
            last: NONE,
            accrued: 0.0,
            silent: 0,
        }
    }

    /// Goes on with a batch after the walks of `statistics`. `None`: the batch has fewer walks.
    #[must_use]
    pub fn resume(index: u64, size: u64, walks: u64, statistics: Statistics) -> Option<Self> {
        let fresh = Self::new(index, size, walks);
        let next = fresh.next.checked_add(statistics.walks())?;
        (next <= fresh.end).then_some(Self {
            next,
            statistics,
            ..fresh
        })
    }

    /// Adds the next walk. `value` is (v, Φ) or the walk's own part of it, `known` is added to what it estimates.
    #[inline(always)]
    pub(crate) fn push<F: Real>(
        &mut self,
        scores: &Walk<F>,
        value: f64,
        known: f64,
    ) -> Result<(), NotFinite> {
        if scores.termination == Termination::NotFinite || !value.is_finite() || !known.is_finite()
        {
            return Err(self.not_finite());
        }
        self.statistics.push(scores, value, known);
        self.next += 1;
        Ok(())
    }

    /// Adds to what a walk scores, of a batch whose walks mostly score nothing. The first call of a walk comes behind the last one of those before.
    #[inline]
    pub(crate) fn accrue(&mut self, walk: u64, score: f64) {
        if self.last == walk {
            self.accrued += score;
            return;
        }
        if self.last != NONE {
            self.statistics.push_score(self.accrued);
        }
        (self.last, self.accrued) = (walk, score);
    }

    /// Counts the walks of another batch as those of this one, too: those of them that did not score here scored nothing.
    pub(crate) fn keep_up_with(&mut self, other: &Self) {
        (self.next, self.silent) = (other.next, 0);
        self.silent = other.walks().saturating_sub(self.walks());
    }

    /// The number of its walks so far.
    const fn walks(&self) -> u64 {
        self.statistics.walks() + (self.last != NONE) as u64 + self.silent
    }

    /// The walk that is next, and its place among those of the batch, where every walk scores; `None`: all have been run.
    #[inline(always)]
    pub(crate) fn next_number(&self) -> Option<WalkNumber> {
        let replicate = self.next.saturating_sub(self.statistics.walks());
        (!self.is_done()).then_some(WalkNumber {
            walk: self.next,
            replicate,
            index: self.next.wrapping_sub(replicate),
        })
    }

    /// Makes its walks one sample: they depend on each other.
    pub(crate) const fn become_replicate(&mut self) {
        self.statistics.become_replicate();
    }

    /// Says that what its walks scored is certain.
    pub(crate) const fn become_certain(&mut self) {
        self.statistics.become_certain();
    }

    /// Finishes a batch that is one sample: its walks give this value together, by so many states. A batch that is done stays as it is.
    ///
    /// # Errors
    /// [`NotFinite`]: the value is none.
    ///
    /// ```
    /// use fredholm_core::Batch;
    ///
    /// // Walks 100 to 199 of 200.
    /// let mut batch = Batch::new(1, 100, 200);
    /// batch.finish_as_replicate(0.5, 120)?;
    /// assert!(batch.is_done() && batch.statistics().replicates() == 1);
    /// assert_eq!(batch.statistics().preconditioned().estimate, 0.5);
    /// # Ok::<(), fredholm_core::NotFinite>(())
    /// ```
    pub fn finish_as_replicate(&mut self, value: f64, states: u64) -> Result<(), NotFinite> {
        if self.is_done() {
            return Ok(());
        }
        if !value.is_finite() {
            return Err(self.not_finite());
        }
        self.statistics = Statistics::of_replicate(self.end - self.next, states, value);
        self.next = self.end;
        Ok(())
    }

    /// Makes this batch that of the weighted sum of functionals whose walks do not depend on each other: its mean and its squared deviations
    /// follow from theirs. `parts` have the same walks so far, of draws of their own.
    ///
    /// ```
    /// use fredholm_core::Batch;
    ///
    /// let mut parts = [Batch::new(0, 100, 100); 2];
    /// parts[0].finish_as_replicate(0.5, 120)?;
    /// parts[1].finish_as_replicate(2.0, 130)?;
    /// let mut sum = Batch::new(0, 100, 100);
    /// sum.become_sum(&parts, &[2.0, 1.0]);
    /// assert!(sum.is_done() && sum.statistics().preconditioned().estimate == 3.0);
    /// # Ok::<(), fredholm_core::NotFinite>(())
    /// ```
    pub fn become_sum(&mut self, parts: &[Self], weights: &[f64]) {
        let Some(first) = parts.first() else { return };
        let terms = parts.iter().map(Self::statistics).zip(weights);
        self.statistics = Statistics::of_sum(terms);
        self.next = first.next;
    }

    /// The number of the walk that is next, from 0.
    #[must_use]
    pub const fn next_walk(&self) -> u64 {
        self.next
    }

    /// The error of the walk that is next.
    pub(crate) const fn not_finite(&self) -> NotFinite {
        NotFinite { walk: self.next }
    }

    /// Whether all its walks have been run.
    #[must_use]
    pub const fn is_done(&self) -> bool {
        self.next >= self.end
    }

    /// The statistics of the walks so far, where every walk scores, without a copy: all but those of derivatives.
    #[must_use]
    pub const fn dense(&self) -> &Statistics {
        &self.statistics
    }

    /// The statistics of the walks so far.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        if self.last == NONE && self.silent == 0 {
            return self.statistics;
        }
        let mut all = self.statistics;
        if self.last != NONE {
            all.push_score(self.accrued);
        }
        all.merge(&Statistics::of_silent(self.silent));
        if self.statistics.replicates() > 0 {
            all.become_replicate();
        }
        all
    }
}
