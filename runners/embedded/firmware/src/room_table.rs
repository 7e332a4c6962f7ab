//! A room from the arrays that `fredholm export` writes, where they lie.

use fredholm_core::Real;
use fredholm_core::galerkin::Dense;
use fredholm_embedded::Table;
use fredholm_embedded::zerocopy::{FromBytes, Immutable};
use fredholm_room::{
    Cells, Choice, Edge, Geometry, MeanOver, Node, Point, RayControl, Room, RoomPairs, Strip,
    VisibilityTable, Wall,
};

/// What [`RoomTable::pairs`] is where walks take from rays.
const RAYS: u32 = 4;

/// What rays take from, of a table that has it.
pub(crate) fn rays<'a, F: Real + FromBytes + Immutable>(
    table: &Table<'a>,
) -> Option<RayControl<'a, F>> {
    Some(RayControl {
        first: table.slice("rayfirst").ok()?,
        stretches: table.slice("stretch").ok()?,
        intervals: table.slice("interval").ok()?,
        boxes: table.slice("boxes").ok()?,
        shares: table.slice("shares").ok()?,
    })
}

/// The arrays of a room: constants, or slices of a table. The coefficients are in the scalar `C`,
/// that of the walks at degree 0 and f64 above.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoomTable<'a, F, C = F> {
    /// q0.
    pub(crate) absorb: f64,
    /// 1 where light may leave.
    pub(crate) open: u32,
    /// The walls.
    pub(crate) walls: &'a [Wall<F>],
    /// The walls as rays see them.
    pub(crate) strips: &'a [Strip<F>],
    /// The hierarchy over them.
    pub(crate) nodes: &'a [Node<F>],
    /// The edges of cells.
    pub(crate) edges: &'a [Edge<F>],
    /// The wall of every cell.
    pub(crate) cells: &'a [u32],
    /// The first cell of every wall, and n.
    pub(crate) first: &'a [u32],
    /// The length of all walls before each, and of all.
    pub(crate) lengths: &'a [f64],
    /// The first wall of every surface, and the number of walls.
    pub(crate) surfaces: &'a [u32],
    /// What cells see of each other.
    pub(crate) views: &'a [u8],
    /// p.
    pub(crate) degree: u32,
    /// K' row by row.
    pub(crate) coeffs: &'a [C],
    /// The Galerkin solution.
    pub(crate) v: &'a [F],
    /// G over S.
    pub(crate) source: &'a [F],
    /// What is done with the pairs.
    pub(crate) pairs: u32,
}

impl<'a, F: Real, C> RoomTable<'a, F, C> {
    /// Of a table that `fredholm export -o FILE.bin` wrote.
    pub(crate) fn read(table: &Table<'a>) -> Option<Self>
    where
        F: FromBytes + Immutable,
        C: FromBytes + Immutable,
    {
        // Tables of rays have no pairs.
        let is_of_rays = table.one::<u32>("pairs").ok()? == RAYS;
        Some(Self {
            absorb: table.one("absorb").ok()?,
            open: table.one("open").ok()?,
            walls: table.slice("walls").ok()?,
            strips: table.slice("strips").ok()?,
            nodes: table.slice("nodes").ok()?,
            edges: table.slice("edges").ok()?,
            cells: table.slice("cells").ok()?,
            first: table.slice("first").ok()?,
            lengths: table.slice("lengths").ok()?,
            surfaces: table.slice("surfaces").ok()?,
            views: match is_of_rays {
                true => &[],
                false => table.slice("views").ok()?,
            },
            degree: table.one("degree").ok()?,
            coeffs: match is_of_rays {
                true => &[],
                false => table.slice("coeffs").ok()?,
            },
            v: table.slice("v").ok()?,
            source: match is_of_rays {
                true => &[],
                false => table.slice("source").ok()?,
            },
            pairs: table.one("pairs").ok()?,
        })
    }

    /// The room.
    pub(crate) fn room(&self) -> Option<Room<'a, F>> {
        let open = match self.open {
            0 => false,
            1 => true,
            _ => return None,
        };
        let geometry = Geometry::new(self.walls, self.strips, self.nodes, open).ok()?;
        let cells = Cells::new(&geometry, self.edges, self.cells, self.first).ok()?;
        let views = match self.pairs {
            RAYS => VisibilityTable::none(),
            _ => VisibilityTable::new(self.views, self.cells.len()).ok()?,
        };
        Room::new(geometry, cells, views, self.absorb).ok()
    }

    /// The kinds of its pairs.
    pub(crate) fn pairs(&self) -> Option<RoomPairs<'a>> {
        let choice = match self.pairs {
            1 => Choice::Default,
            2 => Choice::Paper,
            3 => Choice::Pointwise,
            _ => return None,
        };
        let views = VisibilityTable::new(self.views, self.cells.len()).ok()?;
        Some(RoomPairs { views, choice })
    }

    /// K' with B functions on a cell, if the table is of that degree.
    pub(crate) fn coefficients<const B: usize>(&self) -> Option<Dense<'a, C>> {
        if self.degree as usize + 1 != B {
            return None;
        }
        Dense::new(self.coeffs, self.cells.len(), B)
    }

    /// The mean over a surface, numbered from 0.
    pub(crate) fn mean_over<'r>(
        &self,
        room: &'r Room<'a, F>,
        surface: usize,
    ) -> Option<MeanOver<'r, 'a, F>> {
        let [from, to, ..] = *self.surfaces.get(surface..)? else {
            return None;
        };
        MeanOver::new(room, self.lengths, from as usize..to as usize).ok()
    }

    /// The point at a fraction of the first wall of a surface.
    pub(crate) fn point(
        &self,
        room: &Room<'a, F>,
        surface: usize,
        fraction: f64,
    ) -> Option<Point<F>> {
        let wall = *self.surfaces.get(surface)? as usize;
        room.point(wall, fraction).ok()
    }
}
