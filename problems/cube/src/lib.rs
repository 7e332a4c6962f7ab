// Its examples need what owns its buffers.
#![cfg_attr(feature = "alloc", doc = include_str!("../README.md"))]
#![cfg_attr(
    not(feature = "alloc"),
    doc = "See the README of the crate, or its documentation with the feature `alloc`."
)]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;

mod cube;
mod equation;
mod error;
mod functions;
mod mean;
mod mesh;
mod product;
mod product_tables;
#[cfg(feature = "alloc")]
mod rule;
mod scores;

pub use cube::Cube;
pub use equation::{KernelFn, KernelIntegral, ScalarField};
pub use error::CubeError;
pub use functions::{degrees, polynomials};
pub use mean::{Mean, Weighted};
pub use product::{FactorIntegral, KernelFactors, Product};
pub use product_tables::ProductTables;
#[cfg(feature = "alloc")]
pub use rule::CubeRule;
pub use scores::CubeScores;
