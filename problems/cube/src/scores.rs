//! Functions on cells whose degree is known at run time, for scores of a global estimate and for weights.

use fredholm_core::array::Each;
use fredholm_core::galerkin::{functions, legendre};
use fredholm_core::global::Scores;
use fredholm_core::{Located, Real};

use crate::functions::{Axis, PER_AXIS, add_products, degrees, sum_products};
use crate::mesh::Mesh;
use crate::{Cube, CubeError};

/// All functions of total degree ≤ p on the cells of a cube: those of [`Cube`], in the same order, with p known at run time.
///
/// ```
/// use fredholm_core::global::Scores;
/// use fredholm_cube::{Cube, CubeScores};
///
/// let cube = Cube::<f64, 2, _, _>::new(|_: &[f64; 2], _: &[f64; 2]| 0.5, |_: &[f64; 2]| 1.0, 8)?;
/// let scores = CubeScores::new(&cube, 3)?;
/// assert_eq!(Scores::<[f64; 2]>::unknowns(&scores), 640);
/// # Ok::<(), fredholm_cube::CubeError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct CubeScores<const D: usize> {
    mesh: Mesh<D>,
    degree: usize,
    functions: usize,
}

impl<const D: usize> CubeScores<D> {
    /// The largest degree that there is.
    pub const MOST_DEGREE: usize = PER_AXIS - 1;

    /// The functions of this total degree or less.
    ///
    /// # Errors
    /// [`CubeError::Points`]: the degree is above [`MOST_DEGREE`](Self::MOST_DEGREE).
    pub fn new<F: Real, K, S, const B: usize>(
        cube: &Cube<F, D, K, S, B>,
        degree: usize,
    ) -> Result<Self, CubeError> {
        if degree > Self::MOST_DEGREE {
            return Err(CubeError::Points);
        }
        Ok(Self {
            mesh: cube.mesh(),
            degree,
            functions: functions(D, degree),
        })
    }

    /// The number B of functions on a cell.
    #[must_use]
    pub const fn functions(&self) -> usize {
        self.functions
    }

    /// The number n·B of coefficients.
    #[must_use]
    pub const fn unknowns(&self) -> usize {
        self.mesh.cells().saturating_mul(self.functions)
    }

    /// The value at a point of a piecewise polynomial with n·B coefficients; NaN if there are fewer.
    #[must_use]
    pub fn value<F: Real, C: Real>(&self, x: &Located<[F; D]>, coefficients: &[C]) -> f64 {
        let start = x.cell.saturating_mul(self.functions);
        let own = coefficients.get(start..start.saturating_add(self.functions));
        own.map_or(f64::NAN, |own| {
            sum_products(&self.axes(x), self.degree, &mut own.iter())
        })
    }

    /// The polynomials along every axis at a point.
    #[inline]
    fn axes<F: Real>(&self, x: &Located<[F; D]>) -> [Axis; D] {
        let x = Located {
            point: x.point.each(Real::to_f64),
            cell: x.cell,
        };
        self.mesh.local(&x).each(|t| legendre(t + t - 1.0))
    }

    /// Writes a piecewise polynomial of a lower degree, n blocks of coefficients, as one of these functions. What there
    /// are no coefficients for stays as it is.
    pub fn embed(&self, degree: usize, from: &[f64], to: &mut [f64]) {
        let mut from = from.iter();
        for block in to.chunks_exact_mut(self.functions) {
            let low = block.iter_mut().zip(degrees::<D>(self.degree));
            let low = low.filter(|(_, total)| *total <= degree);
            for ((to, _), from) in low.zip(&mut from) {
                *to = *from;
            }
        }
    }
}

impl<F: Real, const D: usize> Scores<[F; D]> for CubeScores<D> {
    fn unknowns(&self) -> usize {
        Self::unknowns(self)
    }

    fn functions(&self) -> usize {
        self.functions
    }

    #[inline]
    fn add(&self, x: &Located<[F; D]>, score: f64, sums: &mut [f64]) {
        let start = x.cell * self.functions;
        if let Some(own) = sums.get_mut(start..start + self.functions) {
            add_products(&self.axes(x), self.degree, score, &mut own.iter_mut());
        }
    }

    fn value(&self, x: &Located<[F; D]>, coefficients: &[f64]) -> f64 {
        Self::value(self, x, coefficients)
    }
}

#[cfg(test)]
mod tests {
    use fredholm_core::Located;
    use fredholm_core::galerkin::{Basis, Cells, functions};
    use fredholm_core::global::Scores;

    use super::CubeScores;
    use crate::{Cube, CubeError};

    fn check<const D: usize, const B: usize>(degree: usize) {
        let kernel = |_: &[f64; D], _: &[f64; D]| 0.5;
        let cube = Cube::<f64, D, _, _>::new(kernel, |_: &[f64; D]| 1.0, 3).unwrap();
        let cube = cube.with_functions::<B>();
        let scores = CubeScores::new(&cube, degree).unwrap();
        assert_eq!((scores.functions(), cube.degree()), (B, degree));
        let point = core::array::from_fn(|a| 0.05 + 0.27 * a as f64);
        let cell = cube.locate(&point);
        let x = Located { point, cell };
        let mut sums = [0.0; 300];
        scores.add(&x, 2.0, &mut sums);
        let expected = cube.basis(&x);
        for (found, expected) in sums[cell * B..][..B].iter().zip(expected) {
            assert!((found - 2.0 * expected).abs() < 1e-14 * (1.0 + expected.abs()));
        }
        // Σ ψ² over the functions, by the polynomial that has these coefficients.
        let square: f64 = expected.iter().map(|psi| psi * psi).sum();
        let found = scores.value(&x, &sums);
        assert!(
            (found - 2.0 * square).abs() < 1e-13 * square,
            "{found} {square}"
        );
        assert!(sums[(cell + 1) * B..].iter().all(|sum| *sum == 0.0));
    }

    #[test]
    fn they_are_the_functions_of_the_cube() {
        check::<1, 1>(0);
        check::<1, 8>(7);
        check::<2, { functions(2, 4) }>(4);
        check::<3, { functions(3, 2) }>(2);
    }

    #[test]
    fn a_lower_degree_is_one_of_them() {
        let kernel = |_: &[f64; 2], _: &[f64; 2]| 0.5;
        let cube = Cube::<f64, 2, _, _>::new(kernel, |_: &[f64; 2]| 1.0, 1).unwrap();
        assert_eq!(CubeScores::new(&cube, 8).err(), Some(CubeError::Points));
        let scores = CubeScores::new(&cube, 2).unwrap();
        // 1, y, y², x, xy, x².
        let mut to = [0.0; 6];
        scores.embed(1, &[3.0, 4.0, 5.0], &mut to);
        assert_eq!(to, [3.0, 4.0, 0.0, 5.0, 0.0, 0.0]);
        scores.embed(0, &[7.0], &mut to);
        assert_eq!(to, [7.0, 4.0, 0.0, 5.0, 0.0, 0.0]);
    }
}
