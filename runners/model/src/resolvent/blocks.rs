//! What the points that all targets share say of T_D u and of r₀ on every cell.

use fredholm_core::galerkin::{buffer, degree_of};
use fredholm_core::resolvent::GroupScores;

use crate::numbers::{dot, widening};
use crate::{Error, GLOBAL_REPLICATES as REPLICATES};

/// Standard errors of a number that are no sign of it: some of many numbers are three off.
const SIGNIFICANT: f64 = 4.0;

/// Sums over all rounds, with replicates of their errors: of every cell those of T_D u, and behind these those of r₀, of so many functions
/// each.
///
/// Replicates are balanced (McCarthy 1969): what two randomisations of a stratum differ by is added with the signs of a column of a
/// Hadamard matrix. So replicates of any linear function of the sums have the mean 0, and the sum of their squares is that of all strata, but
/// for products of strata that share a column, whose mean is 0.
#[derive(Clone, Debug)]
pub struct Blocks {
    width: usize,
    /// Σ of the rounds' weights.
    weights: f64,
    sums: Vec<f64>,
    /// All replicates of every block, one after the other.
    replicates: Vec<f64>,
    /// The traces of the covariances of blocks over strata, and the squares of these over their degrees of freedom (Satterthwaite 1946).
    traces: Vec<[f64; 2]>,
    columns: usize,
}

/// A number that follows from the sums of all blocks, with its error.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockSum {
    pub(super) value: f64,
    pub(super) errors: [f64; REPLICATES],
    /// The variance as blocks add up, and the sum of its squares over degrees of freedom.
    pub(super) variance: f64,
    pub(super) squares: f64,
}

/// The sign of a replicate in a column of the Hadamard matrix, which is no constant.
pub(super) const fn sign(column: usize, replicate: usize) -> f64 {
    let column = 1 + column % (REPLICATES - 1);
    if (column & replicate).count_ones().is_multiple_of(2) {
        1.0
    } else {
        -1.0
    }
}

impl BlockSum {
    /// The standard error, as much larger as an interval of 95 % by Student's t is than one by the normal distribution.
    pub(super) fn std_error(&self) -> f64 {
        let squares: f64 = self.errors.iter().map(|x| x * x).sum();
        (squares / REPLICATES as f64).sqrt() * self.widening()
    }

    /// The size of the value, and 0 where that may be noise.
    pub(super) fn significant(&self) -> f64 {
        match self.value.abs() > SIGNIFICANT * self.std_error() {
            true => self.value.abs(),
            false => 0.0,
        }
    }

    pub(super) fn widening(&self) -> f64 {
        match self.squares > 0.0 {
            true => widening((self.variance.powi(2) / self.squares).max(1.0)),
            false => 1.0,
        }
    }
}

impl Blocks {
    /// Nothing yet, of so many cells and functions on each.
    pub(super) fn new(cells: usize, width: usize) -> Result<Self, Error> {
        let all = 2 * cells * width;
        Ok(Self {
            width,
            weights: 0.0,
            sums: buffer(all)?,
            replicates: buffer(all.saturating_mul(REPLICATES))?,
            traces: vec![[0.0; 2]; 2 * cells],
            columns: 0,
        })
    }

    /// The degree of the functions on a cell.
    pub(super) fn degree(&self, dimension: usize) -> usize {
        degree_of(dimension, self.width)
    }

    /// Adds a round with a weight.
    pub(super) fn add(&mut self, groups: &[GroupScores], weight: f64) {
        let width = self.width;
        let cells = self.traces.len() / 2;
        self.weights += weight;
        let (mut mean, mut off) = (vec![0.0; width], vec![0.0; width]);
        for group in groups {
            let Some(cell) = group.cell else { continue };
            let block = cell + if group.is_source { cells } else { 0 };
            let count = f64::from(group.replicates);
            let replicates = &mut self.replicates[block * REPLICATES * width..];
            mean.fill(0.0);
            let mut trace = 0.0;
            for (number, scores) in group.means.chunks_exact(width).enumerate() {
                // By Helmert's contrasts: of each with the mean of those before.
                let before = number as f64;
                let scale = weight * (before / (before + 1.0) / (count * (count - 1.0))).sqrt();
                for ((off, mean), score) in off.iter_mut().zip(&mut mean).zip(scores) {
                    *off = scale * (score - *mean);
                    *mean += (score - *mean) / (before + 1.0);
                }
                if number == 0 {
                    continue;
                }
                trace += dot(&off, &off);
                self.columns += 1;
                for (number, row) in replicates
                    .chunks_exact_mut(width)
                    .take(REPLICATES)
                    .enumerate()
                {
                    let sign = sign(self.columns, number);
                    row.iter_mut().zip(&off).for_each(|(to, x)| *to += sign * x);
                }
            }
            let to = self.sums[block * width..].iter_mut().zip(&mean);
            to.for_each(|(to, mean)| *to += weight * mean);
            let [all, squares] = &mut self.traces[block];
            *all += trace;
            *squares += trace * trace / (count - 1.0);
        }
    }

    /// The sum of all integrals times weights.
    pub(super) fn sum(&self, weights: &[f64]) -> BlockSum {
        let mut sum = BlockSum {
            value: dot(&self.sums, weights) / self.weights,
            errors: [0.0; REPLICATES],
            variance: 0.0,
            squares: 0.0,
        };
        let blocks = self.replicates.chunks_exact(REPLICATES * self.width);
        let blocks = blocks
            .zip(weights.chunks_exact(self.width))
            .zip(&self.traces);
        for ((rows, own), [trace, squares]) in blocks {
            if !(*trace > 0.0) {
                continue;
            }
            let mut variance = 0.0;
            for (to, row) in sum.errors.iter_mut().zip(rows.chunks_exact(self.width)) {
                let error = dot(row, own) / self.weights;
                *to += error;
                variance += error * error / REPLICATES as f64;
            }
            sum.variance += variance;
            sum.squares += variance * variance * squares / (trace * trace);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::Blocks;
    use fredholm_core::resolvent::GroupScores;

    fn group(cell: usize, means: &[f64]) -> GroupScores {
        GroupScores {
            cell: Some(cell),
            means: means.to_vec(),
            replicates: means.len() as u32 / 2,
            ..GroupScores::default()
        }
    }

    /// Strata of two cells, in two rounds of which one counts for twice the other: while columns are enough, replicates know all of their
    /// variance.
    #[test]
    fn replicates_have_the_variance_of_strata() {
        let mut blocks = Blocks::new(2, 2).unwrap();
        let first = [
            group(0, &[1.0, 0.0, 3.0, 1.0]),
            group(0, &[0.5, 2.0, 0.5, 1.0, 4.0, 0.0]),
            group(1, &[4.0, 1.0, 2.0, 1.0]),
        ];
        let second = [
            group(0, &[2.0, 1.0, 2.0, 3.0]),
            group(1, &[1.0, 1.0, 3.0, 0.0, 2.0, 2.0, -1.0, 0.5]),
        ];
        blocks.add(&first, 1.0);
        blocks.add(&second, 2.0);
        let weights = [1.0, 2.0, 3.0, -1.0, 0.0, 0.0, 0.0, 0.0];
        let by_hand = |groups: &[GroupScores]| {
            let (mut value, mut variance) = (0.0, 0.0);
            for group in groups {
                let own = &weights[2 * group.cell.unwrap()..];
                let scores = group.means.chunks_exact(2);
                let scores: Vec<f64> = scores.map(|x| own[0] * x[0] + own[1] * x[1]).collect();
                let count = scores.len() as f64;
                let mean = scores.iter().sum::<f64>() / count;
                let squares: f64 = scores.iter().map(|x| (x - mean).powi(2)).sum();
                value += mean;
                variance += squares / (count * (count - 1.0));
            }
            (value, variance)
        };
        let ((v1, s1), (v2, s2)) = (by_hand(&first), by_hand(&second));
        let found = blocks.sum(&weights);
        assert!((found.value - (v1 + 2.0 * v2) / 3.0).abs() < 1e-14);
        let variance = found.errors.iter().map(|x| x * x).sum::<f64>() / 64.0;
        let right = (s1 + 4.0 * s2) / 9.0;
        assert!((variance - right).abs() < 1e-14, "{variance} {right}");
        assert!((found.variance - right).abs() < 1e-14);
        assert!(found.errors.iter().sum::<f64>().abs() < 1e-13);
        assert!(found.widening() > 1.0);
    }
}
