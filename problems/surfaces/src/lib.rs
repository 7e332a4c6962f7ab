#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;

#[cfg(feature = "alloc")]
mod forest;
#[cfg(feature = "alloc")]
mod hierarchy;
mod limits;
mod material;
pub mod space;
mod tint;
mod tree;

#[cfg(feature = "alloc")]
pub use forest::Forest;
#[cfg(feature = "alloc")]
pub use hierarchy::{Bounds, Branch, Costs, Cutting, Item, balanced, build, hull, join, nothing};
pub use limits::{Limits, margin};
pub use material::{Material, MaterialFault, STEFAN_BOLTZMANN};
#[cfg(feature = "alloc")]
pub use tint::ColourTables;
pub use tint::{Colours, Grey, Tint, Wide, share};
pub use tree::{DEPTH, Trace, TreeNode, is_tree, leaves, trace};

/// Whether light may leave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Enclosure {
    /// Surfaces must be closed: what a ray leaves is refused.
    Closed,
    /// Light that leaves, or that meets a surface from behind, is absorbed.
    Open,
}

/// Which surfaces a ray meets, beside their active sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backs {
    /// A ray passes through backs.
    Pass,
    /// A back stops a ray.
    Block,
}
