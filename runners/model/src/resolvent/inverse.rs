//! Factors of a matrix, and its inverse, by blocks: products of matrices take most of the time.

use fredholm_core::galerkin::buffer;
use fredholm_rayon::{Observer, fill_rows};
use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, Dyn, LU};

use crate::Error;

/// Unknowns of a block, and columns of the inverse that one thread makes in one go.
const BLOCK: usize = 64;
/// The condition number from which on nothing is known of a solution: rounding is as large as that.
const MOST_CONDITION: f64 = 1e14;

/// Columns from which on products of matrices are by blocks: of fewer they are rounded otherwise.
const LEAST_COLUMNS: usize = 6;
/// Steps by which the norm of an inverse is looked for, at most: more are hardly ever taken.
const NORM_STEPS: usize = 5;

/// (I − K')⁻¹ row by row, and the condition number of I − K' in the maximum norm.
pub(super) fn inverse(
    kernel: &[f64],
    width: usize,
    watch: &dyn Observer,
) -> Result<(Vec<f64>, f64), Error> {
    let factors = Factors::new(kernel, width, watch)?;
    let mut inverse: Vec<f64> = buffer(width.saturating_mul(width))?;
    fill_rows(&mut inverse, BLOCK * width, |block, rows| {
        go_on(watch)?;
        let count = rows.len() / width;
        for (row, numbers) in rows.chunks_exact_mut(width).enumerate() {
            numbers[block * BLOCK + row] = 1.0;
        }
        match factors.solve(&mut DMatrixViewMut::from_slice(rows, width, count)) {
            true => Ok(()),
            false => Err(singular(width, f64::INFINITY)),
        }
    })?;
    let rows = inverse.chunks_exact(width);
    let sums = rows.map(|row| row.iter().map(|x| x.abs()).sum::<f64>());
    let condition = factors.norm * sums.fold(0.0, f64::max);
    // Written so that NaN is refused.
    match condition < MOST_CONDITION {
        true => Ok((inverse, condition)),
        false => Err(singular(width, condition)),
    }
}

/// The factors of I − K', and about its condition number.
pub(super) fn factors(
    kernel: &[f64],
    width: usize,
    watch: &dyn Observer,
) -> Result<(Factors, f64), Error> {
    let factors = Factors::new(kernel, width, watch)?;
    let condition = factors.norm * factors.norm_of_inverse();
    match condition < MOST_CONDITION {
        true => Ok((factors, condition)),
        false => Err(singular(width, condition)),
    }
}

/// Ends a set-up that is cancelled.
pub(super) fn go_on(watch: &dyn Observer) -> Result<(), Error> {
    match watch.cancelled() {
        true => Err(Error::Cancelled),
        false => Ok(()),
    }
}

/// No solution, or more than one.
fn singular(width: usize, condition: f64) -> Error {
    Error::Regular {
        message: format!(
            "on {width} unknowns the condition number of the equation is {condition:.1e}, so that rounding leaves no digit: as far as \
             numbers tell 1 is an eigenvalue of the kernel, and there is no solution or more than one; or the solution grows beyond \
             numbers, as that of a Volterra kernel may"
        ),
    }
}

/// L and U of (I − K')ᵀ with rows exchanged: of every block of columns the factors below the diagonal.
pub(super) struct Factors {
    matrix: DMatrix<f64>,
    panels: Vec<LU<f64, Dyn, Dyn>>,
    /// The maximum norm of I − K'.
    norm: f64,
}

impl Factors {
    /// The factors, with the largest pivot of every column.
    fn new(kernel: &[f64], width: usize, watch: &dyn Observer) -> Result<Self, Error> {
        // Numbers row by row are those of the transpose column by column.
        let mut matrix = -DMatrix::from_column_slice(width, width, kernel);
        matrix.iter_mut().step_by(width + 1).for_each(|x| *x += 1.0);
        let columns = matrix.column_iter();
        let sums = columns.map(|column| column.iter().map(|x| x.abs()).sum());
        let norm = sums.fold(0.0, f64::max);
        let mut panels = Vec::new();
        for from in (0..width).step_by(BLOCK) {
            go_on(watch)?;
            let own = BLOCK.min(width - from);
            let (to, left) = (from + own, width - from - own);
            let panel = matrix
                .view((from, from), (width - from, own))
                .into_owned()
                .lu();
            let mut below = matrix.rows_mut(from, width - from);
            panel.p().permute_rows(&mut below);
            below.columns_mut(from, own).copy_from(panel.lu_internal());
            let (before, after) = matrix.as_mut_slice().split_at_mut(to * width);
            let upper = DMatrixView::from_slice(&before[from * width..], width, own);
            let diagonal = upper.view((from, 0), (own, own));
            let rest = upper.view((to, 0), (left, own));
            let is_cut = left % BLOCK == 0 || left % BLOCK >= LEAST_COLUMNS;
            let together = if is_cut { BLOCK } else { left };
            fill_rows(after, together * width, |_, columns| {
                let count = columns.len() / width;
                let mut columns = DMatrixViewMut::from_slice(columns, width, count);
                let (mut beside, mut other) = columns.rows_range_pair_mut(from..to, to..);
                diagonal.solve_lower_triangular_with_diag_mut(&mut beside, 1.0);
                subtract_product(&mut other, &rest, &beside.as_view());
                Ok::<(), Error>(())
            })?;
            panels.push(panel);
        }
        Ok(Self {
            matrix,
            panels,
            norm,
        })
    }

    /// (I − K')⁻ᵀ x.
    pub(super) fn transposed(&self, mut x: Vec<f64>) -> Vec<f64> {
        let width = x.len();
        self.solve(&mut DMatrixViewMut::from_slice(&mut x, width, 1));
        x
    }

    /// (I − K')⁻¹ x.
    pub(super) fn direct(&self, mut x: Vec<f64>) -> Vec<f64> {
        let width = x.len();
        let mut column = DMatrixViewMut::from_slice(&mut x, width, 1);
        self.matrix.tr_solve_upper_triangular_mut(&mut column);
        for row in (0..width).rev() {
            let below = self.matrix.view_range(row + 1.., row..=row);
            column[row] -= below.dot(&column.rows_range(row + 1..));
        }
        for (from, panel) in (0..width).step_by(BLOCK).zip(&self.panels).rev() {
            panel
                .p()
                .inv_permute_rows(&mut column.rows_mut(from, width - from));
        }
        x
    }

    /// The maximum norm of (I − K')⁻¹, or, seldom, less: where a convex function of x is largest on vertices (Hager 1984).
    fn norm_of_inverse(&self) -> f64 {
        let width = self.matrix.nrows();
        let (mut x, mut norm) = (vec![1.0 / width as f64; width], 0.0);
        for _ in 0..NORM_STEPS {
            let image = self.transposed(x.clone());
            norm = image.iter().map(|y| y.abs()).sum();
            let slope = self.direct(image.iter().map(|y| y.signum()).collect());
            let here: f64 = slope.iter().zip(&x).map(|(z, x)| z * x).sum();
            let highest = slope.iter().map(|z| z.abs()).enumerate();
            let highest = highest.max_by(|a, b| a.1.total_cmp(&b.1));
            match highest {
                Some((next, height)) if height > here => {
                    x.fill(0.0);
                    x[next] = 1.0;
                }
                _ => break,
            }
        }
        norm
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
            subtract_product(&mut rest, &factors, &solved.as_view());
        }
        let mut is_regular = true;
        for from in (0..width).step_by(BLOCK).rev() {
            let own = BLOCK.min(width - from);
            let (mut rest, mut solved) = columns.rows_range_pair_mut(0..from, from..from + own);
            let diagonal = self.matrix.view((from, from), (own, own));
            is_regular &= diagonal.solve_upper_triangular_mut(&mut solved);
            let factors = self.matrix.view((0, from), (from, own));
            subtract_product(&mut rest, &factors, &solved.as_view());
        }
        is_regular
    }
}

/// Whether products of matrices round once in a multiplication and addition on this processor.
fn is_fused() -> bool {
    #[cfg(target_arch = "x86_64")]
    return std::arch::is_x86_feature_detected!("fma")
        && std::arch::is_x86_feature_detected!("avx2");
    #[cfg(not(target_arch = "x86_64"))]
    return cfg!(target_arch = "aarch64");
}

/// Takes the product of two matrices from a third, with the bits of a processor that fuses.
fn subtract_product(
    from: &mut DMatrixViewMut<'_, f64>,
    left: &DMatrixView<'_, f64>,
    right: &DMatrixView<'_, f64>,
) {
    let sizes = [left.nrows(), left.ncols(), right.ncols()];
    // Small products are columns by columns, and never fused.
    if is_fused() || sizes.iter().any(|&size| size < LEAST_COLUMNS) {
        from.gemm(-1.0, left, right, 1.0);
    } else {
        subtract_fused(from, left, right);
    }
}

/// Takes a product step by step, as a processor without fused instructions has to.
fn subtract_fused(
    from: &mut DMatrixViewMut<'_, f64>,
    left: &DMatrixView<'_, f64>,
    right: &DMatrixView<'_, f64>,
) {
    let mut sums = vec![0.0; left.nrows()];
    for (mut column, factors) in from.column_iter_mut().zip(right.column_iter()) {
        sums.fill(0.0);
        for (own, &factor) in left.column_iter().zip(factors.iter()) {
            for (sum, &x) in sums.iter_mut().zip(own.iter()) {
                *sum = fused(x, factor, *sum);
            }
        }
        for (x, sum) in column.iter_mut().zip(&sums) {
            *x -= sum;
        }
    }
}

/// x y + z, rounded once: the product and the sum with their errors (Dekker 1971), where the error of those makes no difference.
fn fused(x: f64, y: f64, z: f64) -> f64 {
    let halves = |x: f64| {
        let far = 134_217_729.0 * x;
        let high = far - (far - x);
        (high, x - high)
    };
    let ((x1, x2), (y1, y2)) = (halves(x), halves(y));
    let product = x * y;
    let off = ((x1 * y1 - product) + x1 * y2 + x2 * y1) + x2 * y2;
    let sum = product + z;
    let own = sum - product;
    let rest = ((product - (sum - own)) + (z - own)) + off;
    let [low, high] = [1.0 - f64::EPSILON, 1.0 + f64::EPSILON].map(|share| sum + share * rest);
    // Elsewhere halves overflow, or errors are no numbers of f64.
    if low == high && product.abs() > 1e-200 {
        low
    } else {
        libm::fma(x, y, z)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::{factors, fused, inverse, is_fused, subtract_fused};

    fn kernel(width: usize) -> Vec<f64> {
        let entry =
            |i: usize, j: usize| ((i * 7919 + j * 104_729 + i * j) % 1000) as f64 / 500.0 - 1.0;
        (0..width * width)
            .map(|k| entry(k / width, k % width))
            .collect()
    }

    /// Of blocks that are full and one that is not; without exchanges of rows it would be far off.
    #[test]
    fn the_inverse_is_one() {
        let width = 150;
        let kernel = kernel(width);
        let (found, condition) = inverse(&kernel, width, &()).expect("regular");
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

    /// Products of all sizes, and sums that cancel or lie halfway between two numbers.
    #[test]
    fn one_rounding_is_that_of_libm() {
        let mut state = 1_u64;
        let mut number = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            f64::from_bits(state ^ state >> 29)
        };
        let check = |x: f64, y: f64, z: f64| {
            let (own, other) = (fused(x, y, z), libm::fma(x, y, z));
            assert!(
                own.to_bits() == other.to_bits() || own.is_nan() && other.is_nan(),
                "{x:e} {y:e} {z:e}"
            );
        };
        for _ in 0..300_000 {
            let [x, y, z] = [number(), number(), number()];
            check(x, y, z);
            let near = |x: f64| {
                f64::from_bits(
                    x.to_bits() & !(0x7ff << 52) | 1020 << 52 | (x.to_bits() >> 3 & 7) << 52,
                )
            };
            let [x, y, z] = [x, y, z].map(near);
            check(x, y, z);
            check(x, y, -x * y);
            // Few digits: halfway often.
            let coarse = |x: f64| f64::from_bits(x.to_bits() & !0x3ff_ffff);
            check(coarse(x), coarse(y), z);
            check(coarse(x), f64::EPSILON / 2.0, coarse(z));
        }
    }

    /// No block divides these sizes.
    #[test]
    fn products_without_fused_instructions_have_the_same_bits() {
        let matrix = |rows: usize, columns: usize| {
            DMatrix::from_column_slice(rows, columns, &kernel(90)[..rows * columns]).map(f64::sin)
        };
        let (left, right) = (matrix(77, 64), matrix(64, 7));
        let before = matrix(77, 7);
        let [mut one, mut other] = [before.clone(), before];
        one.gemm(-1.0, &left, &right, 1.0);
        subtract_fused(&mut other.as_view_mut(), &left.as_view(), &right.as_view());
        let differing = one.iter().zip(&other).filter(|(x, y)| x != y).count();
        // Of a processor without them half of the numbers, or more, differ.
        assert_eq!(differing == 0, is_fused(), "{differing}");
    }

    /// From either side, and with as large a condition number but for what a search may miss.
    #[test]
    fn factors_solve_as_the_inverse_does() {
        let width = 150;
        let kernel = kernel(width);
        let (inverse, condition) = inverse(&kernel, width, &()).expect("regular");
        let (factors, about) = factors(&kernel, width, &()).expect("regular");
        assert!(
            about <= 1.001 * condition && about > 0.3 * condition,
            "{about} {condition}"
        );
        let x: Vec<f64> = (0..width).map(|k| (k as f64).sin()).collect();
        let (direct, transposed) = (factors.direct(x.clone()), factors.transposed(x.clone()));
        for i in 0..width {
            let row: f64 = (0..width).map(|k| inverse[i * width + k] * x[k]).sum();
            let column: f64 = (0..width).map(|k| inverse[k * width + i] * x[k]).sum();
            assert!((row - direct[i]).abs() < 1e-14 * condition, "{i}");
            assert!((column - transposed[i]).abs() < 1e-14 * condition, "{i}");
        }
    }

    #[test]
    fn an_eigenvalue_is_refused() {
        let mut kernel = vec![0.0; 9];
        kernel[4] = 1.0;
        assert!(inverse(&kernel, 3, &()).is_err());
    }
}
