//! What a broken problem offers of neighbour equations from steps.

use core::num::NonZeroU32;

use fredholm_core::galerkin::Partition;
use fredholm_core::sampled::{Sampled, SampledStep, StepControl, StepEvents};
use fredholm_core::{Kernel, Located, Neighbour, Real, Sampler, StateSpace, Uniforms};
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
        offers.neighbour("to the light", &ToTheLight { problem: self, v });
    }
}

/// The neighbour equation of v + d with h = k, where d is what a light gives: G is drawn by a step to y, and a look from there at
/// the light.
struct ToTheLight<'a, F> {
    problem: &'a Broken<F>,
    v: &'a [F],
}

/// Numbers of which the type is not known.
struct Drawn<'a, F>(&'a mut dyn Uniforms<F>);

impl<F> Uniforms<F> for Drawn<'_, F> {
    fn uniform(&mut self) -> F {
        self.0.uniform()
    }
}

/// d.
fn light<F: Real>(x: F) -> F {
    F::from_f64(0.3) + x * x
}

impl<F: Real> StateSpace for ToTheLight<'_, F> {
    type Scalar = F;
    type Point = F;
}

impl<F: Real> Neighbour for ToTheLight<'_, F> {
    fn locate(&self, x: F) -> Located<F> {
        Located {
            point: x,
            cell: self.problem.locate(&x),
        }
    }

    fn kernel(&self, _: &Located<F>, _: &Located<F>, k: F) -> F {
        k
    }

    fn source(&self, x: &Located<F>, draws: &mut dyn Uniforms<F>) -> F {
        let survival = F::one() - self.problem.absorption(&x.point);
        let seen = self
            .problem
            .step(&x.point, &mut Drawn(draws))
            .map_or(F::zero(), |y| {
                let at = self.locate(y);
                let of_light = light(y) * self.problem.factor(Fault::LastStep, 1.05);
                let of_v = self.value(&at) - light(y);
                survival * self.problem.kernel(&x.point, &y) * (of_light + of_v)
            });
        self.value(x) - seen
    }

    fn value(&self, x: &Located<F>) -> F {
        light(x.point) + self.v.get(x.cell).copied().unwrap_or(F::NAN)
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
