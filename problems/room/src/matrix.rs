//! Galerkin coefficients: what cells receive of each other.

use alloc::vec::Vec;

use fredholm_core::Value as _;
use fredholm_core::galerkin::{Cells, Dense, GalerkinMatrix, Solution, buffer, legendre};
use fredholm_surfaces::{Grey, Tint};

use crate::moments::MOST;
use crate::panels::gauss;
use crate::views::parts;
use crate::{Room, RoomError};

/// The change at which the iteration for v stops, and the most sweeps.
const TOLERANCE: f64 = 1e-14;
const SWEEPS: u32 = 10_000;

/// Fills the rows of a cell, whatever they held.
pub type RowFill<'f> = &'f (dyn Fn(usize, &mut [f64]) -> Result<(), RoomError> + Sync);

/// K' with B functions on a cell, (nB)² numbers. For B = 1 K'_ij is ρ_i F_ij with F_ij the form factor from cell i to cell j.
///
/// What points of a cell see of all others is exact, and in sum all there is. Over the points of the cell it is integrated by Gauss points in
/// the parts from which the same walls are seen.
#[derive(Clone, Debug)]
pub struct Matrix {
    entries: Vec<f64>,
    cells: usize,
    functions: usize,
}

impl Matrix {
    /// The coefficients of all pairs of cells of a room, with B functions on every cell, at most 5.
    ///
    /// # Errors
    /// [`RoomError::Memory`].
    pub fn new<const B: usize>(room: &Room<'_, f64>) -> Result<Self, RoomError> {
        Self::with_rows::<B, RoomError>(room, in_order)
    }

    /// The coefficients by a function that has the rows of all cells filled, as many entries for each as it is told, in any order and
    /// on any threads: every cell's are computed by themselves.
    ///
    /// # Errors
    /// [`RoomError::Memory`], and those of the function.
    pub fn with_rows<const B: usize, E: From<RoomError>>(
        room: &Room<'_, f64>,
        rows: impl FnOnce(&mut [f64], usize, RowFill<'_>) -> Result<(), E>,
    ) -> Result<Self, E> {
        let cells = room.cells();
        let unknowns = cells.checked_mul(B);
        let size = unknowns.and_then(|unknowns| unknowns.checked_mul(unknowns));
        let mut entries: Vec<f64> =
            buffer(size.ok_or(RoomError::Memory { bytes: None })?).map_err(RoomError::from)?;
        rows(&mut entries, cells * B * B, &|cell, rows| {
            let mut row = buffer(cells * B)?;
            rows.fill(0.0);
            for [from, to] in parts(room, cell, &[]) {
                for (place, weight) in places(B.max(2)) {
                    let t = from + (to - from) * place;
                    let Some(x) = room.inside(cell, t) else {
                        continue;
                    };
                    room.all_form_factors::<B>(&x, &mut row);
                    let psi: [f64; B] = legendre(t + t - 1.0);
                    let weight = weight * (to - from) * room.reflectance(&x);
                    for (entries, psi) in rows.chunks_exact_mut(cells * B).zip(psi) {
                        for (entry, moment) in entries.iter_mut().zip(&row) {
                            *entry += weight * psi * moment;
                        }
                    }
                }
            }
            Ok(())
        })?;
        Ok(Self {
            entries,
            cells,
            functions: B,
        })
    }

    /// n.
    #[must_use]
    pub const fn cells(&self) -> usize {
        self.cells
    }

    /// B.
    #[must_use]
    pub const fn functions(&self) -> usize {
        self.functions
    }

    /// K'_(ia)(jb), row by row: (nB)² entries.
    #[must_use]
    pub fn entries(&self) -> &[f64] {
        &self.entries
    }

    /// K'.
    ///
    /// # Panics
    /// Never: the table is square.
    #[must_use]
    pub fn coefficients(&self) -> Dense<'_, f64> {
        Dense::new(&self.entries, self.cells, self.functions).expect("a square table")
    }

    /// The Galerkin solution (41) of the room whose matrix this is, by Gauss–Seidel sweeps.
    ///
    /// # Errors
    /// [`RoomError::Length`] where the matrix is not of this room, and as [`RoomError::Galerkin`] what [`Solution::new`] says.
    pub fn solve(&self, room: &Room<'_, f64>) -> Result<Solution, RoomError> {
        self.solve_channel(room, &Grey, 0)
    }

    /// The solution of a channel: the coefficients differ by the reflectances of rows.
    pub(crate) fn solve_channel(
        &self,
        room: &Room<'_, f64>,
        tint: &impl Tint<f64>,
        channel: usize,
    ) -> Result<Solution, RoomError> {
        let (expected, found) = (room.cells(), self.cells);
        if expected != found {
            return Err(RoomError::Length { expected, found });
        }
        let mut shares: Vec<f64> = buffer(self.cells)?;
        // (nB)² numbers are there, so that nB is one. F is constant on walls, but for the light from outside.
        let mut source: Vec<f64> = buffer(self.cells * self.functions)?;
        let sources = source.chunks_exact_mut(self.functions);
        for (cell, (share, source)) in shares.iter_mut().zip(sources).enumerate() {
            let wall = room.partition().wall(cell).unwrap_or(usize::MAX);
            *share = tint.reflectance(wall as u32).get(channel);
            let most = room.geometry().material(wall);
            let own = most.in_channel(tint, [wall, channel]);
            if !room.outside.is_empty() {
                self.project_outside(room, cell, source);
                source.iter_mut().for_each(|s| *s *= own.reflectance);
            }
            if let Some(first) = source.first_mut() {
                *first += own.emission;
            }
        }
        let coefficients = Shares {
            of: self.coefficients(),
            shares: &shares,
        };
        Ok(Solution::new(&coefficients, source, TOLERANCE, SWEEPS)?)
    }
}

/// Fills the rows of all cells one after the other.
pub(crate) fn in_order(
    entries: &mut [f64],
    width: usize,
    fill: RowFill<'_>,
) -> Result<(), RoomError> {
    let mut rows = entries.chunks_exact_mut(width.max(1)).enumerate();
    rows.try_for_each(|(cell, rows)| fill(cell, rows))
}

impl Matrix {
    /// Adds the projection of what comes from outside on a cell.
    fn project_outside(&self, room: &Room<'_, f64>, cell: usize, out: &mut [f64]) {
        for [from, to] in parts(room, cell, &[]) {
            for (place, weight) in places(self.functions.max(2)) {
                let t = from + (to - from) * place;
                let seen = room
                    .inside(cell, t)
                    .map_or(f64::NAN, |x| room.from_outside(&x));
                let psi: [f64; MOST] = legendre(t + t - 1.0);
                for (out, psi) in out.iter_mut().zip(psi) {
                    *out += weight * (to - from) * seen * psi;
                }
            }
        }
    }
}

/// Places in the unit interval, and weights that sum to 1, for so many functions.
pub(crate) fn places(functions: usize) -> Vec<(f64, f64)> {
    if functions == 1 {
        // The mean is the value in the middle, but for what cells of degree 0 do not see either.
        return alloc::vec![(0.5, 1.0)];
    }
    let rule = gauss::<f64>(usize::from(functions > 3));
    rule.map(|(t, weight)| (0.5 + 0.5 * t, 0.5 * weight))
        .collect()
}

/// v of all channels as walks take it: B numbers of every channel, cell by cell, from the solutions of the channels.
#[must_use]
pub fn side_by_side(solutions: &[Solution], functions: usize) -> Vec<f64> {
    let unknowns = solutions.first().map_or(0, |first| first.v.len());
    let mut all = Vec::with_capacity(unknowns * solutions.len());
    for from in (0..unknowns).step_by(functions.max(1)) {
        for own in solutions {
            all.extend_from_slice(own.v.get(from..from + functions).unwrap_or(&[]));
        }
    }
    all
}

/// Coefficients of which every cell's rows have a share.
struct Shares<'a> {
    of: Dense<'a, f64>,
    shares: &'a [f64],
}

impl Shares<'_> {
    fn share(&self, cell: usize) -> f64 {
        self.shares.get(cell).copied().unwrap_or(f64::NAN)
    }
}

impl GalerkinMatrix for Shares<'_> {
    type Scalar = f64;

    fn cells(&self) -> usize {
        self.of.cells()
    }

    fn functions(&self) -> usize {
        self.of.functions()
    }

    fn entry(&self, row: [usize; 2], column: [usize; 2]) -> f64 {
        self.share(row[0]) * self.of.entry(row, column)
    }

    fn rows_times(&self, i: usize, v: &[f64], out: &mut [f64]) {
        self.of.rows_times(i, v, out);
        out.iter_mut().for_each(|out| *out *= self.share(i));
    }
}
