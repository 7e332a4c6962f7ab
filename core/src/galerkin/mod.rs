//! Piecewise polynomial Galerkin schemes, and the neighbour equation that they give.
//!
//! X is cut into cells X_i. On each stand B functions ψ_i0 … ψ_i(B−1), orthonormal with respect to
//! μ/μ(X_i), so that ψ_i0 = 1; B = 1 are the piecewise constants of Heinrich 1995, section 4. The
//! Galerkin solution is v = Σ_ia v_ia ψ_ia. It solves **exactly**
//!
//! ```text
//! v = T_hp v + G,   G_ia = v_ia − Σ_(i,j)∈S Σ_b K'_(ia)(jb) v_jb                       (42)
//! ```
//!
//! if h satisfies, for x ∈ X_i and (i, j) ∈ S,
//!
//! ```text
//! ∫_Xj h(x,y) p(x,y) ψ_jb(y) dμ(y) = Σ_a K'_(ia)(jb) ψ_ia(x).                          (43)
//! ```
//!
//! With h(x,y) = Σ_c c_c(x) ψ_jc(y) this is a B×B system M_j(x) c(x) = rhs in the transition
//! moments M_j(x)_bc = ∫_Xj p(x,y) ψ_jb(y) ψ_jc(y) dμ(y). For B = 1 that is (44):
//! h = K'_ij/p_j(x). On pointwise pairs h = k instead, and G(x) loses
//! Σ_b v_jb ∫_Xj K(x,y) ψ_jb(y) dμ(y); on the remaining pairs h = 0.
//!
//! What is set up before walks knows B at run time and takes a [`GalerkinMatrix`]; a walk's step has B as a
//! constant and asks [`Basis`], [`TransitionMoments`] and [`Coefficients`].
//!
//! Nothing here asks K' to be exact or v to be converged: (50) holds for any of them. What must be
//! exact are the transition moments and the integrals of pointwise pairs. E η(h,g) = (v,Φ) asks
//! besides for the spectral radius of T_|h|p to be below 1, for which
//! [`max_row_sum`] gives a sufficient condition.

mod cells;
mod coefficients;
mod legendre;
mod pairs;
mod piecewise;
mod small;
#[cfg(feature = "alloc")]
pub(crate) use small::solve_in_place;
#[cfg(feature = "alloc")]
mod solution;
mod solve;
#[cfg(feature = "alloc")]
mod vectors;

pub use cells::{
    Basis, Cells, MOST_DIMENSIONS, PairIntegral, TransitionMoments, degree_of, fill_products,
    functions, products,
};
pub use coefficients::{Coefficients, Dense, GalerkinMatrix, Rounded};
pub use legendre::{Legendre, legendre};
/// Helpers of the crates of this workspace, outside of the public interface.
#[doc(hidden)]
pub use pairs::marked;
pub use pairs::{AllPointwise, DiagonalRule, PairKind, PairTable, Pairs};
pub use piecewise::{NeighbourSource, Piecewise, PointwiseSource, SourceTable, second_moment};
#[cfg(feature = "alloc")]
pub use solution::{Solution, rounded, second_moment_radius};
/// Helpers of the crates of this workspace, outside of the public interface.
#[cfg(feature = "alloc")]
#[doc(hidden)]
pub use solution::{buffer, reserve};
pub use solve::{
    Convergence, GalerkinError, StoppingRule, collatz_wielandt_bounds, gauss_seidel, max_row_sum,
    neighbour_source, spectral_radius_bound,
};
#[cfg(feature = "alloc")]
pub use vectors::{NeighbourVectors, WithPointwise, WithoutPointwise};
