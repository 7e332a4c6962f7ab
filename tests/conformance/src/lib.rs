#![doc = include_str!("../README.md")]

pub mod check;
pub mod description;
pub mod examine;
pub mod galerkin;
pub mod outcome;
pub mod quadrature;
pub mod runners;
pub mod template;

pub use description::Description;
pub use examine::{Offers, Report, examine, examine_both, examine_masses};
