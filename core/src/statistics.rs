//! What is kept of many walks: f64 means, variances and covariances that merge.

use crate::array::from_fn;
use crate::{Real, Termination, Walk};

/// The most walks, and states, that anyone can have run: 10⁹ a second for 36 years.
const MOST: u64 = 1 << 60;

/// How many walks ended in which way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Terminations {
    /// Absorbed.
    pub absorbed: u64,
    /// Left the space.
    pub left: u64,
    /// Cut off at the step limit: a possible bias.
    pub step_limit: u64,
}

/// An estimate with its error bar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean over the walks.
    pub estimate: f64,
    /// The standard error of that mean, std_dev/√walks. Of n replicates of a [Sobol'](crate::Sequence) sequence an interval of
    /// 95 % is the quantile of Student's t with n − 1 degrees of freedom times as wide on each side. `None`: fewer than two walks, or none that
    /// scored, so that nothing is known.
    pub std_error: Option<f64>,
    /// The standard deviation of one walk, √Var in Heinrich 1995; of replicates that of independent walks with the same
    /// standard error. `None`: fewer than two walks, or replicates.
    pub std_dev: Option<f64>,
}

impl Estimate {
    /// The estimate of a number that follows from this one: `scale` says how errors follow.
    ///
    /// ```
    /// use fredholm_core::Estimate;
    ///
    /// let radius = Estimate { estimate: 2.0, std_error: Some(0.1), std_dev: None };
    /// let circumference = radius.derived(6.28 * radius.estimate, |error| 6.28 * error);
    /// assert!((circumference.std_error.unwrap() - 0.628).abs() < 1e-15);
    /// ```
    #[must_use]
    pub fn derived(self, estimate: f64, scale: impl Fn(f64) -> f64) -> Self {
        Self {
            estimate,
            std_error: self.std_error.map(&scale),
            std_dev: self.std_dev.map(scale),
        }
    }
}

/// Statistics of the triples (η(k,f), η(h,g) − (v,Φ), ζ) over some walks of one goal.
///
/// Always f64: an f32 sum of 4·10⁷ scores is wrong in its first digit. Welford's update within a
/// batch, Chan's between. Var ζ is accumulated from ζ itself: as a difference of the others'
/// variances it would lose all digits exactly where the method is good.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Statistics {
    walks: u64,
    states: u64,
    left: u64,
    step_limit: u64,
    scored: u64,
    plain: Moments,
    control: Moments,
    zeta: Moments,
    /// Σ (plain − its mean)(control − its mean).
    cross: f64,
    /// The number of independent samples, if they are replicates and not walks; 0: walks are.
    #[cfg_attr(feature = "serde", serde(default))]
    replicates: u32,
}

/// Mean and sum of squared deviations from it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Moments {
    mean: f64,
    squares: f64,
}

impl Moments {
    /// Welford's update; returns the deviations from the old and from the new mean.
    #[inline]
    fn push(&mut self, x: f64, per_walk: f64) -> (f64, f64) {
        let before = x - self.mean;
        self.mean += before * per_walk;
        let after = x - self.mean;
        self.squares += before * after;
        (before, after)
    }

    /// Adds a term of a sum of independent numbers.
    fn add(&mut self, term: &Self, weight: f64) {
        self.mean += weight * term.mean;
        self.squares += weight * weight * term.squares;
    }

    /// Chan's merge of `share` = n_other/n and `weight` = n_self n_other/n; returns the distance
    /// of the means.
    fn merge(&mut self, other: &Self, share: f64, weight: f64) -> f64 {
        let distance = other.mean - self.mean;
        self.mean += distance * share;
        self.squares += other.squares + distance * distance * weight;
        distance
    }
}

impl Statistics {
    /// The length of [`to_bytes`](Self::to_bytes).
    pub const BYTES: usize = 96;

    /// Adds one walk. `value` is (v, Φ), or the walk's own φ(x0) v(x0); `known` is added to what it estimates.
    #[inline]
    pub(crate) fn push<F: Real>(&mut self, walk: &Walk<F>, value: f64, known: f64) {
        let plain = walk.plain.to_f64() + known;
        let eta = walk.control.to_f64();
        let control = eta - value;
        self.walks += 1;
        self.states += u64::from(walk.states);
        match walk.termination {
            Termination::Absorbed => {}
            Termination::Left => self.left += 1,
            Termination::StepLimit | Termination::NotFinite => self.step_limit += 1,
        }
        // Without their signs: −0 is nothing, too.
        let bits = (plain.to_bits() | eta.to_bits()) << 1;
        self.scored += u64::from(bits != 0);
        let per_walk = 1.0 / self.walks as f64;
        let (before, _) = self.plain.push(plain, per_walk);
        let (_, after) = self.control.push(control, per_walk);
        self.cross += before * after;
        self.zeta.push(plain - control, per_walk);
    }

    /// Adds a walk that scored this, without a control variate; its states are counted elsewhere.
    #[inline]
    pub(crate) fn push_score(&mut self, score: f64) {
        let walk = Walk {
            plain: score,
            control: 0.0,
            states: 0,
            termination: Termination::Absorbed,
        };
        self.push(&walk, 0.0, 0.0);
    }

    /// Adds the walks of `other`, which follow those already here. Merging is not associative in
    /// the last bits: merge batches in their order, never in order of arrival.
    pub fn merge(&mut self, other: &Self) {
        if other.walks == 0 {
            return;
        }
        if self.walks == 0 {
            *self = *other;
            return;
        }
        let (share, weight) = self.shares(other);
        self.walks += other.walks;
        self.states += other.states;
        self.left += other.left;
        self.step_limit += other.step_limit;
        self.scored += other.scored;
        let plain = self.plain.merge(&other.plain, share, weight);
        let control = self.control.merge(&other.control, share, weight);
        self.zeta.merge(&other.zeta, share, weight);
        self.cross += other.cross + plain * control * weight;
        self.replicates = self.replicates.saturating_add(other.replicates);
    }

    /// Makes these walks one sample, that of a replicate: walks that depend on each other tell of its error by nothing but
    /// the means of replicates.
    pub(crate) const fn become_replicate(&mut self) {
        self.replicates = 1;
        self.plain.squares = 0.0;
        self.control.squares = 0.0;
        self.zeta.squares = 0.0;
        self.cross = 0.0;
    }

    /// Counts all walks as those that scored: nothing else is there to be scored.
    pub(crate) const fn become_certain(&mut self) {
        self.scored = self.walks;
    }

    /// One sample by so many walks.
    pub(crate) fn of_replicate(walks: u64, states: u64, value: f64) -> Self {
        let mean = |mean| Moments { mean, squares: 0.0 };
        Self {
            walks,
            states,
            left: 0,
            step_limit: 0,
            scored: walks,
            plain: mean(value),
            control: mean(0.0),
            zeta: mean(value),
            cross: 0.0,
            replicates: 1,
        }
    }

    /// Returns the statistics of so many walks that scored nothing.
    pub(crate) fn of_silent(walks: u64) -> Self {
        Self {
            walks,
            ..Self::default()
        }
    }

    /// The statistics of a weighted sum of functionals with independent walks, of which each has as many.
    pub(crate) fn of_sum<'a>(terms: impl Iterator<Item = (Self, &'a f64)>) -> Self {
        let mut sum = Self::default();
        for (own, &weight) in terms {
            sum.walks = own.walks;
            sum.replicates = own.replicates;
            sum.states += own.states;
            sum.step_limit = sum.step_limit.max(own.step_limit);
            sum.left = sum.left.max(own.left);
            sum.scored = sum.scored.max(own.scored);
            sum.plain.add(&own.plain, weight);
            sum.control.add(&own.control, weight);
            sum.zeta.add(&own.zeta, weight);
            sum.cross += weight * weight * own.cross;
        }
        sum.left = sum.left.min(sum.walks - sum.step_limit);
        sum
    }

    /// The number of replicates, whose means are the independent samples; 0 if walks are.
    #[must_use]
    pub const fn replicates(&self) -> u32 {
        self.replicates
    }

    /// n_other/n and n_self n_other/n.
    fn shares(&self, other: &Self) -> (f64, f64) {
        let (n_self, n_other) = (self.walks as f64, other.walks as f64);
        let share = n_other / (n_self + n_other);
        (share, n_self * share)
    }

    /// The statistics in 96 bytes: as little-endian words the numbers of walks, of states, of walks
    /// that left, that met the step limit and that scored; then mean and sum of squared deviations
    /// of η(k,f), of η(h,g) − (v,Φ) and of ζ; then the sum of the products of deviations. Without the
    /// number of replicates.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let counts = [
            self.walks,
            self.states,
            self.left,
            self.step_limit,
            self.scored,
        ];
        let moments = [self.plain, self.control, self.zeta];
        let floats = moments.into_iter().flat_map(|m| [m.mean, m.squares]);
        let words = floats.chain([self.cross]).map(f64::to_bits);
        let mut bytes = [0; Self::BYTES];
        let (chunks, _) = bytes.as_chunks_mut::<8>();
        for (to, word) in chunks.iter_mut().zip(counts.into_iter().chain(words)) {
            *to = word.to_le_bytes();
        }
        bytes
    }

    /// The statistics that [`to_bytes`](Self::to_bytes) wrote, to the bit. `None`: the numbers of walks
    /// contradict each other, or there are more than 2⁶⁰ walks or states, which nobody can have run
    /// and to which no more could be added. That is no check against other damage.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; Self::BYTES]) -> Option<Self> {
        let (chunks, _) = bytes.as_chunks::<8>();
        let mut words = chunks.iter().map(|bytes| u64::from_le_bytes(*bytes));
        let mut next = || words.next().unwrap_or(0);
        let [walks, states, left, step_limit, scored] = from_fn(|_| next());
        let mut float = || f64::from_bits(next());
        let mut moments = || Moments {
            mean: float(),
            squares: float(),
        };
        let [plain, control, zeta] = from_fn(|_| moments());
        let statistics = Self {
            walks,
            states,
            left,
            step_limit,
            scored,
            plain,
            control,
            zeta,
            cross: float(),
            replicates: 0,
        };
        // `terminations` subtracts the two.
        let cut_short = left.checked_add(step_limit)?;
        let possible = cut_short <= walks && scored <= walks && walks.max(states) <= MOST;
        possible.then_some(statistics)
    }

    /// The number of walks.
    #[must_use]
    pub const fn walks(&self) -> u64 {
        self.walks
    }

    /// Visited states of all walks, starts included.
    #[must_use]
    pub const fn states(&self) -> u64 {
        self.states
    }

    /// How the walks ended.
    #[must_use]
    pub const fn terminations(&self) -> Terminations {
        Terminations {
            absorbed: self.walks - self.left - self.step_limit,
            left: self.left,
            step_limit: self.step_limit,
        }
    }

    /// Walks in which either equation scored anything but 0.
    #[must_use]
    pub const fn scored(&self) -> u64 {
        self.scored
    }

    /// The plain estimate (9): the mean of η(k,f).
    #[must_use]
    pub fn plain(&self) -> Estimate {
        // Scores that are all 0, and no others, have mean 0 and no deviations from it.
        let nothing = self.plain.mean == 0.0 && self.plain.squares == 0.0;
        self.estimate(&self.plain, !nothing)
    }

    /// The preconditioned estimate (11): the mean of ζ = (v,Φ) + η(k,f) − η(h,g).
    #[must_use]
    pub fn preconditioned(&self) -> Estimate {
        let samples = (self.walks, self.replicates);
        estimate(samples, &self.zeta, self.scored > 0)
    }

    /// The standard error of the preconditioned estimate, from two walks on of which one has scored: bit for bit that of
    /// [`preconditioned`](Self::preconditioned).
    #[inline]
    pub(crate) fn preconditioned_error(&self) -> Option<f64> {
        let samples = samples(self.walks, self.replicates);
        let has_error = samples > 1 && self.scored > 0;
        has_error.then(|| std_error(self.zeta.squares, samples, self.walks))
    }

    /// The preconditioned estimate alone.
    #[inline]
    pub(crate) const fn preconditioned_mean(&self) -> f64 {
        self.zeta.mean
    }

    /// The preconditioned estimate of these walks and those of `other`, to the bit what
    /// [`merge`](Self::merge) would give, without a copy of either.
    #[must_use]
    pub fn preconditioned_with(&self, other: &Self) -> Estimate {
        let mut zeta = if self.walks == 0 {
            other.zeta
        } else {
            self.zeta
        };
        if self.walks > 0 && other.walks > 0 {
            let (share, weight) = self.shares(other);
            zeta.merge(&other.zeta, share, weight);
        }
        let scored = self.scored > 0 || other.scored > 0;
        let replicates = self.replicates.saturating_add(other.replicates);
        estimate((self.walks + other.walks, replicates), &zeta, scored)
    }

    /// The mean of η(h,g) − (v,Φ). Its expectation is 0, so that it tests the neighbour equation.
    #[must_use]
    pub fn control(&self) -> Estimate {
        self.estimate(&self.control, self.scored > 0)
    }

    /// The covariance of η(k,f) and η(h,g) − (v,Φ); `None` for fewer than two walks.
    #[must_use]
    pub fn covariance(&self) -> Option<f64> {
        let samples = samples(self.walks, self.replicates);
        (samples > 1).then(|| self.cross / (samples - 1) as f64)
    }

    fn estimate(&self, moments: &Moments, scored: bool) -> Estimate {
        estimate((self.walks, self.replicates), moments, scored)
    }
}

/// The number of independent samples.
#[inline(always)]
const fn samples(walks: u64, replicates: u32) -> u64 {
    if replicates == 0 {
        walks
    } else {
        replicates as u64
    }
}

/// The standard error of a mean over so many walks, from the squares of the deviations of so many samples.
// Out of line: the deepest stack of a device is here, where square roots are software.
#[inline(never)]
fn std_error(squares: f64, samples: u64, walks: u64) -> f64 {
    std_dev(squares, samples) / (walks as f64).sqrt()
}

/// The standard deviation of a score.
#[inline(always)]
fn std_dev(squares: f64, samples: u64) -> f64 {
    (squares / (samples - 1) as f64).sqrt()
}

fn estimate((walks, replicates): (u64, u32), moments: &Moments, scored: bool) -> Estimate {
    let samples = samples(walks, replicates);
    let std_dev = (samples > 1).then(|| std_dev(moments.squares, samples));
    let std_error = std_dev.filter(|_| scored);
    Estimate {
        estimate: moments.mean,
        std_error: std_error.map(|deviation| deviation / (walks as f64).sqrt()),
        std_dev,
    }
}

/// The size of the error that rounding leaves and more walks do not lower:
/// ε (|v| + |u|)/(1 − |kp|), where ε belongs to the scalar type, |v| and |u| are sizes of the two
/// solutions and |kp| < 1 bounds ∫|k(x,y)|p(x,y) dμ(y), or the spectral radius of T_|k|p. From 1 on there
/// is no floor but infinity.
///
/// ```
/// let floor = fredholm_core::rounding_floor::<f32>(5.0, 6.0, 0.75);
/// assert!((floor - 44.0 * f64::from(f32::EPSILON)).abs() < 1e-12);
/// ```
#[must_use]
pub fn rounding_floor<F: Real>(v: f64, u: f64, kp: f64) -> f64 {
    F::EPSILON.to_f64() * (v.abs() + u.abs()) / Real::max(1.0 - kp, 0.0)
}

#[cfg(test)]
mod tests {
    use super::Statistics;
    use crate::{Termination, Walk};

    fn walk(plain: f64, control: f64) -> Walk<f64> {
        Walk {
            plain,
            control,
            states: 2,
            termination: Termination::Absorbed,
        }
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-12 * b.abs()
    }

    #[test]
    fn agrees_with_two_passes_and_merges_in_any_cut() {
        let scores: [(f64, f64); 7] = [
            (1.0, 2.0),
            (0.5, 0.0),
            (3.0, 2.5),
            (-1.0, 0.5),
            (4.0, 4.5),
            (2.0, 1.0),
            (0.25, 0.5),
        ];
        let n = scores.len() as f64;
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| scores.iter().map(f).sum::<f64>() / n;
        let (p, c) = (mean(&|s| s.0), mean(&|s| s.1));
        let covariance = mean(&|s| (s.0 - p) * (s.1 - c)) * n / (n - 1.0);
        let zeta = mean(&|s| s.0 - s.1);
        let variance = mean(&|s| (s.0 - s.1 - zeta) * (s.0 - s.1 - zeta)) * n / (n - 1.0);
        for cut in 0..=scores.len() {
            let mut parts = [Statistics::default(), Statistics::default()];
            for (i, s) in scores.iter().enumerate() {
                // (v, Φ) = 1.5
                parts[usize::from(i >= cut)].push(&walk(s.0, s.1), 1.5, 0.0);
            }
            let [mut all, rest] = parts;
            let both = all.preconditioned_with(&rest);
            all.merge(&rest);
            assert_eq!(all.preconditioned(), both);
            assert_eq!(all.walks(), 7);
            assert_eq!(all.states(), 14);
            assert!(close(all.plain().estimate, p));
            assert!(close(all.preconditioned().estimate, 1.5 + zeta));
            assert!(close(
                all.preconditioned().std_dev.unwrap(),
                variance.sqrt()
            ));
            assert!(close(all.covariance().unwrap(), covariance));
            assert!(close(
                all.plain().std_error.unwrap(),
                all.plain().std_dev.unwrap() / n.sqrt()
            ));
        }
    }

    #[test]
    fn nothing_scored_is_not_an_error_bar_of_zero() {
        let mut statistics = Statistics::default();
        assert_eq!(statistics.plain().std_dev, None);
        for _ in 0..10 {
            statistics.push(&walk(0.0, 0.0), 0.0, 0.0);
        }
        assert_eq!(statistics.plain().std_error, None);
        assert_eq!(statistics.preconditioned().std_error, None);
        statistics.push(&walk(0.0, 1.0), 0.0, 0.0);
        assert_eq!(statistics.plain().std_error, None);
        assert!(statistics.preconditioned().std_error.is_some());
    }

    #[test]
    fn bytes_keep_every_bit_and_refuse_contradictions() {
        let mut statistics = Statistics::default();
        assert_eq!(
            Statistics::from_bytes(&statistics.to_bytes()),
            Some(statistics)
        );
        for (plain, control) in [(1.0, 0.1), (-0.3, 0.7), (1e-300, 3.0)] {
            statistics.push(&walk(plain, control), 0.2, 0.0);
        }
        let bytes = statistics.to_bytes();
        assert_eq!(bytes[..8], 3_u64.to_le_bytes());
        assert_eq!(bytes[88..], statistics.cross.to_le_bytes());
        assert_eq!(Statistics::from_bytes(&bytes), Some(statistics));
        // More walks left, met the limit or scored than there were.
        for (at, word) in [(16, 4_u64), (24, u64::MAX), (32, 4)] {
            let mut spoilt = bytes;
            spoilt[at..at + 8].copy_from_slice(&word.to_le_bytes());
            assert_eq!(Statistics::from_bytes(&spoilt), None, "byte {at}");
        }
        // As many walks or states as can be, to which the next one could not be added.
        for at in [0, 8] {
            for (most, good) in [
                (1_u64 << 60, true),
                ((1 << 60) + 1, false),
                (u64::MAX, false),
            ] {
                let mut spoilt = bytes;
                spoilt[at..at + 8].copy_from_slice(&most.to_le_bytes());
                let read = Statistics::from_bytes(&spoilt);
                assert_eq!(read.is_some(), good, "byte {at}");
                if let Some(mut read) = read {
                    read.push(&walk(1.0, 1.0), 0.0, 0.0);
                    read.merge(&statistics);
                }
            }
        }
    }

    /// f32 sums of this many equal scores stop growing at 2²⁴.
    #[test]
    fn a_long_run_of_f32_scores_keeps_its_mean() {
        let score = Walk {
            plain: 5.8_f32,
            control: 5.7,
            states: 1,
            termination: Termination::Absorbed,
        };
        let mut batch = Statistics::default();
        for _ in 0..4096 {
            batch.push(&score, 5.7, 0.0);
        }
        let mut all = Statistics::default();
        for _ in 0..100_000 {
            all.merge(&batch);
        }
        assert!((all.plain().estimate - f64::from(5.8_f32)).abs() < 1e-12);
    }
}
