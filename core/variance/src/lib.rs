#![doc = include_str!("../README.md")]
#![no_std]

extern crate alloc;
#[cfg(test)]
extern crate std;

mod analysis;
mod bounds;
mod choose;
mod error;
mod flow;
mod gauss;
mod level;
mod matrix;
mod model;
mod passes;
mod row;
mod section4;
mod setting;
mod site;
mod sources;
mod target;

pub use analysis::{Analysis, Pass, Run, serially};
pub use bounds::{Bounds, Quantities};
pub use choose::{Chosen, Possible, Row, Terms, Worth};
pub use error::VarianceError;
pub use gauss::gauss;
pub use level::{Level, Step};
pub use matrix::Power;
pub use model::{Origin, Position, Transition, Values, VarianceModel, Wanted};
pub use section4::{MeanCoefficients, PairQuantities, pair_quantities};
pub use setting::{PointModel, Setting};
pub use site::{Moments, Node, Site};
pub use target::{Attribution, Contribution, Density, Parts, Prediction, Start};
