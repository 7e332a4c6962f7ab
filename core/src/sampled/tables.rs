//! v and the control variate in the scalar of the walks.

use alloc::vec::Vec;
use core::num::NonZeroU32;

use super::events::StepEvents;
use super::{Sampled, SampledError, StepControl};
use crate::galerkin::Basis;
use crate::{Real, StateSpace};

/// v, c and C in the scalar of the walks.
#[derive(Clone, Debug)]
pub struct SampledTables<F> {
    pub(super) v: Vec<F>,
    pub(super) control: Vec<F>,
    pub(super) integral: Vec<F>,
    pub(super) per_axis: u32,
    pub(super) events: Vec<u32>,
    pub(super) of_events: Vec<F>,
}

impl<F: Real> SampledTables<F> {
    /// v_ia.
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

    /// The neighbour equation of v, with so many steps wherever G is scored.
    ///
    /// # Errors
    /// [`SampledError`]: it is none of the problem's cells and functions.
    pub fn neighbour<'a, P, const D: usize, const B: usize>(
        &'a self,
        problem: &'a P,
        steps: NonZeroU32,
    ) -> Result<Sampled<'a, F, P, D, B>, SampledError>
    where
        P: Basis<B> + StateSpace<Scalar = F>,
    {
        Sampled::new(problem, self.tables(), steps)
    }

    /// The neighbour equation of v whose c has events of the steps, with so many steps wherever G is scored.
    ///
    /// # Errors
    /// [`SampledError`]: it is none of the problem's cells and functions.
    pub fn neighbour_with_events<'a, P, E, const D: usize, const B: usize>(
        &'a self,
        of: (&'a P, &'a E),
        steps: NonZeroU32,
    ) -> Result<Sampled<'a, F, P, D, B, E>, SampledError>
    where
        P: Basis<B> + StateSpace<Scalar = F>,
        E: StepEvents<D, Scalar = F, Point = P::Point>,
    {
        Sampled::with_events(of, self.tables(), steps)
    }
}
