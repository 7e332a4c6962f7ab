//! Cells as images of a cube.

use super::Partition;
use crate::Located;

/// Cells as images of the cube [0, 1]^d, for whoever takes integrals over cells or draws points from them.
///
/// Walks do not need it. What solves an equation without knowing its kind does: it computes Galerkin coefficients by
/// quadrature, and starts walks that estimate a mean over X.
///
/// ```
/// use fredholm_core::{Located, StateSpace};
/// use fredholm_core::galerkin::{CellMap, Partition};
///
/// /// [0, 2] in four cells.
/// struct Interval;
///
/// impl StateSpace for Interval {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl Partition for Interval {
///     fn cells(&self) -> usize {
///         4
///     }
///     fn locate(&self, x: &f64) -> usize {
///         ((2.0 * x) as usize).min(3)
///     }
/// }
/// impl CellMap for Interval {
///     const DIMENSION: usize = 1;
///     fn measure(&self, _: usize) -> f64 {
///         0.5
///     }
///     fn point(&self, cell: usize, t: &[f64]) -> f64 {
///         0.5 * (cell as f64 + t[0])
///     }
///     fn at(&self, coordinates: &[f64]) -> Option<f64> {
///         match *coordinates {
///             [x] if (0.0..=2.0).contains(&x) => Some(x),
///             _ => None,
///         }
///     }
///     fn parameters(&self, x: &Located<f64>, t: &mut [f64]) -> bool {
///         t.fill(2.0 * x.point - x.cell as f64);
///         true
///     }
/// }
///
/// let mut t = [0.0];
/// assert!(Interval.parameters(&Located { point: 1.75, cell: 3 }, &mut t) && t == [0.5]);
/// assert_eq!(Interval.locate(&Interval.point(3, &[0.5])), 3);
/// assert_eq!(Interval.at(&[1.5]), Some(1.5));
/// assert_eq!(Interval.at(&[2.5]), None);
/// ```
#[diagnostic::on_unimplemented(
    message = "the cells of `{Self}` are no images of a cube",
    label = "`CellMap` is missing",
    note = "implement `CellMap`: the measure of a cell, its point at parameters in [0, 1]^d, and the point with given \
            coordinates"
)]
pub trait CellMap: Partition {
    /// The number d of parameters of a cell: the dimension of X.
    const DIMENSION: usize;

    /// μ(X_j).
    fn measure(&self, cell: usize) -> f64;

    /// The point of the closed cell at the parameters t ∈ [0, 1]^d. Parameters that are uniform on the cube give points
    /// that are uniform on the cell with respect to μ: on a sphere take the height, not the colatitude.
    fn point(&self, cell: usize, t: &[f64]) -> Self::Point;

    /// The point with these coordinates, of whatever kind people write them in; `None` if X has no such point.
    fn at(&self, coordinates: &[f64]) -> Option<Self::Point>;

    /// Fills `t` with the parameters of a point of a cell, the inverse of [`point`](Self::point), and says whether it can.
    /// By default it cannot. With it there are polynomials of any degree on cells, on which walks of a
    /// [whole function](crate::whole) score.
    fn parameters(&self, x: &Located<Self::Point>, t: &mut [f64]) -> bool {
        let _ = (x, t);
        false
    }
}
