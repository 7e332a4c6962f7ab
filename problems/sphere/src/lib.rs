#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;

#[cfg(feature = "alloc")]
mod coefficients;
mod error;
#[cfg(feature = "alloc")]
mod level;
mod mean;
#[cfg(feature = "alloc")]
mod solution;
mod sphere;

#[cfg(feature = "alloc")]
pub use coefficients::MeanTable;
pub use error::SphereError;
#[cfg(feature = "alloc")]
pub use level::SphereLevel;
pub use mean::Mean;
pub use sphere::{Parameters, Point, Sphere, point};
