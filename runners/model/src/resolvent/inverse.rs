//! The inverse of a matrix of some hundred unknowns, by blocks: products of matrices take most of the time.

use fredholm_core::galerkin::buffer;
use fredholm_rayon::fill_rows;
use nalgebra::{DMatrix, DMatrixViewMut, Dyn, LU};

use crate::Error;

/// Unknowns of a block, and columns of the inverse that one thread makes in one go.
const BLOCK: usize = 64;
/// The condition number from which on nothing is known of a solution: rounding is as large as that.
const MOST_CONDITION: f64 = 1e14;

/// (I − K')⁻¹ row by row, and the condition number of I − K' in the maximum norm.
pub(super) fn inverse(kernel: &[f64], width: usize) -> Result<(Vec<f64>, f64), Error> {
    // Numbers row by row are those of the transpose column by column, and columns of its inverse are the rows that are asked for.
    let mut matrix = -DMatrix::from_column_slice(width, width, kernel);
    matrix.iter_mut().step_by(width + 1).for_each(|x| *x += 1.0);
    let columns = matrix.column_iter();
    let sums = columns.map(|column| column.iter().map(|x| x.abs()).sum());
    let largest = sums.fold(0.0, f64::max);
    let factors = Factors::new(matrix);
    let mut inverse: Vec<f64> = buffer(width.saturating_mul(width))?;
    fill_rows(&mut inverse, BLOCK * width, |block, rows| {
        let count = rows.len() / width;
        for (row, numbers) in rows.chunks_exact_mut(width).enumerate() {
            numbers[block * BLOCK + row] = 1.0;
        }
        match factors.solve(&mut DMatrixViewMut::from_slice(rows, width, count)) {
            true => Ok(()),
            false => Err(singular()),
        }
    })?;
    let rows = inverse.chunks_exact(width);
    let sums = rows.map(|row| row.iter().map(|x| x.abs()).sum::<f64>());
    let condition = largest * sums.fold(0.0, f64::max);
    // Written so that NaN is refused.
    match condition < MOST_CONDITION {
        true => Ok((inverse, condition)),
        false => Err(singular()),
    }
}

/// No solution, or more than one.
fn singular() -> Error {
    Error::Regular {
        message: "the equation has no solution, or more than one: 1 is an eigenvalue of its kernel, as far as the cells tell"
            .to_owned(),
    }
}

/// L and U of a matrix whose rows were exchanged: of every block of columns the factors below the diagonal.
struct Factors {
    matrix: DMatrix<f64>,
    panels: Vec<LU<f64, Dyn, Dyn>>,
}

impl Factors {
    /// The factors, with the largest pivot of every column.
    fn new(mut matrix: DMatrix<f64>) -> Self {
        let width = matrix.nrows();
        let mut panels = Vec::new();
        for from in (0..width).step_by(BLOCK) {
            let own = BLOCK.min(width - from);
            let (to, left) = (from + own, width - from - own);
            let panel = matrix
                .view((from, from), (width - from, own))
                .into_owned()
                .lu();
            let mut below = matrix.rows_mut(from, width - from);
            panel.p().permute_rows(&mut below);
            below.columns_mut(from, own).copy_from(panel.lu_internal());
            let (mut upper, mut lower) = below.columns_range_pair_mut(from..to, to..);
            let (diagonal, rest) = upper.rows_range_pair_mut(0..own, own..);
            let (mut beside, mut other) = lower.rows_range_pair_mut(0..own, own..);
            diagonal.solve_lower_triangular_with_diag_mut(&mut beside, 1.0);
            if left > 0 {
                other.gemm(-1.0, &rest, &beside, 1.0);
            }
            panels.push(panel);
        }
        Self { matrix, panels }
    }

    /// Solves for some columns; whether no pivot was 0.
    fn solve(&self, columns: &mut DMatrixViewMut<'_, f64>) -> bool {
        let width = self.matrix.nrows();
        // Rows of L were exchanged with those of all blocks behind theirs.
        for (from, panel) in (0..width).step_by(BLOCK).zip(&self.panels) {
            panel
                .p()
                .permute_rows(&mut columns.rows_mut(from, width - from));
        }
        for from in (0..width).step_by(BLOCK) {
            let own = BLOCK.min(width - from);
            let mut below = columns.rows_mut(from, width - from);
            let (mut solved, mut rest) = below.rows_range_pair_mut(0..own, own..);
            let diagonal = self.matrix.view((from, from), (own, own));
            diagonal.solve_lower_triangular_with_diag_mut(&mut solved, 1.0);
            let factors = self
                .matrix
                .view((from + own, from), (width - from - own, own));
            rest.gemm(-1.0, &factors, &solved, 1.0);
        }
        let mut is_regular = true;
        for from in (0..width).step_by(BLOCK).rev() {
            let own = BLOCK.min(width - from);
            let (mut rest, mut solved) = columns.rows_range_pair_mut(0..from, from..from + own);
            let diagonal = self.matrix.view((from, from), (own, own));
            is_regular &= diagonal.solve_upper_triangular_mut(&mut solved);
            let factors = self.matrix.view((0, from), (from, own));
            rest.gemm(-1.0, &factors, &solved, 1.0);
        }
        is_regular
    }
}

#[cfg(test)]
mod tests {
    use super::inverse;

    /// Of blocks that are full and one that is not; without exchanges of rows it would be far off.
    #[test]
    fn the_inverse_is_one() {
        let width = 150;
        let entry =
            |i: usize, j: usize| ((i * 7919 + j * 104_729 + i * j) % 1000) as f64 / 500.0 - 1.0;
        let kernel: Vec<f64> = (0..width * width)
            .map(|k| entry(k / width, k % width))
            .collect();
        let (found, condition) = inverse(&kernel, width).expect("regular");
        for i in 0..width {
            for j in 0..width {
                let own = |k: usize| f64::from(u8::from(i == k)) - kernel[i * width + k];
                let product: f64 = (0..width).map(|k| own(k) * found[k * width + j]).sum();
                let expected = f64::from(u8::from(i == j));
                assert!(
                    (product - expected).abs() < 1e-14 * condition,
                    "{i} {j} {product}"
                );
            }
        }
    }

    #[test]
    fn an_eigenvalue_is_refused() {
        let mut kernel = vec![0.0; 9];
        kernel[4] = 1.0;
        assert!(inverse(&kernel, 3).is_err());
    }
}
