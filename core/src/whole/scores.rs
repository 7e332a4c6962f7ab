//! The functions on whose coefficients walks score.

use crate::Located;
use crate::galerkin::Basis;

/// Functions of points P, some on every cell, on whose coefficients walks score. It is object safe.
///
/// They need not be those of v: cells are those of the neighbour equation, the degree is larger.
pub trait Scores<P> {
    /// The number of coefficients, of all cells together.
    fn unknowns(&self) -> usize;

    /// The number of functions on a cell.
    fn functions(&self) -> usize;

    /// Adds `score` times every function at `x` to its place in `sums`. Where `sums` is too short nothing is added.
    fn add(&self, x: &Located<P>, score: f64, sums: &mut [f64]);
}

/// The B functions on every cell of a problem, as [`Basis`] has them.
#[derive(Clone, Copy, Debug)]
pub struct BasisScores<'a, T, const B: usize>(pub &'a T);

impl<T: Basis<B>, const B: usize> Scores<T::Point> for BasisScores<'_, T, B> {
    fn unknowns(&self) -> usize {
        self.0.cells() * B
    }

    fn functions(&self) -> usize {
        B
    }

    #[inline]
    fn add(&self, x: &Located<T::Point>, score: f64, sums: &mut [f64]) {
        use crate::Real;
        let start = x.cell * B;
        let Some(sums) = sums.get_mut(start..start + B) else {
            return;
        };
        for (sum, psi) in sums.iter_mut().zip(self.0.basis(x)) {
            *sum += score * psi.to_f64();
        }
    }
}
