#![doc = include_str!("../README.md")]

pub mod check;
pub mod description;
pub mod examine;
pub mod galerkin;
pub mod offers;
pub mod outcome;
pub mod quadrature;
pub mod report;
pub mod runners;
pub mod template;

pub use description::Description;
pub use examine::{examine, examine_both, examine_masses, examine_steps, examine_steps_both};
pub use offers::{Neighbours, Offers};
pub use report::Report;
