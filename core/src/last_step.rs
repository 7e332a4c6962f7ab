//! The last step of a walk, drawn from the source.
//!
//! # The equation of what is left
//!
//! Let F = F_s + F_r, where F_s is large on a small part of X. With u = F_s + w,
//!
//! ```text
//! w = T_K w + T_K F_s + F_r.
//! ```
//!
//! Chain and kernel are those of u. A walk that scores in x_l, with the weight W_l = φ(x0) k … k (by collision in every state,
//! by absorption in the last one, over q there), needs the number (T_K F_s)(x_l) = ∫ K(x_l, y) F_s(y) dμ(y). A last step to the
//! source gives one with this mean, K(x_l, y) F_s(y)/l(x_l, y) for a y of density l(x_l, ·): [`Lights`]. Or it is
//! known, as what a point sees of a constant light is on the circle and in a room, and then nothing is drawn.
//!
//! # Its neighbour equation
//!
//! (50) of Heinrich 1995 holds for any v if G = v − T_hp v: neither h nor this G knows what the source of the equation is. So
//! the same h, the same kinds of pairs and the same way to draw G serve w, with a v ≈ w in place of one ≈ u. If F_s is in the
//! space of the ansatz, constant on cells say, no second system is solved: v = v_u − F_s is the Galerkin solution of w where v_u
//! is that of u, since (41) with F' from T_K F_s is (41) for v_u less F_s. Every estimate of G, drawn or not, has
//! the mean v − T_hp v, draws from numbers of its own, and is scored in the same states with the same weights as the last
//! step, so that η(h, g) has the mean (v, Φ), whatever v and whatever l, for both estimators and both forms.
//!
//! # What it gains
//!
//! In ζ a state scores S − G, where S is the last step, besides (k − h) v(x_{l+1}) in the residual form. In the product form
//! H_l − W_l multiplies all that is scored from x_l on.
//!
//! - Where h ≠ k, v_u brings F_s into both: rare and large, it makes most of the variance of a small source. v has none of it.
//! - Where h = k and S is exact, S − G = T_K F_s + F_r − v + T_k v = F − v_u + T_k v_u: to the number what it was for u. There
//!   a last step gains nothing yet: what is left of v_u is its error where T_K F_s is not smooth, in the edges of shadows and
//!   next to lights.
//! - The neighbour's last step has to go to the source, too. Let v = d + v_2, where d = T_K F_s is known in every point and v_2
//!   ≈ w − d is in the space of the ansatz. With h = k,
//!
//!   ```text
//!   S − G = F_r − v_2 + T_k (d + v_2),
//!   ```
//!
//!   in which d(x) itself is gone: v_2 need only follow what was reflected twice. T_k d at x is the mean of d(y) over steps to y,
//!   each followed by the last step from y. One step with a control variate that holds the means of d and v_2 over boxes of
//!   steps gives G with its exact mean: that is [`Sampled`](crate::sampled::Sampled).

use crate::galerkin::{Basis, Cells};
use crate::sampled::{SampledStep, StepEvents};
use crate::{Chain, Density, Equation, Located, NoDraws, Space, Start, StartOf, Uniforms, Value};

/// An equation whose source, or a part F_s of it, can be sampled: points y with a density l(x, y) that is large where
/// K(x, y) F_s(y) is. Lamps, the sun, the sky, bright arcs.
///
/// Where F is large on a small part of X only, few walks end there: "the last step of the walk should be modified in such a
/// way that x_m always hits a light source" (Heinrich 1995, section 5).
#[diagnostic::on_unimplemented(
    message = "the source of `{Self}` cannot be sampled",
    label = "`Lights` is missing",
    note = "implement `Lights`: a random number with mean (T_K F_s)(x), K(x, y) F_s(y)/l(x, y) of a y of density l, and F_s(x)"
)]
pub trait Lights: Equation {
    /// A random number whose mean is (T_K F_s)(x) = ∫ K(x, y) F_s(y) dμ(y).
    fn light<U: Uniforms<Self::Scalar>>(&self, x: &Self::Point, uniforms: &mut U) -> Self::Value;

    /// F_s(x): what is known of u where a target looks at a light.
    fn known(&self, x: &Self::Point) -> Self::Value;

    /// F − F_s: what walks score where they meet it.
    #[inline(always)]
    fn rest(&self, x: &Self::Point) -> Self::Value {
        self.source(x, &mut NoDraws).minus(&self.known(x))
    }

    /// The start of a walk of w = u − F_s for the mean of u over steps from x, as [`Equation::arriving`] is one of u: it knows a number with
    /// the mean ∫ p(x, y) F_s(y) dμ(y). By default F_s where the step leads.
    fn arriving_lit<U: Uniforms<Self::Scalar>>(
        &self,
        x: &Self::Point,
        uniforms: &mut U,
    ) -> StartOf<Self> {
        let start = self.arriving(x, uniforms);
        let known = self.known(&start.point).scaled(start.phi);
        Start { known, ..start }
    }
}

/// The equation w = T_K w + T_K F_s + F − F_s of w = u − F_s, with an estimate of T_K F_s by a last step to the source in every
/// state that scores. It has the chain and the kernel of the equation u = T_K u + F, and its cells.
///
/// (u, Φ) = (F_s, Φ) + (w, Φ), and (F_s, Φ) is known.
///
/// ```
/// use fredholm_core::{Chain, Equation, LastStep, Lights, NoDraws, Space, Uniforms};
///
/// /// u(x) = ½ ∫ u dy + F on [0, 1], where F = 1000 below 1/1000, and 0 elsewhere.
/// struct Lamp;
///
/// impl Space for Lamp {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl Chain for Lamp {
///     fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
///         Some(uniforms.uniform())
///     }
/// }
/// impl Equation for Lamp {
///     type Value = f64;
///     fn kernel(&self, _: &f64, _: &f64) -> f64 {
///         0.5
///     }
///     fn source<U: Uniforms<f64>>(&self, x: &f64, _: &mut U) -> f64 {
///         if *x < 1e-3 { 1000.0 } else { 0.0 }
///     }
/// }
/// impl Lights for Lamp {
///     // y uniform below 1/1000: l = 1000, K F/l = ½, whatever y.
///     fn light<U: Uniforms<f64>>(&self, _: &f64, _: &mut U) -> f64 {
///         0.5
///     }
///     fn known(&self, x: &f64) -> f64 {
///         self.source(x, &mut NoDraws)
///     }
/// }
///
/// // A walk scores at once what one of a thousand walks scored before.
/// assert_eq!(LastStep(&Lamp).source(&0.7, &mut NoDraws), 0.5);
/// ```
#[derive(Debug)]
pub struct LastStep<'a, E>(pub &'a E);

// By hand: a derive would ask the equation to be `Clone` and `Copy`.
impl<E> Clone for LastStep<'_, E> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<E> Copy for LastStep<'_, E> {}

impl<E: Space> Space for LastStep<'_, E> {
    type Scalar = E::Scalar;
    type Point = E::Point;
}

impl<E: Chain> Chain for LastStep<'_, E> {
    #[inline(always)]
    fn step<U: Uniforms<E::Scalar>>(&self, x: &E::Point, uniforms: &mut U) -> Option<E::Point> {
        self.0.step(x, uniforms)
    }
}

impl<E: Density> Density for LastStep<'_, E> {
    fn density(&self, x: &E::Point, y: &E::Point) -> E::Scalar {
        self.0.density(x, y)
    }
}

impl<E: Lights> Equation for LastStep<'_, E> {
    type Value = E::Value;

    #[inline(always)]
    fn kernel(&self, x: &E::Point, y: &E::Point) -> E::Value {
        self.0.kernel(x, y)
    }

    #[inline]
    fn source<U: Uniforms<E::Scalar>>(&self, x: &E::Point, uniforms: &mut U) -> E::Value {
        self.0.rest(x).plus(&self.0.light(x, uniforms))
    }

    #[inline(always)]
    fn channels(&self) -> usize {
        self.0.channels()
    }

    #[inline(always)]
    fn size(&self, x: &E::Point) -> E::Scalar {
        self.0.size(x)
    }

    fn arriving<U: Uniforms<E::Scalar>>(&self, x: &E::Point, uniforms: &mut U) -> StartOf<Self> {
        self.0.arriving_lit(x, uniforms)
    }
}

impl<E: Cells> Cells for LastStep<'_, E> {
    const DIMENSION: usize = E::DIMENSION;

    fn cells(&self) -> usize {
        self.0.cells()
    }
    #[inline]
    fn locate(&self, x: &E::Point) -> usize {
        self.0.locate(x)
    }
    fn measure(&self, cell: usize) -> f64 {
        self.0.measure(cell)
    }
    fn point(&self, cell: usize, t: &[f64]) -> E::Point {
        self.0.point(cell, t)
    }
    fn parameters(&self, x: &Located<E::Point>, t: &mut [E::Scalar]) {
        self.0.parameters(x, t);
    }
    fn at(&self, coordinates: &[f64]) -> Option<E::Point> {
        self.0.at(coordinates)
    }

    #[inline]
    fn copies(&self) -> usize {
        self.0.copies()
    }
}

impl<E: Basis<B>, const B: usize> Basis<B> for LastStep<'_, E> {
    #[inline]
    fn basis(&self, x: &Located<E::Point>) -> [E::Scalar; B] {
        self.0.basis(x)
    }
}

impl<E: StepEvents<D>, const D: usize> StepEvents<D> for LastStep<'_, E> {
    fn towards(&self, cell: usize) -> Option<u32> {
        self.0.towards(cell)
    }
    #[inline]
    fn probability(&self, x: &E::Point, event: u32) -> E::Scalar {
        self.0.probability(x, event)
    }
    #[inline]
    fn occurring(&self, step: &SampledStep<'_, E::Point, E::Scalar, D>, events: &[u32]) -> u32 {
        self.0.occurring(step, events)
    }
}
