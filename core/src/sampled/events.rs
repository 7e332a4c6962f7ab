//! Sets of steps whose probability is known.

use core::fmt;
use core::marker::PhantomData;

use num_traits::zero;

use crate::Space;

/// A step as its events see it.
///
/// ```
/// use fredholm_core::sampled::SampledStep;
///
/// let step = SampledStep { from: &0.3, omega: &[0.2], to: Some(&0.1) };
/// assert!(step.to < Some(step.from));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct SampledStep<'s, P, F, const D: usize> {
    /// x.
    pub from: &'s P,
    /// ω.
    pub omega: &'s [F; D],
    /// y(x, ω); `None`: it is not known, or the step left.
    pub to: Option<&'s P>,
}

/// Events of a step: sets A_g(x) ⊂ [0, 1]^D of its random numbers ω whose volume P_g(x) is known exactly.
///
/// κ v(y(x, ω)) jumps where a step meets something else, on surfaces in the space of ω that move with x. Equal boxes blur
/// such a jump, and the indicator of an event that ends there follows it. It may be a control variate since its integral is
/// known: see the [module](crate::sampled).
///
/// ```
/// use fredholm_core::Space;
/// use fredholm_core::sampled::{SampledStep, StepEvents};
///
/// /// Steps that are uniform on [0, 1], and what they meet: one thing below x, another one above.
/// struct Two;
///
/// impl Space for Two {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl StepEvents<1> for Two {
///     fn towards(&self, _: usize) -> Option<u32> {
///         Some(0)
///     }
///     fn probability(&self, x: &f64, _: u32) -> f64 {
///         *x
///     }
///     fn occurring(&self, step: &SampledStep<'_, f64, f64, 1>, events: &[u32]) -> u32 {
///         u32::from(step.omega[0] < *step.from && events == [0])
///     }
/// }
/// let step = SampledStep { from: &0.3, omega: &[0.2], to: None };
/// assert_eq!(Two.occurring(&step, &[0]), 1);
/// assert_eq!(Two.probability(&0.3, 0), 0.3);
/// ```
pub trait StepEvents<const D: usize>: Space {
    /// The number of the event of steps that lead towards a cell; `None`: there is none.
    fn towards(&self, cell: usize) -> Option<u32>;

    /// P_g(x), the probability that ω, uniform in [0, 1]^D, is in A_g(x).
    fn probability(&self, x: &Self::Point, event: u32) -> Self::Scalar;

    /// Which of at most 32 events occur, ω ∈ A_g(x): bit k says it of the one in place k.
    fn occurring(
        &self,
        step: &SampledStep<'_, Self::Point, Self::Scalar, D>,
        events: &[u32],
    ) -> u32;
}

/// Steps without events.
///
/// ```
/// use fredholm_core::Space;
/// use fredholm_core::sampled::{NoEvents, StepEvents};
///
/// struct Line;
/// impl Space for Line {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// assert_eq!(StepEvents::<1>::towards(&NoEvents::<Line>::NEW, 0), None);
/// ```
pub struct NoEvents<P>(PhantomData<fn() -> P>);

impl<P> NoEvents<P> {
    /// No events.
    pub const NEW: Self = Self(PhantomData);
}

impl<P> fmt::Debug for NoEvents<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("NoEvents")
    }
}

impl<P: Space> Space for NoEvents<P> {
    type Scalar = P::Scalar;
    type Point = P::Point;
}

impl<P: Space, const D: usize> StepEvents<D> for NoEvents<P> {
    #[inline(always)]
    fn towards(&self, _: usize) -> Option<u32> {
        None
    }

    #[inline(always)]
    fn probability(&self, _: &P::Point, _: u32) -> P::Scalar {
        zero()
    }

    #[inline(always)]
    fn occurring(&self, _: &SampledStep<'_, P::Point, P::Scalar, D>, _: &[u32]) -> u32 {
        0
    }
}
