// Its examples need what owns its buffers.
#![cfg_attr(feature = "alloc", doc = include_str!("../README.md"))]
#![cfg_attr(
    not(feature = "alloc"),
    doc = "See the README of the crate, or its documentation with the feature `alloc`."
)]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;

mod beam;
mod cells;
#[cfg(feature = "alloc")]
mod check;
#[cfg(feature = "alloc")]
mod clear;
#[cfg(feature = "alloc")]
mod clip;
#[cfg(feature = "alloc")]
mod close;
#[cfg(feature = "alloc")]
mod closed;
mod coloured;
#[cfg(feature = "alloc")]
mod contour;
mod crossed;
#[cfg(feature = "alloc")]
mod edges;
mod error;
#[cfg(feature = "alloc")]
mod events;
#[cfg(feature = "alloc")]
mod factors;
mod geometry;
#[cfg(feature = "alloc")]
mod hierarchy;
#[cfg(feature = "alloc")]
mod join;
mod lambert;
mod light;
mod means;
#[cfg(feature = "alloc")]
mod mesh;
#[cfg(feature = "alloc")]
mod occluders;
#[cfg(feature = "alloc")]
mod partial;
#[cfg(feature = "alloc")]
mod plane;
mod radiosity;
mod ray;
#[cfg(feature = "alloc")]
mod rules;
#[cfg(feature = "alloc")]
mod scene;
#[cfg(feature = "alloc")]
mod shaft;
#[cfg(feature = "alloc")]
pub mod shapes;
#[cfg(feature = "alloc")]
mod sights;
#[cfg(feature = "alloc")]
mod silhouette;
#[cfg(feature = "alloc")]
mod sky;
mod skylight;
#[cfg(feature = "alloc")]
mod sources;
#[cfg(feature = "alloc")]
mod sparse;
mod starts;
#[cfg(feature = "alloc")]
mod tables;
mod vector;
#[cfg(feature = "alloc")]
mod visible;

pub use beam::Beam;
pub use cells::{FacePatch, Side};
pub use coloured::Coloured;
pub use error::{Place, SceneError};
#[cfg(feature = "alloc")]
pub use factors::{Factors, Groups, factors};
pub use geometry::{Face, Geometry, Node, Triangle};
pub use lambert::form_factor_of_point;
pub use light::LastStepWork;
pub use means::Mean;
#[cfg(feature = "alloc")]
pub use means::{FaceStarts, areas};
#[cfg(feature = "alloc")]
pub use mesh::Cells;
pub use radiosity::{Point, Radiosity};
pub use ray::Hit;
#[cfg(feature = "alloc")]
pub use scene::{Enclosure, Material, Polygon, STEFAN_BOLTZMANN, Scene, Surface};
#[cfg(feature = "alloc")]
pub use sights::{Row, Sights};
#[cfg(feature = "alloc")]
pub use sky::{Patch, Sky, SkyFactors, SkyRow};
pub use skylight::SkyBand;
#[cfg(feature = "alloc")]
pub use skylight::SkyLight;
#[cfg(feature = "alloc")]
pub use sources::Sources;
#[cfg(feature = "alloc")]
pub use sparse::SparseFactors;
pub use starts::{Air, Facing, Irradiance};
#[cfg(feature = "alloc")]
pub use tables::Tables;
