#![doc = include_str!("../README.md")]

mod bands;
mod canvas;
mod contours;
mod curves;
mod drawing;
mod error;
mod frame;
mod gltf;
mod grid;
mod legend;
mod mesh;
mod page;
mod picture;
mod scale;
mod shares;
mod strips;

pub use bands::{Axis, GridCurve, GridPoint, ProfilePlot};
pub use canvas::{Canvas, Piece, Wall};
pub use curves::{Curve, LogLogPlot, Style};
pub use drawing::{Drawing, SpaceDrawing};
pub use error::Error;
pub use frame::panel_width;
pub use grid::GridPicture;
pub use mesh::{Cell, Mesh, Quantity, lattice};
pub use page::Figure;
pub use picture::{Overlay, Panel, Picture, Shades};
pub use scale::Scale;
pub use shares::ShareTable;
