//! Checks that every problem must pass, and a toy problem that exercises every seam of the core.

pub mod check;
pub mod circle;
pub mod cube;
pub mod quadrature;
pub mod toy;

/// The README's examples are compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;
