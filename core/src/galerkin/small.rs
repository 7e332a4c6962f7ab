//! The B×B systems of one step.

use num_traits::zero;

use crate::Real;

/// Solves a c = rhs by Gaussian elimination, without allocation.
///
/// There is no pivoting, and so no index that the compiler cannot check: transition moments are
/// symmetric and positive definite, and I − K'_ii is diagonally dominant. A singular matrix gives
/// components that are not finite, which the walk reports.
#[inline]
// Row operations on two rows of one matrix read best by index.
#[allow(clippy::needless_range_loop)]
pub(super) fn solve<F: Real, const B: usize>(mut a: [[F; B]; B], mut rhs: [F; B]) -> [F; B] {
    for column in 0..B {
        for row in column + 1..B {
            let factor = a[row][column] / a[column][column];
            for k in column + 1..B {
                let above = a[column][k];
                a[row][k] -= factor * above;
            }
            let above = rhs[column];
            rhs[row] -= factor * above;
        }
    }
    for row in (0..B).rev() {
        let mut sum = rhs[row];
        for k in row + 1..B {
            sum -= a[row][k] * rhs[k];
        }
        rhs[row] = sum / a[row][row];
    }
    rhs
}

/// Σ_b a_b b_b.
#[inline]
pub(super) fn dot<F: Real, const B: usize>(a: &[F; B], b: &[F; B]) -> F {
    // Starting from the first product saves adding it to zero, which the compiler must not drop.
    let mut products = a.iter().zip(b).map(|(&a, &b)| a * b);
    let first = products.next().unwrap_or_else(zero);
    products.fold(first, |sum, product| sum + product)
}

/// The B unknowns of cell `i`; NaN where the slice is too short, so that no index can panic.
#[inline]
pub(super) fn block<F: Real, const B: usize>(values: &[F], i: usize) -> [F; B] {
    match values.get(i * B..).and_then(<[F]>::first_chunk) {
        Some(block) => *block,
        None => [F::NAN; B],
    }
}

#[cfg(test)]
mod tests {
    use super::solve;

    #[test]
    fn solves_a_positive_definite_system() {
        let c = solve(
            [[4.0, 2.0, 1.0], [2.0, 5.0, 3.0], [1.0, 3.0, 6.0]],
            [11.0, 21.0, 25.0],
        );
        for (c, expected) in c.into_iter().zip([1.0_f64, 2.0, 3.0]) {
            assert!((c - expected).abs() < 1e-14);
        }
    }

    #[test]
    fn a_singular_matrix_is_not_finite() {
        assert!(!solve([[1.0, 1.0], [1.0, 1.0]], [1.0_f64, 2.0])[0].is_finite());
        assert!(!solve([[0.0_f32]], [1.0])[0].is_finite());
    }
}
