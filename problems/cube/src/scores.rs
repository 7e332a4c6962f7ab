//! Functions on cells whose degree is known at run time, for scores of a whole function.

use core::iter::repeat_n;
use core::marker::PhantomData;
use core::slice::{Iter, IterMut};

use fredholm_core::array::from_fn;
use fredholm_core::galerkin::legendre;
use fredholm_core::whole::Scores;
use fredholm_core::{Located, Real};

use crate::mesh::Mesh;
use crate::{Cube, functions};

/// p + 1 for the largest degree that there is.
pub(crate) const PER_AXIS: usize = 8;

/// The polynomials along an axis at one place.
pub(crate) type Axis = [f64; PER_AXIS];

/// All functions of total degree ≤ p on the cells of a cube, for scores of walks in the scalar F: those of
/// [`Cube`], in the same order, with p known at run time.
///
/// ```
/// use fredholm_core::whole::Scores;
/// use fredholm_cube::{Cube, CubeScores};
///
/// let cube = Cube::<f64, 2, _, _>::new(|_: &[f64; 2], _: &[f64; 2]| 0.5, |_: &[f64; 2]| 1.0, 8, 0.2)?;
/// let scores = CubeScores::new(&cube, 3).unwrap();
/// assert_eq!((scores.functions(), scores.unknowns()), (10, 640));
/// assert_eq!(scores.degrees().collect::<Vec<_>>(), [0, 1, 2, 3, 1, 2, 3, 2, 3, 3]);
/// # Ok::<(), fredholm_cube::CubeError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct CubeScores<F, const D: usize> {
    mesh: Mesh<D>,
    degree: usize,
    functions: usize,
    scalar: PhantomData<F>,
}

impl<F: Real, const D: usize> CubeScores<F, D> {
    /// The largest degree that there is.
    pub const MOST_DEGREE: usize = PER_AXIS - 1;

    /// The functions of this total degree or less. `None`: the degree is above [`MOST_DEGREE`](Self::MOST_DEGREE).
    #[must_use]
    pub fn new<K, S, const B: usize>(cube: &Cube<F, D, K, S, B>, degree: usize) -> Option<Self> {
        (degree <= Self::MOST_DEGREE).then_some(Self {
            mesh: cube.mesh(),
            degree,
            functions: functions(D, degree),
            scalar: PhantomData,
        })
    }

    /// The total degree of every function on a cell, in their order.
    pub fn degrees(&self) -> impl Iterator<Item = usize> + use<F, D> {
        degrees(D, self.degree)
    }

    /// The value at a point of a piecewise polynomial with n·B coefficients; NaN if there are fewer.
    #[must_use]
    pub fn value(&self, x: &Located<[F; D]>, coefficients: &[f64]) -> f64 {
        let start = x.cell * self.functions;
        let Some(own) = coefficients.get(start..start + self.functions) else {
            return f64::NAN;
        };
        sum_products(&self.axes(x), self.degree, &mut own.iter())
    }

    /// Adds `score` times every function at a point to the sums of its cell.
    #[inline]
    pub fn add_own(&self, x: &Located<[F; D]>, score: f64, own: &mut [f64]) {
        add_products(&self.axes(x), self.degree, score, &mut own.iter_mut());
    }

    /// The polynomials along every axis at a point.
    #[inline]
    fn axes(&self, x: &Located<[F; D]>) -> [Axis; D] {
        let per_axis = f64::from(self.mesh.per_axis());
        let places = self.mesh.places(x.cell);
        from_fn(|a| {
            let t = 2.0 * (x.point[a].to_f64() * per_axis - f64::from(places[a])) - 1.0;
            legendre(t)
        })
    }

    /// Writes a piecewise polynomial of a lower degree, n blocks of coefficients, as one of these functions. What there
    /// are no coefficients for stays as it is.
    pub fn embed(&self, degree: usize, from: &[f64], to: &mut [f64]) {
        let mut from = from.iter();
        let cells = to.chunks_exact_mut(self.functions.max(1));
        for block in cells {
            let low = block.iter_mut().zip(self.degrees());
            let low = low.filter(|(_, total)| *total <= degree);
            for ((to, _), from) in low.zip(&mut from) {
                *to = *from;
            }
        }
    }
}

/// The total degrees of all functions on a cell of so many axes with total degree ≤ `most`, in the order of the functions:
/// lexicographic in the degrees along the axes, the last axis running fastest.
///
/// ```
/// assert_eq!(fredholm_cube::degrees(2, 2).collect::<Vec<_>>(), [0, 1, 2, 1, 2, 2]);
/// ```
pub fn degrees(axes: usize, most: usize) -> impl Iterator<Item = usize> {
    // In base p + 1 the numbers whose digits sum to p or less.
    let base = most + 1;
    let all = (0..axes).fold(1_usize, |all, _| all.saturating_mul(base));
    (0..all).filter_map(move |mut number| {
        let digits = repeat_n((), axes).map(|()| {
            let digit = number % base;
            number /= base;
            digit
        });
        Some(digits.sum()).filter(|total| *total <= most)
    })
}

/// Adds `factor` times the products of polynomials of total degree ≤ `most` along these axes.
pub(crate) fn add_products(axes: &[Axis], most: usize, factor: f64, sums: &mut IterMut<'_, f64>) {
    let Some((axis, rest)) = axes.split_first() else {
        return;
    };
    for (degree, value) in axis.iter().take(most + 1).enumerate() {
        let product = factor * value;
        if !rest.is_empty() {
            add_products(rest, most - degree, product, sums);
        } else if let Some(sum) = sums.next() {
            *sum += product;
        }
    }
}

/// The sum of these coefficients times the products of polynomials of total degree ≤ `most` along these axes.
fn sum_products(axes: &[Axis], most: usize, coefficients: &mut Iter<'_, f64>) -> f64 {
    let Some((axis, rest)) = axes.split_first() else {
        return 0.0;
    };
    let mut sum = 0.0;
    for (degree, value) in axis.iter().take(most + 1).enumerate() {
        sum += value
            * if rest.is_empty() {
                coefficients.next().copied().unwrap_or(f64::NAN)
            } else {
                sum_products(rest, most - degree, coefficients)
            };
    }
    sum
}

impl<F: Real, const D: usize> Scores<[F; D]> for CubeScores<F, D> {
    fn unknowns(&self) -> usize {
        self.mesh.cells().saturating_mul(self.functions)
    }

    fn functions(&self) -> usize {
        self.functions
    }

    fn add(&self, x: &Located<[F; D]>, score: f64, sums: &mut [f64]) {
        let start = x.cell * self.functions;
        let Some(sums) = sums.get_mut(start..start + self.functions) else {
            return;
        };
        self.add_own(x, score, sums);
    }

    fn value(&self, x: &Located<[F; D]>, coefficients: &[f64]) -> f64 {
        Self::value(self, x, coefficients)
    }
}

#[cfg(test)]
mod tests {
    use fredholm_core::Located;
    use fredholm_core::galerkin::Basis;
    use fredholm_core::whole::Scores;

    use super::CubeScores;
    use crate::{Cube, functions};

    fn check<const D: usize, const B: usize>(degree: usize) {
        let kernel = |_: &[f64; D], _: &[f64; D]| 0.5;
        let cube = Cube::<f64, D, _, _>::new(kernel, |_: &[f64; D]| 1.0, 3, 0.2).unwrap();
        let cube = cube.with_functions::<B>();
        let scores = CubeScores::new(&cube, degree).unwrap();
        assert_eq!((scores.functions(), scores.degrees().count()), (B, B));
        let point = core::array::from_fn(|a| 0.05 + 0.27 * a as f64);
        let cell = fredholm_core::galerkin::Partition::locate(&cube, &point);
        let mut sums = alloc::vec![0.0; scores.unknowns()];
        scores.add(&Located { point, cell }, 2.0, &mut sums);
        let expected = cube.basis(&Located { point, cell });
        for (found, expected) in sums[cell * B..][..B].iter().zip(expected) {
            assert!((found - 2.0 * expected).abs() < 1e-14 * (1.0 + expected.abs()));
        }
        // Σ ψ² over the functions, by the polynomial that has these coefficients.
        let square: f64 = expected.iter().map(|psi| psi * psi).sum();
        let found = scores.value(&Located { point, cell }, &sums);
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
        let cube = Cube::<f64, 2, _, _>::new(kernel, |_: &[f64; 2]| 1.0, 1, 0.2).unwrap();
        assert!(CubeScores::new(&cube, 8).is_none());
        let scores = CubeScores::new(&cube, 2).unwrap();
        // 1, y, y², x, xy, x².
        let mut to = [0.0; 6];
        scores.embed(1, &[3.0, 4.0, 5.0], &mut to);
        assert_eq!(to, [3.0, 4.0, 0.0, 5.0, 0.0, 0.0]);
        scores.embed(0, &[7.0], &mut to);
        assert_eq!(to, [7.0, 4.0, 0.0, 5.0, 0.0, 0.0]);
    }
}
