#![doc = include_str!("../README.md")]

mod content;
mod error;
mod file;
mod frames;
mod identity;
mod keep;
mod merge;
mod notes;
pub mod output;
mod share;
mod system;
mod team;

pub use content::{Content, Record, Run, Seconds};
pub use error::PartError;
pub use file::PartFile;
pub use identity::{Header, JobRecord};
pub use keep::{Keeper, Ready};
pub use merge::{Behind, Merged, merge};
pub use notes::options_of_the_problem;
pub use share::{Share, ShareError};
pub use system::{SystemContent, SystemFile};
pub use team::{Alone, END, Team, TeamWork};
