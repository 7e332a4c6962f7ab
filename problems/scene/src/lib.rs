#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;

#[cfg(feature = "alloc")]
mod check;
#[cfg(feature = "alloc")]
mod closed;
mod error;
mod geometry;
#[cfg(feature = "alloc")]
mod hierarchy;
#[cfg(feature = "alloc")]
mod join;
mod ray;
#[cfg(feature = "alloc")]
mod scene;
#[cfg(feature = "alloc")]
pub mod shapes;
#[cfg(feature = "alloc")]
mod tables;
mod vector;

pub use error::{Place, SceneError};
pub use geometry::{Face, Geometry, Node, Triangle};
pub use ray::Hit;
#[cfg(feature = "alloc")]
pub use scene::{Enclosure, Material, Polygon, STEFAN_BOLTZMANN, Scene, Surface};
#[cfg(feature = "alloc")]
pub use tables::Tables;
