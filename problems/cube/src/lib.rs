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
mod adaptive;
mod cube;
mod equation;
mod error;
#[cfg(feature = "alloc")]
mod exact_source;
mod factors;
mod functions;
mod mean;
mod mesh;
pub mod model;
#[cfg(feature = "alloc")]
mod moments;
mod product;
#[cfg(feature = "alloc")]
mod product_tables;
#[cfg(feature = "alloc")]
mod quadrature;
mod rule;
mod scores;
#[cfg(feature = "alloc")]
mod setup;
#[cfg(feature = "alloc")]
mod solution;
mod table;

pub use cube::Cube;
pub use equation::{KernelFn, KernelIntegral, ScalarField};
pub use error::CubeError;
#[cfg(feature = "alloc")]
pub use exact_source::{ExactSource, REPLICATES};
pub use factors::FactorTables;
pub use functions::{CellFunctions, functions};
pub use mean::{Mean, Weighted};
#[cfg(feature = "alloc")]
pub use moments::KernelMoments;
pub use product::{FactorIntegral, KernelFactors, Product};
#[cfg(feature = "alloc")]
pub use product_tables::ProductTables;
#[cfg(feature = "alloc")]
pub use quadrature::CubeQuadrature;
pub use rule::Rule;
pub use scores::{CubeScores, degrees};
#[cfg(feature = "alloc")]
pub use setup::CubeSetup;
#[cfg(feature = "alloc")]
pub use solution::{absolute_radius, empty_table, table};
pub use table::table_bytes;
