//! Owned tables, and the whole deterministic part in one call.

use alloc::vec::Vec;
use fredholm_core::array::Each;

use fredholm_core::Real;
use fredholm_core::galerkin::{
    GalerkinError, GalerkinMatrix, PairIntegral, Pairs, Solution, buffer, collatz_wielandt_bounds,
};

use crate::{
    Cell, Cells, Circle, CircleError, ClosedForm, Emission, Moment, PolynomialCircle, Slot,
    moments, slots,
};

/// The buffers of [`Cells`], owned.
#[derive(Clone, Debug)]
pub struct Tables<F> {
    cells: Vec<Cell<F>>,
    slots: Vec<Slot<F>>,
}

impl<F: Real> Tables<F> {
    /// The tables of a circle with `reflectance` on equal arcs and `cells` cells: 72 bytes a
    /// cell in f64, 36 in f32.
    ///
    /// # Errors
    /// As [`Cells::fill`], and [`CircleError::Memory`].
    pub fn new(reflectance: &[f64], cells: usize) -> Result<Self, CircleError> {
        crate::cells::validate(reflectance, cells)?;
        let mut tables = Self {
            cells: Vec::new(),
            slots: Vec::new(),
        };
        let reserved = tables.cells.try_reserve_exact(cells);
        reserved
            .and_then(|()| tables.slots.try_reserve_exact(slots(cells)))
            .map_err(|_| CircleError::Memory { cells })?;
        tables.cells.resize(cells, Cell::default());
        tables.slots.resize(slots(cells), Slot::default());
        Cells::fill(reflectance, &mut tables.cells, &mut tables.slots)?;
        Ok(tables)
    }

    /// The cells.
    #[must_use]
    pub fn cells(&self) -> Cells<'_, F> {
        Cells::filled(&self.cells, &self.slots)
    }
}

/// The spectral radius of T_k²p, estimated by powers of its Galerkin matrix ρ_i²Ψ_ij/(1 − q0) on this
/// circle's cells. Plain walks have a finite variance, and so have preconditioned ones up to the
/// quality of h, if it is below 1; it is at most max ρ²/(1 − q0).
#[must_use]
pub fn second_moment_radius<E: Emission<f64>>(circle: &Circle<'_, f64, E>) -> f64 {
    let n = circle.table().len();
    let (mut w, mut next) = (alloc::vec![1.0; n], alloc::vec![0.0; n]);
    let mut apply = |w: &[f64], out: &mut [f64]| {
        circle.apply(w, out);
        for (i, out) in out.iter_mut().enumerate() {
            *out *= circle.weight(i);
        }
    };
    let [_, upper] = collatz_wielandt_bounds(&mut apply, &mut w, &mut next, 100);
    upper
}

impl<E: Emission<f64>> Circle<'_, f64, E> {
    /// The Galerkin solution: solves (41) by Gauss–Seidel sweeps until no residual is above `tolerance`
    /// times the largest |F'_i|, at most `at_most` sweeps.
    ///
    /// # Errors
    /// As [`Solution::new`].
    pub fn solve(&self, tolerance: f64, at_most: u32) -> Result<Solution, GalerkinError> {
        let mut source = buffer(self.table().len())?;
        self.source_means(&mut source)
            .map_err(|_| GalerkinError::Length {
                expected: self.table().len(),
                found: source.len(),
            })?;
        Solution::new(self, source, tolerance, at_most)
    }
}

/// The moments for [`Residual`](crate::Residual) in the walk's scalar, from v as rounded to it, on a [`Circle`] or with
/// [`PolynomialCircle`].
///
/// # Errors
/// [`GalerkinError::Length`]: the solution has another number of unknowns; [`GalerkinError::Memory`].
pub fn residual_moments<F: Real, P: ClosedForm<f64, B>, const B: usize>(
    problem: &P,
    solution: &Solution,
) -> Result<Vec<Moment<F>>, GalerkinError> {
    let v = solution.rounded_through::<F>()?;
    let cells = problem.table().len();
    let mut wide = buffer(cells)?;
    moments(problem, &v, &mut wide).map_err(|_| GalerkinError::Length {
        expected: cells * B,
        found: v.len(),
    })?;
    let mut out = buffer(cells)?;
    for (out, wide) in out.iter_mut().zip(&wide) {
        *out = wide.cast();
    }
    Ok(out)
}

impl<E: Emission<f64>, const B: usize> PolynomialCircle<'_, '_, f64, E, B> {
    /// The Galerkin solution, as [`Circle::solve`].
    ///
    /// # Errors
    /// As [`Solution::new`].
    pub fn solve(&self, tolerance: f64, at_most: u32) -> Result<Solution, GalerkinError> {
        let expected = self.circle().table().len() * B;
        let mut source = buffer(expected)?;
        self.source_means(&mut source)
            .map_err(|_| GalerkinError::Length {
                expected,
                found: source.len(),
            })?;
        Solution::new(self, source, tolerance, at_most)
    }
}

/// The spectral radius of T_h²p with B functions per cell and these pairs, as
/// `fredholm_core::galerkin::second_moment_radius` estimates it from three points of every cell.
///
/// # Errors
/// [`GalerkinError::Memory`].
pub fn neighbour_second_moment_radius<E: Emission<f64>, const B: usize>(
    polynomials: &PolynomialCircle<'_, '_, f64, E, B>,
    pairs: &dyn Pairs,
) -> Result<f64, GalerkinError> {
    let circle = polynomials.circle();
    let cells = circle.table().len();
    let point =
        |i: usize, t: f64| circle.point(core::f64::consts::TAU * ((i as f64 + t) / cells as f64));
    fredholm_core::galerkin::second_moment_radius(
        polynomials,
        polynomials,
        pairs,
        // Within the cell: at its very ends a point belongs to the next.
        |i| [1e-6, 0.5, 1.0 - 1e-6].each(|t| point(i, t)),
        |x, j| {
            let [first] = <_ as PairIntegral<B>>::pair_integral(polynomials, x, j)
                .first_chunk()
                .copied()
                .unwrap_or([f64::NAN]);
            circle.weight(x.cell) * first
        },
    )
}
