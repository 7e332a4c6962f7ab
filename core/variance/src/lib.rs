#![doc = include_str!("../README.md")]
#![no_std]

extern crate alloc;
#[cfg(test)]
extern crate std;

mod analysis;
mod bounds;
mod drawn;
mod error;
mod gauss;
mod matrix;
mod model;
mod passes;
mod quadrature;
mod section4;
mod setup;
mod site;
mod sources;
mod survival;
mod target;

pub use analysis::{Analysis, Pass, Run, serially};
pub use bounds::{Bounds, Quantities};
pub use drawn::{DrawCounts, DrawnModel, DrawnSite, DrawnStart, Draws, SiteDensity, Walked};
pub use error::VarianceError;
pub use gauss::{gauss, gauss_lobatto};
pub use matrix::Power;
pub use model::{Origin, Position, Transition, Values, VarianceModel, Wanted};
pub use quadrature::{Quadrature, Step};
pub use section4::{MeanCoefficients, PairQuantities, pair_quantities};
pub use setup::{PointModel, VarianceSetup};
pub use site::{Node, Site};
pub use target::{Attribution, Contribution, Density, Parts, Prediction, Start};
