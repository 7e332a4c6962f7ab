//! The neighbour equation of a piecewise polynomial Galerkin solution.

use num_traits::zero;

use super::{Coefficients, GalerkinError, PairIntegral, PairKind, Pairs, TransitionMoments, small};
use crate::{Located, Neighbour, Real, StateSpace};

/// The neighbour equation that a Galerkin solution of B unknowns per cell solves exactly: one
/// struct for every degree, whose first case B = 1 is (44)–(50) of Heinrich 1995.
///
/// Made of the problem (cells, basis, exact moments), the coefficients K', the pairs, the solution
/// v and the source G of [`neighbour_source`](super::neighbour_source).
#[derive(Clone, Copy, Debug)]
pub struct Piecewise<'a, F, P, C, S, const B: usize = 1> {
    problem: &'a P,
    coefficients: &'a C,
    pairs: S,
    solution: &'a [F],
    source: &'a [F],
}

impl<'a, F, P, C, S, const B: usize> Piecewise<'a, F, P, C, S, B>
where
    F: Real,
    P: TransitionMoments<B> + PairIntegral<B> + StateSpace<Scalar = F>,
    C: Coefficients<B, Scalar = F>,
    S: Pairs,
{
    /// `solution` is v, `source` is G, both of n·B entries.
    ///
    /// # Errors
    /// [`GalerkinError::Length`]: coefficients or a vector have another size than the partition.
    pub fn new(
        problem: &'a P,
        coefficients: &'a C,
        pairs: S,
        solution: &'a [F],
        source: &'a [F],
    ) -> Result<Self, GalerkinError> {
        let expected = problem.cells() * B;
        for found in [coefficients.cells() * B, solution.len(), source.len()] {
            if found != expected {
                return Err(GalerkinError::Length { expected, found });
            }
        }
        Ok(Self {
            problem,
            coefficients,
            pairs,
            solution,
            source,
        })
    }
}

impl<F: Real, P: StateSpace<Scalar = F>, C, S, const B: usize> StateSpace
    for Piecewise<'_, F, P, C, S, B>
{
    type Scalar = F;
    type Point = P::Point;
}

impl<F, P, C, S, const B: usize> Neighbour for Piecewise<'_, F, P, C, S, B>
where
    F: Real,
    P: TransitionMoments<B> + PairIntegral<B> + StateSpace<Scalar = F>,
    C: Coefficients<B, Scalar = F>,
    S: Pairs,
{
    #[inline]
    fn locate(&self, x: P::Point) -> Located<P::Point> {
        Located {
            point: x,
            cell: self.problem.locate(&x),
        }
    }

    #[inline]
    fn kernel(&self, x: &Located<P::Point>, y: &Located<P::Point>, k: F) -> F {
        match self.pairs.kind(x.cell, y.cell) {
            PairKind::Galerkin => {
                let left = self.problem.basis(x);
                let right = self.coefficients.contract(x.cell, y.cell, &left);
                let c = small::solve(self.problem.moments(x, y.cell), right);
                small::dot(&c, &self.problem.basis(y))
            }
            PairKind::Pointwise => k,
            PairKind::None => zero(),
        }
    }

    #[inline]
    fn source(&self, x: &Located<P::Point>) -> F {
        let mut g = small::dot(&small::block(self.source, x.cell), &self.problem.basis(x));
        for j in self.pairs.pointwise(x.cell, self.problem.cells()) {
            let v = small::block(self.solution, j);
            g -= small::dot(&v, &self.problem.pair_integral(x, j));
        }
        g
    }

    #[inline]
    fn value(&self, x: &Located<P::Point>) -> F {
        small::dot(&small::block(self.solution, x.cell), &self.problem.basis(x))
    }
}
