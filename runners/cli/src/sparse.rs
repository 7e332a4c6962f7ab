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
}

impl Rows {
    /// The number of rows.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Dense(rows) => rows.len(),
            Self::Sparse(sparse) => sparse.len(),
        }
    }

    /// What is not 0 in a row: the column and the factor.
    pub(crate) fn row(&self, i: usize) -> Box<dyn Iterator<Item = (usize, f64)> + '_> {
        match self {
            Self::Dense(rows) => {
                let all = rows[i].iter().copied().enumerate();
                Box::new(all.filter(|(_, factor)| *factor != 0.0))
            }
            Self::Sparse(sparse) => Box::new(sparse.row(i)),
        }
    }

    /// All of a row, zeros too.
    pub(crate) fn whole_row(&self, i: usize) -> Vec<f64> {
        let mut whole = vec![0.0; self.len()];
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
