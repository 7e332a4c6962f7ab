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
#[cfg(feature = "alloc")]
mod covered;
mod error;
mod exact;
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
mod outside;
mod panels;
#[cfg(feature = "alloc")]
mod paper;
mod partition;
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
mod tables;
mod vector;
#[cfg(feature = "alloc")]
mod views;
mod visible;

#[cfg(feature = "alloc")]
pub use coarse::CoarseSolution;
#[cfg(feature = "alloc")]
pub use covered::Covered;
pub use error::{Place, RoomError};
pub use exact::ExactNeighbour;
#[cfg(feature = "alloc")]
pub use factors::exchanges;
#[cfg(feature = "alloc")]
pub use fredholm_surfaces::ColourTables;
pub use fredholm_surfaces::{Colours, Enclosure, Grey, Material, STEFAN_BOLTZMANN, Tint, Wide};
pub use functional::{Irradiance, MeanOver, Seen};
pub use geometry::{Geometry, Hit, Node, Strip, Wall};
#[cfg(feature = "alloc")]
pub use light::{DirectLight, subtract_lights};
#[cfg(feature = "alloc")]
pub use matrix::{Matrix, RowFill, side_by_side};
#[cfg(feature = "alloc")]
pub use mesh::{Grading, Mesh};
pub use outside::Outside;
#[cfg(feature = "alloc")]
pub use paper::paper_pairs;
pub use partition::{Edge, Partition, PartitionTables};
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
pub use tables::Tables;
