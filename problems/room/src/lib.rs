// Its examples need what owns its buffers.
#![cfg_attr(feature = "alloc", doc = include_str!("../README.md"))]
#![cfg_attr(
    not(feature = "alloc"),
    doc = "See the README of the crate, or its documentation with the feature `alloc`."
)]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;

mod cast;
#[cfg(feature = "alloc")]
mod closed;
#[cfg(feature = "alloc")]
mod coarse;
mod coloured;
#[cfg(feature = "alloc")]
mod covered;
mod error;
mod exact;
#[cfg(feature = "alloc")]
mod exchange;
#[cfg(feature = "alloc")]
mod factors;
mod functional;
mod geometry;
#[cfg(feature = "alloc")]
mod hierarchy;
mod light;
#[cfg(feature = "alloc")]
mod matrix;
#[cfg(feature = "alloc")]
mod mesh;
mod moments;
mod pairs;
mod panels;
mod partition;
#[cfg(feature = "alloc")]
mod quadrature;
#[cfg(feature = "alloc")]
mod ray_boxes;
#[cfg(feature = "alloc")]
mod ray_setup;
#[cfg(feature = "alloc")]
mod ray_tables;
mod rays;
mod room;
#[cfg(feature = "alloc")]
mod scene;
#[cfg(feature = "alloc")]
mod shadows;
#[cfg(feature = "alloc")]
mod sides;
#[cfg(feature = "alloc")]
mod solution;
#[cfg(feature = "alloc")]
mod tables;
mod vector;
#[cfg(feature = "alloc")]
mod views;
mod visible;

#[cfg(feature = "alloc")]
pub use coarse::CoarseSolution;
pub use coloured::{ColouredRoom, WallColours};
#[cfg(feature = "alloc")]
pub use covered::Covered;
pub use error::{Place, RoomError};
pub use exact::ExactNeighbour;
#[cfg(feature = "alloc")]
pub use factors::exchanges;
pub use fredholm_surfaces::{Enclosure, Material, STEFAN_BOLTZMANN};
pub use functional::{Irradiance, MeanOver, Seen};
pub use geometry::{Geometry, Hit, Node, Strip, Wall};
pub use light::RoomEquation;
#[cfg(feature = "alloc")]
pub use light::{DirectLight, subtract_lights};
#[cfg(feature = "alloc")]
pub use matrix::{MIN_MASS_RATIO, Matrix, min_mass_ratio};
#[cfg(feature = "alloc")]
pub use mesh::{Grading, Mesh};
pub use pairs::{Choice, RoomPairs, Visibility, VisibilityTable};
pub use partition::{Edge, Partition, PartitionTables};
#[cfg(feature = "alloc")]
pub use quadrature::RoomQuadrature;
#[cfg(feature = "alloc")]
pub use ray_boxes::CellRays;
#[cfg(feature = "alloc")]
pub use ray_setup::RaySetup;
#[cfg(feature = "alloc")]
pub use ray_tables::RayTables;
pub use rays::{RayControl, RayNeighbour, Share, Stretch};
pub use room::{Point, Room};
#[cfg(feature = "alloc")]
pub use scene::{Scene, Surface};
#[cfg(feature = "alloc")]
pub use shadows::Shadows;
#[cfg(feature = "alloc")]
pub use solution::side_by_side;
#[cfg(feature = "alloc")]
pub use tables::Tables;
