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

/// (A/2) I_b(τ) with I_b(τ) = ∫ ψ_b(t) |sin A(t − τ)| dt as power series in τ, each in powers of its own
/// parity. They come from I'' = −A² I + 2A ψ_b(τ), and from I(0) or I'(0) by quadrature.
pub(crate) fn own_integrals<const B: usize>(quarter: f64) -> [[f64; TERMS]; B] {
    from_fn(|b| {
        let half = |weight: fn(f64) -> f64| {
            let product = |t| {
                let psi = legendre::<f64, B>(t).get(b).copied();
                psi.unwrap_or(f64::NAN) * weight(quarter * t)
            };
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

/// The number of terms of a row without which its sum would not be the same to 10⁻¹⁸ of `largest`.
pub(crate) fn terms(row: &[f64; TERMS], largest: f64) -> u32 {
    let counts = |c: &f64| c.abs() > 1e-18 * largest;
    row.iter().rposition(counts).map_or(0, |k| k as u32 + 1)
}

/// Σ_k c_k τ^(2k), times τ for odd b.
#[inline]
pub(crate) fn series<F: Real>(coefficients: &[F; TERMS], terms: usize, b: usize, tau: F) -> F {
    let square = tau * tau;
    let sum = coefficients.iter().take(terms).rev();
    let sum = sum.fold(F::zero(), |sum, &c| sum * square + c);
    if b.is_multiple_of(2) { sum } else { tau * sum }
}

/// 1/(2k (2k − 1)) and 1/(2k (2k + 1)) for k = 8 … 1: what a term of cosine and of sine is of the one before it.
const RATIOS: [[f64; 2]; 8] = {
    let mut ratios = [[0.0; 2]; 8];
    let mut i = 0;
    while i < 8 {
        let even = 2.0 * (8 - i) as f64;
        ratios[i] = [1.0 / (even * (even - 1.0)), 1.0 / (even * (even + 1.0))];
        i += 1;
    }
    ratios
};

/// Cosine and sine of an angle of at most an eighth of a turn, in less time than those of any angle: what is left out, as
/// (π/4)^18/18!, is below a rounding error.
pub(crate) fn eighth_turn(x: f64) -> (f64, f64) {
    let square = x * x;
    let (mut cos, mut sin) = (1.0, 1.0);
    for [even, odd] in RATIOS {
        cos = 1.0 - square * even * cos;
        sin = 1.0 - square * odd * sin;
    }
    (cos, x * sin)
}
