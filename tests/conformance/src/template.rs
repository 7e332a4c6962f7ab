//! A problem crate to copy, file by file: the equation u(x) = ∫₀¹ ½ x y u(y) dy + x in a crate `fredholm-my-equation`.
//!
//! It depends on `fredholm-core`, and for its tests on `fredholm-conformance` and `fredholm`.
//!
//! `src/lib.rs`:
//!
//! ```rust,ignore
#![doc = include_str!("../files/equation.rs")]
//! ```
//!
//! `tests/conformance.rs`:
//!
//! ```rust,ignore
#![doc = include_str!("../files/conformance.rs")]
//! ```
//!
//! `examples/solve.rs`:
//!
//! ```rust,ignore
#![doc = include_str!("../files/solve.rs")]
//! ```
