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
mod backs;
mod beam;
mod cells;
#[cfg(feature = "alloc")]
mod check;
#[cfg(feature = "alloc")]
mod closed;
mod coloured;
#[cfg(feature = "alloc")]
mod contacts;
mod crossed;
mod error;
mod geometry;
#[cfg(feature = "alloc")]
mod join;
mod lambert;
mod light;
mod means;
#[cfg(feature = "alloc")]
mod mesh;
#[cfg(feature = "alloc")]
mod planes;
mod precision;
mod radiosity;
mod ray;
#[cfg(feature = "alloc")]
mod scene;
#[cfg(feature = "alloc")]
pub mod shapes;
mod skylight;
#[cfg(feature = "alloc")]
mod sources;
mod starts;
mod sunlight;
#[cfg(feature = "alloc")]
mod tables;

use fredholm_surfaces::space as vector;

pub use beam::Beam;
pub use cells::{CellTables, FacePatch, Side};
pub use coloured::Coloured;
#[cfg(feature = "alloc")]
pub use contacts::Covered;
pub use error::{Place, SceneError};
#[cfg(feature = "alloc")]
pub use fredholm_surfaces::ColourTables;
pub use fredholm_surfaces::{
    Colours, Enclosure, Grey, Material, STEFAN_BOLTZMANN, Tint, Wide, share,
};
pub use geometry::{Face, Geometry, Node, Triangle};
pub use lambert::{form_factor_from_origin, form_factor_of_point};
#[cfg(feature = "alloc")]
pub use means::areas;
pub use means::{Mean, Ray};
#[cfg(feature = "alloc")]
pub use mesh::Cells;
pub use precision::{Precision, Rounding};
pub use radiosity::{Point, Radiosity};
pub use ray::Hit;
#[cfg(feature = "alloc")]
pub use scene::{Polygon, Scene, Surface};
pub use skylight::SkyBand;
#[cfg(feature = "alloc")]
pub use skylight::SkyLight;
#[cfg(feature = "alloc")]
pub use sources::Sources;
pub use starts::{Air, Facing, Irradiance};
#[cfg(feature = "alloc")]
pub use tables::Tables;
