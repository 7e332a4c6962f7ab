//! Starts of walks, and chains that preserve their density.

use crate::{StateSpace, Uniforms};

/// Starts of a known density p0 for the walks of an equation `E`, and whether its chain preserves that density, thinned by
/// absorption: ∫ p0(x) p(x,y) dμ(x) = s p0(y).
///
/// Uniform starts and a symmetric p with a constant q are the common case, with p0 = 1/μ(X) and s = 1 − q: the circle,
/// uniform steps on a cube, closed rooms with cosine-distributed directions, spheres. Then every state of a walk is scored.
/// Where walks leave the space, or q differs from place to place, there is in general no such p0 that is known. Then the
/// starts alone are scored, unless the [density of all states](Self::density_of_states) is known.
///
/// It is a fact that a problem states: if it is wrong, every result from suffixes is biased. The conformance kit's checks
/// "preserved density" and "suffix starts" find that out.
///
/// ```
/// use fredholm_core::whole::Starts;
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
/// impl Starts for Interval {
///     fn start<U: Uniforms<f64>>(&self, uniforms: &mut U) -> f64 {
///         uniforms.uniform()
///     }
///     fn start_density(&self, _: &f64) -> f64 {
///         1.0
///     }
///     fn survival(&self) -> Option<f64> {
///         Some(0.75)
///     }
/// }
/// assert_eq!(Interval.survival(), Some(1.0 - Interval.absorption(&0.5)));
/// ```
#[diagnostic::on_unimplemented(
    message = "it is not known with which density walks of `{E}` start from `{Self}`",
    label = "`Starts` is missing",
    note = "implement `Starts`: a point with the density p0, that density, and s if the integral of p0(x) p(x, y) over x \
            is s p0(y)"
)]
pub trait Starts<E: StateSpace + ?Sized = Self> {
    /// A point with the density p0, by inversion.
    fn start<U: Uniforms<E::Scalar>>(&self, uniforms: &mut U) -> E::Point;

    /// p0(x) > 0, with respect to μ.
    fn start_density(&self, x: &E::Point) -> f64;

    /// s ∈ [0, 1), the probability that a walk of these starts has one state more, if the chain preserves p0. `None`: it does
    /// not, or nobody knows.
    fn survival(&self) -> Option<f64>;

    /// The density of the first `most` states of a walk together, p0(x) for the start, then that of the next state, and so on,
    /// if it is known of a chain that preserves none. At all points or at none; by default at none.
    fn density_of_states(&self, x: &E::Point, most: usize) -> Option<f64> {
        let _ = (x, most);
        None
    }
}
