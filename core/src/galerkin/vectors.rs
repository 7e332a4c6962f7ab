//! What a solved system hands to its walks.

use alloc::vec::Vec;

use super::{
    Coefficients, GalerkinError, GalerkinMatrix, PairIntegral, Pairs, Piecewise, PointwiseSource,
    Solution, SourceTable, TransitionMoments,
};
use crate::{Equation, Real, Space};

/// v and G of a neighbour equation in the scalar of its walks, and the pairs to which G belongs.
///
/// ```
/// use fredholm_core::galerkin::{Dense, DiagonalRule, PairKind, Solution};
///
/// let table = [0.1, 0.2, 0.3, 0.4];
/// let matrix = Dense::new(&table, 2, 1).unwrap();
/// let solution = Solution::new(&matrix, vec![1.0, 2.0], 1e-15, 100)?;
/// let pairs = DiagonalRule { diagonal: PairKind::Dropped };
/// let vectors = solution.for_walks::<f32, _>(&matrix, pairs)?;
/// assert_eq!(vectors.v()[0], (1.0 / 0.48) as f32);
/// // The diagonal is left out, so that G has what it brings.
/// let g = 1.0 + 0.1 * f64::from(vectors.v()[0]);
/// assert!((f64::from(vectors.source()[0]) - g).abs() < 1e-6);
/// # Ok::<(), fredholm_core::galerkin::GalerkinError>(())
/// ```
#[derive(Clone, Debug)]
pub struct NeighbourVectors<F, S> {
    v: Vec<F>,
    source: Vec<F>,
    pairs: S,
}

/// The neighbour equation of [`NeighbourVectors::piecewise`].
pub type WithoutPointwise<'a, F, P, C, S, const B: usize> =
    Piecewise<'a, F, P, C, S, SourceTable<'a, F, P, B>, B>;

/// The neighbour equation of [`NeighbourVectors::with_pointwise`].
pub type WithPointwise<'a, F, P, C, S, const B: usize> =
    Piecewise<'a, F, P, C, S, PointwiseSource<'a, F, P, S, B>, B>;

impl Solution {
    /// v rounded to the walk's scalar, and G computed in f64 from v as rounded, then rounded: in this order the
    /// walks' neighbour equation holds for the v that they see.
    ///
    /// # Errors
    /// As [`Solution::source`].
    pub fn for_walks<F: Real, S: Pairs>(
        &self,
        matrix: &dyn GalerkinMatrix<Scalar = f64>,
        pairs: S,
    ) -> Result<NeighbourVectors<F, S>, GalerkinError> {
        Ok(NeighbourVectors {
            v: self.rounded()?,
            source: self.source(matrix, &pairs)?,
            pairs,
        })
    }
}

impl<F: Real, S: Pairs + Copy> NeighbourVectors<F, S> {
    /// v_ia.
    #[must_use]
    pub fn v(&self) -> &[F] {
        &self.v
    }

    /// G_ia over S.
    #[must_use]
    pub fn source(&self) -> &[F] {
        &self.source
    }

    /// The pairs.
    #[must_use]
    pub const fn pairs(&self) -> S {
        self.pairs
    }

    /// The neighbour equation, with pairs that are in S or left out.
    ///
    /// # Errors
    /// As [`Piecewise::new`].
    pub fn piecewise<'a, P, C, const B: usize>(
        &'a self,
        problem: &'a P,
        coefficients: &'a C,
    ) -> Result<WithoutPointwise<'a, F, P, C, S, B>, GalerkinError>
    where
        P: TransitionMoments<B> + Space<Scalar = F>,
        C: Coefficients<B, Scalar = F>,
    {
        Piecewise::new(problem, coefficients, self.pairs, &self.v, &self.source)
    }

    /// The neighbour equation, with pairs of any kind.
    ///
    /// # Errors
    /// As [`Piecewise::with_pointwise`].
    pub fn with_pointwise<'a, P, C, const B: usize>(
        &'a self,
        problem: &'a P,
        coefficients: &'a C,
    ) -> Result<WithPointwise<'a, F, P, C, S, B>, GalerkinError>
    where
        P: TransitionMoments<B> + PairIntegral<B> + Equation<Scalar = F, Value = F>,
        C: Coefficients<B, Scalar = F>,
    {
        Piecewise::with_pointwise(problem, coefficients, self.pairs, &self.v, &self.source)
    }
}
