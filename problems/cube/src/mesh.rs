//! Cell numbers.

use fredholm_core::array::{Each, from_fn};
use fredholm_core::{Located, Real};

use crate::CubeError;

/// m^D equal cells; the number of a cell is row-major in its place along the axes, the last axis
/// running fastest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mesh<const D: usize> {
    per_axis: u32,
    cells: u32,
}

impl<const D: usize> Mesh<D> {
    pub(crate) fn new(per_axis: usize) -> Result<Self, CubeError> {
        let per_axis = u32::try_from(per_axis).map_err(|_| CubeError::Cells)?;
        let dimension = u32::try_from(D).map_err(|_| CubeError::Cells)?;
        match per_axis.checked_pow(dimension) {
            // `cells` is used as an index, too.
            Some(cells) if cells > 0 && usize::try_from(cells).is_ok() => {
                Ok(Self { per_axis, cells })
            }
            _ => Err(CubeError::Cells),
        }
    }

    /// m.
    #[inline]
    pub(crate) const fn per_axis(&self) -> u32 {
        self.per_axis
    }

    /// n = m^D.
    #[inline]
    pub(crate) const fn cells(&self) -> usize {
        self.cells as usize
    }

    /// The cell of a point; cells are half open, and the end 1 of an axis belongs to its last cell.
    #[inline]
    pub(crate) fn locate<F: Real>(&self, x: &[F; D], per_axis: F) -> usize {
        let m = self.per_axis;
        let cell = x
            .iter()
            .fold(0, |cell, &x| cell * m + (x * per_axis).to_u32().min(m - 1));
        cell as usize
    }

    /// The places of cell `cell` along the axes.
    #[inline]
    pub(crate) fn places(&self, cell: usize) -> [u32; D] {
        // Divisions of 32 bits are several times as fast as those of 64.
        let mut rest = cell as u32;
        let mut places = [0; D];
        for place in places.iter_mut().rev() {
            *place = rest % self.per_axis;
            rest /= self.per_axis;
        }
        places
    }

    /// The point of a cell at t ∈ [0, 1]^D.
    pub(crate) fn point(&self, cell: usize, t: &[f64; D]) -> [f64; D] {
        let places = self.places(cell);
        from_fn(|a| (f64::from(places[a]) + t[a]) / f64::from(self.per_axis))
    }

    /// The place of a point in its cell, from 0 to 1 along every axis.
    #[inline]
    pub(crate) fn local<F: Real>(&self, x: &Located<[F; D]>) -> [F; D] {
        let per_axis = F::from_u32(self.per_axis);
        let mut t = self.places(x.cell).each(F::from_u32);
        for (t, &x) in t.iter_mut().zip(&x.point) {
            *t = x * per_axis - *t;
        }
        t
    }
}
