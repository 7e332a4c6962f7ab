//! What a problem says of its cells.

use num_traits::{one, zero};

use super::legendre::legendre;
use super::small;
use crate::{Chain, Equation, Located, Real, Space};

/// The largest dimension of cells, and of the uniform numbers by which a control variate knows a step.
pub const MOST_DIMENSIONS: usize = 6;

/// A partition of X into cells X_0 … X_(n−1), of positive measure and disjoint up to null sets, as images of the cube [0, 1]^d.
///
/// Where a point lies in its cell is what polynomials of any degree, quadrature and uniform starts follow from.
///
/// ```
/// use fredholm_core::galerkin::{Basis, Cells};
/// use fredholm_core::{Located, Space};
///
/// /// [0, 2] in four cells.
/// struct Interval;
///
/// impl Space for Interval {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl Cells for Interval {
///     const DIMENSION: usize = 1;
///     fn cells(&self) -> usize {
///         4
///     }
///     fn locate(&self, x: &f64) -> usize {
///         ((2.0 * x) as usize).min(3)
///     }
///     fn measure(&self, _: usize) -> f64 {
///         0.5
///     }
///     fn point(&self, cell: usize, t: &[f64]) -> f64 {
///         0.5 * (cell as f64 + t[0])
///     }
///     fn parameters(&self, x: &Located<f64>, t: &mut [f64]) {
///         t.fill(2.0 * x.point - x.cell as f64);
///     }
///     fn at(&self, coordinates: &[f64]) -> Option<f64> {
///         match *coordinates {
///             [x] if (0.0..=2.0).contains(&x) => Some(x),
///             _ => None,
///         }
///     }
/// }
/// impl<const B: usize> Basis<B> for Interval {}
///
/// let x = Located { point: 1.75, cell: 3 };
/// let mut t = [0.0];
/// Interval.parameters(&x, &mut t);
/// assert_eq!(t, [0.5]);
/// assert_eq!(Interval.locate(&Interval.point(3, &[0.5])), 3);
/// // 1 and the normalised Legendre polynomial of degree 1, which vanishes in the middle.
/// assert_eq!(Basis::<2>::basis(&Interval, &x), [1.0, 0.0]);
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no cells",
    label = "`Cells` is missing",
    note = "implement `Cells`: the number of cells, the cell of a point, its measure, its point at parameters in [0, 1]^d and the \
            parameters of a point"
)]
pub trait Cells: Space {
    /// The number d of parameters of a cell: the dimension of X, [`MOST_DIMENSIONS`] at most.
    const DIMENSION: usize;

    /// n.
    fn cells(&self) -> usize;

    /// The number of the cell in which `x` lies.
    fn locate(&self, x: &Self::Point) -> usize;

    /// μ(X_j).
    fn measure(&self, cell: usize) -> f64;

    /// The point of the closed cell at the parameters t ∈ [0, 1]^d. Parameters that are uniform on the cube give points
    /// that are uniform on the cell with respect to μ: on a sphere take the height, not the colatitude.
    fn point(&self, cell: usize, t: &[f64]) -> Self::Point;

    /// Fills `t`, of d numbers, with the parameters of a point of a cell: the inverse of [`point`](Self::point).
    fn parameters(&self, x: &Located<Self::Point>, t: &mut [Self::Scalar]);

    /// The point with these coordinates, of whatever kind people write them in; `None` if X has no such point.
    fn at(&self, coordinates: &[f64]) -> Option<Self::Point>;

    /// The number of copies of one space that the cells are of, as a system has one for each unknown function: the first so many cells are those of the
    /// first copy, the next ones lie at the same places of the next copy, with the same parameters, and so on.
    #[inline]
    fn copies(&self) -> usize {
        1
    }

    /// The number of a cell within its copy.
    #[inline]
    fn place(&self, cell: usize) -> usize {
        match self.copies() {
            1 => cell,
            copies => cell % (self.cells() / copies).max(1),
        }
    }
}

/// The functions ψ_i0 … ψ_i(B−1) on every cell, orthonormal with respect to μ/μ(X_i); ψ_i0 = 1.
///
/// By default they are the [products](products) of Legendre polynomials in the parameters of a cell.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no basis of {B} functions per cell",
    label = "`Basis<{B}>` is missing",
    note = "implement `Basis<{B}>`: an empty `impl` gives polynomials in the cell's parameters"
)]
pub trait Basis<const B: usize = 1>: Cells {
    /// ψ_i0(x) … ψ_i(B−1)(x), where i is the cell of `x`.
    #[inline]
    fn basis(&self, x: &Located<Self::Point>) -> [Self::Scalar; B] {
        if const { B == 1 } {
            return [one(); B];
        }
        let mut t = [zero(); MOST_DIMENSIONS];
        let own = t.get_mut(..Self::DIMENSION).unwrap_or(&mut []);
        self.parameters(x, own);
        products(own)
    }
}

/// C(p + d, d): how many functions of total degree `degree` or less there are on a cell of
/// `dimension` axes. `usize::MAX` where they are too many to count.
///
/// ```
/// use fredholm_core::galerkin::functions;
///
/// const CUBIC: usize = functions(2, 3);
/// assert_eq!([functions(3, 0), functions(1, 4), CUBIC], [1, 5, 10]);
/// ```
#[must_use]
pub const fn functions(dimension: usize, degree: usize) -> usize {
    let (mut count, mut axis) = (1_usize, 0);
    while axis < dimension {
        axis += 1;
        // C(p + k, k) = C(p + k − 1, k − 1) (p + k)/k, without a remainder.
        let (Some(top), true) = (degree.checked_add(axis), count < usize::MAX) else {
            return usize::MAX;
        };
        count = match count.checked_mul(top) {
            Some(product) => product / axis,
            None => return usize::MAX,
        };
    }
    count
}

/// The degree p of the B = C(p + d, d) functions on a cell of d axes; the lowest with at least as many.
#[must_use]
pub const fn degree_of(dimension: usize, count: usize) -> usize {
    let mut degree = 0;
    while functions(dimension, degree) < count {
        degree += 1;
    }
    degree
}

/// The largest degree of [`products`].
const MOST_DEGREE: usize = 7;

/// The B products of normalised Legendre polynomials of total degree ≤ p at the parameters t ∈ [0, 1]^d, in lexicographic order of
/// their degrees, the last axis running fastest; the first is 1. B = C(p + d, d), and p is 7 at most.
///
/// ```
/// use fredholm_core::galerkin::products;
///
/// let [one, y, x] = products(&[0.75, 1.0]);
/// assert_eq!((one, y, x), (1.0, 3.0_f64.sqrt(), 0.5 * 3.0_f64.sqrt()));
/// ```
#[inline]
#[must_use]
pub fn products<F: Real, const B: usize>(t: &[F]) -> [F; B] {
    if let [t] = t {
        return legendre(*t + *t - one());
    }
    let mut axes = [[zero(); MOST_DEGREE + 1]; MOST_DIMENSIONS];
    for (axis, &t) in axes.iter_mut().zip(t) {
        *axis = legendre(t + t - one());
    }
    let mut all = [F::NAN; B];
    let axes = axes.get(..t.len()).unwrap_or(&[]);
    fill(axes, degree_of(t.len(), B), one(), &mut all.iter_mut());
    all
}

/// The values of [`products`] where the number of functions is known at run time.
pub fn fill_products(t: &[f64], out: &mut [f64]) {
    if let [t] = t {
        let axis = legendre::<_, { MOST_DEGREE + 1 }>(t + t - 1.0);
        return out.iter_mut().zip(axis).for_each(|(out, psi)| *out = psi);
    }
    let mut axes = [[0.0; MOST_DEGREE + 1]; MOST_DIMENSIONS];
    for (axis, &t) in axes.iter_mut().zip(t) {
        *axis = legendre(t + t - 1.0);
    }
    let degree = degree_of(t.len(), out.len());
    let axes = axes.get(..t.len()).unwrap_or(&[]);
    fill(axes, degree, 1.0, &mut out.iter_mut());
}

/// `factor` times the products of polynomials of total degree ≤ `most` along these axes.
fn fill<F: Real>(
    axes: &[[F; MOST_DEGREE + 1]],
    most: usize,
    factor: F,
    out: &mut core::slice::IterMut<'_, F>,
) {
    let Some((axis, rest)) = axes.split_first() else {
        return;
    };
    for degree in 0..=most {
        let product = factor * axis.get(degree).copied().unwrap_or(F::NAN);
        if !rest.is_empty() {
            fill(rest, most - degree, product, out);
        } else if let Some(out) = out.next() {
            *out = product;
        }
    }
}

/// The transition moments, **exact**: they alone carry the unbiasedness.
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not say how probable a step into a cell is",
    label = "`TransitionMoments<{B}>` is missing",
    note = "implement `TransitionMoments<{B}>`: for B = 1 the exact integral of p(x, y) over y in cell j",
    note = "without it there are neighbour equations from steps, `Sampled`, and plain Monte Carlo, with `NoNeighbour`"
)]
pub trait TransitionMoments<const B: usize = 1>: Basis<B> + Chain {
    /// M_j(x)_bc = ∫_Xj p(x,y) ψ_jb(y) ψ_jc(y) dμ(y), symmetric. M_j(x)_00 is p_j(x), the
    /// transition mass (45): the probability that the step from `x` leads to cell `j`.
    ///
    /// It must be accurate relative to its own size: where a difference of nearly equal numbers
    /// would cancel for small cells, rewrite it.
    fn moments(&self, x: &Located<Self::Point>, j: usize) -> [[Self::Scalar; B]; B];

    /// The solution c of M_j(x) c = `right`: by elimination, unless a problem knows better. Where M is a
    /// multiple of the identity it is a division.
    #[inline]
    fn solve_moments(
        &self,
        x: &Located<Self::Point>,
        j: usize,
        right: [Self::Scalar; B],
    ) -> [Self::Scalar; B] {
        small::solve(self.moments(x, j), right)
    }
}

/// Exact first moments of the kernel, for pointwise pairs.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no exact integrals for pointwise pairs",
    label = "`PairIntegral<{B}>` is missing",
    note = "implement `PairIntegral<{B}>`: for B = 1 the integral of K(x, y) over y in cell j",
    note = "without it choose pairs in S or outside: `Piecewise::new`, and no `PairKind::Pointwise`"
)]
pub trait PairIntegral<const B: usize = 1>: Basis<B> + Equation {
    /// ∫_Xj K(x,y) ψ_jb(y) dμ(y) for b = 0 … B−1.
    fn pair_integral(&self, x: &Located<Self::Point>, j: usize) -> [Self::Value; B];
}

#[cfg(test)]
mod tests {
    use super::{degree_of, fill_products, functions, products};

    #[test]
    fn functions_are_counted() {
        assert_eq!(functions(6, 2), 28);
        assert_eq!(functions(2, usize::MAX), usize::MAX);
        assert_eq!(functions(60, 60), usize::MAX);
        for dimension in 1..=6 {
            for degree in 0..5 {
                assert_eq!(degree_of(dimension, functions(dimension, degree)), degree);
            }
        }
    }

    #[test]
    fn the_number_of_functions_does_not_matter() {
        let t = [0.7, 0.2, 0.9];
        let expected: [f64; functions(3, 4)] = products(&t);
        let mut found = [0.0; functions(3, 4)];
        fill_products(&t, &mut found);
        assert_eq!(found.map(f64::to_bits), expected.map(f64::to_bits));
        let root = crate::Real::sqrt(3.0_f64);
        let psi: [f64; 6] = products(&[0.75, 0.375]);
        assert_eq!(psi[0], 1.0);
        assert!((psi[1] + 0.25 * root).abs() < 1e-15, "{psi:?}");
        assert!((psi[3] - 0.5 * root).abs() < 1e-15);
        assert!((psi[4] + 0.375).abs() < 1e-15);
    }
}
