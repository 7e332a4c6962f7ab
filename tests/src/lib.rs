//! Checks that every problem must pass, and a toy problem that exercises every seam of the core.

pub mod check;
pub mod circle;
pub mod quadrature;
pub mod toy;
