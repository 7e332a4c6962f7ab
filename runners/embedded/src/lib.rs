#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;

#[cfg(feature = "alloc")]
mod builder;
mod checksum;
mod driver;
mod state;
mod table;

#[cfg(feature = "alloc")]
pub use builder::{Number, TableBuilder};
pub use driver::{Driver, Progress};
pub use state::{State, StateError};
pub use table::{Aligned, Table, TableError};
#[cfg(feature = "zerocopy")]
pub use zerocopy;
