#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;

#[cfg(feature = "alloc")]
mod builder;
mod checksum;
mod driver;
mod state;
mod tables;

#[cfg(feature = "alloc")]
pub use builder::{Fields, Number, TableBuilder};
pub use driver::{Driver, DriverError, Progress};
pub use state::{State, StateError};
pub use tables::{Aligned, TableError, Tables};
#[cfg(feature = "zerocopy")]
pub use zerocopy;
