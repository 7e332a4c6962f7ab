//! The global estimate: u at all points from one set of walks.
//!
//! With v the Galerkin solution, F + T_K v its iterate (Sloan 1976) and e = u − v,
//!
//! ```text
//! u = F + T_K v + T_K e.
//! ```
//!
//! The first two terms are deterministic. Walks are needed for e alone, and only for what T_K lets through of it: T_K is
//! smooth, so that a projection ê of e on piecewise polynomials serves in its place, and an estimate of ê serves every x:
//!
//! ```text
//! ũ(x) = F(x) + (T_K v)(x) + Σ_jb ê_jb ∫_Xj K(x,y) ψ_jb(y) dμ(y),      ê_jb = 1/μ(X_j) ∫_Xj e ψ_jb dμ.
//! ```
//!
//! Heinrich 1998 has the idea of estimating a function with the smoothness that it has.
//!
//! # Every state is a start
//!
//! The chain **preserves a density** p0 if ∫ p0(x) p(x,y) dμ(x) = p0(y): see [`Stationary`]. Let absorption be constant, s = 1 − q0, let
//! x_0 be drawn from p0, and let D_l be what the walk scores from x_l on, with weight 1 in x_l: η(k,f) − η(h,g) of the
//! *suffix* x_l, x_(l+1), …. Then for every function ψ and every N
//!
//! ```text
//! E Σ_{l < N, l ≤ m} D_l ψ(x_l)/p0(x_l) = S_N ∫ e ψ dμ,      S_N = 1 + s + … + s^(N−1).
//! ```
//!
//! *Proof.* The walk has an l-th state with the density s^l p0, by induction on l. Given x_0 … x_l, the rest of the walk is
//! a walk that starts in x_l, so that E D_l = e(x_l). Hence term l is s^l ∫ e ψ dμ. ∎
//!
//! With forced steps the powers of s begin behind them.
//!
//! The proof needs that what decides whether x_l is scored, here l < N, depends on the past of x_l only. To score the
//! *last* N states would be a bias. So N states of a walk are kept, and it takes no more memory however long it becomes:
//! from x_N on it is followed as a walk that starts there, which gives the score of that suffix, and those of the kept
//! states follow backwards by a_l = k(x_l,x_(l+1))/s a_(l+1), to which collision adds F(x_l), and likewise with h and G.
//!
//! Where the chain preserves no density that is known, N is 1: starts alone are scored. So it is with roulette, by which a state
//! is more or less frequent as weights are.
//!
//! # Replicates
//!
//! Scores of one walk in several states depend on each other, so error bars come from independent [`Replicate`]s, some
//! tens of them: walk w belongs to replicate w mod R. Each has its own sums; they are never merged, so that the bits do
//! not depend on threads. [`over_replicates`] gives mean and standard error of any number that is linear in ê, and
//! [`band_factor`] the width of a band that holds for all x at once.
//!
//! # What it does not do
//!
//! The projection of e loses T_K(I − P)e, which no error bar sees. It is of the order 2(degree + 1) in the cells' width,
//! where T_K smooths as much. [`AdjointScores`] lose nothing, for some functionals that are known before the walks. P is on polynomials of one to three degrees more than v: a Galerkin v leaves a residual
//! that is orthogonal to its own space, so that scores on that space alone find nothing.
//!
//! # References
//!
//! S. Heinrich, *Monte Carlo complexity of global solution of integral equations*, J. Complexity 14, 1998.
//! I. H. Sloan, *Improvement by iteration for compact operator equations*, Math. Comp. 30, 1976.

mod band;
mod chain;
mod replicate;
mod scores;
mod suffixes;
mod task;
#[cfg(test)]
mod tests;

pub use band::{MOST_REPLICATES, Replicated, band_factor, over_replicates};
pub use chain::Stationary;
pub use replicate::{Normalisation, Replicate, ReplicateCounts};
pub use scores::{AdjointImage, AdjointScores, BasisScores, Scores, sum_of};
pub use task::{GLOBAL, GlobalJob, GlobalTask, KEPT_STATES};
