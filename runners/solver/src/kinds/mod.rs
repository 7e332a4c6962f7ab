//! The kinds of equations that follow from what a problem states.

pub mod circle;
pub mod sphere;
