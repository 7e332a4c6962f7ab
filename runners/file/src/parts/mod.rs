#![doc = include_str!("README.md")]

mod container;
mod error;
mod identity;
mod keep;
mod merge;
pub mod output;
mod part;
mod report;
mod share;
mod system;

pub use error::FileError;
pub use identity::{Header, JobRecord, Named};
pub use keep::Keeper;
pub use merge::{Merged, merge};
pub use part::{Batches, Part, Run, Seconds};
pub use report::merged;
pub use share::{Share, ShareError};
pub use system::{SystemContent, SystemFile};
