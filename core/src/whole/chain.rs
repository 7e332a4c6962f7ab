//! Chains that preserve a density.

use crate::{Sampler, Uniforms};

/// A chain that preserves the density of its starts, thinned by absorption: ∫ p0(x) p(x,y) dμ(x) = s p0(y).
///
/// Uniform starts and a symmetric p with a constant q are the common case, with p0 = 1/μ(X) and s = 1 − q: the circle,
/// uniform steps on a cube, closed rooms with cosine-distributed directions. Where walks leave the space, or q differs
/// from place to place, there is in general no such p0 that is known, and a problem does not implement this trait.
///
/// It is a fact that a problem states: if it is wrong, every result from suffixes is biased. The conformance kit's checks
/// "preserved density" and "suffix starts" find that out.
///
/// ```
/// use fredholm_core::whole::Stationary;
/// use fredholm_core::{Sampler, StateSpace, Uniforms};
///
/// /// Uniform steps on [0, 1), absorbed with probability ¼.
/// struct Interval;
/// impl StateSpace for Interval {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl Sampler for Interval {
///     fn absorption(&self, _: &f64) -> f64 {
///         0.25
///     }
///     fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
///         Some(uniforms.uniform())
///     }
/// }
/// impl Stationary for Interval {
///     fn start<U: Uniforms<f64>>(&self, uniforms: &mut U) -> f64 {
///         uniforms.uniform()
///     }
///     fn start_density(&self, _: &f64) -> f64 {
///         1.0
///     }
///     fn survival(&self) -> f64 {
///         0.75
///     }
/// }
/// assert_eq!(Interval.survival(), 1.0 - Interval.absorption(&0.5));
/// ```
#[diagnostic::on_unimplemented(
    message = "it is not known which density the chain of `{Self}` preserves",
    label = "`Stationary` is missing",
    note = "implement `Stationary` if starts of a known density have states of the same density: \
            the integral of p0(x) p(x, y) over x is s p0(y)"
)]
pub trait Stationary: Sampler {
    /// A point with the density p0, by inversion.
    fn start<U: Uniforms<Self::Scalar>>(&self, uniforms: &mut U) -> Self::Point;

    /// p0(x) > 0, with respect to μ.
    fn start_density(&self, x: &Self::Point) -> f64;

    /// s ∈ [0, 1): the probability that a walk of these starts has one state more.
    fn survival(&self) -> f64;
}
