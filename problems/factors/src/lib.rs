#![doc = include_str!("../README.md")]
#![no_std]

extern crate alloc;

mod bodies;
mod clear;
mod clip;
mod close;
mod contour;
mod edges;
mod error;
mod events;
mod flat;
mod groups;
mod holes;
mod occluders;
mod partial;
mod points;
mod rays;
mod rules;
mod segments;
mod shaft;
mod sights;
mod silhouette;
mod sky;
mod sparse;
mod table;
mod walls;

pub use error::FactorsError;
pub use groups::{Groups, SkyFactors};
pub use rays::{RAYS_OF_BLOCK, RayCounts, RayFactor, RayFactors, Rays};
pub use sights::{Row, Sights, SkyRow};
pub use sky::{Patch, Sky};
pub use sparse::SparseFactors;
pub use table::{Factors, scene_factors};
pub use walls::room_factors;
