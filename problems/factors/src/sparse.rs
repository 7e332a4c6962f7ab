//! Form factors without their zeros.

use alloc::vec;
use alloc::vec::Vec;

use crate::Factors;

/// Form factors F_ij of all pairs of faces that see each other, row by row, by ascending columns: compressed sparse rows, as
/// SciPy's `csr_matrix((factors, columns, first))` takes them.
///
/// ```
/// use fredholm_factors::{SparseFactors, scene_factors};
/// use fredholm_scene::{Enclosure, Scene, shapes};
///
/// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
/// let sparse = SparseFactors::new(&scene_factors(&scene, 1e-9)?);
/// // A face of a box sees all others and not itself.
/// assert_eq!(sparse.row(0).map(|(column, _)| column).collect::<Vec<_>>(), [1, 2, 3, 4, 5]);
/// assert!((sparse.row(0).map(|(_, factor)| factor).sum::<f64>() - 1.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SparseFactors {
    first: Vec<u64>,
    columns: Vec<u32>,
    factors: Vec<f64>,
}

impl SparseFactors {
    /// The form factors of exchange areas, which are kept once for both directions.
    #[must_use]
    pub fn new(exchange: &Factors) -> Self {
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

    /// The number of faces.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.first.len().saturating_sub(1)
    }

    /// Whether there are no faces.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where each row begins among columns and factors, and the number of all.
    #[must_use]
    pub fn first(&self) -> &[u64] {
        &self.first
    }

    /// The number j of the face at which a factor arrives.
    #[must_use]
    pub fn columns(&self) -> &[u32] {
        &self.columns
    }

    /// F_ij, without a unit.
    #[must_use]
    pub fn factors(&self) -> &[f64] {
        &self.factors
    }

    /// The faces that face i sees, with their form factors.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> {
        let end = |at: usize| self.first.get(at).map_or(0, |&at| at as usize);
        let range = end(i)..end(i + 1);
        let columns = self.columns.get(range.clone()).unwrap_or_default();
        let factors = self.factors.get(range).unwrap_or_default();
        let columns = columns.iter().map(|&column| column as usize);
        columns.zip(factors.iter().copied())
    }
}
