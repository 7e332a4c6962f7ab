//! Owned tables, and the whole deterministic part in one call.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::galerkin::{
    Coefficients, GalerkinError, Pairs, Solve, Sweeps, contraction, gauss_seidel, neighbour_source,
    radius_bounds,
};

use crate::{Cell, Cells, Circle, CircleError, Emission, Moment, Slot, moments, slots};

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
    let apply = |w: &[f64], out: &mut [f64]| {
        circle.apply(w, out);
        for (i, out) in out.iter_mut().enumerate() {
            *out *= circle.weight(i);
        }
    };
    let [_, upper] = radius_bounds(apply, &mut w, &mut next, 100);
    upper
}

/// The Galerkin solution of a circle, computed in f64.
#[derive(Clone, Debug)]
pub struct Solution {
    /// v_i.
    pub v: Vec<f64>,
    /// How the iteration went.
    pub solve: Solve<f64>,
    /// max ρ, the bound on ∫|K(x,y)| dμ(y).
    pub contraction: f64,
}

impl Solution {
    /// Solves (41) by Gauss–Seidel sweeps until no residual is above `tolerance` times the largest
    /// F'_i.
    ///
    /// # Errors
    /// [`GalerkinError`].
    pub fn new<E: Emission<f64>>(
        circle: &Circle<'_, f64, E>,
        tolerance: f64,
        at_most: u32,
    ) -> Result<Self, GalerkinError> {
        let n = circle.table().len();
        let contraction = contraction(circle)?;
        let mut source = alloc::vec![0.0; n];
        circle
            .source_means(&mut source)
            .map_err(|_| GalerkinError::Length {
                expected: n,
                found: source.len(),
            })?;
        let largest = source.iter().fold(0.0, |m: f64, f| Real::max(m, f.abs()));
        // F' is a good start: the reflected light is missing.
        let mut v = source.clone();
        let sweeps = Sweeps::UntilResidual {
            residual: tolerance * largest,
            at_most,
        };
        let solve = gauss_seidel(circle, &source, &mut v, sweeps)?;
        Ok(Self {
            v,
            solve,
            contraction,
        })
    }

    /// v in the walk's scalar.
    #[must_use]
    pub fn rounded<F: Real>(&self) -> Vec<F> {
        self.v.iter().map(|&v| F::from_f64(v)).collect()
    }

    /// G for these pairs in the walk's scalar, from v as rounded to it.
    ///
    /// # Errors
    /// [`GalerkinError::Length`]: the circle has another number of cells.
    pub fn source<F: Real, E: Emission<f64>, P: Pairs>(
        &self,
        circle: &Circle<'_, f64, E>,
        pairs: &P,
    ) -> Result<Vec<F>, GalerkinError> {
        let mut g = alloc::vec![0.0; self.v.len()];
        neighbour_source(circle, pairs, &self.wide::<F>(), &mut g)?;
        Ok(g.into_iter().map(F::from_f64).collect())
    }

    /// The moments for [`Residual`](crate::Residual) in the walk's scalar, from v as rounded to it.
    ///
    /// # Errors
    /// [`CircleError::Length`]: the circle has another number of cells.
    pub fn moments<F: Real>(&self, cells: &Cells<'_, f64>) -> Result<Vec<Moment<F>>, CircleError> {
        let mut out = alloc::vec![Moment::default(); self.v.len()];
        moments(cells, &self.wide::<F>(), &mut out)?;
        Ok(out.iter().map(Moment::cast).collect())
    }

    fn wide<F: Real>(&self) -> Vec<f64> {
        self.v.iter().map(|&v| F::from_f64(v).to_f64()).collect()
    }
}
