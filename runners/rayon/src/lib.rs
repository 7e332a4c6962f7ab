#![doc = include_str!("../README.md")]

mod replicates;
mod rows;
mod run;

pub use replicates::Replicates;
pub use rows::fill_rows;
pub use run::{Observer, Outcome, RunError, run};

pub use fredholm_core::Tail;
