//! Walks of any regular equation: the neighbour equation with a known resolvent.
//!
//! The equation is given by its kernel K and its source F; no chain, and no bound of ‖T_K‖. On the cells of a partition stand the
//! polynomials ψ_ia of [`Basis`](crate::galerkin::Basis), orthonormal with respect to μ/μ(X_i). From any quadrature come numbers near
//! the Galerkin matrix K' and the means F',
//!
//! ```text
//! K_n(x,y) = ψ(x)ᵀ Â ψ(y),   Â = K' M⁻¹,   M = diag μ(X_i),
//! ```
//!
//! a kernel of finite rank whose resolvent is known **exactly**, whatever K' is: with R' = (I − K')⁻¹ − I and R̂ = R' M⁻¹,
//! (I − T_Kn)⁻¹ = I + R_n, (R_n h)(x) = ψ(x)ᵀ R̂ ∫ ψ(y) h(y) dμ(y).
//!
//! With the pointwise difference D = K − K_n the equation u = T_Kn u + T_D u + F is
//!
//! ```text
//! u = g + R_n r₀ + (I + R_n) T_D u,    g = F + ψᵀ R' F',    r₀ = F − ψᵀ F',
//! ```
//!
//! and for a functional Φ with (R_nᵀΦ)(y) = ψ(y)ᵀ w, w = R̂ᵀ (ψ, Φ),
//!
//! ```text
//! (u,Φ) = (F,Φ) + Σ_ia μ(X_i) F'_ia w_ia + (r₀, ψᵀw) + (T_D u, Φ + ψᵀw).
//! ```
//!
//! It is Heinrich's idea (1995) with the neighbour equation v = T_Kn v + F, whose solution is known with its resolvent; the
//! vector w is the dual solution of goal-oriented error estimation (Becker and Rannacher 2001), here sampled, and so unbiased and
//! with an error bar. Not in the paper.
//!
//! # The walk
//!
//! The last two terms are integrals over cells and over pairs of cells, and one over cells from the point of Φ, if it is the value at one.
//! Where Φ is no polynomial Φ̂ on the cells, (u, Φ − Φ̂) is another one. Each is a [`Stratum`] with a randomised net of its own. A point of
//! the stratum (i, j) scores the weight W = μ(X_i) μ(X_j) ψ_a(z) D(z,y) for every a, times g(y), so that the same points serve the
//! vectors w of all targets. Then u − g = R_n r₀ + (I + R_n) T_D u is
//! due at y. By roulette the walk goes on with probability s = min(1, |W| E_j/τ), W becoming W/s: from y itself or, by the row of R̂,
//! from a uniform point z of another cell, where it scores r₀(z), too. From there a step leads by the table of |D| to the next y, and so
//! on. Points are uniform in cells that are chosen by numbers, so that every density is known, and no walk asks where a point
//! lies.
//!
//! Only D, which is as small as cells are fine, must be small against the resolvent: where the spectral radius of (1 + |R_n|)|D| is
//! below 1 the estimate has a mean, which is (u,Φ) whatever the numbers K', F', w and the tables are. [`ResolventLooks::radius`]
//! estimates it from root mean squares over pairs of cells.
//!
//! # The coarse resolvent
//!
//! Of many cells the numbers F', R'F' and w are those of single systems of equations, and R̂ is all of an inverse. Walks that go on are few, and
//! may do so by the resolvent of another kernel of finite rank K_0, on fewer cells and with any numbers of its own. By K_n r₀ = ψᵀ Â ∫ ψ r₀ and
//! R' = K' + K'R' one has (I − T_Kn) g = F − T_Kn r₀, so that of e = u − g
//!
//! ```text
//! e = F + T_K (g + e) − g = T_Kn r₀ + T_D g + T_K e = (I + R_0) (T_Kn r₀ + T_D g + T_D0 e),    D_0 = K − K_0.
//! ```
//!
//! The terms of first order are those above: what is due at y is e(y). The place of y on the coarse cells is looked up; from y itself, or from z by
//! the row of R̂_0, a step leads to the next y by the table of |D_0|, scores W (D(z,y) g(y) + K_n(z,y) r₀(y)), and goes on with W D_0(z,y).
//! The estimate has a mean where the spectral radius of (1 + |R_0|)|D_0| is below 1, which is (u,Φ) for any w, F' and K', if R'F' solves
//! its system.

#[cfg(feature = "alloc")]
mod edges;
#[cfg(feature = "alloc")]
mod image;
#[cfg(feature = "alloc")]
mod plan;
#[cfg(feature = "alloc")]
mod setup;
mod walk;

pub use walk::{
    CellEnd, CellPoint, Coarse, Ending, Resolvent, ResolventTables, RestDensity, Stratum, Trace,
};

#[cfg(feature = "alloc")]
pub use edges::{Grid, edges, kronecker_point};
#[cfg(feature = "alloc")]
pub use image::{BY_RULES, Image, ImageBounds, Images, total_degrees};
#[cfg(feature = "alloc")]
pub use plan::{GroupScores, Known, Plan, Round, RoundSum};
#[cfg(feature = "alloc")]
pub use setup::{
    AxisNode, GalerkinRows, PAIR_DRAWS, ResolventLooks, ends, grading, is_rough, singularity,
};

use crate::galerkin::Cells;

/// The most functions on a cell: those of degree 4 in three dimensions, and of degree 2 in six.
pub const MOST_FUNCTIONS: usize = 36;

/// The most functions on a cell that points score on: those of degree 6 in three dimensions, and of degree 4 in four.
pub const MOST_SCORED: usize = 84;

/// Equation u(x) = ∫ K(x,y) u(y) dμ(y) + F(x) by its kernel and its source, on cells.
///
/// ```
/// use fredholm_core::galerkin::Cells;
/// use fredholm_core::resolvent::Regular;
/// use fredholm_core::{Located, Space};
///
/// /// u(x) = 2 ∫₀¹ exp(−(x − y)²) u(y) dy + 1 in so many cells.
/// struct Gauss(usize);
///
/// impl Space for Gauss {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl Cells for Gauss {
///     const DIMENSION: usize = 1;
///     fn cells(&self) -> usize {
///         self.0
///     }
///     fn locate(&self, x: &f64) -> usize {
///         ((x * self.0 as f64) as usize).min(self.0 - 1)
///     }
///     fn measure(&self, _: usize) -> f64 {
///         1.0 / self.0 as f64
///     }
///     fn point(&self, cell: usize, t: &[f64]) -> f64 {
///         (cell as f64 + t[0]) / self.0 as f64
///     }
///     fn parameters(&self, x: &Located<f64>, t: &mut [f64]) {
///         t[0] = x.point * self.0 as f64 - x.cell as f64;
///     }
///     fn at(&self, coordinates: &[f64]) -> Option<f64> {
///         coordinates.first().copied()
///     }
/// }
/// impl Regular for Gauss {
///     fn kernel(&self, x: &f64, y: &f64) -> f64 {
///         2.0 * (-(x - y) * (x - y)).exp()
///     }
///     fn source(&self, _: &f64) -> f64 {
///         1.0
///     }
/// }
/// assert_eq!(Gauss(4).kernel(&0.5, &0.5), 2.0);
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no equation by kernel and source yet",
    label = "`Regular` is missing",
    note = "implement `Regular`: K(x, y) with respect to the measure of the cells, and F(x)"
)]
pub trait Regular: Cells {
    /// K(x, y), with respect to μ(dy).
    fn kernel(&self, x: &Self::Point, y: &Self::Point) -> Self::Scalar;

    /// F(x).
    fn source(&self, x: &Self::Point) -> Self::Scalar;

    /// The number d of parameters of a cell: [`Cells::DIMENSION`], or fewer where it is known at run time.
    #[inline]
    fn dimension(&self) -> usize {
        Self::DIMENSION
    }
}
