#![doc = include_str!("../README.md")]

mod along;
mod base64;
mod canvas;
mod contours;
mod curves;
mod density;
mod drawing;
mod error;
mod frame;
mod gltf;
mod grid;
mod legend;
mod mesh;
mod picture;
mod profile;
mod raster;
mod scale;
mod shares;
mod space;
mod strips;
mod view;

pub use along::{GridCurve, GridPoint};
pub use canvas::{Canvas, Piece, Wall};
pub use curves::{Axis, BandPlot, Curve, LogLogPlot, Style, stacked};
pub use density::WallDensity;
pub use drawing::Drawing;
pub use error::Error;
pub use frame::panel_width;
pub use grid::GridPicture;
pub use mesh::{Cell, Mesh, Quantity, lattice};
pub use picture::{Panel, RoomPicture};
pub use profile::ProfilePlot;
pub use scale::Scale;
pub use shares::ShareTable;
pub use space::SpaceDrawing;
pub use view::{ViewPanel, ViewPicture};
