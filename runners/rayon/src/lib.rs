#![doc = include_str!("../README.md")]

mod replicates;
mod rows;
mod run;
mod tail;

pub use replicates::Replicates;
pub use rows::fill_rows;
pub use run::{Observer, Outcome, RunError, run};
pub use tail::Tail;
