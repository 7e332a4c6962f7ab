//! The whole deterministic part in one call.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::galerkin::{
    Pairs, Solve, Sweeps, contraction, gauss_seidel, neighbour_source, radius_bounds,
};

use crate::{Matrix, Mesh, RoomError, Scene};

/// A vector of `length` zeros, or an error in place of an abort.
pub(crate) fn buffer<T: Clone + Default>(length: usize) -> Result<Vec<T>, RoomError> {
    let mut buffer = Vec::new();
    buffer
        .try_reserve_exact(length)
        .map_err(|_| RoomError::Memory {
            bytes: length.checked_mul(size_of::<T>()),
        })?;
    buffer.resize(length, T::default());
    Ok(buffer)
}

/// The same numbers in the walk's scalar.
///
/// # Errors
/// [`RoomError::Memory`].
pub fn rounded<F: Real>(values: &[f64]) -> Result<Vec<F>, RoomError> {
    let mut out = buffer(values.len())?;
    for (out, &value) in out.iter_mut().zip(values) {
        *out = F::from_f64(value);
    }
    Ok(out)
}

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
    matrix: &Matrix,
    absorption: f64,
) -> Result<f64, RoomError> {
    let n = matrix.cells();
    let (mut w, mut next) = (buffer(n)?, buffer(n)?);
    w.fill(1.0);
    let apply = |w: &[f64], out: &mut [f64]| {
        let rows = matrix.entries().chunks_exact(n.max(1));
        for ((out, row), &wall) in out.iter_mut().zip(rows).zip(&mesh.walls) {
            let sum: f64 = row.iter().zip(w).map(|(k, w)| k * w).sum();
            let wall = scene.walls.get(wall as usize);
            *out = sum * wall.map_or(f64::NAN, |w| w.reflectance) / (1.0 - absorption);
        }
    };
    let [_, upper] = radius_bounds(apply, &mut w, &mut next, 100);
    Ok(upper)
}

/// The Galerkin solution of a room, computed in f64.
#[derive(Clone, Debug)]
pub struct Solution {
    /// v_i.
    pub v: Vec<f64>,
    /// How the iteration went.
    pub solve: Solve<f64>,
    /// The largest Σ_j |K'_ij|.
    pub contraction: f64,
}

impl Solution {
    /// Solves (41) by Gauss–Seidel sweeps until no residual is above `tolerance` times the largest
    /// |F'_i|, at most `at_most` sweeps.
    ///
    /// # Errors
    /// [`RoomError::Memory`], [`RoomError::Galerkin`]; [`RoomError::Length`] where the matrix is
    /// not of this mesh.
    pub fn new(
        scene: &Scene,
        mesh: &Mesh,
        matrix: &Matrix,
        tolerance: f64,
        at_most: u32,
    ) -> Result<Self, RoomError> {
        if matrix.cells() != mesh.len() {
            return Err(RoomError::Length {
                expected: mesh.len(),
                found: matrix.cells(),
            });
        }
        let coefficients = matrix.coefficients();
        let contraction = contraction::<_, 1>(&coefficients)?;
        let mut source = buffer(mesh.len())?;
        for (source, &wall) in source.iter_mut().zip(&mesh.walls) {
            *source = scene
                .walls
                .get(wall as usize)
                .map_or(f64::NAN, |w| w.emission);
        }
        let largest = source.iter().fold(0.0, |m: f64, f| Real::max(m, f.abs()));
        // F' is a good start: the reflected light is missing.
        let mut v = source.clone();
        let sweeps = Sweeps::UntilResidual {
            residual: tolerance * largest,
            at_most,
        };
        let solve = gauss_seidel::<_, 1>(&coefficients, &source, &mut v, sweeps)?;
        Ok(Self {
            v,
            solve,
            contraction,
        })
    }

    /// v in the walk's scalar.
    ///
    /// # Errors
    /// [`RoomError::Memory`].
    pub fn rounded<F: Real>(&self) -> Result<Vec<F>, RoomError> {
        rounded(&self.v)
    }

    /// G over S for these pairs in the walk's scalar, from v as rounded to it.
    ///
    /// # Errors
    /// [`RoomError::Memory`], [`RoomError::Galerkin`]: the matrix is of another mesh.
    pub fn source<F: Real>(
        &self,
        matrix: &Matrix,
        pairs: &impl Pairs,
    ) -> Result<Vec<F>, RoomError> {
        let mut wide = buffer(self.v.len())?;
        for (wide, &v) in wide.iter_mut().zip(&self.v) {
            *wide = F::from_f64(v).to_f64();
        }
        let mut g = buffer(self.v.len())?;
        neighbour_source::<_, _, 1>(&matrix.coefficients(), pairs, &wide, &mut g)?;
        rounded(&g)
    }
}
