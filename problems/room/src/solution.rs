//! The whole deterministic part in one call.

use alloc::vec::Vec;

use fredholm_core::Kernel;
use fredholm_core::galerkin::{
    Dense, GalerkinMatrix, Solution, buffer, collatz_wielandt_bounds, reserve,
};

use crate::{Matrix, Mesh, PolynomialRoom, RoomError, RoomPairs, Scene, WallColours};

/// The spectral radius of T_k²p, estimated by powers of its Galerkin matrix ρ_i K'_ij/(1 − q0).
/// Plain walks have a finite variance, and so have preconditioned ones up to the quality of h, if
/// it is below 1; it is at most max ρ²/(1 − q0).
///
/// O(n²) for each of 100 powers.
///
/// # Errors
/// [`RoomError::Memory`].
pub fn second_moment_radius(
    scene: &Scene,
    mesh: &Mesh,
    matrix: &Matrix<'_>,
    absorption: f64,
) -> Result<f64, RoomError> {
    let (n, functions) = (matrix.cells(), matrix.functions());
    let (mut w, mut next) = (buffer(n)?, buffer(n)?);
    w.fill(1.0);
    let mut apply = |w: &[f64], out: &mut [f64]| {
        // The first row of every cell's: K'_(i0)(j0) are among them.
        let rows = matrix.entries().chunks_exact(n.max(1) * functions);
        let rows = rows.step_by(functions);
        for ((out, row), &wall) in out.iter_mut().zip(rows).zip(&mesh.walls) {
            let means = row.iter().step_by(functions);
            let sum: f64 = means.zip(w).map(|(k, w)| k * w).sum();
            let wall = scene.walls.get(wall as usize);
            *out = sum * wall.map_or(f64::NAN, |w| w.reflectance) / (1.0 - absorption);
        }
    };
    let [_, upper] = collatz_wielandt_bounds(&mut apply, &mut w, &mut next, 100);
    Ok(upper)
}

/// The spectral radius of T_h²p with B functions per cell and these pairs, as
/// `fredholm_core::galerkin::second_moment_radius` estimates it from the three Gauss points of
/// every cell: where cells are too few for the degree it may be above 1, and error bars lie.
///
/// # Errors
/// [`RoomError::Memory`]; [`RoomError::Length`], where the matrix is not of this room's cells, and
/// [`RoomError::Galerkin`], where it is of another number of functions.
pub fn neighbour_second_moment_radius<const B: usize>(
    polynomials: &PolynomialRoom<'_, '_, f64, B>,
    matrix: &Matrix<'_>,
    pairs: RoomPairs<'_>,
) -> Result<f64, RoomError> {
    let room = polynomials.room();
    let (cells, found) = (room.table().len(), matrix.cells());
    if cells != found {
        return Err(RoomError::Length {
            expected: cells,
            found,
        });
    }
    let points = |i: usize| {
        let places = [0.112_701_665_379_258_3, 0.5, 0.887_298_334_620_741_7].into_iter();
        places.filter_map(move |t| room.inside(i, t))
    };
    let radius = fredholm_core::galerkin::second_moment_radius(
        polynomials,
        &matrix.coefficients(),
        &pairs,
        points,
        |x, j| {
            let k = room.kernel(&x.point, &x.point);
            k * k * room.survival() * room.form_factor(&x.point, j)
        },
    )?;
    Ok(radius)
}

impl Matrix<'_> {
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
        if self.cells() != mesh.len() {
            return Err(RoomError::Length {
                expected: mesh.len(),
                found: self.cells(),
            });
        }
        // (nB)² numbers are there, so that nB is one. F is constant on walls.
        let mut source = buffer(mesh.len() * self.functions())?;
        for (source, &wall) in source.iter_mut().step_by(self.functions()).zip(&mesh.walls) {
            let wall = scene.walls.get(wall as usize);
            *source = wall.map_or(f64::NAN, |w| w.emission);
        }
        let coefficients = self.coefficients();
        Ok(Solution::new(&coefficients, source, tolerance, at_most)?)
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
        for (expected, found) in [
            (mesh.len(), self.cells()),
            (scene.walls.len(), colours.walls()),
        ] {
            if expected != found {
                return Err(RoomError::Length { expected, found });
            }
        }
        let mut all = reserve(colours.channels())?;
        let mut shares: Vec<f64> = buffer(mesh.len())?;
        for channel in 0..colours.channels() {
            let mut source = buffer(mesh.len() * self.functions())?;
            let sources = source.iter_mut().step_by(self.functions());
            for ((share, source), &wall) in shares.iter_mut().zip(sources).zip(&mesh.walls) {
                let of = |own: &[f64]| own.get(channel).copied().unwrap_or(f64::NAN);
                let wall = wall as usize;
                let most = scene.walls.get(wall).map_or(f64::NAN, |w| w.reflectance);
                let reflectance = of(colours.reflectances(wall));
                // Of a black wall all coefficients are 0.
                *share = if most == 0.0 { 0.0 } else { reflectance / most };
                *source = of(colours.emissions(wall));
            }
            let coefficients = Shares {
                of: self.coefficients(),
                shares: &shares,
            };
            all.push(Solution::new(&coefficients, source, tolerance, at_most)?);
        }
        Ok(all)
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
