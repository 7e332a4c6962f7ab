//! Error bars over replicates: of one number, and of all x at once.

use crate::array::from_fn;
use crate::{DefaultGenerator, Real, RngUniforms, Uniforms, WalkSeeds};

/// The mean of replicates and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Replicated {
    /// The mean over the replicates.
    pub mean: f64,
    /// The standard error of that mean, in its unit; NaN for fewer than two replicates. An interval of 95 % is
    /// Student's t of R − 1 degrees of freedom times as wide on each side.
    pub std_error: f64,
}

/// The mean and its standard error of a number that every replicate has, of replicates of equally many walks. Welford's
/// update: a sum of squares would lose all digits where replicates differ in their last ones.
///
/// ```
/// let u = fredholm_core::global::over_replicates(&[1.0, 2.0, 3.0, 6.0]);
/// assert_eq!(u.mean, 3.0);
/// assert!((u.std_error * u.std_error - 14.0 / 3.0 / 4.0).abs() < 1e-15);
/// ```
#[must_use]
pub fn over_replicates(values: &[f64]) -> Replicated {
    let (mut mean, mut squares) = (0.0, 0.0);
    for (i, value) in values.iter().enumerate() {
        let before = value - mean;
        mean += before / (i + 1) as f64;
        squares += before * (value - mean);
    }
    let count = values.len() as f64;
    let variance = squares / (count - 1.0) / count;
    Replicated {
        mean,
        std_error: if values.len() > 1 {
            Real::sqrt(variance)
        } else {
            f64::NAN
        },
    }
}

/// The most replicates of a [`band_factor`].
pub const MOST_REPLICATES: usize = 256;

/// The number c such that ũ(x) ± c · (standard error in x) holds at all points together with probability `level`: the
/// quantile of the largest studentised deviation max_x |ũ*(x) − ũ(x)|/s*(x) of replicates drawn from the replicates with
/// replacement (the bootstrap-t of Efron 1979, of a maximum).
///
/// `values` has what all R replicates say of one point after those of another, and is overwritten. `largest` has room for
/// one number of each resample: a thousand fix the level to 0.7 %. Points at which all replicates say the same are left
/// out; without any other c is 0. It is the same for the same values and seed, on every machine.
///
/// There is no band without at least two resamples and 4 to 256 replicates: then it is NaN.
///
/// ```
/// use fredholm_core::global::band_factor;
///
/// // Two points, 16 replicates; the second point says nothing new.
/// let one: Vec<f64> = (0..16).map(|r| f64::from(r * 7 % 16)).collect();
/// let mut both = [one.clone(), one].concat();
/// let c = band_factor(&mut both, 16, 0.95, 1, &mut [0.0; 1000]);
/// assert!(1.8 < c && c < 2.6, "{c}");
/// ```
#[must_use]
pub fn band_factor(
    values: &mut [f64],
    replicates: usize,
    level: f64,
    seed: u64,
    largest: &mut [f64],
) -> f64 {
    if !(4..=MOST_REPLICATES).contains(&replicates) || largest.len() < 2 {
        return f64::NAN;
    }
    for point in values.chunks_exact_mut(replicates) {
        standardise(point);
    }
    for block in values.chunks_exact_mut(BLOCK * replicates) {
        transpose(block, replicates);
    }
    let seeds = WalkSeeds::<DefaultGenerator>::new(seed, BAND);
    for (sample, largest) in (0..).zip(largest.iter_mut()) {
        let mut draws = RngUniforms(seeds.generator(sample));
        let mut times: [f64; MOST_REPLICATES] = from_fn(|_| 0.0);
        for _ in 0..replicates {
            let uniform: f64 = draws.uniform();
            if let Some(times) = times.get_mut((uniform * replicates as f64) as usize) {
                *times += 1.0;
            }
        }
        let drawn = Drawn::new(times.get(..replicates).unwrap_or_default());
        let blocks = values.chunks_exact(BLOCK * replicates);
        let rest = blocks.remainder().chunks_exact(replicates);
        let most = blocks.fold(0.0, |most, block| {
            let squares = drawn.squared_deviations::<BLOCK>(block);
            squares.into_iter().fold(most, larger)
        });
        let squares = rest.flat_map(|point| drawn.squared_deviations::<1>(point));
        *largest = Real::sqrt(squares.fold(most, larger));
    }
    largest.sort_unstable_by(f64::total_cmp);
    let rank = level * (largest.len() + 1) as f64;
    // The smallest that at least this share of the others does not exceed.
    let index = (rank as usize).saturating_sub(usize::from(rank as usize as f64 == rank));
    largest
        .get(index.min(largest.len() - 1))
        .copied()
        .unwrap_or(f64::NAN)
}

/// The number in place of a goal's that draws of a band have.
const BAND: u64 = u64::MAX - 1;

/// The larger one; NaN stays.
fn larger(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}

/// Makes the mean 0 and Σ squares R − 1; all 0 where all are equal.
fn standardise(values: &mut [f64]) {
    let Replicated { mean, std_error } = over_replicates(values);
    let deviation = std_error * Real::sqrt(values.len() as f64);
    // As far as rounding goes they are equal.
    let scale = if deviation > f64::EPSILON * mean.abs() {
        1.0 / deviation
    } else {
        0.0
    };
    for value in values {
        *value = (*value - mean) * scale;
    }
}

/// Points that are gone through side by side: a band takes a good part of the time of a global estimate.
const BLOCK: usize = 4;

/// Puts what all points of a block say in one replicate side by side.
fn transpose(block: &mut [f64], replicates: usize) {
    let mut before = [0.0; BLOCK * MOST_REPLICATES];
    let Some(before) = before.get_mut(..block.len()) else {
        return;
    };
    before.copy_from_slice(block);
    for (replicate, out) in block.chunks_exact_mut(BLOCK).enumerate() {
        let points = before.chunks_exact(replicates);
        for (out, point) in out.iter_mut().zip(points) {
            *out = point.get(replicate).copied().unwrap_or(f64::NAN);
        }
    }
}

/// Replicates that were drawn, and how often.
struct Drawn {
    /// Replicates whose numbers are the same modulo 4, class by class, each with the number of its replicates.
    classes: [([(usize, f64); MOST_REPLICATES / 4], usize); 4],
    /// R.
    count: f64,
}

impl Drawn {
    fn new(times: &[f64]) -> Self {
        let mut classes = [([(0, 0.0); MOST_REPLICATES / 4], 0); 4];
        for (replicate, times) in times.iter().enumerate().filter(|(_, times)| **times > 0.0) {
            if let Some((class, length)) = classes.get_mut(replicate % 4)
                && let Some(place) = class.get_mut(*length)
            {
                *place = (replicate, *times);
                *length += 1;
            }
        }
        Self {
            classes,
            count: times.len() as f64,
        }
    }

    /// (mean*/s*)² of the standardised values of N points, those of a replicate side by side; 0 where all that were drawn are 0.
    fn squared_deviations<const N: usize>(&self, values: &[f64]) -> [f64; N] {
        let (mut all_sums, mut all_squares) = ([[0.0; N]; 4], [[0.0; N]; 4]);
        let all = all_sums.iter_mut().zip(&mut all_squares);
        for ((class, length), (sums, squares)) in self.classes.iter().zip(all) {
            for (replicate, times) in class.iter().take(*length) {
                let own = values
                    .get(N * replicate..)
                    .and_then(<[f64]>::first_chunk::<N>);
                let Some(own) = own else {
                    continue;
                };
                for ((sum, squares), value) in sums.iter_mut().zip(&mut *squares).zip(own) {
                    let drawn = times * value;
                    *sum += drawn;
                    *squares += drawn * value;
                }
            }
        }
        let (mut out, squares) = (total(all_sums), total(all_squares));
        for (out, squares) in out.iter_mut().zip(squares) {
            let sum = *out;
            if sum != 0.0 {
                let variance = (squares - sum * sum / self.count) / (self.count - 1.0);
                *out = sum * sum / self.count / variance;
            }
        }
        out
    }
}

/// The sums of four classes, added in the order on which bits depend.
fn total<const N: usize>([mut all, b, c, d]: [[f64; N]; 4]) -> [f64; N] {
    let others = b.into_iter().zip(c.into_iter().zip(d));
    for (a, (b, (c, d))) in all.iter_mut().zip(others) {
        *a = (*a + b) + (c + d);
    }
    all
}
