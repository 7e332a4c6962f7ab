//! The whole deterministic part in one call.

use alloc::vec::Vec;

use fredholm_core::galerkin::{Dense, GalerkinMatrix, Solution, buffer, reserve};

use crate::{Material, Matrix, Mesh, RoomError, Scene, WallColours};

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

impl Matrix {
    /// The Galerkin solution of the room whose matrix this is: solves (41) by Gauss–Seidel sweeps
    /// until no residual is above `tolerance` times the largest |F'_i|, at most `at_most` sweeps.
    ///
    /// # Errors
    /// [`RoomError::Length`] where the matrix is not of this mesh, and as [`RoomError::Galerkin`]
    /// what [`Solution::new`] says.
    pub fn solve(
        &self,
        scene: &Scene,
        mesh: &Mesh,
        tolerance: f64,
        at_most: u32,
    ) -> Result<Solution, RoomError> {
        let own = |wall| scene.material(wall);
        self.solve_materials((scene, mesh), &own, (tolerance, at_most))
    }

    /// The Galerkin solutions of all channels of the room whose matrix this is, each as [`solve`](Self::solve) has it: the
    /// coefficients differ by the reflectances of rows.
    ///
    /// # Errors
    /// As there, and [`RoomError::Length`] where the colours are those of other walls.
    pub fn solve_channels(
        &self,
        scene: &Scene,
        mesh: &Mesh,
        colours: &WallColours<'_, f64>,
        tolerance: f64,
        at_most: u32,
    ) -> Result<Vec<Solution>, RoomError> {
        let (expected, found) = (scene.walls.len(), colours.walls());
        if expected != found {
            return Err(RoomError::Length { expected, found });
        }
        let mut all = reserve(colours.channels())?;
        for channel in 0..colours.channels() {
            let own = |wall| colours.material(wall, channel);
            all.push(self.solve_materials((scene, mesh), &own, (tolerance, at_most))?);
        }
        Ok(all)
    }

    /// The solution for these materials of walls.
    fn solve_materials(
        &self,
        (scene, mesh): (&Scene, &Mesh),
        material: &dyn Fn(usize) -> Material,
        (tolerance, at_most): (f64, u32),
    ) -> Result<Solution, RoomError> {
        let (expected, found) = (mesh.len(), self.cells());
        if expected != found {
            return Err(RoomError::Length { expected, found });
        }
        let mut shares: Vec<f64> = buffer(mesh.len())?;
        // (nB)² numbers are there, so that nB is one. F is constant on walls.
        let mut source = buffer(mesh.len() * self.functions())?;
        let sources = source.iter_mut().step_by(self.functions());
        for ((share, source), &wall) in shares.iter_mut().zip(sources).zip(&mesh.walls) {
            let own = material(wall as usize);
            let most = scene.material(wall as usize).reflectance;
            // Of a black wall all coefficients are 0.
            *share = if most == 0.0 {
                0.0
            } else {
                own.reflectance / most
            };
            *source = own.emission;
        }
        let coefficients = Shares {
            of: self.coefficients(),
            shares: &shares,
        };
        Ok(Solution::new(&coefficients, source, tolerance, at_most)?)
    }
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
