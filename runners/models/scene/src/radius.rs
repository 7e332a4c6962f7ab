//! Spectral radii, and whether walks have a finite variance.

use fredholm_core::Absorption;
use fredholm_model::Error;
use fredholm_model::finite::{check_plain, radius_by_steps};
use fredholm_scene::{CellTables, Cells, Radiosity, Scene, Tables};

/// Cells enough to estimate a spectral radius.
const COARSE: usize = 300;

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
    Ok(radius_by_steps(&radiosity, power).min(bound))
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
    check_plain("reflectance²/(1 − absorption)", absorption, || {
        radius(scene, 2, 1.0 - q)
    })
}
