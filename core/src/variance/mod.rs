//! The variance of both estimates before a single walk: Proposition 2 of Heinrich 1995 made numerical.
//!
//! # Formulas
//!
//! Let Δ = η(k,f) − η(h,g) on a walk that begins in x, and D = k − h. A step from x to y gives
//! η(k,f) = k η(k,f)(y), η(h,g) = h η(h,g)(y), hence Δ = k Δ(y) + D η(h,g)(y), and for
//!
//! ```text
//! e(x) = E Δ,   s(x) = E η(h,g)²,   c(x) = E Δ η(h,g),   w(x) = E Δ²
//!
//! e = T_kp e + r,                    r = F − G + T_Dp v
//! s = T_h²p s + g²q
//! c = T_khp c + T_hDp s + (f − g) g q
//! w = T_k²p w + 2 T_kDp c + T_D²p s + (f − g)² q
//! Var ζ = (w, φ²p0) − (e, φp0)²
//! ```
//!
//! This is (16) with its three resolvents, in a form in which nothing cancels: Var ζ may be 10⁻¹⁸ of Var η,
//! and the differences D and F − G are taken point by point. e = u − v is the error of the Galerkin
//! solution.
//!
//! With the collision estimator η_c(x) = F(x) + k η_c(y), and E η_c(h,G) = v, so that the sources of s, c
//! and w are 2Gv − G², (F − G) v + G (e − (F − G)) and 2 (F − G) e − (F − G)². (h = k, G = F gives the
//! plain estimate's: 2Fu − F².)
//!
//! # Numerics
//!
//! A [`Level`] cuts X into sites and has nodes and weights on them. The equations are solved for means over
//! sites; then every function is taken in the nodes, where the operator of its equation is applied once more
//! to what is known there. That is what it takes where a function meets the difference D, which varies
//! within the same cell (T_kDp c, T_D²p s, T_Dp v). So the error is of second order in the size of a site,
//! relative to the variance.

mod analysis;
mod bounds;
mod choose;
mod gauss;
mod level;
mod section4;
mod site;
mod target;

pub use analysis::{Analysis, Pass, Power, Setting, VarianceError, serially};
pub use bounds::{Bounds, Quantities};
pub use choose::{Chosen, Possible, Row, Terms, Worth};
pub use gauss::gauss;
pub use level::{Level, Step};
pub use section4::PairQuantities;
pub use site::{Moments, Node, Site};
pub use target::{Attribution, Contribution, Density, Parts, Prediction, Start};
