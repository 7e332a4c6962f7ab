//! How the neighbour equation treats pairs of cells.

use super::GalerkinError;
use crate::array::Each;

/// How the neighbour equation treats steps from cell i to cell j.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum PairKind {
    /// (i, j) ∈ S: h from the Galerkin coefficient, (44). Needs inf p_j(x) > 0 on X_i, (46).
    Galerkin = 0,
    /// h = k. Costs an exact integral over X_j wherever G is scored.
    Pointwise = 1,
    /// h = 0: the paper's (i, j) ∉ S.
    #[default]
    Dropped = 2,
}

/// The kind of every pair.
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not say the kind of a pair of cells",
    label = "`Pairs` is missing",
    note = "`DiagonalRule {{ diagonal: PairKind::Galerkin }}` puts all pairs in S"
)]
pub trait Pairs {
    /// The kind of the pair (i, j).
    fn kind(&self, i: usize, j: usize) -> PairKind;

    /// All j of n cells with (i, j) pointwise. A problem that can list them faster than by asking
    /// all `cells` of them overrides this, in agreement with [`kind`](Self::kind): a disagreement
    /// is a bias that no error bar shows, and the conformance kit looks for it.
    fn pointwise(&self, i: usize, cells: usize) -> impl Iterator<Item = usize>
    where
        Self: Sized,
    {
        (0..cells).filter(move |&j| self.kind(i, j) == PairKind::Pointwise)
    }

    /// Calls `visit` with all j of n cells with (i, j) ∉ S, pointwise or none, in this order; overridden as
    /// [`pointwise`](Self::pointwise). What is set up before walks takes pairs as `&dyn Pairs`.
    fn outside(&self, i: usize, cells: usize, visit: &mut dyn FnMut(usize)) {
        let outside = |j: &usize| self.kind(i, *j) != PairKind::Galerkin;
        (0..cells).filter(outside).for_each(visit);
    }
}

/// All pairs with i ≠ j in S; the kind of the diagonal is free. With [`PairKind::Galerkin`] all pairs are
/// in S: right for a kernel and a density that are smooth everywhere.
///
/// Where they have a kink or a jump at x = y no polynomial is close to them on the diagonal. Then it is
/// best [`PairKind::Pointwise`], if the problem has the exact integrals, or [`PairKind::Dropped`], as in
/// Heinrich 1995, section 5.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DiagonalRule {
    /// The kind of (i, i).
    pub diagonal: PairKind,
}

impl Pairs for DiagonalRule {
    #[inline]
    fn kind(&self, i: usize, j: usize) -> PairKind {
        if i == j {
            self.diagonal
        } else {
            PairKind::Galerkin
        }
    }

    #[inline]
    fn pointwise(&self, i: usize, _: usize) -> impl Iterator<Item = usize> {
        let pointwise = self.diagonal == PairKind::Pointwise;
        pointwise.then_some(i).into_iter()
    }

    fn outside(&self, i: usize, _: usize, visit: &mut dyn FnMut(usize)) {
        if self.diagonal != PairKind::Galerkin {
            visit(i);
        }
    }
}

/// All pairs pointwise: h = k, the residual estimator. The neighbour equation differs from the equation
/// in its source only, and every score costs n exact integrals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AllPointwise;

impl Pairs for AllPointwise {
    #[inline]
    fn kind(&self, _: usize, _: usize) -> PairKind {
        PairKind::Pointwise
    }

    #[inline]
    fn pointwise(&self, _: usize, cells: usize) -> impl Iterator<Item = usize> {
        0..cells
    }

    fn outside(&self, _: usize, cells: usize, visit: &mut dyn FnMut(usize)) {
        (0..cells).for_each(visit);
    }
}

/// The kind of every pair by itself: a borrowed table of n² bytes, row by row, each a [`PairKind`] as `u8`.
///
/// ```
/// use fredholm_core::galerkin::{PairKind, PairTable, Pairs};
///
/// let [s, p, none] = [PairKind::Galerkin, PairKind::Pointwise, PairKind::Dropped].map(|kind| kind as u8);
/// let table = [s, p, none, s];
/// let pairs = PairTable::new(&table, 2)?;
/// assert_eq!(pairs.kind(1, 0), PairKind::Dropped);
/// assert!(pairs.pointwise(0, 2).eq([1]));
/// # Ok::<(), fredholm_core::galerkin::GalerkinError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct PairTable<'a> {
    table: &'a [u8],
    cells: usize,
}

impl<'a> PairTable<'a> {
    /// Borrows the kinds of all pairs of n = `cells` cells.
    ///
    /// # Errors
    /// [`GalerkinError::Table`] where its length is not n², [`GalerkinError::Kind`] where a byte is no kind.
    pub fn new(table: &'a [u8], cells: usize) -> Result<Self, GalerkinError> {
        if cells.checked_mul(cells) != Some(table.len()) {
            return Err(GalerkinError::Table {
                cells,
                found: table.len(),
            });
        }
        match table
            .iter()
            .position(|&kind| kind > PairKind::Dropped as u8)
        {
            Some(entry) => Err(GalerkinError::Kind { entry }),
            None => Ok(Self { table, cells }),
        }
    }

    /// The table: what [`new`](Self::new) takes.
    #[must_use]
    pub const fn table(&self) -> &'a [u8] {
        self.table
    }

    /// Row i of the table.
    #[inline]
    fn row(&self, i: usize) -> &'a [u8] {
        let from = i * self.cells;
        self.table.get(from..from + self.cells).unwrap_or(&[])
    }
}

impl Pairs for PairTable<'_> {
    /// [`PairKind::Dropped`] for cells that the table does not have.
    #[inline]
    fn kind(&self, i: usize, j: usize) -> PairKind {
        match self.row(i).get(j) {
            Some(0) => PairKind::Galerkin,
            Some(1) => PairKind::Pointwise,
            _ => PairKind::Dropped,
        }
    }

    #[inline]
    fn pointwise(&self, i: usize, _: usize) -> impl Iterator<Item = usize> {
        // Of 0, 1 and 2 the lowest bit is set in 1 alone.
        marked(self.row(i), 0, 1)
    }

    fn outside(&self, i: usize, cells: usize, visit: &mut dyn FnMut(usize)) {
        // A carry into the bit of 4 marks 1 and 2.
        let row = self.row(i);
        marked(row, 3, 4).chain(row.len()..cells).for_each(visit);
    }
}

/// The places of the bytes b of a row for which (b + `add`) & `bit` ≠ 0, one pass over it, eight bytes at a time: in
/// most rows few are marked. No sum may exceed 255.
#[inline]
pub fn marked(row: &[u8], add: u8, bit: u8) -> impl Iterator<Item = usize> {
    let [add, bit] = [add, bit].each(|byte| u64::from(byte) * EVERY);
    row.chunks(8).enumerate().flat_map(move |(k, chunk)| {
        // The last word may be padded with bytes 0, which are marked where `add` has the bit.
        let mut marks = word(chunk).wrapping_add(add) & bit;
        let count = chunk.len();
        core::iter::from_fn(move || {
            let byte = marks.trailing_zeros() as usize / 8;
            // The lowest mark away; there is none where the word is 0.
            marks &= marks.checked_sub(1)?;
            (byte < count).then_some(8 * k + byte)
        })
    })
}

/// A one in every byte.
const EVERY: u64 = 0x0101_0101_0101_0101;

/// Up to eight bytes as one number, the first in the lowest place.
#[inline]
fn word(bytes: &[u8]) -> u64 {
    match bytes.first_chunk() {
        Some(eight) => u64::from_le_bytes(*eight),
        None => bytes
            .iter()
            .rev()
            .fold(0, |word, &byte| word << 8 | u64::from(byte)),
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::{AllPointwise, DiagonalRule, GalerkinError, PairKind, PairTable, Pairs, marked};

    /// All j outside S, as a list.
    fn outside(pairs: &dyn Pairs, i: usize, cells: usize) -> Vec<usize> {
        let mut all = Vec::new();
        pairs.outside(i, cells, &mut |j| all.push(j));
        all
    }

    /// Asks every pair, as the provided methods do.
    struct Slow<P>(P);
    impl<P: Pairs> Pairs for Slow<P> {
        fn kind(&self, i: usize, j: usize) -> PairKind {
            self.0.kind(i, j)
        }
    }

    #[test]
    fn the_lists_agree_with_the_kinds() {
        fn check<P: Pairs + Copy>(pairs: P) {
            let slow = Slow(pairs);
            for i in 0..5 {
                assert!(pairs.pointwise(i, 5).eq(slow.pointwise(i, 5)));
                assert_eq!(outside(&pairs, i, 5), outside(&slow, i, 5));
            }
        }
        check(AllPointwise);
        for diagonal in [PairKind::Galerkin, PairKind::Pointwise, PairKind::Dropped] {
            check(DiagonalRule { diagonal });
        }
    }
    #[test]
    fn a_table_lists_what_it_says() {
        let mut state = 1_u32;
        for cells in [1, 7, 8, 9, 21] {
            let mut table = [0_u8; 21 * 21];
            for kind in &mut table {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *kind = (state >> 24) as u8 % 3;
            }
            let pairs = PairTable::new(&table[..cells * cells], cells).unwrap();
            let slow = Slow(pairs);
            for i in 0..cells {
                // Asked for more cells than it has, too.
                for n in [cells, cells + 2] {
                    assert!(pairs.pointwise(i, n).eq(slow.pointwise(i, n)));
                    assert_eq!(outside(&pairs, i, n), outside(&slow, i, n));
                }
            }
            assert_eq!(pairs.kind(cells - 1, cells), PairKind::Dropped);
        }
    }

    #[test]
    fn padding_is_no_byte() {
        assert!(marked(&[0; 11], 1, 1).eq(0..11));
        assert!(marked(&[2; 3], 0, 1).eq(0..0));
        assert!(marked(&[], 1, 1).eq(0..0));
    }

    #[test]
    fn what_is_no_table_is_refused() {
        assert_eq!(
            PairTable::new(&[0; 3], 2).err(),
            Some(GalerkinError::Table { cells: 2, found: 3 })
        );
        assert_eq!(
            PairTable::new(&[0, 1, 3, 2], 2).err(),
            Some(GalerkinError::Kind { entry: 2 })
        );
    }
}
