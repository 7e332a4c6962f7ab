//! What the checks need to know of rooms, and the scenes of the tests.

mod degrees;
mod described;
mod drawings;
mod setup;
mod vector;
mod walks;

pub use degrees::examined_of_degree;
pub use described::{Described, described, examined};
pub use drawings::{
    Drawing, Published, SQUARE_VALUE, block, crowd, doorway, facet, furnace, furnished, glowing,
    l_room, polygon, published, random, rectangle, scenes, square, yard,
};
pub use setup::{CHOICES, OfDegree, RoomNeighbour, Setup};
pub use walks::{assert_ok, task};

/// The absorption probability q0 of the tests.
pub const ABSORPTION: f64 = 0.2;
