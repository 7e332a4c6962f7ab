// Its examples need what owns its buffers.
#![cfg_attr(feature = "alloc", doc = include_str!("../README.md"))]
#![cfg_attr(
    not(feature = "alloc"),
    doc = "See the README of the crate, or its documentation with the feature `alloc`."
)]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;

#[cfg(feature = "alloc")]
mod coefficients;
mod error;
#[cfg(feature = "alloc")]
mod harmonics;
mod mean;
#[cfg(feature = "alloc")]
mod quadrature;
#[cfg(feature = "alloc")]
mod solution;
mod sphere;

#[cfg(feature = "alloc")]
pub use coefficients::MeanTable;
pub use error::SphereError;
#[cfg(feature = "alloc")]
pub use harmonics::Harmonics;
pub use mean::Mean;
#[cfg(feature = "alloc")]
pub use quadrature::SphereQuadrature;
pub use sphere::{Parameters, Point, Sphere, point};
