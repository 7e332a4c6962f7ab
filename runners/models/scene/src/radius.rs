//! Whether walks have a finite variance.

use fredholm_core::galerkin::{CellMap, Partition, collatz_wielandt_bounds};
use fredholm_core::{DefaultGenerator, Kernel, RngUniforms, Sampler, Uniforms, WalkSeeds};
use fredholm_model::Error;
use fredholm_scene::{Cells, Radiosity, Scene, Tables};

/// Cells enough to estimate a spectral radius.
const COARSE: usize = 300;
/// Rays from each of them.
const RAYS: usize = 512;
/// Powers of the matrix.
const POWERS: u32 = 200;

/// The spectral radius of T_k²p: no more than ρ²/(1 − q0) of the largest ρ, or, where that is 1 or more, estimated by rays
/// from few cells.
pub(crate) fn second_moment_radius(scene: &Scene, absorption: f64) -> Result<f64, Error> {
    let largest = largest_reflectance(scene);
    let bound = largest * largest / (1.0 - absorption);
    if bound < 1.0 {
        return Ok(bound);
    }
    let high = estimated(scene, absorption, |k| k * k)?;
    Ok(high.min(bound))
}

/// Refuses plain walks of infinite variance.
///
/// # Errors
/// [`Error::InfiniteVariance`].
pub(crate) fn check_plain_variance(scene: &Scene, absorption: f64) -> Result<(), Error> {
    fredholm_model::finite::check_plain("reflectance²/(1 − absorption)", absorption, || {
        second_moment_radius(scene, absorption)
    })
}

/// The spectral radius of T_K: no more than the largest ρ, or, where that is 1, estimated by rays from few cells.
pub(crate) fn radius(scene: &Scene) -> Result<f64, Error> {
    let largest = largest_reflectance(scene);
    if largest < 1.0 {
        return Ok(largest);
    }
    // K = (1 − q0) k, whatever q0.
    estimated(scene, 0.5, |k| k)
}

fn largest_reflectance(scene: &Scene) -> f64 {
    let faces = scene.faces().iter();
    faces.fold(0.0, |m: f64, face| m.max(face.reflectance))
}

/// The spectral radius of (1 − q0) p times a function of k.
fn estimated(scene: &Scene, absorption: f64, of_k: fn(f64) -> f64) -> Result<f64, Error> {
    let (tables, cells) = (Tables::<f64>::new(scene), Cells::new(scene, COARSE)?);
    // Nothing comes back from a sky.
    let radiosity = Radiosity::new(tables.geometry(), &cells, absorption)?.with_sky(&[], &[]);
    let rays: Vec<Vec<(usize, f64)>> = (0..radiosity.cells())
        .map(|cell| rays(&radiosity, cell, of_k))
        .collect();
    let mut apply = |w: &[f64], out: &mut [f64]| {
        for (out, rays) in out.iter_mut().zip(&rays) {
            *out = rays.iter().map(|&(j, weight)| weight * w[j]).sum();
        }
    };
    let (mut w, mut next) = (vec![1.0; rays.len()], vec![0.0; rays.len()]);
    let [_, high] = collatz_wielandt_bounds(&mut apply, &mut w, &mut next, POWERS);
    Ok(high)
}

/// The cells to which rays from a cell lead, each with (1 − q0) times the function of k over the number of rays.
fn rays(radiosity: &Radiosity<'_, f64>, cell: usize, of_k: fn(f64) -> f64) -> Vec<(usize, f64)> {
    let seeds = WalkSeeds::<DefaultGenerator>::new(1, u64::MAX);
    let mut draws = RngUniforms(seeds.generator(cell as u64));
    let mut to = Vec::with_capacity(RAYS);
    for _ in 0..RAYS {
        let t: [f64; 2] = [draws.uniform(), draws.uniform()];
        let x = radiosity.point(cell, &t);
        let survival = 1.0 - radiosity.absorption(&x);
        if let Some(y) = radiosity.step(&x, &mut draws) {
            let k = radiosity.kernel(&x, &y);
            to.push((radiosity.locate(&y), survival * of_k(k) / RAYS as f64));
        }
    }
    to
}
