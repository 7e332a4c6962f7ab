#![doc = include_str!("../README.md")]

mod plan;
mod rows;
mod run;

pub use plan::{ENOUGH_BATCHES, ENOUGH_SCORES, Plan, Target, TargetError};
pub use rows::fill_rows;
pub use run::{Observer, Outcome, RunError, Stop, run};
