//! The functions on a cell: products of Legendre polynomials of bounded total degree.

use core::slice;
use fredholm_core::array::Each;

use fredholm_core::galerkin::{Legendre, legendre};
use fredholm_core::{Located, Real};

use crate::mesh::Mesh;

/// B = C(p + D, D): how many functions of total degree `degree` or less there are on a cell of
/// `dimension` axes, for [`Cube::with_functions`](crate::Cube::with_functions). `usize::MAX` where
/// they are too many to count.
///
/// ```
/// use fredholm_cube::functions;
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

/// Degrees below this, which are those in use, have code of their own: no constant of a program can be
/// p + 1, and B may be far larger.
pub(crate) const FEW: usize = 5;

/// The functions of total degree ≤ p on a cell, with p known at run time: products of Legendre polynomials along the axes.
///
/// Whatever is set up before walks takes them in place of a constant number of functions, so that it is compiled once for all
/// degrees.
///
/// ```
/// use fredholm_cube::CellFunctions;
///
/// let cubic = CellFunctions::<2>::new::<10>();
/// assert_eq!((cubic.degree(), cubic.count()), (3, 10));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct CellFunctions<const D: usize> {
    /// p.
    pub(crate) degree: usize,
    /// The degrees, as in [`Functions::DEGREES`].
    pub(crate) degrees: &'static [[u8; D]],
}

impl<const D: usize> CellFunctions<D> {
    /// All `B` functions of a cell: [`functions`](D, p) of them, or the compiler refuses.
    #[must_use]
    pub const fn new<const B: usize>() -> Self {
        Functions::<D, B>::ALL
    }

    /// The number B of functions.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.degrees.len()
    }

    /// The total degree p.
    #[must_use]
    pub const fn degree(&self) -> usize {
        self.degree
    }

    /// p + 1.
    pub(crate) const fn per_axis(&self) -> usize {
        self.degree + 1
    }

    /// Σ_b w_b ψ_b(x) at a point of a cell.
    pub(crate) fn sum<F: Real>(&self, mesh: &Mesh<D>, x: &Located<[F; D]>, w: &[F]) -> f64 {
        let axes = mesh.local(x).each(Axis::new);
        let mut sum = Sum {
            terms: -0.0,
            weights: w.iter(),
        };
        sum.add(&axes, self.degree, F::one());
        sum.terms
    }
}

/// The values at t of all functions of total degree ≤ `degree`: those of [`Functions::at`].
pub(crate) fn values_at<const D: usize>(t: [f64; D], degree: usize, out: &mut [f64]) {
    if degree == 0 {
        return out.fill(1.0);
    }
    products(&t.map(Axis::new), degree, 1.0, &mut out.iter_mut());
}

/// A coordinate, and the polynomials of the lowest degrees there.
#[derive(Clone, Copy)]
struct Axis<F> {
    t: F,
    few: [F; FEW],
}

impl<F: Real> Axis<F> {
    fn new(t: F) -> Self {
        Self {
            t,
            few: legendre(t),
        }
    }

    fn polynomial(&self, degree: usize) -> F {
        let few = self.few.get(degree).copied();
        few.unwrap_or_else(|| Legendre::new(self.t).nth(degree).unwrap_or(F::NAN))
    }
}

/// A sum of weights times functions, in the order of the functions.
struct Sum<'a, F> {
    terms: f64,
    weights: slice::Iter<'a, F>,
}

impl<F: Real> Sum<'_, F> {
    /// Adds the functions that are `factor` times products of total degree ≤ `most` along these axes.
    fn add(&mut self, axes: &[Axis<F>], most: usize, factor: F) {
        let Some((axis, rest)) = axes.split_first() else {
            return;
        };
        for degree in 0..=most {
            let product = factor * axis.polynomial(degree);
            if !rest.is_empty() {
                self.add(rest, most - degree, product);
            } else if let Some(weight) = self.weights.next() {
                self.terms += weight.to_f64() * product.to_f64();
            }
        }
    }
}

/// `factor` times the products of polynomials of total degree ≤ `most` along these axes.
fn products(axes: &[Axis<f64>], most: usize, factor: f64, out: &mut slice::IterMut<'_, f64>) {
    let Some((axis, rest)) = axes.split_first() else {
        return;
    };
    for degree in 0..=most {
        let product = factor * axis.polynomial(degree);
        if !rest.is_empty() {
            products(rest, most - degree, product, out);
        } else if let Some(out) = out.next() {
            *out = product;
        }
    }
}

/// The B functions of total degree ≤ p on [−1, 1]^D, in lexicographic order of their degrees, the
/// last axis running fastest; the first is 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Functions<const D: usize, const B: usize>;

impl<const D: usize, const B: usize> Functions<D, B> {
    /// p. A B that is no C(p + D, D) does not compile.
    pub(crate) const DEGREE: usize = {
        let mut degree = 0;
        while degree < B && functions(D, degree) < B {
            degree += 1;
        }
        assert!(
            functions(D, degree) == B,
            "a cell of D axes has B = C(p + D, D) functions for some degree p: see `functions`"
        );
        degree
    };

    /// p + 1.
    pub(crate) const PER_AXIS: usize = Self::DEGREE + 1;

    /// The degrees along the axes of every function.
    pub(crate) const DEGREES: [[u8; D]; B] = {
        assert!(
            Self::DEGREE <= u8::MAX as usize,
            "degrees above 255 are not offered"
        );
        let mut all = [[0; D]; B];
        let (mut now, mut total, mut b) = ([0; D], 0, 1);
        while b < B {
            let mut axis = D - 1;
            if total == Self::DEGREE {
                // The last axis that can give way, for one before it.
                while now[axis] == 0 {
                    axis -= 1;
                }
                total -= now[axis] as usize;
                now[axis] = 0;
                axis -= 1;
            }
            now[axis] += 1;
            total += 1;
            all[b] = now;
            b += 1;
        }
        all
    };

    /// Where every function stands if the first axis runs fastest.
    pub(crate) const TURNED: [usize; B] = {
        let mut turned = [0; B];
        let mut b = 0;
        while b < B {
            let mut c = 0;
            loop {
                let mut axis = 0;
                while axis < D && Self::DEGREES[c][axis] == Self::DEGREES[b][D - 1 - axis] {
                    axis += 1;
                }
                if axis == D {
                    break;
                }
                c += 1;
            }
            turned[b] = c;
            b += 1;
        }
        turned
    };

    /// The functions with B known at run time.
    pub(crate) const ALL: CellFunctions<D> = CellFunctions {
        degree: Self::DEGREE,
        degrees: &Self::DEGREES,
    };

    /// Their values at t.
    #[inline]
    pub(crate) fn at<F: Real>(t: [F; D]) -> [F; B] {
        // Constants, so that what is not taken is not compiled.
        if const { Self::DEGREE == 0 } {
            [F::one(); B]
        } else if const { Self::DEGREE < FEW } {
            // What is not used of it is not computed.
            Self::products(&t.each(legendre::<F, FEW>))
        } else {
            Self::products(&t.each(legendre::<F, B>))
        }
    }

    /// Their values at a point of a cell.
    #[inline]
    pub(crate) fn in_cell<F: Real>(mesh: &Mesh<D>, x: &Located<[F; D]>) -> [F; B] {
        if const { Self::DEGREE == 0 } {
            return [F::one(); B];
        }
        Self::at(mesh.local(x))
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
    use super::{Functions, functions, values_at};

    #[test]
    fn degrees_are_all_up_to_the_total() {
        assert_eq!(functions(6, 2), 28);
        assert_eq!(functions(2, usize::MAX), usize::MAX);
        assert_eq!(functions(60, 60), usize::MAX);
        const B: usize = functions(3, 4);
        let all = Functions::<3, B>::DEGREES;
        assert_eq!(Functions::<3, B>::DEGREE, 4);
        assert_eq!([all[0], all[1], all[B - 1]], [[0; 3], [0, 0, 1], [4, 0, 0]]);
        assert!(all.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(all.iter().all(|degrees| degrees.iter().sum::<u8>() <= 4));
        for (b, &turned) in Functions::<3, B>::TURNED.iter().enumerate() {
            let [x, y, z] = all[b];
            assert_eq!(all[turned], [z, y, x]);
        }
    }

    /// To the bit: results depend on it.
    #[test]
    fn the_number_of_functions_does_not_matter() {
        fn check<const D: usize, const B: usize>() {
            let t = core::array::from_fn(|a| 0.7 - 0.45 * a as f64);
            let expected = Functions::<D, B>::at::<f64>(t);
            let mut found = [0.0; B];
            values_at(t, Functions::<D, B>::DEGREE, &mut found);
            assert_eq!(found.map(f64::to_bits), expected.map(f64::to_bits));
        }
        check::<1, 1>();
        check::<1, 4>();
        check::<1, 12>();
        check::<2, { functions(2, 7) }>();
        check::<3, { functions(3, 4) }>();
        check::<6, { functions(6, 2) }>();
    }

    #[test]
    fn values_are_products() {
        let psi = Functions::<2, 6>::at([0.5_f64, -0.25]);
        let root = 3.0_f64.sqrt();
        assert_eq!(psi[0], 1.0);
        assert!((psi[1] + 0.25 * root).abs() < 1e-15, "{psi:?}");
        assert!((psi[3] - 0.5 * root).abs() < 1e-15);
        assert!((psi[4] + 0.375).abs() < 1e-15);
        let high = Functions::<1, 8>::at([1.0_f64]);
        assert!((high[7] - 15.0_f64.sqrt()).abs() < 1e-14);
    }
}
