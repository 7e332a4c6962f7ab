//! The Galerkin solution v, and the neighbour source G that makes it exact.

use core::fmt;

use num_traits::{one, zero};

use super::{GalerkinMatrix, Pairs};
use crate::{Real, refused};

/// When the Gauss–Seidel iteration stops.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum StoppingRule<F> {
    /// After this many sweeps, whatever is reached.
    Fixed(u32),
    /// When a sweep meets no residual above `residual`, at most `at_most` sweeps.
    UntilResidual {
        /// In the units of F'.
        residual: F,
        /// The largest number of sweeps.
        at_most: u32,
    },
}

/// The sweeps and the last residual of a Gauss–Seidel iteration. An unconverged v is legal: it
/// costs variance, not correctness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Convergence<F> {
    /// The number of sweeps.
    pub sweeps: u32,
    /// The largest residual that the last sweep met, before it mended it.
    pub residual: F,
}

/// Why there is no neighbour equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum GalerkinError {
    /// A slice has another length than n·B.
    Length {
        /// n·B.
        expected: usize,
        /// The slice's.
        found: usize,
    },
    /// Coefficients are of another number of functions per cell than the walk.
    Functions {
        /// The walk's.
        expected: usize,
        /// The number of functions of the coefficients.
        found: usize,
    },
    /// The iteration diverges: a residual is not finite, or far above the first one.
    Diverges {
        /// The number of the sweep, from 1.
        sweep: u32,
    },
    /// Σ_j |K'_ij| ≥ 1 or NaN in a row, so that E η(h,g) = (v,Φ) is not granted.
    RowSum {
        /// The number i of the cell.
        row: usize,
    },
    /// The spectral radius of |K'| is not seen to be below 1 by its powers, so that E η(h,g) = (v,Φ) is
    /// not granted.
    Radius,
    /// There is no memory for a buffer.
    Memory {
        /// The size of the buffer in bytes; `None` if it exceeds the address space.
        bytes: Option<usize>,
    },
    /// A pair is pointwise where only pairs in S or outside are allowed.
    Pointwise {
        /// The number i of its row.
        row: usize,
    },
    /// A table of kinds has no entry for every pair, or too many.
    Table {
        /// n.
        cells: usize,
        /// The table's entries.
        found: usize,
    },
    /// An entry of a table of kinds is no kind.
    Kind {
        /// The number of the entry.
        entry: usize,
    },
}

impl fmt::Display for GalerkinError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { expected, found } => {
                write!(
                    f,
                    "a vector of {expected} unknowns is needed, not of {found}"
                )
            }
            Self::Functions { expected, found } => write!(
                f,
                "coefficients of {expected} functions per cell are needed, not of {found}"
            ),
            Self::Diverges { sweep } => write!(
                f,
                "the Gauss-Seidel iteration diverges (sweep {sweep}): the coefficients are no contraction"
            ),
            Self::RowSum { row } => write!(
                f,
                "the coefficients of row {row} sum to 1 or more in absolute value: the mean of the \
                 neighbour equation's walks need not exist; row sums below 1 are needed"
            ),
            Self::Radius => write!(
                f,
                "the absolute values of the coefficients have an estimated spectral radius of 1 or \
                 more: the mean of the walks does not exist; a smaller kernel is needed"
            ),
            Self::Memory { bytes } => refused::memory(f, *bytes, "; fewer cells need less"),
            Self::Pointwise { row } => write!(
                f,
                "row {row} has a pointwise pair: its source is no table, the problem's exact \
                 integrals are needed"
            ),
            Self::Table { cells, found } => write!(
                f,
                "the kinds of all pairs of {cells} cells are {cells} times {cells} bytes, not {found}"
            ),
            Self::Kind { entry } => write!(
                f,
                "entry {entry} of the table of pairs is no kind: 0 is in S, 1 pointwise, 2 neither"
            ),
        }
    }
}

impl core::error::Error for GalerkinError {}

/// The largest [row sum](GalerkinMatrix::row_sum) Σ_j |K'_(i0)(j0)|. Below 1 it grants, for B = 1 and any
/// choice of pairs in S and outside, that E η(h,g) = (v,Φ). For B > 1 it bounds the averages of
/// ∫|K(x,y)| dμ(y) over cells and nothing of h: see [`second_moment`](super::second_moment).
///
/// # Errors
/// [`GalerkinError::RowSum`]: a row sum is 1 or more, or NaN.
pub fn max_row_sum<F: Real>(matrix: &dyn GalerkinMatrix<Scalar = F>) -> Result<F, GalerkinError> {
    let mut largest = zero();
    for row in 0..matrix.cells() {
        let sum = matrix.row_sum(row);
        // Written so that NaN fails.
        if !(sum < one()) {
            return Err(GalerkinError::RowSum { row });
        }
        largest = Real::max(sum, largest);
    }
    Ok(largest)
}

/// The [`max_row_sum`] or, if a row sum is 1 or more, a bound of the spectral radius of |K'| by at
/// most `powers` powers: if it is below 1, E η(h,g) = (v,Φ) all the same. `w` and `next` are room for n
/// numbers each; what they hold is lost.
///
/// # Errors
/// [`GalerkinError::Length`]; [`GalerkinError::RowSum`]: a row sum is NaN; [`GalerkinError::Radius`].
pub fn spectral_radius_bound<F: Real>(
    matrix: &dyn GalerkinMatrix<Scalar = F>,
    w: &mut [F],
    next: &mut [F],
    powers: u32,
) -> Result<F, GalerkinError> {
    let refused = match max_row_sum(matrix) {
        Err(GalerkinError::RowSum { row }) if !matrix.row_sum(row).is_nan() => row,
        done => return done,
    };
    if let Some(row) = (refused..matrix.cells()).find(|&i| matrix.row_sum(i).is_nan()) {
        return Err(GalerkinError::RowSum { row });
    }
    for found in [w.len(), next.len()] {
        let expected = matrix.cells();
        if found != expected {
            return Err(GalerkinError::Length { expected, found });
        }
    }
    w.fill(one());
    let [_, radius] =
        collatz_wielandt_bounds(&mut |w, out| matrix.apply_absolute(w, out), w, next, powers);
    if radius < one() {
        Ok(radius)
    } else {
        Err(GalerkinError::Radius)
    }
}

/// Bounds of the spectral radius of a matrix without negative entries, by the power method from `w`: the
/// smallest and the largest of (Aw)_i/w_i (Collatz 1942, Wielandt 1950) after `powers` steps, or as soon
/// as they agree to a millionth. They are exact bounds where the matrix is irreducible on the entries that
/// w has; `apply` is w ↦ Aw.
///
/// With the matrix of T_k²p it tells whether plain walks have a finite variance (spectral radius below
/// 1): an estimate, as the matrix is an approximation of the operator.
pub fn collatz_wielandt_bounds<F: Real>(
    apply: &mut dyn FnMut(&[F], &mut [F]),
    w: &mut [F],
    next: &mut [F],
    powers: u32,
) -> [F; 2] {
    let mut bounds = [zero(); 2];
    for power in 0..powers {
        apply(w, next);
        let mut ratios = w
            .iter()
            .zip(next.iter())
            .filter(|(w, _)| **w > zero())
            .map(|(&w, &next)| next / w);
        let first = ratios.next().unwrap_or_else(zero);
        // The first step may empty entries that the matrix does not reach.
        if power > 0 || powers == 1 {
            bounds = ratios.fold([first; 2], |[low, high], ratio| {
                [
                    if ratio < low { ratio } else { low },
                    Real::max(high, ratio),
                ]
            });
        }
        let largest = next.iter().fold(zero(), |m, &x| Real::max(x, m));
        if !(largest > zero()) {
            return [zero(); 2];
        }
        let [low, high] = bounds;
        if high > zero() && high - low <= high * F::from_f64(1e-6) {
            break;
        }
        for (w, &next) in w.iter_mut().zip(next.iter()) {
            *w = next / largest;
        }
    }
    bounds
}

/// Solves (41) approximately by Gauss–Seidel sweeps, from what `v` holds. `source` is F'; both have
/// n·B entries. `scratch` has at least as many as [`GalerkinMatrix::scratch`] says, 2 where B = 1; what it
/// holds is lost.
///
/// # Errors
/// [`GalerkinError::Length`], [`GalerkinError::Diverges`].
pub fn gauss_seidel<F: Real>(
    matrix: &dyn GalerkinMatrix<Scalar = F>,
    source: &[F],
    v: &mut [F],
    scratch: &mut [F],
    sweeps: StoppingRule<F>,
) -> Result<Convergence<F>, GalerkinError> {
    check_length(matrix, source)?;
    check_length(matrix, v)?;
    let (expected, found) = (matrix.scratch(), scratch.len());
    if found < expected {
        return Err(GalerkinError::Length { expected, found });
    }
    let (residual, at_most) = match sweeps {
        StoppingRule::Fixed(sweeps) => (-one::<F>(), sweeps),
        StoppingRule::UntilResidual { residual, at_most } => (residual, at_most),
    };
    let mut convergence = Convergence {
        sweeps: 0,
        residual: zero(),
    };
    let mut first = None;
    while convergence.sweeps < at_most {
        convergence.residual = matrix.sweep(source, v, scratch);
        convergence.sweeps += 1;
        let first = *first.get_or_insert(convergence.residual);
        // A convergent iteration may grow at first, but not by this much.
        if !(convergence.residual <= first * F::from_f64(1e6)) || !convergence.residual.is_finite()
        {
            return Err(GalerkinError::Diverges {
                sweep: convergence.sweeps,
            });
        }
        if convergence.residual <= residual {
            break;
        }
    }
    // A pivot that rounds to 0 shows in v alone where the residual before it was 0.
    if !v.iter().all(|v| v.is_finite()) {
        return Err(GalerkinError::Diverges {
            sweep: convergence.sweeps,
        });
    }
    Ok(convergence)
}

/// G over S alone, (42): G_ia = v_ia − Σ_(i,j)∈S Σ_b K'_(ia)(jb) v_jb, into `g`. Both have n·B
/// entries.
///
/// G must come from the same coefficients, pairs and v that the walk uses. For a walk in f32 round
/// v first, compute G from it in f64, then round G.
///
/// # Errors
/// [`GalerkinError::Length`].
pub fn neighbour_source<F: Real>(
    matrix: &dyn GalerkinMatrix<Scalar = F>,
    pairs: &dyn Pairs,
    v: &[F],
    g: &mut [F],
) -> Result<(), GalerkinError> {
    check_length(matrix, v)?;
    check_length(matrix, g)?;
    let functions = matrix.functions().max(1);
    matrix.apply(v, g);
    let rows = g.chunks_exact_mut(functions).zip(v.chunks_exact(functions));
    for (i, (g, own)) in rows.enumerate() {
        pairs.outside(i, matrix.cells(), &mut |j| {
            let other = v.get(j * functions..(j + 1) * functions);
            for (a, g) in g.iter_mut().enumerate() {
                *g -= other.map_or(F::NAN, |other| {
                    sum((0..functions)
                        .zip(other)
                        .map(|(b, &v)| matrix.entry([i, a], [j, b]) * v))
                });
            }
        });
        for (g, &own) in g.iter_mut().zip(own) {
            *g = own - *g;
        }
    }
    Ok(())
}

/// From the first number on, as products of vectors are summed in walks.
fn sum<F: Real>(mut numbers: impl Iterator<Item = F>) -> F {
    let first = numbers.next().unwrap_or_else(zero);
    numbers.fold(first, |sum, number| sum + number)
}

fn check_length<F: Real>(
    matrix: &dyn GalerkinMatrix<Scalar = F>,
    slice: &[F],
) -> Result<(), GalerkinError> {
    let expected = matrix.cells() * matrix.functions();
    if slice.len() == expected {
        return Ok(());
    }
    Err(GalerkinError::Length {
        expected,
        found: slice.len(),
    })
}

#[cfg(test)]
mod tests {
    use super::{GalerkinError, StoppingRule, gauss_seidel, max_row_sum, spectral_radius_bound};
    use crate::galerkin::Dense;

    #[test]
    fn solves_a_small_system() {
        let k = [0.1, 0.2, 0.3, 0.4];
        let dense = Dense::new(&k, 2, 1).unwrap();
        let mut v = [0.0_f64; 2];
        let sweeps = StoppingRule::UntilResidual {
            residual: 1e-15,
            at_most: 100,
        };
        let convergence = gauss_seidel(&dense, &[1.0, 2.0], &mut v, &mut [0.0; 2], sweeps).unwrap();
        assert!(convergence.sweeps < 100 && convergence.residual <= 1e-15);
        // (I − K') v = F' by hand: determinant 0.48.
        assert!((v[0] - 1.0 / 0.48).abs() < 1e-14, "{v:?}");
        assert!((v[1] - 2.1 / 0.48).abs() < 1e-14);
        // The same as one cell with two unknowns: solved by the first sweep.
        let mut block = [0.0_f64; 2];
        let dense = Dense::new(&k, 1, 2).unwrap();
        let (source, once) = ([1.0, 2.0], StoppingRule::Fixed(1));
        gauss_seidel(&dense, &source, &mut block, &mut [0.0; 6], once).unwrap();
        assert!((block[0] - v[0]).abs() < 1e-14 && (block[1] - v[1]).abs() < 1e-14);
        assert_eq!(
            gauss_seidel(&dense, &source, &mut block, &mut [0.0; 5], once),
            Err(GalerkinError::Length {
                expected: 6,
                found: 5
            })
        );
    }

    #[test]
    fn divergence_is_an_error() {
        let k = [0.5, 2.0, 2.0, 0.5];
        let dense = Dense::new(&k, 2, 1).unwrap();
        let mut v = [0.0; 2];
        let sweeps = StoppingRule::UntilResidual {
            residual: 1e-15,
            at_most: 10_000,
        };
        assert!(matches!(
            gauss_seidel(&dense, &[1.0, 2.0], &mut v, &mut [0.0; 2], sweeps),
            Err(GalerkinError::Diverges { .. })
        ));
        let nan = [f64::NAN, 0.0, 0.0, 0.0];
        let dense = Dense::new(&nan, 2, 1).unwrap();
        assert_eq!(
            gauss_seidel(
                &dense,
                &[1.0, 2.0],
                &mut [0.0; 2],
                &mut [0.0; 2],
                StoppingRule::Fixed(3)
            ),
            Err(GalerkinError::Diverges { sweep: 1 })
        );
    }

    #[test]
    fn the_radius_of_a_small_matrix_lies_between_its_bounds() {
        // [[2, 1, 0], [1, 2, 0], [0, 0, 0]] has eigenvalues 3, 1 and 0.
        let apply = |w: &[f64], out: &mut [f64]| {
            out.copy_from_slice(&[2.0 * w[0] + w[1], w[0] + 2.0 * w[1], 0.0]);
        };
        let mut w = [1.0, 0.1, 1.0];
        let [low, high] = super::collatz_wielandt_bounds(&mut { apply }, &mut w, &mut [0.0; 3], 3);
        assert!(
            2.0 < low && low < 3.0 && 3.0 < high && high < 3.4,
            "{low} {high}"
        );
        let [low, high] = super::collatz_wielandt_bounds(&mut { apply }, &mut w, &mut [0.0; 3], 60);
        assert!((low - 3.0).abs() < 3e-6 && (high - 3.0).abs() < 3e-6);
        let none = |_: &[f64], out: &mut [f64]| out.fill(0.0);
        assert_eq!(
            super::collatz_wielandt_bounds(&mut { none }, &mut w, &mut [0.0; 3], 5),
            [0.0; 2]
        );
    }

    #[test]
    fn a_matrix_whose_powers_shrink_is_a_contraction() {
        let (mut w, mut next) = ([0.0; 2], [0.0; 2]);
        let mut bound = |k: [f64; 4]| {
            let dense = Dense::new(&k, 2, 1).unwrap();
            spectral_radius_bound(&dense, &mut w, &mut next, 100)
        };
        assert_eq!(bound([0.1, -0.2, 0.5, 0.25]), Ok(0.75));
        // |K'| has the eigenvalues ±√(2 · 0.3), and the row sum 2.
        let radius = bound([0.1, -2.0, 0.3, 0.1]).unwrap();
        assert!((radius - 0.6_f64.sqrt() - 0.1).abs() < 1e-5, "{radius}");
        assert_eq!(bound([0.1, -2.0, 0.6, 0.1]), Err(GalerkinError::Radius));
        assert_eq!(
            bound([0.1, 2.0, f64::NAN, 0.1]),
            Err(GalerkinError::RowSum { row: 1 })
        );
    }

    #[test]
    fn row_sums_of_one_or_nan_are_refused() {
        let dense = [0.1, 0.2, -0.5, 0.5];
        assert_eq!(
            max_row_sum(&Dense::new(&dense, 2, 1).unwrap()),
            Err(GalerkinError::RowSum { row: 1 })
        );
        let dense = [0.1, f64::NAN, 0.5, 0.2];
        assert_eq!(
            max_row_sum(&Dense::new(&dense, 2, 1).unwrap()),
            Err(GalerkinError::RowSum { row: 0 })
        );
        let dense = [0.1, -0.2, 0.5, 0.25];
        assert_eq!(max_row_sum(&Dense::new(&dense, 2, 1).unwrap()), Ok(0.75));
    }
}
