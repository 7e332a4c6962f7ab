//! What can be wrong with a scene.

use core::fmt;

/// A polygon of a surface, both counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The number of the surface.
    pub surface: usize,
    /// The number of the polygon within it.
    pub polygon: usize,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "surface {}, polygon {}", self.surface, self.polygon)
    }
}

/// Why there is no such scene or table.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SceneError {
    /// There is no surface.
    Empty,
    /// A surface has no polygons.
    Polygons {
        /// The number of the surface.
        surface: usize,
    },
    /// A surface has neither one material nor one per polygon.
    Materials {
        /// The number of the surface.
        surface: usize,
    },
    /// A coordinate is infinite or NaN, or so large or small that products of distances are no
    /// numbers of the scalar.
    Coordinate(Place),
    /// A reflectance is NaN or outside [0, 1], which an emissivity outside [0, 1] makes it, too.
    Reflectance(Place),
    /// A closed scene in which no polygon absorbs has no solution, or many.
    NothingAbsorbs,
    /// An emission is infinite or NaN, or a temperature is NaN, negative or beyond the scalar.
    Emission(Place),
    /// A number of a beam is infinite or NaN, its strength is negative, or its direction has no length.
    Beam {
        /// The number of the beam.
        beam: usize,
    },
    /// A specular reflectance is none of [0, 1), or more than the reflectance leaves.
    Specular(Place),
    /// An absorptance is NaN or outside [0, 1].
    Absorptance(Place),
    /// A period is none, or the scene does not fit in it or is closed.
    Period,
    /// A lamp at a point in a scene that repeats.
    RepeatedLamp,
    /// Light from one place or direction in a scene with mirrors: no walk finds it in them.
    MirroredBeam,
    /// A polygon is thinner than four times the scene's smallest distance.
    Degenerate(Place),
    /// The vertices of a quadrilateral do not lie in a plane.
    NotPlanar {
        /// The quadrilateral.
        at: Place,
        /// The distance of a vertex from the plane of the others.
        by: f64,
    },
    /// A quadrilateral is not convex, or its edges cross.
    NotConvex(Place),
    /// Two polygons have the same vertices and face the same side.
    Duplicate {
        /// One of them.
        first: Place,
        /// The other.
        second: Place,
    },
    /// Two polygons overlap in one plane and face the same side.
    Overlap {
        /// One of them.
        first: Place,
        /// The other.
        second: Place,
    },
    /// An edge of a polygon goes through another.
    Crossing {
        /// The polygon with the edge.
        first: Place,
        /// The one that it goes through.
        second: Place,
        /// The place of the vertex.
        at: [f64; 3],
    },
    /// A vertex lies close to an edge, but not on it, so that there is a gap.
    TJunction {
        /// The polygon with the edge.
        at: Place,
        /// The vertex.
        vertex: [f64; 3],
        /// The distance of the vertex from the edge.
        distance: f64,
    },
    /// A polygon faces the other way than the one beside it.
    Flipped {
        /// One of them.
        first: Place,
        /// The other.
        second: Place,
        /// The middle of their common edge.
        edge: [f64; 3],
    },
    /// The scene is open, or the back of a polygon can be seen from it.
    Open {
        /// The polygon at the gap, or the one that is seen from behind or sees nothing.
        at: Place,
        /// A point of a polygon.
        from: [f64; 3],
        /// A direction in which light leaves from there, or meets a back.
        direction: [f64; 3],
        /// The distance from the middle of an edge that no other polygon has to the nearest polygon beside its own and the neighbours of
        /// that, in the scene's unit of length.
        gap: Option<f64>,
        /// The polygon at that distance.
        to: Option<Place>,
    },
    /// More than 2³² − 2 polygons or vertices.
    TooMany,
    /// There is no such surface.
    Surface {
        /// The number that was asked for.
        surface: usize,
    },
    /// There is no such face.
    Face {
        /// The number that was asked for.
        face: usize,
    },
    /// Numbers in borrowed tables lead nowhere.
    Tables,
    /// More than 2²⁸ cells.
    Cells,
    /// A position is not on a face.
    Point {
        /// The number of the face.
        face: u32,
    },
    /// A direction has no length, or none that is finite.
    Direction,
    /// Bands of a sky are none.
    Sky,
    /// A closed scene sees no sky.
    NoSky,
    /// What a patch of the sky gives is negative or not finite.
    SkyLight {
        /// The number of the patch.
        patch: usize,
    },
    /// A slice has the wrong length.
    Length {
        /// The length that is needed.
        expected: usize,
        /// The length that was given.
        found: usize,
    },
}

impl SceneError {
    /// The error of a scene that stands so far from where it was given.
    #[cfg(feature = "alloc")]
    pub(crate) fn moved(mut self, shift: [f64; 3]) -> Self {
        match &mut self {
            Self::Crossing { at: point, .. }
            | Self::TJunction { vertex: point, .. }
            | Self::Flipped { edge: point, .. }
            | Self::Open { from: point, .. } => {
                for (x, by) in point.iter_mut().zip(shift) {
                    *x += by;
                }
            }
            _ => {}
        }
        self
    }
}

/// Three numbers as people write them.
struct Point([f64; 3]);

impl fmt::Display for Point {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.0;
        write!(f, "({x}, {y}, {z})")
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "a scene needs at least one surface"),
            Self::Polygons { surface } => write!(f, "surface {surface} has no polygons"),
            Self::Materials { surface } => write!(
                f,
                "surface {surface} needs one material, or one for each of its polygons"
            ),
            Self::NothingAbsorbs => f.write_str(
                "nothing absorbs: at least one surface of a closed scene needs a reflectance below 1, or a temperature, and of a vacuum a sticking \
                 factor or a pump",
            ),
            Self::TooMany => write!(f, "a scene has at most 2^32 - 2 polygons and vertices"),
            Self::Surface { surface } => write!(f, "there is no surface {surface}"),
            Self::Face { face } => write!(f, "there is no face {face}"),
            Self::Tables => write!(f, "the tables of a scene do not belong together"),
            Self::Cells => write!(f, "a scene has at most 2^28 cells"),
            Self::Beam { beam } => write!(
                f,
                "beam {beam}: its numbers must be finite, its strength must not be negative, and a direction must have a length"
            ),
            Self::Specular(place) => write!(
                f,
                "{place}: a specular reflectance must be at least 0 and below 1, and with the reflectance, or the emissivity, at most 1"
            ),
            Self::Absorptance(place) => {
                write!(f, "{place}: an absorptance must be from 0 to 1")
            }
            Self::Period => f.write_str(
                "a scene that repeats is open, and no wider than its period, which must be a finite number more than 0",
            ),
            Self::RepeatedLamp => f.write_str(
                "a scene that repeats has no lamps at points: let surfaces shine, the sun or a sky",
            ),
            Self::MirroredBeam => f.write_str(
                "the sun and lamps at points are seen in mirrors, where no walk finds them: leave them out, or `specular`; surfaces and a sky may shine",
            ),
            Self::Point { face } => write!(f, "the position is not on face {face}"),
            Self::Direction => {
                f.write_str("a direction must have finite coordinates, one of which is not 0")
            }
            Self::Sky => f.write_str(
                "the bands of a sky need ascending altitudes from 0 to 90 degrees, and a number of sectors for each band, \
                 100000 pieces in all at most",
            ),
            Self::SkyLight { patch } => write!(
                f,
                "what patch {patch} of the sky gives must be a finite number that is not negative"
            ),
            Self::NoSky => f.write_str("the scene is closed: no sky is seen from it"),
            Self::Length { expected, found } => {
                write!(f, "{expected} numbers are needed, not {found}")
            }
            Self::Coordinate(place) => write!(
                f,
                "{place}: coordinates must be finite, and the scene between 1e-6 and 1e9 wide in f32, \
                 1e-60 and 1e60 in f64"
            ),
            Self::Reflectance(place) => write!(
                f,
                "{place}: the reflectance must be from 0 to 1 (an emissivity above 0 and, with a specular reflectance, at most 1)"
            ),
            Self::Emission(place) => write!(
                f,
                "{place}: the emission must be finite (a temperature at least 0 kelvin)"
            ),
            Self::Degenerate(place) => write!(
                f,
                "{place}: the polygon has no area; vertices nearer than 2^-40 (f32: 2^-16) of the scene's \
                 width are one, and a polygon is at least four times as thick"
            ),
            Self::NotPlanar { at, by } => write!(
                f,
                "{at}: the vertices are not in a plane, one is {by:e} off; cut it into two triangles"
            ),
            Self::NotConvex(place) => write!(
                f,
                "{place}: the quadrilateral is not convex, or its edges cross; cut it into two triangles"
            ),
            Self::Duplicate { first, second } => {
                write!(f, "{second} is {first} once more: remove one of them")
            }
            Self::Overlap { first, second } => write!(
                f,
                "{first} and {second} overlap in one plane and face the same side; a thin plate is two \
                 surfaces that face opposite sides"
            ),
            Self::Crossing { first, second, at } => write!(
                f,
                "an edge of {first} goes through {second} at {}; cut them where they meet",
                Point(*at)
            ),
            Self::TJunction {
                at,
                vertex,
                distance,
            } => write!(
                f,
                "the vertex {} is {distance:e} away from an edge of {at}, which leaves a gap: move it onto the edge",
                Point(*vertex)
            ),
            Self::Flipped {
                first,
                second,
                edge,
            } => write!(
                f,
                "{first} and {second} face different sides at their common edge, at {}: turn one of them",
                Point(*edge)
            ),
            Self::Open {
                at,
                from,
                direction,
                gap,
                to,
            } => {
                write!(
                    f,
                    "the scene is not closed at {at}: light leaves, or meets a polygon from behind, from {} in \
                     direction {}; close the gap",
                    Point(*from),
                    Point(*direction)
                )?;
                if let Some(gap) = gap {
                    write!(f, " of {gap:.3e}")?;
                }
                if let Some(to) = to {
                    write!(f, " to {to}")?;
                }
                f.write_str(
                    ", turn polygons whose vertices are not counter-clockwise seen from the active side, or declare the \
                     scene open",
                )
            }
        }
    }
}

impl core::error::Error for SceneError {}
