//! Neighbour equations of several channels from steps: one step serves all.

use alloc::vec::Vec;
use core::num::NonZeroU32;

use num_traits::{one, zero};

use super::control::{Given, advance, box_of, combine, linear, power, spread};
use super::events::{SampledStep, StepEvents};
use super::{SampledError, SampledTables};
use crate::array::from_fn;
use crate::channels::{ChannelNeighbours, Channels, MOST_CHANNELS};
use crate::galerkin::{Basis, GalerkinError, reserve};
use crate::{Located, Real, StateSpace, Uniforms};

/// v, c and C of several channels in the scalar of the walks, whose controls have the same events.
///
/// Numbers of a cell, or of one of its boxes or events, stand side by side for all channels.
#[derive(Clone, Debug)]
pub struct ChannelTables<F> {
    channels: usize,
    per_axis: u32,
    slots: usize,
    v: Vec<F>,
    control: Vec<F>,
    integral: Vec<F>,
    events: Vec<u32>,
    of_events: Vec<F>,
}

/// Rows of the same length from the tables of all channels, side by side.
fn side_by_side<F: Copy>(tables: &[&[F]], row: usize) -> Result<Vec<F>, GalerkinError> {
    let length = tables.first().map_or(0, |table| table.len());
    let mut all = reserve(length.saturating_mul(tables.len()))?;
    if row > 0 {
        for from in (0..length).step_by(row) {
            for table in tables {
                all.extend_from_slice(table.get(from..from + row).unwrap_or(&[]));
            }
        }
    }
    Ok(all)
}

impl<F: Real> ChannelTables<F> {
    /// The tables of channels that were made with the same cells, of `functions` functions each and with `numbers` numbers of
    /// a step, boxes and events.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`]; [`GalerkinError::Length`]: the tables of a channel are of another length.
    pub fn new(
        tables: &[SampledTables<F>],
        functions: usize,
        numbers: usize,
    ) -> Result<Self, GalerkinError> {
        let Some(first) = tables.first() else {
            return Err(GalerkinError::Length {
                expected: 1,
                found: 0,
            });
        };
        let mut parts: [Vec<&[F]>; 4] = [Vec::new(), Vec::new(), Vec::new(), Vec::new()];
        for own in tables {
            let own = [&own.v, &own.control, &own.integral, &own.of_events];
            let firsts = [&first.v, &first.control, &first.integral, &first.of_events];
            for (part, (own, first)) in parts.iter_mut().zip(own.into_iter().zip(firsts)) {
                let (expected, found) = (first.len(), own.len());
                if expected != found {
                    return Err(GalerkinError::Length { expected, found });
                }
                part.push(own);
            }
        }
        let [v, control, integral, of_events] = &parts;
        let cells = first.v.len().checked_div(functions).unwrap_or(0);
        Ok(Self {
            channels: tables.len(),
            per_axis: first.per_axis,
            slots: first.events.len().checked_div(cells).unwrap_or(0),
            v: side_by_side(v, functions)?,
            control: side_by_side(control, functions + numbers)?,
            integral: side_by_side(integral, functions)?,
            events: {
                let mut events = reserve(first.events.len())?;
                events.extend_from_slice(&first.events);
                events
            },
            of_events: side_by_side(of_events, functions)?,
        })
    }

    /// The number of channels.
    #[must_use]
    pub const fn channels(&self) -> usize {
        self.channels
    }
}

/// The neighbour equations of all channels of an equation, each as [`Sampled`](super::Sampled) has it, from the same steps.
#[derive(Debug)]
pub struct SampledChannels<'a, F, P, E, const D: usize, const B: usize> {
    problem: &'a P,
    events: &'a E,
    tables: &'a ChannelTables<F>,
    steps: u32,
    per_steps: F,
    by: [F; D],
}

// By hand: a derive would ask the problem to be `Clone` and `Copy`.
impl<F: Copy, P, E, const D: usize, const B: usize> Clone for SampledChannels<'_, F, P, E, D, B> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<F: Copy, P, E, const D: usize, const B: usize> Copy for SampledChannels<'_, F, P, E, D, B> {}

impl<'a, F, P, E, const D: usize, const B: usize> SampledChannels<'a, F, P, E, D, B>
where
    F: Real,
    P: Channels + Basis<B> + StateSpace<Scalar = F>,
    E: StepEvents<D, Scalar = F, Point = P::Point>,
{
    /// The neighbour equations of these tables, whose G take so many steps wherever they are scored.
    ///
    /// # Errors
    /// [`SampledError`]: the tables are none of the problem's cells, functions and channels.
    pub fn new(
        (problem, events): (&'a P, &'a E),
        tables: &'a ChannelTables<F>,
        steps: NonZeroU32,
    ) -> Result<Self, SampledError> {
        let (expected, channels) = (problem.channels(), tables.channels);
        if channels != expected || channels > MOST_CHANNELS {
            return Err(SampledError::Channels {
                expected,
                found: channels,
            });
        }
        let boxes = power::<D>(tables.per_axis);
        for (found, of_cell) in [
            (tables.v.len(), channels * B),
            (tables.integral.len(), channels * B),
            (tables.control.len(), channels * boxes * (B + D)),
            (tables.of_events.len(), channels * tables.slots * B),
        ] {
            let expected = problem.cells().saturating_mul(of_cell);
            if found != expected {
                return Err(SampledError::Length { expected, found });
            }
        }
        let mut by = [0.0; D];
        spread(&mut by);
        Ok(Self {
            problem,
            events,
            tables,
            steps: steps.get(),
            per_steps: one::<F>() / F::from_u32(steps.get()),
            by: by.map(F::from_f64),
        })
    }

    /// v_c.
    #[inline]
    fn v(&self, cell: usize, psi: &[F; B], values: &mut [F]) {
        let first = cell.saturating_mul(self.tables.channels);
        for (place, value) in (first..).zip(values) {
            *value = combine(&self.tables.v, place, psi);
        }
    }

    /// Takes c of every channel in a step from the sums.
    #[inline]
    fn subtract_boxes(&self, cell: usize, psi: &[F; B], omega: &[F; D], sums: &mut [F]) {
        let (number, place) = box_of(omega, self.tables.per_axis);
        let boxes = power::<D>(self.tables.per_axis);
        let from = (cell * boxes + number) * self.tables.channels * (B + D);
        let own = self.tables.control.get(from..).unwrap_or(&[]);
        for (sum, own) in sums.iter_mut().zip(own.chunks_exact(B + D)) {
            *sum -= linear(own, psi, &place);
        }
    }
}

impl<F: Real, P: StateSpace<Scalar = F>, E, const D: usize, const B: usize> StateSpace
    for SampledChannels<'_, F, P, E, D, B>
{
    type Scalar = F;
    type Point = P::Point;
}

impl<F, P, E, const D: usize, const B: usize> ChannelNeighbours
    for SampledChannels<'_, F, P, E, D, B>
where
    F: Real,
    P: Channels + Basis<B> + StateSpace<Scalar = F>,
    E: StepEvents<D, Scalar = F, Point = P::Point>,
{
    #[inline]
    fn locate(&self, x: P::Point) -> Located<P::Point> {
        Located {
            point: x,
            cell: self.problem.locate(&x),
        }
    }

    fn sources(&self, x: &Located<P::Point>, draws: &mut dyn Uniforms<F>, sources: &mut [F]) {
        let psi = self.problem.basis(x);
        let channels = self.tables.channels;
        let slots = self.tables.slots;
        let from = x.cell.saturating_mul(slots);
        let own = self.tables.events.get(from..from + slots).unwrap_or(&[]);
        let count = own.iter().take_while(|&&event| event != u32::MAX).count();
        let events = own.get(..count).unwrap_or(&[]);
        let of_event = |event: usize, channel: usize| {
            combine(
                &self.tables.of_events,
                (from + event) * channels + channel,
                &psi,
            )
        };
        let survival = one::<F>() - self.problem.absorption(&x.point);
        let mut omega: [F; D] = from_fn(|_| draws.uniform());
        let (mut sums, mut values) = ([zero::<F>(); MOST_CHANNELS], [zero::<F>(); MOST_CHANNELS]);
        let (sums, values) = (&mut sums[..channels], &mut values[..channels]);
        // Factors of x multiply κ v(y) alone, whose controls know them.
        let mut factors = [zero::<F>(); MOST_CHANNELS];
        let factors = &mut factors[..channels];
        self.problem.factors(&x.point, factors);
        // How often each event occurs.
        let mut times = [zero::<F>(); 32];
        for step in 0..self.steps {
            if step > 0 {
                advance(&mut omega, &self.by);
            }
            let mut numbers = Given::new(omega, &mut *draws);
            let to = self.problem.step(&x.point, &mut numbers);
            if let Some(y) = to {
                let kappa = survival * self.problem.kernel(&x.point, &y);
                let y = self.locate(y);
                self.v(y.cell, &self.problem.basis(&y), values);
                for ((sum, &v), &factor) in sums.iter_mut().zip(&*values).zip(&*factors) {
                    *sum += factor * kappa * v;
                }
            }
            self.subtract_boxes(x.cell, &psi, &omega, sums);
            if !events.is_empty() {
                let step = SampledStep {
                    from: &x.point,
                    omega: &omega,
                    to: to.as_ref(),
                };
                let mut left = self.events.occurring(&step, events);
                while left != 0 {
                    if let Some(times) = times.get_mut(left.trailing_zeros() as usize) {
                        *times += one();
                    }
                    left &= left - 1;
                }
            }
        }
        // An event counts by how much more often it occurred than it does.
        for ((event, &number), times) in events.iter().enumerate().zip(&times) {
            let more = *times * self.per_steps - self.events.probability(&x.point, number);
            for (channel, sum) in sums.iter_mut().enumerate() {
                *sum -= more * of_event(event, channel) * F::from_u32(self.steps);
            }
        }
        self.v(x.cell, &psi, values);
        let first = x.cell.saturating_mul(channels);
        for (((place, source), &v), &sum) in (first..).zip(sources).zip(&*values).zip(&*sums) {
            *source = v - combine(&self.tables.integral, place, &psi) - sum * self.per_steps;
        }
    }

    #[inline]
    fn values(&self, x: &Located<P::Point>, values: &mut [F]) {
        self.v(x.cell, &self.problem.basis(x), values);
    }
}
