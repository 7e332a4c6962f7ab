//! The functions on a cell: products of Legendre polynomials of bounded total degree.

use core::slice::{Iter, IterMut};

use fredholm_core::Real;
use fredholm_core::array::Each;
use fredholm_core::galerkin::{degree_of, functions, legendre};

/// p + 1 for the largest degree.
pub(crate) const PER_AXIS: usize = 8;

/// The polynomials along an axis at one place.
pub(crate) type Axis = [f64; PER_AXIS];

/// The degrees along the axes of function `number` among those of total degree ≤ `most`.
pub(crate) const fn degrees_of<const D: usize>(mut number: usize, mut most: usize) -> [u8; D] {
    let (mut degrees, mut axis) = ([0; D], 0);
    while axis < D {
        // So many functions have the degree so far along this axis.
        while most > 0 && number >= functions(D - 1 - axis, most) {
            number -= functions(D - 1 - axis, most);
            degrees[axis] += 1;
            most -= 1;
        }
        axis += 1;
    }
    degrees
}

/// The total degrees of all functions on a cell of D axes with total degree ≤ `most`, in the order of the functions:
/// lexicographic in the degrees along the axes, the last axis running fastest.
///
/// ```
/// assert_eq!(fredholm_cube::degrees::<2>(2).collect::<Vec<_>>(), [0, 1, 2, 1, 2, 2]);
/// ```
pub fn degrees<const D: usize>(most: usize) -> impl Iterator<Item = usize> {
    let along = move |number| degrees_of::<D>(number, most).into_iter();
    (0..functions(D, most)).map(move |number| along(number).map(usize::from).sum())
}

/// The B functions on a cell of D axes at these parameters: [`products`](fredholm_core::galerkin::products) of the core, to the bit, with
/// degrees that the compiler knows.
///
/// ```
/// let [one, y, x] = fredholm_cube::polynomials(&[0.75, 1.0]);
/// assert_eq!((one, y, x), (1.0, 3.0_f64.sqrt(), 0.5 * 3.0_f64.sqrt()));
/// ```
#[inline]
#[must_use]
pub fn polynomials<F: Real, const D: usize, const B: usize>(t: &[F; D]) -> [F; B] {
    if const { Functions::<D, B>::DEGREE == 0 } {
        return [F::one(); B];
    }
    Functions::at(t.each(|t| t + t - F::one()))
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
pub(crate) fn sum_products<F: Real>(axes: &[Axis], most: usize, of: &mut Iter<'_, F>) -> f64 {
    let Some((axis, rest)) = axes.split_first() else {
        return 0.0;
    };
    let mut sum = 0.0;
    for (degree, value) in axis.iter().take(most + 1).enumerate() {
        sum += value
            * if rest.is_empty() {
                of.next().map_or(f64::NAN, |of| of.to_f64())
            } else {
                sum_products(rest, most - degree, of)
            };
    }
    sum
}

/// The B functions of total degree ≤ p on [−1, 1]^D, in lexicographic order of their degrees, the
/// last axis running fastest; the first is 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Functions<const D: usize, const B: usize>;

impl<const D: usize, const B: usize> Functions<D, B> {
    /// p. A B that is no C(p + D, D) does not compile.
    pub(crate) const DEGREE: usize = {
        assert!(
            functions(D, degree_of(D, B)) == B,
            "a cell of D axes has B = C(p + D, D) functions for some degree p: see `functions`"
        );
        assert!(degree_of(D, B) < PER_AXIS, "degrees are 7 at most");
        degree_of(D, B)
    };

    /// p + 1.
    pub(crate) const PER_AXIS: usize = Self::DEGREE + 1;

    /// The degrees along the axes of every function.
    pub(crate) const DEGREES: [[u8; D]; B] = {
        let (mut all, mut b) = ([[0; D]; B], 0);
        while b < B {
            all[b] = degrees_of(b, Self::DEGREE);
            b += 1;
        }
        all
    };

    /// Their values at t.
    #[inline]
    pub(crate) fn at<F: Real>(t: [F; D]) -> [F; B] {
        // Constants, so that what is not taken is not compiled: the degrees in use have code of their own.
        if const { Self::DEGREE < 5 } {
            Self::products(&t.each(legendre::<F, 5>))
        } else {
            Self::products(&t.each(legendre::<F, PER_AXIS>))
        }
    }

    #[inline]
    fn products<F: Real, const N: usize>(axes: &[[F; N]; D]) -> [F; B] {
        let mut values = [F::one(); B];
        for (value, degrees) in values.iter_mut().zip(&Self::DEGREES) {
            for (axis, &degree) in axes.iter().zip(degrees) {
                *value *= axis.get(degree as usize).copied().unwrap_or(F::NAN);
            }
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::{Axis, Functions, add_products, functions};
    use fredholm_core::galerkin::{legendre, products};

    #[test]
    fn degrees_are_all_up_to_the_total() {
        const B: usize = functions(3, 4);
        let all = Functions::<3, B>::DEGREES;
        assert_eq!(Functions::<3, B>::DEGREE, 4);
        assert_eq!([all[0], all[1], all[B - 1]], [[0; 3], [0, 0, 1], [4, 0, 0]]);
        assert!(all.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(all.iter().all(|degrees| degrees.iter().sum::<u8>() <= 4));
    }

    /// To the bit: results depend on it.
    #[test]
    fn they_are_those_of_the_core_and_of_a_degree_at_run_time() {
        fn check<const D: usize, const B: usize>() {
            let t: [f64; D] = core::array::from_fn(|a| 0.85 - 0.225 * a as f64);
            let expected: [f64; B] = products(&t);
            let t = t.map(|t| t + t - 1.0);
            let found = Functions::<D, B>::at(t);
            assert_eq!(found.map(f64::to_bits), expected.map(f64::to_bits));
            let (axes, mut found): ([Axis; D], _) = (t.map(legendre), [0.0; B]);
            add_products(&axes, Functions::<D, B>::DEGREE, 1.0, &mut found.iter_mut());
            assert_eq!(found.map(f64::to_bits), expected.map(f64::to_bits));
        }
        check::<1, 1>();
        check::<1, 4>();
        check::<1, 8>();
        check::<2, { functions(2, 7) }>();
        check::<3, { functions(3, 4) }>();
        check::<6, { functions(6, 2) }>();
    }
}
