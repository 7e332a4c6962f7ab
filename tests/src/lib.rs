#![doc = include_str!("../README.md")]

pub mod check;
pub mod circle;
pub mod counted;
pub mod cube;
pub mod description;
pub mod device;
pub mod examine;
pub mod fit;
pub mod galerkin;
pub mod outcome;
pub mod quadrature;
pub mod room;
pub mod runners;
pub mod toy;

pub use description::Description;
pub use examine::{Offers, Report, examine, examine_both, examine_masses};

/// The examples of the project's README are compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;
