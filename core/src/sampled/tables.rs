//! v and the control variate in the scalar of the walks.

use alloc::vec::Vec;
use core::num::NonZeroU32;

use super::events::StepEvents;
use super::{Sampled, SampledError, StepControl};
use crate::Equation;
use crate::galerkin::Basis;

/// v, c and C in the scalar of the walks, of every channel.
#[derive(Clone, Debug)]
pub struct SampledTables<F> {
    pub(super) v: Vec<F>,
    pub(super) control: Vec<F>,
    pub(super) integral: Vec<F>,
    pub(super) per_axis: u32,
    pub(super) events: Vec<u32>,
    pub(super) of_events: Vec<F>,
}

impl<F> SampledTables<F> {
    /// v_ia: B numbers of every channel, cell by cell.
    #[must_use]
    pub fn v(&self) -> &[F] {
        &self.v
    }

    /// The tables, borrowed.
    #[must_use]
    pub fn tables(&self) -> StepControl<'_, F> {
        StepControl {
            v: &self.v,
            control: &self.control,
            integral: &self.integral,
            per_axis: self.per_axis,
            events: &self.events,
            of_events: &self.of_events,
        }
    }

    /// The neighbour equation of v whose c has events of the steps, [`NoEvents`](super::NoEvents) say, with so many steps wherever G
    /// is scored.
    ///
    /// # Errors
    /// [`SampledError`]: it is none of the equation's cells, functions and channels.
    pub fn neighbour<'a, E, V, const D: usize, const B: usize>(
        &'a self,
        equation: &'a E,
        events: &'a V,
        steps: NonZeroU32,
    ) -> Result<Sampled<'a, E, D, B, V>, SampledError>
    where
        E: Equation<Scalar = F> + Basis<B>,
        V: StepEvents<D, Scalar = F, Point = E::Point>,
    {
        Sampled::with_events(equation, events, self.tables(), steps)
    }
}
