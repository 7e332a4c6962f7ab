#![doc = include_str!("../README.md")]

pub mod circle;
mod cores;
pub mod cube;
pub mod device;
pub mod device_tables;
pub mod fit;
mod objects;
mod options;
pub mod room;
pub mod scene;
pub mod toy;

pub use cores::on_all_cores;
/// The kit, which the project's own tests build on.
pub use fredholm_conformance::*;
pub use objects::{AnyNeighbour, ObjectGoals, Objects, run};
pub use options::{absorbed, all_ways, paper, seeded};
