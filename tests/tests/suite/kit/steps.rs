//! What a broken problem offers of neighbour equations from steps.

use core::num::NonZeroU32;

use fredholm_core::sampled::{NoEvents, Sampled, SampledStep, StepControl, StepEvents};
use fredholm_core::{Channels, Equation, Real, Value};
use fredholm_tests::{Neighbours, Offers};

use super::{Broken, CELLS, Fault};

/// A constant that controls steps.
const CONSTANT: f64 = 0.6;

impl<F: Real, V: Value<F>> Broken<F, V> {
    /// The tables of this constant as control of all boxes.
    fn integrals(&self) -> [Vec<F>; 2] {
        let constant = F::from_f64(CONSTANT);
        let count = CELLS * self.channels();
        let integral = constant * self.factor(Fault::StepIntegral, 1.05);
        [
            [constant, F::zero()].repeat(count),
            [integral].repeat(count),
        ]
    }
}

/// v in every cell and channel.
fn controlled<'t, F>(v: &'t [F], [control, integral]: &'t [Vec<F>; 2]) -> StepControl<'t, F> {
    StepControl {
        v,
        control,
        integral,
        per_axis: 1,
        events: &[],
        of_events: &[],
    }
}

impl<F: Real> Broken<F> {
    /// Neighbour equations from steps, with a constant as control: of all boxes, and of two events of which one occurs.
    pub(super) fn offer_steps(&self, offers: &mut Offers<'_, Self>, v: &[F]) {
        let integrals = self.integrals();
        let tables = controlled(v, &integrals);
        let neighbour = Sampled::<_, 1>::new(self, tables, NonZeroU32::MIN);
        offers.neighbour("from steps", &neighbour.expect("its tables"));
        let tables = StepControl {
            control: &[F::zero(); 2 * CELLS],
            integral: &[F::zero(); CELLS],
            events: &[0, 1].repeat(CELLS),
            of_events: &[F::from_f64(CONSTANT); 2 * CELLS],
            ..tables
        };
        let neighbour = Sampled::<_, 1, 1, _>::with_events(self, self, tables, NonZeroU32::MIN);
        offers.neighbour("from steps with events", &neighbour.expect("its tables"));
    }
}

impl<F: Real> Neighbours for Broken<F, Channels<F, 3>> {
    fn offers(&self, offers: &mut Offers<'_, Self>) {
        let (integrals, v) = (self.integrals(), [1.0, 0.5, 0.8].map(F::from_f64));
        let v = v.repeat(CELLS);
        let tables = controlled(&v, &integrals);
        let neighbour = Sampled::<_, 1, 1, NoEvents<Self>>::new(self, tables, NonZeroU32::MIN);
        offers.neighbour("from steps", &neighbour.expect("its tables"));
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
