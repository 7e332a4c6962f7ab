//! The last step of a walk, drawn from the source.

use num_traits::zero;

use crate::galerkin::{Basis, CellMap, Partition};
use crate::{Kernel, Located, RandomSource, Sampler, StateSpace, TransitionDensity, Uniforms};

/// An equation whose source, or a part F_s of it, can be sampled: points y with a density l(x, y) that is large where
/// K(x, y) F_s(y) is.
///
/// Where F is large on a small part of X only, few walks end there: "the last step of the walk should be modified in such a
/// way that x_m always hits a light source" (Heinrich 1995, section 5).
#[diagnostic::on_unimplemented(
    message = "the source of `{Self}` cannot be sampled",
    label = "`SourceSampler` is missing",
    note = "implement `SourceSampler`: a random number with mean (T_K F)(x), K(x, y) F(y)/l(x, y) of a y of density l"
)]
pub trait SourceSampler: Sampler + Kernel {
    /// A random number whose mean is (T_K F_s)(x) = ∫ K(x, y) F_s(y) dμ(y).
    fn sample_last_step<U: Uniforms<Self::Scalar>>(
        &self,
        x: &Self::Point,
        uniforms: &mut U,
    ) -> Self::Scalar;

    /// F − F_s: what walks score where they meet it. 0 if all of F is sampled.
    #[inline(always)]
    fn rest_of_source(&self, x: &Self::Point) -> Self::Scalar {
        let _ = x;
        zero()
    }
}

/// The equation w = T_K w + T_K F_s + F − F_s of w = u − F_s, with an estimate of T_K F_s by a last step to the source in every
/// state that scores. It has the chain and the kernel of the equation u = T_K u + F, and its cells.
///
/// (u, Φ) = (F_s, Φ) + (w, Φ), and (F_s, Φ) is known.
///
/// ```
/// use fredholm_core::{Kernel, LastStep, RandomSource, Sampler, SourceSampler, StateSpace, Uniforms};
///
/// /// u(x) = ½ ∫ u dy + F on [0, 1], where F = 1000 below 1/1000, and 0 elsewhere.
/// struct Lamp;
///
/// impl StateSpace for Lamp {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl Sampler for Lamp {
///     fn absorption(&self, _: &f64) -> f64 {
///         0.5
///     }
///     fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
///         Some(uniforms.uniform())
///     }
/// }
/// impl Kernel for Lamp {
///     fn kernel(&self, _: &f64, _: &f64) -> f64 {
///         1.0
///     }
/// }
/// impl SourceSampler for Lamp {
///     // y uniform below 1/1000: l = 1000, K F/l = ½, whatever y.
///     fn sample_last_step<U: Uniforms<f64>>(&self, _: &f64, _: &mut U) -> f64 {
///         0.5
///     }
/// }
///
/// struct NoNumbers;
/// impl Uniforms<f64> for NoNumbers {
///     fn uniform(&mut self) -> f64 {
///         f64::NAN
///     }
/// }
/// // A walk that is absorbed at once scores what one of a thousand walks scored before.
/// assert_eq!(LastStep(&Lamp).sample_source(&0.7, &mut NoNumbers), 0.5);
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

impl<E: StateSpace> StateSpace for LastStep<'_, E> {
    type Scalar = E::Scalar;
    type Point = E::Point;
}

impl<E: Sampler> Sampler for LastStep<'_, E> {
    #[inline(always)]
    fn absorption(&self, x: &E::Point) -> E::Scalar {
        self.0.absorption(x)
    }
    #[inline(always)]
    fn step<U: Uniforms<E::Scalar>>(&self, x: &E::Point, uniforms: &mut U) -> Option<E::Point> {
        self.0.step(x, uniforms)
    }
}

impl<E: TransitionDensity> TransitionDensity for LastStep<'_, E> {
    fn density(&self, x: &E::Point, y: &E::Point) -> E::Scalar {
        self.0.density(x, y)
    }
}

impl<E: Kernel> Kernel for LastStep<'_, E> {
    #[inline(always)]
    fn kernel(&self, x: &E::Point, y: &E::Point) -> E::Scalar {
        self.0.kernel(x, y)
    }
}

impl<E: SourceSampler> RandomSource for LastStep<'_, E> {
    #[inline]
    fn sample_source<U: Uniforms<E::Scalar>>(&self, x: &E::Point, uniforms: &mut U) -> E::Scalar {
        self.0.rest_of_source(x) + self.0.sample_last_step(x, uniforms)
    }
}

impl<E: Partition> Partition for LastStep<'_, E> {
    fn cells(&self) -> usize {
        self.0.cells()
    }
    #[inline]
    fn locate(&self, x: &E::Point) -> usize {
        self.0.locate(x)
    }
}

impl<E: Basis<B>, const B: usize> Basis<B> for LastStep<'_, E> {
    #[inline]
    fn basis(&self, x: &Located<E::Point>) -> [E::Scalar; B] {
        self.0.basis(x)
    }
}

impl<E: CellMap> CellMap for LastStep<'_, E> {
    const DIMENSION: usize = E::DIMENSION;

    fn measure(&self, cell: usize) -> f64 {
        self.0.measure(cell)
    }
    fn point(&self, cell: usize, t: &[f64]) -> E::Point {
        self.0.point(cell, t)
    }
    fn at(&self, coordinates: &[f64]) -> Option<E::Point> {
        self.0.at(coordinates)
    }
}
