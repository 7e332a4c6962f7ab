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

mod cells;
mod circle;
mod coefficients;
mod double;
mod emission;
mod error;
#[cfg(feature = "lanes")]
mod lanes;
mod light;
mod mean;
mod polynomials;
mod quadrature;
mod residual;
mod series;
#[cfg(feature = "alloc")]
mod sites;
#[cfg(feature = "alloc")]
mod solution;
#[cfg(feature = "lanes")]
mod whole_lanes;

pub use cells::{Cell, Cells, Direction, Slot, slots};
pub use circle::{Circle, Constants, Point};
pub use emission::{Arcs, Emission, Harmonic};
pub use error::CircleError;
#[cfg(feature = "lanes")]
pub use lanes::{LaneNeighbour, LanePairs, LaneReal, SideBySide};
pub use light::{ArcLight, DirectLight};
pub use mean::MeanOver;
pub use polynomials::{CircleScores, PolynomialCircle};
pub use residual::{ClosedForm, Moment, Residual, moments};
#[cfg(feature = "alloc")]
pub use sites::CircleQuadrature;
#[cfg(feature = "alloc")]
pub use solution::{
    Tables, neighbour_second_moment_radius, residual_moments, second_moment_radius,
};
#[cfg(feature = "lanes")]
pub use whole_lanes::{WholeLaneReal, WholeSideBySide};
