//! Form factors as a table, with or without its zeros.

use fredholm_scene::Factors as Exchange;
use serde::{Serialize, Serializer};

/// The rows of form factors.
#[derive(Debug)]
pub(crate) enum Rows {
    /// All numbers, row by row.
    Dense(Vec<Vec<f64>>),
    /// What is not 0.
    Sparse(Sparse),
}

/// What is not 0, row by row, by ascending columns.
#[derive(Debug, Default)]
pub(crate) struct Sparse {
    /// Where each row begins, and the number of all.
    pub(crate) first: Vec<u64>,
    pub(crate) columns: Vec<u32>,
    pub(crate) factors: Vec<f64>,
}

impl Sparse {
    /// The form factors of exchange areas, which are kept once for both directions.
    pub(crate) fn new(exchange: &Exchange) -> Self {
        let areas = exchange.areas();
        let mut counts = vec![0_u64; areas.len()];
        for i in 0..areas.len() {
            for &(j, _) in exchange.row(i) {
                counts[i] += 1;
                counts[j as usize] += 1;
            }
        }
        let mut first = Vec::with_capacity(areas.len() + 1);
        let mut sum = 0;
        for count in counts {
            first.push(sum);
            sum += count;
        }
        let mut next = first.clone();
        first.push(sum);
        let mut columns = vec![0; sum as usize];
        let mut factors = vec![0.0; sum as usize];
        // Rows before a face's own put what they share with it first, so that columns ascend.
        for i in 0..areas.len() {
            for &(j, amount) in exchange.row(i) {
                for (row, column) in [(i, j as usize), (j as usize, i)] {
                    let at = next[row] as usize;
                    next[row] += 1;
                    columns[at] = column as u32;
                    factors[at] = amount / areas[row];
                }
            }
        }
        Self {
            first,
            columns,
            factors,
        }
    }

    fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> {
        let range = self.first[i] as usize..self.first[i + 1] as usize;
        let columns = self.columns[range.clone()].iter();
        columns
            .zip(&self.factors[range])
            .map(|(&column, &factor)| (column as usize, factor))
    }
}

impl Rows {
    /// The number of rows.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Dense(rows) => rows.len(),
            Self::Sparse(sparse) => sparse.first.len() - 1,
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
