//! Form factors as a table, with or without its zeros.

use fredholm_factors::SparseFactors;
use serde::{Serialize, Serializer};

/// The rows of form factors.
#[derive(Debug)]
pub(crate) enum Rows {
    /// All numbers, row by row.
    Dense(Vec<Vec<f64>>),
    /// What is not 0.
    Sparse(SparseFactors),
    /// What is not 0 in some rows, with the number of columns.
    Listed(Vec<Vec<(usize, f64)>>, usize),
}

impl Rows {
    /// The number of rows.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Dense(rows) => rows.len(),
            Self::Sparse(sparse) => sparse.len(),
            Self::Listed(rows, _) => rows.len(),
        }
    }

    /// The number of columns.
    fn width(&self) -> usize {
        match self {
            Self::Dense(rows) => rows.first().map_or(0, Vec::len),
            Self::Sparse(sparse) => sparse.len(),
            Self::Listed(_, width) => *width,
        }
    }

    /// These rows alone, without factors below `least`, whose share the others take over.
    pub(crate) fn chosen(&self, rows: impl Iterator<Item = usize>, least: f64) -> Self {
        let row = |i: usize| {
            let all: f64 = self.row(i).map(|(_, factor)| factor).sum();
            let kept: Vec<_> = self.row(i).filter(|(_, factor)| *factor >= least).collect();
            let sum: f64 = kept.iter().map(|(_, factor)| factor).sum();
            let scale = if sum > 0.0 && sum < all {
                all / sum
            } else {
                1.0
            };
            let scaled = kept
                .into_iter()
                .map(|(column, factor)| (column, factor * scale));
            scaled.collect()
        };
        Self::Listed(rows.map(row).collect(), self.width())
    }

    /// What stands where factors are not 0, and how far those factors have moved.
    pub(crate) fn moved(&self, from: &Self, to: &Self) -> Self {
        let row = |i: usize| {
            let (whole, before) = (self.whole_row(i), from.whole_row(i));
            let entry = |(j, now): (usize, f64)| (j, whole[j] + (now - before[j]).abs());
            to.row(i).map(entry).collect()
        };
        Self::Listed((0..self.len()).map(row).collect(), self.width())
    }

    /// What is not 0 in a row: the column and the factor.
    pub(crate) fn row(&self, i: usize) -> Box<dyn Iterator<Item = (usize, f64)> + '_> {
        match self {
            Self::Dense(rows) => {
                let all = rows[i].iter().copied().enumerate();
                Box::new(all.filter(|(_, factor)| *factor != 0.0))
            }
            Self::Sparse(sparse) => Box::new(sparse.row(i)),
            Self::Listed(rows, _) => Box::new(rows.get(i).into_iter().flatten().copied()),
        }
    }

    /// All of a row, zeros too.
    pub(crate) fn whole_row(&self, i: usize) -> Vec<f64> {
        let mut whole = vec![0.0; self.width()];
        for (column, factor) in self.row(i) {
            whole[column] = factor;
        }
        whole
    }
}

impl Serialize for Rows {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq((0..self.len()).map(|i| self.whole_row(i)))
    }
}
