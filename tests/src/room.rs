//! What the checks need to know of rooms, and the scenes of the tests.

mod described;
mod drawings;
mod setup;
mod vector;

pub use described::{Described, described, examined};
pub use drawings::{
    Drawing, Published, SQUARE_VALUE, block, crowd, doorway, facet, furnace, furnished, glowing,
    l_room, polygon, published, random, rectangle, scenes, square, yard,
};
pub use setup::{AnyNeighbour, Setup, WAYS, Way, assert_ok};
