#![doc = include_str!("../README.md")]

mod crew;
mod gather;
mod replicates;
mod rows;
mod run;
mod stage;
mod store;

pub use crew::{Crew, Finished, Piece, Threads, Work, threads};
pub use gather::{Gather, gathered, is_complete, is_incomplete, leave_out, with_gather};
pub use replicates::Replicates;
pub use rows::fill_rows;
pub use run::{Observer, Outcome, RunError, Runner, run, stop};
pub use store::BatchStore;

pub use fredholm_core::Tail;
