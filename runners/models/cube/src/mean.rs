//! Means of functions, where they are known.

use fredholm_cube::{Cube, CubeRule};

use fredholm_model::Error;

/// The mean of a function, if two quadrature rules agree on it.
pub(super) fn mean_of<const D: usize>(
    function: &dyn Fn(&[f64; D]) -> f64,
) -> Result<Option<f64>, Error> {
    let cells = match D {
        1 => [200, 300],
        2 => [12, 18],
        3 => [4, 6],
        4 => [2, 3],
        _ => [1, 2],
    };
    let [coarse, fine] = cells.map(|per_axis| mean(function, per_axis));
    let (coarse, fine) = (coarse?, fine?);
    let agree = (coarse - fine).abs() <= 1e-12 * fine.abs().max(1e-300);
    Ok(agree.then_some(fine))
}

/// The mean of a function by a rule of five points per axis of so many cells.
pub(super) fn mean<const D: usize>(
    function: &dyn Fn(&[f64; D]) -> f64,
    per_axis: usize,
) -> Result<f64, Error> {
    let cube = Cube::<f64, D, _, _>::new(|_: &[f64; D], _: &[f64; D]| 0.0, function, per_axis)?;
    let means = CubeRule::new(&cube, 0, 5)?.means(&function)?;
    Ok(means.iter().sum::<f64>() / means.len() as f64)
}
