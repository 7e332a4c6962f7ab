//! Which pairs of cells see each other, and which are in S.

use fredholm_core::galerkin::{PairKind, Pairs, marked};

use crate::RoomError;

/// What cell i sees of cell j.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Visibility {
    /// None of it: the pair lies on one line, or one is behind the other, or a wall is between them.
    None = 0,
    /// Perhaps a part.
    Partial = 1,
    /// All of it from everywhere, but somewhere p_j(x) is below min_mass_ratio times its mean.
    Full = 2,
    /// All of it from everywhere, and r_ij ≥ min_mass_ratio.
    FullBounded = 3,
}

/// The visibility of all pairs of cells: a borrowed table of n² bytes, row by row, each a [`Visibility`].
///
/// An empty table knows nothing: every pair is [`Visibility::Partial`] then, which is right and slow.
#[derive(Clone, Copy, Debug)]
pub struct VisibilityTable<'a> {
    table: &'a [u8],
    cells: usize,
}

impl<'a> VisibilityTable<'a> {
    /// Borrows the visibility of all pairs of n = `cells` cells. [`Visibility::Full`] and
    /// [`Visibility::FullBounded`] are promises that an estimate is biased without.
    ///
    /// # Errors
    /// [`RoomError::Length`] where its length is not n² (or 0), [`RoomError::Tables`] where a byte
    /// is no view.
    pub fn new(table: &'a [u8], cells: usize) -> Result<Self, RoomError> {
        if !table.is_empty() && cells.checked_mul(cells) != Some(table.len()) {
            return Err(RoomError::Length {
                expected: cells.saturating_mul(cells),
                found: table.len(),
            });
        }
        if table
            .iter()
            .any(|&view| view > Visibility::FullBounded as u8)
        {
            return Err(RoomError::Tables);
        }
        Ok(Self { table, cells })
    }

    /// A table that this crate made.
    #[cfg(feature = "alloc")]
    pub(crate) const fn made(table: &'a [u8], cells: usize) -> Self {
        Self { table, cells }
    }

    /// An empty table: every pair is [`Visibility::Partial`].
    #[must_use]
    pub const fn none() -> Self {
        Self {
            table: &[],
            cells: 0,
        }
    }

    /// The table: what [`new`](Self::new) takes.
    #[must_use]
    pub const fn table(&self) -> &'a [u8] {
        self.table
    }

    /// What cell i sees of cell j.
    #[inline]
    #[must_use]
    pub fn visibility(&self, i: usize, j: usize) -> Visibility {
        match self.table.get(i * self.cells + j) {
            Some(0) => Visibility::None,
            Some(2) => Visibility::Full,
            Some(3) => Visibility::FullBounded,
            _ => Visibility::Partial,
        }
    }

    /// Row i of the table.
    fn row(&self, i: usize) -> &'a [u8] {
        let from = i * self.cells;
        self.table.get(from..from + self.cells).unwrap_or(&[])
    }
}

/// How the neighbour equation treats pairs of cells, by their visibility.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// S = the pairs that see each other [`Visibility::FullBounded`]; h = 0 on the others, as in Heinrich
    /// 1995.
    Paper,
    /// S = the pairs that see each other [`Visibility::FullBounded`]; h = k on all others that see anything.
    Default,
    /// S is empty; h = k wherever a pair sees anything.
    Pointwise,
}

/// The kinds of all pairs of cells, from their visibility.
#[derive(Clone, Copy, Debug)]
pub struct RoomPairs<'a> {
    /// The visibility of all pairs.
    pub views: VisibilityTable<'a>,
    /// How pairs are treated.
    pub choice: Choice,
}

impl RoomPairs<'_> {
    #[inline]
    const fn kind_of(&self, view: Visibility) -> PairKind {
        match (self.choice, view) {
            (Choice::Paper | Choice::Default, Visibility::FullBounded) => PairKind::Galerkin,
            (Choice::Paper, _) | (_, Visibility::None) => PairKind::Dropped,
            (Choice::Default | Choice::Pointwise, _) => PairKind::Pointwise,
        }
    }
}

impl Pairs for RoomPairs<'_> {
    #[inline]
    fn kind(&self, i: usize, j: usize) -> PairKind {
        self.kind_of(self.views.visibility(i, j))
    }

    #[inline]
    fn pointwise(&self, i: usize, cells: usize) -> impl Iterator<Item = usize> {
        // A carry into the bit that is asked for marks the views from 1 to 2, or from 1 to 3.
        let (add, bit) = match self.choice {
            Choice::Paper => (0, 0),
            Choice::Default => (1, 2),
            Choice::Pointwise => (3, 4),
        };
        let listed = marked(self.views.row(i), add, bit);
        // Without a table all are partly seen.
        let unlisted = self.views.table.is_empty() && self.choice != Choice::Paper;
        let all = if unlisted { 0..cells } else { 0..0 };
        listed.chain(all)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use super::{Choice, PairKind, Pairs, RoomPairs, VisibilityTable};

    /// All j outside S, as a list.
    fn outside(pairs: &dyn Pairs, i: usize, cells: usize) -> Vec<usize> {
        let mut all = Vec::new();
        pairs.outside(i, cells, &mut |j| all.push(j));
        all
    }

    /// Asks every pair, as the provided methods do.
    struct Slow<'a>(RoomPairs<'a>);
    impl Pairs for Slow<'_> {
        fn kind(&self, i: usize, j: usize) -> PairKind {
            self.0.kind(i, j)
        }
    }

    #[test]
    fn the_lists_agree_with_the_kinds() {
        let mut state = 1_u32;
        for cells in [1, 7, 8, 9, 21] {
            let mut table = [0_u8; 21 * 21];
            for view in &mut table {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *view = (state >> 30) as u8;
            }
            for table in [&table[..cells * cells], &[]] {
                let views = VisibilityTable::new(table, cells).unwrap();
                for choice in [Choice::Paper, Choice::Default, Choice::Pointwise] {
                    let pairs = RoomPairs { views, choice };
                    let slow = Slow(pairs);
                    for i in 0..cells {
                        assert!(pairs.pointwise(i, cells).eq(slow.pointwise(i, cells)));
                        assert_eq!(outside(&pairs, i, cells), outside(&slow, i, cells));
                    }
                }
            }
        }
    }
}
