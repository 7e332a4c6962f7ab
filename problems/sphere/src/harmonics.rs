//! Spherical harmonics: the eigenfunctions of T_K.

use alloc::vec::Vec;

use fredholm_core::galerkin::{GalerkinError, reserve};
use fredholm_core::whole::Scores;
use fredholm_core::{Located, Real};

use crate::Point;

/// The real spherical harmonics of degree l ≤ p, normalised so that the mean of a square over the sphere is 1: the functions
/// on whose coefficients the walks of a whole function score. T_K multiplies those of degree l by a g^l, exactly.
///
/// Their order is by m, then by l ≥ m; of m > 0 that with cos mφ stands before that with sin mφ.
///
/// ```
/// use fredholm_sphere::Harmonics;
///
/// let harmonics = Harmonics::new(2)?;
/// assert_eq!(harmonics.degrees().collect::<Vec<_>>(), [0, 1, 2, 1, 1, 2, 2, 2, 2]);
/// let mut values = Vec::new();
/// harmonics.visit(&[0.6, 0.0, 0.8], |_, _, [cosine, sine]| values.push([cosine, sine]));
/// // 1, √3 z, √5 (3z² − 1)/2, √3 (x, y), …
/// assert!((values[1][0] - 3.0_f64.sqrt() * 0.8).abs() < 1e-15);
/// assert!((values[3][0] - 3.0_f64.sqrt() * 0.6).abs() < 1e-15 && values[3][1] == 0.0);
/// # Ok::<(), fredholm_core::galerkin::GalerkinError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Harmonics {
    degree: usize,
    /// By m, then by l: the factors of the recursion of l, and of that of m where l = m.
    factors: Vec<[f64; 2]>,
}

impl Harmonics {
    /// The harmonics up to this degree.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn new(degree: usize) -> Result<Self, GalerkinError> {
        let mut factors = reserve((degree + 1) * (degree + 2) / 2)?;
        for m in 0..=degree {
            for l in m..=degree {
                let (l, m) = (l as f64, m as f64);
                factors.push(if l > m {
                    let up = Real::sqrt((4.0 * l * l - 1.0) / (l * l - m * m));
                    let before = l - 1.0;
                    let down = (before * before - m * m) / (4.0 * before * before - 1.0);
                    // Where l − 1 = m there is no l − 2.
                    [up, if before > m { Real::sqrt(down) } else { 0.0 }]
                } else if m == 0.0 {
                    [1.0, 0.0]
                } else {
                    // Functions of m > 0 share a mean square of ½.
                    let first = if m == 1.0 { 2.0 } else { 1.0 };
                    [Real::sqrt(first * (2.0 * m + 1.0) / (2.0 * m)), 0.0]
                });
            }
        }
        Ok(Self { degree, factors })
    }

    /// p.
    #[must_use]
    pub const fn degree(&self) -> usize {
        self.degree
    }

    /// The degrees l of all functions, in their order.
    pub fn degrees(&self) -> impl Iterator<Item = usize> + use<> {
        let most = self.degree;
        let of = move |m: usize| {
            let both = if m > 0 { 2 } else { 1 };
            (m..=most).flat_map(move |l| core::iter::repeat_n(l, both))
        };
        (0..=most).flat_map(of)
    }

    /// Calls `each` with l, m, and the values of both functions at a point, in their order; for m = 0 the second is 0 and no
    /// function.
    #[inline]
    pub fn visit(&self, x: &Point<f64>, mut each: impl FnMut(usize, usize, [f64; 2])) {
        let [x, y, z] = *x;
        let mut factors = self.factors.iter();
        // (x + iy)^m, and the polynomial of l = m.
        let (mut power, mut own) = ([1.0, 0.0], 1.0);
        for m in 0..=self.degree {
            let (mut before, mut now) = (0.0, 0.0);
            for l in m..=self.degree {
                let &[up, down] = factors.next().unwrap_or(&[f64::NAN; 2]);
                let next = if l == m {
                    own *= up;
                    own
                } else {
                    up * (z * now - down * before)
                };
                (before, now) = (now, next);
                each(l, m, [now * power[0], now * power[1]]);
            }
            power = [x * power[0] - y * power[1], x * power[1] + y * power[0]];
        }
    }
}

impl<F: Real> Scores<Point<F>> for Harmonics {
    fn unknowns(&self) -> usize {
        (self.degree + 1) * (self.degree + 1)
    }

    /// All of them: the sphere is one cell.
    fn functions(&self) -> usize {
        (self.degree + 1) * (self.degree + 1)
    }

    #[inline]
    fn add(&self, x: &Located<Point<F>>, score: f64, sums: &mut [f64]) {
        use fredholm_core::array::Each;
        if sums.len() < (self.degree + 1) * (self.degree + 1) {
            return;
        }
        let mut sums = sums.iter_mut();
        let mut add = |value: f64| {
            if let Some(sum) = sums.next() {
                *sum += score * value;
            }
        };
        self.visit(&x.point.each(Real::to_f64), |_, m, [cosine, sine]| {
            add(cosine);
            if m > 0 {
                add(sine);
            }
        });
    }

    fn value(&self, x: &Located<Point<F>>, coefficients: &[f64]) -> f64 {
        use fredholm_core::array::Each;
        let mut coefficients = coefficients.iter();
        let mut next = || coefficients.next().copied().unwrap_or(f64::NAN);
        let mut sum = 0.0;
        self.visit(&x.point.each(Real::to_f64), |_, m, [cosine, sine]| {
            sum += next() * cosine;
            if m > 0 {
                sum += next() * sine;
            }
        });
        sum
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec;
    use fredholm_core::Located;
    use fredholm_core::whole::Scores;
    use fredholm_variance::gauss;

    use super::Harmonics;
    use crate::point;

    /// Means of products over the sphere, by a rule that is exact for them.
    #[test]
    fn they_are_orthonormal() {
        let harmonics = Harmonics::new(9).unwrap();
        let count = harmonics.degrees().count();
        let mut gram = vec![0.0; count * count];
        let turns = 24;
        for (height, weight) in gauss(10).unwrap() {
            for turn in 0..turns {
                let azimuth = core::f64::consts::TAU * f64::from(turn) / f64::from(turns);
                let point = point(height.acos(), azimuth);
                let mut values = vec![0.0; count];
                harmonics.add(&Located { point, cell: 0 }, 1.0, &mut values);
                for (row, left) in gram.chunks_exact_mut(count).zip(&values) {
                    for (entry, right) in row.iter_mut().zip(&values) {
                        *entry += 0.5 * weight / f64::from(turns) * left * right;
                    }
                }
            }
        }
        for (i, row) in gram.chunks_exact(count).enumerate() {
            for (j, entry) in row.iter().enumerate() {
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((entry - expected).abs() < 1e-13, "{i} {j}: {entry}");
            }
        }
    }

    /// Σ_m ψ_lm(x) ψ_lm(y) = (2l + 1) P_l(x·y), the addition theorem: here x = y.
    #[test]
    fn squares_add_up() {
        let harmonics = Harmonics::new(24).unwrap();
        let mut squares = [0.0; 25];
        harmonics.visit(&point(1.1, 2.3), |l, _, [a, b]| {
            squares[l] += a * a + b * b;
        });
        for (l, square) in squares.into_iter().enumerate() {
            let expected = (2 * l + 1) as f64;
            assert!(
                (square - expected).abs() < 1e-12 * expected,
                "{l}: {square}"
            );
        }
    }
}
