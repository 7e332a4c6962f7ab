//! The functions on whose coefficients walks score.

use crate::Located;
use crate::array::Each;
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

    /// The sum at `x` of every function times its coefficient. NaN where `coefficients` is too short.
    fn value(&self, x: &Located<P>, coefficients: &[f64]) -> f64;
}

/// Σ c ψ of the functions on one cell, in their order.
#[inline(always)]
#[must_use]
pub fn sum_of<const B: usize>(coefficients: &[f64], psi: [f64; B]) -> f64 {
    let terms = coefficients.iter().zip(psi);
    terms.fold(0.0, |sum, (c, psi)| sum + c * psi)
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

    #[inline]
    fn value(&self, x: &Located<T::Point>, coefficients: &[f64]) -> f64 {
        use crate::Real;
        let start = x.cell * B;
        let Some(own) = coefficients.get(start..start + B) else {
            return f64::NAN;
        };
        sum_of(own, self.0.basis(x).each(Real::to_f64))
    }
}

/// The adjoint images T_K*Φ of some functionals, in place of polynomials: exactly (e, T_K*Φ) of each.
///
/// With e = u − v is (u, Φ) = (F + T_K v, Φ) + (e, T_K*Φ). For u(x) the image is K(x, ·), for a mean the mean of K(x, ·)
/// over x. A walk costs one value of every image in each state that is scored, and nothing is lost by a projection: the
/// estimate is unbiased whatever the cells.
///
/// All functionals share one cell of measure 1, so that [`Normalisation`](super::Normalisation) makes estimates of sums.
///
/// ```
/// use fredholm_core::Located;
/// use fredholm_core::global::{AdjointScores, Scores};
///
/// // u(0.3), and the mean of u over [0, 1), of the kernel K = x + y.
/// let point = |y: &Located<f64>| 0.3 + y.point;
/// let mean = |y: &Located<f64>| 0.5 + y.point;
/// let scores = AdjointScores(&[&point, &mean]);
/// let mut sums = [0.0; 2];
/// scores.add(&Located { point: 0.2, cell: 7 }, 2.0, &mut sums);
/// assert_eq!(sums, [1.0, 1.4]);
/// ```
#[derive(Clone, Copy)]
pub struct AdjointScores<'a, P>(pub &'a [&'a AdjointImage<'a, P>]);

/// T_K*Φ as a function of y.
pub type AdjointImage<'a, P> = dyn Fn(&Located<P>) -> f64 + Sync + 'a;

impl<P> core::fmt::Debug for AdjointScores<'_, P> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_tuple("AdjointScores").field(&self.0.len()).finish()
    }
}

impl<P> Scores<P> for AdjointScores<'_, P> {
    fn unknowns(&self) -> usize {
        self.0.len()
    }

    fn functions(&self) -> usize {
        self.0.len()
    }

    fn add(&self, x: &Located<P>, score: f64, sums: &mut [f64]) {
        for (sum, image) in sums.iter_mut().zip(self.0) {
            *sum += score * image(x);
        }
    }

    fn value(&self, x: &Located<P>, coefficients: &[f64]) -> f64 {
        let Some(own) = coefficients.get(..self.0.len()) else {
            return f64::NAN;
        };
        let terms = own.iter().zip(self.0);
        terms.map(|(c, image)| c * image(x)).sum()
    }
}
