//! Spectral radii, and whether walks have a finite variance.

use fredholm_core::galerkin::{Cells as _, collatz_wielandt_bounds};
use fredholm_core::{
    Absorption, Chain as _, DefaultGenerator, Equation as _, RngUniforms, Uniforms, WalkSeeds,
};
use fredholm_model::Error;
use fredholm_scene::{CellTables, Cells, Radiosity, Scene, Tables};

/// Cells enough to estimate a spectral radius.
const COARSE: usize = 300;
/// Rays from each of them.
const RAYS: usize = 512;
/// Powers of the matrix.
const POWERS: u32 = 200;

/// The spectral radius of T with k to a power: no more than that of the largest ρ, or, where it is not below a limit, estimated by
/// rays from few cells.
pub(crate) fn radius(scene: &Scene, power: i32, limit: f64) -> Result<f64, Error> {
    let faces = scene.faces().iter();
    let largest = faces.fold(0.0, |m: f64, face| m.max(face.reflectance));
    let bound = largest.powi(power);
    if bound < limit {
        return Ok(bound);
    }
    let (tables, cells) = (Tables::<f64>::new(scene), Cells::new(scene, COARSE)?);
    // Nothing comes back from a sky.
    let of_faces = CellTables {
        sky_bands: &[],
        sky_emissions: &[],
        ..cells.tables()
    };
    let radiosity = Radiosity::of_tables(tables.geometry(), of_faces)?;
    let rays: Vec<Vec<(usize, f64)>> = (0..radiosity.cells())
        .map(|cell| rays(&radiosity, cell, power))
        .collect();
    let mut apply = |w: &[f64], out: &mut [f64]| {
        for (out, rays) in out.iter_mut().zip(&rays) {
            *out = rays.iter().map(|&(j, weight)| weight * w[j]).sum();
        }
    };
    let (mut w, mut next) = (vec![1.0; rays.len()], vec![0.0; rays.len()]);
    let [_, high] = collatz_wielandt_bounds(&mut apply, &mut w, &mut next, POWERS);
    Ok(high.min(bound))
}

/// Refuses walks of infinite variance: with constant absorption. By roulette weights are never above 1, and something of every
/// scene absorbs.
///
/// # Errors
/// [`Error::InfiniteVariance`].
pub(crate) fn check_variance(scene: &Scene, absorption: Absorption) -> Result<(), Error> {
    let Some(q) = absorption.probability() else {
        return Ok(());
    };
    fredholm_model::finite::check_plain("reflectance²/(1 − absorption)", absorption, || {
        radius(scene, 2, 1.0 - q)
    })
}

/// The cells to which rays from a cell lead, each with the power of k over the number of rays.
fn rays(radiosity: &Radiosity<'_, f64>, cell: usize, power: i32) -> Vec<(usize, f64)> {
    let seeds = WalkSeeds::<DefaultGenerator>::new(1, u64::MAX);
    let mut draws = RngUniforms(seeds.generator(cell as u64));
    let mut to = Vec::with_capacity(RAYS);
    for _ in 0..RAYS {
        let t: [f64; 2] = [draws.uniform(), draws.uniform()];
        let x = radiosity.point(cell, &t);
        if let Some(y) = radiosity.step(&x, &mut draws) {
            let k = radiosity.kernel(&x, &y).powi(power);
            to.push((radiosity.locate(&y), k / RAYS as f64));
        }
    }
    to
}
