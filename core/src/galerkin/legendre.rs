//! Legendre polynomials, normalised.

use num_traits::{one, zero};

use crate::Real;

/// √(2b + 1), correctly rounded.
const ROOTS: [f64; 10] = [
    1.0,
    1.732_050_807_568_877_2,
    2.236_067_977_499_79,
    2.645_751_311_064_590_7,
    3.0,
    3.316_624_790_355_4,
    3.605_551_275_463_989,
    3.872_983_346_207_417,
    4.123_105_625_617_661,
    4.358_898_943_540_674,
];

/// √(2b + 1) P_b(t) for b = 0 … B−1: the Legendre polynomials on [−1, 1], orthonormal with respect to
/// dt/2.
///
/// A basis for cells on which a coordinate t runs from −1 to 1 and μ is a multiple of dt.
///
/// ```
/// use fredholm_core::galerkin::legendre;
///
/// let [zero, one, two] = legendre(0.5_f64);
/// assert_eq!([zero, one], [1.0, 0.5 * 3.0_f64.sqrt()]);
/// assert!((two - 5.0_f64.sqrt() * (3.0 * 0.25 - 1.0) / 2.0).abs() < 1e-15);
/// ```
#[inline]
#[must_use]
pub fn legendre<F: Real, const B: usize>(t: F) -> [F; B] {
    // A plain loop: `core::array::from_fn` is not inlined in crates of many units, and what is not used not left out.
    let (mut before, mut now, mut all) = (zero(), one::<F>(), [zero(); B]);
    for (b, value) in all.iter_mut().enumerate() {
        *value = normalised(b, now);
        (before, now) = (now, next(b, t, before, now));
    }
    all
}

/// √(2b + 1) P_b.
#[inline(always)]
fn normalised<F: Real>(b: usize, polynomial: F) -> F {
    polynomial * F::from_f64(root(b))
}

/// P_(b+1) at t: (b + 1) P_(b+1) = (2b + 1) t P_b − b P_(b−1).
#[inline(always)]
fn next<F: Real>(b: usize, t: F, before: F, now: F) -> F {
    let degree = b as f64;
    let forward = F::from_f64((2.0 * degree + 1.0) / (degree + 1.0));
    let back = F::from_f64(degree / (degree + 1.0));
    forward * t * now - back * before
}

/// The values of [`legendre`], one after the other without an end: where B is known at run time.
///
/// ```
/// use fredholm_core::galerkin::{Legendre, legendre};
///
/// let all: [f64; 7] = legendre(0.3);
/// assert!(Legendre::new(0.3).take(7).eq(all));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Legendre<F> {
    t: F,
    /// The number of the next.
    b: usize,
    /// P_(b−1) and P_b.
    before: F,
    now: F,
}

impl<F: Real> Legendre<F> {
    /// The polynomials at t.
    #[inline]
    #[must_use]
    pub fn new(t: F) -> Self {
        Self {
            t,
            b: 0,
            before: zero(),
            now: one(),
        }
    }
}

impl<F: Real> Iterator for Legendre<F> {
    type Item = F;

    #[inline]
    fn next(&mut self) -> Option<F> {
        let value = normalised(self.b, self.now);
        let next = next(self.b, self.t, self.before, self.now);
        (self.before, self.now) = (self.now, next);
        self.b += 1;
        Some(value)
    }
}

#[inline]
fn root(b: usize) -> f64 {
    match ROOTS.get(b) {
        Some(&root) => root,
        None => Real::sqrt(2.0 * b as f64 + 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::legendre;
    use crate::Real;

    /// (Σ over 1000 middles of ψ_a ψ_b)/1000 is off by O(10⁻⁶ B⁴).
    #[test]
    fn they_are_orthonormal() {
        const B: usize = 12;
        let mut sums = [[0.0; B]; B];
        for i in 0..1000 {
            let psi: [f64; B] = legendre((f64::from(i) + 0.5) / 500.0 - 1.0);
            for (row, a) in sums.iter_mut().zip(psi) {
                for (sum, b) in row.iter_mut().zip(psi) {
                    *sum += a * b / 1000.0;
                }
            }
        }
        for (a, row) in sums.iter().enumerate() {
            for (b, &sum) in row.iter().enumerate() {
                let expected = f64::from(u8::from(a == b));
                assert!((sum - expected).abs() < 3e-3, "{a} {b} {sum}");
            }
        }
    }

    #[test]
    fn at_the_ends_they_are_the_roots_of_odd_numbers() {
        let (left, right): ([f64; 11], [f64; 11]) = (legendre(-1.0), legendre(1.0));
        for b in 0..11 {
            let root = Real::sqrt(2.0 * b as f64 + 1.0);
            assert!((right[b] - root).abs() < 1e-14, "{b}");
            assert!((left[b] - if b % 2 == 0 { root } else { -root }).abs() < 1e-14);
        }
    }
}
