//! What can be wrong with a room.

use core::fmt;

use fredholm_core::galerkin::GalerkinError;
use fredholm_core::refused;

/// A vertex of a surface, both counted from 0; also the segment of the surface that starts there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The number of the surface.
    pub surface: usize,
    /// The number of the vertex within it.
    pub vertex: usize,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "surface {}, vertex {}", self.surface, self.vertex)
    }
}

/// Why there is no such room, table or solution.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum RoomError {
    /// There is no surface.
    Empty,
    /// A surface has fewer than two vertices.
    Vertices {
        /// The number of the surface.
        surface: usize,
    },
    /// A surface has neither one material nor one per segment.
    Materials {
        /// The number of the surface.
        surface: usize,
    },
    /// A coordinate is infinite or NaN, or so large or small that squares of distances are no
    /// numbers of the scalar.
    Coordinate(Place),
    /// A reflectance is NaN or outside [0, 1], which an emissivity outside [0, 1] makes it, too.
    Reflectance(Place),
    /// No wall that light from this one reaches, by any number of reflections, has a reflectance below 1: there is no
    /// steady state, or more than one.
    NothingAbsorbs(Place),
    /// An emission is infinite or NaN, or a temperature is NaN, negative or beyond the scalar.
    Emission(Place),
    /// A segment is shorter than the scene's smallest distance.
    ZeroLength(Place),
    /// Two segments cross.
    Crossing {
        /// One of them.
        first: Place,
        /// The other.
        second: Place,
    },
    /// Two segments lie on each other with their active sides on the same side.
    Overlap {
        /// One of them.
        first: Place,
        /// The other.
        second: Place,
    },
    /// The room is open, or the back of a wall can be seen from it.
    Open {
        /// The segment next to the gap, or the one that is seen from behind or sees nothing.
        at: Place,
        /// A point of a wall.
        from: [f64; 2],
        /// A direction in which light leaves from there, or meets a back.
        direction: [f64; 2],
    },
    /// No cells, or more than 2³² − 1, or so many that the scalar cannot tell them apart.
    Cells,
    /// The grading exponent is NaN or outside [1, 10].
    Grading,
    /// There is no such surface.
    Surface {
        /// The number that was asked for.
        surface: usize,
    },
    /// There are no such walls.
    Wall {
        /// The number of the first.
        wall: usize,
    },
    /// A place along a surface or a wall is NaN or outside [0, 1].
    Fraction,
    /// Numbers in borrowed tables lead nowhere.
    Tables,
    /// The number of a light is that of no wall, or the numbers of lights do not grow.
    Lights,
    /// A light from outside has a number that it cannot have, or comes into a closed room.
    Outside {
        /// The number of the light.
        number: usize,
    },
    /// A period is not above 0, or so small beside the room that too many copies of it would lie over it.
    Period,
    /// A buffer has the wrong length.
    Length {
        /// The length that is needed.
        expected: usize,
        /// The length of the buffer.
        found: usize,
    },
    /// There is no memory for a table.
    Memory {
        /// The size of the buffer in bytes; `None` if it exceeds the address space.
        bytes: Option<usize>,
    },
    /// There is no Galerkin solution.
    Galerkin(GalerkinError),
}

impl RoomError {
    /// The place in a surface that is wrong, if it is one.
    #[must_use]
    pub const fn place(&self) -> Option<Place> {
        match *self {
            Self::Vertices { surface } | Self::Materials { surface } => {
                Some(Place { surface, vertex: 0 })
            }
            Self::Coordinate(place)
            | Self::Reflectance(place)
            | Self::NothingAbsorbs(place)
            | Self::Emission(place)
            | Self::ZeroLength(place)
            | Self::Crossing { second: place, .. }
            | Self::Overlap { second: place, .. }
            | Self::Open { at: place, .. } => Some(place),
            _ => None,
        }
    }

    /// Writes what is wrong, with places in the words of others.
    ///
    /// # Errors
    /// Those of the formatter.
    pub fn describe<N: fmt::Display>(
        &self,
        f: &mut fmt::Formatter<'_>,
        name: impl Fn(Place) -> N,
    ) -> fmt::Result {
        if let (Some(place), false) = (
            self.place(),
            matches!(self, Self::Crossing { .. } | Self::Overlap { .. }),
        ) {
            write!(f, "{}: ", name(place))?;
        }
        match self {
            Self::Empty => write!(f, "a room needs at least one surface"),
            Self::Vertices { .. } => write!(f, "a surface needs at least two vertices"),
            Self::Materials { .. } => write!(
                f,
                "give one material for the surface, or one for each of its segments; numbers of several channels, such as colours, \
                 need their names"
            ),
            Self::Coordinate(_) => write!(
                f,
                "coordinates must be finite, and the scene between 1e-100 and 1e100 wide (in f32 between 1e-6 and 1e12)"
            ),
            Self::Reflectance(_) => write!(
                f,
                "the reflectance must be in [0, 1] (and so must an emissivity)"
            ),
            Self::NothingAbsorbs(_) => write!(
                f,
                "no wall of this part of the room absorbs: at least one needs a reflectance below 1"
            ),
            Self::Emission(_) => write!(
                f,
                "the emission must be finite (a temperature at least 0 kelvin)"
            ),
            Self::ZeroLength(_) => write!(
                f,
                "the segment to the next vertex has no length; vertices nearer than 2^-40 (f32: 2^-16) of the scene's width are one"
            ),
            &Self::Crossing { first, second } => write!(
                f,
                "the segment from {} crosses that from {}: split them where they meet",
                name(second),
                name(first)
            ),
            &Self::Overlap { first, second } => write!(
                f,
                "the segments from {} and from {} lie on each other and face the same side; a thin baffle is two surfaces that face \
                 opposite sides",
                name(second),
                name(first)
            ),
            Self::Open {
                from: [x, y],
                direction: [dx, dy],
                ..
            } => write!(
                f,
                "the room is not closed here: light leaves, or meets a wall from behind, from ({x}, {y}) in direction ({dx}, {dy}); close \
                 the gap, turn surfaces whose active side is not on the left, or declare the room open"
            ),
            Self::Cells => write!(
                f,
                "at least one cell is needed, at most 2^32 - 1, and no more than the scalar can tell apart"
            ),
            Self::Grading => write!(f, "the grading exponent must lie between 1 and 10"),
            Self::Surface { surface } => write!(f, "there is no surface {surface}"),
            Self::Wall { wall } => write!(f, "there is no wall {wall}"),
            Self::Fraction => write!(f, "a place along a wall lies between 0 and 1"),
            Self::Tables => write!(f, "the tables of a room do not belong together"),
            Self::Lights => write!(f, "the lights of a room must be numbers of walls that grow"),
            Self::Period => write!(
                f,
                "the period must be finite, above 0, and not less than a hundredth of the room's width"
            ),
            Self::Outside { number } => write!(
                f,
                "light {number} from outside comes into a closed room, or has a number that is negative or not finite, or a direction \
                 that is no unit vector"
            ),
            Self::Length { expected, found } => refused::length(f, *expected, *found),
            Self::Memory { bytes } => refused::memory(f, *bytes, "; fewer cells need less"),
            Self::Galerkin(error) => write!(f, "{error}"),
        }
    }
}

impl fmt::Display for RoomError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.describe(f, |place| place)
    }
}

impl core::error::Error for RoomError {}

impl From<GalerkinError> for RoomError {
    fn from(error: GalerkinError) -> Self {
        Self::Galerkin(error)
    }
}
