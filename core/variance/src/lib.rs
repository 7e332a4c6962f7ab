#![doc = include_str!("../README.md")]
#![no_std]

extern crate alloc;
#[cfg(test)]
extern crate std;

mod analysis;
mod bounds;
mod choose;
mod drawn;
mod error;
mod flow;
mod gauss;
mod matrix;
mod model;
mod passes;
mod quadrature;
mod row;
mod section4;
mod setup;
mod site;
mod sources;
mod target;

pub use analysis::{Analysis, Pass, Run, serially};
pub use bounds::{Bounds, Quantities};
pub use choose::{AllowedKinds, FigureOfMerit, PairCosts, PairSelection, Row};
pub use drawn::{DrawCounts, DrawnModel, DrawnSite, DrawnStart, Draws, SiteDensity};
pub use error::VarianceError;
pub use gauss::gauss;
pub use matrix::Power;
pub use model::{Origin, Position, Transition, Values, VarianceModel, Wanted};
pub use quadrature::{Quadrature, Step};
pub use section4::{MeanCoefficients, PairQuantities, pair_quantities};
pub use setup::{PointModel, VarianceSetup};
pub use site::{Moments, Node, Site};
pub use target::{Attribution, Contribution, Density, Parts, Prediction, Start};
