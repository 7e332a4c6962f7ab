// Its examples need what owns its buffers.
#![cfg_attr(feature = "alloc", doc = include_str!("../README.md"))]
#![cfg_attr(
    not(feature = "alloc"),
    doc = "See the README of the crate, or its documentation with the feature `alloc`."
)]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(test)]
extern crate std;

mod circle;
mod constants;
mod double;
mod emission;
mod error;
mod geometry;
#[cfg(feature = "alloc")]
mod lit;
mod mean;
mod quadrature;
mod residual;
mod series;
mod system;
mod tables;

pub use circle::{Circle, Point};
pub use constants::{Constants, MOST_FUNCTIONS};
pub use emission::{Arcs, Emission, Harmonic};
pub use error::CircleError;
#[cfg(feature = "alloc")]
pub use lit::{Light, LitArcs};
pub use mean::MeanOver;
pub use residual::{Moment, Residual};
pub use system::GalerkinSystem;
#[cfg(feature = "alloc")]
pub use tables::OwnedTables;
pub use tables::{BorrowedTables, Cell, Direction, Slot, Tables, slots};
