#![doc = include_str!("../README.md")]
#![no_std]

mod error;
mod sphere;

pub use error::SphereError;
pub use sphere::{Parameters, Point, Sphere, point};
