//! Pairs of cells as models make them.

use fredholm_core::galerkin::{DiagonalRule, PairKind, Pairs as PairsTrait};
use fredholm_room::RoomPairs;

/// Cells in a row that are near to each other pointwise, all other pairs in S: for a kernel with a singularity at x = y,
/// near which no piecewise polynomial is close to it.
#[derive(Clone, Copy, Debug)]
pub struct Band {
    /// The number of neighbours on each side.
    pub width: usize,
}

impl PairsTrait for Band {
    #[inline]
    fn kind(&self, i: usize, j: usize) -> PairKind {
        if i.abs_diff(j) <= self.width {
            PairKind::Pointwise
        } else {
            PairKind::Galerkin
        }
    }

    #[inline]
    fn pointwise(&self, i: usize, cells: usize) -> impl Iterator<Item = usize> {
        i.saturating_sub(self.width)..(i + self.width + 1).min(cells)
    }

    fn outside(&self, i: usize, cells: usize, visit: &mut dyn FnMut(usize)) {
        self.pointwise(i, cells).for_each(visit);
    }
}

/// Pairs of any kind, for an analysis.
#[derive(Clone, Copy, Debug)]
pub enum AnyPairs<'a> {
    /// All pointwise.
    AllPointwise,
    /// A rule for the diagonal, all others in S.
    Diagonal(DiagonalRule),
    /// A band of pointwise pairs.
    Band(Band),
    /// Pairs of a room, by what cells see of each other.
    Views(RoomPairs<'a>),
}

impl PairsTrait for AnyPairs<'_> {
    fn kind(&self, i: usize, j: usize) -> PairKind {
        match self {
            Self::AllPointwise => PairKind::Pointwise,
            Self::Diagonal(pairs) => pairs.kind(i, j),
            Self::Band(pairs) => pairs.kind(i, j),
            Self::Views(pairs) => pairs.kind(i, j),
        }
    }
}
