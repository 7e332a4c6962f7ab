//! Several equations on one chain: colours, or bands of wavelengths.
//!
//! The equations of C channels differ in the sizes of kernel and source alone,
//!
//! ```text
//! u_c(x) = r_c(x) ∫ K(x, y) u_c(y) dμ(y) + F_c(x),    c = 0, …, C − 1,
//! ```
//!
//! so that one walk serves all of them: its steps have the density p whatever the channel, and its weights are
//! W_c = φ(x0) r_c(x0) k(x0, x1) … r_c(x_{l−1}) k(x_{l−1}, x_l). The neighbour equations are such that h_c = k_c,
//! v_c = T_kc v_c + G_c, and share the draws of G. A step is made once, and what a further channel takes are some products.
//!
//! Heinrich 1995, section 5, treats colours "by superposition": as many runs. Scores of a walk in several channels depend on
//! each other, so that errors of a sum of channels do not follow from those of the channels. A weighted sum is a
//! functional more, with statistics of its own: luminance, or the flux of all bands.

mod goals;

use num_traits::zero;

use crate::{Functional, Kernel, Located, NoNeighbour, Sampler, StateSpace, Uniforms};

pub use goals::{ChannelGoal, ChannelGoals};

/// The most channels of a walk.
pub const MOST_CHANNELS: usize = 128;

/// Equations on one chain: the chain and the kernel that all share, and what of each channel is its own.
///
/// What is written goes into slices of as many numbers as there are channels.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no channels",
    label = "`Channels` is missing",
    note = "implement `Channels`: the factors r_c(x) of the kernel, and the sources F_c(x)"
)]
pub trait Channels: Sampler + Kernel {
    /// C, from 1 to [`MOST_CHANNELS`].
    fn channels(&self) -> usize;

    /// r_c(x) of every channel: K_c(x, y) = r_c(x) K(x, y).
    fn factors(&self, x: &Self::Point, factors: &mut [Self::Scalar]);

    /// Random numbers whose means are F_c(x), or what of it walks score where they meet it.
    fn sample_sources<U: Uniforms<Self::Scalar>>(
        &self,
        x: &Self::Point,
        uniforms: &mut U,
        sources: &mut [Self::Scalar],
    );
}

/// A functional of the solutions of all channels: where walks start, and what each start knows besides.
pub trait ChannelFunctional<E: Channels> {
    /// A point x0 with density p0, and φ(x0), as [`Functional::start`] has them. Writes, for every channel, a random number: what
    /// the start adds to what the walk scores, over φ(x0). It is the part of the functional that no state scores, as where a
    /// last step leads to it.
    fn start<U: Uniforms<E::Scalar>>(
        &self,
        equations: &E,
        uniforms: &mut U,
        known: &mut [E::Scalar],
    ) -> (E::Point, E::Scalar);

    /// A further point with density p0, and φ there, for [`looks`](Self::looks): a start without what it knows.
    fn look<U: Uniforms<E::Scalar>>(
        &self,
        equations: &E,
        uniforms: &mut U,
    ) -> (E::Point, E::Scalar) {
        let mut known = [zero(); MOST_CHANNELS];
        let channels = equations.channels().min(MOST_CHANNELS);
        let known = known.get_mut(..channels).unwrap_or(&mut []);
        self.start(equations, uniforms, known)
    }

    /// The number of points by which a walk estimates (v, Φ) where that is not known: its start, and further ones. The more,
    /// the less of φ v's own variance is left in that of ζ.
    fn looks(&self) -> u32 {
        1
    }
}

impl<E: Channels, T: ChannelFunctional<E>> ChannelFunctional<E> for &T {
    #[inline]
    fn start<U: Uniforms<E::Scalar>>(
        &self,
        equations: &E,
        uniforms: &mut U,
        known: &mut [E::Scalar],
    ) -> (E::Point, E::Scalar) {
        (**self).start(equations, uniforms, known)
    }

    #[inline]
    fn look<U: Uniforms<E::Scalar>>(
        &self,
        equations: &E,
        uniforms: &mut U,
    ) -> (E::Point, E::Scalar) {
        (**self).look(equations, uniforms)
    }

    #[inline]
    fn looks(&self) -> u32 {
        (**self).looks()
    }
}

/// A functional whose starts know nothing besides.
#[derive(Clone, Copy, Debug)]
pub struct NothingKnown<T>(pub T);

impl<E: Channels, T: Functional<E>> ChannelFunctional<E> for NothingKnown<T> {
    #[inline]
    fn start<U: Uniforms<E::Scalar>>(
        &self,
        _: &E,
        uniforms: &mut U,
        known: &mut [E::Scalar],
    ) -> (E::Point, E::Scalar) {
        known.fill(zero());
        self.0.start(uniforms)
    }
}

/// Neighbour equations v_c = T_kc v_c + G_c of every channel, which hold exactly, on one partition.
///
/// What is written goes into slices of as many numbers as there are channels.
pub trait ChannelNeighbours: StateSpace {
    /// Finds the cell of `x`.
    fn locate(&self, x: Self::Point) -> Located<Self::Point>;

    /// G_c(x), or random numbers with these means, which all may depend on the same `draws`.
    fn sources(
        &self,
        x: &Located<Self::Point>,
        draws: &mut dyn Uniforms<Self::Scalar>,
        sources: &mut [Self::Scalar],
    );

    /// v_c(x).
    fn values(&self, x: &Located<Self::Point>, values: &mut [Self::Scalar]);
}

/// v = 0 in every channel: the walks are plain.
impl<E: StateSpace> ChannelNeighbours for NoNeighbour<E> {
    #[inline]
    fn locate(&self, x: E::Point) -> Located<E::Point> {
        Located { point: x, cell: 0 }
    }

    #[inline]
    fn sources(
        &self,
        _: &Located<E::Point>,
        _: &mut dyn Uniforms<E::Scalar>,
        sources: &mut [E::Scalar],
    ) {
        sources.fill(zero());
    }

    #[inline]
    fn values(&self, _: &Located<E::Point>, values: &mut [E::Scalar]) {
        values.fill(zero());
    }
}

#[cfg(test)]
mod tests;
