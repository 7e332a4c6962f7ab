//! Galerkin coefficients of a product kernel, from borrowed tables.

use fredholm_core::Real;
use fredholm_core::galerkin::Coefficients;

use crate::CubeError;
use crate::mesh::Mesh;
use crate::product::product;

/// The coefficients K'_ij = Π_a K'_a(i_a, j_a) of a product kernel, from one m × m table for every
/// axis, wherever it lies: in flash, on a stack. It needs no memory; with the feature `alloc`,
/// [`ProductTables`](crate::ProductTables) computes the tables, owns them and multiplies faster.
///
/// ```
/// use fredholm_core::galerkin::Coefficients;
/// use fredholm_cube::FactorTables;
///
/// // Two axes of two cells.
/// let entries = [0.1, 0.2, 0.3, 0.4, 1.0, 0.5, 0.5, 1.0];
/// let factors = FactorTables::<f64, 2>::new(2, &entries)?;
/// // From cell (1, 0) to cell (0, 1).
/// assert_eq!(factors.block(2, 1), [[0.3 * 0.5]]);
/// # Ok::<(), fredholm_cube::CubeError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct FactorTables<'a, F, const D: usize> {
    mesh: Mesh<D>,
    /// Those of axis 0 row by row, then those of axis 1, and so on.
    entries: &'a [F],
}

impl<'a, F: Real, const D: usize> FactorTables<'a, F, D> {
    /// D tables of m² numbers, m = `per_axis`: that of axis 0 row by row, then that of axis 1, and so
    /// on.
    ///
    /// # Errors
    /// [`CubeError::Cells`], [`CubeError::Length`].
    pub fn new(per_axis: usize, entries: &'a [F]) -> Result<Self, CubeError> {
        let mesh = Mesh::new(per_axis)?;
        let length = per_axis.checked_mul(per_axis);
        let expected = length.and_then(|entries| entries.checked_mul(D));
        match expected {
            Some(expected) if expected == entries.len() => Ok(Self { mesh, entries }),
            Some(expected) => Err(CubeError::Length {
                expected,
                found: entries.len(),
            }),
            None => Err(CubeError::Cells),
        }
    }

    /// Of tables that have the right length.
    #[cfg(feature = "alloc")]
    pub(crate) const fn filled(mesh: Mesh<D>, entries: &'a [F]) -> Self {
        Self { mesh, entries }
    }

    /// Row `place` of the table of `axis`; empty where there is none.
    #[inline]
    pub(crate) fn row(&self, axis: usize, place: u32) -> &'a [F] {
        let m = self.mesh.per_axis() as usize;
        let start = (axis * m + place as usize) * m;
        self.entries.get(start..start + m).unwrap_or(&[])
    }
}

impl<F: Real, const D: usize> Coefficients for FactorTables<'_, F, D> {
    type Scalar = F;

    fn cells(&self) -> usize {
        self.mesh.cells()
    }

    #[inline]
    fn block(&self, i: usize, j: usize) -> [[F; 1]; 1] {
        let (from, to) = (self.mesh.places(i), self.mesh.places(j));
        let m = self.mesh.per_axis() as usize;
        let entry = |a: usize| {
            let at = (a * m + from[a] as usize) * m + to[a] as usize;
            self.entries.get(at).copied().unwrap_or(F::NAN)
        };
        [[product(core::array::from_fn::<_, D, _>(entry))]]
    }

    /// O(D m): the row sums of the factors, multiplied.
    fn row_sum(&self, i: usize) -> F {
        let places = self.mesh.places(i);
        product(core::array::from_fn::<_, D, _>(|a| {
            let row = self.row(a, places[a]).iter();
            row.fold(F::zero(), |sum, k| sum + k.abs())
        }))
    }
}
