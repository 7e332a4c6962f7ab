//! Starts of walks, and chains that preserve their density.

use crate::{Space, Uniforms};

/// Starts of a known density p0 for the walks of an equation `E`, and whether its chain preserves that density:
/// ∫ p0(x) p(x,y) dμ(x) = p0(y).
///
/// Uniform starts and a symmetric p with integral 1 are the common case, with p0 = 1/μ(X): the circle,
/// uniform steps on a cube, closed rooms with cosine-distributed directions, spheres. Then every state of a walk is scored.
/// Where walks leave the space there is in general no such p0 that is known. Then the starts alone are scored.
///
/// It is a fact that a problem states: if it is wrong, every result from suffixes is biased. The conformance kit's checks
/// "preserved density" and "suffix starts" find that out.
///
/// ```
/// use fredholm_core::global::Stationary;
/// use fredholm_core::{Chain, Space, Uniforms};
///
/// /// Uniform steps on [0, 1).
/// struct Interval;
/// impl Space for Interval {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl Chain for Interval {
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
///     fn is_preserved(&self) -> bool {
///         true
///     }
/// }
/// assert!(Interval.is_preserved());
/// ```
#[diagnostic::on_unimplemented(
    message = "it is not known with which density walks of `{E}` start from `{Self}`",
    label = "`Stationary` is missing",
    note = "implement `Stationary`: a point with the density p0, that density, and whether the integral of p0(x) p(x, y) over x \
            is p0(y)"
)]
pub trait Stationary<E: Space + ?Sized = Self> {
    /// A point with the density p0, by inversion.
    fn start<U: Uniforms<E::Scalar>>(&self, uniforms: &mut U) -> E::Point;

    /// p0(x) > 0, with respect to μ.
    fn start_density(&self, x: &E::Point) -> f64;

    /// Whether the chain preserves p0. If it does not, or if it is not known, starts alone are scored.
    fn is_preserved(&self) -> bool;
}
