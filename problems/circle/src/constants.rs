//! What a circle of n cells computes once.

use fredholm_core::Real;
use fredholm_core::array::{Each, from_fn};
use fredholm_core::galerkin::legendre;

use crate::quadrature::{bessel, integrate};
use crate::series::{TERMS, arcsine, own_integrals, series, terms};

/// The largest number B of functions on a cell: polynomials of degree 6.
pub const MOST_FUNCTIONS: usize = 7;

/// The constants of n equal cells, with A = π/2n. A device that keeps them beside its tables needs no trigonometry.
///
/// In the coordinate t ∈ [−1, 1] of a cell, where s = m_j + 2At, ψ_b = √(2b + 1) P_b(t). All cells are equal, so that the
/// same numbers serve them all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Constants<F> {
    /// A.
    pub quarter: F,
    /// √A.
    pub root: F,
    /// cos A.
    pub cosine: F,
    /// 1 − cos A.
    pub versine: F,
    /// (A/2) ∫ ψ_b ψ_c w dt, where w(t) is cos At for even b + c and sin At for odd ones; the first is sin A.
    pub moments: [[F; MOST_FUNCTIONS]; MOST_FUNCTIONS],
    /// √A √(2b + 1) j_b(A), where j_b are the spherical Bessel functions.
    pub factors: [F; MOST_FUNCTIONS],
    /// K'_(ia)(ib)/ρ_i.
    pub diagonal: [[F; MOST_FUNCTIONS]; MOST_FUNCTIONS],
    /// (A/2) ∫ ψ_b(t) |sin A(t − τ)| dt in even powers of τ for even b, in odd ones for odd b.
    pub own: [[F; TERMS]; MOST_FUNCTIONS],
    /// 1/A times the series of the arcsine, in odd powers.
    pub arcsine: [F; TERMS],
    /// The numbers of terms of [`own`](Self::own) that count.
    pub own_terms: [u32; MOST_FUNCTIONS],
    /// The number of terms of [`arcsine`](Self::arcsine) that count; 0: the cells are too large for it.
    pub arcsine_terms: u32,
}

impl<F: Real> Constants<F> {
    /// The constants of this number of cells.
    pub(crate) fn new(cells: usize) -> Self {
        let quarter = core::f64::consts::PI / (2.0 * cells as f64);
        let half_sine = Real::sin(0.5 * quarter);
        let moment = |b: usize, c: usize| {
            if b + c == 0 {
                return Real::sin(quarter);
            }
            let phase = if (b + c).is_multiple_of(2) {
                Real::cos
            } else {
                Real::sin
            };
            let product = |t| {
                let psi: [f64; MOST_FUNCTIONS] = legendre(t);
                at(&psi, b) * at(&psi, c) * phase(quarter * t)
            };
            0.5 * quarter * integrate(-1.0, 1.0, product)
        };
        let own = own_integrals::<MOST_FUNCTIONS>(quarter);
        // |sin| in both of its arguments: the mean over τ of what y brings.
        let diagonal = |a: usize, b: usize| {
            let product = |tau| {
                let psi: [f64; MOST_FUNCTIONS] = legendre(tau);
                let own = own
                    .get(b)
                    .map_or(f64::NAN, |own| series(own, TERMS, b, tau));
                at(&psi, a) * own
            };
            0.5 * integrate(-1.0, 1.0, product)
        };
        let mut factors: [f64; MOST_FUNCTIONS] = bessel(quarter);
        for (f, psi) in factors.iter_mut().zip(legendre::<f64, MOST_FUNCTIONS>(1.0)) {
            *f *= Real::sqrt(quarter) * psi;
        }
        // sin² A < 0.04 to the power 12 is no more than a rounding error.
        let arcsine_terms = if quarter < 0.2 {
            let powers = (1..TERMS as i32).map(|k| Real::pow(quarter, f64::from(2 * k)));
            1 + powers.filter(|power| *power > 1e-17).count() as u32
        } else {
            0
        };
        Self {
            quarter: F::from_f64(quarter),
            root: F::from_f64(Real::sqrt(quarter)),
            cosine: F::from_f64(Real::cos(quarter)),
            versine: F::from_f64(2.0 * half_sine * half_sine),
            moments: matrix(moment),
            factors: factors.each(F::from_f64),
            diagonal: matrix(diagonal),
            own: own.each(|row| row.each(F::from_f64)),
            arcsine: arcsine(quarter).each(F::from_f64),
            own_terms: own.each(|row| terms(&row, own[0][0])),
            arcsine_terms,
        }
    }

    /// (A/2) ∫ ψ_b(t) |sin A(t − τ)| dt for all b < B.
    #[inline]
    pub(crate) fn own_integrals<const B: usize>(&self, tau: F) -> [F; B] {
        const { assert!(B <= MOST_FUNCTIONS, "polynomials have degree 6 at most") };
        from_fn(|b| series(&self.own[b], self.own_terms[b] as usize, b, tau))
    }
}

/// An entry that there is: with an index that the compiler need not check.
fn at(all: &[f64], b: usize) -> f64 {
    all.get(b).copied().unwrap_or(f64::NAN)
}

/// The matrix with these entries.
fn matrix<F: Real>(entry: impl Fn(usize, usize) -> f64) -> [[F; MOST_FUNCTIONS]; MOST_FUNCTIONS] {
    from_fn(|b| from_fn(|c| F::from_f64(entry(b, c))))
}
