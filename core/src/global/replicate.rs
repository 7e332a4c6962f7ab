//! The sums of one replicate.

/// The number of walks of a replicate, and how they ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ReplicateCounts {
    /// Walks.
    pub walks: u64,
    /// Visited states, starts included.
    pub states: u64,
    /// Walks that left the space.
    pub left: u64,
    /// Walks that were cut off at the step limit: a possible bias.
    pub step_limit: u64,
    /// Walks in which either equation scored anything but 0.
    pub scored: u64,
}

impl ReplicateCounts {
    /// Adds the walks of another replicate.
    pub const fn add(&mut self, other: &Self) {
        self.walks += other.walks;
        self.states += other.states;
        self.left += other.left;
        self.step_limit += other.step_limit;
        self.scored += other.scored;
    }
}

/// One of R replicates so far: sums of scores in a buffer of the caller's. Its walks are those with numbers
/// r, r + R, r + 2R, …; work on it may stop after any walk and go on later with the same bits.
#[derive(Debug)]
pub struct Replicate<'s> {
    number: u64,
    of: u64,
    pub(super) counts: ReplicateCounts,
    pub(super) sums: &'s mut [f64],
}

impl<'s> Replicate<'s> {
    /// Replicate `number` of `of`, after the walks in `counts` whose scores are in `sums`: at first none, and zeros.
    #[must_use]
    pub const fn new(number: u64, of: u64, counts: ReplicateCounts, sums: &'s mut [f64]) -> Self {
        Self {
            number,
            of,
            counts,
            sums,
        }
    }

    /// The number of the replicate, from 0.
    #[must_use]
    pub const fn number(&self) -> u64 {
        self.number
    }

    /// The number of its next walk.
    #[must_use]
    pub const fn next_walk(&self) -> u64 {
        self.walk(0)
    }

    /// The number of the walk after so many further ones.
    pub(super) const fn walk(&self, further: u64) -> u64 {
        let walks = self.counts.walks.saturating_add(further);
        self.of.saturating_mul(walks).saturating_add(self.number)
    }

    /// The walks so far.
    #[must_use]
    pub const fn counts(&self) -> &ReplicateCounts {
        &self.counts
    }

    /// Σ D_l ψ_jb(x_l)/p0(x_l) over states and walks so far.
    #[must_use]
    pub const fn sums(&self) -> &[f64] {
        self.sums
    }
}

/// From sums to coefficients ê_jb.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normalisation {
    /// Functions on a cell.
    pub functions: usize,
    /// The number of cells: functions of several channels stand one after the other.
    pub cells: usize,
    /// S_N, the expected number of states of a walk that are scored.
    pub states_scored: f64,
}

impl Normalisation {
    /// Fills `out` with ê_jb, from the sums of so many walks and the measures μ(X_j) of cells. Without walks they are 0.
    pub fn fill(&self, sums: &[f64], walks: u64, measure: impl Fn(usize) -> f64, out: &mut [f64]) {
        let functions = self.functions.max(1);
        let of_walks = walks.max(1) as f64 * self.states_scored;
        let cells = out.chunks_mut(functions).zip(sums.chunks(functions));
        for (j, (out, sums)) in cells.enumerate() {
            let scale = 1.0 / (of_walks * measure(j % self.cells.max(1)));
            for (out, sum) in out.iter_mut().zip(sums) {
                *out = scale * sum;
            }
        }
    }
}
