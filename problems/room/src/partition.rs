//! The partition: every wall cut into cells.

use fredholm_core::Real;
use fredholm_core::array::Each;

use crate::RoomError;
use crate::geometry::{Geometry, Wall};
use crate::visible::Part;

/// A cut of a wall, or one of its ends.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Edge<F> {
    /// The distance from the wall's first vertex.
    pub along: F,
    /// The point.
    pub position: [F; 2],
}

/// The tables of a [`Partition`].
#[derive(Clone, Copy, Debug)]
pub struct PartitionTables<'a, F> {
    /// The edges of all cells: n plus the number of walls.
    pub edges: &'a [Edge<F>],
    /// The wall of every cell.
    pub walls: &'a [u32],
    /// The first cell of every wall, and n.
    pub first: &'a [u32],
}

/// A partition of the walls: borrowed tables. Cell c of wall w lies between the edges c + w and
/// c + w + 1, as every wall has one edge more than cells.
#[derive(Clone, Copy, Debug)]
pub struct Partition<'a, F>(PartitionTables<'a, F>);

impl<'a, F: Real> Partition<'a, F> {
    /// Borrows tables that were made elsewhere, for the walls of `geometry`.
    ///
    /// # Errors
    /// [`RoomError::Tables`]: the cells of a wall do not run from its one end to the other in
    /// growing distances, or numbers disagree.
    pub fn new(
        geometry: &Geometry<'_, F>,
        tables: PartitionTables<'a, F>,
    ) -> Result<Self, RoomError> {
        let PartitionTables {
            edges,
            walls,
            first,
        } = tables;
        let count = geometry.walls().len();
        let lengths = edges.len() == walls.len() + count && first.len() == count + 1;
        let ends =
            first.first() == Some(&0) && first.last() == u32::try_from(walls.len()).as_ref().ok();
        let partition = Self(tables);
        let belongs = |(w, wall): (usize, &Wall<F>)| {
            let [from, to] = [first.get(w), first.get(w + 1)].each(|c| c.map(|&c| c as usize));
            let (Some(from), Some(to)) = (from, to) else {
                return false;
            };
            let own = walls.get(from..to).unwrap_or(&[]);
            let edges = partition.of_wall(w as u32);
            from < to
                && own.len() == to - from
                && own.iter().all(|&o| o as usize == w)
                && edges.len() == own.len() + 1
                && edges.is_sorted_by(|a, b| a.along < b.along)
                && edges
                    .first()
                    .is_some_and(|e| e.along == F::zero() && e.position == wall.ends[0])
                && edges
                    .last()
                    .is_some_and(|e| e.along == wall.length && e.position == wall.ends[1])
        };
        if lengths && ends && geometry.walls().iter().enumerate().all(belongs) {
            Ok(partition)
        } else {
            Err(RoomError::Tables)
        }
    }

    /// Tables that this crate made.
    #[cfg(feature = "alloc")]
    pub(crate) const fn made(tables: PartitionTables<'a, F>) -> Self {
        Self(tables)
    }

    /// The tables: what [`new`](Self::new) takes.
    #[must_use]
    pub const fn tables(&self) -> PartitionTables<'a, F> {
        self.0
    }

    /// n.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.0.walls.len()
    }

    /// Whether there is no cell.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.0.walls.is_empty()
    }

    /// The numbers of the cells of a wall.
    #[must_use]
    pub fn range(&self, wall: u32) -> core::ops::Range<usize> {
        let at = |w: usize| self.0.first.get(w).map_or(0, |&c| c as usize);
        at(wall as usize)..at(wall as usize + 1)
    }

    /// The edges of the cells of a wall.
    #[inline]
    pub(crate) fn of_wall(&self, wall: u32) -> &'a [Edge<F>] {
        let w = wall as usize;
        let (Some(&from), Some(&to)) = (self.0.first.get(w), self.0.first.get(w + 1)) else {
            return &[];
        };
        let (from, to) = (from as usize + w, to as usize + w + 1);
        self.0.edges.get(from..to).unwrap_or(&[])
    }

    /// The cell at this distance from a wall's first vertex. Cells are half open; a wall's last one
    /// has its end.
    #[inline]
    pub(crate) fn find(&self, wall: u32, along: F) -> u32 {
        let edges = self.of_wall(wall);
        // Without the two ends of the wall: how many cuts are at or before the place?
        let cuts = edges.get(1..edges.len().max(2) - 1).unwrap_or(&[]);
        let first = self.0.first.get(wall as usize).copied().unwrap_or(0);
        first + cuts.partition_point(|cut| cut.along <= along) as u32
    }

    /// Wall and two edges of a cell.
    #[inline]
    pub(crate) fn edges(&self, cell: usize) -> Option<(u32, &'a Edge<F>, &'a Edge<F>)> {
        let &wall = self.0.walls.get(cell)?;
        match self.0.edges.get(cell + wall as usize..) {
            Some([from, to, ..]) => Some((wall, from, to)),
            _ => None,
        }
    }

    #[inline]
    pub(crate) fn part(&self, cell: usize) -> Option<Part<F>> {
        let (wall, from, to) = self.edges(cell)?;
        Some(Part {
            wall,
            ends: [from.position, to.position],
            length: to.along - from.along,
        })
    }

    /// The length of a cell; NaN where there is none.
    #[inline]
    #[must_use]
    pub fn length(&self, cell: usize) -> F {
        self.edges(cell)
            .map_or(F::NAN, |(_, from, to)| to.along - from.along)
    }

    /// The number of the wall of a cell.
    #[must_use]
    pub fn wall(&self, cell: usize) -> Option<usize> {
        self.0.walls.get(cell).map(|&wall| wall as usize)
    }
}
