//! v and c of several channels, from the steps of one set-up.

use alloc::vec::Vec;

use super::events::StepEvents;
use super::fit::inverse;
use super::setup::{CellSteps, Kept, SampledSetup, SampledSolution, points, times};
use crate::channels::{Channels, MOST_CHANNELS};
use crate::galerkin::{Basis, CellMap, Convergence, GalerkinError, buffer, reserve};
use crate::{Kernel, RandomSource, Real, Sampler, StateSpace};

/// v of every channel, and what their controls are fitted with.
#[derive(Clone, Debug)]
pub struct SolvedChannels {
    /// v_c, and how its iteration ended.
    solved: Vec<(Vec<f64>, Convergence<f64>)>,
    /// r_c of every cell, on which it is constant.
    factors: Vec<Vec<f64>>,
    /// The sum of all v, each over its size: what events are chosen by.
    sum: Vec<f64>,
}

impl<P, S, const D: usize, const B: usize, E> SampledSetup<'_, P, S, D, B, E>
where
    P: Sampler + Kernel + Basis<B> + CellMap + StateSpace<Scalar = f64>,
    S: RandomSource + StateSpace<Scalar = f64, Point = P::Point>,
    E: StepEvents<D, Scalar = f64, Point = P::Point>,
{
    /// The fits of all F_c on a cell, in the points of its steps, and r_c there.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn channel_rows<C>(
        &self,
        cell: usize,
        equations: &C,
    ) -> Result<Vec<([f64; B], f64)>, GalerkinError>
    where
        C: Channels + StateSpace<Scalar = f64, Point = P::Point>,
    {
        let channels = equations.channels().min(MOST_CHANNELS);
        let mut numbers: Vec<f64> = buffer(channels)?;
        let mut sums: Vec<[f64; B]> = reserve(channels)?;
        sums.resize(channels, [0.0; B]);
        let mut factors: Vec<f64> = buffer(channels)?;
        let mut gram = [[0.0; B]; B];
        points::<P, D>(self.problem, cell, &self.options, &mut |x, _, draws| {
            let psi = self.problem.basis(&x);
            equations.sample_sources(&x.point, draws, &mut numbers);
            for (sum, &source) in sums.iter_mut().zip(&numbers) {
                for (sum, psi) in sum.iter_mut().zip(psi) {
                    *sum += psi * source;
                }
            }
            for (row, a) in gram.iter_mut().zip(psi) {
                for (entry, b) in row.iter_mut().zip(psi) {
                    *entry += a * b;
                }
            }
            equations.factors(&x.point, &mut factors);
        })?;
        let inverse = inverse(gram);
        let fits = sums.iter().map(|sum| times(&inverse, sum));
        Ok(fits.zip(factors).collect())
    }

    /// v_c of every channel from the steps and [rows](Self::channel_rows) of all cells.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    pub fn solve_channels(
        &self,
        steps: &[CellSteps<B>],
        rows: &[Vec<([f64; B], f64)>],
    ) -> Result<SolvedChannels, GalerkinError> {
        let channels = rows.first().map_or(0, Vec::len);
        let mut all = SolvedChannels {
            solved: reserve(channels)?,
            factors: reserve(channels)?,
            sum: buffer(steps.len().saturating_mul(B))?,
        };
        for channel in 0..channels {
            let own = |cell: usize| rows.get(cell).and_then(|row| row.get(channel)).copied();
            let (v, convergence) = self.solve_rows(steps, &|cell| {
                own(cell).unwrap_or(([f64::NAN; B], f64::NAN))
            })?;
            let squares: f64 = v.iter().map(|v| v * v).sum();
            if squares > 0.0 {
                let per_size = 1.0 / Real::sqrt(squares);
                all.sum
                    .iter_mut()
                    .zip(&v)
                    .for_each(|(sum, v)| *sum += per_size * v);
            }
            let mut factors = reserve(rows.len())?;
            factors.extend((0..rows.len()).map(|cell| own(cell).map_or(f64::NAN, |(_, r)| r)));
            all.solved.push((v, convergence));
            all.factors.push(factors);
        }
        Ok(all)
    }

    /// c of every channel on a cell, each as [`control`](Self::control) writes it. All have the same events: those that serve
    /// the sum of all v, each over its size.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn channel_controls(
        &self,
        cell: usize,
        steps: &CellSteps<B>,
        channels: &SolvedChannels,
    ) -> Result<Vec<Vec<f64>>, GalerkinError> {
        let count = channels.solved.len();
        let candidates = self.candidates(steps, &channels.sum)?;
        // The events are those of the last one, the sum.
        let values = |kept: &Kept<B>, values: &mut [f64]| {
            let all = channels.solved.iter().zip(&channels.factors);
            for (value, ((v, _), factors)) in values.iter_mut().zip(all) {
                *value = factors.get(cell).copied().unwrap_or(f64::NAN) * kept.value(v);
            }
            if let Some(sum) = values.last_mut() {
                *sum = kept.value(&channels.sum);
            }
        };
        let mut fit = self.fit(cell, steps, (&candidates, count + 1), &values)?;
        let mut controls = reserve(count)?;
        for _ in 0..count {
            controls.push(buffer(self.coefficients())?);
        }
        fit.solve(&mut controls)?;
        Ok(controls)
    }

    /// The solution of every channel, of the [controls](Self::channel_controls) of all cells.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn channel_solutions(
        &self,
        channels: SolvedChannels,
        controls: &[Vec<Vec<f64>>],
    ) -> Result<Vec<SampledSolution>, GalerkinError> {
        let mut all = reserve(channels.solved.len())?;
        for (channel, solved) in channels.solved.into_iter().enumerate() {
            let mut control: Vec<f64> =
                reserve(controls.len().saturating_mul(self.coefficients()))?;
            for own in controls.iter().filter_map(|of_cell| of_cell.get(channel)) {
                control.extend_from_slice(own);
            }
            all.push(self.solution(solved, control));
        }
        Ok(all)
    }

    /// Steps from all cells, and of every channel v and c with events of the steps, one cell after the other.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    pub fn of_channels<C>(&self, equations: &C) -> Result<Vec<SampledSolution>, GalerkinError>
    where
        C: Channels + StateSpace<Scalar = f64, Point = P::Point>,
    {
        let cells = self.problem.cells();
        let (mut steps, mut rows) = (reserve(cells)?, reserve(cells)?);
        for cell in 0..cells {
            steps.push(self.steps(cell)?);
            rows.push(self.channel_rows(cell, equations)?);
        }
        let channels = self.solve_channels(&steps, &rows)?;
        let mut controls = reserve(cells)?;
        for (cell, steps) in steps.iter().enumerate() {
            controls.push(self.channel_controls(cell, steps, &channels)?);
        }
        self.channel_solutions(channels, &controls)
    }
}
