//! What a broken problem offers of neighbour equations from steps.

use core::num::NonZeroU32;

use fredholm_core::Real;
use fredholm_core::sampled::{Sampled, SampledStep, StepControl, StepEvents};
use fredholm_tests::Offers;

use super::{Broken, CELLS, Fault};

impl<F: Real> Broken<F> {
    /// Neighbour equations from steps, with a constant as control: of all boxes, and of two events of which one occurs.
    pub(super) fn offer_steps(&self, offers: &mut Offers<'_, Self>, v: &[F]) {
        let constant = F::from_f64(0.6);
        let control = [constant, F::zero()].repeat(CELLS);
        let integral = [constant * self.factor(Fault::StepIntegral, 1.05)].repeat(CELLS);
        let tables = StepControl {
            v,
            control: &control,
            integral: &integral,
            per_axis: 1,
            events: &[],
            of_events: &[],
        };
        let neighbour = Sampled::<_, _, 1, 1>::new(self, tables, NonZeroU32::MIN);
        offers.neighbour("from steps", &neighbour.expect("its tables"));
        let tables = StepControl {
            control: &[F::zero(); 2 * CELLS],
            integral: &[F::zero(); CELLS],
            events: &[0, 1].repeat(CELLS),
            of_events: &[constant; 2 * CELLS],
            ..tables
        };
        let of = (self, self);
        let neighbour = Sampled::<_, _, 1, 1, _>::with_events(of, tables, NonZeroU32::MIN);
        offers.neighbour("from steps with events", &neighbour.expect("its tables"));
    }
}

/// Events 0 and 1: the first number of a step is below a half, or not.
impl<F: Real> StepEvents<1> for Broken<F> {
    fn towards(&self, _: usize) -> Option<u32> {
        Some(0)
    }
    fn probability(&self, _: &F, _: u32) -> F {
        F::from_f64(0.5) * self.factor(Fault::EventProbability, 1.05)
    }
    fn occurring(&self, step: &SampledStep<'_, F, F, 1>, events: &[u32]) -> u32 {
        let occurring = u32::from(step.omega[0] >= F::from_f64(0.5));
        let places = events.iter().enumerate();
        places.fold(0, |bits, (place, &event)| {
            bits | u32::from(event == occurring) << place
        })
    }
}
