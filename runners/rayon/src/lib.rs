#![doc = include_str!("../README.md")]

mod plan;
mod run;

pub use plan::{ENOUGH_BATCHES, ENOUGH_SCORES, Plan, Target, TargetError};
pub use run::{Observer, Outcome, RunError, Stop, run};
