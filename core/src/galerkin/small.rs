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

/// Solves as [`solve`] does, with as many rows as `rhs` has, which is known at run time: c in place
/// of rhs, and the matrix is lost.
pub(crate) fn solve_in_place<F: Real>(a: &mut [F], rhs: &mut [F]) {
    let size = rhs.len().max(1);
    for column in 0..rhs.len() {
        let (Some((above, below)), Some((known, unknown))) = (
            a.split_at_mut_checked((column + 1) * size),
            rhs.split_at_mut_checked(column + 1),
        ) else {
            return rhs.fill(F::NAN);
        };
        let (Some(pivots), Some(&known)) = (above.chunks_exact(size).next_back(), known.last())
        else {
            continue;
        };
        for (row, rhs) in below.chunks_exact_mut(size).zip(unknown) {
            let mut entries = row.iter_mut().zip(pivots).skip(column);
            let Some((first, &pivot)) = entries.next() else {
                continue;
            };
            let factor = *first / pivot;
            for (entry, &above) in entries {
                *entry -= factor * above;
            }
            *rhs -= factor * known;
        }
    }
    for (row, entries) in a.chunks_exact(size).enumerate().rev() {
        let entries = entries.get(row..).and_then(<[F]>::split_first);
        let unknown = rhs.get_mut(row..).and_then(<[F]>::split_first_mut);
        let (Some((&pivot, entries)), Some((rhs, known))) = (entries, unknown) else {
            continue;
        };
        let products = entries.iter().zip(&*known).map(|(&a, &c)| a * c);
        *rhs = products.fold(*rhs, |sum, product| sum - product) / pivot;
    }
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
    use super::{solve, solve_in_place};

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

    /// To the bit: results depend on it.
    #[test]
    fn the_number_of_rows_does_not_matter() {
        fn check<const B: usize>(state: &mut u32) {
            let mut next = || {
                *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(*state >> 8) / f64::from(1 << 24)
            };
            for _ in 0..20 {
                let mut matrix = [[0.0; B]; B];
                for (b, row) in matrix.iter_mut().enumerate() {
                    *row = core::array::from_fn(|_| next() - 0.5);
                    row[b] += B as f64;
                }
                let rhs: [f64; B] = core::array::from_fn(|_| next());
                let (mut slice, mut found) = (matrix, rhs);
                solve_in_place(slice.as_flattened_mut(), &mut found);
                assert_eq!(
                    solve(matrix, rhs).map(f64::to_bits),
                    found.map(f64::to_bits)
                );
            }
        }
        let mut state = 1;
        check::<1>(&mut state);
        check::<2>(&mut state);
        check::<5>(&mut state);
        check::<20>(&mut state);
    }

    #[test]
    fn a_singular_matrix_is_not_finite() {
        assert!(!solve([[1.0, 1.0], [1.0, 1.0]], [1.0_f64, 2.0])[0].is_finite());
        assert!(!solve([[0.0_f32]], [1.0])[0].is_finite());
    }
}
