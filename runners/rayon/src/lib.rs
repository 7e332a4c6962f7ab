#![doc = include_str!("../README.md")]

mod plan;
mod rows;
mod run;

/// When a run stops: the core's, as every runner shares them.
pub use fredholm_core::{ENOUGH_BATCHES, ENOUGH_SCORES, TargetError};
pub use plan::{Plan, Target};
pub use rows::fill_rows;
pub use run::{Observer, Outcome, RunError, Stop, run};
