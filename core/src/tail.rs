//! The tail of the scores, as the batches of a run show it, and the error bars that are not believed for it.

use crate::{MIN_BATCHES, Real, Statistics, Tolerance};

/// The most batches that are kept.
const KEPT: usize = 33;
/// The least number of the largest batches that tell a tail index.
const FEWEST: usize = 3;
/// The share of one batch in the variance from which on an error bar may mean nothing: eight times an equal share of 16
/// batches. Of scores whose squares have no mean, the largest has a share that does not fall with their number.
const MOST_SHARE: f64 = 0.5;
/// The tail index of scores from which on their variance is infinite.
const INFINITE: f64 = 2.0;

/// The number of batches from which on one of them with most of the variance is no chance: walks whose error bar is
/// doubtful go on until then.
pub const MANY_BATCHES: u64 = 64;
/// The part of the tolerance that a doubtful error bar must reach: if it is half of the true one, the tolerance is kept.
const SAFE: f64 = 0.5;

/// The batches of a goal with the largest sums of squared deviations of ζ. If these have a tail like t^(−α/2), the
/// scores have one like t^−α, whose variance is finite if α is above 2.
///
/// ```
/// use fredholm_core::{Statistics, Tail};
///
/// let mut tail = Tail::default();
/// // What a runner does after every batch.
/// tail.add(&Statistics::default());
/// assert_eq!(tail.batches(), 1);
/// assert!(!tail.is_doubtful());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tail {
    /// The largest sums first, and then places that are free.
    largest: [f64; KEPT],
    batches: u64,
    sum: f64,
    /// The sum of the squares of all sums.
    squares: f64,
}

/// Below every sum of squares.
const FREE: f64 = -1.0;

impl Default for Tail {
    /// No batch.
    fn default() -> Self {
        Self {
            largest: [FREE; KEPT],
            batches: 0,
            sum: 0.0,
            squares: 0.0,
        }
    }
}

impl Tail {
    /// Adds a batch.
    pub fn add(&mut self, batch: &Statistics) {
        let deviation = batch.preconditioned().std_dev.unwrap_or(0.0);
        self.add_squares(deviation * deviation * (batch.walks().max(1) - 1) as f64);
    }

    /// Adds a batch with this sum of squared deviations.
    fn add_squares(&mut self, squares: f64) {
        self.batches += 1;
        self.sum += squares;
        self.squares += squares * squares;
        let mut carried = squares;
        for place in &mut self.largest {
            if carried > *place {
                core::mem::swap(place, &mut carried);
            }
        }
    }

    /// Whether a goal that has reached its tolerance needs no further walks: the error bar may be believed, or so many
    /// batches have not mended it. `floor` is what rounding alone leaves of the standard deviation of ζ
    /// ([`rounding_floor`](crate::rounding_floor)): scores that differ by no more have any tail, and it means nothing.
    #[must_use]
    pub fn is_enough(&self, merged: &Statistics, tolerance: Option<Tolerance>, floor: f64) -> bool {
        let estimate = merged.preconditioned();
        if !self.is_doubtful() || !(estimate.std_dev > Some(floor)) {
            return true;
        }
        let error = estimate.std_error.unwrap_or(0.0);
        let bound = tolerance.map_or(0.0, |tolerance| tolerance.error(merged));
        let is_settled = error < SAFE * bound || self.seems_infinite();
        self.batches >= MANY_BATCHES && (is_settled || self.batches >= MANY_BATCHES.pow(2))
    }

    /// The number of batches.
    #[must_use]
    pub const fn batches(&self) -> u64 {
        self.batches
    }

    /// The share of the largest batch in all: about one over the number of batches, if scores are alike.
    #[must_use]
    pub fn share(&self) -> f64 {
        match self.largest.first() {
            Some(largest) if self.sum > 0.0 => largest / self.sum,
            _ => 0.0,
        }
    }

    /// The tail index α of the scores by Hill's estimate from so many of the largest batches; `None` if there are too few.
    fn hill(&self, count: usize) -> Option<f64> {
        let (few, rest) = self.largest.split_at_checked(count)?;
        let least = rest.first().filter(|&&least| least > 0.0)?;
        let logarithms: f64 = few.iter().map(|squares| Real::ln(squares / least)).sum();
        Some(2.0 * count as f64 / logarithms)
    }

    /// The number of the largest batches that tell most of the tail: the square root of that of all.
    fn told(&self) -> usize {
        (self.batches.isqrt() as usize).clamp(FEWEST, KEPT - 1)
    }

    /// The tail index α of the scores by Hill's estimate; `None` if there are too few batches for one. Scores without a heavy
    /// tail have a large index.
    #[must_use]
    pub fn index(&self) -> Option<f64> {
        let has_enough = self.batches >= MIN_BATCHES;
        self.hill(self.told()).filter(|_| has_enough)
    }

    /// Whether the variance seems to be infinite: the tail index is below 2 by its standard error, from however many of the
    /// largest batches. A few that are alike, and far above all others, are scores that are rare but bounded.
    #[must_use]
    pub fn seems_infinite(&self) -> bool {
        let is_heavy = |count: usize| {
            let index = self.hill(count);
            index.is_some_and(|index| index * (1.0 + 1.0 / Real::sqrt(count as f64)) < INFINITE)
        };
        self.batches >= MIN_BATCHES && (FEWEST..=self.told()).all(is_heavy)
    }

    /// The relative standard error of an error bar, as the variances of batches differ: √((κ − 1)/4N) for N scores of
    /// kurtosis κ. `None`: there are too few batches.
    #[must_use]
    pub fn uncertainty(&self) -> Option<f64> {
        let (batches, mean) = (self.batches as f64, self.sum / self.batches as f64);
        let spread = Real::max(self.squares / batches - mean * mean, 0.0) / (mean * mean);
        let is_told = self.batches >= MIN_BATCHES && mean > 0.0;
        is_told.then(|| 0.5 * Real::sqrt(spread / (batches - 1.0)))
    }

    /// Whether the error bar may mean little: one of many batches makes most of the variance, or that seems to be infinite.
    #[must_use]
    pub fn is_doubtful(&self) -> bool {
        let is_alone = self.batches >= MIN_BATCHES && self.share() > MOST_SHARE;
        is_alone || self.seems_infinite()
    }
}

#[cfg(test)]
mod tests {
    use super::Tail;

    /// Numbers with P(X > t) = t^−a, at evenly spaced probabilities in a scrambled order.
    fn pareto(a: f64, count: u64) -> Tail {
        let mut tail = Tail::default();
        for i in 0..count {
            // 389 is prime to the counts: every residue comes once.
            let u = ((i * 389 % count) as f64 + 0.5) / count as f64;
            tail.add_squares(u.powf(-1.0 / a));
        }
        tail
    }

    #[test]
    fn a_tail_index_is_found() {
        for index in [1.2, 1.8, 3.0, 6.0] {
            for count in [256, 1024, 4096] {
                let found = pareto(0.5 * index, count).index().unwrap();
                // Evenly spaced probabilities leave the bias of the largest one alone.
                assert!(
                    (found / index - 1.0).abs() < 0.1,
                    "{index}, {count}: {found}"
                );
            }
        }
    }

    #[test]
    fn an_infinite_variance_is_doubtful() {
        // Three batches alone know an index to 58 %.
        assert!(pareto(0.5, 1024).seems_infinite());
        assert!(!pareto(1.5, 1024).is_doubtful());
        let mut one = Tail::default();
        for _ in 0..15 {
            one.add_squares(0.0);
        }
        one.add_squares(1.0);
        assert!(one.is_doubtful() && one.index().is_none());
    }

    /// Four batches of 64 have a score that all others miss.
    #[test]
    fn rare_scores_that_are_bounded_have_a_finite_variance() {
        let mut tail = Tail::default();
        for i in 0..64 {
            let rare = if i % 16 == 3 {
                100.0 + f64::from(i)
            } else {
                0.0
            };
            tail.add_squares(1e-3 + rare);
        }
        assert!(tail.index() < Some(1.0) && !tail.seems_infinite() && !tail.is_doubtful());
    }

    /// Of batches whose sums are exponential, κ − 1 is the number of their walks.
    #[test]
    fn an_error_bar_is_as_uncertain_as_batches_differ() {
        let mut tail = Tail::default();
        for i in 0..400_u32 {
            assert!(i >= 16 || tail.uncertainty().is_none());
            let u = (f64::from(i * 37 % 400) + 0.5) / 400.0;
            tail.add_squares(-u.ln());
        }
        let uncertainty = tail.uncertainty().unwrap();
        assert!((uncertainty / 0.025 - 1.0).abs() < 0.02, "{uncertainty}");
        let mut equal = Tail::default();
        (0..100).for_each(|_| equal.add_squares(2.0));
        assert!(equal.uncertainty().unwrap() < 1e-9);
    }

    #[test]
    fn equal_batches_and_few_batches_are_not_doubtful() {
        let mut equal = Tail::default();
        for _ in 0..15 {
            equal.add_squares(1.0);
            assert!(!equal.is_doubtful() && equal.index().is_none());
        }
        equal.add_squares(1.0);
        assert!(!equal.is_doubtful());
        assert_eq!(equal.share(), 1.0 / 16.0);
    }
}
