#![doc = include_str!("../README.md")]

pub mod answer;
pub mod choice;
pub mod circle;
pub mod cost;
pub mod cube;
mod device;
pub mod diagnosis;
mod error;
mod examined;
mod finite;
mod goal;
mod memory;
pub mod model;
pub mod numbers;
mod options;
mod pairs;
pub mod report;
pub mod room;
mod settings;
mod solver;
pub mod sphere;
pub mod sweep;

pub use circle::CircleModel;
pub use cube::CubeModel;
pub use error::{Error, Subject};
pub use examined::Examined;
pub use fredholm_core::{Estimator, Tolerance};
pub use goal::{Ask, Goal, Region, Target, goals};
pub use memory::{bytes, refuse_beyond_memory};
pub use model::{About, Derived, Flux, Heat, Model, Partitioned, Prepared, Request, System, Then};
pub use options::{Choice, Choices, Pairs, Scalar};
pub use pairs::PairCounts;
pub use room::RoomModel;
pub use settings::{Discretisation, Settings, WalkOptions};
pub use solver::{Point, SolveError, Solver};
pub use sphere::SphereModel;
