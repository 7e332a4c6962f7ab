#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;

mod cube;
mod equation;
mod error;
mod factors;
mod functions;
#[cfg(feature = "alloc")]
mod level;
mod mean;
mod mesh;
pub mod model;
mod product;
#[cfg(feature = "alloc")]
mod product_tables;
mod rule;
#[cfg(feature = "alloc")]
mod solution;
mod table;

pub use cube::Cube;
pub use equation::{CellIntegral, Function, IntegralKernel};
pub use error::CubeError;
pub use factors::FactorTables;
pub use functions::functions;
#[cfg(feature = "alloc")]
pub use level::CubeLevel;
pub use mean::{Mean, Weighted};
pub use product::{FactorIntegral, KernelFactors, Product};
#[cfg(feature = "alloc")]
pub use product_tables::ProductTables;
pub use rule::Rule;
#[cfg(feature = "alloc")]
pub use solution::{absolute_radius, empty_table, table};
pub use table::table_bytes;
