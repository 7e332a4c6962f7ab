//! Neighbour equations from steps alone: for a chain of which no integrals are known.
//!
//! A step is a function of the state and of uniform numbers: y = y(x, ω), where ω ∈ [0, 1]^D are the first D numbers that it
//! draws. So T_k is an integral over a cube,
//!
//! ```text
//! (T_k v)(x) = ∫_[0,1]^D k(x, y(x, ω)) v(y(x, ω)) dω,
//! ```
//!
//! and with h = k the neighbour equation v = T_k v + G asks for nothing but G(x) = v(x) − (T_k v)(x), of which a random
//! number with this mean is enough. It is taken from a few steps ω_1 … ω_s at x, with a control variate c in the space of ω,
//! whose integral C is known:
//!
//! ```text
//! G(x) ≈ v(x) − C(x) − 1/s Σ_r (k v(y(x, ω_r)) − c(x, ω_r)),    C(x) = ∫ c(x, ω) dω.
//! ```
//!
//! This has the mean G(x) for any v and any c. No form factors, no kinds of pairs, no moments, and as much memory as there
//! are cells. It is the idea of Heinrich 1995 once more, a function near the integrand whose integral is known, this time in
//! the space of a step's random numbers. Not in the paper.
//!
//! c is, for x in cell i and ω in one of m^D equal boxes, linear: a combination of the basis ψ_ia(x), whose integral over the
//! box is itself times m^−D, and of the D coordinates of ω within the box, whose integrals are 0. Where k v(y(x, ω)) jumps
//! on surfaces that move with x, boxes blur it, and c may have [events](StepEvents) besides: sets A_g(x) of ω whose volume
//! P_g(x) is known, each with a combination of the ψ_ia(x), whose integral is itself times P_g(x).

mod control;
mod events;
#[cfg(feature = "alloc")]
mod fit;
#[cfg(feature = "alloc")]
mod setup;
#[cfg(feature = "alloc")]
mod tables;
#[cfg(feature = "alloc")]
mod variance;

pub use control::{Sampled, SampledError, StepControl};
pub use events::{NoEvents, SampledStep, StepEvents};
#[cfg(feature = "alloc")]
pub use setup::{CellSteps, SampledSetup, SampledSolution, SetupOptions, SolvedSteps};
#[cfg(feature = "alloc")]
pub use tables::SampledTables;
#[cfg(feature = "alloc")]
pub use variance::ScoreVariance;
