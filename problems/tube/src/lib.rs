#![doc = include_str!("../README.md")]
#![no_std]

mod error;
mod tube;

pub use error::TubeError;
pub use tube::{Parameters, Tube};
