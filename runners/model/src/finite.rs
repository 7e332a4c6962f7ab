//! Refusals of walks of infinite variance, the same for all kinds.

use fredholm_core::galerkin::{Cells, collatz_wielandt_bounds};
use fredholm_core::{Absorption, DefaultGenerator, Equation, RngUniforms, Uniforms, WalkSeeds};

use crate::Error;
use crate::numbers::dot;

/// The most powers of a matrix that are looked at.
const POWERS: u32 = 100;
/// The most powers of a matrix of steps, and steps from each of its cells.
const POWERS_OF_STEPS: u32 = 200;
const STEPS: usize = 512;

/// Refuses plain walks unless the spectral radius of T_k²p is below 1; `of` is what it depends on.
///
/// # Errors
/// [`Error::InfiniteVariance`], or what `radius` says.
pub fn check_plain(
    of: &str,
    absorption: Absorption,
    radius: impl FnOnce() -> Result<f64, Error>,
) -> Result<(), Error> {
    refuse(|| of.to_owned(), absorption, radius()?)
}

/// Refuses walks unless a spectral radius is below 1; `of` is what it depends on.
///
/// # Errors
/// [`Error::InfiniteVariance`].
pub fn refuse(
    of: impl FnOnce() -> String,
    absorption: Absorption,
    radius: f64,
) -> Result<(), Error> {
    // By roulette weights above 1 are not thinned out.
    let radius = radius / (1.0 - absorption.probability().unwrap_or(0.0));
    if radius < 1.0 {
        return Ok(());
    }
    Err(Error::InfiniteVariance {
        of: of(),
        radius,
        absorption: absorption.probability(),
    })
}

/// The spectral radius of a matrix of so many rows without negative entries, from above.
#[must_use]
pub fn radius_above(rows: usize, entries: &[f64]) -> f64 {
    let (mut w, mut next) = (vec![1.0; rows], vec![0.0; rows]);
    let mut apply = |w: &[f64], out: &mut [f64]| {
        for (out, row) in out.iter_mut().zip(entries.chunks_exact(rows)) {
            *out = dot(row, w);
        }
    };
    let [_, upper] = collatz_wielandt_bounds(&mut apply, &mut w, &mut next, POWERS);
    upper
}

/// The spectral radius of T with k to a power, estimated by steps from the cells of an equation.
pub fn radius_by_steps<E>(equation: &E, power: i32) -> f64
where
    E: Equation<Scalar = f64, Value = f64> + Cells,
{
    let seeds = WalkSeeds::<DefaultGenerator>::new(1, u64::MAX);
    let steps = (0..equation.cells()).map(|cell| {
        let mut draws = RngUniforms(seeds.generator(cell as u64));
        let mut to = Vec::with_capacity(STEPS);
        for _ in 0..STEPS {
            let t: Vec<f64> = (0..E::DIMENSION).map(|_| draws.uniform()).collect();
            let x = equation.point(cell, &t);
            if let Some(y) = equation.step(&x, &mut draws) {
                let k = equation.kernel(&x, &y).powi(power);
                to.push((equation.locate(&y), k / STEPS as f64));
            }
        }
        to
    });
    let steps: Vec<Vec<(usize, f64)>> = steps.collect();
    let mut apply = |w: &[f64], out: &mut [f64]| {
        for (out, steps) in out.iter_mut().zip(&steps) {
            *out = steps.iter().map(|&(j, weight)| weight * w[j]).sum();
        }
    };
    let (mut w, mut next) = (vec![1.0; steps.len()], vec![0.0; steps.len()]);
    let [_, upper] = collatz_wielandt_bounds(&mut apply, &mut w, &mut next, POWERS_OF_STEPS);
    upper
}
