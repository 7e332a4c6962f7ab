//! Power series of the functions on a cell.

use fredholm_core::Real;
use fredholm_core::array::from_fn;
use fredholm_core::galerkin::legendre;

use crate::quadrature::integrate;

/// Terms of a series in even or in odd powers of an angle in units of A ≤ π/2: (π/2)²⁴/24! < 10⁻¹⁸.
pub(crate) const TERMS: usize = 12;

/// The series of asin(z)/A in z, z³, z⁵, …
pub(crate) fn arcsine(quarter: f64) -> [f64; TERMS] {
    let mut coefficient = 1.0;
    from_fn(|k| {
        let power = 2.0 * k as f64;
        let value = coefficient / ((power + 1.0) * quarter);
        coefficient *= (power + 1.0) / (power + 2.0);
        value
    })
}

/// The number of terms of the arcsine's series that are not below 10⁻¹⁷ of the first.
pub(crate) fn arcsine_terms(quarter: f64) -> usize {
    let mut terms = 1;
    let mut power = quarter * quarter;
    while terms < TERMS && power > 1e-17 {
        power *= quarter * quarter;
        terms += 1;
    }
    terms
}

/// (A/2) I_b(τ) with I_b(τ) = ∫ ψ_b(t) |sin A(t − τ)| dt as power series in τ, each in powers of its own
/// parity. They come from I'' = −A² I + 2A ψ_b(τ), and from I(0) or I'(0) by quadrature.
pub(crate) fn own_integrals<const B: usize>(quarter: f64) -> [[f64; TERMS]; B] {
    from_fn(|b| {
        let half = |weight: fn(f64) -> f64| {
            let product = |t| legendre::<f64, B>(t)[b] * weight(quarter * t);
            2.0 * integrate(0.0, 1.0, product)
        };
        let first = if b.is_multiple_of(2) {
            half(Real::sin)
        } else {
            -quarter * half(Real::cos)
        };
        let psi = powers(b);
        let mut next = 0.5 * quarter * first;
        from_fn(|k| {
            let value = next;
            let power = (2 * k + b % 2) as f64;
            let own = psi.get(k).copied().unwrap_or(0.0);
            next = (quarter * quarter * own - quarter * quarter * value)
                / ((power + 1.0) * (power + 2.0));
            value
        })
    })
}

/// ψ_b(t) in powers of t of its own parity.
fn powers(b: usize) -> [f64; TERMS] {
    let mut out = [0.0; TERMS];
    // (−1)^k (2b − 2k)!/(2^b k! (b − k)! (b − 2k)!) belongs to t^(b − 2k).
    let mut coefficient = Real::sqrt(2.0 * b as f64 + 1.0);
    for i in 0..b {
        coefficient *= (2 * i + 1) as f64 / (i + 1) as f64;
    }
    for k in 0..=b / 2 {
        if let Some(out) = out.get_mut(b / 2 - k) {
            *out = coefficient;
        }
        let (left, b, k) = ((b - 2 * k) as f64, b as f64, k as f64);
        coefficient *= -left * (left - 1.0) / (2.0 * (k + 1.0) * (2.0 * b - 2.0 * k - 1.0));
    }
    out
}

/// The number of terms without which the sums would not be the same to 10⁻¹⁸ of the first function's.
pub(crate) fn terms<const B: usize>(own: &[[f64; TERMS]; B]) -> usize {
    let largest = own.iter().flatten().fold(0.0, |m: f64, c| m.max(c.abs()));
    let counts = |k: &usize| own.iter().any(|row| row[*k].abs() > 1e-18 * largest);
    (0..TERMS).rev().find(counts).map_or(TERMS, |k| k + 1)
}

/// Σ_k c_k τ^(2k), times τ for odd b.
#[inline]
pub(crate) fn series<F: Real>(coefficients: &[F; TERMS], terms: usize, b: usize, tau: F) -> F {
    let square = tau * tau;
    let sum = coefficients.iter().take(terms).rev();
    let sum = sum.fold(F::zero(), |sum, &c| sum * square + c);
    if b.is_multiple_of(2) { sum } else { tau * sum }
}

/// The coefficients of the sine in odd powers, the last first: up to an eighth of a turn what is left out is below a rounding error,
/// as (π/4)^17/17! is.
pub(crate) const SINE: [f64; 8] = factorials(1);
/// The coefficients of the cosine in even powers, the last first; what is left out is (π/4)^18/18!.
pub(crate) const COSINE: [f64; 9] = factorials(0);

/// (−1)^k/(2k + first)! of N terms, the last first.
const fn factorials<const N: usize>(first: u32) -> [f64; N] {
    let mut all = [0.0; N];
    let mut k = 0;
    while k < N {
        let mut factorial = 1.0;
        let mut i = 2;
        while i <= 2 * k as u32 + first {
            factorial *= i as f64;
            i += 1;
        }
        all[N - 1 - k] = if k % 2 == 0 { 1.0 } else { -1.0 } / factorial;
        k += 1;
    }
    all
}

/// Cosine and sine of an angle of at most an eighth of a turn: what starts need, side by side with the same bits.
pub(crate) fn eighth_turn(x: f64) -> (f64, f64) {
    let square = x * x;
    let series = |terms: &[f64]| terms.iter().fold(0.0, |sum, &c| sum * square + c);
    (series(&COSINE), x * series(&SINE))
}
